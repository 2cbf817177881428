//! Adversarial motion and geometry: the source coordinates that the production shader wrote, against rays
//! that meet a plane in closed form, each at its own instant in f64. The table of figures is in
//! docs/accuracy/stress.md.

mod common;

use std::sync::Arc;

use camsim_core::{
    mount::CameraPath,
    pose::BodyState,
    scenario::{Axis, Channel, MountSpec, Scenario, ShutterSpec, VibrationSpec},
    scene::{Mesh, MeshVertex, Scene, Wrap},
    sequence::Sequence,
    trajectory::Trajectory,
};
use camsim_engine::Finished;
use camsim_plan::{FramePlan, TemporalStage};
use common::{engine, pattern, render_at_phase, rolling, scenario, sequence, steady};
use glam::{DQuat, DVec2, DVec3, EulerRot};

/// A plane through `at`, and how far from `at` its picture reaches.
#[derive(Clone, Copy, Debug)]
struct Plane {
    at_ned_m: DVec3,
    normal_ned: DVec3,
    half_m: f64,
}

const GROUND: Plane = Plane { at_ned_m: DVec3::ZERO, normal_ned: DVec3::Z, half_m: 3000.0 };

/// Where the ray of a pixel at an exposure phase is seen from the key camera: on the plane, or infinitely far
/// in the sky. `None` near the plane's border, where a bilinear depth tap meets both.
fn closed_form(
    plan: &FramePlan,
    path: &CameraPath,
    plane: Plane,
    [x, y]: [u32; 2],
    phase: f64,
) -> Option<DVec2> {
    let uv = plan.camera.unproject(DVec2::new(f64::from(x), f64::from(y)))?;
    let t_s = plan.stamp_s + plan.shutter.dt_pixel_s(x, y) + phase * plan.shutter.exposure_s();
    let pose = path.pose(t_s);
    let ray_ned = pose.ned_from_camera * uv.extend(1.0);
    let key_from_ned = plan.key_pose.ned_from_camera.inverse();
    let depth_m = plane.normal_ned.dot(plane.at_ned_m - pose.position_ned_m) / plane.normal_ned.dot(ray_ned);
    if depth_m <= 0.0 || !depth_m.is_finite() {
        let far = key_from_ned * ray_ned;
        return (far.z > 0.0).then(|| plan.ideal.px_from_point(far));
    }
    let hit = pose.position_ned_m + depth_m * ray_ned;
    let rim_m = 3.0 * depth_m / plan.ideal.focal_px.min_element();
    let reach_m = (hit - plane.at_ned_m).abs().max_element();
    (reach_m < plane.half_m - rim_m)
        .then(|| plan.ideal.px_from_point(key_from_ned * (hit - plan.key_pose.position_ned_m)))
}

/// Errors over the phases begin, middle and end.
#[derive(Debug)]
struct Errors {
    rms_px: f64,
    p99_px: f64,
    max_px: f64,
    compared: usize,
    /// Pixels with a source that came out invalid.
    missing: usize,
}

fn errors(sequence: &Arc<Sequence>, plane: Plane) -> (Errors, Finished) {
    let engine = engine();
    let (mut all, mut missing) = (Vec::new(), 0);
    let mut last = None;
    for phase in [-0.5, 0.0, 0.5] {
        let done = render_at_phase(&engine, sequence, &[Channel::Color, Channel::Coords], 0, phase);
        let coords = done.frame.coords().expect("coords were asked for");
        let width = done.frame.size_px[0];
        for (i, found) in coords.iter().enumerate() {
            let pixel = [i as u32 % width, i as u32 / width];
            let Some(exact) = closed_form(&done.plan, &sequence.path, plane, pixel, f64::from(phase)) else {
                continue;
            };
            if done.frame.color_rgba()[4 * i + 3] == 0.0 {
                missing += usize::from(done.plan.ideal.contains(exact));
                continue;
            }
            all.push(DVec2::new(f64::from(found[2]), f64::from(found[3])).distance(exact));
        }
        last = Some(done);
    }
    all.sort_by(f64::total_cmp);
    let at = |fraction: f64| all[((all.len() as f64 * fraction) as usize).min(all.len() - 1)];
    let rms_px = (all.iter().map(|e| e * e).sum::<f64>() / all.len() as f64).sqrt();
    let found = Errors { rms_px, p99_px: at(0.99), max_px: at(1.0), compared: all.len(), missing };
    (found, last.expect("three phases"))
}

fn small(shutter: ShutterSpec, pitch_deg: f64) -> Scenario {
    let mut scenario = scenario();
    scenario.camera.size_px = [160, 120];
    scenario.camera.focal_px = [125.0, 125.0];
    scenario.camera.mount = MountSpec { angles_deg: [0.0, pitch_deg, 0.0], ..MountSpec::default() };
    scenario.camera.shutter = shutter;
    scenario
}

/// At the default tolerance (p99 below 0.05 px), unless the case says more.
fn check(name: &str, sequence: &Arc<Sequence>, plane: Plane, p99_px: f64) -> Finished {
    let (found, done) = errors(sequence, plane);
    eprintln!(
        "{name}: rms {:.2e}, p99 {:.2e}, max {:.2e} px over {}, {} missing; {:?}, {:?}",
        found.rms_px,
        found.p99_px,
        found.max_px,
        found.compared,
        found.missing,
        done.plan.temporal,
        done.plan.blur
    );
    assert!(found.compared > 10_000, "{name}: {found:?}");
    assert_eq!(found.missing, 0, "{name}: {found:?}");
    assert!(found.p99_px <= p99_px, "{name}: {found:?}");
    done
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_turn_of_36_degrees_in_one_window() {
    for (axis, name) in [(DVec3::X, "roll"), (DVec3::Y, "pitch"), (DVec3::Z, "yaw")] {
        let turning = steady(900.0, 0.0, DVec3::ZERO, axis * 120_f64.to_radians());
        let sequence = sequence(small(rolling(300.0, 0.0), -90.0), turning, pattern(6000.0));
        check(&format!("36 deg of {name}"), &sequence, GROUND, 1e-3);
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn vibration_of_200_hz_within_the_exposure() {
    let mut scenario = small(rolling(33.0, 5.0), -90.0);
    let shake =
        |axis, phase_deg| VibrationSpec { axis, amplitude_deg: 0.1, amplitude_m: 0.0, hz: 200.0, phase_deg };
    scenario.camera.mount.vibration = vec![shake(Axis::Pitch, 10.0), shake(Axis::Roll, 80.0)];
    let sequence =
        sequence(scenario, steady(150.0, 0.0, DVec3::new(0.0, 30.0, 0.0), DVec3::ZERO), pattern(6000.0));
    let done = check("200 Hz vibration, 5 ms exposure", &sequence, GROUND, 0.05);
    // One whole period: its ends alone see nothing.
    assert!(done.plan.blur.is_some_and(|blur| blur.solved() >= 5), "{:?}", done.plan.blur);
}

/// An upright wall to the north, seen by a camera that looks and flies north.
fn wall(distance_m: f64) -> (Scene, Plane) {
    let half_m = 40.0;
    let corner = |e: f32, d: f32| MeshVertex::new([0.0, e, d], [0.5 + e / 80.0, 0.5 + d / 80.0]);
    let h = half_m as f32;
    let vertices = vec![corner(-h, -h), corner(h, -h), corner(h, h), corner(-h, h)];
    let texture = pattern(1.0).meshes[0].material.texture.clone();
    let mesh = Mesh::new(
        vertices,
        vec![0, 1, 2, 0, 2, 3],
        texture,
        DVec3::new(distance_m, 0.0, -500.0),
        Wrap::Clamp,
    );
    let plane = Plane { at_ned_m: mesh.origin_ned_m, normal_ned: DVec3::X, half_m };
    (Scene { meshes: vec![mesh], sky_linear: [0.2, 0.4, 0.8], ..Scene::default() }, plane)
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn straight_at_a_wall() {
    // 80 m/s and 100 ms: +-4 m about the middle. t_z w reaches 0.4, 0.8 and 0.95.
    for (distance_m, p99_px) in [(10.0, 0.05), (5.0, 0.05), (4.2, 0.05)] {
        let (scene, plane) = wall(distance_m);
        let flying = steady(500.0, 0.0, DVec3::new(80.0, 0.0, 0.0), DVec3::ZERO);
        let sequence = sequence(small(rolling(100.0, 0.0), 0.0), flying, scene);
        check(&format!("at a wall, t_z w up to {:.2}", 4.0 / distance_m), &sequence, plane, p99_px);
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn skyline_and_ground_to_the_horizon() {
    // Sky has no depth (w = 0): it must follow the rotation alone, while the ground below it shifts.
    let flying = steady(40.0, 20.0, DVec3::new(30.0, 10.0, 0.0), DVec3::new(0.3, -0.2, 0.8));
    let sequence = sequence(small(rolling(33.0, 4.0), 0.0), flying, pattern(6000.0));
    check("skyline", &sequence, GROUND, 0.05);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn a_metre_and_65_km_in_one_frame() {
    let plane = Plane { half_m: 65_000.0, ..GROUND };
    let flying = steady(1.2, 0.0, DVec3::new(2.0, 1.0, 0.0), DVec3::new(0.0, 0.1, 0.3));
    let sequence = sequence(small(rolling(33.0, 0.0), -24.0), flying, pattern(130_000.0));
    check("1 m and 65 km", &sequence, plane, 0.05);
}

/// [`steady`] about another position and another time.
fn moved(at_ned_m: DVec3, at_s: f64) -> Trajectory {
    let first = BodyState {
        position_ned_m: at_ned_m + DVec3::new(-25.0, -60.0, -120.0),
        velocity_ned_m_s: DVec3::new(25.0, 60.0, 0.0),
        ned_from_body: DQuat::from_euler(EulerRot::ZYX, 0.3, 0.1, -0.1),
        rate_body_rad_s: DVec3::new(0.2, -0.3, 0.9),
        ..BodyState::default()
    };
    Trajectory::uniform(at_s - 1.0, 4.0, at_s + 3.0, vec![first]).expect("one segment")
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn far_from_the_origin_of_position_and_time() {
    let near = DVec3::ZERO;
    // 100 km north-east, whole metres and a fraction that f32 would lose (its step there is 8 mm).
    let far = DVec3::new(100_000.013, -99_999.257, -12.0);
    for (name, position, at_s) in
        [("at the origin", near, 0.0), ("100 km away", far, 0.0), ("at t = 1e9 s", near, 1e9)]
    {
        let mut scene = pattern(6000.0);
        scene.meshes[0].origin_ned_m = position;
        let mut sequence = sequence(small(rolling(33.0, 8.0), -90.0), moved(position, at_s), scene);
        Arc::get_mut(&mut sequence).expect("the only owner").start_s = at_s;
        check(name, &sequence, Plane { at_ned_m: position, ..GROUND }, 0.05);
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn unix_time_reaches_the_rows_unrounded() {
    let mut sequence = sequence(small(rolling(33.0, 0.0), -90.0), moved(DVec3::ZERO, 0.0), pattern(6000.0));
    // The clock is whole nanoseconds; only times from the log's first row are floating point.
    let epoch_ns = 1_700_000_000_123_456_789;
    Arc::get_mut(&mut sequence).expect("the only owner").epoch_ns = epoch_ns;
    let done = render_at_phase(&engine(), &sequence, &[Channel::Rows], 0, 0.0);
    for row in &done.frame.rows {
        let exact_ns = 33e6 * ((f64::from(row.row) + 0.5) / 120.0 - 0.5);
        assert!(((row.t_mid_ns - epoch_ns) as f64 - exact_ns).abs() <= 1.0, "{row:?} {exact_ns}");
    }
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn no_time_shift_is_the_identity() {
    // Moving fast and oblique, but every pixel has the instant of the ideal frame: one line, one instant.
    let flying = steady(60.0, 0.0, DVec3::new(80.0, 20.0, 30.0), DVec3::new(0.5, -0.7, 2.0));
    let mut scenario = small(rolling(0.0, 0.0), -60.0);
    scenario.quality.max_error_px = 1e-4;
    // Each from an ideal frame of its own: over a plane they would share one.
    scenario.quality.frames_per_ideal = 1;
    let sequence = sequence(scenario, flying, pattern(6000.0));
    let done = check("no time shift", &sequence, GROUND, 1e-4);
    assert_eq!(done.plan.temporal, TemporalStage::Identity);
    // The delay is taken by the key's own instant.
    let mut scenario = sequence.scenario.clone();
    scenario.camera.shutter.delay_ms = 700.0;
    let delayed = common::sequence(
        scenario,
        steady(60.0, 0.0, DVec3::new(80.0, 20.0, 3.0), DVec3::new(0.5, -0.7, 0.2)),
        pattern(6000.0),
    );
    let done = check("700 ms of delay", &delayed, GROUND, 1e-4);
    assert_eq!(done.plan.temporal, TemporalStage::Identity);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn what_is_behind_the_camera_stays_there() {
    // A ground that ends behind the camera's image plane, and a camera that turns 60 deg in one window
    // towards it.
    let mut scene = pattern(6000.0);
    scene.meshes[0].origin_ned_m = DVec3::new(-3010.0, 0.0, 0.0);
    let plane = Plane { at_ned_m: scene.meshes[0].origin_ned_m, ..GROUND };
    let turning =
        steady(30.0, 0.0, DVec3::new(5.0, 0.0, 0.0), DVec3::new(0.0, -60_f64.to_radians() / 0.3, 0.0));
    let sequence = sequence(small(rolling(300.0, 0.0), -30.0), turning, scene);
    check("ground behind the camera", &sequence, plane, 0.05);
}

#[test]
#[cfg_attr(skip_gpu, ignore = "CAMSIM_SKIP_GPU is set")]
fn at_the_gimbals_pole() {
    // Nose straight up, yaw and roll the same axis; the camera looks along the nose's back at the ground.
    let mut start = moved(DVec3::ZERO, 0.0).knots()[0];
    start.ned_from_body = DQuat::from_euler(EulerRot::ZYX, 0.4, std::f64::consts::FRAC_PI_2, 0.0);
    start.rate_body_rad_s = DVec3::new(0.8, 0.3, -0.4);
    let path = Trajectory::uniform(-1.0, 4.0, 3.0, vec![start]).expect("one segment");
    let mut scenario = small(rolling(33.0, 8.0), 180.0);
    // The body turns for a second before the stamp; follow it with the mount.
    let at_stamp = path.state(0.0).ned_from_body.inverse() * DVec3::Z;
    let pitch = (-at_stamp.z).atan2(at_stamp.x.hypot(at_stamp.y));
    let yaw = at_stamp.y.atan2(at_stamp.x);
    scenario.camera.mount.angles_deg = [0.0, pitch.to_degrees(), yaw.to_degrees()];
    let sequence = sequence(scenario, path, pattern(6000.0));
    check("nose up", &sequence, GROUND, 0.05);
}
