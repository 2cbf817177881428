//! Column names: which names mean what, and what a header as a whole says.

use super::text::TimeUnit;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Meaning {
    Time(Option<TimeUnit>),
    Latitude,
    Longitude,
    /// Up.
    Height,
    /// Up, but less trusted than `Height`.
    PressureHeight,
    North,
    East,
    Down,
    X,
    Y,
    Z,
    Roll,
    Pitch,
    Yaw,
    Qx,
    Qy,
    Qz,
    Qw,
}

/// A recognised column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Column {
    pub(super) meaning: Meaning,
    pub(super) is_radians: bool,
}

/// The columns of a header; `None` for names that say nothing to us.
pub(super) struct Header(pub(super) Vec<Option<Column>>);

impl Header {
    pub(super) fn parse(names: &[&str]) -> Self {
        Self(names.iter().map(|name| parse_name(name)).collect())
    }

    /// Index of the first column of this meaning.
    pub(super) fn find(&self, meaning: Meaning) -> Option<usize> {
        self.0.iter().position(|column| column.is_some_and(|column| column.meaning == meaning))
    }

    pub(super) fn find_all<const N: usize>(&self, meanings: [Meaning; N]) -> Option<[usize; N]> {
        let found = meanings.map(|meaning| self.find(meaning));
        found.iter().all(Option::is_some).then(|| found.map(Option::unwrap_or_default))
    }

    pub(super) fn time(&self) -> Option<(usize, Option<TimeUnit>)> {
        self.0.iter().enumerate().find_map(|(index, column)| match column.map(|column| column.meaning) {
            Some(Meaning::Time(unit)) => Some((index, unit)),
            _ => None,
        })
    }

    pub(super) fn is_radians(&self, index: usize) -> bool {
        self.0.get(index).copied().flatten().is_some_and(|column| column.is_radians)
    }
}

/// `timestamp [ns]`, `lat_deg`, `p_RS_R_x [m]`, `Yaw(rad)`, ...
fn parse_name(name: &str) -> Option<Column> {
    let lower = name.trim_matches(['"', '\'', ' ']).to_ascii_lowercase();
    let (base, bracketed) = match lower.find(['[', '(']) {
        Some(at) => (lower[..at].trim(), lower[at + 1..].trim_end_matches([']', ')', ' ']).trim()),
        None => (lower.as_str(), ""),
    };
    let base = base.replace([' ', '-', '.'], "_");
    let (stem, suffix) = match base.rsplit_once('_') {
        Some((stem, unit @ ("s" | "sec" | "ms" | "us" | "ns" | "deg" | "rad" | "m"))) => (stem, unit),
        _ => (base.as_str(), ""),
    };
    let unit = if bracketed.is_empty() { suffix } else { bracketed };
    // `qx_m` or `t_m` would be odd but harmless; `q_w` must not lose its letter, which is why units are listed.
    let meaning = match stem {
        "t" | "time" | "timestamp" | "stamp" | "sec" | "secs" | "seconds" | "time_stamp" => Meaning::Time(match unit {
            "s" | "sec" => Some(TimeUnit::Seconds),
            "ms" => Some(TimeUnit::Milliseconds),
            "us" => Some(TimeUnit::Microseconds),
            "ns" => Some(TimeUnit::Nanoseconds),
            _ if stem.starts_with("sec") => Some(TimeUnit::Seconds),
            _ => None,
        }),
        "lat" | "latitude" => Meaning::Latitude,
        "lon" | "lng" | "long" | "longitude" => Meaning::Longitude,
        "alt" | "altitude" | "height" | "h" | "up" | "elevation" | "gnss_alt" | "gps_alt" | "alt_msl" | "alt_ellipsoid" => Meaning::Height,
        "pressure_alt" | "baro_alt" => Meaning::PressureHeight,
        "n" | "north" => Meaning::North,
        "e" | "east" => Meaning::East,
        "d" | "down" => Meaning::Down,
        "x" | "tx" | "px" | "p_x" | "pos_x" | "p_rs_r_x" => Meaning::X,
        "y" | "ty" | "py" | "p_y" | "pos_y" | "p_rs_r_y" => Meaning::Y,
        "z" | "tz" | "pz" | "p_z" | "pos_z" | "p_rs_r_z" => Meaning::Z,
        "roll" | "phi" => Meaning::Roll,
        "pitch" | "theta" => Meaning::Pitch,
        "yaw" | "heading" | "hdg" | "psi" => Meaning::Yaw,
        "qx" | "q_x" | "q_rs_x" => Meaning::Qx,
        "qy" | "q_y" | "q_rs_y" => Meaning::Qy,
        "qz" | "q_z" | "q_rs_z" => Meaning::Qz,
        "qw" | "q_w" | "q_rs_w" => Meaning::Qw,
        _ => return None,
    };
    Some(Column { meaning, is_radians: unit == "rad" })
}
