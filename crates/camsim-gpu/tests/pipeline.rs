//! The frame pipeline: nothing is made on the device once it runs, frames come in the order asked for, and faults stop it at once.

mod common;

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    scenario::{Channel, LensModel, LensSpec, MountSpec, Scenario, ShutterSpec, ZoomSpec},
    sequence::Sequence,
};
use camsim_gpu::Engine;
use common::{city, engine, pattern, scenario, sequence, steady};
use glam::DVec3;

const ALL: [Channel; 3] = [Channel::Color, Channel::Coords, Channel::Depth];
/// Rendered twice: whatever kind of frame there is among them, nothing is new the second time.
const FRAMES: u64 = 6;

fn small() -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [64, 48];
    scenario.camera.focal_px = [52.0, 52.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -60.0, 0.0], ..MountSpec::default() };
    scenario.camera.shutter = ShutterSpec { readout_ms: 20.0, exposure_ms: 6.0, ..ShutterSpec::default() };
    scenario.camera.lens = LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.2, 0.05, 0.001, -0.002] };
    scenario
}

/// Over a pattern: no silhouettes. `zoom`: the lens changes with every frame.
fn plain(zoom: bool) -> Arc<Sequence> {
    let mut scenario = small();
    let entry =
        |at, focal_px: f64, k1| ZoomSpec { at, focal_px: [focal_px; 2], principal_point_px: None, coefficients: vec![k1, 0.02, 0.0, 0.0] };
    if zoom {
        scenario.camera.zoom = vec![entry(1.0, 52.0, -0.2), entry(2.0, 60.0, -0.1)];
    }
    let mut sequence = Sequence::clone(&sequence(scenario, steady(80.0, 0.0, DVec3::new(9.0, 2.0, 0.0), DVec3::ZERO), pattern(400.0)));
    if zoom {
        sequence.zoom_track = vec![(0.0, 1.0), (3.3, 2.0)];
    }
    Arc::new(sequence)
}

/// Over houses: silhouettes, several ideal frames.
fn houses() -> Arc<Sequence> {
    sequence(small(), steady(80.0, 0.0, DVec3::new(9.0, 2.0, 0.0), DVec3::ZERO), city(2))
}

/// What the device holds, by wgpu's own books: transient objects of a frame in flight are among it.
fn held(engine: &Engine) -> Vec<(&'static str, isize)> {
    let counters = engine.gpu().device.get_internal_counters().hal;
    vec![
        ("buffers", counters.buffers.read()),
        ("bytes of buffers", counters.buffer_memory.read()),
        ("bytes of textures", counters.texture_memory.read()),
        ("views", counters.texture_views.read()),
        ("bind groups", counters.bind_groups.read()),
        ("bind group layouts", counters.bind_group_layouts.read()),
        ("pipelines", counters.render_pipelines.read() + counters.compute_pipelines.read()),
        ("samplers", counters.samplers.read()),
        ("shader modules", counters.shader_modules.read()),
        ("command encoders", counters.command_encoders.read()),
        ("query sets", counters.query_sets.read()),
        ("fences", counters.fences.read()),
    ]
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_frame_makes_nothing_on_the_device() {
    let engine = engine();
    for (name, sequence) in [("plain", plain(false)), ("zoom lens", plain(true)), ("houses", houses())] {
        let mut session = engine.session::<Infallible>(sequence, &ALL).expect("session");
        session.render::<Infallible>(0..FRAMES, &mut |_| Ok(())).expect("render");
        let before = held(&engine);
        let counted = before.iter().filter(|(_, count)| *count > 0).count();
        assert!(counted >= before.len() - 1, "wgpu counts all of these, query sets only where frames are timed: {before:?}");
        let mut most = before.clone();
        let mut keep_most = |_| {
            most.iter_mut().zip(held(&engine)).for_each(|(most, now)| most.1 = most.1.max(now.1));
            Ok(())
        };
        session.render::<Infallible>(0..FRAMES, &mut keep_most).expect("render");
        assert_eq!(most, before, "{name}: with a frame in flight, and before");
        assert_eq!(held(&engine), before, "{name}: after and before");
    }
}
