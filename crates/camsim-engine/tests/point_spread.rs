//! Light spreads in the same way whichever renderer brings it, before any noise.

mod common;

use std::sync::Arc;

use camsim_core::{
    frame::RenderedFrame,
    imaging::Optics,
    metrics::{ImageView, compare},
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{CameraSpec, Channel, LensModel, LensSpec, PointSpreadSpec, Scenario, TwinSpec},
    sequence::Sequence,
};
use camsim_plan::Backend;
use common::{engine, pattern, render, rolling, scenario, sequence, steady};
use glam::DVec3;

/// Ground under a lens whose corners have no ray.
fn ground(change: impl Fn(&mut Scenario)) -> Arc<Sequence> {
    let mut scenario = scenario();
    let camera = &mut scenario.camera;
    camera.size_px = [96, 72];
    camera.focal_px = [80.0, 80.0];
    camera.lens = LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.45] };
    camera.mount.angles_deg = [0.0, -90.0, 0.0];
    camera.shutter = rolling(20.0, 4.0);
    camera.photometric.noise_sigma = 0.0;
    change(&mut scenario);
    let trajectory = steady(80.0, 0.0, DVec3::new(9.0, 2.0, -1.0), DVec3::new(0.1, -0.05, 0.2));
    sequence(scenario, trajectory, pattern(800.0))
}

fn spread() -> PointSpreadSpec {
    PointSpreadSpec { sigma_px: Some(0.7), defocus_px: Some(2.5), glare: 0.1, ..PointSpreadSpec::default() }
}

fn by_reference(sequence: &Arc<Sequence>) -> RenderedFrame {
    ReferenceRenderer::new(sequence.clone()).expect("a reference").render(0, &RenderOptions::default())
}

fn psnr_db(a: &RenderedFrame, b: &RenderedFrame) -> f64 {
    let [a, b] = [a, b].map(|frame| ImageView {
        size_px: frame.size_px,
        channels: 4,
        alpha: Some(3),
        samples: frame.color_rgba(),
    });
    compare(a, b).expect("one size").psnr_db()
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn every_renderer_spreads_its_light() {
    let with = |spec: Option<PointSpreadSpec>| {
        ground(move |scenario| {
            scenario.camera.point_spread = spec.clone();
            scenario.camera.photometric.light = 1.3;
            scenario.camera.photometric.noise_sigma = 0.02;
        })
    };
    let (sharp, blurred) = (with(None), with(Some(spread())));
    let (exact_sharp, exact) = (by_reference(&sharp), by_reference(&blurred));
    let valid = exact.color_rgba().chunks_exact(4).filter(|rgba| rgba[3] > 0.0).count();
    assert!((4000..96 * 72).contains(&valid), "some corners have no ray: {valid}");
    let change_db = psnr_db(&exact, &exact_sharp);
    assert!(change_db < 35.0, "the picture changes: {change_db} dB");
    for backend in [Backend::Cpu, Backend::Gpu] {
        let mut engine = engine();
        engine.set_backend(backend);
        let error = |sequence: &Arc<Sequence>, exact: &RenderedFrame| {
            psnr_db(&render(&engine, sequence, &[Channel::Color], 0).frame, exact)
        };
        // Blur keeps no more of the error than the sharp picture has; noise is the same to the bit.
        let (of_sharp, of_blurred) = (error(&sharp, &exact_sharp), error(&blurred, &exact));
        assert!(of_blurred > of_sharp.max(40.0), "{backend:?}: {of_sharp} dB sharp, {of_blurred} dB blurred");
    }
}

#[test]
fn light_is_spread_once_and_noise_is_not() {
    let clean = ground(|_| {});
    let noisy = |spec: Option<PointSpreadSpec>| {
        ground(move |scenario| {
            scenario.camera.point_spread = spec.clone();
            scenario.camera.photometric.noise_sigma = 0.05;
        })
    };
    let mut expected = by_reference(&clean);
    Optics::new(&noisy(Some(spread())).scenario.camera, clean.scenario.seed)
        .expect("a point spread")
        .expose(&mut expected, None);
    let found = by_reference(&noisy(Some(spread())));
    assert_eq!(found.color_rgba(), expected.color_rgba());
    // An ideal twin has neither; one without noise keeps the blur.
    let twin =
        |twin: TwinSpec| by_reference(&Arc::new(noisy(Some(spread())).twin(&twin, None).expect("a twin")));
    let without_noise = twin(TwinSpec { name: "clean".into(), noise: Some(false), ..TwinSpec::default() });
    let mut blurred = by_reference(&clean);
    let camera = CameraSpec { point_spread: Some(spread()), ..clean.scenario.camera.clone() };
    Optics::new(&camera, 0).expect("a point spread").expose(&mut blurred, None);
    assert_eq!(without_noise.color_rgba(), blurred.color_rgba());
    let sharp = TwinSpec { noise: Some(false), point_spread: Some(false), ..TwinSpec::default() };
    assert_eq!(
        twin(TwinSpec { name: "sharp".into(), ..sharp }).color_rgba(),
        by_reference(&clean).color_rgba()
    );
}
