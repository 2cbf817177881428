//! Flight log: poses of the platform over time.

use glam::{DQuat, DVec3};

/// One good row of a flight log.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LogRow {
    /// Seconds since the first good row.
    pub t_s: f64,
    /// Position in NED, metres.
    pub position_ned_m: DVec3,
    /// Rotation that takes body (FRD) coordinates to NED.
    pub ned_from_body: DQuat,
}
