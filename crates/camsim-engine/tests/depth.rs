//! Depth and points of every pixel, silhouettes and creases included, against rays of the reference renderer.

mod common;

use std::{path::PathBuf, sync::Arc};

use camsim_core::{
    reference::{ReferenceRenderer, TruthErrors, truth_errors},
    scenario::{Channel, FieldOr, MountSpec, Readout, Scenario, ShutterSpec, Silhouettes},
    scene::{Encoding, Scene, Terrain, Texture},
    sequence::Sequence,
};
use camsim_engine::Finished;
use camsim_io::{load::load_sequence, scenario_file::read_scenario};
use common::{engine, rays::black_ground_and_roof, render, roof, scenario, sequence, steady};
use glam::DVec3;

/// Pixels: an edge that is nearer to a pixel's centre may be seen from either side.
const NEAR_PX: f64 = 0.05;

fn camera(pitch_deg: f64) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [200, 150];
    scenario.camera.focal_px = [160.0, 160.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, pitch_deg, 0.0], ..MountSpec::default() };
    scenario.camera.shutter = ShutterSpec { readout_ms: 33.0, exposure_ms: 8.0, ..ShutterSpec::default() };
    scenario
}

/// Name, pitch of the camera in degrees, what it looks at, and what else is different.
type Case = (&'static str, f64, Scene, fn(&mut Scenario));

/// Steep hills with a roof over them.
fn hills() -> Scene {
    let heights: Vec<f64> = (0..129 * 129)
        .map(|i| 30.0 * (f64::from(i % 129) * 0.4).sin() * (f64::from(i / 129) * 0.3).cos())
        .collect();
    let texture = Arc::new(Texture::uniform([120, 130, 90, 255], Encoding::Srgb));
    let terrain = Terrain::from_heights(129, 129, 8.0, &heights, Some(texture)).expect("heights");
    Scene { terrain: Some(terrain), meshes: vec![roof(60.0, 25.0)], ..Scene::default() }
}

fn errors(sequence: &Arc<Sequence>, done: &Finished) -> TruthErrors {
    let reference = ReferenceRenderer::new(sequence.clone()).expect("a usable camera");
    truth_errors(&reference, done.plan.frame, &done.frame, NEAR_PX).expect("depth of the sequence's size")
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn every_depth_belongs_to_a_visible_surface() {
    let engine = engine();
    let cases: [Case; 6] = [
        ("roof", -90.0, black_ground_and_roof(), |_| {}),
        ("roof, rays at silhouettes", -90.0, black_ground_and_roof(), |s| {
            s.quality.silhouettes = Silhouettes::Rays
        }),
        ("hills from above", -90.0, hills(), |_| {}),
        ("hills and the skyline", -20.0, hills(), |_| {}),
        ("interlaced", -40.0, hills(), |s| s.camera.shutter.interlace_ms = FieldOr::Field),
        ("columns", -40.0, hills(), |s| s.camera.shutter.readout = Readout::LeftToRight),
    ];
    for (name, pitch_deg, scene, change) in cases {
        let mut scenario = camera(pitch_deg);
        change(&mut scenario);
        let sequence = sequence(
            scenario,
            steady(120.0, 0.0, DVec3::new(10.0, 40.0, 0.0), DVec3::new(0.2, -0.3, 0.5)),
            scene,
        );
        let done = render(&engine, &sequence, &[Channel::Depth, Channel::Coords], 0);
        let errors = errors(&sequence, &done);
        eprintln!("{name}: {errors:?}");
        assert!(errors.is_consistent(), "{name}: {errors:?}");
        // At edges within 0.05 px of a pixel's centre either side is right.
        assert!(errors.depth_beyond * 2000 <= errors.pixels && errors.pixels > 20_000, "{name}: {errors:?}");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn depths_between_two_surfaces_are_detected() {
    let sequence =
        sequence(camera(-90.0), steady(120.0, 0.0, DVec3::ZERO, DVec3::ZERO), black_ground_and_roof());
    let mut done = render(&engine(), &sequence, &[Channel::Depth], 0);
    let depths = done.frame.depth_m().expect("depth").to_vec();
    let step = |i: usize| (depths[i] - depths[i + 1]).abs() > 0.2 * depths[i];
    let beside: Vec<usize> = (0..depths.len() - 1).filter(|i| i % 200 != 199 && step(*i)).collect();
    assert!(beside.len() > 20 && errors(&sequence, &done).is_consistent());
    for &i in &beside {
        let depth_m = done.frame.floats_mut(Channel::Depth).expect("depth");
        depth_m[i] = 0.5 * (depths[i] + depths[i + 1]);
    }
    let found = errors(&sequence, &done);
    assert_eq!(
        (found.depth_faults, found.depth_beyond),
        (beside.len() as u64, beside.len() as u64),
        "{found:?}"
    );
    assert!(!found.is_consistent() && found.depth_max > 0.05, "{found:?}");
    // A surface that is there, but not within reach of the pixel, is as wrong.
    let mut far = render(&engine(), &sequence, &[Channel::Depth], 0);
    far.frame.floats_mut(Channel::Depth).expect("depth")[beside[0] - 5] = depths[beside[0] + 1];
    assert_eq!(errors(&sequence, &far).depth_faults, 1);
}

/// A low flight between houses and trees, with a delay, a fisheye and a mount that shakes:
/// `tests/data/field/low-town`, whose models are not part of the repository.
#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn depths_between_houses_are_exact() {
    let Some(data) = std::env::var_os("CAMSIM_DATA").map(PathBuf::from) else {
        eprintln!("CAMSIM_DATA is not set: skipped");
        return;
    };
    let scenario = read_scenario(&data.join("field/low-town/low_town.toml"), &[], None).expect("scenario");
    let sequence = load_sequence(&scenario).expect("sequence").sequence;
    for frame in [0, 60, 120] {
        let done = render(&engine(), &sequence, &[Channel::Depth, Channel::Coords], frame);
        let errors = errors(&sequence, &done);
        eprintln!("frame {frame}: {errors:?}");
        // What is left, fewer than one pixel in 20 000, are cracks of the models and slivers, which a ray
        // beside the pixel's centre misses.
        assert!(
            errors.is_consistent()
                && errors.depth_beyond * 20_000 < errors.pixels
                && errors.pixels == 120_000,
            "frame {frame}: {errors:?}"
        );
    }
}
