//! Frame rate and shutter times, under whatever name a file has them.

use camsim_core::scenario::Readout;
use serde_json::Value;

use super::ImportedCamera;
use super::document::{Problem, as_flag, as_number};
use super::keys::{Key, Leaf, Part, Use, known};

/// Longest readout that is believed: sensors take 1 to 190 ms for a frame.
const LONGEST_MS: f64 = 250.0;
/// Shortest, when the unit has to be told from the number.
const SHORTEST_MS: f64 = 0.5;

/// What a key is by its name.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Time {
    /// Milliseconds a unit, where the name or the format says it.
    Readout(Option<f64>),
    LineDelay(Option<f64>),
    Rate,
    Rolling,
    Global,
    Kind,
    Direction,
}

/// What was found of each.
#[derive(Default)]
struct Found {
    readout_ms: Option<(String, f64)>,
    fps: Option<(String, f64)>,
    rolling: Option<(String, bool)>,
    direction: Option<Readout>,
    /// A frame rate that is none.
    no_rate: bool,
}

/// Sets frame rate and shutter; gives the paths of the keys that it used. A note says what was looked for and
/// not found.
pub(super) fn apply(parts: &[Part<'_>], imported: &mut ImportedCamera) -> Result<Vec<String>, Problem> {
    let rows = f64::from(imported.spec.size_px[1]);
    let (mut found, mut done, mut spoken_of) = (Found::default(), Vec::new(), false);
    for (keys, leaf) in parts.iter().flat_map(|part| part.leaves.iter().map(|leaf| (part.keys, leaf))) {
        let Some(time) = time_of(keys, leaf) else {
            spoken_of |= may_be_a_time(leaf.name()) && is_named(keys, leaf);
            continue;
        };
        if leaf.value.is_null() {
            continue;
        }
        take(leaf, time, rows, &mut found, &mut imported.notes)?;
        done.push(leaf.path.clone());
    }
    let spec = &mut imported.spec;
    if let Some((_, fps)) = &found.fps {
        spec.fps = *fps;
    }
    if let Some((path, ms)) = &found.readout_ms {
        match &found.rolling {
            Some((why, false)) if *ms != 0.0 => {
                imported.notes.push(format!(
                    "left out: {path} ({} ms), as {why} says that the shutter is global",
                    ms.abs()
                ));
            }
            _ => spec.shutter.readout_ms = ms.abs(),
        }
        spec.shutter.readout = turned(found.direction.unwrap_or_default(), *ms < 0.0);
        if *ms < 0.0 {
            imported.notes.push(format!(
                "{path} is negative: rows are read the other way round, {:?}",
                spec.shutter.readout
            ));
        }
    }
    if let Some((path, true)) = &found.rolling
        && spec.shutter.readout_ms == 0.0
    {
        imported.notes.push(format!(
            "{path} says that the shutter is rolling, but no readout time is given: the shutter is global until you set shutter.readout_ms"
        ));
    }
    let period_ms = 1e3 / spec.fps;
    if found.fps.is_some() && spec.shutter.readout_ms > 1.001 * period_ms {
        imported.notes.push(format!(
            "the readout of {} ms is longer than the frame period of {period_ms:.3} ms",
            spec.shutter.readout_ms
        ));
    }
    let no_shutter = found.readout_ms.is_none() && found.rolling.is_none() && !spoken_of;
    match (found.fps.is_none() && !found.no_rate && !spoken_of, no_shutter) {
        (true, true) => imported.notes.push(
            "no frame rate and no shutter times are in the file: fps is 30, the shutter global".to_owned(),
        ),
        (true, false) => imported.notes.push("no frame rate is in the file: fps is 30".to_owned()),
        (false, true) => {
            imported.notes.push("no shutter times are in the file: the shutter is global".to_owned())
        }
        (false, false) => {}
    }
    Ok(done)
}

fn take(
    leaf: &Leaf<'_>,
    time: Time,
    rows: f64,
    found: &mut Found,
    notes: &mut Vec<String>,
) -> Result<(), Problem> {
    let number = || {
        as_number(leaf.value)
            .ok_or_else(|| Problem::new(&leaf.path, format!("is {}, not a finite number", leaf.value)))
    };
    let yes = || {
        as_flag(leaf.value).ok_or_else(|| {
            Problem::new(&leaf.path, format!("is {}, neither yes (1, true) nor no (0, false)", leaf.value))
        })
    };
    match time {
        Time::Readout(unit) => {
            let ms = in_ms(leaf, number()?, unit, notes)?;
            once(&mut found.readout_ms, leaf, ms, "ms of readout")
        }
        Time::LineDelay(unit) => {
            let ms = in_ms(leaf, number()? * rows, unit, notes)?;
            if ms != 0.0 {
                notes.push(format!("{} x {rows} rows is a readout of {ms} ms", leaf.path));
            }
            once(&mut found.readout_ms, leaf, ms, "ms of readout")
        }
        Time::Rate => match number()? {
            fps if fps > 0.0 => once(&mut found.fps, leaf, fps, "frames a second"),
            fps => {
                notes.push(format!("left out: {} = {fps}, which is no frame rate; fps is 30", leaf.path));
                found.no_rate = true;
                Ok(())
            }
        },
        Time::Rolling => yes_at(leaf, yes(), found),
        Time::Global => yes_at(leaf, yes().map(|global| !global), found),
        Time::Kind => match leaf.value.as_str().map(str::to_ascii_lowercase).unwrap_or_default() {
            word if word.contains("rolling") => yes_at(leaf, Ok(true), found),
            word if word.contains("global") => yes_at(leaf, Ok(false), found),
            word => Err(Problem::new(
                &leaf.path,
                format!("is `{word}`: rolling or global is meant; delete it if it is something else"),
            )),
        },
        Time::Direction => {
            let word: String =
                leaf.value.as_str().unwrap_or_default().chars().filter(char::is_ascii_alphabetic).collect();
            found.direction = Some(match word.to_ascii_lowercase().as_str() {
                "toptobottom" => Readout::TopToBottom,
                "bottomtotop" => Readout::BottomToTop,
                "lefttoright" => Readout::LeftToRight,
                "righttoleft" => Readout::RightToLeft,
                _ => {
                    return Err(Problem::new(
                        &leaf.path,
                        format!(
                            "is {}, which is no direction (TopToBottom, BottomToTop, LeftToRight, RightToLeft)",
                            leaf.value
                        ),
                    ));
                }
            });
            Ok(())
        }
    }
}

fn yes_at(leaf: &Leaf<'_>, rolling: Result<bool, Problem>, found: &mut Found) -> Result<(), Problem> {
    let rolling = rolling?;
    match &found.rolling {
        Some((other, before)) if *before != rolling => Err(Problem::new(
            &leaf.path,
            format!("says another thing of the shutter than {other}: delete one"),
        )),
        _ => {
            found.rolling = Some((leaf.path.clone(), rolling));
            Ok(())
        }
    }
}

/// Keeps a number; a second one that is another is refused.
fn once(slot: &mut Option<(String, f64)>, leaf: &Leaf<'_>, number: f64, unit: &str) -> Result<(), Problem> {
    match slot {
        Some((other, before)) if (*before - number).abs() > 5e-3 * before.abs() => Err(Problem::new(
            &leaf.path,
            format!("is {number} {unit}, but {other} is {before}: delete the one that is not meant"),
        )),
        _ => {
            slot.get_or_insert((leaf.path.clone(), number));
            Ok(())
        }
    }
}

/// A readout in milliseconds. Without a stated unit the one in which a sensor can be that fast: there is
/// never more than one.
fn in_ms(leaf: &Leaf<'_>, readout: f64, unit: Option<f64>, notes: &mut Vec<String>) -> Result<f64, Problem> {
    if readout == 0.0 {
        return Ok(0.0);
    }
    if let Some(unit) = unit {
        let ms = readout * unit;
        return if ms.abs() <= 1e3 {
            Ok(ms)
        } else {
            Err(Problem::new(
                &leaf.path,
                format!(
                    "is {}: a readout of {:.3} s, which no sensor takes; check its unit",
                    leaf.value,
                    ms * 1e-3
                ),
            ))
        };
    }
    let units = [("s", 1e3), ("ms", 1.0), ("us", 1e-3), ("ns", 1e-6)];
    let fitting = units.iter().find(|(_, unit)| (SHORTEST_MS..=LONGEST_MS).contains(&(readout * unit)));
    let (name, unit) = fitting.ok_or_else(|| {
        let text = format!("is {} without a unit, and in none of s, ms, us, ns a readout of {SHORTEST_MS} to {LONGEST_MS} ms: call it readout_ms or line_delay_ns", leaf.value);
        Problem::new(&leaf.path, text)
    })?;
    notes
        .push(format!("{} was read in {name}: in no other unit would a sensor's readout last {SHORTEST_MS} to {LONGEST_MS} ms", leaf.path));
    Ok(readout * unit)
}

fn turned(direction: Readout, backwards: bool) -> Readout {
    match (direction, backwards) {
        (same, false) => same,
        (Readout::TopToBottom, true) => Readout::BottomToTop,
        (Readout::BottomToTop, true) => Readout::TopToBottom,
        (Readout::LeftToRight, true) => Readout::RightToLeft,
        (Readout::RightToLeft, true) => Readout::LeftToRight,
    }
}

/// Whether a note will name it.
fn is_named(keys: &'static [Key], leaf: &Leaf<'_>) -> bool {
    match known(keys, leaf).map(|key| key.use_) {
        None => true,
        Some(Use::Named(neutral)) => !neutral.is(leaf.value),
        Some(_) => false,
    }
}

/// By the format's table, else by name.
fn time_of(keys: &'static [Key], leaf: &Leaf<'_>) -> Option<Time> {
    match known(keys, leaf).map(|key| key.use_) {
        Some(Use::Readout(unit)) => Some(Time::Readout(Some(unit))),
        Some(Use::LineDelay(unit)) => Some(Time::LineDelay(Some(unit))),
        Some(Use::Rate) => Some(Time::Rate),
        Some(Use::Rolling) => Some(Time::Rolling),
        Some(_) => None,
        None => by_name(&leaf.path).filter(|time| match leaf.value {
            Value::Array(_) | Value::Object(_) => false,
            Value::String(_) => true,
            _ => !matches!(time, Time::Kind | Time::Direction),
        }),
    }
}

/// Letters and digits, in lower case.
fn plain(name: &str) -> String {
    name.chars().filter(char::is_ascii_alphanumeric).map(|c| c.to_ascii_lowercase()).collect()
}

/// Words that speak of times, in `plain` spelling.
fn may_be_a_time(name: &str) -> bool {
    let name = plain(name);
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

pub(super) fn by_name(path: &str) -> Option<Time> {
    let path =
        path.split('[').map(|part| part.split_once(']').map_or(part, |(_, rest)| rest)).collect::<String>();
    // Rates and times of other sensors.
    if ["imu", "gyro", "gps", "lidar", "publish"]
        .iter()
        .any(|other| path.to_ascii_lowercase().contains(other))
    {
        return None;
    }
    let mut names = path.rsplit('.').map(plain);
    let name = names.next()?;
    let of_name = |name: &str| {
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
                return unit(rest).map(Time::LineDelay);
            }
        }
        if name.contains("readoutdirection") || name.contains("shutterdirection") {
            return Some(Time::Direction);
        }
        if let Some((_, rest)) = name.split_once("readout") {
            return unit(rest).map(Time::Readout);
        }
        if let Some((_, rest)) = name.split_once("rollingshutter") {
            return match rest {
                "" | "enabled" | "enable" | "flag" | "camera" | "on" => Some(Time::Rolling),
                "tr" => Some(Time::Readout(Some(1e3))),
                rest => unit(rest.trim_start_matches("skew")).map(Time::Readout),
            };
        }
        match name {
            _ if name.ends_with("globalshutter") => Some(Time::Global),
            _ if name.ends_with("shutter")
                || name.ends_with("shuttertype")
                || name.ends_with("shuttermode") =>
            {
                Some(Time::Kind)
            }
            "fps" | "framerate" | "ratehz" | "framespersecond" | "camerafps" | "camfps" | "camerarate"
            | "camrate" | "imagerate" | "cameraframerate" | "frameratehz" | "cameraratehz"
            | "imageratehz" => Some(Time::Rate),
            _ => None,
        }
    };
    // `rolling_shutter: {readout_time: ...}`, `shutter: {type: rolling}`.
    of_name(&name).or_else(|| of_name(&format!("{}{name}", names.next()?)))
}

/// Milliseconds a unit of what stands behind the word; `Some(None)` if it is not said, `None` if it is
/// something else.
fn unit(rest: &str) -> Option<Option<f64>> {
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
