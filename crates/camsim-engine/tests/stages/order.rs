//! Bytes are the same twice and in any order of frames.

use std::{convert::Infallible, sync::Arc};

use camsim_core::{
    frame::RenderedFrame,
    scenario::{Channel, MountSpec, ZoomSpec},
    sequence::Sequence,
};
use camsim_engine::Finished;
use camsim_plan::Backend;
use glam::DVec3;

use super::common::{barrel_lens, engine, pattern, rolling, scenario, sequence, steady};

/// Frames of a sequence rendered in some order by one session, sorted.
fn frames_in_order(
    (backend, general_cpu): (Backend, bool),
    sequence: &Arc<Sequence>,
    order: &[u64],
) -> Vec<RenderedFrame> {
    let mut engine = engine();
    engine.set_backend(backend);
    let channels = [Channel::Color, Channel::Coords];
    let mut session = engine.session::<Infallible>(sequence.clone(), &channels).expect("session");
    session.set_general_cpu(general_cpu);
    let mut frames = Vec::new();
    let mut keep = |finished: Finished| {
        frames.push(finished.frame);
        Ok(())
    };
    session.render::<Infallible>(order.iter().copied(), &mut keep).expect("render");
    frames.sort_by_key(|frame| frame.index);
    frames
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn bytes_are_the_same_twice_and_in_any_order() {
    let mut fixed = scenario();
    fixed.camera.size_px = [200, 150];
    fixed.camera.focal_px = [160.0, 160.0];
    fixed.camera.mount = MountSpec { angles_deg: [8.0, -70.0, 15.0], ..MountSpec::default() };
    fixed.camera.lens = barrel_lens();
    fixed.camera.shutter = rolling(33.0, 30.0);
    fixed.camera.photometric.noise_sigma = 0.02;
    let mut zooming = fixed.clone();
    let entry = |at: f64, focal_px: f64, k1: f64| ZoomSpec {
        at,
        focal_px: [focal_px; 2],
        principal_point_px: None,
        coefficients: vec![k1, 0.05],
    };
    zooming.camera.zoom = vec![entry(1.0, 160.0, -0.3), entry(2.0, 300.0, -0.1)];
    let trajectory = || steady(200.0, 30.0, DVec3::new(0.0, 60.0, 0.0), DVec3::new(0.2, -0.3, 0.9));
    for (name, scenario) in [("fixed lens", fixed), ("zoom lens", zooming)] {
        let mut sequence = Arc::unwrap_or_clone(sequence(scenario, trajectory(), pattern(6000.0)));
        sequence.zoom_track = vec![(0.0, 1.0), (0.2, 2.0)];
        let sequence = Arc::new(sequence);
        for by in [(Backend::Auto, false), (Backend::Gpu, false), (Backend::Cpu, false), (Backend::Cpu, true)]
        {
            let bits = |order: &[u64]| {
                let frames = frames_in_order(by, &sequence, order);
                frames.into_iter().map(|frame| frame.planes).collect::<Vec<_>>()
            };
            let forwards = bits(&[0, 1, 2, 3, 4]);
            assert!(forwards == bits(&[3, 0, 4, 2, 1]), "{name}, {by:?}: order must not matter");
            assert!(forwards == bits(&[0, 1, 2, 3, 4]), "{name}, {by:?}: twice must be the same");
            assert!(forwards[0] != forwards[1], "{name}, {by:?}: frames differ");
        }
    }
}
