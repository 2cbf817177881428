//! Pareto fronts of time and error, and the planner's choices that are not on them.

use serde::Serialize;

use super::{
    Row,
    methods::{DEFAULT_METHOD, MethodFamily},
};
use crate::timing::quantile;

/// A row is slower if its time is larger by this factor ...
const MIN_TIME_RATIO: f64 = 1.02;
/// ... in this fraction of the rounds: of three rounds, in about all.
const SHARE_OF_ROUNDS: f64 = 0.9;
/// Source errors differ if their ratio exceeds this factor ...
const MIN_ERROR_RATIO: f64 = 1.1;
/// ... and their difference exceeds that of single precision, px.
const SINGLE_PRECISION_PX: f64 = 2e-4;
/// Smallest difference of PSNR that counts, dB.
const MIN_DIFFERENCE_DB: f64 = 0.1;
/// PSNR above which the noise of the reference picture dominates, dB: better pictures count as equal.
const REFERENCE_NOISE_DB: f64 = 55.0;

/// A choice of the planner that another method dominates: it is slower and has a larger error.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Violation {
    /// Name of the case.
    pub case: String,
    /// Name of the planner's row.
    pub row: String,
    /// Name of the row that dominates it.
    pub better: String,
    /// Time of the planner's row over that of the other, median of the rounds.
    pub time_ratio: f64,
    /// RMS source error of the planner's row and of the other, px.
    pub coord_rms_px: [Option<f64>; 2],
    /// 99th percentile of the source error away from silhouettes, of both rows, px.
    pub smooth_p99_px: [Option<f64>; 2],
    /// PSNR of both rows, dB.
    pub psnr_db: [Option<f64>; 2],
}

/// Marks the rows on the Pareto fronts of their case and size: `coord_front` by time and RMS source error,
/// `image_front` by time and PSNR. Times are compared within common rounds.
pub fn mark_fronts(rows: &mut [Row]) {
    let fronts: Vec<[bool; 2]> = rows
        .iter()
        .map(|row| {
            let is_on_front = |error: fn(&Row) -> Option<f64>| {
                error(row).is_some_and(|own| {
                    !rows.iter().filter(|other| comparable(row, other) && other.knob != row.knob).any(
                        |other| {
                            let [_, time, _] = other.times.ratio_quartiles(&row.times);
                            time <= 1.0
                                && error(other)
                                    .is_some_and(|error| error < own || (error <= own && time < 1.0))
                        },
                    )
                })
            };
            [is_on_front(|row| row.coord_rms_px), is_on_front(|row| row.psnr_db.map(|db| -db))]
        })
        .collect();
    for (row, [coord, image]) in rows.iter_mut().zip(fronts) {
        row.coord_front = coord;
        row.image_front = image;
    }
}

fn comparable(a: &Row, b: &Row) -> bool {
    a.case == b.case && [a.width, a.height] == [b.width, b.height]
}

/// A figure of one row compared with that of another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Comparison {
    Better,
    Equal,
    Worse,
}

/// Compares source errors; unknown ones count as equal.
fn compare_source_errors(other: Option<f64>, row: Option<f64>) -> Comparison {
    match (other, row) {
        (Some(other), Some(row)) if row > MIN_ERROR_RATIO * other + SINGLE_PRECISION_PX => Comparison::Better,
        (Some(other), Some(row)) if other > MIN_ERROR_RATIO * row + SINGLE_PRECISION_PX => Comparison::Worse,
        _ => Comparison::Equal,
    }
}

/// Compares the PSNR of two rows; unknown ones count as equal.
fn compare_pictures(other: &Row, row: &Row) -> Comparison {
    match (
        other.psnr_db.map(|db| db.min(REFERENCE_NOISE_DB)),
        row.psnr_db.map(|db| db.min(REFERENCE_NOISE_DB)),
    ) {
        (Some(other), Some(row)) if other > row + MIN_DIFFERENCE_DB => Comparison::Better,
        (Some(other), Some(row)) if other < row - MIN_DIFFERENCE_DB => Comparison::Worse,
        _ => Comparison::Equal,
    }
}

/// Whether a row with these ratios to the times of another row is clearly slower.
pub(super) fn is_slower(ratios: &[f64]) -> bool {
    quantile(ratios, 1.0 - SHARE_OF_ROUNDS) > MIN_TIME_RATIO
}

/// The planner's rows that are clearly slower than another row of the same case, with at least one clearly
/// larger error and no smaller one: source error over all pixels (RMS) and away from silhouettes (99th
/// percentile), and picture error. Rows with the plans of a row above them are skipped.
#[must_use]
pub fn violations(rows: &[Row]) -> Vec<Violation> {
    let rows: Vec<&Row> = rows.iter().filter(|row| row.same_as.is_none()).collect();
    let mut violations = Vec::new();
    for row in rows.iter().filter(|row| row.family == MethodFamily::Tolerance) {
        for other in rows.iter().filter(|other| comparable(row, other) && other.knob != row.knob) {
            let ratios = row.times.ratios(&other.times);
            // Samples and taps do not change sources: a figure that was not measured is that of the default
            // row.
            let default =
                rows.iter().find(|default| comparable(row, default) && default.knob == DEFAULT_METHOD);
            let compare = |figure: fn(&Row) -> Option<f64>| {
                compare_source_errors(
                    figure(other).or_else(|| default.and_then(|default| figure(default))),
                    figure(row),
                )
            };
            let errors = [
                compare(|row| row.coord_rms_px),
                compare(|row| row.smooth_p99_px),
                compare_pictures(other, row),
            ];
            if is_slower(&ratios)
                && errors.contains(&Comparison::Better)
                && !errors.contains(&Comparison::Worse)
            {
                violations.push(Violation {
                    case: row.case.clone(),
                    row: row.knob.clone(),
                    better: other.knob.clone(),
                    time_ratio: quantile(&ratios, 0.5),
                    coord_rms_px: [row.coord_rms_px, other.coord_rms_px],
                    smooth_p99_px: [row.smooth_p99_px, other.smooth_p99_px],
                    psnr_db: [row.psnr_db, other.psnr_db],
                });
            }
        }
    }
    violations
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::rounds::Times;

    fn row(knob: &str, family: MethodFamily, wall_ms: [f64; 3], coord_rms_px: f64, psnr_db: f64) -> Row {
        Row {
            knob: knob.into(),
            family,
            ms_per_frame_p50: crate::timing::quantile(&wall_ms, 0.5),
            coord_rms_px: Some(coord_rms_px),
            psnr_db: Some(psnr_db),
            times: Times { wall_ms: wall_ms.to_vec(), ..Times::default() },
            ..Row::empty("case", [640, 480])
        }
    }

    #[test]
    fn dominated_rows_are_found_despite_noise() {
        let auto = row("auto", MethodFamily::Tolerance, [20.0, 22.0, 21.0], 0.05, 45.0);
        let names = |rows: &[Row]| violations(rows).into_iter().map(|v| v.better).collect::<Vec<_>>();
        let better = row("better", MethodFamily::Solver, [10.0, 11.0, 10.0], 0.01, 45.0);
        assert_eq!(names(&[auto.clone(), better.clone()]), ["better"]);
        // No violation: the time differs by noise only, or the other row has a larger error, or a worse
        // picture. Forced rows are never violations.
        let noisy = row("noisy", MethodFamily::Solver, [19.0, 23.0, 21.5], 0.01, 45.0);
        let coarse = row("coarse", MethodFamily::Solver, [10.0, 11.0, 10.0], 0.06, 45.0);
        let ugly = row("ugly", MethodFamily::Solver, [10.0, 11.0, 10.0], 0.01, 40.0);
        assert!(names(&[auto.clone(), noisy, coarse, ugly]).is_empty());
        assert!(
            names(&[row("forced", MethodFamily::Solver, [20.0, 22.0, 21.0], 0.05, 45.0), better.clone()])
                .is_empty()
        );
        let mut larger = better.clone();
        larger.width = 1280;
        assert!(names(&[auto.clone(), larger]).is_empty());
        // Fewer samples with a better picture and unknown source error; and the same plan under another name.
        let sharper =
            Row { coord_rms_px: None, ..row("sharper", MethodFamily::Blur, [10.0, 11.0, 10.0], 0.0, 45.5) };
        assert_eq!(names(&[auto.clone(), sharper.clone()]), ["sharper"]);
        // The source error is then that of the default row, which is larger than the exact row's.
        let default = Row {
            coord_rms_px: Some(0.05),
            ..row(DEFAULT_METHOD, MethodFamily::Tolerance, [9.0; 3], 0.05, 45.0)
        };
        let exact = row("exact", MethodFamily::Tolerance, [20.0, 22.0, 21.0], 1e-4, 45.0);
        assert!(names(&[default, exact, sharper.clone()]).is_empty());
        let smoother = Row {
            smooth_p99_px: Some(1e-4),
            ..row("smoother", MethodFamily::Solver, [10.0, 11.0, 10.0], 0.05, 45.0)
        };
        assert_eq!(names(&[Row { smooth_p99_px: Some(2e-3), ..auto.clone() }, smoother]), ["smoother"]);
        // Pictures above 55 dB count as equal.
        let pictures = |own_db: f64, better_db: f64| {
            names(&[
                Row { coord_rms_px: None, psnr_db: Some(own_db), ..auto.clone() },
                Row { psnr_db: Some(better_db), ..sharper.clone() },
            ])
        };
        assert_eq!(pictures(53.0, 62.0), ["sharper"]);
        assert!(pictures(59.0, 62.0).is_empty());
        let also = Row { knob: "also auto".into(), same_as: Some("auto".into()), ..auto.clone() };
        assert_eq!(names(&[auto, also, sharper]), ["sharper"]);
    }

    #[test]
    fn front_has_no_dominated_row() {
        let mut rows = vec![
            row("fast", MethodFamily::Solver, [5.0; 3], 1.0, 30.0),
            row("middle", MethodFamily::Solver, [10.0; 3], 0.1, 29.0),
            row("beaten", MethodFamily::Solver, [12.0; 3], 0.2, 28.0),
            row("exact", MethodFamily::Solver, [20.0; 3], 0.001, 50.0),
        ];
        mark_fronts(&mut rows);
        assert_eq!(rows.iter().map(|r| r.coord_front).collect::<Vec<_>>(), [true, true, false, true]);
        assert_eq!(rows.iter().map(|r| r.image_front).collect::<Vec<_>>(), [true, false, false, true]);
    }
}
