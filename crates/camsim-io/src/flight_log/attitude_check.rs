//! Attitudes that contradict the flight: the body not upright, or one attitude while the path turns.

use camsim_core::flight_log::{FlightLog, LogRow, Note, RawAttitude, RawRow};
use glam::{DQuat, DVec3, EulerRot};

use super::RawLog;
use crate::formats::axes::enu_from_flu;

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

/// How the quaternions of a table are read.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct QuaternionReading {
    /// Whether the scalar stands first.
    pub(super) is_scalar_first: bool,
    /// Whether they turn forward-left-up bodies to east, north, up.
    pub(super) is_enu: bool,
}

/// Warnings about the attitudes that the rows of a log state.
pub(super) fn notes(log: &FlightLog, raw: &RawLog) -> Vec<Note> {
    let sample: Vec<LogRow> =
        log.rows.iter().step_by(log.rows.len().div_ceil(MAX_ROWS).max(1)).copied().collect();
    let has_quaternions = raw.rows.iter().any(|row| matches!(row.attitude, RawAttitude::Quaternion(_)));
    if sample.len() < 3 {
        return Vec::new();
    }
    let attitudes: Vec<DQuat> = sample.iter().map(|row| row.ned_from_body).collect();
    let tilted = match has_quaternions {
        true => tilted_quaternions(&attitudes, raw.quaternions),
        false => tilted_angles(&attitudes),
    };
    let texts = [tilted, constant(&sample, &raw.rows)];
    texts.into_iter().flatten().map(Note::warning).collect()
}

/// Fraction of attitudes in which an axis of the body points at least this far along down.
fn fraction(attitudes: &[DQuat], axis: DVec3, is_so: impl Fn(f64) -> bool) -> f64 {
    let count = attitudes.iter().filter(|attitude| is_so((**attitude * axis).z)).count();
    count as f64 / attitudes.len() as f64
}

fn is_upright(down: f64) -> bool {
    down > UPRIGHT
}

/// Says that angles turn the body upside down or on its side.
fn tilted_angles(attitudes: &[DQuat]) -> Option<String> {
    if fraction(attitudes, DVec3::Z, |down| down < UPSIDE_DOWN) >= 0.99 {
        let cause = "does roll count from inverted flight, or belong to a body with z up?";
        return Some(format!("the body is upside down in every row: {cause}"));
    }
    let lies = [DVec3::Y, -DVec3::Y].into_iter().any(|side| fraction(attitudes, side, is_upright) >= 0.99);
    lies.then(|| {
        "the body lies on its side in every row: do the angles belong to camera (optical) axes? Those of the \
            body belong here, and camera.mount says where the camera looks"
            .to_owned()
    })
}

/// Says that quaternions do not leave the body upright, with the readings in which it would be.
fn tilted_quaternions(attitudes: &[DQuat], reading: Option<QuaternionReading>) -> Option<String> {
    if fraction(attitudes, DVec3::Z, is_upright) >= 0.5 {
        return None;
    }
    const AXES: &str = "do the quaternions belong to a body with other axes, as those of a camera (camera.mount \
        says where the camera looks), or to a world with z the other way?";
    const OPTICAL: &str = "do the quaternions belong to camera (optical) axes, x right, y down, z forward? Then turn \
        them to a body with x forward; camera.mount says where the camera looks";
    let mut causes = Vec::new();
    if let Some(reading) = reading
        && fraction(&in_the_other_order(attitudes, reading), DVec3::Z, is_upright) > 0.95
    {
        let order = if reading.is_scalar_first { "x, y, z, w" } else { "w, x, y, z" };
        causes.push(format!(
            "in the order {order} the quaternions would be upright: is that theirs? Then name the columns"
        ));
    }
    // The axis of the body that points down, and what its axes may then be.
    for (axis, cause) in [(-DVec3::Z, AXES), (DVec3::Y, OPTICAL), (-DVec3::Y, OPTICAL)] {
        if fraction(attitudes, axis, is_upright) > 0.95 {
            causes.push(cause.to_owned());
        }
    }
    if causes.is_empty() {
        return None;
    }
    let what = if fraction(attitudes, DVec3::Z, |down| down < UPSIDE_DOWN) >= 0.99 {
        "is upside down in every row"
    } else {
        "is not upright in most rows"
    };
    Some(format!("the body {what}: {}", causes.join("; or: ")))
}

/// The attitudes if the scalar of the quaternions stood at the other end.
fn in_the_other_order(attitudes: &[DQuat], reading: QuaternionReading) -> Vec<DQuat> {
    let reorder = |q: DQuat| match reading.is_scalar_first {
        true => DQuat::from_xyzw(q.w, q.x, q.y, q.z),
        false => DQuat::from_xyzw(q.y, q.z, q.w, q.x),
    };
    let in_enu = |q: DQuat| enu_from_flu(reorder(enu_from_flu(q)));
    attitudes.iter().map(|&q| if reading.is_enu { in_enu(q) } else { reorder(q) }).collect()
}

/// Says that the attitude is the same in all rows although the path turns. The rows of the file count: north
/// is not the same direction at all positions.
fn constant(rows: &[LogRow], raw: &[RawRow]) -> Option<String> {
    let mut attitudes = raw.iter().filter_map(|row| match row.attitude {
        RawAttitude::None => None,
        RawAttitude::EulerDeg(angles) => {
            let [roll, pitch, yaw] = angles.map(f64::to_radians);
            Some(DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll))
        }
        RawAttitude::Quaternion(quaternion) => Some(quaternion),
    });
    let first = attitudes.next()?;
    // Incomplete attitudes are NaN, and do not count.
    let differs = |attitude: DQuat| attitude.dot(first).abs() <= 1.0 - 1e-12;
    if attitudes.any(differs) {
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
