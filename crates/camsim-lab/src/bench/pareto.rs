//! Which rows of a case are worth their time.

use serde::Serialize;

use super::{
    Row,
    knobs::{DEFAULT, Family},
};
use crate::timing::quantile;

/// Times differ if nine tenths of the rounds say so, by this factor: of three rounds, about all.
const SLOWER: f64 = 1.02;
const ROUNDS: f64 = 0.9;
/// Errors differ by this factor, and by more than single precision leaves, px.
const WORSE: f64 = 1.1;
const FLOOR_PX: f64 = 2e-4;
/// Pictures differ from this on, dB.
const WORSE_DB: f64 = 0.1;
/// Beyond this the oracle's own noise shows, dB: better pictures are alike.
const ORACLE_DB: f64 = 55.0;

/// A row that the plan chose, and one that is faster and better.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Violation {
    /// The case.
    pub case: String,
    /// The plan's own row.
    pub row: String,
    /// The row that dominates it.
    pub better: String,
    /// Time of the first over the second, median of the rounds.
    pub time_ratio: f64,
    /// RMS of the source coordinates, first and second, px.
    pub coord_rms_px: [Option<f64>; 2],
    /// 99th percentile away from silhouettes, first and second, px.
    pub smooth_p99_px: [Option<f64>; 2],
    /// PSNR, first and second, dB.
    pub psnr_db: [Option<f64>; 2],
}

/// Marks the rows that no other row of their case and size beats in both time and error: `coord_front` by the
/// RMS of the source coordinates, `image_front` by PSNR. Times are compared within the rounds that two rows
/// have in common.
pub fn mark_fronts(rows: &mut [Row]) {
    let fronts: Vec<[bool; 2]> = rows
        .iter()
        .map(|row| {
            let free = |error: fn(&Row) -> Option<f64>| {
                error(row).is_some_and(|own| {
                    !rows.iter().filter(|other| comparable(row, other) && other.knob != row.knob).any(
                        |other| {
                            let [_, time, _] = other.times.ratio_to(&row.times);
                            time <= 1.0
                                && error(other)
                                    .is_some_and(|error| error < own || (error <= own && time < 1.0))
                        },
                    )
                })
            };
            [free(|row| row.coord_rms_px), free(|row| row.psnr_db.map(|db| -db))]
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

/// How one figure of two rows compares.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Than {
    Better,
    Alike,
    Worse,
}

/// One figure of coordinates than another; alike where one is not known.
fn coords_than(other: Option<f64>, row: Option<f64>) -> Than {
    match (other, row) {
        (Some(other), Some(row)) if row > WORSE * other + FLOOR_PX => Than::Better,
        (Some(other), Some(row)) if other > WORSE * row + FLOOR_PX => Than::Worse,
        _ => Than::Alike,
    }
}

/// The same of the pictures.
fn picture_than(other: &Row, row: &Row) -> Than {
    match (other.psnr_db.map(|db| db.min(ORACLE_DB)), row.psnr_db.map(|db| db.min(ORACLE_DB))) {
        (Some(other), Some(row)) if other > row + WORSE_DB => Than::Better,
        (Some(other), Some(row)) if other < row - WORSE_DB => Than::Worse,
        _ => Than::Alike,
    }
}

/// Whether times over those of another row are clearly above 1.
pub(super) fn is_slower(ratios: &[f64]) -> bool {
    quantile(ratios, 1.0 - ROUNDS) > SLOWER
}

/// Rows chosen by the plan that take clearly more time than another row of the same case for a clearly larger
/// error: of all coordinates (RMS), of those away from silhouettes (99th percentile) or of the picture, and
/// no smaller one of the others. A row that has the plans of one above it is that row.
#[must_use]
pub fn violations(rows: &[Row]) -> Vec<Violation> {
    let rows: Vec<&Row> = rows.iter().filter(|row| row.same_as.is_none()).collect();
    let mut found = Vec::new();
    for row in rows.iter().filter(|row| row.family == Family::Tolerance) {
        for other in rows.iter().filter(|other| comparable(row, other) && other.knob != row.knob) {
            let ratios = row.times.ratios(&other.times);
            // Samples and taps do not move sources: what was not compared is as in the case's default row.
            let default = rows.iter().find(|default| comparable(row, default) && default.knob == DEFAULT);
            let coords = |figure: fn(&Row) -> Option<f64>| {
                coords_than(
                    figure(other).or_else(|| default.and_then(|default| figure(default))),
                    figure(row),
                )
            };
            let than =
                [coords(|row| row.coord_rms_px), coords(|row| row.smooth_p99_px), picture_than(other, row)];
            if is_slower(&ratios) && than.contains(&Than::Better) && !than.contains(&Than::Worse) {
                found.push(Violation {
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
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::rounds::Times;

    fn row(knob: &str, family: Family, wall_ms: [f64; 3], coord_rms_px: f64, psnr_db: f64) -> Row {
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
    fn dominated_rows_are_found_and_noise_is_not() {
        let auto = row("auto", Family::Tolerance, [20.0, 22.0, 21.0], 0.05, 45.0);
        let names = |rows: &[Row]| violations(rows).into_iter().map(|v| v.better).collect::<Vec<_>>();
        let better = row("better", Family::Solver, [10.0, 11.0, 10.0], 0.01, 45.0);
        assert_eq!(names(&[auto.clone(), better.clone()]), ["better"]);
        // One row's time is noise, another's error is larger, a third's picture is worse; a forced row may be
        // as bad as it likes.
        let noisy = row("noisy", Family::Solver, [19.0, 23.0, 21.5], 0.01, 45.0);
        let coarse = row("coarse", Family::Solver, [10.0, 11.0, 10.0], 0.06, 45.0);
        let ugly = row("ugly", Family::Solver, [10.0, 11.0, 10.0], 0.01, 40.0);
        assert!(names(&[auto.clone(), noisy, coarse, ugly]).is_empty());
        assert!(
            names(&[row("forced", Family::Solver, [20.0, 22.0, 21.0], 0.05, 45.0), better.clone()])
                .is_empty()
        );
        let mut larger = better.clone();
        larger.width = 1280;
        assert!(names(&[auto.clone(), larger]).is_empty());
        // Fewer samples for a better picture, coordinates not looked at; and the same plan under another
        // name.
        let sharper =
            Row { coord_rms_px: None, ..row("sharper", Family::Blur, [10.0, 11.0, 10.0], 0.0, 45.5) };
        assert_eq!(names(&[auto.clone(), sharper.clone()]), ["sharper"]);
        // Its coordinates are then those of the default row: worse than those of a row that was asked to be
        // exact.
        let default =
            Row { coord_rms_px: Some(0.05), ..row(DEFAULT, Family::Tolerance, [9.0; 3], 0.05, 45.0) };
        let exact = row("exact", Family::Tolerance, [20.0, 22.0, 21.0], 1e-4, 45.0);
        assert!(names(&[default, exact, sharper.clone()]).is_empty());
        let smoother = Row {
            smooth_p99_px: Some(1e-4),
            ..row("smoother", Family::Solver, [10.0, 11.0, 10.0], 0.05, 45.0)
        };
        assert_eq!(names(&[Row { smooth_p99_px: Some(2e-3), ..auto.clone() }, smoother]), ["smoother"]);
        // From 55 dB on pictures are alike.
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
    fn a_front_has_no_row_that_another_beats() {
        let mut rows = vec![
            row("fast", Family::Solver, [5.0; 3], 1.0, 30.0),
            row("middle", Family::Solver, [10.0; 3], 0.1, 29.0),
            row("beaten", Family::Solver, [12.0; 3], 0.2, 28.0),
            row("exact", Family::Solver, [20.0; 3], 0.001, 50.0),
        ];
        mark_fronts(&mut rows);
        assert_eq!(rows.iter().map(|r| r.coord_front).collect::<Vec<_>>(), [true, true, false, true]);
        assert_eq!(rows.iter().map(|r| r.image_front).collect::<Vec<_>>(), [true, false, false, true]);
    }
}
