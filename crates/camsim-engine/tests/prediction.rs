//! Is the prediction honest? Random frames of three scenes: the error measured against the reference is never
//! above the predicted one, and the predicted one is not far above it.
//!
//! `CAMSIM_LONG=1` tries all 200 frames; without it a fifth of them.

mod common;

use std::{convert::Infallible, sync::Arc, time::Instant};

use camsim_core::{
    noise::pcg4d,
    reference::{CoordErrors, ReferenceRenderer, coord_errors},
    scenario::{
        Auto, Axis, Channel, FieldOr, LensModel, LensSpec, Readout, Scenario, ShutterSpec, Solver,
        VibrationSpec,
    },
    scene::{Encoding, Mesh, MeshVertex, Scene, Terrain, Texture, Wrap},
    sequence::Sequence,
    trajectory::Trajectory,
};
use camsim_engine::{Engine, Finished};
use camsim_plan::{FramePlan, TemporalStage};
use common::{engine, pattern, scenario, sequence, steady};
use glam::DVec3;

const FRAMES: u32 = 200;
/// Half a unit in the last place of a coordinate of 64 px: what is measured below this says nothing.
const RESOLUTION_PX: f64 = 3.8e-6;

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
            60.0 * (0.05 * x).sin() * (0.04 * y).cos()
                + 12.0 * (0.31 * x + 0.2 * y).sin()
                + 3.0 * (f64::from(noise >> 8) / 1.6e7 - 0.5)
        })
        .collect();
    Scene {
        terrain: Some(Terrain::from_heights(SIDE, SIDE, 16.0, &heights, None).expect("a terrain")),
        ..Scene::default()
    }
}

/// A box on the ground.
fn building(centre: [f64; 2], half: [f64; 2], height: f64) -> Mesh {
    let corner = |i: u32| {
        let side = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
        let position_m = [
            (side(0) * half[0]) as f32,
            (side(1) * half[1]) as f32,
            if i >> 2 & 1 == 1 { -height as f32 } else { 0.0 },
        ];
        MeshVertex::new(position_m, [0.5, 0.5])
    };
    let quads = [[4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let indices = quads.into_iter().flat_map(|[a, b, c, d]| [a, b, c, a, c, d]).collect();
    let texture = Arc::new(Texture::uniform([200, 180, 160, 255], Encoding::Linear));
    Mesh::new(
        (0..8).map(corner).collect(),
        indices,
        texture,
        DVec3::new(centre[0], centre[1], 0.0),
        Wrap::Clamp,
    )
}

fn buildings() -> Scene {
    let mut dice = Dice { seed: 99, thrown: 0 };
    let mut scene = pattern(8000.0);
    for i in 0..36 {
        let centre =
            [f64::from(i % 6) - 2.5, f64::from(i / 6) - 2.5].map(|k| 60.0 * k + dice.within(-12.0, 12.0));
        let (half, height) = ([dice.within(5.0, 18.0), dice.within(5.0, 18.0)], dice.within(5.0, 35.0));
        scene.meshes.push(building(centre, half, height));
    }
    scene
}

fn frame(dice: &mut Dice, over_m: [f64; 2]) -> (Scenario, Trajectory) {
    let mut scenario = scenario();
    scenario.quality.max_error_px = [0.05, 0.01, 1e-3][dice.within(0.0, 3.0) as usize];
    if dice.one_in(6.0) {
        scenario.quality.solver = Auto::Value([Solver::Linear, Solver::Rk2][dice.within(0.0, 2.0) as usize]);
    }
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
    camera.mount.angles_deg =
        [dice.within(-10.0, 10.0), dice.within(-90.0, -40.0), dice.within(-180.0, 180.0)];
    if dice.one_in(4.0) {
        let hz = dice.within(20.0, 200.0);
        camera.mount.vibration = vec![
            VibrationSpec {
                axis: Axis::Pitch,
                amplitude_deg: dice.within(0.0, 0.2),
                amplitude_m: 0.0,
                hz,
                phase_deg: 40.0,
            },
            VibrationSpec {
                axis: Axis::Y,
                amplitude_deg: 0.0,
                amplitude_m: dice.within(0.0, 0.01),
                hz: 0.7 * hz,
                phase_deg: 0.0,
            },
        ];
    }
    camera.shutter = ShutterSpec {
        delay_ms: if dice.one_in(3.0) { dice.within(0.0, 100.0) } else { 0.0 },
        readout_ms: if dice.one_in(8.0) { 0.0 } else { dice.within(2.0, 60.0) },
        exposure_ms: if dice.one_in(2.0) {
            0.0
        } else {
            dice.within(0.2, 20.0) * if dice.one_in(6.0) { 20.0 } else { 1.0 }
        },
        interlace_ms: FieldOr::Ms(if dice.one_in(6.0) { 20.0 } else { 0.0 }),
        readout: [Readout::TopToBottom, Readout::BottomToTop, Readout::LeftToRight, Readout::RightToLeft]
            [dice.within(0.0, 4.0) as usize],
        ..ShutterSpec::default()
    };
    let speed_m_s = if dice.one_in(8.0) { 0.0 } else { dice.within(1.0, 80.0) };
    let velocity = speed_m_s * dice.vector(1.0);
    let rate = if dice.one_in(4.0) { DVec3::ZERO } else { dice.vector(1.0) };
    let height_m = dice.within(over_m[0], over_m[1]);
    (scenario, steady(height_m, dice.within(0.0, 360.0), velocity, rate))
}

/// What was found out about one frame.
struct Found {
    plan: FramePlan,
    /// Worst over mid-exposure and, where there is an exposure, three more of its phases.
    worst: CoordErrors,
    plan_ms: f64,
}

fn find(engine: &Engine, sequence: &Arc<Sequence>) -> Found {
    let reference = ReferenceRenderer::new(sequence.clone()).expect("a usable camera");
    let mut session = engine.session::<Infallible>(sequence.clone(), &[Channel::Coords]).expect("session");
    session.set_looked_up_coords(true);
    let begin = Instant::now();
    let plan = session.planner().plan(0).expect("a plan");
    let plan_ms = 1e3 * begin.elapsed().as_secs_f64();
    let mut phases = vec![0.0];
    if let Some(blur) = plan.blur {
        // Begin, and the middles of two steps between nodes; exactly 0 would be mid-exposure, which is solved
        // for itself.
        let steps = blur.solved() as f32 - 1.0;
        phases.push(-0.5);
        phases.extend([0.25, 0.75].map(|fraction| ((fraction * steps).floor() + 0.5) / steps - 0.5 + 1e-5));
    }
    let mut worst: Option<CoordErrors> = None;
    for phase in phases {
        session.set_coords_phase(phase);
        let mut sink = |done: Finished| {
            let errors = coord_errors(
                &reference,
                done.plan.frame,
                &done.plan.ideal_view(),
                &done.frame,
                f64::from(phase),
                1,
            )
            .expect("coords were asked for");
            if worst.is_none_or(|worst| errors.smooth.p99_px > worst.smooth.p99_px) {
                worst = Some(errors);
            }
            Ok(())
        };
        session.render::<Infallible>([0], &mut sink).expect("render");
    }
    Found { plan, worst: worst.expect("rendered"), plan_ms }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn errors_of_random_frames_are_within_the_prediction() {
    let long = std::env::var_os("CAMSIM_LONG").is_some_and(|value| value == "1");
    let engine = engine();
    let scenes = [
        ("plane", pattern(60_000.0), [40.0, 800.0]),
        ("hills", hills(), [150.0, 700.0]),
        ("buildings", buildings(), [60.0, 250.0]),
    ];
    let (mut ratios, mut broken, mut empty, mut plan_ms) = (Vec::new(), Vec::new(), 0, 0.0);
    eprintln!(
        "{:>5} {:9} {:>5} {:13} {:>6} {:>8} {:>8} {:>8} {:>8} {:>9} {:>5}",
        "frame", "scene", "tol", "temporal", "pixels", "all rms", "rms", "p99", "max", "predicted", "ratio"
    );
    for seed in (0..FRAMES).step_by(if long { 1 } else { 5 }) {
        let (name, scene, over_m) = &scenes[(seed % 3) as usize];
        let mut dice = Dice { seed, thrown: 0 };
        let (scenario, trajectory) = frame(&mut dice, *over_m);
        let sequence = sequence(scenario, trajectory, scene.clone());
        let Found { plan, worst, plan_ms: ms } = find(&engine, &sequence);
        plan_ms += ms;
        let (predicted, smooth) = (&plan.predicted, worst.smooth);
        let tolerance_px = sequence.scenario.quality.max_error_px;
        let ratio = predicted.total_px / smooth.p99_px.max(RESOLUTION_PX);
        let temporal = match plan.temporal {
            TemporalStage::Reproject { iterations } => format!("reproject x{iterations}"),
            other => format!("{other:?}"),
        };
        eprintln!(
            "{seed:>5} {name:9} {tolerance_px:>5} {temporal:13} {:>6} {:>8.1e} {:>8.1e} {:>8.1e} {:>8.1e} \
             {:>9.1e} {ratio:>5.2} {}{}",
            smooth.count,
            worst.all.rms_px,
            smooth.rms_px,
            smooth.p99_px,
            smooth.max_px,
            predicted.total_px,
            if plan.blur.is_some() { "blur " } else { "" },
            predicted.source_error_obstacle.as_deref().unwrap_or(""),
        );
        // A hundredth of fewer pixels than this is no percentile.
        if smooth.count < 300 {
            empty += 1;
            continue;
        }
        if smooth.p99_px > predicted.total_px || (predicted.source_error_kept && smooth.p99_px > tolerance_px)
        {
            eprintln!("      {predicted:?} {:?} {:?}", plan.blur, plan.motion);
            broken.push(seed);
        }
        ratios.push(ratio);
    }
    ratios.sort_by(f64::total_cmp);
    let [low, median, high] = [0, ratios.len() / 2, ratios.len() - 1].map(|i| ratios[i]);
    eprintln!(
        "predicted / measured over {} frames: median {median:.2}, from {low:.2} to {high:.2}; {empty} frames \
         hardly show anything but silhouettes; a plan takes {:.2} ms",
        ratios.len(),
        plan_ms / (ratios.len() + empty) as f64
    );
    assert!(empty * 10 <= ratios.len(), "{empty} frames show nothing to measure");
    assert!(broken.is_empty(), "measured above predicted in frames {broken:?}");
    assert!(median <= 5.0, "the prediction is {median} times the error in the median");
}

/// That what was measured is no more than the plan foretold.
fn assert_predicted(case: &str, Found { plan, worst, .. }: &Found) {
    let (measured_px, predicted_px) = (worst.smooth.p99_px, plan.predicted.total_px);
    eprintln!(
        "{case}: {measured_px:.2e} px, predicted {predicted_px:.2e}; {:?} {:?}",
        plan.temporal, plan.blur
    );
    assert!(measured_px <= predicted_px, "{case}: {measured_px:.2e} px, predicted {predicted_px:.2e}");
}

/// Two whole periods of the mount within the exposure: at its middle and ends the camera looks the same way,
/// and depth looked up there says nothing of what is between. Long readouts make every line another phase.
#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn errors_within_an_exposure_are_predicted() {
    let engine = engine();
    for readout_ms in [100.0, 300.0, 1000.0] {
        let mut scenario = scenario();
        scenario.camera.size_px = [160, 120];
        scenario.camera.focal_px = [100.0, 100.0];
        scenario.camera.mount.angles_deg = [0.0, -75.0, 0.0];
        scenario.camera.mount.vibration = vec![VibrationSpec {
            axis: Axis::Pitch,
            amplitude_deg: 0.4,
            amplitude_m: 0.0,
            hz: 200.0,
            phase_deg: 0.0,
        }];
        scenario.camera.shutter = ShutterSpec { readout_ms, exposure_ms: 10.0, ..ShutterSpec::default() };
        let sequence = sequence(
            scenario,
            steady(250.0, 0.0, DVec3::new(60.0, 20.0, 0.0), DVec3::new(0.0, 0.0, 0.2)),
            hills(),
        );
        assert_predicted(&format!("{readout_ms} ms readout"), &find(&engine, &sequence));
    }
}

/// A camera that moves far within the exposure: seen from its middle, where the ideal frame is taken, the
/// depth matters least in the middle and at the ends of what a line between the depths of the ends tells, and
/// most between them.
#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn long_exposures_are_predicted() {
    let engine = engine();
    for (exposure_ms, readout_ms, max_error_px) in
        [(60.0, 0.0, 2e-3), (250.0, 5.0, 0.01), (1000.0, 0.0, 0.05), (1000.0, 0.0, 5e-3)]
    {
        let mut scenario = scenario();
        scenario.quality.max_error_px = max_error_px;
        scenario.camera.size_px = [160, 120];
        scenario.camera.focal_px = [120.0, 120.0];
        scenario.camera.mount.angles_deg = [0.0, -60.0, 0.0];
        scenario.camera.shutter = ShutterSpec { readout_ms, exposure_ms, ..ShutterSpec::default() };
        let sequence = sequence(
            scenario,
            steady(400.0, 30.0, DVec3::new(40.0, 20.0, 0.0), DVec3::new(0.0, 0.02, 0.05)),
            hills(),
        );
        assert_predicted(&format!("{exposure_ms} ms exposure, {max_error_px} px"), &find(&engine, &sequence));
    }
}

/// At the border of a fisheye's picture a path bends more than the outermost of a few rays tell: where the
/// probes find so, it gets more nodes.
#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn curved_exposure_path_gets_more_nodes() {
    let engine = engine();
    for max_error_px in [5.0, 0.5, 0.05] {
        let mut scenario = scenario();
        scenario.quality.max_error_px = max_error_px;
        let camera = &mut scenario.camera;
        camera.size_px = [160, 120];
        camera.focal_px = [69.67, 69.62];
        camera.lens = LensSpec {
            model: LensModel::KannalaBrandt,
            coefficients: vec![-0.013_721_8, 0.020_727_4, -0.012_786_5, 0.002_524_2],
        };
        camera.mount.angles_deg = [0.0, -60.0, 0.0];
        camera.shutter = ShutterSpec { readout_ms: 33.0, exposure_ms: 10.0, ..ShutterSpec::default() };
        let sequence = sequence(
            scenario,
            steady(400.0, 0.0, DVec3::new(20.0, 5.0, 0.0), DVec3::new(1.0, 3.0, 1.0)),
            pattern(60_000.0),
        );
        let found = find(&engine, &sequence);
        assert_predicted(&format!("{max_error_px} px"), &found);
        assert!(
            found.plan.predicted.source_error_kept,
            "{max_error_px} px: {:?}",
            found.plan.predicted.source_error_obstacle
        );
    }
}

/// A tighter tolerance is kept, and costs look-ups.
#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn tolerance_is_kept() {
    let engine = engine();
    let mut look_ups = [0, 0];
    for (name, scene) in [("plane", pattern(60_000.0)), ("hills", hills()), ("buildings", buildings())] {
        for (i, tolerance_px) in [0.05, 1e-3].into_iter().enumerate() {
            let mut scenario = scenario();
            scenario.quality.max_error_px = tolerance_px;
            scenario.quality.max_error_dn = 0.5;
            scenario.quality.ideal_scale = Auto::Value(1.0);
            scenario.camera.size_px = [320, 240];
            scenario.camera.focal_px = [200.0, 200.0];
            scenario.camera.mount.angles_deg = [3.0, -75.0, 0.0];
            scenario.camera.shutter = ShutterSpec { readout_ms: 33.0, ..ShutterSpec::default() };
            let trajectory = steady(160.0, 20.0, DVec3::new(30.0, 40.0, 5.0), DVec3::new(0.3, -0.2, 0.5));
            let sequence = sequence(scenario, trajectory, scene.clone());
            let Found { plan, worst, .. } = find(&engine, &sequence);
            let CoordErrors { all, smooth, .. } = worst;
            eprintln!(
                "{name:9} tolerance {tolerance_px:>5}: {:?}, smooth rms {:.1e} p99 {:.1e}, all rms {:.1e} \
                 max {:.1e}, predicted {:.1e}",
                plan.temporal, smooth.rms_px, smooth.p99_px, all.rms_px, all.max_px, plan.predicted.total_px
            );
            assert!(
                smooth.p99_px <= tolerance_px && smooth.rms_px <= tolerance_px,
                "{name} at {tolerance_px}"
            );
            // Between ground, walls and roofs depth has creases, where it is off by more between the ideal
            // frame's pixels. They are too few to count in the percentile, but some probe may stand at one:
            // the plan cannot be sure of the tighter tolerance, and says why.
            let predicted = &plan.predicted;
            let sure = name != "buildings" || i == 0;
            assert!(
                predicted.source_error_kept == sure
                    && predicted.total_px < 5.0 * tolerance_px.max(smooth.p99_px),
                "{name} at {tolerance_px}"
            );
            assert_eq!(
                predicted.source_error_obstacle.as_ref().map(|cause| cause.contains("depth between")),
                (!sure).then_some(true)
            );
            if let TemporalStage::Reproject { iterations } = plan.temporal {
                look_ups[i] += iterations;
            }
        }
    }
    assert!(look_ups[0] < look_ups[1], "the default must be cheaper: {look_ups:?}");
}
