//! The axes that the names of frames state, and poses in camsim's axes by them.
//!
//! Without a word in its name a world has x east, y north, z up (`map`, `odom`), a body x forward, y left, z up
//! (`base_link`), as REP 103 and REP 105 say. Three letters in a name say otherwise, one for each axis:
//! `odom_ned`, `local_origin_ned`, `map_nwu`, `base_link_frd`, `fcu_frd`, `imu_rfu`. An `optical` frame has x
//! right, y down, z forward.

use std::{collections::BTreeMap, sync::Arc};

use camsim_core::flight_log::Note;
use glam::{DMat3, DQuat, DVec3};

use super::messages::{RosKind, Sample};

/// Axes of worlds and bodies without a word about them: east-north-up, forward-left-up.
const USUAL_WORLD: Axes = Axes(*b"rfu");
const USUAL_BODY: Axes = Axes(*b"flu");
const NORTH_EAST_DOWN: Axes = Axes(*b"frd");
const OPTICAL: Axes = Axes(*b"rdf");

/// Words of frames that move with the vehicle, without numbers behind them.
const VEHICLE_WORDS: [&str; 10] =
    ["base", "baselink", "body", "camera", "cam", "imu", "lidar", "gps", "fcu", "optical"];
/// Words of frames that do not, whatever else their names say: `camera_init`, `camera_odom_frame`.
const WORLD_WORDS: [&str; 8] = ["map", "odom", "world", "local", "origin", "init", "earth", "global"];

/// Directions of x, y and z: forward or north, back or south, right or east, left or west, up, down, by the
/// first letter of a body's.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Axes([u8; 3]);

impl Axes {
    /// The axes that a name states; its last word counts.
    fn stated(name: &str) -> Option<Self> {
        let words = words(name);
        let by_letters = words.iter().rev().find_map(|word| Self::of_letters(word));
        let is_optical = || words.iter().any(|word| word == "optical");
        by_letters.or_else(|| is_optical().then_some(OPTICAL))
    }

    /// Three letters of a right-handed world (`ned`) or body (`frd`).
    fn of_letters(word: &str) -> Option<Self> {
        let letters = <[u8; 3]>::try_from(word.as_bytes()).ok()?;
        let is_world = letters.iter().all(|letter| b"nsewud".contains(letter));
        let is_body = letters.iter().all(|letter| b"fbrlud".contains(letter));
        let axes = Self(letters.map(|letter| match letter {
            b'n' => b'f',
            b's' => b'b',
            b'e' => b'r',
            b'w' => b'l',
            other => other,
        }));
        ((is_world || is_body) && (axes.matrix().determinant() - 1.0).abs() < 1e-9).then_some(axes)
    }

    /// Takes vectors in these axes to north-east-down, or forward-right-down.
    fn matrix(self) -> DMat3 {
        let [x, y, z] = self.0.map(|letter| match letter {
            b'f' => DVec3::X,
            b'b' => DVec3::NEG_X,
            b'r' => DVec3::Y,
            b'l' => DVec3::NEG_Y,
            b'd' => DVec3::Z,
            _ => DVec3::NEG_Z,
        });
        DMat3::from_cols(x, y, z)
    }

    fn rotation(self) -> DQuat {
        DQuat::from_mat3(&self.matrix())
    }

    fn inverse(self) -> DQuat {
        DQuat::from_mat3(&self.matrix().transpose())
    }

    /// As `north-east-down`, or `forward-right-down`.
    fn words(self, is_world: bool) -> String {
        let word = |letter: u8| match (letter, is_world) {
            (b'f', true) => "north",
            (b'f', false) => "forward",
            (b'b', true) => "south",
            (b'b', false) => "back",
            (b'r', true) => "east",
            (b'r', false) => "right",
            (b'l', true) => "west",
            (b'l', false) => "left",
            (b'd', _) => "down",
            _ => "up",
        };
        self.0.map(word).join("-")
    }
}

/// The words of a name, in lower case: at marks, and where a small letter meets a capital.
fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut before_is_small = false;
    for letter in name.chars() {
        let begins = !letter.is_ascii_alphanumeric() || before_is_small && letter.is_ascii_uppercase();
        if begins {
            words.push(String::new());
        }
        if let (true, Some(word)) = (letter.is_ascii_alphanumeric(), words.last_mut()) {
            word.push(letter.to_ascii_lowercase());
        }
        before_is_small = letter.is_ascii_lowercase() || letter.is_ascii_digit();
    }
    words.retain(|word| !word.is_empty());
    words
}

/// Whether a frame moves with the vehicle, by its name.
fn is_of_vehicle(name: &str) -> bool {
    let words = words(name);
    let has = |list: &[&str]| {
        words.iter().any(|word| list.contains(&word.trim_end_matches(|c: char| c.is_ascii_digit())))
    };
    has(&VEHICLE_WORDS) && !has(&WORLD_WORDS)
}

/// Whether positions of a frame are geocentric (REP 105: `earth`).
pub(in super::super) fn is_geocentric(name: &str) -> bool {
    name == "earth" || words(name).iter().any(|word| word == "ecef")
}

/// Whether a frame is a grid of a map.
pub(super) fn is_grid(name: &str) -> bool {
    words(name).iter().any(|word| word == "utm" || word == "mgrs")
}

/// The axes of a world that a name states: `north-east-down`.
pub(in super::super) fn world_axes(name: &str) -> Option<String> {
    Axes::stated(name).map(|axes| axes.words(true))
}

/// Whether a name says how its axes point.
pub(in super::super) fn states_axes(name: &str) -> bool {
    Axes::stated(name).is_some()
}

/// The frame of all samples; none if none names one.
///
/// # Errors
/// There are several.
fn single_frame(topic: &str, samples: &[Sample]) -> Result<Arc<str>, String> {
    let mut counts: BTreeMap<&Arc<str>, usize> = BTreeMap::new();
    for sample in samples.iter().filter(|sample| !sample.frame.is_empty()) {
        *counts.entry(&sample.frame).or_default() += 1;
    }
    if counts.len() > 1 {
        let list: Vec<String> =
            counts.iter().map(|(name, count)| format!("`{name}` ({count} messages)")).collect();
        return Err(format!(
            "`{topic}` has poses in several frames, {}: a flight has one; record those of one, or choose \
                another topic by flight.topic",
            list.join(", ")
        ));
    }
    Ok(counts.into_keys().next().cloned().unwrap_or_default())
}

/// Turns samples to north-east-down and forward-right-down, by the names of their frames.
///
/// # Errors
/// The frames are several, or positions in them are no flight.
pub(in super::super) fn turn(
    topic: &str,
    kind: RosKind,
    samples: &mut [Sample],
    notes: &mut Vec<Note>,
) -> Result<(), String> {
    if kind == RosKind::NavSatFix {
        return Ok(());
    }
    let frame = single_frame(topic, samples)?;
    let child = samples.iter().find_map(|sample| sample.child.clone()).unwrap_or_default();
    // The header of an IMU names the sensor, whose axes a word about the world gives, too.
    let (world, body) = if kind == RosKind::Imu {
        (Axes::stated(&frame).filter(|_| states_world(&frame)), frame.clone())
    } else {
        (Axes::stated(&frame), child)
    };
    if kind != RosKind::Imu {
        check_world(topic, &frame, notes)?;
    }
    let stated_body = Axes::stated(&body);
    let mut axes = (world.unwrap_or(USUAL_WORLD), stated_body.unwrap_or(USUAL_BODY));
    let mut inferred = None;
    if is_upside_down(samples, axes) {
        // By custom, names may omit one of the two.
        if world.is_some_and(|world| world != USUAL_WORLD) && stated_body.is_none() {
            axes.1 = NORTH_EAST_DOWN;
            inferred = Some("its body");
        } else if kind == RosKind::Imu && world.is_none() && stated_body == Some(NORTH_EAST_DOWN) {
            axes.0 = NORTH_EAST_DOWN;
            inferred = Some("its world");
        }
        if inferred.is_some() && is_upside_down(samples, axes) {
            axes = (world.unwrap_or(USUAL_WORLD), stated_body.unwrap_or(USUAL_BODY));
            inferred = None;
        }
    }
    let (from_world, to_body) = (axes.0.rotation(), axes.1.inverse());
    for sample in samples.iter_mut() {
        sample.position = sample.position.map(|p| (axes.0.matrix() * DVec3::from_array(p)).to_array());
        sample.rotation = sample.rotation.map(|q| (from_world * DQuat::from_array(q) * to_body).to_array());
    }
    notes.extend(axes_note(topic, kind, [&frame, &body], axes, inferred));
    Ok(())
}

/// Whether the axes that a name states are those of a world: `imu_ned`, but not `imu_frd`.
fn states_world(name: &str) -> bool {
    let is_world = |word: &String| {
        Axes::of_letters(word).is_some() && word.bytes().any(|letter| b"nsew".contains(&letter))
    };
    words(name).iter().any(is_world)
}

/// Warns of a world that is none, and refuses one in which positions are no flight.
fn check_world(topic: &str, frame: &str, notes: &mut Vec<Note>) -> Result<(), String> {
    let mut warn = |text: String| notes.push(Note::warning(text));
    if is_geocentric(frame) {
        return Err(format!(
            "`{topic}` is in the frame `{frame}`, whose positions are geocentric (REP 105): choose a topic of \
                NavSatFix, or of poses in `map` or `odom`, by flight.topic"
        ));
    }
    if is_grid(frame) {
        warn(format!(
            "`{topic}` is in the frame `{frame}`, a grid: its north is taken as true north, which is degrees off \
                far from the grid's middle"
        ));
    }
    if is_of_vehicle(frame) {
        warn(format!(
            "`{topic}` is in the frame `{frame}`, which by its name moves with the vehicle: its poses are read as \
                those in a world at rest; choose another by flight.topic if they are not"
        ));
    }
    Ok(())
}

/// Whether nine bodies in ten have their upper side down.
fn is_upside_down(samples: &[Sample], (world, body): (Axes, Axes)) -> bool {
    let (world, body) = (world.rotation(), body.inverse());
    let rotations = samples.iter().filter_map(|sample| sample.rotation).map(DQuat::from_array);
    let (mut count, mut down) = (0_usize, 0_usize);
    for rotation in rotations {
        count += 1;
        down += usize::from((world * rotation * body * DVec3::Z).z < 0.0);
    }
    count > 0 && down * 10 >= count * 9
}

/// What was made of the names of the frames; a warning where it is not what they say.
fn axes_note(
    topic: &str,
    kind: RosKind,
    [frame, body]: [&str; 2],
    (world_axes, body_axes): (Axes, Axes),
    inferred: Option<&str>,
) -> Option<Note> {
    let (world_words, body_words) = (world_axes.words(true), body_axes.words(false));
    let named = |name: &str| if name.is_empty() { "without a name".to_owned() } else { format!("`{name}`") };
    let names = if kind == RosKind::Imu {
        named(frame)
    } else {
        format!("world {}, body {}", named(frame), named(body))
    };
    if let Some(which) = inferred {
        return Some(Note::warning(format!(
            "`{topic}` ({names}): {which} is read as {}, because the vehicle is upside down otherwise: the \
                    names should say so (`odom_ned`, `base_link_frd`)",
            if which == "its body" { &body_words } else { &world_words }
        )));
    }
    if body_axes == OPTICAL {
        return Some(Note::warning(format!(
            "`{topic}`: the poses are those of the optical frame {} (x right, y down, z forward), turned to \
                    a body that looks along z: camera.mount counts from there",
            named(body)
        )));
    }
    let is_usual = (world_axes, body_axes) == (USUAL_WORLD, USUAL_BODY);
    (!is_usual).then(|| {
        Note::information(format!(
            "`{topic}` ({names}): read as {world_words} and {body_words}, as the names say"
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_state_axes() {
        let stated = |name| Axes::stated(name).map(|axes| axes.words(true));
        for (name, axes) in [
            ("odom_ned", Some("north-east-down")),
            ("local_origin_ned", Some("north-east-down")),
            ("uav1/world_enu", Some("east-north-up")),
            ("OdomNED", Some("north-east-down")),
            ("map_nwu", Some("north-west-up")),
            ("base_link_frd", Some("north-east-down")),
            ("imu_rfu", Some("east-north-up")),
            ("camera_color_optical_frame", Some("east-down-north")),
            ("map", None),
            ("base_link", None),
            // Left-handed, or no axes at all.
            ("map_neu", None),
            ("sun_sensor", None),
            ("end", None),
        ] {
            assert_eq!(stated(name).as_deref(), axes, "{name}");
        }
    }

    #[test]
    fn vehicles_and_worlds_differ_by_their_words() {
        for name in ["base_link", "camera_link", "fcu", "drone1/base_footprint"] {
            assert!(is_of_vehicle(name), "{name}");
        }
        for name in ["map", "odom", "camera_init", "camera_odom_frame", "vicon", "", "world"] {
            assert!(!is_of_vehicle(name), "{name}");
        }
    }
}
