//! Mount: position and orientation of the camera on the platform, with lever arm and vibration (eqs. 3-5 of
//! the paper without their approximations).
//!
//! With the body at position x and attitude R, body rate w, mount M (constant), vibration rotation V(t) =
//! Exp(theta(t)) and displacement d(t):
//!
//! ```text
//! ned_from_camera = R V(t) M                 optical centre = x + R (lever + d(t))
//! velocity        = v + R (w x (lever + d) + d')
//! rate in camera  = (V M)^T (w + J(theta) theta'),  J the left Jacobian of Exp
//! ```
//!
//! M rotates optical camera axes to body axes: at angles (0, 0, 0) the camera's z is the nose, its x the
//! right wing, its y the belly; roll, pitch and yaw then rotate it like a body (ZYX). Pitch -90 deg looks
//! straight down with the top of the image towards the nose. Vibration is applied before the mount, so its
//! axes are those of the body for any orientation of the camera. The components of theta are the sums of
//! `amplitude sin(2 pi hz t + phase)` over the roll, pitch and yaw entries; the rotation is about the optical
//! centre.

use std::sync::Arc;

use glam::{DMat3, DQuat, DVec3};
use thiserror::Error;

use crate::{
    pose::{BodyState, CameraPose, FRD_FROM_RDF},
    scenario::{Axis, MountSpec},
    trajectory::{Trajectory, so3},
};

mod vibration;

pub(crate) use vibration::Vibration;

/// Invalid mount parameters.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum MountError {
    /// NaN or infinity.
    #[error("camera.mount.{key} holds a number that is not finite; give plain numbers")]
    NotFinite {
        /// The key.
        key: &'static str,
    },
    /// The amplitude given is of the wrong kind for the axis.
    #[error(
        "camera.mount.vibration entry {entry} (counted from 1): axis {axis:?} takes `{wanted}`, not `{given}`"
    )]
    WrongAmplitude {
        /// Counted from 1.
        entry: usize,
        /// Its axis.
        axis: Axis,
        /// The key that this axis takes.
        wanted: &'static str,
        /// The key that was given.
        given: &'static str,
    },
    /// Negative, NaN or infinite frequency, amplitude or phase.
    #[error(
        "camera.mount.vibration entry {entry} (counted from 1): amplitude and phase must be finite, hz finite and not negative"
    )]
    BadVibration {
        /// Counted from 1.
        entry: usize,
    },
}

/// Pose, velocity and rate of the camera at any instant. Cheap to clone.
#[derive(Clone, Debug)]
pub struct CameraPath {
    /// Motion of the platform.
    pub trajectory: Arc<Trajectory>,
    body_from_camera: DQuat,
    lever_body_m: DVec3,
    vibration: Vibration,
}

/// Contribution of the mount at one instant.
struct Offset {
    body_from_camera: DQuat,
    lever_body_m: DVec3,
    lever_rate_body_m_s: DVec3,
    rate_body_rad_s: DVec3,
}

impl CameraPath {
    /// The camera mounted by `spec` on a platform that flies `trajectory`.
    pub fn new(trajectory: impl Into<Arc<Trajectory>>, spec: &MountSpec) -> Result<Self, MountError> {
        for (key, values) in [("angles_deg", spec.angles_deg), ("offset_m", spec.offset_m)] {
            if !values.iter().all(|value| value.is_finite()) {
                return Err(MountError::NotFinite { key });
            }
        }
        Ok(Self {
            trajectory: trajectory.into(),
            body_from_camera: body_from_camera(spec.angles_deg),
            lever_body_m: DVec3::from_array(spec.offset_m),
            vibration: Vibration::new(&spec.vibration)?,
        })
    }

    /// The path of a camera at the same position whose axes are turned.
    #[must_use]
    pub fn turned(&self, camera_from_turned: DQuat) -> Self {
        Self { body_from_camera: self.body_from_camera * camera_from_turned, ..self.clone() }
    }

    /// First and last instant of the log, seconds. Outside, the platform coasts and the mount continues to
    /// vibrate.
    pub fn span_s(&self) -> (f64, f64) {
        self.trajectory.span_s()
    }

    /// Pose of the camera at `t_s`.
    pub fn pose(&self, t_s: f64) -> CameraPose {
        let (body, offset) = self.at(t_s);
        CameraPose {
            position_ned_m: body.position_ned_m + body.ned_from_body * offset.lever_body_m,
            ned_from_camera: body.ned_from_body * offset.body_from_camera,
        }
    }

    /// Velocity of the optical centre in NED at `t_s`, m/s.
    pub fn velocity_ned(&self, t_s: f64) -> DVec3 {
        let (body, offset) = self.at(t_s);
        body.velocity_ned_m_s
            + body.ned_from_body
                * (body.rate_body_rad_s.cross(offset.lever_body_m) + offset.lever_rate_body_m_s)
    }

    /// Angular rate of the camera relative to NED at `t_s`, in optical camera axes, rad/s.
    pub fn rate_camera(&self, t_s: f64) -> DVec3 {
        let (body, offset) = self.at(t_s);
        offset.body_from_camera.inverse() * (body.rate_body_rad_s + offset.rate_body_rad_s)
    }

    /// Highest frequency of any vibration with an amplitude, hertz; 0 for a rigid mount.
    pub fn highest_vibration_hz(&self) -> f64 {
        self.vibration.highest_hz()
    }

    /// Bound on the vibration's angle at any time, radians; 0 for a rigid mount.
    pub fn peak_vibration_rad(&self) -> f64 {
        self.vibration.peak_rad()
    }

    /// Inlined, so that poses, the most frequent query, skip all rates.
    #[inline(always)]
    fn at(&self, t_s: f64) -> (BodyState, Offset) {
        let body = self.trajectory.state(t_s);
        let mut offset = Offset {
            body_from_camera: self.body_from_camera,
            lever_body_m: self.lever_body_m,
            lever_rate_body_m_s: DVec3::ZERO,
            rate_body_rad_s: DVec3::ZERO,
        };
        // A sine has no value at an infinite instant. The trajectory stands still there, and so does the
        // mount.
        if t_s.is_finite() {
            if let Some((angle_rad, angle_rate_rad_s)) = self.vibration.turn(t_s) {
                offset.body_from_camera = so3::exp(angle_rad) * self.body_from_camera;
                offset.rate_body_rad_s = so3::left_jacobian_times(angle_rad, angle_rate_rad_s);
            }
            if let Some((shift_m, shift_rate_m_s)) = self.vibration.shift(t_s) {
                offset.lever_body_m += shift_m;
                offset.lever_rate_body_m_s = shift_rate_m_s;
            }
        }
        (body, offset)
    }
}

/// Rotation from optical camera axes to body axes for roll, pitch, yaw in degrees.
#[must_use]
pub fn body_from_camera([roll_deg, pitch_deg, yaw_deg]: [f64; 3]) -> DQuat {
    let turned = DQuat::from_rotation_z(yaw_deg.to_radians())
        * DQuat::from_rotation_y(pitch_deg.to_radians())
        * DQuat::from_rotation_x(roll_deg.to_radians());
    (turned * FRD_FROM_RDF).normalize()
}

/// Most that two rotation matrices differ that are the same to the rounding of a few products.
const SAME_ROTATION: f64 = 2e-15;

/// Roll, pitch, yaw in degrees of [`body_from_camera`]: the shortest decimals that give the rotation to rounding.
/// Where the camera looks straight up or down roll is 0, as only its sum with yaw counts there.
#[must_use]
pub fn mount_angles_deg(body_from_camera_axes: DQuat) -> [f64; 3] {
    let turned = DMat3::from_quat(body_from_camera_axes * FRD_FROM_RDF.inverse());
    // Entries by row and column.
    let m = |row: usize, column: usize| turned.col(column)[row];
    let pitch = (-m(2, 0)).atan2(m(0, 0).hypot(m(1, 0)));
    let yaw = m(1, 0).atan2(m(0, 0));
    // Of a yaw that is rounding noise, the roll that goes with it.
    let (sin, cos) = yaw.sin_cos();
    let roll = (sin * m(0, 2) - cos * m(1, 2)).atan2(cos * m(1, 1) - sin * m(0, 1));
    let upright = [0.0, pitch, (-m(0, 1)).atan2(m(1, 1))];
    let wanted = DMat3::from_quat(body_from_camera_axes);
    let is_same = |angles_deg: [f64; 3]| {
        let difference = DMat3::from_quat(body_from_camera(angles_deg)) - wanted;
        difference.abs_diff_eq(DMat3::ZERO, SAME_ROTATION)
    };
    let degrees = |angles: [f64; 3]| angles.map(|angle| angle.to_degrees() + 0.0);
    let candidates = [degrees(upright), degrees([roll, pitch, yaw])];
    let shortest = candidates.into_iter().find_map(|angles| {
        (0..=13).map(|decimals| angles.map(|angle| rounded(angle, decimals))).find(|angles| is_same(*angles))
    });
    shortest.unwrap_or(candidates[1])
}

/// An angle rounded to decimal places; -180 is 180.
fn rounded(angle_deg: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    let short = (angle_deg * scale).round() / scale + 0.0;
    if short == -180.0 { 180.0 } else { short }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::scenario::VibrationSpec;

    fn body(velocity_ned_m_s: DVec3, ned_from_body: DQuat, rate_body_rad_s: DVec3) -> Trajectory {
        let state = BodyState {
            position_ned_m: DVec3::new(100.0, 200.0, -300.0),
            velocity_ned_m_s,
            ned_from_body,
            rate_body_rad_s,
            ..BodyState::default()
        };
        Trajectory::uniform(0.0, 10.0, 10.0, vec![state]).unwrap()
    }

    fn level(yaw_deg: f64) -> Trajectory {
        body(DVec3::ZERO, DQuat::from_rotation_z(yaw_deg.to_radians()), DVec3::ZERO)
    }

    fn mount(angles_deg: [f64; 3]) -> MountSpec {
        MountSpec { angles_deg, ..MountSpec::default() }
    }

    /// NED directions of image right, image up and the optical axis.
    fn directions(path: &CameraPath) -> [DVec3; 3] {
        let q = path.pose(1.0).ned_from_camera;
        [q * DVec3::X, q * -DVec3::Y, q * DVec3::Z]
    }

    #[test]
    fn mount_angles_follow_the_conventions() {
        let (north, east, down) = (DVec3::X, DVec3::Y, DVec3::Z);
        let h = std::f64::consts::FRAC_1_SQRT_2;
        for (yaw_deg, angles_deg, expected) in [
            (0.0, [0.0, 0.0, 0.0], [east, -down, north]),
            (0.0, [0.0, -90.0, 0.0], [east, north, down]),
            (90.0, [0.0, -90.0, 0.0], [-north, east, down]),
            (0.0, [0.0, 0.0, 90.0], [-north, -down, east]),
            (0.0, [90.0, 0.0, 0.0], [down, east, north]),
            (0.0, [0.0, -45.0, 0.0], [east, DVec3::new(h, 0.0, -h), DVec3::new(h, 0.0, h)]),
        ] {
            let path = CameraPath::new(level(yaw_deg), &mount(angles_deg)).unwrap();
            for (direction, expected) in directions(&path).into_iter().zip(expected) {
                assert!(
                    (direction - expected).length() < 1e-15,
                    "yaw {yaw_deg}, mount {angles_deg:?}: {direction}"
                );
            }
        }
    }

    #[test]
    fn angles_come_back_from_the_rotation() {
        for angles_deg in [
            [0.0, 0.0, 0.0],
            [0.0, -90.0, 0.0],
            [0.0, 90.0, 30.0],
            [0.0, -90.0, -135.5],
            [3.0, -60.0, 20.0],
            [-178.25, 12.345_678_9, 179.0],
            [90.0, 0.0, 180.0],
            [0.1, -89.999, 45.0],
        ] {
            // Through a pose of another body and back, as files have it.
            let other = DQuat::from_euler(glam::EulerRot::ZYX, 0.3, -1.1, 2.0);
            let through = other.inverse() * (other * body_from_camera(angles_deg)).normalize();
            assert_eq!(mount_angles_deg(through), angles_deg);
        }
        // Any rotation, to rounding.
        for i in 0..1000 {
            let x = f64::from(i);
            let axis = DVec3::new((1.3 * x).sin(), (2.1 * x).cos(), (0.7 * x).sin());
            let rotation = DQuat::from_scaled_axis(axis * (0.01 * x));
            let back = DMat3::from_quat(body_from_camera(mount_angles_deg(rotation)));
            assert!(back.abs_diff_eq(DMat3::from_quat(rotation), 4e-15), "{i}");
        }
    }

    fn shaken() -> CameraPath {
        let entry = |axis, amplitude_deg, amplitude_m, hz, phase_deg| VibrationSpec {
            axis,
            amplitude_deg,
            amplitude_m,
            hz,
            phase_deg,
        };
        let spec = MountSpec {
            angles_deg: [3.0, -60.0, 20.0],
            offset_m: [1.5, -0.2, 0.4],
            vibration: vec![
                entry(Axis::Roll, 0.2, 0.0, 100.0, 10.0),
                entry(Axis::Pitch, 5.0, 0.0, 3.0, -70.0),
                entry(Axis::Yaw, 1.0, 0.0, 17.0, 0.0),
                entry(Axis::X, 0.0, 0.01, 40.0, 90.0),
                entry(Axis::Z, 0.0, 0.002, 80.0, 0.0),
            ],
        };
        let attitude = so3::exp(DVec3::new(0.3, -0.2, 2.0));
        CameraPath::new(body(DVec3::new(12.0, 3.0, -1.0), attitude, DVec3::new(0.5, -0.3, 0.8)), &spec)
            .unwrap()
    }

    #[test]
    fn velocity_and_rate_are_derivatives_of_the_pose() {
        let path = shaken();
        let h = 1e-6;
        for i in 0..200 {
            let t_s = 0.0431 * f64::from(i);
            let (before, after) = (path.pose(t_s - h), path.pose(t_s + h));
            let velocity = (after.position_ned_m - before.position_ned_m) / (2.0 * h);
            let rate = so3::log(before.ned_from_camera.inverse() * after.ned_from_camera) / (2.0 * h);
            // Rounding: 1e-13 m over 2 us. Third derivative of 0.2 deg at 100 Hz: h^2/6 * 9e5 rad/s^3 =
            // 1.5e-7 rad/s.
            assert!((velocity - path.velocity_ned(t_s)).length() < 1e-6);
            assert!((rate - path.rate_camera(t_s)).length() < 5e-7);
        }
    }

    #[test]
    fn lever_arm_is_exact() {
        let spec = MountSpec { offset_m: [2.0, 0.0, 0.0], ..MountSpec::default() };
        let path =
            CameraPath::new(body(DVec3::ZERO, DQuat::IDENTITY, DVec3::new(0.0, 0.0, 1.0)), &spec).unwrap();
        let (sin, cos) = 1.0f64.sin_cos();
        assert!(
            (path.pose(1.0).position_ned_m - DVec3::new(100.0 + 2.0 * cos, 200.0 + 2.0 * sin, -300.0))
                .length()
                < 1e-12
        );
        assert!((path.velocity_ned(1.0) - DVec3::new(-2.0 * sin, 2.0 * cos, 0.0)).length() < 1e-12);
        // A level camera that looks along the nose yaws about its own downward y.
        assert!((path.rate_camera(1.0) - DVec3::Y).length() < 1e-15);
    }

    #[test]
    fn vibration_bounds_for_the_planner() {
        let path = shaken();
        assert!((path.highest_vibration_hz() - 100.0).abs() < 1e-9);
        assert!((path.peak_vibration_rad().to_degrees() - (0.04f64 + 25.0 + 1.0).sqrt()).abs() < 1e-9);
        let rigid = CameraPath::new(level(0.0), &MountSpec::default()).unwrap();
        assert_eq!((rigid.highest_vibration_hz(), rigid.peak_vibration_rad()), (0.0, 0.0));
    }

    #[test]
    fn invalid_mounts_are_refused_and_any_time_is_finite() {
        assert_eq!(
            CameraPath::new(level(0.0), &mount([f64::NAN, 0.0, 0.0])).unwrap_err(),
            MountError::NotFinite { key: "angles_deg" }
        );
        let vibration = |axis, amplitude_deg, amplitude_m, hz| MountSpec {
            vibration: vec![VibrationSpec { axis, amplitude_deg, amplitude_m, hz, phase_deg: 0.0 }],
            ..MountSpec::default()
        };
        let wrong = CameraPath::new(level(0.0), &vibration(Axis::Roll, 0.0, 0.1, 5.0)).unwrap_err();
        assert!(wrong.to_string().contains("takes `amplitude_deg`"), "{wrong}");
        assert!(CameraPath::new(level(0.0), &vibration(Axis::X, 1.0, 0.0, 5.0)).is_err());
        assert!(CameraPath::new(level(0.0), &vibration(Axis::X, 0.0, 0.1, -5.0)).is_err());
        assert!(CameraPath::new(level(0.0), &vibration(Axis::X, 0.0, f64::INFINITY, 5.0)).is_err());
        let path = shaken();
        for t_s in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300, -1e12] {
            let pose = path.pose(t_s);
            assert!(pose.position_ned_m.is_finite() && pose.ned_from_camera.is_finite(), "{t_s}");
        }
    }
}
