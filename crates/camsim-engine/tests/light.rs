//! Sun and sky: the gpu and the reference renderer against closed forms and against each other.

mod common;

use std::sync::Arc;

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Channel, MountSpec},
    scene::{Encoding, Light, Mesh, MeshVertex, Scene, Shape, Terrain, Texture, Wrap},
    sequence::Sequence,
};
use camsim_engine::Engine;
use common::{gpu_engine, render, scenario, sequence, steady};
use glam::{DMat3, DQuat, DVec3};

const ALBEDO: [f64; 3] = [0.8, 0.6, 0.4];

fn sun() -> Light {
    Light::new(2.3, 0.6, 0.7, 0.3)
}

/// Light on a face, written out.
fn of_face(normal_ned: DVec3) -> f64 {
    let to_sun = DVec3::new(0.6_f64.cos() * 2.3_f64.cos(), 0.6_f64.cos() * 2.3_f64.sin(), -(0.6_f64.sin()));
    0.7 * normal_ned.dot(to_sun).max(0.0) + 0.3 * (1.0 - normal_ned.z) / 2.0
}

fn paint() -> Arc<Texture> {
    Arc::new(Texture::uniform([204, 153, 102, 255], Encoding::Linear))
}

/// A level square with a side of 60 m that turns anticlockwise as seen from above, and looks up.
fn square() -> Mesh {
    let corner = |n: f32, e: f32| MeshVertex::new([30.0 * n, 30.0 * e, 0.0], [e, -n]);
    let vertices = vec![corner(1.0, -1.0), corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
    let mut mesh = Mesh::new(vertices, vec![0, 1, 2, 0, 2, 3], paint(), DVec3::ZERO, Wrap::Repeat);
    Arc::make_mut(&mut mesh.shape).normals = vec![[0.0, 0.0, -1.0]; 4];
    mesh
}

fn seen_from_above(scene: Scene) -> Arc<Sequence> {
    let mut scenario = scenario();
    scenario.camera.size_px = [160, 120];
    scenario.camera.focal_px = [200.0, 200.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    scenario.quality.max_error_dn = 0.5;
    sequence(scenario, steady(100.0, 0.0, DVec3::ZERO, DVec3::ZERO), scene)
}

fn in_light(meshes: Vec<Mesh>, light: Option<Light>) -> Arc<Sequence> {
    seen_from_above(Scene { meshes, sky_linear: [0.1, 0.15, 0.4], light, ..Scene::default() })
}

/// The pictures of the renderer, gpu or cpu, that is farther from the reference, and of the reference, R G B A.
fn pictures(sequence: &Arc<Sequence>) -> [Vec<f32>; 2] {
    let channels = [Channel::Color];
    let options =
        RenderOptions { channels: channels.to_vec(), tolerance_dn: 0.25, ..RenderOptions::default() };
    let truth =
        ReferenceRenderer::new(sequence.clone()).expect("a reference").render(0, &options).into_color();
    let by = |engine: &Engine| [render(engine, sequence, &channels, 0).frame.into_color(), truth.clone()];
    let both = [by(&gpu_engine()), by(&Engine::cpu())];
    both.into_iter().min_by(|a, b| psnr_db(a).total_cmp(&psnr_db(b))).expect("two")
}

fn psnr_db([a, b]: &[Vec<f32>; 2]) -> f64 {
    let squares: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum();
    -10.0 * (squares / a.len() as f64).log10()
}

/// Checks the middle of the picture; half precision is 1/2048 of a value.
fn expect_in_the_middle(name: &str, mesh: Mesh, light: Option<Light>, expected: DVec3) {
    let both = pictures(&in_light(vec![mesh], light));
    for (who, picture) in ["device", "reference"].into_iter().zip(&both) {
        let at = 4 * (60 * 160 + 80);
        let found =
            DVec3::new(f64::from(picture[at]), f64::from(picture[at + 1]), f64::from(picture[at + 2]));
        assert!(
            (found - expected).abs().max_element() < 5e-4,
            "{name}, {who}: {found} instead of {expected}"
        );
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn lit_planes_match_closed_form() {
    let albedo = DVec3::from_array(ALBEDO);
    let up = DVec3::NEG_Z;
    let turn = |a: f64, b: f64| DMat3::from_quat(DQuat::from_rotation_z(a) * DQuat::from_rotation_x(b));
    let placed = |mesh: &Mesh, ned_from_shape: DMat3| Mesh { ned_from_shape, ..mesh.clone() };
    let level = square();
    expect_in_the_middle("level", level.clone(), Some(sun()), albedo * of_face(up));
    // One shape, several turns: each has its own light.
    for (a, b) in [(0.4, 0.5), (2.0, 0.5), (-1.3, 0.7)] {
        let matrix = turn(a, b);
        expect_in_the_middle(
            "turned",
            placed(&level, matrix * 1.3),
            Some(sun()),
            albedo * of_face(matrix * up),
        );
    }
    // From behind: the side that is seen counts.
    let behind = turn(0.4, std::f64::consts::PI + 0.5);
    let outward = behind * up;
    assert!(outward.z > 0.0);
    expect_in_the_middle("behind", placed(&level, behind), Some(sun()), albedo * of_face(-outward));
    // A shape that is tilted in its own axes, 30 m higher in the north, mirrored and stretched. Its triangles
    // are turned back.
    let mut tilted = level.clone();
    let shape = Arc::make_mut(&mut tilted.shape);
    shape.vertices.iter_mut().for_each(|vertex| vertex.position_m[2] = -0.5 * vertex.position_m[0]);
    let own = DVec3::new(-0.5, 0.0, -1.0).normalize();
    shape.normals = vec![own.as_vec3().to_array(); 4];
    let stretched = placed(&tilted, DMat3::from_diagonal(DVec3::new(1.0, 2.0, 3.0)));
    expect_in_the_middle(
        "stretched",
        stretched,
        Some(sun()),
        albedo * of_face(DVec3::new(-1.5, 0.0, -1.0).normalize()),
    );
    Arc::make_mut(&mut tilted.shape).indices = vec![0, 2, 1, 0, 3, 2];
    let mirrored = placed(&tilted, turn(0.3, 0.0) * DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)));
    let expected = turn(0.3, 0.0) * DVec3::new(0.5, 0.0, -1.0).normalize();
    expect_in_the_middle("mirrored", mirrored.clone(), Some(sun()), albedo * of_face(expected));
    let mut one_sided = mirrored;
    one_sided.material.one_sided = true;
    expect_in_the_middle("mirrored, one side", one_sided, Some(sun()), albedo * of_face(expected));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn tints_cutouts_and_emission_with_light() {
    let albedo = DVec3::from_array(ALBEDO);
    let mut mesh = square();
    mesh.material.emissive = [0.1, 0.05, 0.0];
    mesh.material.cutoff = Some(0.5);
    let shape = Arc::make_mut(&mut mesh.shape);
    shape.vertices.iter_mut().for_each(|vertex| vertex.tint = [0.5, 1.0, 0.25, 1.0]);
    // Normals that go apart: the middle is on the diagonal between the first corner and the third, and the
    // pixel's centre half a pixel (0.25 m) south and east of it.
    shape.normals = [[0.6, 0.0, -0.8], [0.0, 0.0, -1.0], [0.0, 0.6, -0.8], [0.0, 0.0, -1.0]].to_vec();
    let tint = DVec3::new(0.5, 1.0, 0.25);
    let expected =
        albedo * tint * of_face(DVec3::new(0.6, 0.0, -0.8).lerp(DVec3::new(0.0, 0.6, -0.8), 30.25 / 60.0))
            + DVec3::new(0.1, 0.05, 0.0);
    expect_in_the_middle("all", mesh.clone(), Some(sun()), expected);
    let both = pictures(&in_light(vec![mesh.clone()], Some(sun())));
    assert!(psnr_db(&both) > 55.0, "{}", psnr_db(&both));
    // Without normals, or without light, it is what it was.
    expect_in_the_middle("no light", mesh.clone(), None, albedo * tint + DVec3::new(0.1, 0.05, 0.0));
    let with_normals = pictures(&in_light(vec![mesh.clone()], None));
    Arc::make_mut(&mut mesh.shape).normals.clear();
    assert_eq!(pictures(&in_light(vec![mesh.clone()], Some(sun()))), with_normals);
    assert_eq!(pictures(&in_light(vec![mesh], None)), with_normals);
}

/// A sphere with smooth normals.
fn ball(n: u32) -> Shape {
    let at = |i: u32, j: u32| {
        let (around, down) = (
            std::f64::consts::TAU * f64::from(i) / f64::from(n),
            std::f64::consts::PI * f64::from(j) / f64::from(n),
        );
        DVec3::new(down.sin() * around.cos(), down.sin() * around.sin(), -down.cos()).as_vec3().to_array()
    };
    let corners: Vec<[f32; 3]> = (0..=n).flat_map(|j| (0..=n).map(move |i| at(i, j))).collect();
    let index = |i: u32, j: u32| j * (n + 1) + i;
    let cell = |i: u32, j: u32| {
        [index(i, j), index(i + 1, j + 1), index(i + 1, j), index(i, j), index(i, j + 1), index(i + 1, j + 1)]
    };
    Shape {
        vertices: corners
            .iter()
            .map(|corner| MeshVertex::new(corner.map(|part| 5.0 * part), [0.0; 2]))
            .collect(),
        indices: (0..n).flat_map(|j| (0..n).flat_map(move |i| cell(i, j))).collect(),
        normals: corners,
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn rotated_copies_with_light_match_the_reference() {
    let shape = Arc::new(ball(16));
    let place = |k: u32| {
        let part = |step: f64| (f64::from(k) * step).fract() - 0.5;
        let turn = DMat3::from_rotation_z(7.0 * part(0.31)) * DMat3::from_rotation_x(2.0 * part(0.47));
        let stretch = if k.is_multiple_of(3) { DVec3::new(1.0, 0.5, 1.5) } else { DVec3::ONE };
        Mesh {
            shape: shape.clone(),
            origin_ned_m: DVec3::new(60.0 * part(0.618_034), 80.0 * part(0.754_878), 20.0 * part(0.569_84)),
            ned_from_shape: turn * DMat3::from_diagonal(stretch) * (0.4 + 0.8 * part(0.83).abs()),
            ..square()
        }
    };
    let meshes: Vec<Mesh> = (0..90).map(place).collect();
    let [unlit, lit] = [None, Some(sun())].map(|light| psnr_db(&pictures(&in_light(meshes.clone(), light))));
    eprintln!("90 balls: {unlit:.1} dB without light, {lit:.1} dB with it");
    assert!(lit > 45.0 && lit > unlit - 1.0, "{lit} {unlit}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn lit_slope_matches_closed_form() {
    // 40 % up to the north, 30 % up to the east, seen with few triangles and many.
    let heights: Vec<f64> =
        (0..81 * 81).map(|k| 2.0 * (-0.4 * f64::from(k / 81) + 0.3 * f64::from(k % 81)) + 8.0).collect();
    let mut terrain = Terrain::from_heights(81, 81, 2.0, &heights, Some(paint())).expect("a terrain");
    terrain.bake_light(&sun());
    let sequence = seen_from_above(Scene { terrain: Some(terrain), light: Some(sun()), ..Scene::default() });
    let expected = DVec3::from_array(ALBEDO) * of_face(DVec3::new(-0.4, -0.3, -1.0).normalize());
    // The picture on the ground has 8 bits.
    for (who, picture) in ["device", "reference"].into_iter().zip(pictures(&sequence)) {
        for pixel in picture.chunks_exact(4).step_by(37) {
            let found = DVec3::new(f64::from(pixel[0]), f64::from(pixel[1]), f64::from(pixel[2]));
            assert!(
                (found - expected).abs().max_element() < 0.5 / 255.0 + 5e-4,
                "{who}: {found} instead of {expected}"
            );
        }
    }
}
