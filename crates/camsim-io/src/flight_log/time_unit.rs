//! Unit of a time column whose header names none: from `flight.time_unit`, or from the values where only one
//! unit is plausible.

use camsim_core::{
    flight_log::Note,
    scenario::{FlightSpec, TimeUnit},
};

use super::{
    columns::Frame,
    layout::TableLayout,
    rows::{ParsedRow, ParsedRows},
    time_fields::{self, Clock, TimeFormat},
    units::{HOUR, MICROSECOND, MILLISECOND, MINUTE, NANOSECOND, SECOND, Unit},
};
use crate::median::median;

/// The years 2000 to 2100, seconds since 1970.
const THIS_CENTURY_S: std::ops::Range<f64> = 946e6..4_103e6;
/// A clock that has run for longer than 3 years has another unit.
const MAX_UPTIME_S: f64 = 1e8;
/// Mean speeds below this show that the times are not seconds.
const MIN_PLAUSIBLE_M_S: f64 = 1e-3;
/// At mean speeds below this, integer times may have a smaller unit.
const MIN_INTEGER_TIME_M_S: f64 = 0.05;
/// At mean speeds below this, times with steps of [`LONG_STEP_S`] or more may have a smaller unit.
const SLOW_M_S: f64 = 1.0;
/// Median step between rows that is long for a flight log.
const LONG_STEP_S: f64 = 2.0;
/// Median step between rows that is too long for a flight log.
const VERY_LONG_STEP_S: f64 = 100.0;
/// Up to this number of rows without motion, a log may be written by hand with long steps.
const HANDWRITTEN_ROWS: usize = 4;
/// At mean speeds above this, the unit may be larger.
const FAST_M_S: f64 = 340.0;
/// Mean speeds above this show that the unit is larger.
const MAX_PLAUSIBLE_M_S: f64 = 1000.0;

/// The unit that `flight.time_unit` names; `None` for `auto`.
pub(super) fn unit_of_key(key: TimeUnit) -> Option<&'static Unit> {
    match key {
        TimeUnit::Auto => None,
        TimeUnit::S => Some(&SECOND),
        TimeUnit::Ms => Some(&MILLISECOND),
        TimeUnit::Us => Some(&MICROSECOND),
        TimeUnit::Ns => Some(&NANOSECOND),
        TimeUnit::Min => Some(&MINUTE),
        TimeUnit::H => Some(&HOUR),
    }
}

/// Times and mean speed of a log, in the unknown unit of its time column.
struct Motion {
    /// Number of times.
    rows: usize,
    /// Largest absolute time.
    largest: f64,
    /// Median step between times; `None` with fewer than two times.
    step: Option<f64>,
    /// Mean speed, metres per unit of time; `None` without motion.
    speed: Option<f64>,
    /// Whether all times are integers.
    is_integer: bool,
    /// Whether positions are geodetic. Local positions may have any unit of length.
    is_geodetic: bool,
}

/// The rows with their times in nanoseconds, and what these are.
///
/// # Errors
/// The key contradicts the header, or the unit is not known: the error message.
pub(super) fn in_nanoseconds(
    mut parsed: ParsedRows,
    layout: &TableLayout,
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Result<(Clock, Vec<ParsedRow>), String> {
    if parsed.clock.format == TimeFormat::Number {
        let unit_ns = unit_ns(&parsed.rows, layout, spec, notes)?;
        for row in &mut parsed.rows {
            row.time = row.time.and_then(|time| time_fields::to_ns(time, unit_ns)).map(i128::from);
        }
    } else if spec.time_unit != TimeUnit::Auto {
        notes.push(Note::warning("flight.time_unit is not used: the times are clock times or dates"));
    }
    Ok((parsed.clock, parsed.rows))
}

/// Nanoseconds per unit of the time column.
fn unit_ns(
    rows: &[ParsedRow],
    layout: &TableLayout,
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Result<f64, String> {
    let key = unit_of_key(spec.time_unit);
    if let Some(named_ns) = layout.time.unit_ns {
        return match key {
            Some(unit) if unit.factor != named_ns => Err(format!(
                "the header names another unit of time{} than flight.time_unit = \"{}\"; remove the key or \
                    correct the header",
                layout.bracketed_name(layout.time.column),
                unit.name
            )),
            _ => {
                warn_if_implausible(&motion(rows, layout), named_ns, "the header's", notes);
                Ok(named_ns)
            }
        };
    }
    let motion = motion(rows, layout);
    if let Some(unit) = key {
        warn_if_implausible(&motion, unit.factor, "flight.time_unit's", notes);
        return Ok(unit.factor);
    }
    if look_like_hhmmss(rows, &motion) {
        return Err(unit_required_message(
            "its numbers look like the digits of clock times (hhmmss: after 59 comes 100); write hh:mm:ss, \
                or, if they are seconds",
        ));
    }
    if layout.time.integers_are_ns && motion.is_integer {
        // No log has steps of less than 0.1 ms, whatever its format.
        let is_plausible = motion.step.is_none_or(|step| step * 1e-9 >= 1e-4);
        return if is_plausible {
            Ok(NANOSECOND.factor)
        } else {
            Err(unit_required_message(
                "by EuRoC's format they would be nanoseconds, but then the rows lie less than 0.1 ms apart",
            ))
        };
    }
    infer_unit_ns(&motion, notes)
}

/// Warns if a stated unit of time gives implausible steps or speeds. `origin` names where it is stated.
fn warn_if_implausible(motion: &Motion, unit_ns: f64, origin: &str, notes: &mut Vec<Note>) {
    let scaled = motion.scaled(unit_ns);
    if !scaled.is_plausible() {
        notes.push(Note::warning(format!(
            "in {origin} unit of time there are {}: check it",
            scaled.describe()
        )));
    }
}

/// Whether the numbers are clock times `hhmmss`: no seconds or minutes of 60 and more, and steps that carry
/// from 59 to 100.
fn look_like_hhmmss(rows: &[ParsedRow], motion: &Motion) -> bool {
    let times: Vec<f64> = rows.iter().filter_map(|row| row.time).map(time_fields::to_units).collect();
    let is_clock = |time: f64| {
        (0.0..240_000.0).contains(&time) && time % 100.0 < 60.0 && (time / 100.0).floor() % 100.0 < 60.0
    };
    let Some(step) = motion.step.filter(|step| *step <= 10.0) else { return false };
    let carries = |a: f64, b: f64| {
        (40.0..=40.0 + 3.0 * step).contains(&(b - a)) && (b / 100.0).floor() > (a / 100.0).floor()
    };
    times.iter().all(|&time| is_clock(time)) && times.windows(2).any(|pair| carries(pair[0], pair[1]))
}

/// Message that asks for the unit of time.
fn unit_required_message(reason: &str) -> String {
    format!(
        "the column of times names no unit, and {reason}: set flight.time_unit to \"s\", \"ms\", \"us\", \
            \"ns\", \"min\" or \"h\", or name the unit in the header (t_s, t_ms)"
    )
}

/// Infers the unit from steps and speeds: seconds if they are plausible; else, with a warning, the only unit
/// that makes the times dates of this century or the rows those of a flight.
fn infer_unit_ns(motion: &Motion, notes: &mut Vec<Note>) -> Result<f64, String> {
    let seconds = motion.scaled(SECOND.factor);
    let is_date_s =
        THIS_CENTURY_S.contains(&motion.largest) && motion.step.is_none_or(|step| step < VERY_LONG_STEP_S);
    let (step_s, speed) = (seconds.step_s, seconds.speed_m_s);
    let is_impossible = motion.largest > THIS_CENTURY_S.end
        || (motion.is_integer && step_s.is_some_and(|step| step >= 1e5))
        || (!is_date_s
            && speed.is_some_and(|speed| !(MIN_PLAUSIBLE_M_S..=MAX_PLAUSIBLE_M_S).contains(&speed)));
    let is_doubtful = !is_date_s
        && match (speed, step_s) {
            (None, step) => step.is_some_and(|step| {
                step >= VERY_LONG_STEP_S
                    || (motion.is_integer && motion.rows > HANDWRITTEN_ROWS && step >= LONG_STEP_S)
            }),
            (Some(speed), step) => {
                (speed > FAST_M_S && (motion.is_geodetic || !motion.is_integer))
                    || (motion.is_integer && speed < MIN_INTEGER_TIME_M_S)
                    || (speed < SLOW_M_S && step.is_some_and(|step| step >= LONG_STEP_S))
            }
        };
    if !is_impossible && !is_doubtful {
        return Ok(SECOND.factor);
    }
    let others = [&MILLISECOND, &MICROSECOND, &NANOSECOND, &MINUTE, &HOUR];
    let as_date = others
        .into_iter()
        .find(|unit| THIS_CENTURY_S.contains(&(motion.largest * unit.factor * 1e-9)) && unit.factor < 1e9);
    let mut infer = |unit: &'static Unit, reason: String| {
        let text = format!(
            "the times are read as {}: their column names no unit, and {reason}; flight.time_unit decides",
            unit.name
        );
        notes.push(Note::warning(text));
        Ok(unit.factor)
    };
    if let Some(unit) = as_date.filter(|unit| is_impossible && motion.scaled(unit.factor).is_plausible()) {
        let year = 1970.0 + (motion.largest * unit.factor * 1e-9 / 31_556_952.0).floor();
        return infer(unit, format!("only so they are dates of this century ({year})"));
    }
    let plausible: Vec<&'static Unit> =
        others.into_iter().filter(|unit| motion.scaled(unit.factor).is_typical_flight()).collect();
    match &plausible[..] {
        [unit] if is_impossible => {
            let scaled = motion.scaled(unit.factor);
            infer(unit, format!("only so rows and speed are those of a flight ({})", scaled.describe()))
        }
        _ => Err(unit_required_message(&format!(
            "as seconds, {} would be {}",
            seconds.describe(),
            if is_impossible { "no flight" } else { "an odd flight" }
        ))),
    }
}

/// The motion of a log for one assumed unit of time.
struct ScaledMotion {
    largest_s: f64,
    step_s: Option<f64>,
    speed_m_s: Option<f64>,
}

impl ScaledMotion {
    /// Whether steps and speed are physically plausible.
    fn is_plausible(&self) -> bool {
        self.step_s.is_none_or(|step| (1e-4..1e5).contains(&step))
            && self.speed_m_s.is_none_or(|speed| (MIN_PLAUSIBLE_M_S..MAX_PLAUSIBLE_M_S).contains(&speed))
    }

    /// Whether steps, speed and clock are those of a usual flight.
    fn is_typical_flight(&self) -> bool {
        self.step_s.is_some_and(|step| (4e-4..=120.0).contains(&step))
            && self.speed_m_s.is_none_or(|speed| (MIN_INTEGER_TIME_M_S..=FAST_M_S).contains(&speed))
            && (self.largest_s < MAX_UPTIME_S || THIS_CENTURY_S.contains(&self.largest_s))
    }

    fn describe(&self) -> String {
        match (self.step_s, self.speed_m_s) {
            (Some(step), Some(speed)) => {
                format!("rows {} s apart at {} m/s", format_short(step), format_short(speed))
            }
            (Some(step), None) => format!("rows {} s apart", format_short(step)),
            _ => format!("a time of {} s", format_short(self.largest_s)),
        }
    }
}

/// A number rounded to three decimals, or in scientific notation where that would lose it.
pub(super) fn format_short(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e6).contains(&value.abs()) {
        format!("{value:.1e}")
    } else {
        format!("{}", (value * 1e3).round() / 1e3)
    }
}

impl Motion {
    fn scaled(&self, unit_ns: f64) -> ScaledMotion {
        let unit_s = unit_ns * 1e-9;
        ScaledMotion {
            largest_s: self.largest * unit_s,
            step_s: self.step.map(|step| step * unit_s),
            speed_m_s: self.speed.map(|speed| speed / unit_s),
        }
    }
}

/// Measures times and mean speed of a log.
fn motion(rows: &[ParsedRow], layout: &TableLayout) -> Motion {
    let times: Vec<f64> = rows.iter().filter_map(|row| row.time).map(time_fields::to_units).collect();
    let mut largest = 0.0_f64;
    for time in &times {
        largest = largest.max(time.abs());
    }
    let is_integer = rows.iter().filter_map(|row| row.time).all(time_fields::is_integer);
    let mut steps: Vec<f64> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    let step = median(&mut steps, f64::total_cmp);

    let geodetic = layout.frame == Frame::Geodetic;
    // A latitude or longitude of exactly 0 is written by receivers without a fix.
    let is_null = |position: &[f64; 3]| geodetic && (position[0] == 0.0 || position[1] == 0.0);
    let fixes = rows.iter().filter(|row| row.has_position() && !is_null(&row.position));
    let fixes: Vec<(f64, [f64; 3])> =
        fixes.filter_map(|row| row.time.map(|time| (time_fields::to_units(time), row.position))).collect();
    let mut moves: Vec<(f64, f64)> = fixes
        .windows(2)
        .map(|pair| (pair[1].0 - pair[0].0, distance_m(pair[0].1, pair[1].1, geodetic)))
        .filter(|(step, distance)| *step > 0.0 && distance.is_finite())
        .collect();
    // Spikes and gaps do not count in the mean speed.
    let mut distances: Vec<f64> =
        moves.iter().map(|(_, distance)| *distance).filter(|distance| *distance > 0.0).collect();
    let median_distance = median(&mut distances, f64::total_cmp).unwrap_or(0.0);
    let mut move_steps: Vec<f64> = moves.iter().map(|(step, _)| *step).collect();
    let median_step = median(&mut move_steps, f64::total_cmp).unwrap_or(0.0);
    moves.retain(|(step, _)| *step <= 20.0 * median_step);
    let length: f64 = moves.iter().map(|(_, distance)| distance.min(20.0 * median_distance)).sum();
    let duration: f64 = moves.iter().map(|(step, _)| step).sum();
    let speed = (length > 0.0 && duration > 0.0).then(|| length / duration);
    Motion { rows: times.len(), largest, step, speed, is_integer, is_geodetic: geodetic }
}

/// Distance of two positions, metres; of geodetic ones by metres per degree on a sphere.
fn distance_m(a: [f64; 3], b: [f64; 3], geodetic: bool) -> f64 {
    let scale = if geodetic { [111_200.0, 111_200.0 * a[0].to_radians().cos(), 1.0] } else { [1.0; 3] };
    (0..3).map(|axis| ((b[axis] - a[axis]) * scale[axis]).powi(2)).sum::<f64>().sqrt()
}
