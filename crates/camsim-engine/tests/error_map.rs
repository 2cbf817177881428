//! The map of predicted errors: its largest value is that of the plan, and pixel errors are within the
//! predictions around them.

mod common;

use std::sync::Arc;

use camsim_core::{
    noise::pcg4d,
    reference::ReferenceRenderer,
    scenario::{Auto, Axis, Channel, LensModel, LensSpec, Scenario, ShutterSpec, Solver, VibrationSpec},
    scene::{Scene, Terrain},
    sequence::Sequence,
};
use camsim_plan::{ErrorMap, FramePlan, Planner, TemporalStage};
use common::{city, engine, pattern, render, scenario, sequence, steady};
use glam::{DVec2, DVec3};

/// Pixels that are looked at.
const PIXELS: u32 = 3000;

/// Rough ground of 4 km.
fn hills() -> Scene {
    const SIDE: u32 = 257;
    let height = |i: u32| {
        let (x, y) = (f64::from(i % SIDE), f64::from(i / SIDE));
        let [noise, ..] = pcg4d([i, 7, 3, 1]);
        60.0 * (0.05 * x).sin() * (0.04 * y).cos()
            + 12.0 * (0.31 * x + 0.2 * y).sin()
            + 3.0 * (f64::from(noise >> 8) / 1.6e7 - 0.5)
    };
    let heights: Vec<f64> = (0..SIDE * SIDE).map(height).collect();
    Scene {
        terrain: Some(Terrain::from_heights(SIDE, SIDE, 16.0, &heights, None).expect("a terrain")),
        ..Scene::default()
    }
}

fn camera() -> Scenario {
    let mut scenario = scenario();
    let camera = &mut scenario.camera;
    (camera.size_px, camera.focal_px) = ([320, 240], [154.0, 154.0]);
    camera.lens = LensSpec {
        model: LensModel::BrownConrady,
        coefficients: vec![-0.390_024, 0.111_124, -0.001_274_4, -0.008_151_7, -0.008_427_63],
    };
    camera.mount.angles_deg = [3.0, -75.0, 0.0];
    camera.shutter = ShutterSpec { readout_ms: 33.0, exposure_ms: 8.0, ..ShutterSpec::default() };
    scenario
}

fn flown(scenario: Scenario, scene: Scene) -> Arc<Sequence> {
    sequence(scenario, steady(260.0, 20.0, DVec3::new(30.0, 40.0, 5.0), DVec3::new(0.3, -0.2, 0.5)), scene)
}

fn mapped(sequence: &Arc<Sequence>, frame: u64) -> (FramePlan, ErrorMap) {
    let planner = Planner::new(sequence.clone(), &[Channel::Color], 16_384).expect("a planner");
    let plan = planner.plan(frame).expect("a plan");
    let map = planner.error_map(&plan).expect("a map");
    (plan, map)
}

#[test]
fn largest_error_of_the_map_is_that_of_the_plan() {
    let mut kinds = [0; 3];
    let mut cases: Vec<(&str, Scenario, Scene)> = Vec::new();
    for tolerance_px in [0.05, 1e-3] {
        for (name, scene) in [("plane", pattern(60_000.0)), ("hills", hills()), ("city", city(5))] {
            let mut scenario = camera();
            scenario.quality.max_error_px = tolerance_px;
            // What is shared is drawn for the strictest of all.
            scenario.quality.frames_per_ideal = 1;
            cases.push((name, scenario, scene));
        }
    }
    for solver in [Solver::Linear, Solver::Rk2] {
        let mut scenario = camera();
        scenario.quality.solver = Auto::Value(solver);
        cases.push(("a solver by name", scenario, hills()));
    }
    let mut several = camera();
    several.quality.key_frames = Auto::Value(3);
    cases.push(("several ideal frames", several, city(5)));
    let mut still = camera();
    still.camera.shutter.exposure_ms = 0.0;
    still.quality.frames_per_ideal = 1;
    cases.push(("no exposure", still, hills()));
    for (name, scenario, scene) in cases {
        let (plan, map) = mapped(&flown(scenario, scene), 3);
        let (largest_px, total_px) = (map.largest_px(), plan.predicted.total_px);
        let off = (largest_px - total_px).abs() / total_px;
        eprintln!(
            "{name}: {:?}, {} keys, {largest_px:.6e} px of {total_px:.6e}",
            plan.temporal,
            plan.keys.len()
        );
        assert!(off < 1e-9, "{name}: {largest_px} px, the plan {total_px}");
        assert!(
            map.pixels.len() >= plan.predicted.probes as usize && map.known().count() > 100,
            "{name}: {}",
            map.known().count()
        );
        kinds[match plan.temporal {
            TemporalStage::Linear | TemporalStage::Rk2 => 0,
            _ if plan.keys.len() > 1 => 1,
            _ => 2,
        }] += 1;
    }
    assert!(kinds.iter().all(|count| *count > 0), "each way was tried: {kinds:?}");
}

#[test]
fn frames_of_one_ideal_frame_have_separate_maps() {
    let mut scenario = camera();
    (scenario.camera.size_px, scenario.camera.focal_px) = ([160, 120], [130.0, 130.0]);
    scenario.camera.lens.coefficients = vec![-0.2, 0.05, 0.001, -0.002];
    scenario.camera.mount.angles_deg = [0.0, -60.0, 0.0];
    // So that no frame is cheap by the twist of its own instant.
    scenario.camera.mount.vibration = vec![VibrationSpec {
        axis: Axis::Roll,
        amplitude_deg: 0.05,
        amplitude_m: 0.0,
        hz: 40.0,
        phase_deg: 0.0,
    }];
    scenario.camera.shutter = ShutterSpec { readout_ms: 20.0, exposure_ms: 6.0, ..ShutterSpec::default() };
    scenario.quality.frames_per_ideal = 8;
    let sequence = sequence(
        scenario,
        steady(80.0, 0.0, DVec3::new(9.0, 2.0, -1.0), DVec3::new(0.1, -0.05, 0.2)),
        pattern(800.0),
    );
    let shared: Vec<_> = (0..12)
        .map(|frame| mapped(&sequence, frame))
        .filter(|(plan, _)| plan.shared_frames.is_some())
        .collect();
    assert!(!shared.is_empty(), "no frame shares");
    for (plan, _) in &shared {
        // Each is run dry at positions of its own, and those that are solved in the same way answer for all of
        // these.
        let is_alike = |other: &FramePlan| {
            other.shared_frames == plan.shared_frames
                && other.temporal == plan.temporal
                && other.blur == plan.blur
        };
        let alike = shared.iter().filter(|(other, _)| is_alike(other));
        let (largest_px, total_px) =
            (alike.map(|(_, map)| map.largest_px()).fold(0.0, f64::max), plan.predicted.total_px);
        assert!(
            (largest_px - total_px).abs() < 1e-9 * total_px,
            "frame {}: {largest_px} px, the plan {total_px}",
            plan.frame
        );
    }
}

/// What is worked out once for all positions is worked out in parallel: positions that wait for it may not keep its
/// parts from being done.
#[test]
fn error_maps_on_all_threads_do_not_deadlock() {
    let (done, is_done) = std::sync::mpsc::channel();
    let work = move || {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(16).build().expect("threads");
        // Over hills, in a turn: such plans ask what look-ups find at mid-exposure.
        let sequence = flown(camera(), hills());
        for _ in 0..20 {
            pool.install(|| mapped(&sequence, 3));
        }
        done.send(()).expect("somebody waits");
    };
    std::thread::spawn(work);
    is_done.recv_timeout(std::time::Duration::from_secs(100)).expect("threads wait for each other");
}

/// By exact rays at random pixels, away from silhouettes as the map itself knows them.
#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn pixel_errors_are_within_the_neighbouring_predictions() {
    let engine = engine();
    for (name, scene) in [("plane", pattern(60_000.0)), ("hills", hills()), ("city", city(5))] {
        let mut scenario = camera();
        scenario.camera.shutter.exposure_ms = 0.0;
        scenario.quality.frames_per_ideal = 1;
        let sequence = flown(scenario, scene);
        let done = render(&engine, &sequence, &[Channel::Color, Channel::Coords], 0);
        let planner =
            Planner::new(sequence.clone(), &[Channel::Color, Channel::Coords], 16_384).expect("a planner");
        let map = planner.error_map(&done.plan).expect("a map");
        let reference = ReferenceRenderer::new(sequence.clone()).expect("a usable camera");
        let view = reference.view(0);
        let key = done.plan.ideal_view();
        let coords = done.frame.coords().expect("asked for");
        let (mut within, mut all, mut apart, mut least_px, mut most_px) = (0, 0, 0, f64::INFINITY, 0.0_f64);
        for i in 0..PIXELS {
            let [x, y, ..] = pcg4d([i, 3, 1, 4]);
            let pixel = [x % 320, y % 240];
            let Some(look) = view.sample(pixel, DVec2::ZERO, 0.0) else { continue };
            let Some(near_px) = map.near_px(pixel) else {
                apart += 1;
                continue;
            };
            let [.., at_x, at_y] = coords[(pixel[1] * 320 + pixel[0]) as usize][..4] else {
                panic!("four numbers")
            };
            let off_px = DVec2::new(f64::from(at_x), f64::from(at_y)).distance(key.source_px(&look));
            // Single precision of coordinates of some hundred pixels says nothing below this.
            within += u32::from(off_px <= near_px.max(3e-5));
            all += 1;
            (least_px, most_px) = (least_px.min(near_px), most_px.max(near_px));
        }
        eprintln!(
            "{name}: {:.2} % of {all} within; positions {least_px:.2e} to {most_px:.2e} px, {apart} apart",
            100.0 * f64::from(within) / f64::from(all)
        );
        assert!(all > PIXELS / 2, "{name}: {all}");
        assert!(f64::from(within) >= 0.98 * f64::from(all), "{name}: {within} of {all}");
    }
}
