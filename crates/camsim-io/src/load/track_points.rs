//! Points to track that files and keys give: those of the calibration board, and those of tables.

use std::path::Path;

use camsim_core::{
    flight_log::FlightLog,
    geodesy::LocalFrame,
    scenario::{PointSource, Scenario},
    scene::ned_from_board,
    tracks::{TrackPoint, thinned},
};
use glam::DVec3;

use super::{
    LoadError, board_position_ned_m,
    position_columns::{PositionColumns, check_names},
    raises_log,
    scene::{position_ned_m, undulation_m},
};
use crate::{board_file::read_board, table::open_table};

/// Advice in messages about the header.
const COLUMNS: &str = "give a header with n_m,e_m,d_m or lat_deg,lon_deg,height_m and, if wanted, name";

/// Points of `[output.tracks]` that files and keys give, and the position of the local frame on Earth.
#[derive(Clone, Debug, Default)]
pub struct TrackInputs {
    /// The points of each source of `output.tracks.points`; none of terrain and models, which depend on what
    /// the frames see.
    pub given: Vec<Vec<TrackPoint>>,
    frame: Option<LocalFrame>,
    /// Whether heights of the log are above mean sea level and those of the local frame are not.
    shifts_heights: bool,
}

impl TrackInputs {
    /// Reads the tables and the board.
    ///
    /// # Errors
    /// A table or board that cannot be read; geodetic points without an origin.
    pub(super) fn load(scenario: &Scenario, log: &FlightLog) -> Result<Self, LoadError> {
        let Some(spec) = &scenario.output.tracks else { return Ok(Self::default()) };
        let of_source = |source: &PointSource| match source {
            PointSource::Terrain | PointSource::Vertices => Ok(Vec::new()),
            PointSource::Board => board_points(scenario, log, spec.count as usize),
            PointSource::Table(path) => read_points(path, &source.label(), scenario, log),
        };
        Ok(Self {
            given: spec.points.iter().map(of_source).collect::<Result<_, _>>()?,
            frame: log.frame,
            shifts_heights: raises_log(scenario),
        })
    }

    /// Latitude, longitude (degrees) and height (metres, above what heights of the log are above) of a point;
    /// `None` for logs in local coordinates without an origin.
    #[must_use]
    pub fn geodetic(&self, point_ned_m: DVec3) -> Option<[f64; 3]> {
        let geodetic = self.frame.as_ref()?.geodetic_from_ned(point_ned_m);
        let undulation_m =
            if self.shifts_heights { undulation_m(geodetic.lat_rad, geodetic.lon_rad) } else { 0.0 };
        Some([geodetic.lat_deg(), geodetic.lon_deg(), geodetic.height_m - undulation_m])
    }
}

/// Corners or centres of circles of the scenario's board, at most `count`.
fn board_points(scenario: &Scenario, log: &FlightLog, count: usize) -> Result<Vec<TrackPoint>, LoadError> {
    let Some(spec) = &scenario.scene.board else { return Ok(Vec::new()) };
    let board = read_board(spec)?;
    let centre_ned_m = board_position_ned_m(scenario, spec, log)?;
    let turn = ned_from_board(spec.angles_deg);
    let points = thinned(board.points().to_vec(), count, scenario.seed);
    let point = |point: camsim_core::scene::BoardPoint| TrackPoint {
        source: PointSource::Board.label(),
        name: point.id.to_string(),
        position_ned_m: centre_ned_m + turn * point.position_m.extend(0.0),
        moves_with: None,
    };
    Ok(points.into_iter().map(point).collect())
}

/// Reads a table of points. Rows without a name have their number, counted from 0.
fn read_points(
    path: &Path,
    source: &str,
    scenario: &Scenario,
    log: &FlightLog,
) -> Result<Vec<TrackPoint>, LoadError> {
    let fail = |problem: String| LoadError::TrackPoints { path: path.into(), problem };
    let mut reader = open_table(path)
        .map_err(|error| fail(format!("cannot be read: {error}; check output.tracks.points")))?;
    let header = reader.headers().map_err(|error| fail(error.to_string()))?.clone();
    let wrong = |problem: String| fail(format!("line 1: {problem}"));
    check_names(&header, |name| name == "name", COLUMNS).map_err(wrong)?;
    let columns = PositionColumns::of(&header, false)
        .ok_or_else(|| wrong(format!("positions are incomplete, or of two kinds; {COLUMNS}")))?;
    let name_column = header.iter().position(|cell| cell == "name");
    let mut points = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| fail(error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let (at, geodetic) =
            columns.read(&record).map_err(|problem| fail(format!("line {line}: {problem}")))?;
        let name = name_column.and_then(|column| record.get(column)).unwrap_or_default();
        points.push(TrackPoint {
            source: source.to_owned(),
            name: if name.is_empty() { points.len().to_string() } else { name.to_owned() },
            position_ned_m: position_ned_m(scenario, log, at, geodetic, "a table of output.tracks.points")?,
            moves_with: None,
        });
    }
    if points.is_empty() { Err(fail("has no row: give each point a line".into())) } else { Ok(points) }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::{load::load_flight, scenario_file::parse_scenario};

    const LOG: &str = "t_s,lat_deg,lon_deg,height_m,roll_deg,pitch_deg,yaw_deg\n\
                       0,46.5,7.25,1000,0,0,0\n1,46.5001,7.25,1000,0,0,0\n2,46.5002,7.25,1000,0,0,0\n";

    /// The points of a table beside a log.
    fn read(table: &str, sets: &str) -> Result<(TrackInputs, Vec<TrackPoint>), String> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("log.csv"), LOG).unwrap();
        std::fs::write(folder.path().join("p.csv"), table).unwrap();
        let text = format!(
            "seed = 3\n[flight]\nlog = \"log.csv\"\n{sets}\n[scene.board]\nkind = \"chessboard\"\ncolumns = 3\n\
             rows = 2\nsize_m = 0.5\nat = [10.0, 20.0, 5.0]\nangles_deg = [0.0, 0.0, 0.0]\n\
             [output.tracks]\npoints = [\"board\", \"p.csv\"]\ncount = 4\n"
        );
        let scenario = parse_scenario(&text, &folder.path().join("s.toml"), &[]).unwrap();
        let (log, _) = load_flight(&scenario).unwrap();
        let inputs = TrackInputs::load(&scenario, &log).map_err(|error| error.to_string())?;
        let points = inputs.given[1].clone();
        Ok((inputs, points))
    }

    #[test]
    fn tables_and_boards_give_points() {
        let (inputs, points) =
            read("\u{feff}e_m,n_m,d_m,name\r\n# two\r\n1,2,3,\"a, b\"\r\n4,5,6,\r\n", "").unwrap();
        let point = |name: &str, ned: [f64; 3]| TrackPoint {
            source: "p.csv".into(),
            name: name.into(),
            position_ned_m: DVec3::from_array(ned),
            moves_with: None,
        };
        assert_eq!(points, [point("a, b", [2.0, 1.0, 3.0]), point("1", [5.0, 4.0, 6.0])]);
        // Four of the six corners; rows run from the top (north), columns to the right (east).
        let board = &inputs.given[0];
        assert_eq!(board.len(), 4);
        for corner in board {
            let id: u32 = corner.name.parse().unwrap();
            let (column, row) = (f64::from(id % 3), f64::from(id / 3));
            let expected = DVec3::new(10.25 - 0.5 * row, 19.5 + 0.5 * column, 5.0);
            assert!((corner.position_ned_m - expected).length() < 1e-12, "{corner:?}");
        }
        // Latitude and longitude there and back, with heights of either datum.
        for sets in ["", "height = \"msl\"\n[scene.terrain]\ndem = \"none.tif\""] {
            let (inputs, points) = read("lat_deg,lon_deg,height_m\n46.51,7.26,700\n", sets).unwrap();
            let back = inputs.geodetic(points[0].position_ned_m).unwrap();
            for (value, expected) in back.into_iter().zip([46.51, 7.26, 700.0]) {
                assert!((value - expected).abs() < 1e-6, "{sets}: {back:?}");
            }
        }
    }

    #[test]
    fn errors_name_file_and_line() {
        for (table, wanted) in [
            ("n_m,e_m\n1,2\n", "line 1: positions are incomplete"),
            ("n_m,e_m,d_m,lat_deg\n1,2,3,4\n", "of two kinds"),
            ("n_m,e_m,d_m,size\n1,2,3,4\n", "line 1: the column `size`"),
            ("n_m,e_m,d_m,n_m\n1,2,3,4\n", "there are two columns `n_m`"),
            ("n_m,e_m,d_m\n1,2,3\n1,x,3\n", "line 3: `x` is no finite number"),
            ("lat_deg,lon_deg,height_m\n99,7,3\n", "line 2: latitude 99, longitude 7"),
            ("n_m,e_m,d_m\n", "has no row"),
            ("n_m,e_m,d_m\n1\n", "p.csv"),
        ] {
            let error = read(table, "").map(|_| ()).unwrap_err();
            assert!(error.contains(wanted) && error.contains("p.csv"), "{error}");
        }
    }
}
