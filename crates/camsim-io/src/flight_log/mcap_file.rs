//! ROS poses in MCAP files, as rosbag2 records them.
//!
//! | message | applied |
//! |---|---|
//! | `geometry_msgs/PoseStamped`, `PoseWithCovarianceStamped`, `TransformStamped` | position and orientation |
//! | `nav_msgs/Odometry` | the pose |
//! | `tf2_msgs/TFMessage` | the transforms to one child frame, as `/tf#base_link` |
//! | `sensor_msgs/NavSatFix` | latitude, longitude, height above the ellipsoid; rows without a fix are skipped |
//! | `sensor_msgs/Imu` | the orientation, beside a `NavSatFix` |
//!
//! Axes are those of ROS (REP 103): worlds have x east, y north, z up, bodies x forward, y left, z up, unless
//! the names of their frames say otherwise (`frames`). Transforms are composed to the root of their tree
//! (`tree`). A topic of positions is chosen by `flight.topic`, unless only one fits. Times are the stamps of the
//! headers, or the recorder's where those are 0. CDR and ROS 1 messages are read, whole or in chunks (zstd,
//! lz4).

use std::collections::BTreeMap;

use camsim_core::{
    flight_log::Note,
    scenario::{AttitudeSource, FlightSpec, HeightReference},
};

use super::{
    RawLog,
    columns::{AttitudeKind, Frame},
    streams::{self, Stream, Streams},
    unused_keys::unused_height_note,
};

mod cdr;
pub(super) mod frames;
pub(super) mod messages;
mod records;
mod tree;

use messages::{RosKind, Sample};
use records::{TopicKey, Topics};
use tree::Tree;

/// Reads the poses of an MCAP file.
///
/// # Errors
/// The file is no MCAP file, or no topic or several fit.
pub(super) fn read(bytes: &[u8], spec: &FlightSpec) -> Result<RawLog, String> {
    let mut topics = records::read(bytes)?;
    let (position_name, attitude_name) = streams::named_topics(spec);
    let (key, kind) = choose(&topics, position_name, &|kind| kind.has_position(), "positions")
        .map_err(|text| [&[text][..], &topics.damage].concat().join("; "))?;
    let mut notes: Vec<Note> = topics.damage.drain(..).map(Note::warning).collect();
    notes.extend(unused_height_note(spec));
    let samples = turned(&topics, &key, kind, &mut notes)?;
    let is_geodetic = kind == RosKind::NavSatFix;
    let imu = if !is_geodetic && attitude_name.is_none() || spec.attitude == AttitudeSource::Track {
        None
    } else {
        choose_imu(&topics, attitude_name)?
    };
    if is_geodetic {
        notes.extend(streams::height_note("heights of NavSatFix", HeightReference::Ellipsoid, spec));
    }
    let position = stream(&key, &samples, imu.is_none(), &mut notes);
    let attitude = match imu {
        None => None,
        // One topic may be named for both.
        Some(other) if other == key => Some(stream(&key, &samples, true, &mut notes)),
        Some(other) => {
            let kind = topics.kinds.get(&other).copied().unwrap_or(RosKind::Imu);
            let samples = turned(&topics, &other, kind, &mut notes)?;
            Some(stream(&other, &samples, true, &mut notes))
        }
    };
    let has_attitude = attitude.is_some() || position.rows.iter().any(|row| row.has_attitude());
    let kind = if has_attitude { AttitudeKind::Quaternion } else { AttitudeKind::None };
    let frame = if is_geodetic { Frame::Geodetic } else { Frame::NorthEastDown };
    Streams { frame, kind, position, attitude, notes }.into_log(spec)
}

/// The samples of a topic, in the root of their transforms and in camsim's axes.
fn turned(
    topics: &Topics,
    key: &TopicKey,
    kind: RosKind,
    notes: &mut Vec<Note>,
) -> Result<Vec<Sample>, String> {
    let name = key.to_string();
    let mut samples = topics.samples.get(key).cloned().unwrap_or_default();
    let tree = Tree::new(topics, &key.topic);
    let Some(first) = samples.first() else { return Ok(samples) };
    let (frame, child) = (first.frame.clone(), first.child.clone());
    match kind {
        RosKind::Transforms => tree.compose(&name, &mut samples, notes)?,
        // Their headers name the sensor.
        RosKind::NavSatFix | RosKind::Imu => notes.extend(tree.mount_note(&name, &frame)),
        _ => {
            notes.extend(tree.unused_parent_note(&name, &frame, topics));
            notes.extend(child.and_then(|child| tree.mount_note(&name, &child)));
        }
    }
    frames::turn(&name, kind, &mut samples, notes)?;
    Ok(samples)
}

/// The topic of a name that fits, or the only one that does.
fn choose(
    topics: &Topics,
    name: Option<&str>,
    fits: &dyn Fn(RosKind) -> bool,
    what: &str,
) -> Result<(TopicKey, RosKind), String> {
    let fitting: BTreeMap<&TopicKey, RosKind> =
        topics.kinds.iter().filter(|(_, kind)| fits(**kind)).map(|(key, kind)| (key, *kind)).collect();
    let list = || {
        let names: Vec<String> =
            fitting.iter().map(|(key, kind)| format!("{key} ({})", kind.name())).collect();
        names.join(", ")
    };
    if let Some(name) = name {
        let named: Vec<_> =
            fitting.iter().filter(|(key, _)| key.to_string() == name || key.topic == name).collect();
        return match named[..] {
            [(key, kind)] => Ok(((*key).clone(), *kind)),
            [] if fitting.is_empty() => {
                Err(format!("flight.topic: `{name}` has no {what}, nor has any other topic"))
            }
            [] => Err(format!("flight.topic: `{name}` is no topic with {what}; there are: {}", list())),
            _ => Err(format!("flight.topic: `{name}` is of several frames; name one of: {}", list())),
        };
    }
    // A pose counts more than the transforms that repeat it.
    let is_pose = |kind: &RosKind| *kind != RosKind::Transforms;
    let poses: Vec<_> = fitting.iter().filter(|(_, kind)| is_pose(kind)).collect();
    match (&poses[..], fitting.len()) {
        ([(key, kind)], _) => Ok(((**key).clone(), **kind)),
        (_, 0) => {
            let all: Vec<String> =
                topics.others.iter().map(|(topic, kind)| format!("{topic} ({kind})")).collect();
            Err(format!(
                "the MCAP file has no {what} (PoseStamped, PoseWithCovarianceStamped, Odometry, NavSatFix, \
                    TFMessage){}",
                if all.is_empty() { String::new() } else { format!("; it has: {}", all.join(", ")) }
            ))
        }
        ([], 1) => fitting.into_iter().next().map(|(key, kind)| (key.clone(), kind)).ok_or_else(String::new),
        _ => Err(format!("several topics have {what}: set flight.topic to one of: {}", list())),
    }
}

/// The topic of orientations beside positions without any: the named one, or the only one.
fn choose_imu(topics: &Topics, name: Option<&str>) -> Result<Option<TopicKey>, String> {
    let has_orientation =
        |key: &TopicKey| topics.samples.get(key).is_some_and(|all| all.iter().any(|s| s.rotation.is_some()));
    let fitting = |kind: RosKind| kind == RosKind::Imu;
    if name.is_some() {
        return choose(topics, name, &|kind| kind != RosKind::NavSatFix, "orientations")
            .map(|(key, _)| Some(key));
    }
    let all: Vec<&TopicKey> = topics
        .kinds
        .iter()
        .filter(|(key, kind)| fitting(**kind) && has_orientation(key))
        .map(|(key, _)| key)
        .collect();
    match all[..] {
        [] => Ok(None),
        [only] => Ok(Some(only.clone())),
        _ => {
            let names: Vec<String> = all.iter().map(ToString::to_string).collect();
            Err(format!(
                "several topics have orientations: name one behind a comma in flight.topic, of: {}",
                names.join(", ")
            ))
        }
    }
}

/// The samples as rows.
fn stream(key: &TopicKey, samples: &[Sample], with_attitude: bool, notes: &mut Vec<Note>) -> Stream {
    let name = key.to_string();
    let (mut rows, mut without_fix, mut without_stamp) = (Vec::with_capacity(samples.len()), 0, 0);
    for sample in samples {
        if !sample.is_valid {
            without_fix += 1;
            continue;
        }
        without_stamp += usize::from(sample.stamp_ns == 0);
        let mut row = streams::empty_row(sample.number, Some(sample.time_ns()));
        row.position = sample.position.unwrap_or([f64::NAN; 3]);
        if let Some(rotation) = sample.rotation.filter(|_| with_attitude) {
            row.attitude = rotation;
        }
        rows.push(row);
    }
    if without_fix > 0 {
        let text = format!("{without_fix} messages of `{name}` have no fix, and are skipped");
        notes.push(Note::warning(text));
    }
    if without_stamp > 0 {
        let text = format!(
            "{without_stamp} headers of `{name}` have no stamp: their times are those of the recording, which \
                are later and uneven"
        );
        notes.push(Note::warning(text));
    }
    Stream { name, rows }
}
