//! Columns of tables by name, with the unit that the name states.

/// A time or a length by its name: `t_s`, `t_ms`, `timestamp [ns]`, `x`, `x_mm`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unit {
    /// Seconds or metres of one of them.
    pub factor: f64,
}

/// What a column is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Column {
    /// Seconds are the numbers times this; `None` if the name has no unit.
    Time(Option<Unit>),
    /// x, y, z of the position; metres are the numbers times this.
    Position(usize, Unit),
    /// w, x, y, z of the quaternion.
    Turn(usize),
    /// A known quantity in a unit that is not.
    WrongUnit,
    /// Anything else.
    Other,
}

/// Names of time units and what they are in seconds.
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
/// Names of units of length and what they are in metres.
const LENGTHS: &[(&str, f64)] =
    &[("m", 1.0), ("mm", 1e-3), ("cm", 1e-2), ("km", 1e3), ("ft", 0.3048), ("in", 0.0254)];

const TIME_NAMES: &[&str] = &["t", "time", "timestamp", "stamp"];

/// What a header's cell names.
pub(crate) fn column(cell: &str) -> Column {
    let cell = cell.trim_start_matches('\u{feff}').trim().trim_matches('"').trim().to_lowercase();
    let (name, unit) = split(&cell);
    let factor = |units: &[(&str, f64)]| {
        units.iter().find(|(known, _)| Some(*known) == unit).map(|(_, factor)| Unit { factor: *factor })
    };
    if TIME_NAMES.contains(&name) {
        return match (unit, factor(TIMES)) {
            (None, _) => Column::Time(None),
            (_, Some(unit)) => Column::Time(Some(unit)),
            (Some(_), None) => Column::WrongUnit,
        };
    }
    let axis = |names: &[&str]| names.iter().position(|known| *known == name);
    if let Some(axis) =
        axis(&["x", "y", "z"]).or_else(|| axis(&["tx", "ty", "tz"])).or_else(|| axis(&["px", "py", "pz"]))
    {
        return match (unit, factor(LENGTHS)) {
            (None, _) => Column::Position(axis, Unit { factor: 1.0 }),
            (_, Some(unit)) => Column::Position(axis, unit),
            (Some(_), None) => Column::WrongUnit,
        };
    }
    match axis(&["qw", "qx", "qy", "qz"]) {
        Some(part) if unit.is_none() => Column::Turn(part),
        _ => Column::Other,
    }
}

/// A name and its unit: `x_mm`, `x [mm]`, `x (mm)`, `q_w` being a name of its own.
fn split(cell: &str) -> (&str, Option<&str>) {
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
    // `time_stamp` is no unit of time called stamp.
    if cell == "time_stamp" {
        return ("timestamp", None);
    }
    cell.split_once('_').map_or((cell, None), |(name, unit)| (name, Some(unit)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_what_and_in_which_unit() {
        let unit = |factor| Unit { factor };
        for (cell, expected) in [
            ("t_s", Column::Time(Some(unit(1.0)))),
            ("\u{feff}T_ms", Column::Time(Some(unit(1e-3)))),
            ("timestamp [ns]", Column::Time(Some(unit(1e-9)))),
            ("time (us)", Column::Time(Some(unit(1e-6)))),
            ("t_min", Column::Time(Some(unit(60.0)))),
            ("timestamp", Column::Time(None)),
            ("t_ticks", Column::WrongUnit),
            ("x", Column::Position(0, unit(1.0))),
            ("TY_MM", Column::Position(1, unit(1e-3))),
            ("pz [ft]", Column::Position(2, unit(0.3048))),
            ("x_px", Column::WrongUnit),
            ("qw", Column::Turn(0)),
            ("q_z", Column::Turn(3)),
            ("yaw", Column::Other),
            ("qw_deg", Column::Other),
        ] {
            assert_eq!(column(cell), expected, "{cell}");
        }
    }
}
