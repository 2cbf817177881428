//! Materials and placement of meshes: the gpu against the reference renderer, feature by feature.

mod common;

use std::sync::Arc;

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Channel, MountSpec},
    scene::{Encoding, Mesh, MeshVertex, Scene, Texture, Wrap},
};
use camsim_engine::Engine;
use common::{gpu_engine, render, scenario, sequence, steady};
use glam::{DMat3, DVec3};

/// From 100 m above: 0.5 m a pixel, north up.
const HEIGHT_M: f64 = 100.0;

/// A level square with a side of 40 m, its texture twice across and down; it turns anticlockwise as seen from
/// above.
fn square(texture: Texture) -> Mesh {
    let corner = |n: f32, e: f32| MeshVertex::new([20.0 * n, 20.0 * e, 0.0], [e, -n]);
    let vertices = vec![corner(1.0, -1.0), corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
    Mesh::new(vertices, vec![0, 1, 2, 0, 2, 3], Arc::new(texture), DVec3::ZERO, Wrap::Repeat)
}

/// Colours that change smoothly.
fn picture(side: u32) -> Texture {
    let mut texture = with_alpha(side);
    texture.rgba8.chunks_exact_mut(4).for_each(|pixel| pixel[3] = 255);
    texture
}

/// The same with a disc of alpha.
fn with_alpha(side: u32) -> Texture {
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

/// PSNR of the picture, of gpu or cpu, that is farther from the reference's, and the fraction of pixels whose depth is
/// another surface's.
fn compare(name: &str, meshes: Vec<Mesh>) -> (f64, f64) {
    let mut scenario = scenario();
    scenario.camera.size_px = [160, 120];
    scenario.camera.focal_px = [200.0, 200.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    scenario.quality.max_error_dn = 0.5;
    let scene = Scene { meshes, sky_linear: [0.1, 0.15, 0.4], ..Scene::default() };
    let sequence = sequence(scenario, steady(HEIGHT_M, 0.0, DVec3::ZERO, DVec3::ZERO), scene);
    let channels = [Channel::Color, Channel::Depth];
    let options =
        RenderOptions { channels: channels.to_vec(), tolerance_dn: 0.25, ..RenderOptions::default() };
    let truth = ReferenceRenderer::new(sequence.clone()).expect("a reference").render(0, &options);
    let exact = truth.depth_m().expect("depth");
    let seen = exact.iter().filter(|depth| **depth > 0.0).count() as f64 / exact.len() as f64;
    let psnr_db = [("gpu", gpu_engine()), ("cpu", Engine::cpu())].map(|(who, engine)| {
        let done = render(&engine, &sequence, &channels, 0).frame;
        let squares: f64 =
            done.color_rgba().iter().zip(truth.color_rgba()).map(|(a, b)| f64::from(a - b).powi(2)).sum();
        let psnr_db = -10.0 * (squares / done.color_rgba().len() as f64).log10();
        let found = done.depth_m().expect("depth");
        let differ = |(a, b): &(&f32, &f32)| (*a - *b).abs() > 1e-3 * b.abs().max(1.0);
        let other = found.iter().zip(exact).filter(differ).count() as f64 / found.len() as f64;
        eprintln!(
            "{name}, {who}: {psnr_db:.1} dB, {:.3} % of depths differ, {:.0} % of the picture",
            100.0 * other,
            100.0 * seen
        );
        assert!(other < 1e-3, "{name}, {who}: {other}");
        psnr_db
    });
    (psnr_db[0].min(psnr_db[1]), seen)
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn tints_samplers_and_emission() {
    let mut tinted = square(picture(64));
    for (vertex, tint) in Arc::make_mut(&mut tinted.shape).vertices.iter_mut().zip([
        [1.0, 0.2, 0.1, 1.0],
        [0.1, 1.0, 0.3, 1.0],
        [0.2, 0.1, 1.0, 1.0],
        [0.5; 4],
    ]) {
        vertex.tint = tint;
    }
    let mut bright = tinted.clone();
    bright.material.emissive = [0.2, 0.05, 0.0];
    let mut wraps = square(picture(64));
    wraps.material.wrap = [Wrap::Mirror, Wrap::Clamp];
    let mut nearest = square(picture(8));
    nearest.material.nearest = true;
    // What is left is the picture's own seam, where it begins again, and half precision.
    for (name, mesh) in
        [("tint", tinted), ("emissive", bright), ("mirrored and clamped", wraps), ("nearest", nearest)]
    {
        let (psnr_db, seen) = compare(name, vec![mesh]);
        assert!(psnr_db > 55.0 && seen > 0.25, "{name}: {psnr_db} dB, {seen}");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn single_sided_and_cutout_materials() {
    let mut front = square(picture(64));
    front.material.one_sided = true;
    let mut back = front.clone();
    back.ned_from_shape = DMat3::from_rotation_x(std::f64::consts::PI);
    let (psnr_db, seen) = compare("the side that is there", vec![front.clone()]);
    assert!(psnr_db > 55.0 && seen > 0.25, "{psnr_db} {seen}");
    assert_eq!(compare("the side that is not", vec![back]).1, 0.0);
    // A sheet with holes above another picture.
    let mut holes = square(with_alpha(64));
    holes.material.one_sided = true;
    holes.material.cutoff = Some(0.5);
    holes.origin_ned_m = DVec3::new(3.0, -2.0, -20.0);
    let (psnr_db, _) = compare("holes", vec![square(picture(64)), holes.clone()]);
    assert!(psnr_db > 50.0, "{psnr_db}");
    let (psnr_db, seen) = compare("holes before the sky", vec![holes]);
    assert!(psnr_db > 50.0 && (0.1..0.3).contains(&seen), "{psnr_db} {seen}");
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn rotated_and_scaled_instances() {
    let one = square(picture(64));
    let place = |k: u32| {
        let part = |step: f64| (f64::from(k) * step).fract() - 0.5;
        let turn = DMat3::from_rotation_z(7.0 * part(0.31)) * DMat3::from_rotation_x(2.0 * part(0.47));
        Mesh {
            origin_ned_m: DVec3::new(300.0 * part(0.618_034), 300.0 * part(0.754_878), 20.0 * part(0.569_84)),
            ned_from_shape: turn * (0.1 + 0.2 * part(0.83).abs()),
            ..one.clone()
        }
    };
    let (psnr_db, seen) = compare("400 of one shape", (0..400).map(place).collect());
    assert!(psnr_db > 42.0 && seen > 0.05, "{psnr_db} {seen}");
}
