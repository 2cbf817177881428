//! What prose says about the numbers of a table: comments above, among and below the rows, and lines before
//! the names of the columns.
//!
//! A unit that plainly belongs to a column which names none is applied, and so is the order of quaternions
//! without names. Any other statement that concerns what is read, and differs from how it is read, is named
//! in a warning.

use camsim_core::{
    flight_log::Note,
    scenario::{AngleUnit, FlightSpec, Origin, TimeUnit},
};

use super::{
    angle_unit::unit_of_angle_key,
    column_meaning::ColumnMeaning,
    columns::{AttitudeColumns, Frame},
    header::parse_name,
    layout::TableLayout,
    text_table::{HeaderLine, Table},
    time_unit::unit_of_key,
    units::{Dimension, Unit},
};

mod conventions;
mod prose_units;

/// Lines of prose that a warning quotes.
const MAX_QUOTED: usize = 4;
/// Characters of a line that a warning quotes.
const MAX_CHARACTERS: usize = 80;

/// A number of a row that prose may give a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Target {
    Time,
    /// Index of the position.
    Position(usize),
    /// Index of roll, pitch and yaw.
    Angle(usize),
}

/// Applies what prose says to the layout of a table, or warns.
pub(super) fn apply(
    layout: &mut TableLayout,
    table: &Table<'_>,
    prose: &[HeaderLine<'_>],
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) {
    let lines: Vec<HeaderLine<'_>> = prose.iter().chain(&table.later_comments).copied().collect();
    let mut doubts = apply_units(layout, table, &lines, spec, notes);
    doubts.extend(conventions::apply(layout, &lines, spec, notes));
    doubts.extend(lines.iter().filter_map(|line| reference_position(layout, line, spec)));
    if doubts.is_empty() {
        return;
    }
    doubts.dedup_by(|one, other| one.line == other.line && one.reason == other.reason);
    let more = doubts.len().saturating_sub(MAX_QUOTED);
    let quoted: Vec<String> = doubts.iter().take(MAX_QUOTED).map(Doubt::describe).collect();
    let more = if more > 0 { format!("; and {more} more") } else { String::new() };
    notes.push(Note::warning(format!("not applied: {}{more}", quoted.join("; "))));
}

/// A comment of RTKLIB that says where local positions count from, unless flight.origin says the same.
fn reference_position(layout: &TableLayout, line: &HeaderLine<'_>, spec: &FlightSpec) -> Option<Doubt> {
    let (_, text) = line.text.trim().strip_prefix("ref pos")?.split_once(':')?;
    let numbers: Vec<f64> = text.split_whitespace().map_while(|word| word.parse().ok()).collect();
    let [latitude, longitude, height_m] = numbers[..] else { return None };
    if layout.frame == Frame::Geodetic || latitude.abs() > 90.0 || longitude.abs() > 360.0 {
        return None;
    }
    let is_origin = |[lat, lon, _]: [f64; 3]| (lat - latitude).abs() < 1e-5 && (lon - longitude).abs() < 1e-5;
    let reason = match spec.origin {
        Origin::Geodetic(origin) if is_origin(origin) => return None,
        Origin::Geodetic(_) => "flight.origin is another position".to_owned(),
        Origin::First => format!(
            "the positions are read as from no known origin: set flight.origin = [{latitude}, {longitude}, \
                {height_m:?}]"
        ),
    };
    Some(Doubt::new(line, reason))
}

/// A statement that is not applied.
struct Doubt {
    line: usize,
    /// The whole line.
    text: String,
    /// How the numbers are read, and what to do.
    reason: String,
}

impl Doubt {
    fn new(line: &HeaderLine<'_>, reason: String) -> Self {
        Self { line: line.number, text: line.text.to_owned(), reason }
    }

    fn describe(&self) -> String {
        let text: String = self.text.chars().take(MAX_CHARACTERS).collect();
        let dots = if text.len() < self.text.len() { "..." } else { "" };
        format!("line {} says `{text}{dots}`, but {}", self.line, self.reason)
    }
}

/// Gives columns without a unit that which prose states. Returns the statements that are not applied.
fn apply_units(
    layout: &mut TableLayout,
    table: &Table<'_>,
    lines: &[HeaderLine<'_>],
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    // Targets with the unit and the line that states it.
    let mut stated: Vec<(Target, &'static Unit, HeaderLine<'_>)> = Vec::new();
    for line in lines {
        let found = prose_units::find(line.text, layout.frame);
        for (targets, unit) in found.plain {
            let targets = if targets.is_empty() { whole_table(unit, layout, table) } else { targets };
            stated.extend(targets.into_iter().map(|target| (target, unit, *line)));
        }
        if let Some(unit) = found.doubtful {
            doubts.push(Doubt::new(line, in_doubt(unit, layout, spec)));
        }
    }
    let mut applied: Vec<(usize, &'static Unit, Vec<String>)> = Vec::new();
    for (index, &(target, unit, line)) in stated.iter().enumerate() {
        let Some(column) = column_of(layout, target) else { continue };
        let name = layout.names.get(column).cloned().unwrap_or_default();
        let same_target = |&&(other, ..): &&(Target, &Unit, HeaderLine<'_>)| other == target;
        if stated.iter().filter(same_target).any(|(_, other, _)| *other != unit) {
            doubts
                .push(Doubt::new(&line, format!("another unit is stated for `{name}`, too: name it there")));
        } else if let Some(named) = unit_of(layout, spec, target) {
            if (named / unit.factor - 1.0).abs() > 1e-9 {
                doubts
                    .push(Doubt::new(&line, format!("`{name}` has another unit by its name or by [flight]")));
            }
        } else if !stated[..index].iter().any(|(other, ..)| *other == target) {
            match applied.iter_mut().find(|(number, other, _)| (*number, *other) == (line.number, unit)) {
                Some((_, _, names)) => names.push(name),
                None => applied.push((line.number, unit, vec![name])),
            }
        }
    }
    for &(target, unit, _) in &stated {
        let differs = stated.iter().any(|(other, u, _)| *other == target && *u != unit);
        if !differs && column_of(layout, target).is_some() && unit_of(layout, spec, target).is_none() {
            set_unit(layout, target, unit.factor);
        }
    }
    for (line, unit, names) in applied {
        notes.push(Note::information(format!(
            "line {line} states the unit of `{}`: {}",
            names.join("`, `"),
            unit.name
        )));
    }
    doubts
}

/// The targets of a unit that stands for the whole table, as in `units: feet, degrees`.
fn whole_table(unit: &Unit, layout: &TableLayout, table: &Table<'_>) -> Vec<Target> {
    let angles = (0..3).map(Target::Angle);
    match unit.dimension {
        Dimension::Time => vec![Target::Time],
        Dimension::Length if layout.frame == Frame::Geodetic => vec![Target::Position(2)],
        Dimension::Length => (0..3).map(Target::Position).collect(),
        Dimension::Angle if layout.frame == Frame::Geodetic && fit_radians(layout, table) => {
            angles.chain((0..2).map(Target::Position)).collect()
        }
        Dimension::Angle => angles.collect(),
    }
}

/// Whether latitudes and longitudes may be radians.
fn fit_radians(layout: &TableLayout, table: &Table<'_>) -> bool {
    let largest = |axis: usize| {
        let values = table.sample(100).filter_map(|row| {
            table.fields(row).get(layout.position[axis].column).and_then(|field| table.number(field))
        });
        values.fold(0.0, |largest: f64, value| largest.max(value.abs()))
    };
    largest(0) <= std::f64::consts::FRAC_PI_2 && largest(1) <= std::f64::consts::PI
}

/// Index of the column of a target, where it is read.
fn column_of(layout: &TableLayout, target: Target) -> Option<usize> {
    match (target, layout.attitude) {
        (Target::Time, _) => Some(layout.time.column),
        (Target::Position(axis), _) => Some(layout.position[axis].column),
        (Target::Angle(axis), AttitudeColumns::Euler(sources)) => Some(sources[axis].column),
        (Target::Angle(_), _) => None,
    }
}

/// Factor of the unit that a name or a key states.
fn unit_of(layout: &TableLayout, spec: &FlightSpec, target: Target) -> Option<f64> {
    match (target, layout.attitude) {
        (Target::Time, _) if spec.time_unit != TimeUnit::Auto => {
            unit_of_key(spec.time_unit).map(|unit| unit.factor)
        }
        (Target::Time, _) => layout.time.unit_ns,
        (Target::Position(axis), _) => layout.position[axis].factor,
        (Target::Angle(_), _) if spec.angle_unit != AngleUnit::Auto => unit_of_angle_key(spec.angle_unit),
        (Target::Angle(axis), AttitudeColumns::Euler(sources)) => sources[axis].factor,
        (Target::Angle(_), _) => None,
    }
}

fn set_unit(layout: &mut TableLayout, target: Target, factor: f64) {
    match (target, &mut layout.attitude) {
        (Target::Time, _) => layout.time.unit_ns = Some(factor),
        (Target::Position(axis), _) => layout.position[axis].factor = Some(factor),
        (Target::Angle(axis), AttitudeColumns::Euler(sources)) => sources[axis].factor = Some(factor),
        (Target::Angle(_), _) => {}
    }
}

/// How numbers are read whose unit prose states unclearly.
fn in_doubt(unit: &Unit, layout: &TableLayout, spec: &FlightSpec) -> String {
    let target = match unit.dimension {
        Dimension::Time => Target::Time,
        Dimension::Length => Target::Position(2),
        Dimension::Angle => Target::Angle(2),
    };
    let name = column_of(layout, target).and_then(|column| layout.names.get(column));
    let name = name.map_or("yaw", |name| name.as_str());
    if unit_of(layout, spec, target).is_some() {
        return format!("the unit of `{name}` is known by its name or by [flight], which counts");
    }
    format!(
        "it is not plainly about a column: write the unit in the column's name, as `{name} ({})`, if it is",
        unit.name
    )
}

/// The meaning of a column by its name.
fn meaning_of(layout: &TableLayout, column: usize) -> Option<ColumnMeaning> {
    Some(parse_name(layout.names.get(column)?, None)?.meaning)
}
