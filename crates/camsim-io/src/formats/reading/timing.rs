//! Frame rate and shutter times under the names of all formats.

use camsim_core::scenario::{CameraSpec, Readout};
use serde_json::Value;

use super::key_table::{KeyRow, Leaf, TableLeaves, Treatment, row_of};
use crate::text::document::{KeyProblem, as_flag, as_number};
use crate::text::numbers::shortest;
use crate::unlikely_camera::LONGEST_READOUT_MS;

/// Shortest plausible readout where the unit is not stated, milliseconds.
const MIN_READOUT_MS: f64 = 0.5;

/// Kind of a timing key.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TimingKey {
    /// Readout time; the unit in milliseconds, if stated.
    Readout(Option<f64>),
    /// Line delay; the unit in milliseconds, if stated.
    LineDelay(Option<f64>),
    /// Frames per second.
    FrameRate,
    /// Whether the shutter is rolling.
    RollingShutter,
    /// Whether the shutter is global.
    GlobalShutter,
    /// "rolling" or "global".
    ShutterType,
    /// Direction of the readout.
    Direction,
}

/// Timing values of a file, with their paths.
#[derive(Default)]
struct Timings {
    readout_ms: Option<(String, f64)>,
    fps: Option<(String, f64)>,
    is_rolling: Option<(String, bool)>,
    direction: Option<Readout>,
    /// Whether the file has an invalid frame rate.
    has_invalid_rate: bool,
}

/// Sets frame rate and shutter, and returns the paths of the applied keys. Notes state what is missing.
// Long because: each value leads to its own note.
pub(crate) fn apply(
    parts: &[TableLeaves<'_>],
    spec: &mut CameraSpec,
    notes: &mut Vec<String>,
) -> Result<Vec<String>, KeyProblem> {
    let rows = f64::from(spec.size_px[1]);
    let (mut timings, mut applied, mut is_reported) = (Timings::default(), Vec::new(), false);
    for (keys, leaf) in parts.iter().flat_map(|part| part.leaves.iter().map(|leaf| (part.keys, leaf))) {
        let Some(kind) = timing_key(keys, leaf) else {
            is_reported |= mentions_timing(leaf.name()) && will_be_reported(keys, leaf);
            continue;
        };
        if leaf.value.is_null() {
            continue;
        }
        read_leaf(leaf, kind, rows, &mut timings, notes)?;
        applied.push(leaf.path.clone());
    }
    if let Some((_, fps)) = &timings.fps {
        spec.fps = *fps;
    }
    if let Some((path, ms)) = &timings.readout_ms {
        match &timings.is_rolling {
            Some((global_path, false)) if *ms != 0.0 => {
                notes.push(format!(
                    "not applied: {path} ({} ms), because {global_path} states a global shutter",
                    ms.abs()
                ));
            }
            _ => spec.shutter.readout_ms = ms.abs(),
        }
        spec.shutter.readout = reversed_if(timings.direction.unwrap_or_default(), *ms < 0.0);
        if *ms < 0.0 {
            notes.push(format!(
                "{path} is negative: the readout direction is reversed to {:?}",
                spec.shutter.readout
            ));
        }
    }
    if let Some((path, true)) = &timings.is_rolling
        && spec.shutter.readout_ms == 0.0
    {
        notes.push(format!(
            "{path} states a rolling shutter, but there is no readout time: the shutter is global until you \
             set shutter.readout_ms"
        ));
    }
    let period_ms = 1e3 / spec.fps;
    if timings.fps.is_some() && spec.shutter.readout_ms > 1.001 * period_ms {
        notes.push(format!(
            "the readout of {} ms is longer than the frame period of {period_ms:.3} ms",
            spec.shutter.readout_ms
        ));
        spec.shutter.allow_overlap = true;
    }
    let lacks_shutter = timings.readout_ms.is_none() && timings.is_rolling.is_none() && !is_reported;
    match (timings.fps.is_none() && !timings.has_invalid_rate && !is_reported, lacks_shutter) {
        (true, true) => notes.push(
            "the file has no frame rate and no shutter times: fps is 30, the shutter global".to_owned(),
        ),
        (true, false) => notes.push("the file has no frame rate: fps is 30".to_owned()),
        (false, true) => notes.push("the file has no shutter times: the shutter is global".to_owned()),
        (false, false) => {}
    }
    Ok(applied)
}

/// Reads one timing value.
// Long because: one match over the kinds of keys.
fn read_leaf(
    leaf: &Leaf<'_>,
    kind: TimingKey,
    rows: f64,
    timings: &mut Timings,
    notes: &mut Vec<String>,
) -> Result<(), KeyProblem> {
    let number = || {
        as_number(leaf.value)
            .ok_or_else(|| KeyProblem::new(&leaf.path, format!("is {}, not a finite number", leaf.value)))
    };
    let flag = || {
        as_flag(leaf.value).ok_or_else(|| {
            KeyProblem::new(&leaf.path, format!("is {}, neither yes (1, true) nor no (0, false)", leaf.value))
        })
    };
    match kind {
        TimingKey::Readout(unit) => {
            let ms = readout_ms(leaf, number()?, unit, notes)?;
            set_number(&mut timings.readout_ms, leaf, ms, "ms of readout")
        }
        TimingKey::LineDelay(unit) => {
            let ms = readout_ms(leaf, number()? * rows, unit, notes)?;
            let ms = shortest(ms, 4.0 * f64::EPSILON * ms.abs());
            if ms != 0.0 {
                notes.push(format!("{} x {rows} rows is a readout of {ms} ms", leaf.path));
            }
            set_number(&mut timings.readout_ms, leaf, ms, "ms of readout")
        }
        TimingKey::FrameRate => match number()? {
            fps if fps > 0.0 => set_number(&mut timings.fps, leaf, fps, "frames per second"),
            fps => {
                notes.push(format!(
                    "not applied: {} = {fps}, which is not a frame rate; fps is 30",
                    leaf.path
                ));
                timings.has_invalid_rate = true;
                Ok(())
            }
        },
        TimingKey::RollingShutter => set_rolling(leaf, flag(), timings),
        TimingKey::GlobalShutter => set_rolling(leaf, flag().map(|global| !global), timings),
        TimingKey::ShutterType => {
            match leaf.value.as_str().map(str::to_ascii_lowercase).unwrap_or_default() {
                word if word.contains("rolling") => set_rolling(leaf, Ok(true), timings),
                word if word.contains("global") => set_rolling(leaf, Ok(false), timings),
                word => Err(KeyProblem::new(
                    &leaf.path,
                    format!("is `{word}`, neither rolling nor global; delete it if it is something else"),
                )),
            }
        }
        TimingKey::Direction => {
            let word: String =
                leaf.value.as_str().unwrap_or_default().chars().filter(char::is_ascii_alphabetic).collect();
            timings.direction = Some(match word.to_ascii_lowercase().as_str() {
                "toptobottom" => Readout::TopToBottom,
                "bottomtotop" => Readout::BottomToTop,
                "lefttoright" => Readout::LeftToRight,
                "righttoleft" => Readout::RightToLeft,
                _ => {
                    return Err(KeyProblem::new(
                        &leaf.path,
                        format!(
                            "is {}, which is not a direction (TopToBottom, BottomToTop, LeftToRight, \
                             RightToLeft)",
                            leaf.value
                        ),
                    ));
                }
            });
            Ok(())
        }
    }
}

/// Stores whether the shutter is rolling; contradictions are refused.
fn set_rolling(
    leaf: &Leaf<'_>,
    is_rolling: Result<bool, KeyProblem>,
    timings: &mut Timings,
) -> Result<(), KeyProblem> {
    let is_rolling = is_rolling?;
    match &timings.is_rolling {
        Some((other, before)) if *before != is_rolling => {
            Err(KeyProblem::new(&leaf.path, format!("contradicts {other} on the shutter: delete one")))
        }
        _ => {
            timings.is_rolling = Some((leaf.path.clone(), is_rolling));
            Ok(())
        }
    }
}

/// Stores a number; a second, different one is refused.
fn set_number(
    slot: &mut Option<(String, f64)>,
    leaf: &Leaf<'_>,
    number: f64,
    unit: &str,
) -> Result<(), KeyProblem> {
    match slot {
        Some((other, before)) if (*before - number).abs() > 5e-3 * before.abs() => Err(KeyProblem::new(
            &leaf.path,
            format!("is {number} {unit}, but {other} is {before}: delete the wrong one"),
        )),
        _ => {
            slot.get_or_insert((leaf.path.clone(), number));
            Ok(())
        }
    }
}

/// A readout in milliseconds. Without a stated unit, the only one in which the readout is plausible.
fn readout_ms(
    leaf: &Leaf<'_>,
    readout: f64,
    unit: Option<f64>,
    notes: &mut Vec<String>,
) -> Result<f64, KeyProblem> {
    if readout == 0.0 {
        return Ok(0.0);
    }
    if let Some(unit) = unit {
        let ms = readout * unit;
        return if ms.abs() <= 1e3 {
            Ok(ms)
        } else {
            Err(KeyProblem::new(
                &leaf.path,
                format!(
                    "is {}: a readout of {:.3} s, which is implausible; check its unit",
                    leaf.value,
                    ms * 1e-3
                ),
            ))
        };
    }
    let units = [("s", 1e3), ("ms", 1.0), ("us", 1e-3), ("ns", 1e-6)];
    let plausible =
        units.iter().find(|(_, unit)| (MIN_READOUT_MS..=LONGEST_READOUT_MS).contains(&(readout * unit)));
    let (name, unit) = plausible.ok_or_else(|| {
        let text = format!(
            "is {} without a unit, and in none of s, ms, us, ns a readout of {MIN_READOUT_MS} to \
             {LONGEST_READOUT_MS} ms: rename it to readout_ms or line_delay_ns",
            leaf.value
        );
        KeyProblem::new(&leaf.path, text)
    })?;
    notes.push(format!(
        "{} is read in {name}, the only unit with a readout of {MIN_READOUT_MS} to {LONGEST_READOUT_MS} ms",
        leaf.path
    ));
    Ok(readout * unit)
}

/// The direction, reversed if `is_reversed`.
fn reversed_if(direction: Readout, is_reversed: bool) -> Readout {
    match (direction, is_reversed) {
        (same, false) => same,
        (Readout::TopToBottom, true) => Readout::BottomToTop,
        (Readout::BottomToTop, true) => Readout::TopToBottom,
        (Readout::LeftToRight, true) => Readout::RightToLeft,
        (Readout::RightToLeft, true) => Readout::LeftToRight,
        (Readout::MiddleOutward, true) => Readout::EdgesInward,
        (Readout::EdgesInward, true) => Readout::MiddleOutward,
    }
}

/// Whether a note will report a leaf.
fn will_be_reported(keys: &'static [KeyRow], leaf: &Leaf<'_>) -> bool {
    match row_of(keys, leaf).map(|key| key.treatment) {
        None => true,
        Some(Treatment::Reported(neutral)) => !neutral.matches(leaf.value),
        Some(_) => false,
    }
}

/// Kind of a leaf by the format's table, else by name.
fn timing_key(keys: &'static [KeyRow], leaf: &Leaf<'_>) -> Option<TimingKey> {
    match row_of(keys, leaf).map(|key| key.treatment) {
        Some(Treatment::Readout(unit)) => Some(TimingKey::Readout(Some(unit))),
        Some(Treatment::LineDelay(unit)) => Some(TimingKey::LineDelay(Some(unit))),
        Some(Treatment::FrameRate) => Some(TimingKey::FrameRate),
        Some(Treatment::RollingShutter) => Some(TimingKey::RollingShutter),
        Some(_) => None,
        None => by_name(&leaf.path).filter(|kind| match leaf.value {
            Value::Array(_) | Value::Object(_) => false,
            Value::String(_) => true,
            _ => !matches!(kind, TimingKey::ShutterType | TimingKey::Direction),
        }),
    }
}

/// Letters and digits in lower case.
fn normalized(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect()
}

/// Whether a name mentions a timing quantity.
fn mentions_timing(name: &str) -> bool {
    let name = normalized(name);
    [
        "shutter",
        "readout",
        "linedelay",
        "rowdelay",
        "linetime",
        "rowtime",
        "exposure",
        "fps",
        "framerate",
        "framehz",
    ]
    .iter()
    .any(|word| name.contains(word))
}

/// Kind of a key by its path; `None` for other keys.
// Long because: one list of spellings.
pub(crate) fn by_name(path: &str) -> Option<TimingKey> {
    let path =
        path.split('[').map(|part| part.split_once(']').map_or(part, |(_, rest)| rest)).collect::<String>();
    // Rates and times of other sensors.
    if ["imu", "gyro", "gps", "lidar", "publish"]
        .iter()
        .any(|other| path.to_ascii_lowercase().contains(other))
    {
        return None;
    }
    let mut names = path.rsplit('.').map(normalized);
    let name = names.next()?;
    let kind_of = |name: &str| {
        for word in [
            "linedelay",
            "rowdelay",
            "linetime",
            "rowtime",
            "lineperiod",
            "rowperiod",
            "linereadout",
            "rowreadout",
        ] {
            if let Some((_, rest)) = name.split_once(word) {
                return unit_ms(rest).map(TimingKey::LineDelay);
            }
        }
        if name.contains("readoutdirection") || name.contains("shutterdirection") {
            return Some(TimingKey::Direction);
        }
        if let Some((_, rest)) = name.split_once("readout") {
            return unit_ms(rest).map(TimingKey::Readout);
        }
        if let Some((_, rest)) = name.split_once("rollingshutter") {
            return match rest {
                "" | "enabled" | "enable" | "flag" | "camera" | "on" => Some(TimingKey::RollingShutter),
                "tr" => Some(TimingKey::Readout(Some(1e3))),
                rest => unit_ms(rest.trim_start_matches("skew")).map(TimingKey::Readout),
            };
        }
        match name {
            _ if name.ends_with("globalshutter") => Some(TimingKey::GlobalShutter),
            _ if name.ends_with("shutter")
                || name.ends_with("shuttertype")
                || name.ends_with("shuttermode") =>
            {
                Some(TimingKey::ShutterType)
            }
            "fps" | "framerate" | "ratehz" | "framespersecond" | "camerafps" | "camfps" | "camerarate"
            | "camrate" | "imagerate" | "cameraframerate" | "frameratehz" | "cameraratehz"
            | "imageratehz" => Some(TimingKey::FrameRate),
            _ => None,
        }
    };
    // `rolling_shutter: {readout_time: ...}`, `shutter: {type: rolling}`.
    kind_of(&name).or_else(|| kind_of(&format!("{}{name}", names.next()?)))
}

/// The unit that follows a word, in milliseconds: `Some(None)` if it is not stated, `None` if another word
/// follows.
fn unit_ms(rest: &str) -> Option<Option<f64>> {
    let rest = rest.strip_prefix("time").or_else(|| rest.strip_prefix("duration")).unwrap_or(rest);
    let rest = rest.strip_prefix("in").filter(|unit| !unit.is_empty()).unwrap_or(rest);
    Some(match rest {
        "" => None,
        "s" | "sec" | "secs" | "second" | "seconds" => Some(1e3),
        "ms" | "msec" | "msecs" | "millis" | "millisecond" | "milliseconds" => Some(1.0),
        "us" | "usec" | "usecs" | "micros" | "microsecond" | "microseconds" => Some(1e-3),
        "ns" | "nsec" | "nsecs" | "nanos" | "nanosecond" | "nanoseconds" => Some(1e-6),
        _ => return None,
    })
}
