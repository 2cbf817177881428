//! Units that no header names: told by a key, by the values where they leave no doubt, or asked for.

use camsim_core::{
    flight_log::Note,
    scenario::{AngleKind, AngleUnit, FlightSpec, TimeUnit},
};

use super::{
    columns::{AttitudeColumns, Frame, Source},
    layout::Layout,
    rows::Rows,
    time::{self, Kind},
    units::{HOUR, MICROSECOND, MILLISECOND, MINUTE, NANOSECOND, SECOND, Unit},
};

/// 2000 to 2100, seconds since 1970.
const THIS_CENTURY_S: std::ops::Range<f64> = 946e6..4_103e6;
/// A log that has been running for longer than 3 years has another unit.
const LONGEST_S: f64 = 1e8;
/// Slower than this all the time, seconds are not what the times are.
const STANDING_M_S: f64 = 1e-3;
/// Slower than this, times that are whole numbers may be of a smaller unit.
const CREEPING_M_S: f64 = 0.05;
/// Slower than this, times of rows that lie apart may be of a smaller unit.
const SLOW_M_S: f64 = 1.0;
const APART_S: f64 = 2.0;
const FAR_APART_S: f64 = 100.0;
/// So few rows at one place may be written by hand.
const FEW_ROWS: usize = 4;
/// Faster than this the unit may be a larger one.
const FAST_M_S: f64 = 340.0;
/// Faster than this all the time, nothing that carries a camera flies.
const IMPOSSIBLE_M_S: f64 = 1000.0;

/// The unit that the key names.
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

/// How a log moves, its times in the file's unit.
struct Motion {
    rows: usize,
    largest: f64,
    /// Median; `None` with fewer than two times.
    step: Option<f64>,
    /// Metres per unit of time on average; `None` where it stands still.
    pace: Option<f64>,
    all_whole: bool,
    /// Positions are on Earth; local ones may have any unit of length.
    is_geodetic: bool,
}

/// Nanoseconds of the unit of the times.
pub(super) fn time_unit_ns(
    rows: &Rows,
    layout: &Layout,
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Result<f64, String> {
    let key = unit_of_key(spec.time_unit);
    if rows.kind != Kind::Number {
        if key.is_some() {
            notes.push(Note {
                is_warning: true,
                text: "flight.time_unit is not used: the times are clock times or dates".to_owned(),
            });
        }
        return Ok(1.0);
    }
    if let Some(named_ns) = layout.time.unit_ns {
        return match key {
            Some(unit) if unit.factor != named_ns => Err(format!(
                "the header names another unit of time{} than flight.time_unit = \"{}\"; remove the key or correct the header",
                layout.named(layout.time.column),
                unit.name
            )),
            _ => {
                say_if_odd(&motion(rows, layout), named_ns, "the header's", notes);
                Ok(named_ns)
            }
        };
    }
    let motion = motion(rows, layout);
    if let Some(unit) = key {
        say_if_odd(&motion, unit.factor, "flight.time_unit's", notes);
        return Ok(unit.factor);
    }
    if are_digits_of_clocks(rows, &motion) {
        return Err(asked(
            "its numbers look like the digits of clock times (hhmmss: after 59 comes 100); write hh:mm:ss, or, if they are seconds",
        ));
    }
    if layout.time.whole_are_ns && motion.all_whole {
        // Steps of less than 0.1 ms are no log, whatever the format says.
        let good = motion.step.is_none_or(|step| step * 1e-9 >= 1e-4);
        return if good {
            Ok(NANOSECOND.factor)
        } else {
            Err(asked(
                "by EuRoC's format they would be nanoseconds, but then the rows lie less than 0.1 ms apart",
            ))
        };
    }
    guess(&motion, notes)
}

/// A stated unit stands, but nothing that carries a camera moves so.
fn say_if_odd(motion: &Motion, unit_ns: f64, whose: &str, notes: &mut Vec<Note>) {
    let taken = motion.in_unit(unit_ns);
    if !taken.is_sound() {
        notes.push(Note {
            is_warning: true,
            text: format!("in {whose} unit of time there are {}: check it", taken.describe()),
        });
    }
}

/// Whether the numbers are `hhmmss`: no 60th second or minute, and from 59 the next row's step leads to 100.
fn are_digits_of_clocks(rows: &Rows, motion: &Motion) -> bool {
    let times: Vec<f64> = rows.rows.iter().filter_map(|row| row.time).map(time::to_units).collect();
    let is_clock = |time: f64| {
        (0.0..240_000.0).contains(&time) && time % 100.0 < 60.0 && (time / 100.0).floor() % 100.0 < 60.0
    };
    let Some(step) = motion.step.filter(|step| *step <= 10.0) else { return false };
    let leaps = |a: f64, b: f64| {
        (40.0..=40.0 + 3.0 * step).contains(&(b - a)) && (b / 100.0).floor() > (a / 100.0).floor()
    };
    times.iter().all(|&time| is_clock(time)) && times.windows(2).any(|pair| leaps(pair[0], pair[1]))
}

fn asked(why: &str) -> String {
    format!(
        "the column of times names no unit, and {why}: set flight.time_unit to \"s\", \"ms\", \"us\", \"ns\", \"min\" or \"h\", or name the unit in the header (t_s, t_ms)"
    )
}

fn guess(motion: &Motion, notes: &mut Vec<Note>) -> Result<f64, String> {
    let seconds = motion.in_unit(SECOND.factor);
    let is_date_s =
        THIS_CENTURY_S.contains(&motion.largest) && motion.step.is_none_or(|step| step < FAR_APART_S);
    let (step_s, speed) = (seconds.step_s, seconds.speed_m_s);
    let impossible = motion.largest > THIS_CENTURY_S.end
        || (motion.all_whole && step_s.is_some_and(|step| step >= 1e5))
        || (!is_date_s && speed.is_some_and(|speed| !(STANDING_M_S..=IMPOSSIBLE_M_S).contains(&speed)));
    let doubtful = !is_date_s
        && match (speed, step_s) {
            (None, step) => step.is_some_and(|step| {
                step >= FAR_APART_S || (motion.all_whole && motion.rows > FEW_ROWS && step >= APART_S)
            }),
            (Some(speed), step) => {
                (speed > FAST_M_S && (motion.is_geodetic || !motion.all_whole))
                    || (motion.all_whole && speed < CREEPING_M_S)
                    || (speed < SLOW_M_S && step.is_some_and(|step| step >= APART_S))
            }
        };
    if !impossible && !doubtful {
        return Ok(SECOND.factor);
    }
    let others = [&MILLISECOND, &MICROSECOND, &NANOSECOND, &MINUTE, &HOUR];
    let as_date = others
        .into_iter()
        .find(|unit| THIS_CENTURY_S.contains(&(motion.largest * unit.factor * 1e-9)) && unit.factor < 1e9);
    let mut infer = |unit: &'static Unit, why: String| {
        let text = format!(
            "the times are read as {}: their column names no unit, and {why}; flight.time_unit decides",
            unit.name
        );
        notes.push(Note { is_warning: true, text });
        Ok(unit.factor)
    };
    if let Some(unit) = as_date.filter(|unit| impossible && motion.in_unit(unit.factor).is_sound()) {
        let year = 1970.0 + (motion.largest * unit.factor * 1e-9 / 31_556_952.0).floor();
        return infer(unit, format!("only so they are dates of this century ({year})"));
    }
    let plausible: Vec<&'static Unit> =
        others.into_iter().filter(|unit| motion.in_unit(unit.factor).is_flight()).collect();
    match &plausible[..] {
        [unit] if impossible => {
            let taken = motion.in_unit(unit.factor);
            infer(unit, format!("only so rows and speed are those of a flight ({})", taken.describe()))
        }
        _ => Err(asked(&format!(
            "as seconds, {} would be {}",
            seconds.describe(),
            if impossible { "no flight" } else { "an odd flight" }
        ))),
    }
}

/// A log's motion in one unit of time.
struct InUnit {
    largest_s: f64,
    step_s: Option<f64>,
    speed_m_s: Option<f64>,
}

impl InUnit {
    /// Not against reason.
    fn is_sound(&self) -> bool {
        self.step_s.is_none_or(|step| (1e-4..1e5).contains(&step))
            && self.speed_m_s.is_none_or(|speed| (STANDING_M_S..IMPOSSIBLE_M_S).contains(&speed))
    }

    /// What flights do.
    fn is_flight(&self) -> bool {
        self.step_s.is_some_and(|step| (4e-4..=120.0).contains(&step))
            && self.speed_m_s.is_none_or(|speed| (CREEPING_M_S..=FAST_M_S).contains(&speed))
            && (self.largest_s < LONGEST_S || THIS_CENTURY_S.contains(&self.largest_s))
    }

    fn describe(&self) -> String {
        match (self.step_s, self.speed_m_s) {
            (Some(step), Some(speed)) => format!("rows {} s apart at {} m/s", short(step), short(speed)),
            (Some(step), None) => format!("rows {} s apart", short(step)),
            _ => format!("a time of {} s", short(self.largest_s)),
        }
    }
}

fn short(value: f64) -> String {
    if value != 0.0 && !(1e-3..1e6).contains(&value.abs()) {
        format!("{value:.1e}")
    } else {
        format!("{}", (value * 1e3).round() / 1e3)
    }
}

impl Motion {
    fn in_unit(&self, unit_ns: f64) -> InUnit {
        let unit_s = unit_ns * 1e-9;
        InUnit {
            largest_s: self.largest * unit_s,
            step_s: self.step.map(|step| step * unit_s),
            speed_m_s: self.pace.map(|pace| pace / unit_s),
        }
    }
}

fn motion(rows: &Rows, layout: &Layout) -> Motion {
    let times: Vec<f64> = rows.rows.iter().filter_map(|row| row.time).map(time::to_units).collect();
    let mut largest = 0.0_f64;
    for time in &times {
        largest = largest.max(time.abs());
    }
    let all_whole = rows.rows.iter().filter_map(|row| row.time).all(time::is_whole);
    let mut steps: Vec<f64> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0).collect();
    let step = median(&mut steps);

    let geodetic = layout.frame == Frame::Geodetic;
    let is_null = |position: &[f64; 3]| geodetic && (position[0] == 0.0 || position[1] == 0.0);
    let places = rows.rows.iter().filter(|row| row.has_position() && !is_null(&row.position));
    let places: Vec<(f64, [f64; 3])> =
        places.filter_map(|row| row.time.map(|time| (time::to_units(time), row.position))).collect();
    let mut moves: Vec<(f64, f64)> = places
        .windows(2)
        .map(|pair| (pair[1].0 - pair[0].0, distance_m(pair[0].1, pair[1].1, geodetic)))
        .filter(|(step, distance)| *step > 0.0 && distance.is_finite())
        .collect();
    // A spike is no speed, and a gap none either.
    let mut distances: Vec<f64> =
        moves.iter().map(|(_, distance)| *distance).filter(|distance| *distance > 0.0).collect();
    let usual = median(&mut distances).unwrap_or(0.0);
    let mut paces: Vec<f64> = moves.iter().map(|(step, _)| *step).collect();
    let usual_step = median(&mut paces).unwrap_or(0.0);
    moves.retain(|(step, _)| *step <= 20.0 * usual_step);
    let length: f64 = moves.iter().map(|(_, distance)| distance.min(20.0 * usual)).sum();
    let duration: f64 = moves.iter().map(|(step, _)| step).sum();
    let pace = (length > 0.0 && duration > 0.0).then(|| length / duration);
    Motion { rows: times.len(), largest, step, pace, all_whole, is_geodetic: geodetic }
}

fn distance_m(a: [f64; 3], b: [f64; 3], geodetic: bool) -> f64 {
    let scale = if geodetic { [111_200.0, 111_200.0 * a[0].to_radians().cos(), 1.0] } else { [1.0; 3] };
    (0..3).map(|axis| ((b[axis] - a[axis]) * scale[axis]).powi(2)).sum::<f64>().sqrt()
}

fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let middle = values.len() / 2;
    Some(*values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Brings roll, pitch and yaw to degrees where the header names no unit.
pub(super) fn angles_to_degrees(
    rows: &mut Rows,
    layout: &Layout,
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Result<(), String> {
    let AttitudeColumns::Euler(sources) = layout.attitude else {
        if spec.angle_unit != AngleUnit::Auto {
            notes.push(Note {
                is_warning: true,
                text: "flight.angle_unit is not used: no roll, pitch and yaw are read".to_owned(),
            });
        }
        return Ok(());
    };
    let wanted = match spec.angle_unit {
        AngleUnit::Auto => None,
        AngleUnit::Deg => Some(1.0),
        AngleUnit::Rad => Some(180.0 / std::f64::consts::PI),
    };
    let contradicts = |source: &&Source| source.factor.is_some() && source.factor != wanted;
    if let (Some(_), Some(source)) = (wanted, sources.iter().find(contradicts)) {
        return Err(format!(
            "the header names another unit{} than flight.angle_unit; remove the key or correct the header",
            layout.named(source.column)
        ));
    }
    let open: Vec<usize> = (0..3).filter(|&axis| sources[axis].factor.is_none()).collect();
    let factor = match wanted {
        _ if open.is_empty() => return Ok(()),
        Some(factor) => factor,
        None => guess_angles(rows, &open, layout, sources.map(|source| source.column), spec, notes)?,
    };
    if factor != 1.0 {
        for row in &mut rows.rows {
            for &axis in &open {
                row.attitude[axis] *= factor;
            }
        }
    }
    Ok(())
}

fn guess_angles(
    rows: &Rows,
    open: &[usize],
    layout: &Layout,
    columns: [usize; 3],
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Result<f64, String> {
    use std::f64::consts::{FRAC_PI_2, PI, TAU};
    let column =
        |axis: usize| rows.rows.iter().map(move |row| row.attitude[axis]).filter(|value| value.is_finite());
    if spec.angles != AngleKind::Continuous {
        for &axis in open {
            let steps = column(axis).zip(column(axis).skip(1)).map(|(a, b)| (b - a).abs());
            if column(axis).next().is_some_and(|first| first.abs() > 720.0)
                || steps.into_iter().any(|step| step > 10_000.0)
            {
                return Err(format!(
                    "column {}{} holds {}, which is no angle in degrees: name the unit in the header (yaw_cdeg), or set flight.angles = \"continuous\" if turns count",
                    columns[axis] + 1,
                    layout.named(columns[axis]),
                    short(column(axis).fold(0.0, |most: f64, value| if value.abs() > most.abs() {
                        value
                    } else {
                        most
                    }))
                ));
            }
        }
    }
    const SLACK: f64 = 0.005;
    let domain = [-PI..=PI, -FRAC_PI_2..=FRAC_PI_2, -PI..=TAU];
    let within = |axis: usize| {
        column(axis).all(|value| (domain[axis].start() - SLACK..=domain[axis].end() + SLACK).contains(&value))
    };
    let all_zero = open.iter().all(|&axis| column(axis).all(|value| value == 0.0));
    if all_zero || !open.iter().all(|&axis| within(axis)) {
        let most = |axis: usize| column(axis).fold(0.0, |most: f64, value| most.max(value.abs()));
        let (low, high) = column(2)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), yaw| (yaw.min(low), yaw.max(high)));
        let tilt = most(0).max(most(1));
        if open.len() == 3 && tilt > 0.0 && tilt <= 1.6 && high - low > 6.3 {
            notes.push(Note {
                is_warning: true,
                text: format!(
                    "roll and pitch are read as degrees like yaw, but never exceed {}: if they are radians, set flight.angle_unit or name the units in the header (roll_rad, yaw_deg)",
                    short(tilt)
                ),
            });
        }
        return Ok(1.0);
    }
    let wraps = |a: f64, b: f64| {
        (b - a).abs() > 5.2 && ((a.abs() > 2.6 && b.abs() > 2.6 && a * b < 0.0) || (a - b).abs() > 5.5)
    };
    let is_open_yaw = open.contains(&2);
    let jumps =
        if is_open_yaw { column(2).zip(column(2).skip(1)).filter(|&(a, b)| wraps(a, b)).count() } else { 0 };
    if jumps > 0 {
        notes.push(Note {
            is_warning: true,
            text: format!(
                "roll, pitch and yaw are read as radians: their columns name no unit, all stay within a turn of radians, and yaw jumps by one {jumps} times; flight.angle_unit decides"
            ),
        });
        return Ok(180.0 / PI);
    }
    Err(format!(
        "roll, pitch and yaw name no unit and stay within pi throughout (column {}{}): set flight.angle_unit = \"deg\" or \"rad\", or name the unit in the header (yaw_deg, yaw_rad)",
        columns[2] + 1,
        layout.named(columns[2])
    ))
}

/// Refuses latitudes and longitudes that may be radians.
pub(super) fn check_degrees(rows: &Rows, layout: &Layout) -> Result<(), String> {
    use std::f64::consts::{FRAC_PI_2, PI};
    let [latitude, longitude, _] = layout.position;
    if layout.frame != Frame::Geodetic || latitude.factor.is_some() || longitude.factor.is_some() {
        return Ok(());
    }
    let column =
        |axis: usize| rows.rows.iter().filter(|row| row.has_position()).map(move |row| row.position[axis]);
    let mut latitudes: Vec<f64> = column(0).map(f64::abs).filter(|value| *value > 0.0).collect();
    // In degrees that is the Gulf of Guinea and no land; close to the equator it is a made-up place.
    let far_from_equator = median(&mut latitudes).is_some_and(|latitude| latitude > 0.05);
    if far_from_equator
        && column(0).all(|value| value.abs() <= FRAC_PI_2)
        && column(1).all(|value| value.abs() <= PI)
    {
        return Err(format!(
            "latitude and longitude (columns {} and {}) name no unit and stay within pi: name them lat_rad and lon_rad, or lat_deg and lon_deg, in a header line",
            latitude.column + 1,
            longitude.column + 1
        ));
    }
    Ok(())
}
