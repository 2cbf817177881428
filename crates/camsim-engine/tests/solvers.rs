//! The paper's constant-twist solvers on the gpu: against their twins, and their errors against rays.

mod common;

use std::sync::Arc;

use camsim_core::{
    reference::{CoordErrors, ReferenceRenderer, coord_errors},
    scenario::{Auto, Axis, Channel, MountSpec, Scenario, ShutterSpec, Solver, VibrationSpec},
    scene::{Scene, Terrain},
    sequence::Sequence,
    temporal::{
        InverseDepthImage,
        displacement::{RK2_STEP_DEG, linear, rk2, rk2_steps},
    },
};
use camsim_plan::{TemporalStage, row_times};
use common::{barrel_lens, engine, pattern, render, render_with_ideal, scenario, sequence, steady};
use glam::{DVec2, DVec3};

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn linear_and_rk2_agree_with_their_twins() {
    let mut moving = scenario();
    moving.camera.size_px = [160, 120];
    moving.camera.focal_px = [130.0, 130.0];
    moving.camera.mount = MountSpec { angles_deg: [8.0, -70.0, 15.0], ..MountSpec::default() };
    moving.camera.lens = barrel_lens();
    moving.camera.shutter = ShutterSpec { readout_ms: 200.0, exposure_ms: 20.0, ..ShutterSpec::default() };
    for solver in [Solver::Linear, Solver::Rk2] {
        moving.quality.solver = Auto::Value(solver);
        let flight = steady(200.0, 30.0, DVec3::new(0.0, 60.0, 0.0), DVec3::new(0.2, -0.3, 0.9));
        let sequence = sequence(moving.clone(), flight, pattern(6000.0));
        for (phase, node) in [(-0.5, Some(0)), (0.0, None)] {
            let (done, (ideal, _, values)) = render_with_ideal(&sequence, phase);
            let plan = &done.plan;
            let expected = if solver == Solver::Linear { TemporalStage::Linear } else { TemporalStage::Rk2 };
            assert_eq!(plan.temporal, expected);
            let nodes = plan.blur.expect("20 ms blur").nodes;
            assert!(solver == Solver::Rk2 || nodes == 2, "a straight line has two ends");
            let table = row_times(plan);
            let depth = InverseDepthImage { size_px: ideal.size_px, values: &values };
            let (mut worst_px, mut compared, mut most_steps) = (0.0_f64, 0, 0);
            for (i, coords) in done.frame.coords().expect("asked for").iter().enumerate() {
                if done.frame.color_rgba()[4 * i + 3] == 0.0 {
                    continue;
                }
                let line = i as u32 / plan.camera.size_px[0];
                let dt_s = f64::from(table.dt_s[(line * table.stride + node.unwrap_or(nodes)) as usize]);
                let uv = DVec2::new(f64::from(coords[0]), f64::from(coords[1]));
                let w = depth.inverse_depth(ideal.px_from_point(uv.extend(1.0)));
                let step_rad = RK2_STEP_DEG.to_radians();
                let moved = match solver {
                    Solver::Linear => linear(uv, w, &plan.key_twist, dt_s),
                    _ => rk2(uv, w, &plan.key_twist, dt_s, step_rad),
                };
                most_steps = most_steps.max(rk2_steps(&plan.key_twist, dt_s, step_rad));
                let found = DVec2::new(f64::from(coords[2]), f64::from(coords[3]));
                worst_px = worst_px.max(found.distance(ideal.px_from_point(moved.extend(1.0))));
                compared += 1;
            }
            eprintln!(
                "{solver:?} at phase {phase}: {worst_px:.2e} px over {compared} pixels, up to {most_steps} \
                 steps"
            );
            assert!(compared > 19_000 && most_steps >= 3, "{compared} {most_steps}");
            // f32 of coordinates up to 400 px: 3e-5 px a rounding.
            assert!(worst_px < 5e-4, "{worst_px:.2e}");
        }
    }
}

/// Hills of 60 m over 640 m, as a 30 m grid.
fn hills() -> Scene {
    const SIDE: u32 = 257;
    let height = |i: u32| {
        let (x, y) = (f64::from(i % SIDE) * 30.0, f64::from(i / SIDE) * 30.0);
        30.0 * (x / 100.0).sin() * (y / 130.0).cos()
    };
    let heights: Vec<f64> = (0..SIDE * SIDE).map(height).collect();
    Scene {
        terrain: Some(Terrain::from_heights(SIDE, SIDE, 30.0, &heights, None).expect("a grid")),
        ..Scene::default()
    }
}

struct Case {
    name: &'static str,
    height_m: f64,
    pitch_deg: f64,
    velocity_ned_m_s: DVec3,
    rate_body_deg_s: DVec3,
    vibration: Option<VibrationSpec>,
    scene: Scene,
    /// RMS in px that linear and rk2 may have, about twice what they do have.
    within_px: [f64; 2],
}

fn cases() -> Vec<Case> {
    let still = DVec3::ZERO;
    let case = |name, height_m, velocity_ned_m_s, rate_body_deg_s, scene, within_px| Case {
        name,
        height_m,
        pitch_deg: -90.0,
        velocity_ned_m_s,
        rate_body_deg_s,
        vibration: None,
        scene,
        within_px,
    };
    let vibration =
        VibrationSpec { axis: Axis::Pitch, amplitude_deg: 0.2, amplitude_m: 0.0, hz: 100.0, phase_deg: 0.0 };
    vec![
        // Straight down, the body's yaw axis is the optical axis.
        case("roll 120 deg/s", 300.0, still, DVec3::new(0.0, 0.0, 120.0), pattern(6000.0), [0.15, 2e-3]),
        case("pitch 120 deg/s", 300.0, still, DVec3::new(0.0, 120.0, 0.0), pattern(6000.0), [0.4, 4e-3]),
        Case {
            pitch_deg: -60.0,
            ..case("plane 30 m/s", 150.0, DVec3::new(30.0, 0.0, 0.0), still, pattern(6000.0), [1e-3, 1e-3])
        },
        case("terrain 100 m/s", 150.0, DVec3::new(100.0, 0.0, 0.0), still, hills(), [0.05, 0.05]),
        Case {
            vibration: Some(vibration),
            ..case("vibration 100 Hz 0.2 deg", 300.0, still, still, hills(), [20.0, 20.0])
        },
    ]
}

fn of_case(case: &Case, solver: Solver, iterations: Auto<u32>) -> Arc<Sequence> {
    let mut scenario: Scenario = scenario();
    scenario.camera.size_px = [160, 120];
    scenario.camera.focal_px = [76.9, 76.9];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, case.pitch_deg, 0.0], ..MountSpec::default() };
    scenario.camera.mount.vibration.extend(case.vibration.clone());
    scenario.camera.shutter = ShutterSpec { readout_ms: 33.0, ..ShutterSpec::default() };
    scenario.quality.solver = Auto::Value(solver);
    scenario.quality.iterations = iterations;
    scenario.quality.max_terrain_error_px = 1e-6;
    let rate = DVec3::new(
        case.rate_body_deg_s.x.to_radians(),
        case.rate_body_deg_s.y.to_radians(),
        case.rate_body_deg_s.z.to_radians(),
    );
    sequence(scenario, steady(case.height_m, 20.0, case.velocity_ned_m_s, rate), case.scene.clone())
}

/// The ladder of solvers on this renderer, a quarter of 640x480 a side (errors in px scale with that): `cargo
/// test -p camsim-gpu --test solvers -- --nocapture` prints it.
#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn errors_against_rays_cast_into_the_scene() {
    let engine = engine();
    let ladder = [
        ("linear", Solver::Linear, Auto::Auto),
        ("rk2", Solver::Rk2, Auto::Auto),
        ("reproject x1", Solver::Reproject, Auto::Value(1)),
        ("reproject x2", Solver::Reproject, Auto::Value(2)),
        ("reproject x3", Solver::Reproject, Auto::Value(3)),
    ];
    for case in cases() {
        let mut rms_px = Vec::new();
        for (name, solver, iterations) in ladder {
            let sequence = of_case(&case, solver, iterations);
            let done = render(&engine, &sequence, &[Channel::Color, Channel::Coords], 0);
            if let Auto::Value(iterations) = iterations {
                assert_eq!(done.plan.temporal, TemporalStage::Reproject { iterations });
            }
            let reference = ReferenceRenderer::new(sequence).expect("a camera");
            let errors: CoordErrors =
                coord_errors(&reference, done.plan.frame, &done.plan.ideal_view(), &done.frame, 0.0, 1)
                    .expect("coords");
            let all = errors.all;
            eprintln!(
                "{:26} {name:13} RMS {:.2e} p99 {:.2e} max {:.2e} px",
                case.name, all.rms_px, all.p99_px, all.max_px
            );
            assert!(all.count > 19_000 && errors.missing == 0 && errors.falsely_valid == 0, "{errors:?}");
            rms_px.push(all.rms_px);
        }
        assert!(rms_px[0] < case.within_px[0] && rms_px[1] < case.within_px[1], "{}: {rms_px:?}", case.name);
        assert!(rms_px[3] < 2e-3, "{}: exact poses leave the depth's error alone, {rms_px:?}", case.name);
    }
}
