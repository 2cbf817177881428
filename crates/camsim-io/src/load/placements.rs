//! Tables of placements: where copies of a model stand.

use std::path::Path;

use camsim_core::scenario::PatternCentre;

use super::LoadError;

/// Pose and scale of one copy of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Placement {
    /// Local position (north-east-down, metres), or latitude, longitude and height (degrees, metres).
    pub position: (PatternCentre, Option<[f64; 3]>),
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
// Long because the rules of header and rows share the columns.
pub(super) fn read_placements(path: &Path, on_ground: bool) -> Result<Vec<Placement>, LoadError> {
    let fail = |problem: String| LoadError::Placements { path: path.into(), problem };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(|error| fail(format!("cannot be read: {error}; check scene.gltf.placements")))?;
    let header = reader.headers().map_err(|error| fail(error.to_string()))?.clone();
    let known = ["n_m", "e_m", "d_m", "lat_deg", "lon_deg", "height_m", "heading_deg", "scale"];
    if let Some(name) = header.iter().find(|name| !known.contains(&name.trim_start_matches('\u{feff}'))) {
        return Err(fail(format!("line 1: the column `{name}` says nothing here; {COLUMNS}")));
    }
    if let Some(name) = known
        .into_iter()
        .find(|name| header.iter().filter(|cell| cell.trim_start_matches('\u{feff}') == *name).count() > 1)
    {
        return Err(fail(format!("line 1: there are two columns `{name}`; leave one out")));
    }
    let column = |name: &str| header.iter().position(|cell| cell.trim_start_matches('\u{feff}') == name);
    let local = [column("n_m"), column("e_m"), column("d_m")];
    let earth = [column("lat_deg"), column("lon_deg"), column("height_m")];
    let is_complete = |columns: [Option<usize>; 3]| {
        columns[0].is_some() && columns[1].is_some() && (columns[2].is_some() || on_ground)
    };
    let is_local = match (is_complete(local), is_complete(earth)) {
        (true, false) => true,
        (false, true) => false,
        _ => {
            let missing = [("d_m", local), ("height_m", earth)]
                .into_iter()
                .find(|(_, columns)| columns[0].is_some() && columns[1].is_some() && columns[2].is_none());
            return Err(fail(match missing {
                Some((name, _)) if !on_ground => {
                    format!(
                        "line 1: the column `{name}` is missing; give it, or set scene.gltf.on_ground = true \
                            for what stands on the terrain"
                    )
                }
                _ => format!("line 1: places are missing, or there are two kinds of them; {COLUMNS}"),
            }));
        }
    };
    let mut placements = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| fail(error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let number = |column: Option<usize>, default: f64| -> Result<f64, LoadError> {
            let Some(column) = column else { return Ok(default) };
            let text = record.get(column).unwrap_or_default();
            let wrong = || fail(format!("line {line}: `{text}` is no finite number"));
            text.parse().ok().filter(|value: &f64| value.is_finite()).ok_or_else(wrong)
        };
        let triple = |columns: [Option<usize>; 3]| -> Result<[f64; 3], LoadError> {
            Ok([number(columns[0], 0.0)?, number(columns[1], 0.0)?, number(columns[2], 0.0)?])
        };
        let position = match is_local {
            true => (PatternCentre::Ned(triple(local)?), None),
            false => (PatternCentre::Origin, Some(triple(earth)?)),
        };
        if let Some([lat_deg, lon_deg, _]) =
            position.1.filter(|[lat_deg, lon_deg, _]| lat_deg.abs() > 90.0 || lon_deg.abs() > 360.0)
        {
            return Err(fail(format!(
                "line {line}: latitude {lat_deg}, longitude {lon_deg} are no place on Earth; both are \
                    degrees, latitude -90 to 90"
            )));
        }
        let scale = number(column("scale"), 1.0)?;
        if scale <= 0.0 {
            return Err(fail(format!("line {line}: the scale is {scale}, not above 0")));
        }
        placements.push(Placement { position, heading_deg: number(column("heading_deg"), 0.0)?, scale });
    }
    if placements.is_empty() { Err(fail("has no row: give a place a line".into())) } else { Ok(placements) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

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
            ("n_m,d_m\n1,2\n", false, "line 1: places are missing"),
            ("n_m,e_m,lat_deg,lon_deg\n1,2,3,4\n", true, "two kinds"),
            ("n_m,e_m,size\n1,2,3\n", true, "the column `size`"),
            ("n_m,e_m,d_m,n_m\n1,2,3,4\n", false, "line 1: there are two columns `n_m`"),
            (
                "lat_deg,lon_deg\n47,8\n147,8\n",
                true,
                "line 3: latitude 147, longitude 8 are no place on Earth",
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
