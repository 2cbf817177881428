//! Zeros that stand for a missing value: the fix at latitude 0, longitude 0, and the height 0 that receivers
//! write before their first valid one.
//!
//! A zero may also be true: flights cross the equator and take off from the sea. A true zero has neighbours
//! near it. So a run of zeros is dropped only if it is separated from the good rows on both sides (where
//! there are any) by a jump that no aircraft flies.

use super::{CleaningReport, RawPosition, RawRow, outliers::quantile};
use crate::geodesy::Geodetic;

/// Latitude or longitude of exactly 0 is invalid if the rows around are farther away than this.
const FAR_DEG: f64 = 1.0;
/// Heights closer to 0 than this may be a take-off from there.
const FAR_HEIGHT_M: f64 = 10.0;
/// Largest plausible climb rate.
const CLIMB_M_S: f64 = 20.0;
/// A jump must also exceed the usual step of the log by this factor.
const USUAL_FACTOR: f64 = 10.0;

/// Drops null fixes and null heights from rows in order of time, and counts them.
pub(super) fn drop(rows: &mut Vec<&RawRow>, report: &mut CleaningReport) {
    let is_null_fix = |at: Geodetic| at.lat_deg() == 0.0 || at.lon_deg() == 0.0;
    let fixes = runs(rows, is_null_fix, |null, good, _| {
        let is_far = |zero: f64, other: f64| {
            zero == 0.0 && (other - zero).abs().min(360.0 - (other - zero).abs()) > FAR_DEG
        };
        is_far(null.lat_deg(), good.lat_deg()) || is_far(null.lon_deg(), good.lon_deg())
    });
    take(rows, &fixes, |line| report.null_fixes.add(line));

    let heights: Vec<f64> = rows.iter().filter_map(|row| geodetic(row)).map(|at| at.height_m).collect();
    let steps: Vec<f64> = heights
        .windows(2)
        .filter(|pair| pair[0] != 0.0 && pair[1] != 0.0)
        .map(|pair| (pair[1] - pair[0]).abs())
        .collect();
    let floor_m = FAR_HEIGHT_M.max(USUAL_FACTOR * quantile(&steps, 0.9));
    let nulls = runs(
        rows,
        |at| at.height_m == 0.0,
        |_, good, step_s| good.height_m.abs() > floor_m && good.height_m.abs() > CLIMB_M_S * step_s,
    );
    take(rows, &nulls, |line| report.null_heights.add(line));
}

/// Marks runs of null rows that are away from the good rows at both ends. `is_away` receives a row of the
/// run, the good row beside it and their distance in time.
fn runs(
    rows: &[&RawRow],
    is_null: impl Fn(Geodetic) -> bool,
    is_away: impl Fn(Geodetic, Geodetic, f64) -> bool,
) -> Vec<bool> {
    let null_at = |row: usize| geodetic(rows[row]).is_some_and(&is_null);
    let is_far = |null: usize, good: usize| match (geodetic(rows[null]), geodetic(rows[good])) {
        (Some(at), Some(beside)) => is_away(at, beside, step_s(rows[null], rows[good])),
        _ => false,
    };
    let mut marks = vec![false; rows.len()];
    let mut first = 0;
    while first < rows.len() {
        if !null_at(first) {
            first += 1;
            continue;
        }
        let end = (first..rows.len()).find(|&row| !null_at(row)).unwrap_or(rows.len());
        let before = first.checked_sub(1);
        let after = (end < rows.len()).then_some(end);
        let is_alone = before.is_none() && after.is_none();
        if !is_alone
            && before.is_none_or(|good| is_far(first, good))
            && after.is_none_or(|good| is_far(end - 1, good))
        {
            marks[first..end].fill(true);
        }
        first = end;
    }
    marks
}

fn take(rows: &mut Vec<&RawRow>, marks: &[bool], mut count: impl FnMut(usize)) {
    let mut marks = marks.iter();
    rows.retain(|row| {
        let is_null = marks.next().copied().unwrap_or(false);
        if is_null {
            count(row.line);
        }
        !is_null
    });
}

fn geodetic(row: &RawRow) -> Option<Geodetic> {
    match row.position {
        RawPosition::Geodetic(at) => Some(at),
        RawPosition::Ned(_) => None,
    }
}

fn step_s(a: &RawRow, b: &RawRow) -> f64 {
    let [a, b] = [a, b].map(|row| i128::from(row.t_ns.unwrap_or_default()));
    (a - b).abs() as f64 * 1e-9
}
