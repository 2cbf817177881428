//! Tables of OptiTrack's Motive: a line of keys, header lines for type, name and quantity, y up.
//!
//! | key | applied |
//! |---|---|
//! | `Length Units` | positions |
//! | `Rotation Type` | only quaternions are read |
//! | `Coordinate Space` | only `Global` is read |
//! | `Capture Start Time` | named: times count from it |
//!
//! Motive's x is taken as east, its z as south, and its bodies have x forward and y up.

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightSpec, LogFormat},
};

use super::{
    RawLog,
    columns::{AttitudeKind, Frame},
    streams::{self, Stream, Streams},
    text_table::{self, Separator},
    time_fields,
    units::{Dimension, Qualifier, SECOND, Unit, parse_qualifier},
    unused_keys::unused_height_note,
};

const AXES: [&str; 4] = ["X", "Y", "Z", "W"];

/// Whether a text is a table of Motive.
pub(super) fn is_motive(content: &str) -> bool {
    content.trim_start().trim_start_matches('"').starts_with("Format Version") && content.contains("\nFrame,")
}

/// The cells of a line.
fn cells(line: &str) -> Vec<&str> {
    let mut cells = Vec::new();
    Separator::Comma.split(line, &mut cells);
    cells
}

/// The header of a table.
struct Header<'a> {
    /// Cells of the first line: keys and their values.
    keys: Vec<&'a str>,
    types: Vec<&'a str>,
    names: Vec<&'a str>,
    /// `Rotation` or `Position`, above the axes.
    quantities: Vec<&'a str>,
    axes: Vec<&'a str>,
    /// Index of the first line of data.
    length: usize,
}

impl<'a> Header<'a> {
    fn parse(content: &'a str) -> Option<Self> {
        let mut header = Self {
            keys: cells(content.lines().find(|line| !line.trim().is_empty())?),
            types: Vec::new(),
            names: Vec::new(),
            quantities: Vec::new(),
            axes: Vec::new(),
            length: 0,
        };
        for (index, line) in content.lines().enumerate() {
            let row = cells(line);
            match (row.first().copied(), row.get(1).copied()) {
                (Some("Frame"), _) => {
                    (header.axes, header.length) = (row, index + 1);
                    return Some(header);
                }
                (_, Some("Type")) => header.types = row,
                (_, Some("Name")) => header.names = row,
                _ => header.quantities = row,
            }
        }
        None
    }

    fn value(&self, key: &str) -> Option<&'a str> {
        self.keys.chunks_exact(2).find(|pair| pair[0] == key).map(|pair| pair[1])
    }

    /// Names of the rigid bodies, in the order of the file.
    fn bodies(&self) -> Vec<&'a str> {
        let mut bodies: Vec<&str> = Vec::new();
        for (name, kind) in self.names.iter().zip(&self.types) {
            if *kind == "Rigid Body" && !bodies.contains(name) {
                bodies.push(name);
            }
        }
        bodies
    }

    /// The columns of a quantity of a body, for each of the first `N` axes.
    fn columns<const N: usize>(&self, body: &str, quantity: &str) -> Option<[usize; N]> {
        let is_body = |column: &usize| {
            self.types.get(*column) == Some(&"Rigid Body")
                && self.names.get(*column) == Some(&body)
                && self.quantities.get(*column) == Some(&quantity)
        };
        let mut columns = [0; N];
        for (column, axis) in columns.iter_mut().zip(AXES) {
            *column = (0..self.axes.len()).filter(is_body).find(|&column| self.axes[column] == axis)?;
        }
        Some(columns)
    }

    fn body(&self, topic: Option<&str>) -> Result<&'a str, String> {
        let bodies = self.bodies();
        let list = || bodies.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ");
        match (&bodies[..], topic) {
            ([], _) => Err("the table of Motive has no rigid body: export one (Rigid Bodies on)".to_owned()),
            (_, Some(topic)) => bodies
                .iter()
                .copied()
                .find(|name| *name == topic)
                .ok_or_else(|| format!("flight.topic: `{topic}` is no rigid body; there are: {}", list())),
            ([body], None) => Ok(body),
            _ => Err(format!(
                "the table of Motive has several rigid bodies: set flight.topic to one of {}",
                list()
            )),
        }
    }
}

/// Reads a table of Motive.
///
/// # Errors
/// There is no rigid body or no choice among several, or its units, space or rotations are not read.
pub(super) fn read(content: &str, spec: &FlightSpec) -> Result<RawLog, String> {
    let header = Header::parse(content).ok_or("the table of Motive has no line `Frame,...`")?;
    if spec.format != LogFormat::Auto {
        return Err(streams::other_format(spec, "a table of Motive"));
    }
    let mut notes = Vec::new();
    notes.extend(unused_height_note(spec));
    let body = header.body(spec.topic.as_deref())?;
    let unit = length_unit(&header)?;
    let positions = header.columns::<3>(body, "Position");
    let positions = positions.ok_or_else(|| format!("the rigid body `{body}` has no positions"))?;
    let rotations = rotations(&header, body, spec)?;
    notes.push(Note::information(format!(
        "a table of Motive in {}: x is taken as east, z as south, y as up; bodies have x forward, y up",
        unit.name
    )));
    if let Some(start) = header.value("Capture Start Time") {
        notes.push(Note::information(format!("times count from the start of the capture, {start}")));
    }
    let time_column = header.axes.iter().position(|name| name.starts_with("Time"));
    let time_column = time_column.ok_or("the table of Motive has no times")?;
    let mut rows = Vec::new();
    for (index, line) in
        content.lines().enumerate().skip(header.length).filter(|(_, line)| !line.trim().is_empty())
    {
        let fields = cells(line);
        let number = |column: usize| {
            let text = fields.get(column).copied().unwrap_or("");
            text_table::number(text, false).ok_or_else(|| {
                format!("line {}, column {} (`{body}`): `{text}` is not a number", index + 1, column + 1)
            })
        };
        let time = fields.get(time_column).and_then(|text| time_fields::fixed_point(text, false)?);
        let time = time.and_then(|time| time_fields::to_ns(time, SECOND.factor)).map(i128::from);
        let mut row = streams::empty_row(index + 1, time);
        let [x, y, z] = positions.map(number);
        row.position = east_north_up([x?, y?, z?].map(|value| value * unit.factor));
        if let Some(rotations) = rotations {
            let [x, y, z, w] = rotations.map(number);
            let [x, y, z] = east_north_up([x?, y?, z?]);
            row.attitude = [x, y, z, w?];
        }
        rows.push(row);
    }
    let kind = if rotations.is_some() { AttitudeKind::Quaternion } else { AttitudeKind::None };
    let position = Stream { name: body.to_owned(), rows };
    Streams { frame: Frame::EastNorthUp, kind, position, attitude: None, notes }.into_log(spec)
}

/// A vector with z up of one with y up.
fn east_north_up([x, y, z]: [f64; 3]) -> [f64; 3] {
    [x, -z, y]
}

fn length_unit(header: &Header<'_>) -> Result<&'static Unit, String> {
    let Some(text) = header.value("Length Units") else {
        return Err("the first line states no `Length Units`: add `,Length Units,Meters` to it if they are"
            .to_owned());
    };
    match parse_qualifier(text) {
        Some(Qualifier::Unit(unit)) if unit.dimension == Dimension::Length => Ok(unit),
        _ => Err(format!("`Length Units` is `{text}`, which is no unit of length known: export in meters")),
    }
}

/// The columns of the quaternion, where the attitude is read.
fn rotations(header: &Header<'_>, body: &str, spec: &FlightSpec) -> Result<Option<[usize; 4]>, String> {
    if let Some(space) = header.value("Coordinate Space").filter(|space| *space != "Global") {
        return Err(format!("`Coordinate Space` is `{space}`: export the take again in global coordinates"));
    }
    if spec.attitude == AttitudeSource::Track {
        return Ok(None);
    }
    match (header.value("Rotation Type"), header.columns::<4>(body, "Rotation")) {
        (None | Some("Quaternion"), columns) => Ok(columns),
        (Some(kind), _) => Err(format!(
            "`Rotation Type` is `{kind}`: export the take again with quaternions, or set flight.attitude = \
                \"track\""
        )),
    }
}
