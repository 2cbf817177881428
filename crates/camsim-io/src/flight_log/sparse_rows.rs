//! Sparse tables, merged from streams of several rates, in which no row has all quantities.
//!
//! Each quantity is interpolated over time between the rows that have it: first the height of rows
//! with latitude and longitude only, then the position of rows with an attitude only. The later cleaning of
//! the log interpolates attitudes, as rotations, and drops rows outside the time span of a quantity.

use std::collections::HashSet;

use camsim_core::flight_log::Note;

use super::{columns::AttitudeKind, rows::ParsedRow};
use crate::median::median;

const SECOND_NS: i128 = 1_000_000_000;

/// Interpolates the missing positions of a sparse table. Times are nanoseconds.
pub(super) fn interpolated(
    mut rows: Vec<ParsedRow>,
    is_geodetic: bool,
    kind: AttitudeKind,
    notes: &mut Vec<Note>,
) -> Vec<ParsedRow> {
    let has_plane =
        |row: &ParsedRow| row.time.is_some() && row.position[0].is_finite() && row.position[1].is_finite();
    let has_height = |row: &ParsedRow| row.time.is_some() && row.position[2].is_finite();
    let count =
        |rows: &[ParsedRow], has: &dyn Fn(&ParsedRow) -> bool| rows.iter().filter(|row| has(row)).count();
    let mut filled = Vec::new();

    let (planes, heights) = (count(&rows, &has_plane), count(&rows, &has_height));
    let both = count(&rows, &|row| has_plane(row) && has_height(row));
    if planes > 0 && heights > 1 && both * 2 < planes {
        interpolate(&mut rows, 2..3, is_geodetic, &has_height, &|row: &ParsedRow| {
            has_plane(row) && !has_height(row)
        });
        filled.push("heights");
    }
    let has_position = |row: &ParsedRow| row.time.is_some() && row.has_position();
    let has_attitude = |row: &ParsedRow| row.time.is_some() && row.has_attitude();
    let attitudes = count(&rows, &has_attitude);
    let lone_attitudes = count(&rows, &|row| has_attitude(row) && !has_position(row));
    let positions = count(&rows, &has_position);
    if kind != AttitudeKind::None && positions > 1 && lone_attitudes * 2 > attitudes {
        interpolate(&mut rows, 0..3, is_geodetic, &has_position, &|row: &ParsedRow| {
            has_attitude(row) && !has_position(row)
        });
        filled.push("positions");
        // A row with a position only says nothing more than one of the same time with both.
        let complete: HashSet<Option<i128>> =
            rows.iter().filter(|row| has_attitude(row) && has_position(row)).map(|row| row.time).collect();
        rows.retain(|row| row.has_attitude() || !complete.contains(&row.time));
    }
    let is_empty_row = |row: &ParsedRow| !has_position(row) && !row.has_attitude();
    let empty = count(&rows, &is_empty_row);
    if empty * 3 > rows.len() && empty < rows.len() {
        rows.retain(|row| !is_empty_row(row));
        let text = format!(
            "{empty} rows state neither a whole position nor an attitude, as in tables merged from several \
                streams, and are skipped"
        );
        notes.push(Note::information(text));
    }
    if !filled.is_empty() {
        notes.push(Note::warning(format!(
            "no row states everything: {} are interpolated between the rows that state them ({positions} \
                    with a position, {attitudes} with an attitude)",
            filled.join(" and ")
        )));
    }
    rows
}

/// Interpolates `axes` of the positions of the rows that `is_wanted` selects, between those that `is_known`
/// selects: by cubics through them, with the slope of the parabola through three at each; by straight lines
/// over gaps. Outside of their time span the value becomes NaN. Longitudes, of geodetic positions, go the
/// shorter way.
pub(super) fn interpolate(
    rows: &mut [ParsedRow],
    axes: std::ops::Range<usize>,
    is_geodetic: bool,
    is_known: &dyn Fn(&ParsedRow) -> bool,
    is_wanted: &dyn Fn(&ParsedRow) -> bool,
) {
    let mut knots: Vec<(i128, [f64; 3])> = rows
        .iter()
        .filter(|row| is_known(row))
        .filter_map(|row| row.time.map(|time| (time, row.position)))
        .collect();
    knots.sort_by_key(|(time, _)| *time);
    knots.dedup_by_key(|(time, _)| *time);
    if is_geodetic {
        unwrap_longitudes(&mut knots);
    }
    let gap_ns = gap_ns(&knots.iter().map(|(time, _)| *time).collect::<Vec<_>>());
    for row in rows.iter_mut() {
        let Some(time) = row.time.filter(|_| is_wanted(row)) else { continue };
        let after = knots.partition_point(|(other, _)| *other < time);
        let exact = knots.get(after).filter(|(other, _)| *other == time);
        for axis in axes.clone() {
            row.position[axis] = match exact {
                Some((_, position)) => position[axis],
                None => cubic(&knots, after, time, axis, gap_ns).unwrap_or(f64::NAN),
            };
        }
    }
}

/// Steps above this are gaps: 1 s, or three usual steps.
pub(super) fn gap_ns(times: &[i128]) -> i128 {
    let mut steps: Vec<i128> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    median(&mut steps, Ord::cmp).map_or(SECOND_NS, |usual| SECOND_NS.max(3 * usual))
}

fn unwrap_longitudes(knots: &mut [(i128, [f64; 3])]) {
    let mut before: Option<f64> = None;
    for (_, position) in knots {
        if let Some(before) = before {
            position[1] -= ((position[1] - before) / 360.0).round() * 360.0;
        }
        before = Some(position[1]);
    }
}

/// The value at a time between the knots `after - 1` and `after`.
fn cubic(knots: &[(i128, [f64; 3])], after: usize, time: i128, axis: usize, gap_ns: i128) -> Option<f64> {
    let before = after.checked_sub(1)?;
    let (a, b) = (knots.get(before)?, knots.get(after)?);
    let span = (b.0 - a.0) as f64;
    let (from, to) = (a.1[axis], b.1[axis]);
    let u = (time - a.0) as f64 / span;
    let slope = |i: usize, j: usize| {
        let (a, b) = (knots.get(i)?, knots.get(j)?);
        (b.0 - a.0 <= gap_ns).then(|| ((b.1[axis] - a.1[axis]) / (b.0 - a.0) as f64, (b.0 - a.0) as f64))
    };
    let Some((here, _)) = slope(before, after) else { return Some(from + (to - from) * u) };
    // Of two neighbouring slopes the one over the shorter step counts more.
    let blend = |(there, width): (f64, f64)| (here * width + there * span) / (width + span);
    let earlier = before.checked_sub(1).and_then(|earlier| slope(earlier, before)).map(blend);
    let later = slope(after, after + 1).map(blend);
    // At an end the parabola of the three knots there goes on.
    let (at_a, at_b) = match (earlier, later) {
        (Some(at_a), Some(at_b)) => (at_a, at_b),
        (None, Some(at_b)) => (2.0 * here - at_b, at_b),
        (Some(at_a), None) => (at_a, 2.0 * here - at_a),
        (None, None) => (here, here),
    };
    let (at_a, at_b) = (at_a * span, at_b * span);
    let change = to - from;
    Some(from + u * (at_a + u * (3.0 * change - 2.0 * at_a - at_b + u * (at_a + at_b - 2.0 * change))))
}
