//! Motion about the stamp: a constant twist of the camera, a table of its poses, or an optical flow.

use glam::{DMat3, DQuat, DVec3};

use super::FlowField;
use crate::{
    temporal::displacement::Twist,
    trajectory::so3::{exp, left_jacobian_times, log},
};

/// Least number of instants at which the path over an exposure is evaluated.
const INSTANTS: u32 = 32;
/// Tolerance for tables that end too early, seconds: rounding of time stamps.
const COVER_SLACK_S: f64 = 1e-6;

/// Motion during the frame; times are seconds from the stamp.
#[derive(Clone, Debug, PartialEq)]
pub enum Motion {
    /// Constant velocity and angular rate in camera axes: the screw motion `exp(xi t)` on SE(3), whose
    /// displacement field is eq. 10 of the paper.
    Twist(Twist),
    /// Poses over time.
    Poses(PoseTrack),
    /// Displacement of each pixel of the ideal frame, by any motion.
    Flow(FlowField),
}

impl Motion {
    /// Relative pose `x_key = R x_row + t` from the camera at `dt_s` to the camera at `instant_s`. For a
    /// flow, which does not separate the camera's motion, it is the identity.
    #[must_use]
    pub fn key_from(&self, dt_s: f64, instant_s: f64) -> (DMat3, DVec3) {
        match self {
            Self::Twist(twist) => {
                let shift_s = dt_s - instant_s;
                let turn = twist.rate_rad_s * shift_s;
                (DMat3::from_quat(exp(turn)), left_jacobian_times(turn, twist.velocity_m_s * shift_s))
            }
            Self::Poses(track) => {
                let (key, line) = (track.pose(instant_s), track.pose(dt_s));
                let camera_from_world = key.1.inverse();
                (
                    DMat3::from_quat((camera_from_world * line.1).normalize()),
                    camera_from_world * (line.0 - key.0),
                )
            }
            Self::Flow(_) => (DMat3::IDENTITY, DVec3::ZERO),
        }
    }

    /// Velocity and angular rate in camera axes at an instant, for solvers that hold them constant.
    #[must_use]
    pub fn twist_at(&self, instant_s: f64) -> Twist {
        match self {
            Self::Twist(twist) => *twist,
            Self::Poses(track) => track.twist_at(instant_s),
            Self::Flow(_) => Twist::default(),
        }
    }

    /// Whether the camera translates, so that depth matters. False for a flow.
    #[must_use]
    pub fn translates(&self) -> bool {
        match self {
            Self::Twist(twist) => twist.velocity_m_s != DVec3::ZERO,
            Self::Poses(track) => track.translates(),
            Self::Flow(_) => false,
        }
    }

    /// Checks that a time window is covered.
    ///
    /// # Errors
    /// A table of poses that begins later or ends earlier than the window.
    pub fn covers(&self, first_s: f64, last_s: f64) -> Result<(), PoseTrackError> {
        match self {
            Self::Twist(_) | Self::Flow(_) => Ok(()),
            Self::Poses(track) => track.covers(first_s, last_s),
        }
    }

    /// Longest time between two table rows in, or around the ends of, a window; 0 without a table.
    #[must_use]
    pub fn longest_step_s(&self, first_s: f64, last_s: f64) -> f64 {
        match self {
            Self::Twist(_) | Self::Flow(_) => 0.0,
            Self::Poses(track) => track.longest_step_s(first_s, last_s),
        }
    }

    /// Number of instants at which to evaluate the path over an exposure: four per table row, at least 32.
    #[must_use]
    pub fn instants(&self, exposure_s: f64) -> u32 {
        match self {
            Self::Twist(_) | Self::Flow(_) => INSTANTS,
            Self::Poses(track) => INSTANTS.max((4.0 * exposure_s / track.mean_step_s()).min(4096.0) as u32),
        }
    }
}

/// One row of a table of poses.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseRow {
    /// Time on the clock of the table, seconds.
    pub t_s: f64,
    /// Position of the optical centre in the world, metres.
    pub position_m: DVec3,
    /// Rotation from optical camera coordinates to the world. Its length need not be exactly 1.
    pub world_from_camera: DQuat,
}

/// Why a table of poses cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PoseTrackError {
    /// Fewer than two rows.
    #[error(
        "the trajectory has {0} row(s): at least two are needed to say how the camera moves; use [motion] velocity_m_s and angular_rate_rad_s for a constant twist"
    )]
    TooShort(usize),
    /// A row with invalid values.
    #[error("trajectory row {row}: {what}")]
    Row {
        /// Row number from 1, without the header.
        row: usize,
        /// What is wrong.
        what: &'static str,
    },
    /// The table does not cover the exposure of the frame.
    #[error(
        "the trajectory covers {from:+.6} s to {to:+.6} s about the stamp, the frame needs {first:+.6} s to {last:+.6} s: check stamp_s, or give more rows"
    )]
    Window {
        /// Begin of the table relative to the stamp, seconds.
        from: f64,
        /// End of the table relative to the stamp, seconds.
        to: f64,
        /// Begin of the frame's window, seconds.
        first: f64,
        /// End of the frame's window, seconds.
        last: f64,
    },
}

/// Poses over time about a stamp; between rows, translation is linear and rotation has a constant rate.
#[derive(Clone, Debug, PartialEq)]
pub struct PoseTrack {
    /// Rows with `t_s` relative to the stamp.
    rows: Vec<PoseRow>,
}

impl PoseTrack {
    /// Builds a track from rows on any clock and the stamp of the frame on the same clock.
    ///
    /// # Errors
    /// Fewer than two rows, numbers that are not finite, a quaternion that is no rotation, or times that do
    /// not ascend.
    pub fn new(mut rows: Vec<PoseRow>, stamp_s: f64) -> Result<Self, PoseTrackError> {
        if rows.len() < 2 {
            return Err(PoseTrackError::TooShort(rows.len()));
        }
        let mut before = f64::NEG_INFINITY;
        // Positions relative to the first: a table in UTM or earth-centred coordinates then keeps its
        // precision where it matters.
        let origin_m = rows[0].position_m;
        for (i, row) in rows.iter_mut().enumerate() {
            let fail = |what| Err(PoseTrackError::Row { row: i + 1, what });
            row.t_s -= stamp_s;
            row.position_m -= origin_m;
            let norm = row.world_from_camera.length();
            if !(row.t_s.is_finite() && row.position_m.is_finite() && norm.is_finite()) {
                return fail("has a value that is not finite; leave the row out");
            }
            if (norm - 1.0).abs() > 0.01 {
                return fail(
                    "has a quaternion that is not of unit length; its columns are qw,qx,qy,qz by name, and in TUM's order, which has no names, qx qy qz qw",
                );
            }
            if row.t_s <= before {
                return fail("is not later than the row before; sort by time and leave doubles out");
            }
            before = row.t_s;
            row.world_from_camera = row.world_from_camera.normalize();
        }
        Ok(Self { rows })
    }

    /// Positions are relative to the first.
    fn translates(&self) -> bool {
        self.rows.iter().any(|row| row.position_m != DVec3::ZERO)
    }

    fn covers(&self, first: f64, last: f64) -> Result<(), PoseTrackError> {
        let (from, to) = (self.rows[0].t_s, self.rows[self.rows.len() - 1].t_s);
        if from > first + COVER_SLACK_S || to < last - COVER_SLACK_S {
            return Err(PoseTrackError::Window { from, to, first, last });
        }
        Ok(())
    }

    fn longest_step_s(&self, first_s: f64, last_s: f64) -> f64 {
        let steps = self.rows.windows(2).map(|rows| [rows[0].t_s, rows[1].t_s]);
        steps
            .filter(|[from_s, to_s]| *to_s > first_s && *from_s < last_s)
            .map(|[from_s, to_s]| to_s - from_s)
            .fold(0.0, f64::max)
    }

    fn mean_step_s(&self) -> f64 {
        (self.rows[self.rows.len() - 1].t_s - self.rows[0].t_s) / (self.rows.len() - 1) as f64
    }

    /// The rows around an instant; outside of the table the outermost pair.
    fn bracket(&self, dt_s: f64) -> (&PoseRow, &PoseRow) {
        let after = self.rows.partition_point(|row| row.t_s <= dt_s).clamp(1, self.rows.len() - 1);
        (&self.rows[after - 1], &self.rows[after])
    }

    fn pose(&self, dt_s: f64) -> (DVec3, DQuat) {
        let (a, b) = self.bracket(dt_s);
        let fraction = (dt_s - a.t_s) / (b.t_s - a.t_s);
        let turn = log(a.world_from_camera.inverse() * b.world_from_camera);
        (a.position_m.lerp(b.position_m, fraction), a.world_from_camera * exp(turn * fraction))
    }

    fn twist_at(&self, dt_s: f64) -> Twist {
        let (a, b) = self.bracket(dt_s);
        let step_s = b.t_s - a.t_s;
        let (_, world_from_camera) = self.pose(dt_s);
        Twist {
            velocity_m_s: world_from_camera.inverse() * ((b.position_m - a.position_m) / step_s),
            // At a constant rate the rotation axis is fixed, so the rate is equal in the axes of either row.
            rate_rad_s: log(a.world_from_camera.inverse() * b.world_from_camera) / step_s,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn twist() -> Twist {
        Twist { velocity_m_s: DVec3::new(3.0, -2.0, 8.0), rate_rad_s: DVec3::new(0.3, -0.7, 1.1) }
    }

    /// A static point moves in the camera by eq. 10, dr/dt = -V - w x r. Integrated backwards in small steps.
    #[test]
    fn twist_matches_equation_10() {
        let motion = Motion::Twist(twist());
        for dt_s in [0.4, -0.3, 1e-9, 0.0] {
            let (rotation, shift) = motion.key_from(dt_s + 0.1, 0.1);
            let in_line = DVec3::new(1.0, -2.0, 9.0);
            let steps = 4000;
            let h = dt_s / f64::from(steps);
            let flow = |r: DVec3| -twist().velocity_m_s - twist().rate_rad_s.cross(r);
            // Classical Runge-Kutta from the row's instant back to the key instant: error below 1e-13 here.
            let in_key = (0..steps).fold(in_line, |r, _| {
                let k1 = flow(r);
                let k2 = flow(r - 0.5 * h * k1);
                let k3 = flow(r - 0.5 * h * k2);
                let k4 = flow(r - h * k3);
                r - h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
            });
            assert!((rotation * in_line + shift - in_key).length() < 1e-11, "{dt_s}");
        }
    }

    #[test]
    fn longest_step_includes_the_window_ends() {
        let row = |t_s: f64| PoseRow { t_s, position_m: DVec3::ZERO, world_from_camera: DQuat::IDENTITY };
        let track = Motion::Poses(
            PoseTrack::new([0.0, 0.1, 0.2, 3.2, 3.3].map(|t_s| row(100.0 + t_s)).to_vec(), 100.0).unwrap(),
        );
        for (window, expected) in [
            ([0.02, 0.08], 0.1),
            ([0.05, 0.15], 0.1),
            ([0.15, 0.25], 3.0),
            ([1.0, 1.1], 3.0),
            ([3.21, 3.25], 0.1),
        ] {
            let step_s = track.longest_step_s(window[0], window[1]);
            assert!((step_s - expected).abs() < 1e-9, "{window:?}: {step_s}");
        }
        assert_eq!(Motion::Twist(twist()).longest_step_s(0.0, 1.0), 0.0);
    }

    #[test]
    fn dense_pose_table_reproduces_its_twist() {
        let motion = Motion::Twist(twist());
        // Unix time, far from zero.
        let (stamp_s, start_m) = (1_700_000_000.0, DVec3::new(4.2e5, 5.1e6, 500.0));
        let start = exp(DVec3::new(0.5, 1.0, -2.0));
        let rows: Vec<PoseRow> = (-1024..=1024)
            .map(|i| {
                let t_s = f64::from(i) / 4096.0;
                let (rotation, shift) = motion.key_from(t_s, 0.0);
                let world_from_camera = start * DQuat::from_mat3(&rotation);
                PoseRow { t_s: stamp_s + t_s, position_m: start_m + start * shift, world_from_camera }
            })
            .collect();
        let track = Motion::Poses(PoseTrack::new(rows, stamp_s).unwrap());
        for dt_s in [0.2, -0.15, 0.0, 0.101] {
            let (a, b) = (track.key_from(dt_s, 0.01), motion.key_from(dt_s, 0.01));
            // Linear interpolation between rows: |v'| h^2 / 8 = 1e-7 m at 8 m/s and 1.3 rad/s; coordinates
            // are rounded to 1e-9 m.
            assert!(
                (a.0.x_axis - b.0.x_axis).length() < 1e-9 && (a.1 - b.1).length() < 2e-7,
                "{dt_s}: {:?} {:?}",
                a.1,
                b.1
            );
        }
        let twist_found = track.twist_at(0.01);
        assert!(
            (twist_found.velocity_m_s - twist().velocity_m_s).length() < 3e-3
                && (twist_found.rate_rad_s - twist().rate_rad_s).length() < 1e-9
        );
        assert_eq!(track.covers(-0.25, 0.25), Ok(()));
        assert!(matches!(track.covers(-0.26, 0.2), Err(PoseTrackError::Window { .. })));
        // The same instant gives exactly no motion.
        let (rotation, shift) = track.key_from(0.1234, 0.1234);
        assert!(
            (rotation - DMat3::IDENTITY).to_cols_array().iter().all(|v| v.abs() < 1e-15)
                && shift == DVec3::ZERO
        );
    }

    #[test]
    fn invalid_pose_tables_are_refused_by_row() {
        let row = |t_s: f64, w: f64| PoseRow {
            t_s,
            position_m: DVec3::ZERO,
            world_from_camera: DQuat::from_xyzw(0.0, 0.0, 0.0, w),
        };
        let error = |rows: &[PoseRow]| PoseTrack::new(rows.to_vec(), 0.0).unwrap_err().to_string();
        assert!(error(&[row(0.0, 1.0)]).contains("at least two"));
        assert!(error(&[row(0.0, 1.0), row(0.0, 1.0)]).contains("row 2: is not later"));
        assert!(error(&[row(0.0, 1.0), row(1.0, 0.5)]).contains("unit length"));
        assert!(error(&[row(0.0, 1.0), row(f64::NAN, 1.0)]).contains("not finite"));
    }
}
