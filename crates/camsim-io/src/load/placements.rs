//! Tables of placements: where copies of a model stand.

use std::path::Path;

use super::{
    LoadError,
    position_columns::{NAMES, Position, PositionColumns, check_names},
};
use crate::table::{finite, open_table};

/// Pose and scale of one copy of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    /// Local position (north-east-down, metres), or latitude, longitude and height (degrees, metres).
    pub position: Position,
    /// Heading, added to that of the scenario.
    pub heading_deg: f64,
    /// Scale, multiplied by that of the scenario.
    pub scale: f64,
}

/// Advice in messages about the header.
const COLUMNS: &str =
    "give a header with n_m,e_m,d_m or lat_deg,lon_deg,height_m and, if wanted, heading_deg and scale";

/// Reads a table with a header. With `on_ground` the column of heights may be missing.
///
/// # Errors
/// The table cannot be read, lacks columns, or a value is out of range.
pub(super) fn read_placements(path: &Path, on_ground: bool) -> Result<Vec<Placement>, LoadError> {
    let fail = |problem: String| LoadError::Placements { path: path.into(), problem };
    let mut reader = open_table(path)
        .map_err(|error| fail(format!("cannot be read: {error}; check scene.gltf.placements")))?;
    let header = reader.headers().map_err(|error| fail(error.to_string()))?.clone();
    let wrong = |problem: String| fail(format!("line 1: {problem}"));
    check_names(&header, |name| ["heading_deg", "scale"].contains(&name), COLUMNS).map_err(wrong)?;
    let columns =
        PositionColumns::of(&header, on_ground).ok_or_else(|| wrong(missing(&header, on_ground)))?;
    let column = |name: &str| header.iter().position(|cell| cell == name);
    let mut placements = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| fail(error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let wrong = |problem: String| fail(format!("line {line}: {problem}"));
        let number = |column: Option<usize>, default: f64| {
            column.map_or(Ok(default), |column| finite(&record, column)).map_err(wrong)
        };
        let position = columns.read(&record).map_err(wrong)?;
        let scale = number(column("scale"), 1.0)?;
        if scale <= 0.0 {
            return Err(wrong(format!("the scale is {scale}, not above 0")));
        }
        placements.push(Placement { position, heading_deg: number(column("heading_deg"), 0.0)?, scale });
    }
    if placements.is_empty() {
        Err(fail("has no row: give a position a line".into()))
    } else {
        Ok(placements)
    }
}

/// What is wrong with the columns of positions.
fn missing(header: &csv::StringRecord, on_ground: bool) -> String {
    let has = |name: &str| header.iter().any(|cell| cell == name);
    match NAMES.into_iter().find(|[a, b, c]| !on_ground && has(a) && has(b) && !has(c)) {
        Some([.., name]) => format!(
            "the column `{name}` is missing; give it, or set scene.gltf.on_ground = true for what stands on the terrain"
        ),
        None => format!("positions are missing, or there are two kinds of them; {COLUMNS}"),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use camsim_core::scenario::PatternCentre;

    use super::*;

    fn read(text: &str, on_ground: bool) -> Result<Vec<Placement>, String> {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("places.csv");
        std::fs::write(&path, text).unwrap();
        read_placements(&path, on_ground).map_err(|error| error.to_string())
    }

    #[test]
    fn placements_are_read_by_column_names() {
        let placement = |position, heading_deg, scale| Placement { position, heading_deg, scale };
        assert_eq!(
            read("\u{feff}e_m,n_m,d_m,heading_deg\r\n# two\r\n1,2,3,90\r\n4,5,6,0\r\n", false).unwrap(),
            [
                placement((PatternCentre::Ned([2.0, 1.0, 3.0]), None), 90.0, 1.0),
                placement((PatternCentre::Ned([5.0, 4.0, 6.0]), None), 0.0, 1.0)
            ]
        );
        let earth = read("lat_deg,lon_deg,scale\n47,8,2.5\n", true).unwrap();
        assert_eq!(earth, [placement((PatternCentre::Origin, Some([47.0, 8.0, 0.0])), 0.0, 2.5)]);
    }

    #[test]
    fn errors_name_file_and_line() {
        for (text, on_ground, wanted) in [
            (
                "n_m,e_m\n1,2\n",
                false,
                "line 1: the column `d_m` is missing; give it, or set scene.gltf.on_ground",
            ),
            ("lon_deg,lat_deg\n1,2\n", false, "line 1: the column `height_m` is missing"),
            ("n_m,d_m\n1,2\n", false, "line 1: positions are missing"),
            ("n_m,e_m,lat_deg,lon_deg\n1,2,3,4\n", true, "two kinds"),
            ("n_m,e_m,d_m,lat_deg\n1,2,3,4\n", false, "two kinds"),
            ("n_m,e_m,size\n1,2,3\n", true, "the column `size`"),
            ("n_m,e_m,d_m,n_m\n1,2,3,4\n", false, "line 1: there are two columns `n_m`"),
            (
                "lat_deg,lon_deg\n47,8\n147,8\n",
                true,
                "line 3: latitude 147, longitude 8 are no position on Earth",
            ),
            ("lat_deg,lon_deg\n47,999\n", true, "line 2: latitude 47, longitude 999"),
            ("n_m,e_m\n1,x\n", true, "line 2: `x` is no finite number"),
            ("n_m,e_m,scale\n1,2,1\n1,2,0\n", true, "line 3: the scale is 0"),
            ("n_m,e_m\n", true, "has no row"),
            ("n_m,e_m\n1\n", true, "places.csv"),
        ] {
            let error = read(text, on_ground).unwrap_err();
            assert!(error.contains(wanted) && error.contains("places.csv"), "{error}");
        }
    }
}
