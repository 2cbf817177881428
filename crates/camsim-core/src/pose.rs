//! Poses and motion states. The world is local NED in metres (f64), the body FRD, the camera optical (x
//! right, y down, z forward).

use std::f64::consts::FRAC_1_SQRT_2;

use glam::{DMat3, DQuat, DVec3};

/// Takes optical camera axes to those of a body that looks the same way.
pub const FRD_FROM_RDF: DQuat = DQuat::from_xyzw(0.5, 0.5, 0.5, 0.5);
/// Takes axes forward, right, down to forward, left, up, and back: half a turn about the first.
pub const FLU_FROM_FRD: DQuat = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);
/// Takes axes north, east, down to east, north, up, and back: half a turn about north-east.
pub const ENU_FROM_NED: DQuat = DQuat::from_xyzw(FRAC_1_SQRT_2, FRAC_1_SQRT_2, 0.0, 0.0);

/// Full motion state of the platform at one instant.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BodyState {
    /// Position in NED, metres.
    pub position_ned_m: DVec3,
    /// Velocity in NED, m/s.
    pub velocity_ned_m_s: DVec3,
    /// Acceleration in NED, m/s^2.
    pub acceleration_ned_m_s2: DVec3,
    /// Rotation that takes body (FRD) coordinates to NED.
    pub ned_from_body: DQuat,
    /// Angular rate of the body relative to NED, in body axes, rad/s.
    pub rate_body_rad_s: DVec3,
    /// Time derivative of `rate_body_rad_s`, rad/s^2.
    pub angular_acceleration_body_rad_s2: DVec3,
}

/// Position and attitude of the camera at one instant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraPose {
    /// Optical centre in NED, metres.
    pub position_ned_m: DVec3,
    /// Rotation that takes optical camera coordinates to NED.
    pub ned_from_camera: DQuat,
}

impl CameraPose {
    /// Relative pose that takes coordinates of `self` to coordinates of `other`: `x_other = R x_self + t`, in
    /// f64.
    pub fn relative_to(&self, other: &Self) -> (DMat3, DVec3) {
        let other_from_ned = other.ned_from_camera.inverse();
        let rotation = DMat3::from_quat((other_from_ned * self.ned_from_camera).normalize());
        (rotation, other_from_ned * (self.position_ned_m - other.position_ned_m))
    }
}

/// Components of a quaternion, scalar first.
#[must_use]
pub fn wxyz(q: DQuat) -> [f64; 4] {
    [q.w, q.x, q.y, q.z]
}
