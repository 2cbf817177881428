//! No kernel is compiled twice: a driver that compiles one anew for each value of a number in its uniforms
//! (lavapipe does, for numbers that decide where the kernel goes) takes half a second each time and keeps the
//! code of all of them. Alone in its process: it counts that process' code.

mod common;

use std::convert::Infallible;

use camsim_core::scenario::{Auto, Channel, LensModel, LensSpec, MountSpec, Preset, ShutterSpec};
use camsim_plan::Backend;
use common::{city, engine, scenario, sequence, steady};
use glam::DVec3;

const ALL: [Channel; 3] = [Channel::Color, Channel::Coords, Channel::Depth];

/// Pieces of code in memory that come from no file.
fn pieces_of_code() -> Option<usize> {
    let maps = std::fs::read_to_string("/proc/self/maps").ok()?;
    let is_made = |line: &str| {
        let mut words = line.split_whitespace();
        words.nth(1).is_some_and(|access| access.contains('x')) && words.nth(3).is_none()
    };
    Some(maps.lines().filter(|line| is_made(line)).count())
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn kernels_are_compiled_once() {
    let mut engine = engine();
    engine.set_backend(Backend::Gpu);
    for (preset, ideal_scale, channels) in [
        (Preset::Default, Auto::Auto, &ALL[..]),
        (Preset::Default, Auto::Value(3.0), &ALL[..1]),
        (Preset::Default, Auto::Value(3.0), &ALL[..]),
        (Preset::Paper, Auto::Auto, &ALL[..]),
    ] {
        let mut scenario = scenario();
        scenario.quality.preset = preset;
        scenario.quality.ideal_scale = ideal_scale;
        scenario.camera.size_px = [64, 48];
        scenario.camera.focal_px = [52.0, 52.0];
        scenario.camera.mount = MountSpec { angles_deg: [0.0, -60.0, 0.0], ..MountSpec::default() };
        scenario.camera.shutter =
            ShutterSpec { readout_ms: 20.0, exposure_ms: 6.0, ..ShutterSpec::default() };
        scenario.camera.lens =
            LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.2, 0.05, 0.001, -0.002] };
        let sequence = sequence(scenario, steady(80.0, 0.0, DVec3::new(9.0, 2.0, 0.0), DVec3::ZERO), city(2));
        let mut session = engine.session::<Infallible>(sequence, channels).expect("session");
        let mut render_at = |phases: &[f32]| {
            for &phase in phases {
                session.set_coords_phase(phase);
                session.render::<Infallible>(0..3, &mut |_| Ok(())).expect("render");
            }
        };
        // Mid-exposure once more: other frames in flight.
        render_at(&[0.0, 0.3, 0.0]);
        let before = pieces_of_code();
        render_at(&[-0.5, -0.4, -0.1, 0.1, 0.2, 0.45]);
        eprintln!("{preset:?}, {ideal_scale:?}: {before:?} pieces of code");
        assert_eq!(pieces_of_code(), before, "{preset:?}, {ideal_scale:?}: code was made for numbers");
        assert!(
            !engine.gpu().expect("an adapter").adapter.name.contains("llvmpipe") || before != Some(0),
            "no code is seen"
        );
    }
}
