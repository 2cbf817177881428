//! Units and other qualifiers of column names.

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
    /// Spellings, in lower case, without blanks, underscores, dots, hyphens and multiplication signs.
    pub(super) spellings: &'static [&'static str],
    /// What it measures.
    pub(super) dimension: Dimension,
    /// Factor that converts to nanoseconds, metres or degrees.
    pub(super) factor: f64,
}

const fn unit(
    name: &'static str,
    dimension: Dimension,
    factor: f64,
    spellings: &'static [&'static str],
) -> Unit {
    Unit { name, spellings, dimension, factor }
}

pub(super) static SECOND: Unit = unit("s", Dimension::Time, 1e9, &["s", "sec", "secs", "second", "seconds"]);
pub(super) static MILLISECOND: Unit = unit(
    "ms",
    Dimension::Time,
    1e6,
    &["ms", "msec", "msecs", "millis", "millisec", "millisecs", "millisecond", "milliseconds"],
);
pub(super) static MICROSECOND: Unit = unit(
    "us",
    Dimension::Time,
    1e3,
    &["us", "usec", "usecs", "µs", "μs", "micros", "microsec", "microsecs", "microsecond", "microseconds"],
);
pub(super) static NANOSECOND: Unit = unit(
    "ns",
    Dimension::Time,
    1.0,
    &["ns", "nsec", "nsecs", "nanos", "nanosec", "nanosecs", "nanosecond", "nanoseconds"],
);
pub(super) static MINUTE: Unit = unit("min", Dimension::Time, 60e9, &["min", "mins", "minute", "minutes"]);
pub(super) static HOUR: Unit = unit("h", Dimension::Time, 3600e9, &["h", "hr", "hrs", "hour", "hours"]);
static DAY: Unit = unit("days", Dimension::Time, 86_400e9, &["day", "days"]);
pub(super) static METRE: Unit =
    unit("m", Dimension::Length, 1.0, &["m", "meter", "meters", "metre", "metres", "mtr", "mtrs"]);
static FOOT: Unit = unit(
    "ft",
    Dimension::Length,
    0.3048,
    &["ft", "foot", "feet", "fuß", "fuss", "pied", "pieds", "pies", "piedi", "voet"],
);
static SURVEY_FOOT: Unit = unit(
    "US survey foot",
    Dimension::Length,
    1200.0 / 3937.0,
    &[
        "usft",
        "ftus",
        "ussft",
        "ussurveyft",
        "ussurveyfoot",
        "ussurveyfeet",
        "surveyft",
        "surveyfoot",
        "surveyfeet",
        "usfoot",
        "usfeet",
    ],
);
pub(super) static MILLIMETRE: Unit =
    unit("mm", Dimension::Length, 1e-3, &["mm", "millimeter", "millimeters", "millimetre", "millimetres"]);
static CENTIMETRE: Unit =
    unit("cm", Dimension::Length, 1e-2, &["cm", "centimeter", "centimeters", "centimetre", "centimetres"]);
static DECIMETRE: Unit =
    unit("dm", Dimension::Length, 0.1, &["dm", "decimeter", "decimeters", "decimetre", "decimetres"]);
static KILOMETRE: Unit =
    unit("km", Dimension::Length, 1e3, &["km", "kilometer", "kilometers", "kilometre", "kilometres"]);
static INCH: Unit = unit("inch", Dimension::Length, 0.0254, &["inch", "inches"]);
static YARD: Unit = unit("yd", Dimension::Length, 0.9144, &["yd", "yds", "yard", "yards"]);
static MILE: Unit = unit("mi", Dimension::Length, 1609.344, &["mi", "mile", "miles"]);
pub(super) static DEGREE: Unit =
    unit("deg", Dimension::Angle, 1.0, &["deg", "degs", "degree", "degrees", "°", "@"]);
pub(super) static RADIAN: Unit =
    unit("rad", Dimension::Angle, 180.0 / std::f64::consts::PI, &["rad", "rads", "radian", "radians"]);
static MILLIRADIAN: Unit = unit(
    "mrad",
    Dimension::Angle,
    0.18 / std::f64::consts::PI,
    &["mrad", "mrads", "milliradian", "milliradians"],
);
static DECIDEGREE: Unit = unit(
    "0.1 deg",
    Dimension::Angle,
    0.1,
    &["ddeg", "decideg", "decidegree", "decidegrees", "dege1", "01deg"],
);
static CENTIDEGREE: Unit = unit(
    "cdeg",
    Dimension::Angle,
    1e-2,
    &["cdeg", "cdegs", "centideg", "centidegs", "centidegree", "centidegrees", "dege2", "001deg"],
);
static MILLIDEGREE: Unit =
    unit("mdeg", Dimension::Angle, 1e-3, &["mdeg", "millideg", "millidegree", "millidegrees"]);
pub(super) static DEGREE_E7: Unit = unit(
    "1e-7 deg",
    Dimension::Angle,
    1e-7,
    &[
        "dege7",
        "deg1e7",
        "1e7deg",
        "1e7degree",
        "1e7degrees",
        "degreese7",
        "degrees1e7",
        "e7",
        "1e7",
        "deg10^7",
    ],
);
static ARC_MINUTE: Unit =
    unit("arcmin", Dimension::Angle, 1.0 / 60.0, &["arcmin", "arcminute", "arcminutes"]);
static ARC_SECOND: Unit =
    unit("arcsec", Dimension::Angle, 1.0 / 3600.0, &["arcsec", "arcsecond", "arcseconds"]);
static GON: Unit = unit("gon", Dimension::Angle, 0.9, &["gon", "gons"]);
static SEMICIRCLE: Unit =
    unit("semicircles", Dimension::Angle, 180.0 / 2_147_483_648.0, &["semicircle", "semicircles"]);

/// All known units.
pub(super) static UNITS: &[&Unit] = &[
    &SECOND,
    &MILLISECOND,
    &MICROSECOND,
    &NANOSECOND,
    &MINUTE,
    &HOUR,
    &DAY,
    &METRE,
    &FOOT,
    &SURVEY_FOOT,
    &MILLIMETRE,
    &CENTIMETRE,
    &DECIMETRE,
    &KILOMETRE,
    &INCH,
    &YARD,
    &MILE,
    &DEGREE,
    &RADIAN,
    &MILLIRADIAN,
    &DECIDEGREE,
    &CENTIDEGREE,
    &MILLIDEGREE,
    &DEGREE_E7,
    &ARC_MINUTE,
    &ARC_SECOND,
    &GON,
    &SEMICIRCLE,
];

/// Reference surface of heights.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum VerticalDatum {
    MeanSeaLevel,
    Ellipsoid,
}

/// A word that qualifies a column's name: a suffix, or in brackets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Qualifier {
    /// Unit of the numbers.
    Unit(&'static Unit),
    /// Reference surface of a height.
    Datum(VerticalDatum),
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
    if let Some(unit) = UNITS.iter().find(|unit| unit.spellings.contains(&key.as_str())) {
        return Some(Qualifier::Unit(unit));
    }
    Some(match key.as_str() {
        "msl" | "amsl" | "asl" | "sealevel" | "abovesealevel" | "abovemeansealevel" | "orthometric"
        | "geoid" | "egm96" => Qualifier::Datum(VerticalDatum::MeanSeaLevel),
        "ellipsoid" | "ellipsoidal" | "hae" | "wgs84" | "wgs" | "aboveellipsoid" => {
            Qualifier::Datum(VerticalDatum::Ellipsoid)
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
        let all: Vec<&str> = UNITS.iter().flat_map(|unit| unit.spellings.iter().copied()).collect();
        for (index, spelling) in all.iter().enumerate() {
            assert!(!all[..index].contains(spelling), "{spelling}");
            assert!(matches!(parse_qualifier(spelling), Some(Qualifier::Unit(_))), "{spelling}");
        }
    }
}
