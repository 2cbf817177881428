//! Frames do not depend on the number of pixels per thread.

mod common;

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    frame::RenderedFrame,
    scenario::{Channel, FieldOr, MountSpec, Readout, Scenario, ShutterSpec},
    sequence::Sequence,
};
use camsim_gpu::reverse::PipelineKey;
use camsim_plan::Backend;
use common::{barrel_lens, city, engine, scenario, sequence, steady};
use glam::DVec3;

/// Sides that no workgroup divides.
const SIZE_PX: [u32; 2] = [181, 139];

fn camera(readout: Readout, exposure_ms: f64, interlace_ms: f64) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = SIZE_PX;
    scenario.camera.focal_px = [150.0, 150.0];
    scenario.camera.mount = MountSpec { angles_deg: [3.0, -60.0, 10.0], ..MountSpec::default() };
    scenario.camera.lens = barrel_lens();
    scenario.camera.shutter = ShutterSpec {
        readout,
        readout_ms: 33.0,
        exposure_ms,
        interlace_ms: FieldOr::Ms(interlace_ms),
        ..ShutterSpec::default()
    };
    scenario.camera.photometric.noise_sigma = 0.02;
    scenario
}

fn frame(
    sequence: &Arc<Sequence>,
    channels: &[Channel],
    pixels_a_thread: u32,
) -> (RenderedFrame, PipelineKey) {
    let mut engine = engine();
    engine.set_pixels_a_thread(pixels_a_thread);
    // The host takes blocks of its own size.
    engine.set_backend(Backend::Gpu);
    let mut session = engine.session::<Infallible>(sequence.clone(), channels).expect("session");
    let mut found = None;
    let mut keep = |finished: camsim_engine::Finished| {
        let key = PipelineKey::of(&finished.plan);
        found = Some((finished.frame, key));
        Ok(())
    };
    session.render::<Infallible>([2], &mut keep).expect("render");
    found.expect("a frame")
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn any_number_of_pixels_a_thread_gives_the_same_bytes() {
    let all = [Channel::Color, Channel::Coords, Channel::Depth];
    let cases = [
        ("rows", camera(Readout::TopToBottom, 0.0, 0.0), &all[..1]),
        ("rows, exposure, truth", camera(Readout::BottomToTop, 8.0, 0.0), &all[..]),
        ("interlaced", camera(Readout::TopToBottom, 8.0, 16.0), &all[..1]),
        ("columns, interlaced", camera(Readout::LeftToRight, 8.0, 16.0), &all[..1]),
        ("columns, truth", camera(Readout::RightToLeft, 0.0, 0.0), &all[..]),
    ];
    for (name, scenario, channels) in cases {
        let sequence =
            sequence(scenario, steady(120.0, 10.0, DVec3::new(5.0, 30.0, 0.0), DVec3::ZERO), city(6));
        let (one, key) = frame(&sequence, channels, 1);
        assert!(key.caches_line_poses(), "{name}: nothing to be shared in {key:?}");
        assert!(one.color_rgba().iter().any(|&value| value > 0.1), "{name}: a picture");
        for pixels in [3, 16, 1000] {
            let (several, _) = frame(&sequence, channels, pixels);
            assert!(one.color_rgba() == several.color_rgba(), "{name}: colours of {pixels} pixels a thread");
            assert!(
                (one.coords(), one.depth_m()) == (several.coords(), several.depth_m()),
                "{name}: truth of {pixels} pixels a thread"
            );
        }
    }
}
