//! PX4 logs (ULog): positions and attitudes of the estimators.
//!
//! | topic | applied |
//! |---|---|
//! | `vehicle_global_position`, `estimator_global_position` | `lat`, `lon` (deg), `alt` (m above mean sea level) or `alt_ellipsoid` |
//! | `vehicle_local_position`, `estimator_local_position` | `x`, `y`, `z` (m north, east, down); with `ref_lat`, `ref_lon`, `ref_alt` they become geodetic by PX4's own projection |
//! | `vehicle_gps_position`, `sensor_gps` | both spellings of latitude, longitude and the two heights; rows without a 3D fix are skipped |
//! | `vehicle_odometry`, `vehicle_visual_odometry` | `position` (m north, east, down) with `q` |
//! | `vehicle_attitude`, `estimator_attitude` | `q`: w, x, y, z; takes forward-right-down to north-east-down |
//!
//! `flight.topic` names others, as `estimator_local_position#1` or `vehicle_gps_position, vehicle_attitude`. Of
//! several instances that of the estimator which flew is taken (`instances`).
//! Times are `timestamp_sample` where a topic has it, else `timestamp`, in microseconds since the start.

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightSpec},
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
mod positions;

use file::{Topic, UlogFile};
use instances::Candidate;
use positions::{PositionFields, PositionReader, full_name, time_field, time_ns, xyzw};

/// Topics with positions, the best first.
const POSITIONS: [&str; 7] = [
    "vehicle_global_position",
    "vehicle_local_position",
    "vehicle_odometry",
    "estimator_global_position",
    "estimator_local_position",
    "vehicle_gps_position",
    "sensor_gps",
];

/// Reads a ULog file.
///
/// # Errors
/// The file is no ULog, or has no positions, or not those that `flight.topic` names.
pub(super) fn read(bytes: &[u8], spec: &FlightSpec) -> Result<RawLog, String> {
    let file = UlogFile::parse(bytes)?;
    let mut notes: Vec<Note> = file.damage.iter().map(Note::warning).collect();
    notes.extend(unused_height_note(spec));
    let (position_name, attitude_name) = streams::named_topics(spec);
    let (topic, reader, position) = positions(&file, position_name, spec, &mut notes)?;
    let attitude = if spec.attitude == AttitudeSource::Track || reader.quaternion.is_some() {
        None
    } else {
        attitude_stream(&file, &topic, attitude_name, &mut notes)?
    };
    let kind = match (&attitude, reader.quaternion) {
        (None, None) => AttitudeKind::None,
        _ => AttitudeKind::Quaternion,
    };
    let frame = if reader.is_geodetic() { Frame::Geodetic } else { Frame::NorthEastDown };
    Streams { frame, kind, position, attitude, notes }.into_log(spec)
}

/// The positions to fly: of the topic that `flight.topic` names, else of the first with valid ones.
fn positions<'a>(
    file: &UlogFile<'a>,
    name: Option<&str>,
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) -> Result<(Topic<'a>, PositionReader, Stream), String> {
    let usable = |topic: &&Topic<'_>| !topic.messages.is_empty() && PositionFields::of(topic).is_some();
    let all: Vec<String> = file.topics.iter().filter(usable).map(full_name).collect();
    let mut candidates: Vec<Candidate<'a>> = match name {
        Some(name) => instances::candidates(file, name),
        None => POSITIONS.iter().flat_map(|name| instances::candidates(file, name)).collect(),
    };
    candidates.retain(|candidate| usable(&&candidate.topic));
    for Candidate { topic, note } in &candidates {
        let mut its_notes: Vec<Note> = note.clone().into_iter().collect();
        let reader = PositionReader::new(topic, spec, &mut its_notes)?;
        let stream = reader.stream(topic, &mut its_notes);
        if stream.rows.iter().any(ParsedRow::has_position) {
            notes.extend(its_notes);
            return Ok((topic.clone(), reader, stream));
        }
        notes.push(Note::warning(format!("`{}` has no valid position", full_name(topic))));
    }
    Err(match (name, candidates.is_empty(), all.is_empty()) {
        (Some(name), true, _) => {
            format!("flight.topic: `{name}` is no topic with positions; there are: {}", listed(&all))
        }
        (_, false, _) => {
            let tried: Vec<String> = candidates.iter().map(|one| full_name(&one.topic)).collect();
            let others: Vec<String> = all.into_iter().filter(|name| !tried.contains(name)).collect();
            format!(
                "no position is valid in {}: the estimator had none, fly with GNSS or motion capture{}",
                listed(&tried),
                if others.is_empty() {
                    String::new()
                } else {
                    format!(", or set flight.topic to one of: {}", listed(&others))
                }
            )
        }
        (None, true, true) => {
            "the PX4 log has no positions (vehicle_global_position, vehicle_local_position, \
            vehicle_gps_position): log them by SDLOG_PROFILE"
                .to_owned()
        }
        (None, true, false) => format!("flight.topic must name the positions to fly: {}", listed(&all)),
    })
}

/// The attitudes that belong to a topic of positions, or those that `flight.topic` names.
fn attitude_stream(
    file: &UlogFile<'_>,
    position: &Topic<'_>,
    name: Option<&str>,
    notes: &mut Vec<Note>,
) -> Result<Option<Stream>, String> {
    let has_attitude = |topic: &&Topic<'_>| topic.array_field::<4>("q").is_some();
    let find =
        |name: &str| instances::candidates(file, name).into_iter().find(|one| has_attitude(&&one.topic));
    let candidate = match name {
        Some(name) => Some(find(name).ok_or_else(|| {
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
            let mut own = format!("{estimator}_attitude{suffix}");
            if !position.is_merged {
                own += &format!("#{}", position.instance);
            }
            find(&own).or_else(|| find("vehicle_attitude"))
        }
    };
    let Some(Candidate { topic, note }) = candidate else { return Ok(None) };
    notes.extend(note);
    let time = time_field(&topic)?;
    let q = topic.array_field::<4>("q").ok_or_else(|| format!("`{}` has no q", topic.name))?;
    let rows: Vec<ParsedRow> = topic
        .messages
        .iter()
        .map(|&(number, message)| ParsedRow {
            attitude: xyzw(q.map(|field| field.read(message))),
            ..streams::empty_row(number, time_ns(time.read(message)))
        })
        .collect();
    Ok(Some(Stream { name: full_name(&topic), rows }))
}
