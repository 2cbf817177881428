//! Units in prose, with the quantities that they belong to: `heights in feet, angles in radians`.
//!
//! Prose may be about anything: `Image height in mm: 24`. So a unit counts only in a line that is about columns
//! and nothing else: it has no word that is not known here, and states no number.

use std::ops::Range;

use super::{
    super::{
        columns::Frame,
        units::{Dimension, Qualifier, Unit, parse_qualifier},
        word_list::has_word,
    },
    Target,
};

/// Units that a line of prose states.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Found {
    /// Units with what they belong to; with nothing, to the whole table.
    pub(super) plain: Vec<(Vec<Target>, &'static Unit)>,
    /// A unit other than metres and degrees that may belong to what is read.
    pub(super) doubtful: Option<&'static Unit>,
}

/// Words that say nothing about which numbers have a unit.
const FILLERS: &str = "unit units in of are is as to a an all and the this these with by decimal value \
    values number numbers column columns col cols field fields row rows file table log data measured given \
    recorded logged stored expressed written stated use uses using format scale pose poses trajectory \
    flight uav drone gps gnss above sea level msl amsl asl agl orthometric geoid egm96 egm2008 navd88 \
    ellipsoid ellipsoidal wgs84 wgs 84 since from boot startup start epoch unix 1970 utc quaternion \
    quaternions quat hamilton scalar first last xyzw wxyz qx qy qz qw w frame convention ned enu frd flu \
    axis axes up true magnetic per / en über meer meeresspiegel nn au dessus du niveau de la mer";
/// Such words that make another quantity of one right behind them, as in `frame height` and `start time`.
const MODIFIERS: &str = "column row field table file frame scale pose trajectory level geoid boot start \
    startup epoch first last axis axes scalar number value";
/// Pairs of words one of which alone has another meaning.
const FILLER_PAIRS: &str = "ground truth, camera pose, camera poses, camera trajectory, mean sea, right \
    handed, left handed";
/// Words by which a unit without a quantity is that of the whole table.
const WHOLE_TABLE: &str = "unit units values pose poses";
/// Words behind which a unit stands.
const LINKS: &str = "in en is are unit units as decimal and use uses using given";
/// Quantities that are not read, and words that make another quantity of the one beside them (`antenna
/// height`, `time offset`); their units do not matter.
const OTHERS: &str = "speed speeds velocity velocities vel groundspeed airspeed accuracy accuracies \
    precision deviation std sigma covariance error errors noise wind range acceleration accelerations acc \
    accel gyro gyroscope imu gravity temperature rate rates climb sink vario battery voltage mass weight \
    focal pixel pixels lens baseline antenna lever offset wingspan gimbal camera declination variation \
    magnetometer undulation separation radius runway airport step interval period delay latency duration \
    exposure resolution window tolerance threshold home takeoff ground terrain geoid max maximum min \
    minimum average initial target cruise zone";
/// Units of such quantities.
const OTHER_UNITS: &str = "knots knot kt kts kn mph kmh kph hpa mbar celsius volts bpm";

/// One word of a line, or a slash between two.
struct Word<'a> {
    text: &'a str,
    /// Whether a bracket, a colon or an equals sign stands before it.
    is_marked: bool,
    /// Whether a sentence ends before it.
    begins_sentence: bool,
    /// Whether only blanks stand between it and the word before.
    is_adjacent: bool,
}

fn words(lower: &str) -> Vec<Word<'_>> {
    let is_part = |c: char| c.is_alphanumeric() || matches!(c, '°' | '^');
    let mut words = Vec::new();
    let (mut is_marked, mut begins_sentence, mut is_adjacent) = (false, true, false);
    let mut rest = lower;
    while let Some(first) = rest.chars().next() {
        // Numbers keep their sign, point and exponent.
        let is_number = first.is_ascii_digit();
        let end = if is_part(first) {
            let is_in_number = |c: char| is_part(c) || matches!(c, '.' | '-' | '+');
            rest.find(|c: char| if is_number { !is_in_number(c) } else { !is_part(c) }).unwrap_or(rest.len())
        } else {
            first.len_utf8()
        };
        let (text, after) = rest.split_at(end);
        if is_part(first) || first == '/' {
            words.push(Word { text: text.trim_end_matches('.'), is_marked, begins_sentence, is_adjacent });
            (is_marked, begins_sentence, is_adjacent) = (false, false, true);
        } else if !matches!(first, ' ' | '_' | '-') {
            is_adjacent = false;
        }
        if matches!(first, '[' | '(' | '{' | ':' | '=') {
            is_marked = true;
        } else if matches!(first, '.' | '!' | '|') {
            begins_sentence = true;
        } else if matches!(first, ',' | ';') {
            is_marked = false;
        }
        rest = after;
    }
    words
}

/// What a word names: numbers that are read, or something else.
#[derive(Clone, Debug, PartialEq)]
enum Quantity {
    Read(Vec<Target>, Dimension),
    Other,
}

/// Words of the time, of a latitude, longitude, height, roll, pitch and yaw; also in German, French, Spanish and
/// Italian.
const TIMES: &str = "time times timestamp timestamps stamp stamps t clock";
const LATITUDES: &str = "lat latitude latitudes";
const LONGITUDES: &str = "lon lng long longitude longitudes";
const HEIGHTS: &str = "alt alts altitude altitudes height heights elevation elevations ele elev hmsl hae \
    down z tz höhe höhen hoehe hauteur hauteurs altitud altura altitudine quota";
const ANGLES: [&str; 3] = ["roll bank", "pitch", "yaw heading headings hdg"];
/// Words of all angles, of a whole position, and of the lengths in it.
const ATTITUDES: &str =
    "angle angles attitude attitudes orientation orientations euler rpy rotation rotations";
const POSITIONS: &str = "position positions coordinate coordinates location locations";
const LENGTHS: &str = "translation translations xyz length lengths";

fn quantity(word: &str, frame: Frame) -> Option<Quantity> {
    let is = |list: &str| has_word(list, word);
    let is_geodetic = frame == Frame::Geodetic;
    let positions = |axes: &[usize], dimension: Dimension| {
        Some(Quantity::Read(axes.iter().map(|&axis| Target::Position(axis)).collect(), dimension))
    };
    let angles =
        |axes: Range<usize>| Some(Quantity::Read(axes.map(Target::Angle).collect(), Dimension::Angle));
    let horizontal = |axis: usize| if is_geodetic { None } else { positions(&[axis], Dimension::Length) };
    let degrees = |axis: usize| if is_geodetic { positions(&[axis], Dimension::Angle) } else { None };
    let (north, east) = if frame == Frame::EastNorthUp { (1, 0) } else { (0, 1) };
    match word {
        _ if is(TIMES) => Some(Quantity::Read(vec![Target::Time], Dimension::Time)),
        _ if is(LATITUDES) => degrees(0),
        _ if is(LONGITUDES) => degrees(1),
        _ if is(HEIGHTS) => positions(&[2], Dimension::Length),
        "north" | "northing" => horizontal(north),
        "east" | "easting" => horizontal(east),
        "x" | "tx" => horizontal(0),
        "y" | "ty" => horizontal(1),
        _ if is_geodetic && is(POSITIONS) => positions(&[0, 1], Dimension::Angle),
        _ if is_geodetic && is(LENGTHS) => positions(&[2], Dimension::Length),
        _ if is(POSITIONS) || is(LENGTHS) => positions(&[0, 1, 2], Dimension::Length),
        _ if is(ATTITUDES) => angles(0..3),
        _ => match ANGLES.iter().position(|list| is(list)) {
            Some(axis) => angles(axis..axis + 1),
            None => has_word(OTHERS, word).then_some(Quantity::Other),
        },
    }
}

/// Letters that are units only where they plainly stand for one.
fn is_short(word: &str) -> bool {
    const SHORT: &str =
        "us mi hr hrs min mins minute minutes hour hours day days dd second foot inch mm cm dm yd";
    word.chars().count() <= 1 || has_word(SHORT, word)
}

fn unit(word: &str) -> Option<&'static Unit> {
    match parse_qualifier(word)? {
        Qualifier::Unit(unit) => Some(unit),
        _ => None,
    }
}

/// The unit at a word and the number of its words: `1e-7 degrees` and `us survey feet` are one unit each.
fn unit_at(words: &[Word<'_>], index: usize) -> Option<(&'static Unit, usize)> {
    let first = words[index].text;
    let may_be_joined = is_number(first) || matches!(first, "us" | "survey");
    (1..=3).rev().filter(|&count| count == 1 || may_be_joined).find_map(|count| {
        let parts: String = words.get(index..index + count)?.iter().map(|word| word.text).collect();
        unit(&parts).map(|unit| (unit, count))
    })
}

fn is_filler_pair([first, second]: [&str; 2]) -> bool {
    FILLER_PAIRS.split(", ").any(|pair| pair.split_once(' ') == Some((first, second)))
}

fn is_number(word: &str) -> bool {
    word.starts_with(|c: char| c.is_ascii_digit())
}

/// Whether a line has a word that is not known, or states a number.
fn has_other_words(words: &[Word<'_>], frame: Frame) -> bool {
    let mut next = 0;
    let mut has_words = false;
    while let Some(word) = words.get(next) {
        let following = words.get(next + 1);
        let pair = [word.text, following.map_or("", |word| word.text)];
        let is_modifier = has_word(MODIFIERS, word.text)
            && following.is_some_and(|word| word.is_adjacent && quantity(word.text, frame).is_some());
        let count = if is_filler_pair(pair) {
            2
        } else if let Some((_, count)) = unit_at(words, next) {
            count
        } else if quantity(word.text, frame).is_some()
            || (has_word(FILLERS, word.text) && !is_modifier)
            || has_word(OTHER_UNITS, word.text)
            // `4: altitude`, `column 4`, `5-7: angles`.
            || (is_number(word.text) && (!has_words || words[next - 1].text.starts_with("col")))
        {
            1
        } else {
            return true;
        };
        has_words |= !is_number(word.text);
        next += count;
    }
    false
}

/// Leaves `unit = cm` of `1 unit = 1 cm`.
fn remove_ones(words: &mut Vec<Word<'_>>) {
    let mut is_marked = false;
    words.retain_mut(|word| {
        word.is_marked |= std::mem::take(&mut is_marked);
        is_marked = word.text == "1" && word.is_marked;
        word.text != "1"
    });
}

/// Finds the units of a line.
// Long because a word's meaning depends on those beside it.
pub(super) fn find(line: &str, frame: Frame) -> Found {
    let lower = line.to_lowercase();
    let mut words = words(&lower);
    let states_scale = words.windows(2).any(|pair| pair[0].text == "1" && pair[1].text == "unit");
    if states_scale {
        remove_ones(&mut words);
    }
    let text = |index: usize| words.get(index).map_or("", |word| word.text);
    let has_other_words = has_other_words(&words, frame);
    let states_units = words.iter().any(|word| has_word(WHOLE_TABLE, word.text))
        // `[mm]`
        || (words.len() == 1 && words[0].is_marked);
    let mut found = Found::default();
    let mut pending: Vec<Quantity> = Vec::new();
    let mut next = 0;
    // Where the last unit ends.
    let mut unit_end = usize::MAX;
    while let Some(word) = words.get(next) {
        let index = next;
        let before = index.checked_sub(1).map_or("", text);
        next += 1;
        if word.begins_sentence {
            pending.clear();
        }
        if is_filler_pair([word.text, text(next)]) {
            continue;
        }
        if let Some(quantity) = quantity(word.text, frame) {
            let is_qualified = word.is_adjacent && has_word(OTHERS, before);
            if quantity == Quantity::Other && word.is_adjacent && self::quantity(before, frame).is_some() {
                pending.pop();
            }
            pending.push(if is_qualified { Quantity::Other } else { quantity });
            continue;
        }
        if has_word(OTHER_UNITS, word.text) {
            pending.retain(|quantity| *quantity != Quantity::Other);
        }
        let Some((unit, count)) = unit_at(&words, index) else { continue };
        next += count - 1;
        // `flown at 400 feet`, but not `1 unit = 0.01 m`.
        if count == 1 && is_number(before) && !word.is_marked {
            if states_scale {
                found.doubtful = Some(unit);
            }
            continue;
        }
        let follows_unit = unit_end == index || (unit_end.checked_add(1) == Some(index) && before == "and");
        let is_plain_word = count > 1
            || word.is_marked
            || follows_unit
            || matches!(before, "in" | "unit" | "units")
            || !is_short(word.text);
        if !is_plain_word {
            continue;
        }
        unit_end = next;
        // Feet per minute, m/s: the unit of another quantity.
        let has_other_dimension =
            |word: &str| self::unit(word).is_some_and(|other| other.dimension != unit.dimension);
        if text(next) == "per"
            || before == "per"
            || (text(next) == "/" && has_other_dimension(text(next + 1)))
            || (before == "/" && index > 1 && has_other_dimension(text(index - 2)))
        {
            pending.clear();
            continue;
        }
        let is_linked = word.is_marked
            || follows_unit
            || has_word(LINKS, before)
            || quantity(before, frame).is_some()
            || self::unit(before).is_some();
        let mut targets: Vec<Target> = Vec::new();
        let had_others = pending.contains(&Quantity::Other);
        pending.retain(|quantity| match quantity {
            Quantity::Read(read, dimension) if *dimension == unit.dimension => {
                for target in read {
                    if !targets.contains(target) {
                        targets.push(*target);
                    }
                }
                false
            }
            Quantity::Read(..) => true,
            Quantity::Other => false,
        });
        if targets.is_empty() && had_others {
            continue;
        }
        // `altitude in feet of terrain`
        let is_of_other = had_others || (text(next) == "of" && has_word(OTHERS, text(next + 1)));
        let is_plain = is_linked && !has_other_words && !is_of_other;
        if is_plain && (!targets.is_empty() || states_units) {
            found.plain.push((targets, unit));
        } else if unit.factor != 1.0 && (unit.dimension != Dimension::Time || !targets.is_empty()) {
            // Metres and degrees are what is read without a unit; seconds need not be.
            found.doubtful = Some(unit);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Targets of the plain units of a line, with the units' names; and the unit in doubt.
    fn of(line: &str) -> (Vec<(Vec<Target>, &'static str)>, Option<&'static str>) {
        let found = find(line, Frame::Geodetic);
        let plain = found.plain.into_iter().map(|(targets, unit)| (targets, unit.name)).collect();
        (plain, found.doubtful.map(|unit| unit.name))
    }

    #[test]
    fn units_of_quantities_are_found_in_prose() {
        use Target::{Angle, Position, Time};
        let height = || vec![Position(2)];
        let angles = || (0..3).map(Angle).collect::<Vec<_>>();
        for (line, plain) in [
            ("heights in feet above mean sea level", vec![(height(), "ft")]),
            ("Altitude: ft", vec![(height(), "ft")]),
            ("altitude (feet), speed (knots)", vec![(height(), "ft")]),
            ("altitude en pieds", vec![(height(), "ft")]),
            ("Höhe in Fuß über NN", vec![(height(), "ft")]),
            ("Höhen in Fuss", vec![(height(), "ft")]),
            ("speed in knots, altitude in feet", vec![(height(), "ft")]),
            ("roll, pitch and yaw are in radians", vec![(angles(), "rad")]),
            ("attitude angles in radians; time in ms", vec![(angles(), "rad"), (vec![Time], "ms")]),
            ("1 unit = 1 cm", vec![(vec![], "cm")]),
            ("[mm]", vec![(vec![], "mm")]),
            ("all values in mm and s", vec![(vec![], "mm"), (vec![], "s")]),
            ("ground truth, unit: cm", vec![(vec![], "cm")]),
            ("4: altitude (ft)", vec![(height(), "ft")]),
            ("lat/lon in 1e-7 degrees", vec![(vec![Position(0), Position(1)], "1e-7 deg")]),
            ("height in US survey feet", vec![(height(), "US survey foot")]),
            ("Length Units,Millimeters", vec![(height(), "mm")]),
            ("units: feet", vec![(vec![], "ft")]),
            (
                "lat, lon, alt in degrees and feet",
                vec![(vec![Position(0), Position(1)], "deg"), (height(), "ft")],
            ),
        ] {
            assert_eq!(of(line), (plain, None), "{line}");
        }
        for line in [
            "flown at 400 feet",
            "speed in feet per second",
            "climb rate: ft/min",
            "antenna height in feet",
            "height accuracy in feet",
            "time offset in ms, from the pilot's log",
            "velocities in m/s",
            "recorded by us on day 3",
        ] {
            assert_eq!(of(line), (vec![], None), "{line}");
        }
        for (line, unit) in [
            ("altitude converted from feet to metres", "ft"),
            ("heights are not in feet", "ft"),
            ("everything in radians", "rad"),
            ("altitude in feet of terrain", "ft"),
            ("Image height in mm: 24", "mm"),
            ("Wingspan and height (ft)", "ft"),
            ("frame roll in mrad", "mrad"),
            ("mean height in mm", "mm"),
            ("start time in ms", "ms"),
            ("obstacle heights in feet", "ft"),
            ("IMU roll/pitch bias [mrad]", "mrad"),
            ("time between photos in s", "s"),
            ("1 unit = 0.01 m", "m"),
            ("column 4: ft", "ft"),
            ("distances in feet", "ft"),
        ] {
            let (plain, doubtful) = of(line);
            assert_eq!((plain, doubtful), (vec![], Some(unit)), "{line}");
        }
    }
}
