//! Which column is what: from the header, from `flight.format`, or from the values.

use std::path::Path;

use camsim_core::{
    flight_log::{RawAttitude, RawPosition, RawRow},
    geodesy::Geodetic,
    scenario::LogFormat,
};
use glam::{DQuat, DVec3};

use super::{
    FlightLogError,
    header::{Header, Meaning},
    text::{self, HeaderLine, Line, Separator, Table, TimeUnit},
};

/// Rows looked at to decide what the columns are.
const SAMPLE_ROWS: usize = 500;
/// A "time" at or above this is nanoseconds: in seconds it would be 3 million years.
const NANOSECONDS_FROM: f64 = 1e14;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Position {
    /// Latitude, longitude, height up.
    Geodetic,
    /// North, east, up.
    NorthEastUp,
    /// North, east, down.
    NorthEastDown,
    /// East, north, up; the attitude is that of a forward-left-up body.
    EastNorthUp,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum AttitudeColumns {
    None,
    /// Roll, pitch, yaw, and whether each is in radians.
    Euler([usize; 3], [bool; 3]),
    /// x, y, z, w.
    Quaternion([usize; 4]),
}

/// Columns of a file and what they mean.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    format: LogFormat,
    time: (usize, TimeUnit),
    position: Position,
    position_columns: [usize; 3],
    attitude: AttitudeColumns,
}

impl Layout {
    pub(super) fn find(path: &Path, table: &Table<'_>, format: LogFormat) -> Result<Self, FlightLogError> {
        refuse_pose_matrices(path, table)?;
        // The header nearest to the data counts; prose in comments names no columns.
        for line in table.headers.iter().rev() {
            if let Some(layout) = Self::from_header(path, table, line, format)? {
                return Ok(layout);
            }
        }
        let columns = table.rows.first().map_or(0, |row| table.fields(row).len());
        let format = if format == LogFormat::Auto { detect(path, table, columns)? } else { format };
        Ok(Self::without_header(table, format, columns))
    }

    fn without_header(table: &Table<'_>, format: LogFormat, columns: usize) -> Self {
        let first_time = table.rows.first().and_then(|row| table.fields(row).first().copied()).unwrap_or("");
        let position = match format {
            LogFormat::CsvLla | LogFormat::Auto => Position::Geodetic,
            LogFormat::CsvXya => Position::NorthEastUp,
            LogFormat::CsvNed => Position::NorthEastDown,
            LogFormat::Tum | LogFormat::Euroc => Position::EastNorthUp,
        };
        let attitude = match format {
            LogFormat::Tum => AttitudeColumns::Quaternion([4, 5, 6, 7]),
            LogFormat::Euroc => AttitudeColumns::Quaternion([5, 6, 7, 4]),
            _ if columns >= 7 => AttitudeColumns::Euler([4, 5, 6], [false; 3]),
            _ => AttitudeColumns::None,
        };
        let unit = time_unit(first_time, format);
        Self { format, time: (0, unit), position, position_columns: [1, 2, 3], attitude }
    }

    /// `None` if the line is a comment that names no columns.
    fn from_header(path: &Path, table: &Table<'_>, line: &HeaderLine<'_>, format: LogFormat) -> Result<Option<Self>, FlightLogError> {
        use Meaning::{Down, East, Height, Latitude, Longitude, North, Pitch, PressureHeight, Qw, Qx, Qy, Qz, Roll, X, Y, Yaw, Z};
        let header = Header::parse(&line.names);
        let problem = |problem: String| FlightLogError::Header { path: path.to_owned(), line: line.number, problem };
        let height = header.find(Height).or_else(|| header.find(PressureHeight));
        let with_height = |pair: [usize; 2]| height.map(|height| [pair[0], pair[1], height]);
        let position = if let Some(columns) = header.find_all([Latitude, Longitude]).and_then(with_height) {
            Some((Position::Geodetic, columns))
        } else if let Some(columns) = header.find_all([North, East, Down]) {
            Some((Position::NorthEastDown, columns))
        } else if let Some(columns) = header.find_all([North, East]).and_then(with_height) {
            Some((Position::NorthEastUp, columns))
        } else if let Some(columns) = header.find_all([X, Y]).and_then(with_height) {
            Some((Position::NorthEastUp, columns))
        } else {
            // Which way z points, the names alone do not say; decided below.
            header.find_all([X, Y, Z]).map(|columns| (Position::EastNorthUp, columns))
        };
        let (Some((time_column, named_unit)), Some((mut position, position_columns))) = (header.time(), position) else {
            if line.is_comment {
                return Ok(None);
            }
            let names = line.names.join(", ");
            return Err(problem(format!(
                "the columns `{names}` name no time and position; name t and lat, lon, alt, or t and north, east, down (or alt), or t and x, y, z"
            )));
        };
        let attitude = if let Some(columns) = header.find_all([Qx, Qy, Qz, Qw]) {
            AttitudeColumns::Quaternion(columns)
        } else if let Some(columns) = header.find_all([Roll, Pitch, Yaw]) {
            AttitudeColumns::Euler(columns, columns.map(|column| header.is_radians(column)))
        } else {
            AttitudeColumns::None
        };
        if position == Position::EastNorthUp {
            position = match format {
                LogFormat::CsvXya => Position::NorthEastUp,
                LogFormat::CsvNed => Position::NorthEastDown,
                LogFormat::Tum | LogFormat::Euroc => Position::EastNorthUp,
                LogFormat::Auto if matches!(attitude, AttitudeColumns::Quaternion(_)) => Position::EastNorthUp,
                LogFormat::Auto => {
                    return Err(problem("the columns x, y, z do not say whether z points up; set flight.format = \"csv-xya\" (z up) or \"csv-ned\" (z down), or name them north, east, alt or down".to_owned()));
                }
                LogFormat::CsvLla => return Err(problem("flight.format is \"csv-lla\" but the columns are x, y, z".to_owned())),
            };
        } else if (position == Position::Geodetic) != (format == LogFormat::CsvLla) && format != LogFormat::Auto {
            return Err(problem(format!(
                "flight.format is \"{}\" but the columns are named otherwise; remove the key or rename the columns",
                name(format)
            )));
        }
        let format = match position {
            Position::Geodetic => LogFormat::CsvLla,
            Position::NorthEastUp => LogFormat::CsvXya,
            Position::NorthEastDown => LogFormat::CsvNed,
            Position::EastNorthUp if format == LogFormat::Euroc => LogFormat::Euroc,
            Position::EastNorthUp => LogFormat::Tum,
        };
        let first_time = table.rows.first().and_then(|row| table.fields(row).get(time_column).copied()).unwrap_or("");
        let unit = named_unit.unwrap_or_else(|| time_unit(first_time, format));
        Ok(Some(Self { format, time: (time_column, unit), position, position_columns, attitude }))
    }

    /// One line as the file states it.
    pub(super) fn read_row(&self, path: &Path, table: &Table<'_>, line: &Line<'_>) -> Result<RawRow, FlightLogError> {
        let fields = table.fields(line);
        let field = |column: usize| {
            fields.get(column).copied().ok_or_else(|| FlightLogError::MissingColumns {
                path: path.to_owned(),
                line: line.number,
                found: fields.len(),
                needed: self.columns_needed(),
                format: name(self.format),
            })
        };
        let not_a_number = |column: usize, text: &str| FlightLogError::NotANumber {
            path: path.to_owned(),
            line: line.number,
            column: column + 1,
            text: text.to_owned(),
        };
        let number = |column: usize| {
            let text = field(column)?;
            text::number(text).ok_or_else(|| not_a_number(column, text))
        };
        let time_text = field(self.time.0)?;
        let t_ns = text::time_ns(time_text, self.time.1).ok_or_else(|| not_a_number(self.time.0, time_text))?;
        let [a, b, c] = self.position_columns;
        let values = DVec3::new(number(a)?, number(b)?, number(c)?);
        let position = match self.position {
            Position::Geodetic => {
                for (column, what, value, limit) in [(a, "latitude", values.x, 90.0), (b, "longitude", values.y, 360.0)] {
                    if value.is_finite() && value.abs() > limit {
                        return Err(FlightLogError::OutOfRange {
                            path: path.to_owned(),
                            line: line.number,
                            column: column + 1,
                            what,
                            value,
                        });
                    }
                }
                RawPosition::Geodetic(Geodetic::from_deg(values.x, values.y, values.z))
            }
            Position::NorthEastUp => RawPosition::Ned(DVec3::new(values.x, values.y, -values.z)),
            Position::NorthEastDown => RawPosition::Ned(values),
            Position::EastNorthUp => RawPosition::Ned(DVec3::new(values.y, values.x, -values.z)),
        };
        let attitude = match self.attitude {
            AttitudeColumns::None => RawAttitude::None,
            AttitudeColumns::Euler([roll, pitch, yaw], [roll_rad, pitch_rad, yaw_rad]) => {
                let angle = |column, is_radians| number(column).map(|value| if is_radians { value.to_degrees() } else { value });
                RawAttitude::EulerDeg([angle(roll, roll_rad)?, angle(pitch, pitch_rad)?, angle(yaw, yaw_rad)?])
            }
            AttitudeColumns::Quaternion([x, y, z, w]) => {
                let world_from_body = DQuat::from_xyzw(number(x)?, number(y)?, number(z)?, number(w)?);
                RawAttitude::Quaternion(match self.position {
                    Position::EastNorthUp => ned_from_enu() * world_from_body * FLU_FROM_FRD,
                    _ => world_from_body,
                })
            }
        };
        Ok(RawRow { line: line.number, t_ns, position, attitude })
    }

    fn columns_needed(&self) -> usize {
        let attitude = match self.attitude {
            AttitudeColumns::None => 0,
            AttitudeColumns::Euler(columns, _) => columns.into_iter().max().unwrap_or(0),
            AttitudeColumns::Quaternion(columns) => columns.into_iter().max().unwrap_or(0),
        };
        1 + self.position_columns.into_iter().fold(attitude.max(self.time.0), usize::max)
    }
}

/// Half a turn about x: y and z change sign.
const FLU_FROM_FRD: DQuat = DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0);

/// Half a turn about the north-east diagonal: x and y change places, z changes sign.
fn ned_from_enu() -> DQuat {
    DQuat::from_xyzw(std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2, 0.0, 0.0)
}

/// As written in a scenario.
fn name(format: LogFormat) -> &'static str {
    match format {
        LogFormat::Auto => "auto",
        LogFormat::CsvLla => "csv-lla",
        LogFormat::CsvXya => "csv-xya",
        LogFormat::CsvNed => "csv-ned",
        LogFormat::Tum => "tum",
        LogFormat::Euroc => "euroc",
    }
}

fn time_unit(first: &str, format: LogFormat) -> TimeUnit {
    let is_whole = !first.contains(['.', 'e', 'E']);
    let is_huge = text::number(first).is_some_and(|value| value.abs() >= NANOSECONDS_FROM);
    if is_huge || (format == LogFormat::Euroc && is_whole) { TimeUnit::Nanoseconds } else { TimeUnit::Seconds }
}

/// The format of a file without a header, if only one fits.
fn detect(path: &Path, table: &Table<'_>, columns: usize) -> Result<LogFormat, FlightLogError> {
    let ambiguous = |candidates| FlightLogError::Ambiguous { path: path.to_owned(), candidates };
    let sample: Vec<Vec<f64>> = table
        .sample(SAMPLE_ROWS)
        .map(|row| table.fields(row).iter().map(|field| text::number(field).unwrap_or(f64::NAN)).collect())
        .collect();
    let is_unit = |row: &Vec<f64>| row.len() >= 8 && (row[4..8].iter().map(|q| q * q).sum::<f64>() - 1.0).abs() < 0.02;
    if columns >= 8 && sample.iter().filter(|row| is_unit(row)).count() * 10 >= sample.len() * 9 {
        return if sample[0][0] >= NANOSECONDS_FROM {
            Ok(LogFormat::Euroc)
        } else if table.separator == Separator::Space {
            Ok(LogFormat::Tum)
        } else {
            Err(ambiguous("tum (qx qy qz qw) and euroc (qw qx qy qz)"))
        };
    }
    if columns != 4 && columns != 7 {
        return Err(FlightLogError::UnknownLayout { path: path.to_owned(), columns });
    }
    if only_geodetic_fits(&sample) { Ok(LogFormat::CsvLla) } else { Err(ambiguous(metric_candidates(&sample))) }
}

fn can_be_geodetic(sample: &[Vec<f64>]) -> bool {
    // Written so that missing values pass.
    sample.iter().all(|row| row.len() < 4 || !(row[1].abs() > 90.0 || row[2].abs() > 360.0 || row[3] < -1000.0 || row[3] > 1e5))
}

/// Whether the columns can be latitude and longitude and cannot be metres, judged by the upper quartile of their change per second.
///
/// A flight of 0.05 to 333 m/s changes its degrees by 4.5e-7 to 3e-3 a second. Read as metres that would be at most 3 mm/s, which is no flight. A log
/// that moves faster or not at all is not decided.
fn only_geodetic_fits(sample: &[Vec<f64>]) -> bool {
    let mut rates: Vec<f64> = sample
        .windows(2)
        .filter(|pair| pair[0].len() >= 4 && pair[1].len() >= 4)
        .map(|pair| (pair[1][1] - pair[0][1]).hypot(pair[1][2] - pair[0][2]) / (pair[1][0] - pair[0][0]))
        .filter(|rate| rate.is_finite() && *rate >= 0.0)
        .collect();
    rates.sort_by(f64::total_cmp);
    let upper_quartile = rates.get(rates.len() * 3 / 4).copied().unwrap_or(0.0);
    can_be_geodetic(sample) && (4.5e-7..3e-3).contains(&upper_quartile)
}

fn metric_candidates(sample: &[Vec<f64>]) -> &'static str {
    if can_be_geodetic(sample) {
        "csv-lla (degrees), csv-xya (metres, z up) and csv-ned (metres, z down)"
    } else {
        "csv-xya (metres, z up) and csv-ned (metres, z down)"
    }
}

/// KITTI writes twelve columns whose left 3x3 block is a rotation.
fn refuse_pose_matrices(path: &Path, table: &Table<'_>) -> Result<(), FlightLogError> {
    let is_matrix = |row: &Line<'_>| {
        let values: Option<Vec<f64>> = table.fields(row).iter().map(|field| text::number(field)).collect();
        values.is_some_and(|v| {
            let axes: Vec<DVec3> = v.chunks(4).map(|row| DVec3::from_slice(row.get(..3).unwrap_or(&[f64::NAN; 3]))).collect();
            v.len() == 12
                && axes.iter().all(|axis| (axis.length() - 1.0).abs() < 1e-2)
                && (axes[0].cross(axes[1]) - axes[2]).length() < 1e-2
        })
    };
    let (rows, matrices) = table.sample(20).fold((0, 0), |(rows, matrices), row| (rows + 1, matrices + usize::from(is_matrix(row))));
    if rows == matrices { Err(FlightLogError::PoseMatrices { path: path.to_owned() }) } else { Ok(()) }
}
