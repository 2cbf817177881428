//! Attitudes that contradict the flight: the body upside down, or one attitude while the path turns.

use camsim_core::flight_log::{FlightLog, LogRow, Note, RawAttitude, RawRow};
use glam::{DQuat, DVec3};

use super::{FLU_FROM_FRD, ned_from_enu};

/// Rows that are looked at.
const MAX_ROWS: usize = 2000;
/// Cosine of the tilt from which on a body is upside down: 120 degrees.
const UPSIDE_DOWN: f64 = -0.5;
/// Cosine of the tilt up to which a body is upright: 60 degrees.
const UPRIGHT: f64 = 0.5;
/// Turn of the path from which on one attitude is doubtful, radians.
const TURN: f64 = 0.5;
/// Steps of the path, as a part of its extent.
const STEP_OF_EXTENT: f64 = 0.05;
/// Extent below which the path is that of a body at rest, metres.
const MIN_EXTENT_M: f64 = 0.5;

/// Warnings about the attitudes that the rows of a log state.
pub(super) fn notes(log: &FlightLog, raw: &[RawRow]) -> Vec<Note> {
    let sample: Vec<LogRow> =
        log.rows.iter().step_by(log.rows.len().div_ceil(MAX_ROWS).max(1)).copied().collect();
    let has_quaternions = raw.iter().any(|row| matches!(row.attitude, RawAttitude::Quaternion(_)));
    if sample.len() < 3 {
        return Vec::new();
    }
    let texts = [upside_down(&sample, has_quaternions), constant(&sample)];
    texts.into_iter().flatten().map(|text| Note { is_warning: true, text }).collect()
}

/// Share of attitudes whose body has its down axis at least this far along down.
fn share(attitudes: &[DQuat], is_so: impl Fn(f64) -> bool) -> f64 {
    let count = attitudes.iter().filter(|attitude| is_so((**attitude * DVec3::Z).z)).count();
    count as f64 / attitudes.len() as f64
}

/// Says that the body is upside down, or that only another order of the quaternions makes it upright.
fn upside_down(rows: &[LogRow], has_quaternions: bool) -> Option<String> {
    let attitudes: Vec<DQuat> = rows.iter().map(|row| row.ned_from_body).collect();
    let is_upright = |down: f64| down > UPRIGHT;
    let inverted = share(&attitudes, |down| down < UPSIDE_DOWN);
    let order = has_quaternions.then(|| better_order(&attitudes)).flatten();
    let is_wrong_order = order.is_some() && share(&attitudes, is_upright) < 0.5;
    if inverted < 0.99 && !is_wrong_order {
        return None;
    }
    let what = if inverted < 0.99 { "is not upright in most rows" } else { "is upside down in every row" };
    let cause = match order {
        Some(order) => format!(
            "in the order {order} the quaternions would be upright: is that theirs? Then name the columns"
        ),
        None if has_quaternions => {
            "do the quaternions belong to a body with other axes (camera.mount turns a \
            camera that looks along another one), or to a world with z the other way?"
                .to_owned()
        }
        None => "does roll count from inverted flight, or belong to a body with z up?".to_owned(),
    };
    Some(format!("the body {what}: {cause}"))
}

/// The order of the numbers of the quaternions in which nearly all are upright; `None` if there is none other
/// than that in which they were read.
fn better_order(attitudes: &[DQuat]) -> Option<&'static str> {
    type Reorder = fn(DQuat) -> DQuat;
    let orders: [(&str, Reorder); 2] = [
        // Read as x, y, z, w.
        ("w, x, y, z", |q| DQuat::from_xyzw(q.y, q.z, q.w, q.x)),
        // Read as w, x, y, z.
        ("x, y, z, w", |q| DQuat::from_xyzw(q.w, q.x, q.y, q.z)),
    ];
    let to_enu = ned_from_enu().inverse();
    orders.into_iter().find_map(|(name, reorder)| {
        let as_ned: Vec<DQuat> = attitudes.iter().map(|&q| reorder(q)).collect();
        let as_enu: Vec<DQuat> = attitudes
            .iter()
            .map(|&q| ned_from_enu() * reorder(to_enu * q * FLU_FROM_FRD.inverse()) * FLU_FROM_FRD)
            .collect();
        [as_ned, as_enu].iter().any(|all| share(all, |down| down > UPRIGHT) > 0.95).then_some(name)
    })
}

/// Says that the attitude is the same in all rows although the path turns.
fn constant(rows: &[LogRow]) -> Option<String> {
    let first = rows[0].ned_from_body;
    let is_same = |row: &LogRow| row.ned_from_body.dot(first).abs() > 1.0 - 1e-12;
    if !rows.iter().all(is_same) {
        return None;
    }
    let turn = path_turn(rows).filter(|turn| *turn > TURN)?;
    Some(format!(
        "the attitude is the same in every row, but the path turns by {:.0} degrees: set flight.attitude = \
            \"track\" if it is unknown",
        turn.to_degrees()
    ))
}

/// The largest angle between two courses over ground, radians; `None` of a path that stands.
fn path_turn(rows: &[LogRow]) -> Option<f64> {
    let horizontal = |row: &LogRow| row.position_ned_m.truncate();
    let start = horizontal(&rows[0]);
    let extent = rows.iter().map(|row| horizontal(row).distance(start)).fold(0.0, f64::max);
    if extent < MIN_EXTENT_M {
        return None;
    }
    let mut last = start;
    let mut courses = Vec::new();
    for row in rows {
        let step = horizontal(row) - last;
        if step.length() >= STEP_OF_EXTENT * extent {
            courses.push(step);
            last = horizontal(row);
        }
    }
    let first = *courses.first()?;
    Some(courses.iter().map(|course| first.angle_to(*course).abs()).fold(0.0, f64::max))
}
