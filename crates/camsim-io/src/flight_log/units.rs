//! Units and other qualifiers of column names.

use std::{collections::HashMap, f64::consts::PI, sync::LazyLock};

use camsim_core::scenario::HeightReference;

/// Physical dimension of a unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dimension {
    /// Time; factors convert to nanoseconds.
    Time,
    /// Length; factors convert to metres.
    Length,
    /// Angle; factors convert to degrees.
    Angle,
}

impl Dimension {
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::Time => "time",
            Self::Length => "length",
            Self::Angle => "angle",
        }
    }
}

/// A unit of time, length or angle.
#[derive(Debug, PartialEq)]
pub(super) struct Unit {
    /// Name in messages.
    pub(super) name: &'static str,
    /// What it measures.
    pub(super) dimension: Dimension,
    /// Factor that converts to nanoseconds, metres or degrees.
    pub(super) factor: f64,
    /// Spellings with blanks between them, in lower case, without blanks, underscores, dots, hyphens and
    /// multiplication signs.
    pub(super) spellings: &'static str,
}

macro_rules! units {
    ($($unit:ident: $name:literal, $dimension:ident, $factor:expr, $spellings:literal;)*) => {
        $(pub(super) static $unit: Unit =
            Unit { name: $name, dimension: Dimension::$dimension, factor: $factor, spellings: $spellings };)*
        /// All known units.
        pub(super) static UNITS: &[&Unit] = &[$(&$unit),*];
    };
}

units! {
    SECOND: "s", Time, 1e9, "s sec secs second seconds";
    MILLISECOND: "ms", Time, 1e6, "ms msec msecs millis millisec millisecs millisecond milliseconds";
    MICROSECOND: "us", Time, 1e3,
        "us usec usecs µs μs micros microsec microsecs microsecond microseconds";
    NANOSECOND: "ns", Time, 1.0, "ns nsec nsecs nanos nanosec nanosecs nanosecond nanoseconds";
    MINUTE: "min", Time, 60e9, "min mins minute minutes";
    HOUR: "h", Time, 3600e9, "h hr hrs hour hours";
    DAY: "days", Time, 86_400e9, "day days";
    METRE: "m", Length, 1.0, "m meter meters metre metres mtr mtrs";
    FOOT: "ft", Length, 0.3048, "ft foot feet fuß fuss pied pieds pies piedi voet";
    SURVEY_FOOT: "US survey foot", Length, 1200.0 / 3937.0,
        "usft ftus ussft ussurveyft ussurveyfoot ussurveyfeet surveyft surveyfoot surveyfeet usfoot usfeet";
    MILLIMETRE: "mm", Length, 1e-3, "mm millimeter millimeters millimetre millimetres";
    CENTIMETRE: "cm", Length, 1e-2, "cm centimeter centimeters centimetre centimetres";
    DECIMETRE: "dm", Length, 0.1, "dm decimeter decimeters decimetre decimetres";
    KILOMETRE: "km", Length, 1e3, "km kilometer kilometers kilometre kilometres";
    INCH: "inch", Length, 0.0254, "inch inches";
    YARD: "yd", Length, 0.9144, "yd yds yard yards";
    MILE: "mi", Length, 1609.344, "mi mile miles";
    DEGREE: "deg", Angle, 1.0, "deg degs degree degrees ° @";
    RADIAN: "rad", Angle, 180.0 / PI, "rad rads radian radians";
    MILLIRADIAN: "mrad", Angle, 0.18 / PI, "mrad mrads milliradian milliradians";
    DECIDEGREE: "0.1 deg", Angle, 0.1, "ddeg decideg decidegree decidegrees dege1 01deg";
    CENTIDEGREE: "cdeg", Angle, 1e-2,
        "cdeg cdegs centideg centidegs centidegree centidegrees dege2 001deg";
    MILLIDEGREE: "mdeg", Angle, 1e-3, "mdeg millideg millidegree millidegrees";
    DEGREE_E7: "1e-7 deg", Angle, 1e-7,
        "dege7 deg1e7 1e7deg 1e7degree 1e7degrees degreese7 degrees1e7 e7 1e7 deg10^7";
    ARC_MINUTE: "arcmin", Angle, 1.0 / 60.0, "arcmin arcminute arcminutes";
    ARC_SECOND: "arcsec", Angle, 1.0 / 3600.0, "arcsec arcsecond arcseconds";
    GON: "gon", Angle, 0.9, "gon gons";
    SEMICIRCLE: "semicircles", Angle, 180.0 / 2_147_483_648.0, "semicircle semicircles";
}

/// Each spelling with its unit.
static BY_SPELLING: LazyLock<HashMap<&str, &Unit>> = LazyLock::new(|| {
    UNITS.iter().flat_map(|unit| unit.spellings.split(' ').map(move |spelling| (spelling, *unit))).collect()
});

/// A word that qualifies a column's name: a suffix, or in brackets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Qualifier {
    /// Unit of the numbers.
    Unit(&'static Unit),
    /// Reference surface of a height.
    Datum(HeightReference),
    /// Angles from magnetic north.
    Magnetic,
    /// A known word that does not change the numbers.
    Ignored,
}

/// Parses a suffix of a name, or a word in its brackets; `None` if it is not known.
pub(super) fn parse_qualifier(text: &str) -> Option<Qualifier> {
    let key: String = text
        .to_lowercase()
        .chars()
        .filter(|c| !matches!(c, ' ' | '_' | '.' | '-' | '+' | '±' | '*' | '·' | '×'))
        .collect();
    if let Some(unit) = BY_SPELLING.get(key.as_str()) {
        return Some(Qualifier::Unit(unit));
    }
    Some(match key.as_str() {
        "msl" | "amsl" | "asl" | "sealevel" | "abovesealevel" | "abovemeansealevel" | "orthometric"
        | "geoid" | "egm96" => Qualifier::Datum(HeightReference::Msl),
        "ellipsoid" | "ellipsoidal" | "hae" | "wgs84" | "wgs" | "aboveellipsoid" => {
            Qualifier::Datum(HeightReference::Ellipsoid)
        }
        "magnetic" | "mag" => Qualifier::Magnetic,
        "" | "utc" | "gmt" | "local" | "gps" | "unix" | "epoch" | "true" | "1" | "unitless" | "0360"
        | "360" | "180" | "180180" | "180to180" | "0to360" | "frd" | "body" | "decimal" | "dd" => {
            Qualifier::Ignored
        }
        pattern if is_time_pattern(pattern) => Qualifier::Ignored,
        _ => return None,
    })
}

/// Whether a text describes how dates or clock times are written, as `yyyy-mm-dd` or `hh:mm:ss`.
fn is_time_pattern(key: &str) -> bool {
    let has = |part: &str| key.contains(part);
    matches!(key, "iso" | "iso8601")
        || ((has("yy") && has("mm") && has("dd")) || (has("hh") && has("mm") && has("ss")))
            && key.chars().all(|c| "ymdhsftz:/,".contains(c))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spellings_are_unique_and_in_normal_form() {
        let all: Vec<&str> = UNITS.iter().flat_map(|unit| unit.spellings.split(' ')).collect();
        for (index, spelling) in all.iter().enumerate() {
            assert!(!all[..index].contains(spelling), "{spelling}");
            assert!(matches!(parse_qualifier(spelling), Some(Qualifier::Unit(_))), "{spelling}");
        }
    }
}
