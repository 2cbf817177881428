//! Readouts in halves, and exposures that grow from row to row, against the reference renderer.

mod common;

use std::sync::Arc;

use camsim_core::{
    frame::RenderedFrame,
    reference::{ReferenceRenderer, RenderOptions},
    scenario::{
        Auto, Channel, LensModel, LensSpec, Readout, Reset, Scenario, ShutterSpec, Silhouettes, TwinSpec,
    },
    sequence::Sequence,
};
use camsim_engine::Engine;
use common::{engine, ground_and_roof, render, scenario, sequence, steady};
use glam::DVec3;

const CHANNELS: [Channel; 3] = [Channel::Color, Channel::Depth, Channel::Rows];
const READOUTS: [Readout; 6] = [
    Readout::TopToBottom,
    Readout::BottomToTop,
    Readout::LeftToRight,
    Readout::RightToLeft,
    Readout::MiddleOutward,
    Readout::EdgesInward,
];

fn camera(readout: Readout, reset: Reset) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [120, 90];
    scenario.camera.focal_px = [100.0, 100.0];
    scenario.camera.mount.angles_deg = [0.0, -80.0, 0.0];
    scenario.camera.lens = LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.1, 0.02] };
    // Rows that wait until they are read collect up to three times the light.
    scenario.camera.photometric.light = if reset == Reset::Global { 0.3 } else { 0.9 };
    scenario.camera.shutter = ShutterSpec {
        delay_ms: 3.0,
        readout_ms: 16.0,
        readout,
        exposure_ms: 8.0,
        reset,
        ..ShutterSpec::default()
    };
    scenario
}

fn flown(scenario: Scenario) -> Arc<Sequence> {
    let flight = steady(120.0, 20.0, DVec3::new(30.0, 12.0, -2.0), DVec3::new(0.5, -0.4, 0.8));
    sequence(scenario, flight, ground_and_roof(900.0, 20.0, 12.0))
}

/// Root mean square difference of colours in numbers of 255, and the largest difference in depth, over pixels of
/// which both have a depth.
fn compared(a: &RenderedFrame, b: &RenderedFrame) -> f64 {
    let squares = a.color_rgba().iter().zip(b.color_rgba()).map(|(a, b)| f64::from(a - b).powi(2));
    let count = a.color_rgba().len() as f64;
    255.0 * (squares.sum::<f64>() / count).sqrt()
}

/// A frame is as near to the reference as `quality.max_error_dn` asks for.
fn check(engine: &Engine, scenario: Scenario) {
    let most_dn = scenario.quality.max_error_dn;
    let name = format!("{:?}", scenario.camera.shutter);
    let sequence = flown(scenario);
    let reference = ReferenceRenderer::new(sequence.clone()).expect("a reference");
    let options =
        RenderOptions { channels: CHANNELS.to_vec(), tolerance_dn: 0.2, ..RenderOptions::default() };
    let truth = reference.render(0, &options);
    let done = render(engine, &sequence, &CHANNELS, 0).frame;
    let off_dn = compared(&truth, &done);
    eprintln!("{off_dn:.3} dn, {:.1} dB: {name}", 20.0 * (255.0 / off_dn).log10());
    assert!(off_dn < most_dn, "{name}: {off_dn}");
    for (ours, theirs) in done.rows.iter().zip(&truth.rows) {
        assert!((ours.t_mid_ns - theirs.t_mid_ns).abs() <= 1, "{name} {ours:?} {theirs:?}");
        assert!((ours.exposure_ns - theirs.exposure_ns).abs() <= 1, "{name} {ours:?} {theirs:?}");
    }
    let (ours, theirs) = (done.depth_m().expect("depth"), truth.depth_m().expect("depth"));
    let off = ours.iter().zip(theirs).filter(|(a, b)| (*a / *b - 1.0).abs() > 1e-4).count();
    assert!(off <= ours.len() / 500, "{name}: {off} depths");
}

#[test]
fn the_processor_agrees_with_the_reference() {
    for reset in [Reset::Rolling, Reset::Global] {
        for readout in READOUTS {
            check(&Engine::cpu(), camera(readout, reset));
        }
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn the_gpu_agrees_with_the_reference() {
    let engine = engine();
    for readout in [Readout::TopToBottom, Readout::RightToLeft, Readout::MiddleOutward] {
        check(&engine, camera(readout, Reset::Global));
    }
    check(&engine, camera(Readout::EdgesInward, Reset::Rolling));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn several_key_frames_and_rays_of_silhouettes_have_each_rows_exposure() {
    let mut scenario = camera(Readout::TopToBottom, Reset::Global);
    scenario.quality.key_frames = Auto::Value(3);
    scenario.quality.silhouettes = Silhouettes::Rays;
    check(&Engine::cpu(), scenario.clone());
    check(&engine(), scenario);
}

#[test]
fn light_grows_with_the_exposure() {
    let mut scenario = camera(Readout::TopToBottom, Reset::Global);
    scenario.camera.photometric.light = 0.2;
    let mut sequence = Sequence::clone(&flown(scenario));
    // A scene of one colour: sky alone.
    sequence.scene = Arc::new(camsim_core::scene::Scene { sky_linear: [0.5; 3], ..Default::default() });
    let frame = render(&Engine::cpu(), &Arc::new(sequence), &[Channel::Color], 0).frame;
    for y in [0_usize, 44, 89] {
        // Exposures of 8 ms and 16/90 ms more from row to row.
        let wanted = 0.5 * 0.2 * (8.0 + 16.0 * y as f64 / 90.0) / 8.0;
        let found = f64::from(frame.color_rgba()[4 * (y * 120 + 60)]);
        assert!((found - wanted).abs() < 1e-6, "row {y}: {found} {wanted}");
    }
}

#[test]
fn the_mean_of_a_burst_is_the_frame_but_for_the_light_of_its_rows() {
    const COUNT: u32 = 32;
    let mut scenario = camera(Readout::TopToBottom, Reset::Global);
    // What the gain of rows makes of it afterwards is not cut off at white.
    scenario.camera.photometric.light = 0.2;
    let sequence = flown(scenario);
    let twin = TwinSpec { name: "burst".into(), instants: Some(COUNT), ..TwinSpec::default() };
    let whole = render(&Engine::cpu(), &sequence, &[Channel::Color], 1).frame;
    let mut mean = vec![0.0_f64; whole.color_rgba().len()];
    for k in 0..COUNT {
        let picture = Arc::new(sequence.twin(&twin, Some(k)).expect("a usable shutter"));
        let frame = render(&Engine::cpu(), &picture, &[Channel::Color], 1).frame;
        mean.iter_mut().zip(frame.color_rgba()).for_each(|(sum, c)| *sum += f64::from(*c) / f64::from(COUNT));
    }
    let mut squares = 0.0;
    for (i, (mean, whole)) in mean.iter().zip(whole.color_rgba()).enumerate().filter(|(i, _)| i % 4 < 3) {
        let gain = 1.0 + 2.0 * (i / (4 * 120)) as f64 / 90.0;
        squares += (gain * mean - f64::from(*whole)).powi(2);
    }
    let off_dn = 255.0 * (squares / (0.75 * mean.len() as f64)).sqrt();
    // What a frame may be off, and so the mean of its burst.
    assert!(off_dn < sequence.scenario.quality.max_error_dn, "{off_dn}");
}
