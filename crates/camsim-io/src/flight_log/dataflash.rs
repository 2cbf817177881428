//! ArduPilot logs (DataFlash, `.bin`): positions and attitudes of the filters.
//!
//! | message | applied |
//! |---|---|
//! | `POS` | `Lat`, `Lng` (deg), `Alt` (m above mean sea level), with the attitude of `ATT` |
//! | `AHR2`, `SIM` | the same with `Roll`, `Pitch`, `Yaw` (deg) of their own |
//! | `XKF1`, `NKF1` | `PN`, `PE`, `PD` (m) from the origin in `ORGN`, with `Roll`, `Pitch`, `Yaw` |
//! | `GPS`, `GPS2`, `GPSB` | `Lat`, `Lng`, `Alt`; rows without a 3D fix are skipped |
//! | `ATT` | `Roll`, `Pitch`, `Yaw` (deg, from true north) |
//! | `XKQ`, `NKQ` | `Q1` to `Q4`: w, x, y, z |
//!
//! Without `flight.topic` the first of `POS`, `XKF1`, `NKF1`, `AHR2`, `GPS` is flown (`NKF1` before `XKF1`
//! where the parameter `AHRS_EKF_TYPE` is 2). `flight.topic` names another, as `XKF1#1` (core 1) or `GPS, AHR2`.
//! Of several cores or receivers the one that the vehicle used is flown (`instances`). Times are `TimeUS`, or
//! `TimeMS` in old logs.

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightSpec, HeightReference},
};

use super::{
    RawLog,
    columns::{AttitudeKind, Frame},
    rows::ParsedRow,
    streams::{self, Stream, Streams, listed},
    unused_keys::unused_height_note,
};

mod file;
mod instances;

use file::{Column, DataflashFile, Message};
use instances::Part;

/// Messages with positions, the best first. `AHR2` is the estimate that stands by.
const POSITIONS: [&str; 5] = ["POS", "XKF1", "NKF1", "AHR2", "GPS"];
/// The same where the second filter flies.
const POSITIONS_OF_EKF2: [&str; 5] = ["POS", "NKF1", "XKF1", "AHR2", "GPS"];
/// Degrees of latitude per metre in ArduPilot's local frame.
const DEG_PER_M: f64 = 1e-7 / 0.011_131_884_502_145_034;

/// Reads a DataFlash file.
///
/// # Errors
/// The file is no DataFlash file, or has no positions, or not those that `flight.topic` names.
pub(super) fn read(bytes: &[u8], spec: &FlightSpec) -> Result<RawLog, String> {
    let file = DataflashFile::parse(bytes)?;
    let mut notes: Vec<Note> = file.damage.iter().map(Note::warning).collect();
    notes.extend(unused_height_note(spec));
    let (position_name, attitude_name) = streams::named_topics(spec);
    let chosen = choose(&file, position_name)?;
    let mut position = chosen.stream(&file, &mut notes)?;
    notes.extend(streams::height_note("heights of ArduPilot", HeightReference::Msl, spec));
    let wants_other = attitude_name.is_some() || attitude_columns(chosen.message).is_none();
    let (attitude, kind) = if spec.attitude == AttitudeSource::Track {
        (None, AttitudeKind::None)
    } else if wants_other {
        position.rows.iter_mut().for_each(|row| row.attitude = [f64::NAN; 4]);
        attitude_stream(&file, attitude_name, &mut notes)?
    } else {
        (None, AttitudeKind::Euler)
    };
    Streams { frame: Frame::Geodetic, kind, position, attitude, notes }.into_log(spec)
}

/// A message that is read, with the instance of it that `flight.topic` names.
struct Chosen<'a, 'b> {
    message: &'b Message<'a>,
    parts: Vec<Part<'a, 'b>>,
    instance: Option<u32>,
}

/// Columns of a position.
#[derive(Clone, Copy)]
enum PositionColumns {
    /// Latitude, longitude, height.
    Geodetic([Column; 3]),
    /// North, east, down from the filter's origin.
    Local([Column; 3]),
}

fn position_columns(message: &Message<'_>) -> Option<PositionColumns> {
    let geodetic = message.columns(["Lat", "Lng", "Alt"]).map(PositionColumns::Geodetic);
    geodetic.or_else(|| message.columns(["PN", "PE", "PD"]).map(PositionColumns::Local))
}

/// Columns of angles.
fn attitude_columns(message: &Message<'_>) -> Option<[Column; 3]> {
    message.columns(["Roll", "Pitch", "Yaw"])
}

/// The message to fly: the one that `flight.topic` names, else the first of [`POSITIONS`].
fn choose<'a, 'b>(file: &'b DataflashFile<'a>, name: Option<&str>) -> Result<Chosen<'a, 'b>, String> {
    let (stem, instance) = name.map_or(("", None), streams::split_instance);
    let by_rank = if file.parameter("AHRS_EKF_TYPE") == Some(2.0) { &POSITIONS_OF_EKF2 } else { &POSITIONS };
    let names = if name.is_some() { &[stem][..] } else { &by_rank[..] };
    for name in names {
        let Some(message) = file.find(name) else { continue };
        let Some(columns) = position_columns(message) else { continue };
        // Without the origin of the filter, its metres give no position on Earth.
        if matches!(columns, PositionColumns::Local(_)) && origin(file).is_none() && names.len() > 1 {
            continue;
        }
        return Ok(Chosen { message, parts: instances::parts(file, message), instance });
    }
    let all: Vec<String> = file
        .all()
        .into_iter()
        .filter(|message| {
            position_columns(message).is_some() && message.name != "ORGN" && message.name != "CMD"
        })
        .map(|message| message.name.clone())
        .collect();
    Err(match (name, all.is_empty()) {
        (Some(name), _) => {
            format!("flight.topic: `{name}` is no message with positions; there are: {}", listed(&all))
        }
        (None, true) => "the ArduPilot log has no positions (POS, AHR2, XKF1, GPS): set LOG_BITMASK to log \
            them"
            .to_owned(),
        (None, false) => format!("flight.topic must name the positions to fly: {}", all.join(", ")),
    })
}

/// Latitude, longitude and height of the filters' origin.
fn origin(file: &DataflashFile<'_>) -> Option<[f64; 3]> {
    let message = file.find("ORGN")?;
    let columns = message.columns(["Lat", "Lng", "Alt"])?;
    let kind = message.column(&["Type"]);
    // Type 0 is the origin of the filter, 1 the home position.
    let record =
        message.records.iter().find(|(_, record)| kind.is_none_or(|kind| kind.read(record) == 0.0))?;
    Some(columns.map(|column| column.read(record.1)))
}

/// Nanoseconds of the time of a record.
fn time_reader(message: &Message<'_>) -> Result<impl Fn(&[u8]) -> Option<i128> + use<>, String> {
    let (column, unit_ns) = message
        .column(&["TimeUS"])
        .map(|column| (column, 1e3))
        .or_else(|| message.column(&["TimeMS", "T"]).map(|column| (column, 1e6)))
        .ok_or_else(|| format!("`{}` has no time (TimeUS)", message.name))?;
    Ok(move |record: &[u8]| {
        let time = column.read(record);
        (time.is_finite() && time < 9e15).then_some((time * unit_ns) as i128)
    })
}

impl Chosen<'_, '_> {
    /// The positions, with the attitudes of the same message.
    fn stream(&self, file: &DataflashFile<'_>, notes: &mut Vec<Note>) -> Result<Stream, String> {
        let name = self.message.name.clone();
        let records = instances::select(file, &self.parts, self.instance, notes)?;
        let origin = match position_columns(self.message) {
            Some(PositionColumns::Local(_)) => Some(origin(file).ok_or_else(|| {
                format!(
                    "`{name}` counts metres from an origin that the log does not have (ORGN): choose another \
                    by flight.topic"
                )
            })?),
            _ => None,
        };
        let mut readers = Vec::new();
        for Part { message, .. } in &self.parts {
            let columns =
                position_columns(message).ok_or_else(|| format!("`{}` has no positions", message.name))?;
            readers.push((time_reader(message)?, columns, attitude_columns(message)));
        }
        let (mut rows, mut without_fix) = (Vec::with_capacity(records.len()), 0);
        for instances::Selected { number, record, part, .. } in records {
            let (time, columns, attitude) = &readers[part];
            if !instances::has_fix(&self.parts[part], record) {
                without_fix += 1;
                continue;
            }
            let mut row = streams::empty_row(number, time(record));
            row.position = match (*columns, origin) {
                (PositionColumns::Local(columns), Some(origin)) => {
                    geodetic_from_local(columns.map(|column| column.read(record)), origin)
                }
                (PositionColumns::Local(columns) | PositionColumns::Geodetic(columns), _) => {
                    columns.map(|column| column.read(record))
                }
            };
            if let Some([roll, pitch, yaw]) = attitude {
                row.attitude = [roll.read(record), pitch.read(record), yaw.read(record), f64::NAN];
            }
            rows.push(row);
        }
        if without_fix > 0 {
            notes.push(Note::warning(format!(
                "{without_fix} positions of `{name}` have no 3D fix, and are skipped"
            )));
        }
        Ok(Stream { name, rows })
    }
}

/// Geodetic position, in degrees and metres, from north, east, down about an origin, as ArduPilot offsets its
/// locations: a degree of longitude is that at the mean latitude.
fn geodetic_from_local([north, east, down]: [f64; 3], [lat, lon, height]: [f64; 3]) -> [f64; 3] {
    let latitude = lat + north * DEG_PER_M;
    let scale = (0.5 * (lat + latitude)).to_radians().cos().max(0.01);
    [latitude, lon + east * DEG_PER_M / scale, height - down]
}

/// The attitudes of the message that `flight.topic` names, else of `ATT`.
fn attitude_stream(
    file: &DataflashFile<'_>,
    name: Option<&str>,
    notes: &mut Vec<Note>,
) -> Result<(Option<Stream>, AttitudeKind), String> {
    let (stem, instance) = streams::split_instance(name.unwrap_or("ATT"));
    let quaternion = |message: &Message<'_>| message.columns(["Q1", "Q2", "Q3", "Q4"]);
    let euler = |message: &Message<'_>| attitude_columns(message);
    let Some(message) =
        file.find(stem).filter(|&message| euler(message).is_some() || quaternion(message).is_some())
    else {
        let Some(name) = name else { return Ok((None, AttitudeKind::None)) };
        let all: Vec<String> = file
            .all()
            .into_iter()
            .filter(|message| euler(message).is_some() || quaternion(message).is_some())
            .map(|message| message.name.clone())
            .collect();
        return Err(format!(
            "flight.topic: `{name}` is no message with attitudes; there are: {}",
            listed(&all)
        ));
    };
    let parts = instances::parts(file, message);
    let mut readers = Vec::new();
    for Part { message, .. } in &parts {
        readers.push((time_reader(message)?, attitude_columns(message), quaternion(message)));
    }
    let mut rows = Vec::new();
    for instances::Selected { number, record, part, .. } in instances::select(file, &parts, instance, notes)?
    {
        let (time, angles, q) = &readers[part];
        let attitude = match (angles, q) {
            (Some(angles), _) => {
                let [roll, pitch, yaw] = angles.map(|column| column.read(record));
                [roll, pitch, yaw, f64::NAN]
            }
            (None, Some(q)) => {
                let [w, x, y, z] = q.map(|column| column.read(record));
                [x, y, z, w]
            }
            (None, None) => [f64::NAN; 4],
        };
        rows.push(ParsedRow { attitude, ..streams::empty_row(number, time(record)) });
    }
    let kind =
        if attitude_columns(message).is_some() { AttitudeKind::Euler } else { AttitudeKind::Quaternion };
    Ok((Some(Stream { name: message.name.clone(), rows }), kind))
}
