//! An imu on a camera that vibrates.

use super::*;
use crate::{
    mount::CameraPath,
    scenario::{Axis, MountSpec, SensorAxes, SensorCarrier, SensorMountSpec, VibrationSpec},
};

fn vibration(axis: Axis, amplitude: f64, hz: f64, phase_deg: f64) -> VibrationSpec {
    let turns = matches!(axis, Axis::Roll | Axis::Pitch | Axis::Yaw);
    let (amplitude_deg, amplitude_m) = if turns { (amplitude, 0.0) } else { (0.0, amplitude) };
    VibrationSpec { axis, amplitude_deg, amplitude_m, hz, phase_deg }
}

fn on_camera(offset_m: [f64; 3]) -> ImuSpec {
    let mount = SensorMountSpec { offset_m, ..SensorMountSpec::default() };
    ImuSpec { rate_hz: 1000.0, attached_to: SensorCarrier::Camera, mount, ..ImuSpec::default() }
}

/// A platform at rest with a camera that vibrates.
fn at_rest(vibration: Vec<VibrationSpec>, offset_m: [f64; 3]) -> SensorInput {
    let camera_mount = MountSpec { offset_m, vibration, ..MountSpec::default() };
    SensorInput { camera_mount, ..input(still(DQuat::IDENTITY), None, [0.0, 0.5]) }
}

const G: DVec3 = DVec3::new(0.0, 0.0, -9.806_65);

#[test]
fn a_translation_is_felt_as_its_second_derivative() {
    let (amplitude_m, hz) = (0.002, 40.0);
    let input = at_rest(vec![vibration(Axis::X, amplitude_m, hz, 30.0)], [0.3, 0.0, 0.1]);
    let w = std::f64::consts::TAU * hz;
    for sample in imu(on_camera([0.3, 0.0, 0.2]), &input).samples() {
        let angle = w * sample.time.t_s + 30_f64.to_radians();
        let felt = G - DVec3::X * (amplitude_m * w * w * angle.sin());
        assert!((sample.true_accel_m_s2 - felt).length() < 1e-10, "{}", sample.true_accel_m_s2);
        assert_eq!(sample.true_gyro_rad_s, DVec3::ZERO);
        let position = DVec3::new(10.3 + amplitude_m * angle.sin(), -20.0, -29.8);
        assert!((sample.position_ned_m - position).length() < 1e-12);
    }
    let on_body = ImuSpec { attached_to: SensorCarrier::Body, ..on_camera([0.3, 0.0, 0.2]) };
    assert!(imu(on_body, &input).samples().all(|sample| sample.true_accel_m_s2 == G));
}

#[test]
fn a_rotation_is_felt_as_swing_about_the_optical_centre() {
    // Pitch angle theta; the unit is ahead of the optical centre by r: it feels -theta'^2 r along its own x, and
    // -theta'' r along its z, and gravity in its own axes.
    let (amplitude, hz, r) = (2_f64.to_radians(), 25.0, 0.05);
    let input = at_rest(vec![vibration(Axis::Pitch, 2.0, hz, 0.0)], [1.0, 0.0, 0.0]);
    let w = std::f64::consts::TAU * hz;
    let samples: Vec<ImuSample> = imu(on_camera([1.0 + r, 0.0, 0.0]), &input).samples().collect();
    assert_eq!(samples.len(), 501);
    for sample in &samples {
        let (sin, cos) = (w * sample.time.t_s).sin_cos();
        let (theta, rate, acceleration) = (amplitude * sin, amplitude * w * cos, -amplitude * w * w * sin);
        let g = 9.806_65;
        let felt = DVec3::new(g * theta.sin() - rate * rate * r, 0.0, -g * theta.cos() - acceleration * r);
        assert!((sample.true_accel_m_s2 - felt).length() < 1e-10, "{} {felt}", sample.true_accel_m_s2);
        assert!((sample.true_gyro_rad_s - DVec3::Y * rate).length() < 1e-12);
    }
}

/// Independent of derivatives in closed form: those of the camera's pose by differences, in flight.
#[test]
fn in_flight_the_unit_moves_as_the_camera_does() {
    let entries = vec![
        vibration(Axis::Roll, 3.0, 7.0, 10.0),
        vibration(Axis::Pitch, 5.0, 3.0, -70.0),
        vibration(Axis::Yaw, 4.0, 11.0, 0.0),
        vibration(Axis::Y, 0.01, 9.0, 90.0),
        vibration(Axis::Z, 0.02, 5.0, 0.0),
    ];
    let camera_mount = MountSpec { offset_m: [1.5, -0.2, 0.4], vibration: entries, ..MountSpec::default() };
    let input = SensorInput { camera_mount: camera_mount.clone(), ..input(flown(6.0), None, [2.001, 2.999]) };
    let path = CameraPath::new(input.trajectory.clone(), &camera_mount).unwrap();
    // Axes of the camera, 0.1 m below its optical centre (the camera's y is down).
    let spec = ImuSpec { axes: SensorAxes::Rdf, rate_hz: 97.0, ..on_camera([1.5, -0.2, 0.5]) };
    let position = |t_s: f64| {
        let pose = path.pose(t_s);
        pose.position_ned_m + pose.ned_from_camera * DVec3::new(0.0, 0.1, 0.0)
    };
    // Shorter than from any sample to a knot of the trajectory, at which its acceleration jumps.
    let step_s = 2e-5;
    for sample in imu(spec, &input).samples() {
        let t_s = sample.time.t_s;
        let (before, here, after) = (position(t_s - step_s), position(t_s), position(t_s + step_s));
        let pose = path.pose(t_s);
        assert!((sample.position_ned_m - here).length() < 1e-12);
        assert!(sample.ned_from_sensor.angle_between(pose.ned_from_camera) < 1e-7);
        assert!((sample.true_gyro_rad_s - path.rate_camera(t_s)).length() < 1e-12);
        // Rounding of 100 m by some ulp of 1.4e-14 over step^2.
        let velocity = (after - before) / (2.0 * step_s);
        assert!((sample.velocity_ned_m_s - velocity).length() < 1e-4);
        let acceleration = (after - 2.0 * here + before) / (step_s * step_s);
        let felt = pose.ned_from_camera.inverse() * (acceleration + G);
        let off = (sample.true_accel_m_s2 - felt).length();
        assert!(off < 1e-3, "{t_s}: {off}");
    }
}
