//! ArduPilot logs (DataFlash, `.bin`): positions and attitudes of the filters.
//!
//! | message | applied |
//! |---|---|
//! | `POS` | `Lat`, `Lng` (deg), `Alt` (m above mean sea level), with the attitude of `ATT` |
//! | `AHR2`, `SIM` | the same with `Roll`, `Pitch`, `Yaw` (deg) of their own |
//! | `XKF1`, `NKF1` | `PN`, `PE`, `PD` (m) from the origin in `ORGN`, with `Roll`, `Pitch`, `Yaw` |
//! | `GPS`, `GPS2`, `GPSB` | `Lat`, `Lng`, `Alt`; rows without a 3D fix are left out |
//! | `ATT` | `Roll`, `Pitch`, `Yaw` (deg, from true north) |
//! | `XKQ`, `NKQ` | `Q1` to `Q4`: w, x, y, z |
//!
//! Without `flight.topic` the first of `POS`, `AHR2`, `XKF1`, `NKF1`, `GPS` is flown. `flight.topic` names
//! another, as `XKF1#1` (core 1) or `GPS, AHR2`. Times are `TimeUS`, or `TimeMS` in old logs.

use std::path::Path;

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightSpec, LogFormat},
};

use super::{
    FlightLogError, RawLog,
    columns::{AttitudeKind, Frame},
    rows::ParsedRow,
    streams::{self, Stream, Streams},
    unused_keys::unused_height_note,
};

mod file;

use file::{Column, DataflashFile, Message};

/// Messages with positions, the best first.
const POSITIONS: [&str; 5] = ["POS", "AHR2", "XKF1", "NKF1", "GPS"];
/// Degrees of latitude per metre in ArduPilot's local frame.
const DEG_PER_M: f64 = 1e-7 / 0.011_131_884_502_145_034;

/// Reads a DataFlash file.
///
/// # Errors
/// The file is no DataFlash file, or has no positions, or not those that `flight.topic` names.
pub(super) fn read(path: &Path, bytes: &[u8], spec: &FlightSpec) -> Result<RawLog, FlightLogError> {
    let problem = |problem: String| FlightLogError::Values { path: path.to_owned(), problem };
    streams::check_format(path, spec, LogFormat::Dataflash)?;
    let file = DataflashFile::parse(bytes).map_err(problem)?;
    let mut notes: Vec<Note> =
        file.damage.iter().map(|text| Note { is_warning: true, text: text.clone() }).collect();
    notes.extend(unused_height_note(spec));
    let (position_name, attitude_name) = streams::named_topics(spec);
    let chosen = choose(&file, position_name).map_err(problem)?;
    let mut position = chosen.stream(&file, &mut notes).map_err(problem)?;
    notes.extend(streams::height_note("heights of ArduPilot", true, spec));
    let wants_other = attitude_name.is_some() || chosen.attitude.is_none();
    let (attitude, kind) = if spec.attitude == AttitudeSource::Track {
        (None, AttitudeKind::None)
    } else if wants_other {
        position.rows.iter_mut().for_each(|row| row.attitude = [f64::NAN; 4]);
        attitude_stream(&file, attitude_name).map_err(problem)?
    } else {
        (None, AttitudeKind::Euler)
    };
    Streams { frame: Frame::Geodetic, kind, position, attitude, notes }.into_log(path, spec)
}

/// A message that is read, with the instance of it.
struct Chosen<'a, 'b> {
    message: &'b Message<'a>,
    instance: u32,
    place: PlaceColumns,
    attitude: Option<[Column; 3]>,
}

/// Columns of a position.
#[derive(Clone, Copy)]
enum PlaceColumns {
    /// Latitude, longitude, height.
    Geodetic([Column; 3]),
    /// North, east, down from the filter's origin.
    Local([Column; 3]),
}

fn place(message: &Message<'_>) -> Option<PlaceColumns> {
    let geodetic = message.columns(["Lat", "Lng", "Alt"]).map(PlaceColumns::Geodetic);
    geodetic.or_else(|| message.columns(["PN", "PE", "PD"]).map(PlaceColumns::Local))
}

/// The message to fly: the one that `flight.topic` names, else the first of [`POSITIONS`].
fn choose<'a, 'b>(file: &'b DataflashFile<'a>, name: Option<&str>) -> Result<Chosen<'a, 'b>, String> {
    let (stem, instance) = name.map_or(("", None), streams::split_instance);
    let names = if name.is_some() { &[stem][..] } else { &POSITIONS[..] };
    for name in names {
        let Some(message) = file.find(name) else { continue };
        let Some(place) = place(message) else { continue };
        // Without the origin of the filter, its metres are of no place.
        if matches!(place, PlaceColumns::Local(_)) && origin(file).is_none() && names.len() > 1 {
            continue;
        }
        let instance = instance.unwrap_or_else(|| first_instance(message));
        return Ok(Chosen { message, instance, place, attitude: message.columns(["Roll", "Pitch", "Yaw"]) });
    }
    let all: Vec<&str> = file
        .all()
        .into_iter()
        .filter(|message| place(message).is_some() && message.name != "ORGN" && message.name != "CMD")
        .map(|message| message.name.as_str())
        .collect();
    Err(match (name, all.is_empty()) {
        (Some(name), _) => format!(
            "flight.topic: `{name}` is no message with positions; there are: {}",
            if all.is_empty() { "none".to_owned() } else { all.join(", ") }
        ),
        (None, true) => "the ArduPilot log has no positions (POS, AHR2, XKF1, GPS): set LOG_BITMASK to log \
            them"
            .to_owned(),
        (None, false) => format!("flight.topic must name the positions to fly: {}", all.join(", ")),
    })
}

/// The column that counts sensors or cores.
fn instance_column(message: &Message<'_>) -> Option<Column> {
    message.column(&["I", "C"])
}

/// The lowest instance of a message.
fn first_instance(message: &Message<'_>) -> u32 {
    let Some(column) = instance_column(message) else { return 0 };
    let lowest = message.records.iter().map(|(_, record)| column.read(record)).fold(f64::INFINITY, f64::min);
    if lowest.is_finite() { lowest as u32 } else { 0 }
}

/// Records of one instance.
fn of_instance<'a>(message: &Message<'a>, instance: u32) -> Vec<(usize, &'a [u8])> {
    let column = instance_column(message);
    let is_wanted = |record: &[u8]| column.is_none_or(|column| column.read(record) == f64::from(instance));
    message.records.iter().copied().filter(|(_, record)| is_wanted(record)).collect()
}

/// Latitude, longitude and height of the filters' origin.
fn origin(file: &DataflashFile<'_>) -> Option<[f64; 3]> {
    let message = file.find("ORGN")?;
    let columns = message.columns(["Lat", "Lng", "Alt"])?;
    let kind = message.column(&["Type"]);
    // Type 0 is the origin of the filter, 1 the place of the home.
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
        let time = time_reader(self.message)?;
        let fix = self.message.column(&["Status"]).filter(|_| name.starts_with("GPS"));
        let records = of_instance(self.message, self.instance);
        if records.is_empty() {
            return Err(format!("flight.topic: `{name}` has no instance {}", self.instance));
        }
        let origin = match self.place {
            PlaceColumns::Local(_) => Some(origin(file).ok_or_else(|| {
                format!(
                    "`{name}` counts metres from an origin that the log does not have (ORGN): choose another \
                    by flight.topic"
                )
            })?),
            PlaceColumns::Geodetic(_) => None,
        };
        let (mut rows, mut without_fix) = (Vec::with_capacity(records.len()), 0);
        for (number, record) in records {
            if fix.is_some_and(|fix| fix.read(record) < 3.0) {
                without_fix += 1;
                continue;
            }
            let mut row = streams::empty_row(number, time(record));
            row.position = match (self.place, origin) {
                (PlaceColumns::Local(columns), Some(origin)) => {
                    geodetic_from_local(columns.map(|column| column.read(record)), origin)
                }
                (PlaceColumns::Local(columns) | PlaceColumns::Geodetic(columns), _) => {
                    columns.map(|column| column.read(record))
                }
            };
            if let Some([roll, pitch, yaw]) = self.attitude {
                row.attitude = [roll.read(record), pitch.read(record), yaw.read(record), f64::NAN];
            }
            rows.push(row);
        }
        if without_fix > 0 {
            notes.push(Note {
                is_warning: true,
                text: format!("{without_fix} positions of `{name}` have no 3D fix, and are left out"),
            });
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
) -> Result<(Option<Stream>, AttitudeKind), String> {
    let (stem, instance) = streams::split_instance(name.unwrap_or("ATT"));
    let quaternion = |message: &Message<'_>| message.columns(["Q1", "Q2", "Q3", "Q4"]);
    let euler = |message: &Message<'_>| message.columns(["Roll", "Pitch", "Yaw"]);
    let Some(message) =
        file.find(stem).filter(|&message| euler(message).is_some() || quaternion(message).is_some())
    else {
        let Some(name) = name else { return Ok((None, AttitudeKind::None)) };
        let all: Vec<&str> = file
            .all()
            .into_iter()
            .filter(|message| euler(message).is_some() || quaternion(message).is_some())
            .map(|message| message.name.as_str())
            .collect();
        return Err(format!(
            "flight.topic: `{name}` is no message with attitudes; there are: {}",
            if all.is_empty() { "none".to_owned() } else { all.join(", ") }
        ));
    };
    let time = time_reader(message)?;
    let records = of_instance(message, instance.unwrap_or_else(|| first_instance(message)));
    let row = |number: usize, record: &[u8], attitude: [f64; 4]| ParsedRow {
        attitude,
        ..streams::empty_row(number, time(record))
    };
    let (rows, kind) = match (euler(message), quaternion(message)) {
        (Some(angles), _) => {
            let read = |record: &[u8]| {
                let [roll, pitch, yaw] = angles.map(|column| column.read(record));
                [roll, pitch, yaw, f64::NAN]
            };
            let rows = records.into_iter().map(|(number, record)| row(number, record, read(record)));
            (rows.collect(), AttitudeKind::Euler)
        }
        (None, Some(q)) => {
            let read = |record: &[u8]| {
                let [w, x, y, z] = q.map(|column| column.read(record));
                [x, y, z, w]
            };
            let rows = records.into_iter().map(|(number, record)| row(number, record, read(record)));
            (rows.collect(), AttitudeKind::Quaternion)
        }
        (None, None) => (Vec::new(), AttitudeKind::None),
    };
    Ok((Some(Stream { name: message.name.clone(), rows }), kind))
}
