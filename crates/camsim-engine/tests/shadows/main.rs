//! Shadows of the sun: a sundial in closed form, hills with a box and things that move against the reference
//! renderer.

#[path = "../common/mod.rs"]
mod common;
mod hills;
mod moving;
mod sundial;

use std::sync::Arc;

use camsim_core::{
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{Channel, MountSpec, Scenario},
    scene::{Encoding, Light, Terrain, Texture},
    sequence::Sequence,
};
use common::{block, scenario};

const SUN: f64 = 0.7;
const SKY: f64 = 0.3;

/// From the south-west, 35 degrees up, with shadows.
fn light() -> Light {
    Light::new(220_f64.to_radians(), 35_f64.to_radians(), SUN, SKY).with_shadows(true)
}

fn paint(byte: u8) -> Arc<Texture> {
    Arc::new(Texture::uniform([byte, byte, byte, 255], Encoding::Linear))
}

/// Level ground of 128 m with heights of 2 m, and light on it.
fn level_ground(light: &Light) -> Terrain {
    let mut terrain = Terrain::from_heights(65, 65, 2.0, &[0.0; 65 * 65], Some(paint(204))).expect("terrain");
    terrain.bake_light(light);
    terrain
}

fn looking_down(size_px: [u32; 2], focal_px: f64) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = size_px;
    scenario.camera.focal_px = [focal_px; 2];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    scenario.quality.max_error_dn = 1.0;
    scenario
}

fn by_reference(sequence: &Arc<Sequence>) -> Vec<f32> {
    let options =
        RenderOptions { channels: vec![Channel::Color], tolerance_dn: 0.2, ..RenderOptions::default() };
    ReferenceRenderer::new(sequence.clone()).expect("a reference").render(0, &options).into_color()
}

/// PSNR of the pixels near borders, and of the others, dB.
fn psnr_db(truth: &[f32], picture: &[f32], near: &[bool]) -> [f64; 2] {
    let (mut squares, mut count) = ([0.0_f64; 2], [0.0_f64; 2]);
    for (i, &near) in near.iter().enumerate() {
        let kind = usize::from(!near);
        for k in 4 * i..4 * i + 3 {
            squares[kind] += f64::from(truth[k] - picture[k]).powi(2);
            count[kind] += 1.0;
        }
    }
    [0, 1].map(|kind: usize| -10.0 * (squares[kind] / count[kind]).log10())
}
