//! Names of table columns and the units that they state.

/// Unit of a time or a length, as in `t_s`, `t_ms`, `timestamp [ns]`, `x`, `x_mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UnitFactor {
    /// Factor that converts to seconds or metres.
    pub factor: f64,
}

/// Meaning of a column.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum TableColumn {
    /// Time; `None` if the name has no unit.
    Time(Option<UnitFactor>),
    /// Component of the position: 0, 1, 2 for x, y, z.
    Position(usize, UnitFactor),
    /// Component of the quaternion: 0, 1, 2, 3 for w, x, y, z.
    Quaternion(usize),
    /// A known quantity in an unknown unit.
    WrongUnit,
    /// Anything else.
    Other,
}

/// Units of time, in seconds.
const TIMES: &[(&str, f64)] = &[
    ("s", 1.0),
    ("sec", 1.0),
    ("seconds", 1.0),
    ("ms", 1e-3),
    ("us", 1e-6),
    ("\u{b5}s", 1e-6),
    ("\u{3bc}s", 1e-6),
    ("ns", 1e-9),
    ("nsec", 1e-9),
    ("nanoseconds", 1e-9),
    ("min", 60.0),
];
/// Units of length, in metres.
const LENGTHS: &[(&str, f64)] =
    &[("m", 1.0), ("mm", 1e-3), ("cm", 1e-2), ("km", 1e3), ("ft", 0.3048), ("in", 0.0254)];

/// Names of time columns.
const TIME_NAMES: &[&str] = &["t", "time", "timestamp", "stamp"];

/// Parses the name of a column.
pub(crate) fn parse_column(cell: &str) -> TableColumn {
    let cell = cell.trim_start_matches('\u{feff}').trim().trim_matches('"').trim().to_lowercase();
    let (name, unit) = split_unit(&cell);
    let factor = |units: &[(&str, f64)]| {
        units.iter().find(|(known, _)| Some(*known) == unit).map(|(_, factor)| UnitFactor { factor: *factor })
    };
    if TIME_NAMES.contains(&name) {
        return match (unit, factor(TIMES)) {
            (None, _) => TableColumn::Time(None),
            (_, Some(unit)) => TableColumn::Time(Some(unit)),
            (Some(_), None) => TableColumn::WrongUnit,
        };
    }
    let axis = |names: &[&str]| names.iter().position(|known| *known == name);
    if let Some(axis) =
        axis(&["x", "y", "z"]).or_else(|| axis(&["tx", "ty", "tz"])).or_else(|| axis(&["px", "py", "pz"]))
    {
        return match (unit, factor(LENGTHS)) {
            (None, _) => TableColumn::Position(axis, UnitFactor { factor: 1.0 }),
            (_, Some(unit)) => TableColumn::Position(axis, unit),
            (Some(_), None) => TableColumn::WrongUnit,
        };
    }
    match axis(&["qw", "qx", "qy", "qz"]) {
        Some(part) if unit.is_none() => TableColumn::Quaternion(part),
        _ => TableColumn::Other,
    }
}

/// Splits `x_mm`, `x [mm]` or `x (mm)` into name and unit. The `w` of `q_w` is no unit.
fn split_unit(cell: &str) -> (&str, Option<&str>) {
    match cell {
        "q_w" => return ("qw", None),
        "q_x" => return ("qx", None),
        "q_y" => return ("qy", None),
        "q_z" => return ("qz", None),
        _ => {}
    }
    for (open, close) in [('[', ']'), ('(', ')')] {
        if let Some((name, unit)) = cell.strip_suffix(close).and_then(|cell| cell.split_once(open)) {
            return (name.trim_end_matches(['_', ' ']), Some(unit.trim()));
        }
    }
    // The `stamp` of `time_stamp` is no unit.
    if cell == "time_stamp" {
        return ("timestamp", None);
    }
    cell.split_once('_').map_or((cell, None), |(name, unit)| (name, Some(unit)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_parsed_into_meaning_and_unit() {
        let unit = |factor| UnitFactor { factor };
        for (cell, expected) in [
            ("t_s", TableColumn::Time(Some(unit(1.0)))),
            ("\u{feff}T_ms", TableColumn::Time(Some(unit(1e-3)))),
            ("timestamp [ns]", TableColumn::Time(Some(unit(1e-9)))),
            ("time (us)", TableColumn::Time(Some(unit(1e-6)))),
            ("t_min", TableColumn::Time(Some(unit(60.0)))),
            ("timestamp", TableColumn::Time(None)),
            ("t_ticks", TableColumn::WrongUnit),
            ("x", TableColumn::Position(0, unit(1.0))),
            ("TY_MM", TableColumn::Position(1, unit(1e-3))),
            ("pz [ft]", TableColumn::Position(2, unit(0.3048))),
            ("x_px", TableColumn::WrongUnit),
            ("qw", TableColumn::Quaternion(0)),
            ("q_z", TableColumn::Quaternion(3)),
            ("yaw", TableColumn::Other),
            ("qw_deg", TableColumn::Other),
        ] {
            assert_eq!(parse_column(cell), expected, "{cell}");
        }
    }
}
