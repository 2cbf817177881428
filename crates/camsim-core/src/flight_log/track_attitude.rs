//! Attitude from the track: heading along the ground track, bank of a coordinated turn, pitch along the
//! flight path.
//!
//! Velocity and acceleration come from a weighted quadratic fit to the positions around each row (local
//! regression, tricube weights, Cleveland 1979) over +-h, where h is 1 s, or more where rows are sparse: a low
//! pass without lag. On a circle at the angular rate w the fit flattens the path: tan(bank) comes out smaller
//! by the factor `1 - k (w h)^2`, k = 0.043 with dense rows (a bank of 20 degrees at 0.2 rad/s: 0.03 degrees
//! less); the heading is exact.
//!
//! At a standstill the heading is kept, until it turns into that of the next motion within its last 2 s.
//! Motion is what is faster than [`SLOW_M_S`], and than four standard errors of the fitted velocity, so that
//! the noise of a receiver on the ground turns nothing.

use glam::{DMat3, DVec3};

use super::{LogRow, attitude::body_from_euler_deg};
use crate::geodesy::LocalFrame;

/// Standard gravity, m/s^2.
const GRAVITY_M_S2: f64 = 9.806_65;
const MAX_BANK_DEG: f64 = 60.0;
/// Half width of the fit.
const HALF_WIDTH_S: f64 = 1.0;
/// Least number of rows that the fit reaches on either side.
const REACH_ROWS: usize = 3;
/// Ground speed below which the direction of the track is noise. Heading is interpolated there, and bank and
/// pitch fade out.
const SLOW_M_S: f64 = 0.5;
/// Standard errors of the velocity that a motion must exceed.
const SURE_ERRORS: f64 = 4.0;
/// Time before a motion within which the heading turns into its own.
const TURN_S: f64 = 2.0;

/// Motion at a row.
#[derive(Clone, Copy, Debug)]
struct Motion {
    velocity: DVec3,
    acceleration: DVec3,
    /// Whether the track has a direction here.
    is_sure: bool,
}

/// Sets the attitude of every row. With a `frame`, velocities are rotated into the tangent frame at each row.
pub(super) fn fill(rows: &mut [LogRow], frame: Option<&LocalFrame>) {
    let motions: Vec<Motion> = (0..rows.len()).map(|row| fit_motion(rows, row)).collect();
    let ned_from_local: Vec<_> = rows
        .iter()
        .map(|row| {
            frame.map_or(glam::DQuat::IDENTITY, |frame| {
                frame.ned_from_local(frame.geodetic_from_ned(row.position_ned_m))
            })
        })
        .collect();
    let local: Vec<Motion> = motions
        .iter()
        .zip(&ned_from_local)
        .map(|(motion, rotation)| Motion {
            velocity: rotation.inverse() * motion.velocity,
            acceleration: rotation.inverse() * motion.acceleration,
            is_sure: motion.is_sure,
        })
        .collect();
    let headings = headings_rad(rows, &local);
    for (i, row) in rows.iter_mut().enumerate() {
        let Motion { velocity, acceleration, is_sure } = local[i];
        let ground_speed = velocity.x.hypot(velocity.y);
        // v psi_dot = lateral acceleration = (v x a)_z / |v|, tan(bank) = v psi_dot / g.
        let lateral =
            (velocity.x * acceleration.y - velocity.y * acceleration.x) / ground_speed.max(SLOW_M_S);
        let bank_deg = (lateral / GRAVITY_M_S2).atan().to_degrees().clamp(-MAX_BANK_DEG, MAX_BANK_DEG);
        let pitch_deg = (-velocity.z).atan2(ground_speed.hypot(SLOW_M_S)).to_degrees();
        let fade = if is_sure { (ground_speed / SLOW_M_S).min(1.0) } else { 0.0 };
        let local_from_body =
            body_from_euler_deg([bank_deg * fade, pitch_deg * fade, headings[i].to_degrees()]);
        row.ned_from_body = (ned_from_local[i] * local_from_body).normalize();
    }
}

/// Heading of each row. Rows without a direction keep the heading before them, and turn into the next one, by
/// the shorter arc, within [`TURN_S`] before it. All zero for a log that stands still.
fn headings_rad(rows: &[LogRow], motions: &[Motion]) -> Vec<f64> {
    let mut known: Vec<(usize, f64)> = Vec::new();
    for (i, Motion { velocity, is_sure, .. }) in motions.iter().enumerate() {
        if *is_sure && velocity.x.hypot(velocity.y) >= SLOW_M_S {
            let heading = velocity.y.atan2(velocity.x);
            let unwrapped = known.last().map_or(heading, |&(_, before)| before + wrap_rad(heading - before));
            known.push((i, unwrapped));
        }
    }
    let mut next = 0;
    (0..rows.len())
        .map(|i| {
            while next < known.len() && known[next].0 <= i {
                next += 1;
            }
            match (next.checked_sub(1).map(|k| known[k]), known.get(next).copied()) {
                (Some((a, from)), Some((b, to))) => {
                    let turn_s = TURN_S.min(rows[b].t_s - rows[a].t_s);
                    let part = (1.0 - (rows[b].t_s - rows[i].t_s) / turn_s).clamp(0.0, 1.0);
                    from + (to - from) * part * part * (3.0 - 2.0 * part)
                }
                (Some((_, one)), None) | (None, Some((_, one))) => one,
                (None, None) => 0.0,
            }
        })
        .collect()
}

fn wrap_rad(angle: f64) -> f64 {
    (angle + std::f64::consts::PI).rem_euclid(std::f64::consts::TAU) - std::f64::consts::PI
}

/// Motion at a row from `p(tau) = p0 + v tau + a tau^2 / 2`, fitted with weights `(1 -
/// |tau/h|^3)^3`.
fn fit_motion(rows: &[LogRow], row: usize) -> Motion {
    let here = rows[row];
    let reach_before = rows[row.saturating_sub(REACH_ROWS)].t_s;
    let reach_after = rows[(row + REACH_ROWS).min(rows.len() - 1)].t_s;
    let half_width_s = HALF_WIDTH_S.max(1.1 * (here.t_s - reach_before).max(reach_after - here.t_s));
    let first = rows.partition_point(|other| other.t_s <= here.t_s - half_width_s);
    let last = rows.partition_point(|other| other.t_s < here.t_s + half_width_s);
    // Time in units of the half width keeps the normal equations well conditioned.
    let mut moments = [0.0; 5];
    let mut sums = [DVec3::ZERO; 3];
    for other in &rows[first..last] {
        let tau = (other.t_s - here.t_s) / half_width_s;
        let weight = (1.0 - tau.abs().powi(3)).powi(3);
        let offset = other.position_ned_m - here.position_ned_m;
        let mut power = weight;
        for (k, moment) in moments.iter_mut().enumerate() {
            *moment += power;
            if k < 3 {
                sums[k] += offset * power;
            }
            power *= tau;
        }
    }
    let [m0, m1, m2, m3, m4] = moments;
    let normal = DMat3::from_cols_array(&[m0, m1, m2, m1, m2, m3, m2, m3, m4]);
    if last - first >= 3 && normal.determinant() > 1e-12 * m0.powi(3) {
        let columns = DMat3::from_cols(sums[0], sums[1], sums[2]).transpose();
        let inverse = normal.inverse();
        let solution = (inverse * columns).transpose();
        let variance = residual_variance(&rows[first..last], here, half_width_s, solution);
        let velocity_error = (variance * inverse.y_axis.y).sqrt() / half_width_s;
        let velocity = solution.y_axis / half_width_s;
        return Motion {
            velocity,
            acceleration: 2.0 * solution.z_axis / (half_width_s * half_width_s),
            is_sure: velocity.x.hypot(velocity.y) >= SURE_ERRORS * velocity_error,
        };
    }
    // With two rows, the velocity between them.
    let (a, b) = (rows[row.saturating_sub(1)], rows[(row + 1).min(rows.len() - 1)]);
    let span_s = b.t_s - a.t_s;
    let velocity = if span_s > 0.0 { (b.position_ned_m - a.position_ned_m) / span_s } else { DVec3::ZERO };
    Motion { velocity, acceleration: DVec3::ZERO, is_sure: true }
}

/// Variance of the horizontal positions about a fit, per axis; 0 where the fit goes through them all.
fn residual_variance(rows: &[LogRow], here: LogRow, half_width_s: f64, fit: DMat3) -> f64 {
    let spare = rows.len().saturating_sub(3);
    if spare == 0 {
        return 0.0;
    }
    let (mut sum, mut weights) = (0.0, 0.0);
    for row in rows {
        let tau = (row.t_s - here.t_s) / half_width_s;
        let weight = (1.0 - tau.abs().powi(3)).powi(3);
        let residual = row.position_ned_m - here.position_ned_m - fit * DVec3::new(1.0, tau, tau * tau);
        sum += weight * residual.truncate().length_squared();
        weights += weight;
    }
    0.5 * sum / weights * rows.len() as f64 / spare as f64
}
