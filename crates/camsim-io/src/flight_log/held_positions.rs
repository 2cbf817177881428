//! Positions of a slow receiver in the rows of a faster table, held until the next one.

use std::collections::HashSet;

use camsim_core::flight_log::Note;

use super::{rows::ParsedRow, sparse_rows, time_unit::format_short};
use crate::median::median;

/// With fewer steps of the position than this it is not known whether they are regular.
const MIN_RUNS: usize = 6;
/// Receivers state at least about one position a second; a platform may stand still for longer.
const MAX_PERIOD_NS: i128 = 1_100_000_000;

/// Interpolates positions that stay the same for a regular number of rows, between the rows where they
/// change. A platform that stands still keeps its rows.
pub(super) fn interpolated(
    mut rows: Vec<ParsedRow>,
    is_geodetic: bool,
    notes: &mut Vec<Note>,
) -> Vec<ParsedRow> {
    let timed: Vec<usize> =
        (0..rows.len()).filter(|&row| rows[row].time.is_some() && rows[row].has_position()).collect();
    let runs = runs(&rows, &timed);
    let Some(period) = regular_length(&runs) else { return rows };
    let time = |row: usize| rows[timed[row]].time.unwrap_or_default();
    let is_sorted = (1..timed.len()).all(|row| time(row - 1) < time(row));
    let mut steps_ns: Vec<i128> = runs.windows(2).map(|pair| time(pair[1].0) - time(pair[0].0)).collect();
    let period_ns = median(&mut steps_ns, Ord::cmp).unwrap_or(0);
    if !is_sorted || period_ns > MAX_PERIOD_NS || !attitudes_change(&rows, &timed, &runs) {
        return rows;
    }
    let is_held = |&(start, length): &(usize, usize)| {
        let heights = timed[start..start + length].iter().map(|&row| rows[row].position[2]);
        heights.clone().all(|height| height == rows[timed[start]].position[2])
    };
    let axes =
        if runs.iter().filter(|run| is_held(run)).count() * 10 >= runs.len() * 9 { 0..3 } else { 0..2 };
    let known: HashSet<usize> = changes(&runs, period).into_iter().map(|row| rows[timed[row]].line).collect();
    let held: HashSet<usize> =
        timed.iter().map(|&row| rows[row].line).filter(|line| !known.contains(line)).collect();
    sparse_rows::interpolate(
        &mut rows,
        axes,
        is_geodetic,
        &|row: &ParsedRow| known.contains(&row.line),
        &|row: &ParsedRow| held.contains(&row.line),
    );
    // Before the first and behind the last change it is not known where the platform was.
    let before = rows.len();
    rows.retain(|row| !held.contains(&row.line) || row.has_position());
    let left_out = before - rows.len();
    let mut text = format!(
        "the positions change once in {period} rows only, each {} s, as those of a slower receiver do: they are \
            interpolated between the changes",
        format_short(period_ns as f64 * 1e-9)
    );
    if left_out > 0 {
        text += &format!(", and {left_out} rows beyond the first or last change are skipped");
    }
    notes.push(Note::warning(text));
    rows
}

/// Runs of equal horizontal positions: start and length, in `timed`.
fn runs(rows: &[ParsedRow], timed: &[usize]) -> Vec<(usize, usize)> {
    let plane = |row: usize| [rows[timed[row]].position[0], rows[timed[row]].position[1]];
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for row in 0..timed.len() {
        match runs.last_mut() {
            Some((start, length)) if plane(*start) == plane(row) => *length += 1,
            _ => runs.push((row, 1)),
        }
    }
    runs
}

/// The usual length of the runs, if most have it and it is more than one row.
fn regular_length(runs: &[(usize, usize)]) -> Option<usize> {
    let [_, inner @ .., _] = runs else { return None };
    let mut lengths: Vec<usize> = inner.iter().map(|(_, length)| *length).collect();
    let usual = median(&mut lengths, Ord::cmp).filter(|&usual| usual > 1 && runs.len() >= MIN_RUNS)?;
    let regular =
        lengths.iter().filter(|length| length.abs_diff(usual) <= (usual / 3).min(usual - 1).max(1)).count();
    (regular * 10 >= lengths.len() * 9).then_some(usual)
}

/// Whether the attitude goes on while the position is held, if there is one: a platform that stops at each
/// position may hold both.
fn attitudes_change(rows: &[ParsedRow], timed: &[usize], runs: &[(usize, usize)]) -> bool {
    let has_attitude = timed.iter().any(|&row| rows[row].has_attitude());
    let changes = |&&(start, length): &&(usize, usize)| {
        timed[start..start + length].windows(2).any(|pair| rows[pair[0]].attitude != rows[pair[1]].attitude)
    };
    !has_attitude || runs.iter().filter(changes).count() * 2 > runs.len()
}

/// The rows where a position is new: the first of each run, and, as the receiver stated the same position again,
/// each `period` rows further. The first run may have begun before the log: it counts from its end.
fn changes(runs: &[(usize, usize)], period: usize) -> Vec<usize> {
    let mut changes = Vec::new();
    for (index, &(start, length)) in runs.iter().enumerate() {
        // A run that is a little longer than usual holds one position.
        let positions = ((length + period / 2) / period).max(1);
        if index > 0 || length >= period {
            let offset = if index == 0 { length.saturating_sub(positions * period) } else { 0 };
            changes.extend((0..positions).map(|position| start + offset + position * period));
        }
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(norths: impl Iterator<Item = usize>) -> Vec<ParsedRow> {
        let row = |(index, north): (usize, usize)| ParsedRow {
            line: index + 2,
            time: Some(index as i128 * 20_000_000),
            position: [north as f64, 0.0, 0.0],
            attitude: [0.1 * index as f64, 0.0, 60.0, f64::NAN],
        };
        norths.enumerate().map(row).collect()
    }

    fn interpolated(norths: impl Iterator<Item = usize>) -> (Vec<f64>, usize) {
        let mut notes = Vec::new();
        let rows = super::interpolated(rows(norths), false, &mut notes);
        (rows.iter().map(|row| row.position[0]).collect(), notes.len())
    }

    #[test]
    fn held_positions_are_interpolated_between_their_changes() {
        let (norths, notes) = interpolated((0..100).map(|row| row / 10 * 10));
        assert_eq!((norths.len(), notes), (91, 1));
        assert!(
            norths.iter().enumerate().all(|(row, north)| (north - row as f64).abs() < 1e-9),
            "{norths:?}"
        );
        // The log begins three rows before a change.
        let (norths, _) = interpolated((7..100).map(|row| row / 10 * 10));
        assert!(
            norths.iter().enumerate().all(|(row, north)| (north - (row + 10) as f64).abs() < 1e-9),
            "{norths:?}"
        );
        // Between its moves the platform stands still for 30 rows.
        let (norths, _) = interpolated(
            (0..200).map(|row| if row < 100 { row / 10 * 10 } else { 90 + (row.max(130) - 130) / 10 * 10 }),
        );
        assert!(norths[95..=125].iter().all(|north| (north - 90.0).abs() < 1.0), "{norths:?}");
    }

    #[test]
    fn other_positions_stay_as_they_are() {
        for (what, norths) in [
            ("new in each row", (0..100).collect::<Vec<usize>>()),
            ("at rest", vec![5; 100]),
            ("irregular", (0..100).map(|row| row * row / 700).collect()),
        ] {
            let (after, notes) = interpolated(norths.iter().copied());
            assert_eq!((after, notes), (norths.iter().map(|north| *north as f64).collect(), 0), "{what}");
        }
    }
}
