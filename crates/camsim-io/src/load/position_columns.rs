//! Columns of positions in tables.

use camsim_core::scenario::PatternCentre;

use crate::table::finite;

/// North, east, down, metres; latitude, longitude, degrees, and height, metres.
pub(super) const NAMES: [[&str; 3]; 2] = [["n_m", "e_m", "d_m"], ["lat_deg", "lon_deg", "height_m"]];

/// Where a table has positions.
#[derive(Debug, PartialEq)]
pub(super) struct PositionColumns {
    pub(super) is_local: bool,
    pub(super) columns: [Option<usize>; 3],
}

/// A local position, or one on Earth.
pub(super) type Position = (PatternCentre, Option<[f64; 3]>);

impl PositionColumns {
    /// Finds the columns; the third may be missing with `on_ground`. `None` if there are none or two kinds of them,
    /// or if one is missing.
    pub(super) fn of(header: &csv::StringRecord, on_ground: bool) -> Option<Self> {
        let column = |name: &str| header.iter().position(|cell| cell == name);
        let [local, earth] = NAMES.map(|names| names.map(column));
        let is_begun = |columns: [Option<usize>; 3]| columns.iter().any(Option::is_some);
        if is_begun(local) == is_begun(earth) {
            return None;
        }
        let is_local = is_begun(local);
        let columns = if is_local { local } else { earth };
        let is_whole = columns[0].is_some() && columns[1].is_some() && (columns[2].is_some() || on_ground);
        is_whole.then_some(Self { is_local, columns })
    }

    /// The position of a row; without a column of heights that is 0.
    pub(super) fn read(&self, row: &csv::StringRecord) -> Result<Position, String> {
        let mut position = [0.0; 3];
        for (value, column) in position.iter_mut().zip(self.columns) {
            *value = column.map_or(Ok(0.0), |column| finite(row, column))?;
        }
        let [lat_deg, lon_deg, _] = position;
        if self.is_local {
            return Ok((PatternCentre::Ned(position), None));
        }
        if lat_deg.abs() > 90.0 || lon_deg.abs() > 360.0 {
            return Err(format!(
                "latitude {lat_deg}, longitude {lon_deg} are no position on Earth; both are degrees, latitude -90 to 90"
            ));
        }
        Ok((PatternCentre::Origin, Some(position)))
    }
}

/// Refuses columns that are neither of positions nor known otherwise, and those that are there twice.
pub(super) fn check_names(
    header: &csv::StringRecord,
    is_known: impl Fn(&str) -> bool,
    advice: &str,
) -> Result<(), String> {
    if let Some(name) = header.iter().find(|name| !NAMES.as_flattened().contains(name) && !is_known(name)) {
        return Err(format!("the column `{name}` says nothing here; {advice}"));
    }
    match header.iter().find(|name| header.iter().filter(|other| other == name).count() > 1) {
        Some(name) => Err(format!("there are two columns `{name}`; leave one out")),
        None => Ok(()),
    }
}
