//! Detection of the format of a table without a header, from its values.

use camsim_core::scenario::{FlightSpec, LogFormat};
use glam::DVec3;

use super::{
    error::LogProblem,
    text_table::{Line, Separator, Table},
    time_fields,
    time_unit::unit_of_key,
};

/// Rows that are sampled.
const SAMPLE_ROWS: usize = 500;
/// Times at or above this number are nanoseconds: as seconds they would be 3 million years.
const MIN_NANOSECONDS: f64 = 1e14;

/// The format of a table without a header.
///
/// # Errors
/// No format fits, or several do.
pub(super) fn detect_format(table: &Table<'_>, spec: &FlightSpec) -> Result<LogFormat, LogProblem> {
    let time_factor = unit_of_key(spec.time_unit).map_or(1.0, |unit| unit.factor * 1e-9);
    let value = |index: usize, field: &str| match table.number(field) {
        Some(value) if index == 0 => value * time_factor,
        Some(value) => value,
        None => time_fields::date_time_ns(field)
            .or_else(|| time_fields::clock_ns(field))
            .map_or(f64::NAN, |ns| ns as f64 * 1e-9),
    };
    let sample: Vec<Vec<f64>> = table
        .sample(SAMPLE_ROWS)
        .map(|row| table.fields(row).iter().enumerate().map(|(index, field)| value(index, field)).collect())
        .collect();
    if (table.columns >= 8 && has_quaternions(&sample)) || (table.columns == 8 && lacks_quaternions(&sample))
    {
        let first_time = table.column(0).next().and_then(|field| table.number(field));
        // TUM files have seconds and blanks, EuRoC files nanoseconds and commas. With any other combination
        // the order of the quaternion is unknown.
        return match (first_time.is_some_and(|time| time >= MIN_NANOSECONDS), table.separator) {
            (true, Separator::Comma) => Ok(LogFormat::Euroc),
            (false, Separator::Space) => Ok(LogFormat::Tum),
            _ => Err(LogProblem::Ambiguous("tum (qx qy qz qw) and euroc (qw qx qy qz)")),
        };
    }
    if table.columns != 4 && table.columns != 7 {
        return Err(LogProblem::UnknownLayout(table.columns));
    }
    if only_geodetic_fits(&sample) {
        Ok(LogFormat::CsvLla)
    } else {
        Err(LogProblem::Ambiguous(metric_candidates(&sample)))
    }
}

/// Whether columns 4 to 7 (from 0) are quaternions: of those that are not 0, nine in ten have norm 1, or they
/// change and have one common norm.
fn has_quaternions(sample: &[Vec<f64>]) -> bool {
    let quaternions: Vec<&[f64]> = sample.iter().filter_map(|row| row.get(4..8)).collect();
    let norms: Vec<f64> = quaternions
        .iter()
        .map(|q| q.iter().map(|q| q * q).sum::<f64>().sqrt())
        .filter(|norm| *norm > 0.0)
        .collect();
    let most_near = |norm: f64, tolerance: f64| {
        norms.iter().filter(|other| (*other / norm - 1.0).abs() < tolerance).count() * 10 >= norms.len() * 9
            && !norms.is_empty()
    };
    let changes = || quaternions.windows(2).any(|pair| pair[0] != pair[1]);
    most_near(1.0, 0.01) || norms.first().is_some_and(|&first| most_near(first, 1e-4) && changes())
}

/// Whether columns 4 to 7 (from 0) are zeros or missing throughout, as of a position without an attitude.
fn lacks_quaternions(sample: &[Vec<f64>]) -> bool {
    let is_unknown = |row: &Vec<f64>| {
        row.get(4..8).is_some_and(|q| q.iter().all(|q| *q == 0.0) || q.iter().all(|q| q.is_nan()))
    };
    sample.iter().all(is_unknown)
}

fn can_be_geodetic(sample: &[Vec<f64>]) -> bool {
    // Comparisons with NaN are false, so missing values pass.
    sample.iter().all(|row| {
        row.len() < 4 || !(row[1].abs() > 90.0 || row[2].abs() > 360.0 || row[3] < -1000.0 || row[3] > 1e5)
    })
}

/// Whether the columns can be latitude and longitude and cannot be metres, by the upper quartile of their
/// change per second.
///
/// At 0.05 to 333 m/s latitude and longitude change by 4.5e-7 to 3e-3 degrees per second. Read as metres that
/// is at most 3 mm/s, slower than any flight. A log that moves faster, or not at all, stays undecided.
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

/// Refuses KITTI poses: twelve columns, whose left 3x3 block is a rotation matrix.
pub(super) fn refuse_pose_matrices(table: &Table<'_>) -> Result<(), LogProblem> {
    let is_matrix = |row: &Line<'_>| {
        let values: Option<Vec<f64>> = table.fields(row).iter().map(|field| table.number(field)).collect();
        values.is_some_and(|v| {
            let axes: Vec<DVec3> =
                v.chunks(4).map(|row| DVec3::from_slice(row.get(..3).unwrap_or(&[f64::NAN; 3]))).collect();
            v.len() == 12
                && axes.iter().all(|axis| (axis.length() - 1.0).abs() < 1e-2)
                && (axes[0].cross(axes[1]) - axes[2]).length() < 1e-2
        })
    };
    let (rows, matrices) = table
        .sample(20)
        .fold((0, 0), |(rows, matrices), row| (rows + 1, matrices + usize::from(is_matrix(row))));
    if rows == matrices { Err(LogProblem::PoseMatrices) } else { Ok(()) }
}
