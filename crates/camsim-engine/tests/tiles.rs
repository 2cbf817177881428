//! A tiled ground texture gives the picture of a single texture.

mod common;

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    scenario::{Channel, MountSpec, Scenario},
    scene::{Encoding, Scene, Terrain, Texture},
    sequence::Sequence,
};
use camsim_engine::IdealPlanes;
use camsim_plan::Backend;
use camsim_plan::PrefilterTaps;
use common::{engine, is_software, scenario, sequence, steady};
use glam::DVec3;

/// Every texel another colour, with larger patches: nothing hides a read that is off.
fn ground() -> Scene {
    let [width, height] = [4001_u32, 2884];
    let mix = |mut n: u32| {
        n = (n ^ (n >> 16)).wrapping_mul(0x7feb_352d);
        n = (n ^ (n >> 15)).wrapping_mul(0x846c_a68b);
        n ^ (n >> 16)
    };
    let rgba8 = (0..width * height).flat_map(|i| {
        let (fine, coarse) = (mix(i), mix((i % width / 40) * 7919 + i / width / 40));
        [0, 8, 16]
            .map(|shift| (((fine >> shift) & 255) / 2 + ((coarse >> shift) & 255) / 2) as u8)
            .into_iter()
            .chain([255])
    });
    let texture = Texture { size_px: [width, height], rgba8: rgba8.collect(), encoding: Encoding::Srgb };
    let (cols, rows) = (251, 181);
    let heights: Vec<f64> = (0..cols * rows)
        .map(|i| 25.0 * (f64::from(i % cols) * 0.13).sin() * (f64::from(i / cols) * 0.09).cos())
        .collect();
    let terrain =
        Terrain::from_heights(cols, rows, 10.0, &heights, Some(Arc::new(texture))).expect("a terrain");
    Scene { terrain: Some(terrain), sky_linear: [0.2, 0.4, 0.8], ..Scene::default() }
}

fn flight(ground: &Scene, max_error_dn: f64, pitch_deg: f64) -> Arc<Sequence> {
    let mut scenario: Scenario = scenario();
    scenario.quality.max_error_dn = max_error_dn;
    scenario.camera.size_px = [320, 240];
    scenario.camera.focal_px = [250.0, 240.0];
    scenario.camera.fps = 2.0;
    scenario.camera.mount = MountSpec { angles_deg: [0.0, pitch_deg, 0.0], ..MountSpec::default() };
    sequence(scenario, steady(160.0, 20.0, DVec3::new(120.0, 90.0, -20.0), DVec3::ZERO), ground.clone())
}

/// Ideal frames with the picture whole (`None`) or in tiles, how they read it, and tiles on the device, of
/// all.
fn ideal_frames(
    sequence: &Arc<Sequence>,
    limit_px: Option<u32>,
    frames: &[u64],
) -> (Vec<IdealPlanes>, PrefilterTaps, Option<[usize; 2]>) {
    let mut engine = engine();
    // Only the gpu has tiles.
    engine.set_backend(Backend::Gpu);
    if let Some(limit_px) = limit_px {
        engine.limit_pictures(limit_px);
    }
    let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Color]).expect("session");
    let (mut ideal, mut reads) = (Vec::new(), PrefilterTaps::Two);
    for &frame in frames {
        let mut keep = |finished: camsim_engine::Finished| {
            reads = finished.plan.surface_reads;
            Ok(())
        };
        session.render::<Infallible>([frame], &mut keep).expect("render");
        ideal.push(session.read_ideal().expect("readable").expect("drawn"));
    }
    (ideal, reads, session.tiles_held())
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn tiles_show_what_one_texture_does() {
    let ground = ground();
    let mut seen = Vec::new();
    // Straight down over so much ground that tiles make room for others, and for some of them again.
    let far: &[u64] = &[0, 6, 12, 16, 1];
    for (max_error_dn, pitch_deg, frames) in
        [(16.0, -90.0, far), (1.5, -20.0, &[0, 6]), (0.6, -60.0, &[6]), (1.0, -45.0, &[6])]
    {
        let sequence = flight(&ground, max_error_dn, pitch_deg);
        let (whole, reads, none) = ideal_frames(&sequence, None, frames);
        let (tiled, _, held) = ideal_frames(&sequence, Some(512), frames);
        assert_eq!(none, None);
        let [held, all] = held.expect("tiles");
        // One layer has room for 64.
        assert!(frames.len() < 3 || held == 64, "{held}");
        for (frame, (whole, tiled)) in frames.iter().zip(whole.iter().zip(&tiled)) {
            assert_eq!((whole.0, &whole.2), (tiled.0, &tiled.2), "geometry and depth are the same");
            let differences: Vec<f32> = whole.1.iter().zip(&tiled.1).map(|(a, b)| (a - b).abs()).collect();
            let largest = differences.iter().copied().fold(0.0, f32::max);
            let mean = differences.iter().sum::<f32>() / differences.len() as f32;
            eprintln!(
                "{reads:?}, frame {frame}: {held} of {all} tiles; largest difference {:.3}/255, mean \
                 {:.4}/255",
                255.0 * largest,
                255.0 * mean
            );
            // Half floats below 1 are up to 0.12/255 apart. Where texels are weighed with 8 bits, a read of
            // black beside white is off by 1/255 at most (2^-9 of it along each axis), and the same position of
            // a tile is not rounded as that of the whole.
            let [most, most_mean] = if is_software(&engine()) { [0.26, 0.002] } else { [2.0, 0.1] };
            assert!(255.0 * largest < most && 255.0 * mean < most_mean, "{largest} {mean}");
        }
        seen.push(reads);
        assert!(held < all);
    }
    assert_eq!(seen, PrefilterTaps::ALL);
}
