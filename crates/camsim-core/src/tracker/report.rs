//! Accuracy of a trajectory against its log, and the motion that it demands of the platform.

use glam::{DQuat, DVec3};
use serde::Serialize;

use super::reference::LogInterpolator;
use crate::{
    flight_log::LogRow,
    pose::BodyState,
    trajectory::{Trajectory, so3},
};

/// One number per degree of freedom.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Channels {
    /// North, metres.
    pub north_m: f64,
    /// East, metres.
    pub east_m: f64,
    /// Down, metres.
    pub down_m: f64,
    /// Roll, degrees. Roll and yaw are meaningless near pitch +-90; `attitude_deg` is always valid.
    pub roll_deg: f64,
    /// Pitch, degrees.
    pub pitch_deg: f64,
    /// Yaw, degrees.
    pub yaw_deg: f64,
    /// Angle of the whole attitude error, degrees.
    pub attitude_deg: f64,
}

/// Largest motion over all control ticks. The vectors hold the largest magnitude of each component.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct MotionUse {
    /// Length of the velocity, m/s.
    pub speed_m_s: f64,
    /// Length of the acceleration, m/s^2.
    pub acceleration_m_s2: f64,
    /// Length of the body rate, deg/s.
    pub angular_rate_deg_s: f64,
    /// Length of the angular acceleration, deg/s^2.
    pub angular_acceleration_deg_s2: f64,
    /// North, east, down velocity, m/s.
    pub velocity_ned_m_s: [f64; 3],
    /// North, east, down acceleration, m/s^2.
    pub acceleration_ned_m_s2: [f64; 3],
    /// Body x, y, z rate, deg/s.
    pub rate_body_deg_s: [f64; 3],
    /// Body x, y, z angular acceleration, deg/s^2.
    pub angular_acceleration_body_deg_s2: [f64; 3],
}

/// Errors against the interpolated log and the motion used, over all control ticks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TrackReport {
    /// Number of instants compared.
    pub samples: usize,
    /// Root of the mean squared error.
    pub rms: Channels,
    /// Largest magnitude of the error.
    pub max_error: Channels,
    /// Largest velocities and accelerations.
    pub max_used: MotionUse,
    /// Fraction of ticks at which the acceleration along north, east, down changes sign, 0 to 1.
    pub sign_changes_ned: [f64; 3],
    /// Fraction of ticks at which the angular acceleration about body x, y, z changes sign, 0 to 1.
    pub sign_changes_body: [f64; 3],
}

/// Accelerations below this (m/s^2, rad/s^2) are rounding and have no sign.
const SIGNLESS_BELOW: f64 = 1e-6;

impl TrackReport {
    /// Measures over the trajectory's span at `rate_hz`. `None` without rows, or for a rate that is not
    /// positive.
    pub fn measure(trajectory: &Trajectory, rows: &[LogRow], rate_hz: f64) -> Option<Self> {
        let mut log = LogInterpolator::new(rows)?;
        if !(rate_hz > 0.0 && rate_hz.is_finite()) {
            return None;
        }
        let (start_s, end_s) = trajectory.span_s();
        let samples = ((end_s - start_s) * rate_hz + 1e-6).floor() as usize + 1;
        let mut report = Self { samples, ..Self::default() };
        let mut squares = [0.0; 7];
        let mut worst = [0.0f64; 7];
        let mut signs = [SignChanges::default(); 6];
        for k in 0..samples {
            // Slightly inside the segment that begins here, so that rounding does not select the one before.
            let t_s = (start_s + (k as f64 + 1e-7) / rate_hz).min(end_s);
            let state = trajectory.state(t_s);
            for ((error, square), worst) in
                errors(&state, log.at(t_s)).into_iter().zip(&mut squares).zip(&mut worst)
            {
                *square += error * error;
                *worst = worst.max(error.abs());
            }
            report.max_used.include(&state);
            let accelerations = state
                .acceleration_ned_m_s2
                .to_array()
                .into_iter()
                .chain(state.angular_acceleration_body_rad_s2.to_array());
            for (sign, acceleration) in signs.iter_mut().zip(accelerations) {
                sign.include(acceleration);
            }
        }
        report.rms = Channels::from(squares.map(|square| (square / samples as f64).sqrt()));
        report.max_error = Channels::from(worst);
        let fractions = signs.map(|sign| sign.changes as f64 / samples as f64);
        report.sign_changes_ned = [fractions[0], fractions[1], fractions[2]];
        report.sign_changes_body = [fractions[3], fractions[4], fractions[5]];
        Some(report)
    }
}

impl From<[f64; 7]> for Channels {
    fn from([north_m, east_m, down_m, roll_deg, pitch_deg, yaw_deg, attitude_deg]: [f64; 7]) -> Self {
        Self { north_m, east_m, down_m, roll_deg, pitch_deg, yaw_deg, attitude_deg }
    }
}

impl MotionUse {
    fn include(&mut self, state: &BodyState) {
        let degrees = 1f64.to_degrees();
        let pairs: [(&mut f64, &mut [f64; 3], DVec3); 4] = [
            (&mut self.speed_m_s, &mut self.velocity_ned_m_s, state.velocity_ned_m_s),
            (&mut self.acceleration_m_s2, &mut self.acceleration_ned_m_s2, state.acceleration_ned_m_s2),
            (&mut self.angular_rate_deg_s, &mut self.rate_body_deg_s, state.rate_body_rad_s * degrees),
            (
                &mut self.angular_acceleration_deg_s2,
                &mut self.angular_acceleration_body_deg_s2,
                state.angular_acceleration_body_rad_s2 * degrees,
            ),
        ];
        for (length, components, vector) in pairs {
            *length = length.max(vector.length());
            *components = DVec3::from_array(*components).max(vector.abs()).to_array();
        }
    }
}

/// Counts the sign changes of a quantity, without zeros.
#[derive(Clone, Copy, Debug, Default)]
struct SignChanges {
    before: f64,
    changes: usize,
}

impl SignChanges {
    fn include(&mut self, value: f64) {
        if value.abs() < SIGNLESS_BELOW {
            return;
        }
        if self.before * value < 0.0 {
            self.changes += 1;
        }
        self.before = value;
    }
}

fn errors(state: &BodyState, (position, attitude): (DVec3, DQuat)) -> [f64; 7] {
    let position = state.position_ned_m - position;
    let (own, log) = (euler_zyx(state.ned_from_body), euler_zyx(attitude));
    let angle = |i: usize| {
        let difference = own[i] - log[i];
        (difference - std::f64::consts::TAU * (difference / std::f64::consts::TAU).round()).to_degrees()
    };
    let total = so3::log(attitude.inverse() * state.ned_from_body).length().to_degrees();
    [position.x, position.y, position.z, angle(0), angle(1), angle(2), total]
}

/// Roll, pitch, yaw (ZYX), radians; pitch in [-pi/2, pi/2].
fn euler_zyx(q: DQuat) -> [f64; 3] {
    let roll = (2.0 * (q.w * q.x + q.y * q.z)).atan2(1.0 - 2.0 * (q.x * q.x + q.y * q.y));
    let pitch = (2.0 * (q.w * q.y - q.z * q.x)).clamp(-1.0, 1.0).asin();
    let yaw = (2.0 * (q.w * q.z + q.x * q.y)).atan2(1.0 - 2.0 * (q.y * q.y + q.z * q.z));
    [roll, pitch, yaw]
}
