//! Is the prediction honest? Random frames of three scenes: the error measured against the oracle is never above the predicted one, and the
//! predicted one is not far above it.
//!
//! `CAMSIM_LONG=1` tries all 200 frames; without it a fifth of them.

mod common;

use std::sync::Arc;

use camsim_core::{
    noise::pcg4d,
    plan::TemporalStage,
    reference::{ErrorStats, Oracle, coord_errors},
    scenario::{Axis, Channel, FieldOr, LensModel, LensSpec, Readout, Scenario, ShutterSpec, VibrationSpec},
    scene::{Encoding, Mesh, MeshVertex, Scene, Terrain, Texture, Wrap},
    trajectory::Trajectory,
};
use common::{engine, pattern, render_at_phase, scenario, sequence, steady};
use glam::DVec3;

const FRAMES: u32 = 200;

/// Random numbers of one frame: the same on every machine.
struct Dice {
    seed: u32,
    thrown: u32,
}

impl Dice {
    fn within(&mut self, low: f64, high: f64) -> f64 {
        self.thrown += 1;
        let [value, ..] = pcg4d([self.seed, self.thrown, 0x5eed, 1]);
        low + (high - low) * f64::from(value >> 8) / f64::from(1_u32 << 24)
    }

    fn one_in(&mut self, of: f64) -> bool {
        self.within(0.0, of) < 1.0
    }

    fn vector(&mut self, reach: f64) -> DVec3 {
        DVec3::new(self.within(-reach, reach), self.within(-reach, reach), self.within(-reach, reach))
    }
}

/// Rough ground of 4 km: three scales of waves and noise in every vertex.
fn hills() -> Scene {
    const SIDE: u32 = 257;
    let heights: Vec<f64> = (0..SIDE * SIDE)
        .map(|i| {
            let (x, y) = (f64::from(i % SIDE), f64::from(i / SIDE));
            let [noise, ..] = pcg4d([i, 7, 3, 1]);
            60.0 * (0.05 * x).sin() * (0.04 * y).cos() + 12.0 * (0.31 * x + 0.2 * y).sin() + 3.0 * (f64::from(noise >> 8) / 1.6e7 - 0.5)
        })
        .collect();
    Scene { terrain: Some(Terrain::from_heights(SIDE, SIDE, 16.0, &heights, None).expect("a terrain")), ..Scene::default() }
}

/// A box on the ground.
fn building(centre: [f64; 2], half: [f64; 2], height: f64) -> Mesh {
    let corner = |i: u32| {
        let side = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let position_m = [(side(0) * half[0]) as f32, (side(1) * half[1]) as f32, if i >> 2 & 1 == 1 { -height as f32 } else { 0.0 }];
        MeshVertex { position_m, uv: [0.5, 0.5] }
    };
    let quads = [[4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    Mesh {
        vertices: (0..8).map(corner).collect(),
        indices: quads.into_iter().flat_map(|[a, b, c, d]| [a, b, c, a, c, d]).collect(),
        texture: Arc::new(Texture::uniform([200, 180, 160, 255], Encoding::Linear)),
        origin_ned_m: DVec3::new(centre[0], centre[1], 0.0),
        wrap: Wrap::Clamp,
    }
}

fn buildings() -> Scene {
    let mut dice = Dice { seed: 99, thrown: 0 };
    let mut scene = pattern(8000.0);
    for i in 0..36 {
        let place = [f64::from(i % 6) - 2.5, f64::from(i / 6) - 2.5].map(|k| 60.0 * k + dice.within(-12.0, 12.0));
        let (half, height) = ([dice.within(5.0, 18.0), dice.within(5.0, 18.0)], dice.within(5.0, 35.0));
        scene.meshes.push(building(place, half, height));
    }
    scene
}

fn frame(dice: &mut Dice, over_m: [f64; 2]) -> (Scenario, Trajectory) {
    let mut scenario = scenario();
    scenario.quality.max_error_px = [0.05, 0.05, 0.01, 1e-3][dice.within(0.0, 4.0) as usize];
    let camera = &mut scenario.camera;
    camera.size_px = [160, 120];
    let focal_px = dice.within(70.0, 180.0);
    camera.focal_px = [focal_px, focal_px];
    camera.principal_point_px = Some([dice.within(70.0, 90.0), dice.within(50.0, 70.0)]);
    if dice.one_in(2.0) {
        camera.focal_px = [77.0, 77.0];
        camera.lens = LensSpec {
            model: LensModel::BrownConrady,
            coefficients: vec![-0.390_024, 0.111_124, -0.001_274_4, -0.008_151_7, -0.008_427_63],
        };
    }
    camera.mount.angles_deg = [dice.within(-10.0, 10.0), dice.within(-90.0, -40.0), dice.within(-180.0, 180.0)];
    if dice.one_in(4.0) {
        let hz = dice.within(20.0, 200.0);
        camera.mount.vibration = vec![
            VibrationSpec { axis: Axis::Pitch, amplitude_deg: dice.within(0.0, 0.2), amplitude_m: 0.0, hz, phase_deg: 40.0 },
            VibrationSpec { axis: Axis::Y, amplitude_deg: 0.0, amplitude_m: dice.within(0.0, 0.01), hz: 0.7 * hz, phase_deg: 0.0 },
        ];
    }
    camera.shutter = ShutterSpec {
        delay_ms: if dice.one_in(3.0) { dice.within(0.0, 100.0) } else { 0.0 },
        readout_ms: if dice.one_in(8.0) { 0.0 } else { dice.within(2.0, 60.0) },
        exposure_ms: if dice.one_in(2.0) { 0.0 } else { dice.within(0.2, 20.0) },
        interlace_ms: FieldOr::Ms(if dice.one_in(6.0) { 20.0 } else { 0.0 }),
        readout: [Readout::TopToBottom, Readout::BottomToTop, Readout::LeftToRight, Readout::RightToLeft][dice.within(0.0, 4.0) as usize],
        ..ShutterSpec::default()
    };
    let speed_m_s = if dice.one_in(8.0) { 0.0 } else { dice.within(1.0, 40.0) };
    let velocity = speed_m_s * dice.vector(1.0);
    let rate = if dice.one_in(4.0) { DVec3::ZERO } else { dice.vector(1.0) };
    let height_m = dice.within(over_m[0], over_m[1]);
    (scenario, steady(height_m, dice.within(0.0, 360.0), velocity, rate))
}

/// Worst over mid-exposure and, where there is an exposure, three more of its phases.
fn measured(
    engine: &camsim_gpu::Engine,
    sequence: &Arc<camsim_core::sequence::Sequence>,
    oracle: &Oracle,
) -> (ErrorStats, camsim_core::plan::FramePlan) {
    let mut worst = ErrorStats::default();
    let mut phases = vec![0.0];
    let mut plan = None;
    while let Some(phase) = phases.pop() {
        let done = render_at_phase(engine, sequence, &[Channel::Coords], 0, phase);
        if plan.is_none()
            && let Some(blur) = done.plan.blur
        {
            // Begin, and the middles of two stretches.
            let segments = blur.nodes as f32 - 1.0;
            phases.extend([
                -0.5,
                ((0.25 * segments).floor() + 0.5) / segments - 0.5,
                ((0.75 * segments).floor() + 0.5) / segments - 0.5 + 1e-4,
            ]);
        }
        let errors = coord_errors(oracle, &done.plan, &done.frame, f64::from(phase), 1).expect("coords were asked for").smooth;
        if errors.p99_px >= worst.p99_px {
            worst = errors;
        }
        plan = Some(done.plan);
    }
    (worst, plan.expect("rendered"))
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn random_frames_stay_within_their_prediction() {
    let long = std::env::var_os("CAMSIM_LONG").is_some_and(|value| value == "1");
    let engine = engine();
    let scenes =
        [("plane", pattern(60_000.0), [40.0, 800.0]), ("hills", hills(), [150.0, 700.0]), ("buildings", buildings(), [60.0, 250.0])];
    let mut ratios = Vec::new();
    let mut broken = Vec::new();
    println!(
        "{:>5} {:9} {:>6} {:22} {:>8} {:>9} {:>9} {:>9} {:>9} {:>6}",
        "frame", "scene", "tol", "temporal", "pixels", "rms", "p99", "max", "predicted", "ratio"
    );
    for seed in (0..FRAMES).step_by(if long { 1 } else { 5 }) {
        let (name, scene, over_m) = &scenes[(seed / 5 % 3) as usize];
        let mut dice = Dice { seed, thrown: 0 };
        let (scenario, trajectory) = frame(&mut dice, *over_m);
        let sequence = sequence(scenario, trajectory, scene.clone());
        let oracle = Oracle::new(sequence.clone()).expect("a usable camera");
        let (errors, plan) = measured(&engine, &sequence, &oracle);
        let predicted = &plan.predicted;
        let ratio = predicted.total_px / errors.p99_px.max(1e-12);
        let temporal = match plan.temporal {
            TemporalStage::Reproject { iterations } => format!("reproject x{iterations}"),
            other => format!("{other:?}"),
        };
        println!(
            "{seed:>5} {name:9} {:>6} {temporal:22} {:>8} {:>9.2e} {:>9.2e} {:>9.2e} {:>9.2e} {ratio:>6.2} {}{}",
            sequence.scenario.quality.max_error_px,
            errors.count,
            errors.rms_px,
            errors.p99_px,
            errors.max_px,
            predicted.total_px,
            if plan.blur.is_some() { "blur " } else { "" },
            predicted.in_the_way.as_deref().unwrap_or(""),
        );
        let tolerance_px = sequence.scenario.quality.max_error_px;
        if errors.p99_px > predicted.total_px || (predicted.kept && errors.p99_px > tolerance_px) {
            println!("      {predicted:?} {:?} {:?}", plan.blur, plan.motion);
            broken.push(seed);
        }
        ratios.push(ratio);
    }
    ratios.sort_by(f64::total_cmp);
    let median = ratios[ratios.len() / 2];
    println!("predicted / measured: median {median:.2}, from {:.2} to {:.2}", ratios[0], ratios[ratios.len() - 1]);
    assert!(broken.is_empty(), "measured above predicted in frames {broken:?}");
    assert!(median <= 5.0, "the prediction is {median} times the error in the median");
}
