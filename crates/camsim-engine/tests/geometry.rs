//! The `coords` that the production shader wrote, against closed-form f64 homographies of a plane, per line
//! and exposure sample.
//!
//! The reference shares trajectory, shutter timing and the lens's inverse in f64 with the program; the
//! temporal inverse it replaces by intersecting each ray with the plane at the ray's own instant.

mod common;

use camsim_core::{
    mount::CameraPath,
    scenario::{
        Auto, Axis, CameraSpec, Channel, FieldOr, LensModel, LensSpec, MountSpec, Readout, Scenario,
        ShutterSpec, Solver, VibrationSpec,
    },
    scene::Wrap,
    trajectory::Trajectory,
};
use camsim_plan::{FramePlan, TemporalStage};
use common::{engine, pattern, render_at_phase, scenario, sequence, steady};
use glam::{DVec2, DVec3};

/// Ground width of the pattern, metres.
const WIDTH_M: f64 = 6000.0;

/// Where the ray of pixel (x, y) at exposure phase `phase` meets the ground, seen from the key camera; `None`
/// off the pattern.
fn closed_form(plan: &FramePlan, path: &CameraPath, [x, y]: [u32; 2], phase: f64) -> Option<DVec2> {
    let uv = plan.camera.unproject(DVec2::new(f64::from(x), f64::from(y)))?;
    let t_s = plan.stamp_s + plan.shutter.dt_pixel_s(x, y) + phase * plan.shutter.exposure_s();
    let pose = path.pose(t_s);
    let ray_ned = pose.ned_from_camera * uv.extend(1.0);
    let depth_m = -pose.position_ned_m.z / ray_ned.z;
    if depth_m <= 0.0 {
        return None;
    }
    let hit = pose.position_ned_m + depth_m * ray_ned;
    // Two pixels of border are skipped: there a bilinear depth tap meets the sky.
    let rim_m = 3.0 * depth_m / plan.ideal.focal_px.min_element();
    if hit.x.abs().max(hit.y.abs()) > 0.5 * WIDTH_M - rim_m {
        return None;
    }
    let in_key = plan.key_pose.ned_from_camera.inverse() * (hit - plan.key_pose.position_ned_m);
    Some(plan.ideal.px_from_point(in_key))
}

/// Parallax between surfaces that needs no rays of its own, as in the shaders, pixels: at a skyline a pixel
/// may be off by that.
const GAP_PX: f64 = 0.1;

/// RMS and largest source error over all pixels and five exposure phases, and the number of pixels compared.
/// A pixel that sees the sky at one end of its exposure is held against [`GAP_PX`] alone.
fn errors(scenario: Scenario, trajectory: Trajectory) -> (f64, f64, u32) {
    let engine = engine();
    let sequence = sequence(scenario, trajectory, pattern(WIDTH_M));
    let (mut sum, mut worst, mut count) = (0.0, 0.0_f64, 0_u32);
    for phase in [-0.5, -0.3, 0.0, 0.17, 0.5] {
        let done = render_at_phase(&engine, &sequence, &[Channel::Coords], 0, phase);
        let coords = done.frame.coords().expect("coords were asked for");
        let [width, height] = done.frame.size_px;
        for y in 0..height {
            for x in 0..width {
                let i = (y * width + x) as usize;
                let Some(exact) = closed_form(&done.plan, &sequence.path, [x, y], f64::from(phase)) else {
                    continue;
                };
                if done.frame.color_rgba()[4 * i + 3] == 0.0 {
                    panic!("pixel ({x}, {y}) has a source at {exact} but came out invalid");
                }
                let found = DVec2::new(f64::from(coords[i][2]), f64::from(coords[i][3]));
                let error = found.distance(exact);
                let exposed = done.plan.shutter.exposure_s() > 0.0;
                if exposed
                    && [-0.5, 0.5]
                        .iter()
                        .any(|&end| closed_form(&done.plan, &sequence.path, [x, y], end).is_none())
                {
                    assert!(error < GAP_PX, "({x}, {y}) at the skyline: {error:.2e} px");
                    continue;
                }
                sum += error * error;
                worst = worst.max(error);
                count += 1;
            }
        }
    }
    ((sum / f64::from(count.max(1))).sqrt(), worst, count)
}

/// Planar depth in the camera of the pixel's own line against the ground's, relative: 99th percentile, and
/// the number of pixels.
fn depth_error(scenario: Scenario, trajectory: Trajectory) -> (f64, usize, TemporalStage) {
    let sequence = sequence(scenario, trajectory, pattern(WIDTH_M));
    let done = render_at_phase(&engine(), &sequence, &[Channel::Depth], 0, 0.0);
    let found = done.frame.depth_m().expect("depth was asked for");
    let [width, height] = done.frame.size_px;
    let mut errors: Vec<f64> = (0..width * height)
        .filter_map(|i| {
            let pixel = [i % width, i / width];
            closed_form(&done.plan, &sequence.path, pixel, 0.0)?;
            let uv = done.plan.camera.unproject(DVec2::new(f64::from(pixel[0]), f64::from(pixel[1])))?;
            let pose =
                sequence.path.pose(done.plan.stamp_s + done.plan.shutter.dt_pixel_s(pixel[0], pixel[1]));
            let exact_m = -pose.position_ned_m.z / (pose.ned_from_camera * uv.extend(1.0)).z;
            Some((f64::from(found[i as usize]) / exact_m - 1.0).abs())
        })
        .collect();
    errors.sort_by(f64::total_cmp);
    (errors[errors.len() * 99 / 100], errors.len(), done.plan.temporal)
}

fn check(name: &str, scenario: Scenario, trajectory: Trajectory) {
    let pixels = scenario.camera.size_px[0] * scenario.camera.size_px[1];
    let (rms, worst, count) = errors(scenario, trajectory);
    eprintln!("{name}: rms {rms:.2e} px, max {worst:.2e} px over {count} samples");
    assert!(count > pixels, "{name}: only {count} samples compared");
    assert!(rms <= 1e-3 && worst <= 1e-2, "{name}: rms {rms:.2e}, max {worst:.2e}");
}

fn with(shutter: ShutterSpec, change: impl FnOnce(&mut CameraSpec)) -> Scenario {
    let mut scenario = scenario();
    scenario.quality.max_error_px = 1e-3;
    // What several frames make of one: sharing.rs.
    scenario.quality.frames_per_ideal = 1;
    scenario.camera.size_px = [320, 240];
    scenario.camera.focal_px = [250.0, 240.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    scenario.camera.shutter = shutter;
    change(&mut scenario.camera);
    scenario
}

fn rolling() -> ShutterSpec {
    ShutterSpec { readout_ms: 33.0, exposure_ms: 8.0, ..ShutterSpec::default() }
}

const EAST: DVec3 = DVec3::new(0.0, 60.0, 0.0);
const DOWN: DVec3 = DVec3::new(0.0, 0.0, 80.0);
const TURN: DVec3 = DVec3::new(0.2, -0.3, 0.9);

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn rotation() {
    check("rotation", with(rolling(), |_| ()), steady(700.0, 30.0, DVec3::ZERO, TURN));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn translation_and_motion_along_the_optical_axis() {
    check("sideways", with(rolling(), |_| ()), steady(300.0, 0.0, EAST, DVec3::ZERO));
    check("down the axis", with(rolling(), |_| ()), steady(300.0, 0.0, DOWN, DVec3::ZERO));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn delay_and_interlacing_in_every_readout_direction() {
    for readout in [Readout::TopToBottom, Readout::BottomToTop, Readout::LeftToRight, Readout::RightToLeft] {
        let shutter = ShutterSpec { delay_ms: 50.0, interlace_ms: FieldOr::Ms(16.0), readout, ..rolling() };
        check(&format!("{readout:?}"), with(shutter, |_| ()), steady(400.0, -120.0, EAST, TURN));
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn lever_arm_and_vibration() {
    let change = |camera: &mut CameraSpec| {
        camera.mount.offset_m = [1.5, -0.4, 0.8];
        camera.mount.vibration = vec![
            VibrationSpec {
                axis: Axis::Pitch,
                amplitude_deg: 0.2,
                amplitude_m: 0.0,
                hz: 97.0,
                phase_deg: 40.0,
            },
            VibrationSpec { axis: Axis::Z, amplitude_deg: 0.0, amplitude_m: 0.02, hz: 60.0, phase_deg: 0.0 },
        ];
    };
    check("lever arm and vibration", with(rolling(), change), steady(150.0, 10.0, EAST, TURN));
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn through_a_fisheye_with_oblique_view() {
    let change = |camera: &mut CameraSpec| {
        camera.size_px = [640, 480];
        camera.focal_px = [307.6, 307.6];
        camera.principal_point_px = Some([305.1, 226.2]);
        camera.lens = LensSpec {
            model: LensModel::BrownConrady,
            coefficients: vec![-0.390_024, 0.111_124, -0.001_274_4, -0.008_151_7, -0.008_427_63],
        };
        camera.mount.angles_deg = [5.0, -60.0, 20.0];
    };
    check("fisheye", with(rolling(), change), steady(500.0, 10.0, EAST, TURN));
}

/// A picture that repeats is the same one period on; held at its border it is not.
#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn texture_repeats_with_wrap_mode_repeat() {
    let engine = engine();
    let mut scenario = scenario();
    scenario.camera.size_px = [120, 90];
    scenario.camera.focal_px = [100.0, 100.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, -90.0, 0.0], ..MountSpec::default() };
    let unlike = |wrap: Wrap| {
        // Four copies of the picture over 400 m, one each 100 m: a period is 50 px from 200 m above ground.
        // The middle is a seam.
        let mut scene = pattern(400.0);
        scene.meshes[0].material.wrap = [wrap; 2];
        for vertex in &mut std::sync::Arc::make_mut(&mut scene.meshes[0].shape).vertices {
            vertex.uv = vertex.uv.map(|t| 4.0 * t);
        }
        let sequence = sequence(scenario.clone(), steady(200.0, 0.0, DVec3::ZERO, DVec3::ZERO), scene);
        let color = render_at_phase(&engine, &sequence, &[Channel::Color], 0, 0.0).frame.into_color();
        let at = |x: usize, y: usize| color[4 * (y * 120 + x)];
        (0..90 * 70).map(|i| (at(i % 70, i / 70) - at(i % 70 + 50, i / 70)).abs()).fold(0.0, f32::max)
    };
    // Half precision, and the filter's own rounding.
    assert!(unlike(Wrap::Repeat) < 0.01, "{}", unlike(Wrap::Repeat));
    assert!(unlike(Wrap::Clamp) > 0.1, "{}", unlike(Wrap::Clamp));
}

/// Where one look-up is enough for the picture, the depth that it was found with is that of a neighbour up to
/// a line's displacement away.
#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn depth_is_in_the_camera_of_the_row() {
    let scene = |solver: Auto<Solver>| {
        let mut scenario = with(ShutterSpec { readout_ms: 90.0, ..ShutterSpec::default() }, |camera| {
            camera.mount.angles_deg[1] = -50.0
        });
        scenario.quality.solver = solver;
        scenario.quality.max_error_px = 0.05;
        // Two steps would do what one is asked to show.
        if solver == Auto::Value(Solver::Reproject) {
            scenario.quality.iterations = Auto::Value(1);
        }
        depth_error(scenario, steady(300.0, 0.0, DVec3::new(60.0, 10.0, 20.0), 0.3 * TURN))
    };
    // The ground's depth changes by 1 / f a pixel or more: a source off by the tolerance of 0.05 px of 250
    // makes 2e-4. The paper's models keep a constant twist and drop what is of second order in it: (0.09 s *
    // 0.3 rad/s)^2 / 2 = 4e-4.
    for (solver, limit) in [
        (Auto::Value(Solver::Reproject), 2e-4),
        (Auto::Auto, 4e-4),
        (Auto::Value(Solver::Linear), 4e-4),
        (Auto::Value(Solver::Rk2), 4e-4),
    ] {
        let (p99, count, stage) = scene(solver);
        eprintln!("{solver:?}, {stage:?}: depth off by {p99:.1e} at the 99th percentile of {count} pixels");
        assert!(count > 60_000 && p99 < limit, "{solver:?}: {p99:.1e} of {count}");
    }
}
