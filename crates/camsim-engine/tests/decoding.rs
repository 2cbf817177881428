//! Textures are decoded from sRGB by IEC 61966-2-1.

mod common;

use std::sync::Arc;

use camsim_core::{
    scenario::{Channel, MountSpec},
    scene::{Encoding, Mesh, MeshVertex, Scene, Texture, Wrap},
};
use common::{engine, render, scenario, sequence, steady};
use glam::DVec3;

/// Half floats: 2^-12 of 1 for the picture on the device, 2^-11 for the ideal frame, which devices may cut
/// off; less of less.
const MOST: f64 = 7.4e-4;

/// All byte values, 16 by 16 sharp texels, on a level square with a side of 60 m.
fn chart() -> Mesh {
    let bytes = (0..=255_u8).flat_map(|byte| [byte, byte, byte, 255]).collect();
    let texture = Texture { size_px: [16, 16], rgba8: bytes, encoding: Encoding::Srgb };
    let corner = |n: f32, e: f32| MeshVertex::new([30.0 * n, 30.0 * e, 0.0], [0.5 + 0.5 * e, 0.5 - 0.5 * n]);
    let vertices = vec![corner(1.0, -1.0), corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0)];
    let mut mesh = Mesh::new(vertices, vec![0, 1, 2, 0, 2, 3], Arc::new(texture), DVec3::ZERO, Wrap::Clamp);
    mesh.material.nearest = true;
    mesh
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn srgb_bytes_are_decoded_by_the_standard() {
    let mut scenario = scenario();
    scenario.camera.size_px = [160, 160];
    scenario.camera.focal_px = [250.0, 250.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    let scene = Scene { meshes: vec![chart()], ..Scene::default() };
    let sequence = sequence(scenario, steady(100.0, 0.0, DVec3::ZERO, DVec3::ZERO), scene);
    let engine = engine();
    let picture = render(&engine, &sequence, &[Channel::Color], 0).frame.into_color();
    // Seen from 100 m the square is 150 pixels wide, a texel 9.4. North is up.
    let mut worst = (0.0, 0);
    for byte in 0..256_usize {
        let [x, y] =
            [byte % 16, byte / 16].map(|texel| (79.5 + 150.0 / 16.0 * (texel as f64 - 7.5)).round() as usize);
        let stored = byte as f64 / 255.0;
        let light = if stored <= 0.040_45 { stored / 12.92 } else { ((stored + 0.055) / 1.055).powf(2.4) };
        let off = (f64::from(picture[4 * (160 * y + x)]) - light).abs();
        worst = if off > worst.0 { (off, byte) } else { worst };
    }
    eprintln!(
        "{}: at most {:.4}/255, byte {}",
        engine.gpu().expect("an adapter").adapter,
        255.0 * worst.0,
        worst.1
    );
    assert!(worst.0 < MOST, "byte {} is off by {:.4}/255 of the linear range", worst.1, 255.0 * worst.0);
}
