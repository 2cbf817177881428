//! Flights for tests.

#![allow(clippy::unwrap_used)]

use camsim_core::{mount::CameraPath, pose::BodyState, scenario::MountSpec, trajectory::Trajectory};
use glam::DVec3;

pub(crate) const SPEED_M_S: f64 = 40.0;

/// Level, 150 m above the origin at 0 s, looking down.
pub(crate) fn flying_east() -> CameraPath {
    flying_east_from(DVec3::new(0.0, 0.0, -150.0), -90.0)
}

/// Level from somewhere at 0 s, looking up by so many degrees to the north.
pub(crate) fn flying_east_from(from_ned_m: DVec3, up_deg: f64) -> CameraPath {
    let state = |t_s: f64| BodyState {
        position_ned_m: from_ned_m + SPEED_M_S * t_s * DVec3::Y,
        velocity_ned_m_s: DVec3::new(0.0, SPEED_M_S, 0.0),
        ..BodyState::default()
    };
    let mount = MountSpec { angles_deg: [0.0, up_deg, 0.0], ..MountSpec::default() };
    let knots = (0..=20).map(|k| state(0.1 * f64::from(k) - 1.0)).collect();
    CameraPath::new(Trajectory::uniform(-1.0, 0.1, 1.0, knots).unwrap(), &mount).unwrap()
}
