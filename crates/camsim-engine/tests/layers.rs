//! Blended surfaces: the gpu and the reference renderer against closed forms and against each other.

mod common;

use std::sync::Arc;

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Auto, Channel, MountSpec, Preset},
    scene::{Encoding, Light, Mesh, MeshVertex, Scene, Texture, Wrap},
    sequence::Sequence,
};
use camsim_engine::Engine;
use camsim_io::gltf_file::{GltfOptions, read_gltf};
use camsim_plan::FramePlan;
use common::{gpu_engine, pattern, render, scenario, sequence, steady};
use glam::{DMat3, DVec3};

const WALL: DVec3 = DVec3::new(0.9, 0.8, 0.1);
const RED: DVec3 = DVec3::new(0.8, 0.1, 0.0);
const BLUE: DVec3 = DVec3::new(0.1, 0.3, 0.9);
const SKY: DVec3 = DVec3::new(0.1, 0.15, 0.4);
/// Of the camera.
const HEIGHT_M: f64 = 100.0;

/// A level square with a side of 40 m that looks up, so high above the ground.
fn level(color: DVec3, alpha: f32, height_m: f64) -> Mesh {
    let [r, g, b] = color.as_vec3().to_array();
    let corner = |n: f32, e: f32| MeshVertex {
        tint: [r, g, b, alpha],
        ..MeshVertex::new([20.0 * n, 20.0 * e, 0.0], [e, -n])
    };
    let vertices = vec![corner(1.0, -1.0), corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
    let texture = Arc::new(Texture::uniform([255; 4], Encoding::Linear));
    let mut mesh =
        Mesh::new(vertices, vec![0, 1, 2, 0, 2, 3], texture, DVec3::new(0.0, 0.0, -height_m), Wrap::Repeat);
    Arc::make_mut(&mut mesh.shape).normals = vec![[0.0, 0.0, -1.0]; 4];
    mesh
}

fn mixed(mesh: Mesh) -> Mesh {
    let mut mesh = mesh;
    (mesh.material.blends, mesh.material.cutoff) = (true, Some(0.5));
    mesh
}

fn pane(color: DVec3, alpha: f32, height_m: f64) -> Mesh {
    mixed(level(color, alpha, height_m))
}

fn over(front: DVec3, alpha: f64, behind: DVec3) -> DVec3 {
    alpha * front + (1.0 - alpha) * behind
}

fn seen_from_above(scene: Scene, velocity_ned_m_s: DVec3) -> Arc<Sequence> {
    let mut scenario = scenario();
    scenario.camera.size_px = [160, 120];
    scenario.camera.focal_px = [200.0, 200.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    scenario.camera.shutter.readout_ms = if velocity_ned_m_s == DVec3::ZERO { 0.0 } else { 60.0 };
    scenario.quality.max_error_dn = 0.5;
    let scene = Scene { sky_linear: SKY.as_vec3().to_array(), ..scene };
    sequence(scenario, steady(HEIGHT_M, 0.0, velocity_ned_m_s, DVec3::ZERO), scene)
}

/// Of the device and of the reference.
struct Pictures {
    colors: [Vec<f32>; 2],
    depths_m: [Vec<f32>; 2],
    plan: FramePlan,
}

/// Of the renderer, gpu or cpu, that is farther from the reference.
fn pictures(sequence: &Arc<Sequence>) -> Pictures {
    let channels = [Channel::Color, Channel::Depth];
    let options =
        RenderOptions { channels: channels.to_vec(), tolerance_dn: 0.25, ..RenderOptions::default() };
    let truth = ReferenceRenderer::new(sequence.clone()).expect("a reference").render(0, &options);
    let by = |engine: &Engine| {
        let done = render(engine, sequence, &channels, 0);
        let depths_m = [&done.frame, &truth].map(|frame| frame.depth_m().expect("depth").to_vec());
        Pictures { colors: [done.frame.into_color(), truth.color_rgba().to_vec()], depths_m, plan: done.plan }
    };
    let both = [by(&gpu_engine()), by(&Engine::cpu())];
    both.into_iter().min_by(|a, b| a.psnr_db().total_cmp(&b.psnr_db())).expect("two")
}

fn standing(meshes: Vec<Mesh>) -> Arc<Sequence> {
    seen_from_above(Scene { meshes, ..Scene::default() }, DVec3::ZERO)
}

impl Pictures {
    fn psnr_db(&self) -> f64 {
        let [a, b] = &self.colors;
        let squares: f64 = a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum();
        -10.0 * (squares / a.len() as f64).log10()
    }

    /// In the middle; half precision is 1/2048 of a value, for each layer.
    fn expect_in_the_middle(&self, name: &str, expected: DVec3, depth_m: f64) {
        for (k, who) in ["device", "reference"].into_iter().enumerate() {
            let (at, picture) = (60 * 160 + 80, &self.colors[k]);
            let found =
                DVec3::from_array([0, 1, 2].map(|channel: usize| f64::from(picture[4 * at + channel])));
            assert!(
                (found - expected).abs().max_element() < 1e-3,
                "{name}, {who}: {found} instead of {expected}"
            );
            let depth = f64::from(self.depths_m[k][at]);
            assert!((depth - depth_m).abs() < 1e-3, "{name}, {who}: {depth} m instead of {depth_m}");
        }
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn two_panes_over_a_wall_match_closed_form() {
    for (heights, alphas, depth_m) in [
        ([20.0, 40.0], [0.3, 0.6], 60.0),
        ([40.0, 20.0], [0.3, 0.6], 80.0),
        ([40.0, 20.0], [0.25, 0.4], 100.0),
    ] {
        let panes = [pane(RED, alphas[0], heights[0]), pane(BLUE, alphas[1], heights[1])];
        let [a, b] = [(RED, f64::from(alphas[0])), (BLUE, f64::from(alphas[1]))];
        let (front, behind) = if heights[0] > heights[1] { (a, b) } else { (b, a) };
        let expected = over(front.0, front.1, over(behind.0, behind.1, WALL));
        for order in [[0, 1, 2], [2, 1, 0]] {
            let all = [level(WALL, 1.0, 0.0), panes[0].clone(), panes[1].clone()];
            let found = pictures(&standing(order.map(|k: usize| all[k].clone()).to_vec()));
            found.expect_in_the_middle(&format!("{heights:?} {alphas:?} {order:?}"), expected, depth_m);
        }
    }
    // The same wall and panes, and a roof above all: the camera looks at its upper side, and no pane is seen.
    let roofed = vec![level(WALL, 1.0, 50.0), pane(RED, 0.6, 40.0), pane(BLUE, 0.3, 20.0)];
    pictures(&standing(roofed)).expect_in_the_middle("hidden", WALL, 50.0);
    let before_sky = pictures(&standing(vec![pane(RED, 0.25, 40.0)]));
    before_sky.expect_in_the_middle("before the sky", over(RED, 0.25, SKY), 0.0);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn blending_with_light_fog_and_emission() {
    let light = Light::new(2.3, 0.6, 0.7, 0.3);
    let up = 0.7 * 0.6_f64.sin() + 0.3;
    let mut shining = pane(RED, 0.4, 40.0);
    shining.material.emissive = [0.1, 0.2, 0.05];
    let meshes = vec![shining.clone(), level(WALL, 1.0, 0.0)];
    let own = DVec3::new(0.1, 0.2, 0.05);
    let lit = Scene { meshes: meshes.clone(), light: Some(light), ..Scene::default() };
    let found = pictures(&seen_from_above(lit, DVec3::ZERO));
    found.expect_in_the_middle("lit", over(up * RED + own, 0.4, up * WALL), 100.0);
    let foggy = Scene { meshes, fog_visibility_m: Some(200.0), ..Scene::default() };
    let air = |color: DVec3, path_m: f64| SKY + (-3.912 * path_m / 200.0_f64).exp() * (color - SKY);
    let found = pictures(&seen_from_above(foggy, DVec3::ZERO));
    found.expect_in_the_middle("fog", air(over(RED + own, 0.4, air(WALL, 40.0)), 60.0), 100.0);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn paper_preset_blends() {
    let mut sequence = standing(vec![pane(RED, 0.3, 40.0), level(WALL, 1.0, 0.0)]);
    Arc::make_mut(&mut sequence).scenario.quality.preset = Preset::Paper;
    let found = render(&gpu_engine(), &sequence, &[Channel::Color], 0).frame.into_color();
    let at = 4 * (60 * 160 + 80);
    let found = DVec3::from_array([0, 1, 2].map(|channel: usize| f64::from(found[at + channel])));
    // Stored with 8 bits of sRGB, whose widest step is 0.009 of light, once for the wall and once for the
    // pane.
    assert!((found - over(RED, 0.3, WALL)).abs().max_element() < 9e-3, "{found}");
}

/// A disc of alpha over a picture that changes smoothly.
fn disc() -> Texture {
    let side = 64;
    let rgba8 = (0..side * side).flat_map(|i| {
        let [x, y] = [i % side, i / side].map(|k| (f64::from(k) + 0.5) / f64::from(side));
        let far = ((x - 0.4).powi(2) + (y - 0.55).powi(2)).sqrt();
        [
            60.0 + 150.0 * x,
            200.0 - 140.0 * y,
            90.0 + 80.0 * (6.0 * x).sin(),
            255.0 * (1.5 - 3.0 * far).clamp(0.0, 1.0),
        ]
        .map(|v| v as u8)
    });
    Texture { size_px: [side, side], rgba8: rgba8.collect(), encoding: Encoding::Linear }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn textures_tints_and_cutouts_blend_as_in_the_reference() {
    let textured = |height_m: f64| {
        let mut mesh = level(DVec3::ONE, 1.0, height_m);
        mesh.material.texture = Arc::new(disc());
        mesh.origin_ned_m += DVec3::new(3.0, -2.0, 0.0);
        mesh
    };
    let ground = || pattern(400.0).meshes;
    let mut tinted = pane(DVec3::ONE, 1.0, 30.0);
    let corners = [[1.0, 0.2, 0.1, 0.2], [0.1, 1.0, 0.3, 0.9], [0.2, 0.1, 1.0, 0.4], [0.5, 0.5, 0.5, 0.0]];
    Arc::make_mut(&mut tinted.shape)
        .vertices
        .iter_mut()
        .zip(corners)
        .for_each(|(vertex, tint)| vertex.tint = tint);
    let mut holed = textured(45.0);
    holed.material.cutoff = Some(0.5);
    let small =
        Mesh { ned_from_shape: DMat3::from_diagonal(DVec3::new(0.2, 0.2, 1.0)), ..mixed(textured(60.0)) };
    let sharp = {
        let mut mesh = mixed(textured(20.0));
        mesh.material.nearest = true;
        mesh
    };
    for (name, meshes, least_db) in [
        ("alpha in the picture", vec![mixed(textured(40.0))], 50.0),
        ("sharp texels", vec![sharp], 50.0),
        ("made smaller", vec![small], 45.0),
        ("alpha of corners", vec![tinted.clone()], 50.0),
        ("a masked sheet between two that are mixed", vec![tinted, holed, pane(BLUE, 0.3, 55.0)], 45.0),
    ] {
        let found = pictures(&standing([ground(), meshes].concat()));
        let [a, b] = &found.depths_m;
        let other = a.iter().zip(b).filter(|(a, b)| (**a - **b).abs() > 1e-3 * b.abs()).count();
        eprintln!("{name}: {:.1} dB, {other} depths of another surface", found.psnr_db());
        assert!(found.psnr_db() > least_db && other < 20, "{name}: {} dB, {other}", found.psnr_db());
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn many_copies_are_drawn_back_to_front() {
    // Tilted alike, each in a slab of its own: none cross, and their middles tell nothing of their order.
    let tilt = DMat3::from_rotation_x(0.6) * DMat3::from_rotation_y(-0.4);
    let part = |k: u32, step: f64| (f64::from(k) * step).fract() - 0.5;
    let one = pane(RED, 0.3, 0.0);
    let copies = (0..60).map(|k| {
        let size = 0.1 * 12_f64.powf(part(k, 0.618_034) + 0.5);
        let mut copy = Mesh {
            ned_from_shape: tilt * DMat3::from_diagonal(DVec3::new(size, size, 1.0)),
            origin_ned_m: tilt
                * DVec3::new(50.0 * part(k, 0.754_878), 60.0 * part(k, 0.569_84), -0.7 * f64::from(k) + 10.0),
            ..one.clone()
        };
        if k % 3 > 0 {
            copy.shape = pane([BLUE, DVec3::ONE][k as usize % 2], 0.45, 0.0).shape;
        }
        copy
    });
    let found = pictures(&standing([pattern(400.0).meshes, copies.collect()].concat()));
    eprintln!("60 panes: {:.1} dB, {:?}", found.psnr_db(), found.plan.predicted.blended_depth);
    assert!(found.psnr_db() > 40.0, "{}", found.psnr_db());
    // What is left is at their borders, which the plan knows of.
    let measured_dn = 255.0 * 10_f64.powf(-found.psnr_db() / 20.0) * (4.0_f64 / 3.0).sqrt();
    let predicted_dn = found.plan.predicted.picture_dn();
    assert!(measured_dn < 1.5 * predicted_dn, "{measured_dn} of {predicted_dn}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn error_of_one_depth_per_pixel_is_predicted() {
    let mut checkered = pane(RED, 0.45, 30.0);
    checkered.ned_from_shape = DMat3::from_diagonal(DVec3::new(4.0, 4.0, 1.0));
    let rgba8 =
        (0..32 * 32).flat_map(|i| [255, 255, 255, if (i % 32 / 8 + i / 32 / 8) % 2 == 0 { 40 } else { 255 }]);
    checkered.material.texture =
        Arc::new(Texture { size_px: [32, 32], rgba8: rgba8.collect(), encoding: Encoding::Linear });
    let mut errors = Vec::new();
    for (speed_m_s, keys) in [(0.0, Auto::Auto), (60.0, Auto::Value(1)), (60.0, Auto::Auto)] {
        let scene =
            Scene { meshes: [pattern(400.0).meshes, vec![checkered.clone()]].concat(), ..Scene::default() };
        let mut sequence = seen_from_above(scene, DVec3::new(0.0, speed_m_s, 0.0));
        Arc::make_mut(&mut sequence).scenario.quality.key_frames = keys;
        let found = pictures(&sequence);
        let measured_dn = 255.0 * 10_f64.powf(-found.psnr_db() / 20.0) * (4.0_f64 / 3.0).sqrt();
        let predicted = &found.plan.predicted;
        let count = found.plan.keys.len();
        eprintln!(
            "{speed_m_s} m/s, {count} keys: {measured_dn:.2}/255 measured, {:.2} predicted, {:?}",
            predicted.picture_dn(),
            predicted.blended_depth
        );
        assert!(measured_dn < 1.5 * predicted.picture_dn(), "{measured_dn} of {}", predicted.picture_dn());
        errors.push((
            measured_dn,
            predicted.blended_depth.expect("a pane").error_dn,
            predicted.picture_error_obstacle.clone(),
        ));
    }
    assert!(errors[0].1 < 1e-6 && errors[1].1 > 1.0 && errors[1].0 > 0.5 * errors[1].1, "{errors:?}");
    // More ideal frames, each for fewer rows.
    assert!(errors[2].0 < 0.6 * errors[1].0 && errors[2].1 < 0.6 * errors[1].1, "{errors:?}");
    assert!(errors[1].2.as_ref().is_some_and(|cause| cause.contains("blended")), "{errors:?}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn blending_test_model_matches_the_reference() {
    let Some(data) = std::env::var_os("CAMSIM_DATA") else {
        eprintln!("CAMSIM_DATA is not set: models of other people are not read");
        return;
    };
    let file =
        std::path::PathBuf::from(data).join("gltf/AlphaBlendModeTest/glTF-Binary/AlphaBlendModeTest.glb");
    let model = read_gltf(&file, GltfOptions::default()).expect("a model");
    assert_eq!(
        model.notes,
        ["colour is albedo alone: metallicRoughnessTexture, normalTexture and occlusionTexture are ignored"]
    );
    let ahead = DMat3::from_rotation_y(-std::f64::consts::FRAC_PI_2);
    let mut meshes: Vec<Mesh> = model.place(DVec3::ZERO, std::f64::consts::PI, 10.0).collect();
    // Lying on its back below the camera.
    meshes.iter_mut().for_each(|mesh| {
        mesh.ned_from_shape = ahead * mesh.ned_from_shape;
        mesh.origin_ned_m = ahead * mesh.origin_ned_m;
    });
    let found = pictures(&standing(meshes));
    let seen = found.depths_m[1].iter().filter(|depth| **depth > 0.0).count();
    eprintln!(
        "{:.1} dB, {seen} pixels of a surface, {:?}",
        found.psnr_db(),
        found.plan.predicted.blended_depth
    );
    assert!(found.psnr_db() > 38.0 && seen > 2000, "{} {seen}", found.psnr_db());
}
