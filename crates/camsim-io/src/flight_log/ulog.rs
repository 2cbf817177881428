//! PX4 logs (ULog): positions and attitudes of the estimators.
//!
//! | topic | applied |
//! |---|---|
//! | `vehicle_global_position`, `estimator_global_position` | `lat`, `lon` (deg), `alt` (m above mean sea level) or `alt_ellipsoid` |
//! | `vehicle_local_position`, `estimator_local_position` | `x`, `y`, `z` (m north, east, down); with `ref_lat`, `ref_lon`, `ref_alt` they become geodetic by PX4's own projection |
//! | `vehicle_gps_position`, `sensor_gps` | both spellings of latitude, longitude and the two heights; rows without a 3D fix are left out |
//! | `vehicle_odometry`, `vehicle_visual_odometry` | `position` (m north, east, down) with `q` |
//! | `vehicle_attitude`, `estimator_attitude` | `q`: w, x, y, z; takes forward-right-down to north-east-down |
//!
//! `flight.topic` names others, as `estimator_local_position#1` or `vehicle_gps_position, vehicle_attitude`.
//! Times are `timestamp_sample` where a topic has it, else `timestamp`, in microseconds since the start.

use std::path::Path;

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightSpec, HeightReference, LogFormat},
};

use super::{
    FlightLogError, RawLog,
    columns::{AttitudeKind, Frame},
    rows::ParsedRow,
    streams::{self, Stream, Streams},
    unused_height_note,
};

mod file;

use file::{Topic, UlogField, UlogFile};

/// Topics with positions, the best first.
const POSITIONS: [&str; 5] = [
    "vehicle_global_position",
    "vehicle_local_position",
    "vehicle_odometry",
    "vehicle_gps_position",
    "sensor_gps",
];
/// Radius of PX4's projection.
const EARTH_RADIUS_M: f64 = 6_371_000.0;

/// Reads a ULog file.
///
/// # Errors
/// The file is no ULog, or has no positions, or not those that `flight.topic` names.
pub(super) fn read(path: &Path, bytes: &[u8], spec: &FlightSpec) -> Result<RawLog, FlightLogError> {
    let problem = |problem: String| FlightLogError::Values { path: path.to_owned(), problem };
    streams::check_format(path, spec, LogFormat::Ulog)?;
    let file = UlogFile::parse(bytes).map_err(problem)?;
    let mut notes: Vec<Note> =
        file.damage.iter().map(|text| Note { is_warning: true, text: text.clone() }).collect();
    notes.extend(unused_height_note(spec));
    let (position_name, attitude_name) = streams::named_topics(spec);
    let (topic, reader, position) = positions(&file, position_name, spec, &mut notes).map_err(problem)?;
    let attitude = if spec.attitude == AttitudeSource::Track || reader.quaternion.is_some() {
        None
    } else {
        attitude_stream(&file, topic, attitude_name).map_err(problem)?
    };
    let kind = match (&attitude, reader.quaternion) {
        (None, None) => AttitudeKind::None,
        _ => AttitudeKind::Quaternion,
    };
    let frame = if reader.is_geodetic() { Frame::Geodetic } else { Frame::NorthEastDown };
    Streams { frame, kind, position, attitude, notes }.into_log(path, spec)
}

/// Name of a topic with its instance.
fn full_name(topic: &Topic<'_>) -> String {
    if topic.instance == 0 { topic.name.clone() } else { format!("{}#{}", topic.name, topic.instance) }
}

/// The topic of a name with messages; several subscriptions of one topic are one here: the longest counts.
fn find<'a, 'b>(file: &'b UlogFile<'a>, name: &str) -> Option<&'b Topic<'a>> {
    let (stem, instance) = streams::split_instance(name);
    file.topics
        .iter()
        .filter(|topic| topic.name == stem && u32::from(topic.instance) == instance.unwrap_or(0))
        .max_by_key(|topic| topic.messages.len())
        .filter(|topic| !topic.messages.is_empty())
}

/// The positions to fly: of the topic that `flight.topic` names, else of the first with valid ones.
fn positions<'a, 'b>(
    file: &'b UlogFile<'a>,
    name: Option<&str>,
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Result<(&'b Topic<'a>, PositionReader, Stream), String> {
    let usable = |topic: &&Topic<'_>| !topic.messages.is_empty() && Place::of(topic).is_some();
    let all: Vec<String> = file.topics.iter().filter(usable).map(full_name).collect();
    let candidates: Vec<&Topic<'_>> = match name {
        Some(name) => find(file, name).filter(usable).into_iter().collect(),
        None => POSITIONS.iter().filter_map(|name| find(file, name).filter(usable)).collect(),
    };
    for topic in &candidates {
        let mut its_notes = Vec::new();
        let reader = PositionReader::new(topic, spec, &mut its_notes)?;
        let stream = reader.stream(topic, &mut its_notes);
        if stream.rows.iter().any(ParsedRow::has_position) {
            notes.extend(its_notes);
            return Ok((topic, reader, stream));
        }
        notes.push(Note { is_warning: true, text: format!("`{}` has no valid position", full_name(topic)) });
    }
    Err(match (name, candidates.is_empty(), all.is_empty()) {
        (Some(name), true, _) => {
            format!("flight.topic: `{name}` is no topic with positions; there are: {}", listed(&all))
        }
        (_, false, _) => format!(
            "no position is valid in {}: the estimator had none, fly with GNSS or motion capture, or set \
                flight.topic to another of {}",
            listed(&candidates.into_iter().map(full_name).collect::<Vec<_>>()),
            listed(&all)
        ),
        (None, true, true) => {
            "the PX4 log has no positions (vehicle_global_position, vehicle_local_position, \
            vehicle_gps_position): log them by SDLOG_PROFILE"
                .to_owned()
        }
        (None, true, false) => format!("flight.topic must name the positions to fly: {}", listed(&all)),
    })
}

fn listed(names: &[String]) -> String {
    if names.is_empty() { "none".to_owned() } else { names.join(", ") }
}

/// The fields of a position.
#[derive(Clone, Copy, Debug)]
enum Place {
    /// Latitude and longitude with a factor to degrees, and heights with a factor to metres.
    Geodetic {
        plane: [UlogField; 2],
        plane_factor: f64,
        msl: UlogField,
        ellipsoid: Option<UlogField>,
        height_factor: f64,
    },
    /// North, east, down.
    Local([UlogField; 3]),
}

impl Place {
    fn of(topic: &Topic<'_>) -> Option<Self> {
        let both = |a: &str, b: &str| Some([topic.field(a)?, topic.field(b)?]);
        if let Some(plane) = both("latitude_deg", "longitude_deg") {
            let (msl, ellipsoid) = (topic.field("altitude_msl_m")?, topic.field("altitude_ellipsoid_m"));
            return Some(Self::Geodetic { plane, plane_factor: 1.0, msl, ellipsoid, height_factor: 1.0 });
        }
        if let Some(plane) = both("lat", "lon") {
            let (msl, ellipsoid) = (topic.field("alt")?, topic.field("alt_ellipsoid"));
            // Receivers have whole numbers of 1e-7 degrees and of millimetres.
            let is_whole = topic.field("fix_type").is_some();
            let (plane_factor, height_factor) = if is_whole { (1e-7, 1e-3) } else { (1.0, 1.0) };
            return Some(Self::Geodetic { plane, plane_factor, msl, ellipsoid, height_factor });
        }
        if let (Some([x, y]), Some(z)) = (both("x", "y"), topic.field("z")) {
            return Some(Self::Local([x, y, z]));
        }
        topic.array_field("position").map(Self::Local)
    }
}

/// The fields of a topic of positions.
#[derive(Debug)]
struct PositionReader {
    time: UlogField,
    place: Place,
    /// Quality of the fix of a receiver.
    fix: Option<UlogField>,
    /// Whether a position is valid.
    valid: Vec<UlogField>,
    /// Counters of jumps of the estimate.
    resets: Vec<UlogField>,
    /// Latitude, longitude (deg) and height of the origin of local positions.
    reference: Option<[UlogField; 3]>,
    /// w, x, y, z.
    quaternion: Option<[UlogField; 4]>,
    uses_ellipsoid: bool,
}

impl PositionReader {
    fn new(topic: &Topic<'_>, spec: &FlightSpec, notes: &mut Vec<Note>) -> Result<Self, String> {
        let place = Place::of(topic).ok_or_else(|| format!("`{}` has no positions", topic.name))?;
        let time = time_field(topic)?;
        let all = |names: &[&str]| names.iter().filter_map(|name| topic.field(name)).collect::<Vec<_>>();
        let reference = match place {
            Place::Local(_) => reference_fields(topic),
            Place::Geodetic { .. } => None,
        };
        let has_ellipsoid = |field: UlogField| {
            topic.messages.iter().any(|(_, message)| {
                let height = field.read(message);
                height.is_finite() && height != 0.0
            })
        };
        let uses_ellipsoid = spec.height == HeightReference::Ellipsoid
            && matches!(place, Place::Geodetic { ellipsoid: Some(field), .. } if has_ellipsoid(field));
        let is_geodetic = reference.is_some() || matches!(place, Place::Geodetic { .. });
        if is_geodetic && !uses_ellipsoid {
            notes.extend(streams::height_note(&format!("heights of `{}`", topic.name), true, spec));
        }
        let quaternion = match place {
            Place::Local(_) if topic.field("position[0]").is_some() => {
                let frame = topic.field("pose_frame").or(topic.field("local_frame"));
                let frames: Vec<f64> = frame
                    .map_or(Vec::new(), |frame| topic.messages.iter().map(|(_, m)| frame.read(m)).collect());
                refuse_foreign_frame(topic, &frames)?;
                topic.array_field("q")
            }
            _ => None,
        };
        let mut valid = all(&["xy_valid", "z_valid", "lat_lon_valid", "alt_valid"]);
        if reference.is_some() {
            valid.extend(all(&["xy_global", "z_global"]));
        }
        Ok(Self {
            time,
            place,
            fix: topic.field("fix_type"),
            valid,
            resets: all(&[
                "xy_reset_counter",
                "z_reset_counter",
                "lat_lon_reset_counter",
                "alt_reset_counter",
                "reset_counter",
            ]),
            reference,
            quaternion,
            uses_ellipsoid,
        })
    }

    fn is_geodetic(&self) -> bool {
        self.reference.is_some() || matches!(self.place, Place::Geodetic { .. })
    }

    /// The positions; those that the log itself calls invalid are left out, with a note.
    fn stream(&self, topic: &Topic<'_>, notes: &mut Vec<Note>) -> Stream {
        let mut rows = Vec::with_capacity(topic.messages.len());
        let mut left_out = 0;
        let mut resets: Vec<usize> = Vec::new();
        let mut counters: Option<Vec<f64>> = None;
        for &(number, message) in &topic.messages {
            let invalid = self.valid.iter().any(|field| field.read(message) == 0.0)
                || self.fix.is_some_and(|fix| fix.read(message) < 3.0);
            if invalid {
                left_out += 1;
                continue;
            }
            let now: Vec<f64> = self.resets.iter().map(|field| field.read(message)).collect();
            if counters.as_ref().is_some_and(|before| *before != now) {
                resets.push(number);
            }
            counters = Some(now);
            let mut row = streams::empty_row(number, time_ns(self.time.read(message)));
            row.position = self.position(message);
            if let Some(q) = self.quaternion {
                row.attitude = xyzw(q.map(|field| field.read(message)));
            }
            rows.push(row);
        }
        let name = full_name(topic);
        if left_out > 0 {
            notes.push(Note {
                is_warning: true,
                text: format!(
                    "{left_out} of {} positions of `{name}` are marked as invalid or without a 3D fix, and \
                        are left out",
                    topic.messages.len()
                ),
            });
        }
        if let Some(first) = resets.first() {
            notes.push(Note {
                is_warning: true,
                text: format!(
                    "the estimator moved the positions of `{name}` at once {} times, first at message \
                        {first}: the flight jumps there",
                    resets.len()
                ),
            });
        }
        Stream { name, rows }
    }

    fn position(&self, message: &[u8]) -> [f64; 3] {
        match self.place {
            Place::Geodetic { plane: [lat, lon], plane_factor, msl, ellipsoid, height_factor } => {
                let height = if self.uses_ellipsoid { ellipsoid.unwrap_or(msl) } else { msl };
                [
                    lat.read(message) * plane_factor,
                    lon.read(message) * plane_factor,
                    height.read(message) * height_factor,
                ]
            }
            Place::Local(fields) => {
                let ned = fields.map(|field| field.read(message));
                match self.reference {
                    Some(reference) => geodetic_from_local(ned, reference.map(|field| field.read(message))),
                    None => ned,
                }
            }
        }
    }
}

/// Fields of the origin of local positions, if the log has a usable one.
fn reference_fields(topic: &Topic<'_>) -> Option<[UlogField; 3]> {
    let fields = [topic.field("ref_lat")?, topic.field("ref_lon")?, topic.field("ref_alt")?];
    let flags: Vec<UlogField> =
        ["xy_global", "z_global"].iter().filter_map(|name| topic.field(name)).collect();
    let is_global = |message: &[u8]| {
        let [lat, lon, alt] = fields.map(|field| field.read(message));
        lat.is_finite()
            && lon.is_finite()
            && alt.is_finite()
            && (lat, lon) != (0.0, 0.0)
            && flags.iter().all(|flag| flag.read(message) != 0.0)
    };
    topic.messages.iter().any(|(_, message)| is_global(message)).then_some(fields)
}

/// Geodetic position, in degrees and metres, from north, east, down about an origin: PX4's azimuthal
/// equidistant projection on a sphere, reversed.
fn geodetic_from_local([north, east, down]: [f64; 3], [lat, lon, height]: [f64; 3]) -> [f64; 3] {
    let (x, y) = (north / EARTH_RADIUS_M, east / EARTH_RADIUS_M);
    let angle = x.hypot(y);
    if angle == 0.0 {
        return [lat, lon, height - down];
    }
    let (sin, cos) = angle.sin_cos();
    let (sin_lat, cos_lat) = lat.to_radians().sin_cos();
    let latitude = (cos * sin_lat + x * sin * cos_lat / angle).asin();
    let longitude = (y * sin).atan2(angle * cos_lat * cos - x * sin_lat * sin);
    [latitude.to_degrees(), lon + longitude.to_degrees(), height - down]
}

/// Refuses odometry in a frame other than north-east-down.
fn refuse_foreign_frame(topic: &Topic<'_>, frames: &[f64]) -> Result<(), String> {
    // 1 is north-east-down in `pose_frame`; 0 is that in the older `local_frame`.
    let ned = if topic.field("pose_frame").is_some() { 1.0 } else { 0.0 };
    if frames.iter().any(|&frame| frame != ned) {
        return Err(format!(
            "`{}` is not in north-east-down (another frame in {}): choose another position by flight.topic",
            topic.name,
            if ned == 1.0 { "pose_frame" } else { "local_frame" }
        ));
    }
    Ok(())
}

fn time_field(topic: &Topic<'_>) -> Result<UlogField, String> {
    let sample = topic
        .field("timestamp_sample")
        .filter(|field| topic.messages.iter().all(|(_, message)| field.read(message) > 0.0));
    sample.or(topic.field("timestamp")).ok_or_else(|| format!("`{}` has no timestamp", topic.name))
}

/// Nanoseconds of a time in microseconds.
fn time_ns(microseconds: f64) -> Option<i128> {
    (microseconds.is_finite() && microseconds > 0.0 && microseconds < 9e15)
        .then(|| (microseconds * 1e3) as i128)
}

fn xyzw([w, x, y, z]: [f64; 4]) -> [f64; 4] {
    [x, y, z, w]
}

/// The attitudes that belong to a topic of positions, or those that `flight.topic` names.
fn attitude_stream(
    file: &UlogFile<'_>,
    position: &Topic<'_>,
    name: Option<&str>,
) -> Result<Option<Stream>, String> {
    let has_attitude = |topic: &&Topic<'_>| topic.array_field::<4>("q").is_some();
    let topic = match name {
        Some(name) => Some(find(file, name).filter(has_attitude).ok_or_else(|| {
            let all: Vec<String> = file
                .topics
                .iter()
                .filter(|topic| !topic.messages.is_empty() && has_attitude(topic))
                .map(full_name)
                .collect();
            format!("flight.topic: `{name}` is no topic with attitudes; there are: {}", listed(&all))
        })?),
        None => {
            // The attitude of the same estimator, else the vehicle's own.
            let (estimator, _) = position.name.split_once('_').unwrap_or(("", ""));
            let suffix = if position.name.ends_with("_groundtruth") { "_groundtruth" } else { "" };
            let own = format!("{estimator}_attitude{suffix}#{}", position.instance);
            find(file, &own).or_else(|| find(file, "vehicle_attitude")).filter(has_attitude)
        }
    };
    let Some(topic) = topic else { return Ok(None) };
    let time = time_field(topic)?;
    let q = topic.array_field::<4>("q").ok_or_else(|| format!("`{}` has no q", topic.name))?;
    let rows: Vec<ParsedRow> = topic
        .messages
        .iter()
        .map(|&(number, message)| ParsedRow {
            attitude: xyzw(q.map(|field| field.read(message))),
            ..streams::empty_row(number, time_ns(time.read(message)))
        })
        .collect();
    Ok(Some(Stream { name: full_name(topic), rows }))
}
