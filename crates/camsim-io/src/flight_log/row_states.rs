//! Columns without a known meaning that number receivers, and states that change where positions jump.

use std::collections::BTreeMap;

use camsim_core::flight_log::Note;

use super::{
    column_meaning::FixCode,
    columns::Frame,
    layout::TableLayout,
    row_selection::{MAX_RECEIVERS, MIN_ROWS, lowest, receivers_note},
    rows::{ParsedRow, ParsedRows},
    text_table::{Table, is_missing},
};

/// The path through all rows over the sum of the paths of each receiver, from which on they are several. Parts of
/// one flight give 1 at most.
const MIN_ZIGZAG: f64 = 1.5;
/// Steps as often longer than those before and after them are jumps.
const JUMP_FACTOR: f64 = 10.0;

/// Table and rows of one receiver where a column tells interleaved tracks apart, else all.
pub(super) fn one_track<'a>(
    table: Table<'a>,
    layout: &TableLayout,
    mut parsed: ParsedRows,
    notes: &mut Vec<Note>,
) -> (Table<'a>, ParsedRows) {
    let located = located(&parsed.rows);
    let Some((column, counts)) = receiver_column(&table, layout, &parsed.rows, &located) else {
        return (table, parsed);
    };
    let first = lowest(&counts);
    let mut keeps = vec![true; parsed.rows.len()];
    for row in located {
        let name = table.field(&table.rows[row], column);
        keeps[row] = is_missing(name) || name == first;
    }
    notes.push(receivers_note(layout, column, &counts, &format!("those of `{first}` count"), &keeps));
    let mut is_kept = keeps.iter();
    parsed.rows.retain(|_| is_kept.next() != Some(&false));
    (table.with_rows_kept(&keeps), parsed)
}

/// Indices of the rows with a position.
fn located(rows: &[ParsedRow]) -> Vec<usize> {
    (0..rows.len()).filter(|&row| rows[row].has_position()).collect()
}

/// The track of one value of a column.
#[derive(Clone, Copy, Debug)]
struct Track {
    rows: usize,
    last: [f64; 3],
    length: f64,
}

/// The tracks of the values of a column, and how often the value changes.
#[derive(Clone, Debug, Default)]
struct Tracks<'a> {
    by_value: BTreeMap<&'a str, Track>,
    last: &'a str,
    changes: usize,
}

/// The column that tells interleaved tracks apart best, with the rows of each of its values.
fn receiver_column<'a>(
    table: &Table<'a>,
    layout: &TableLayout,
    rows: &[ParsedRow],
    located: &[usize],
) -> Option<(usize, BTreeMap<&'a str, usize>)> {
    let used = used_columns(layout);
    let mut columns: Vec<Option<Tracks<'_>>> =
        (0..table.columns).map(|column| (!used.contains(&column)).then(Tracks::default)).collect();
    let mut fields = Vec::new();
    let mut length = 0.0;
    let mut before: Option<[f64; 3]> = None;
    for &row in located {
        if columns.iter().all(Option::is_none) {
            return None;
        }
        let position = rows[row].position;
        length += before.map_or(0.0, |before| distance(layout.frame, before, position));
        before = Some(position);
        table.separator.split(table.rows[row].text, &mut fields);
        for (column, tracks) in columns.iter_mut().enumerate() {
            let Some(tracks_of) = tracks else { continue };
            let Some(value) = fields.get(column).copied().filter(|value| !is_missing(value)) else {
                continue;
            };
            tracks_of.changes += usize::from(value != tracks_of.last);
            tracks_of.last = value;
            let track =
                tracks_of.by_value.entry(value).or_insert(Track { rows: 0, last: position, length: 0.0 });
            track.length += distance(layout.frame, track.last, position);
            (track.last, track.rows) = (position, track.rows + 1);
            if tracks_of.by_value.len() > MAX_RECEIVERS {
                *tracks = None;
            }
        }
    }
    let zigzag = |tracks: &Tracks<'_>| {
        let apart: f64 = tracks.by_value.values().map(|track| track.length).sum();
        let is_interleaved = tracks.by_value.len() > 1
            && tracks.by_value.values().all(|track| track.rows >= MIN_ROWS)
            && tracks.changes * 10 >= located.len();
        if is_interleaved && length > 0.0 { length / apart } else { 0.0 }
    };
    let candidates = columns.iter().enumerate().filter_map(|(column, tracks)| {
        let tracks = tracks.as_ref()?;
        let zigzag = zigzag(tracks);
        (zigzag > MIN_ZIGZAG).then_some((zigzag, column, tracks))
    });
    let (_, column, tracks) = candidates.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)))?;
    let counts = tracks.by_value.iter().map(|(value, track)| (*value, track.rows)).collect();
    Some((column, counts))
}

/// Columns whose meaning is known.
fn used_columns(layout: &TableLayout) -> Vec<usize> {
    let mut used: Vec<usize> = layout.position.iter().map(|source| source.column).collect();
    used.extend(layout.attitude.columns());
    used.push(layout.time.column);
    used.extend(layout.time.date.into_iter().chain(layout.time.nanoseconds).chain(layout.in_use));
    used.extend(layout.fixes.iter().map(|(column, _)| *column));
    used
}

/// Distance in the units of the rows; that of geodetic positions without heights, whose unit is another.
fn distance(frame: Frame, from: [f64; 3], to: [f64; 3]) -> f64 {
    let axes = if frame == Frame::Geodetic { 2 } else { 3 };
    (0..axes).map(|axis| (to[axis] - from[axis]).powi(2)).sum::<f64>().sqrt()
}

/// Warns of states that are not understood, and that change wherever positions jump.
pub(super) fn warn_of_states(
    table: &Table<'_>,
    layout: &TableLayout,
    rows: &[ParsedRow],
    notes: &mut Vec<Note>,
) {
    let is_unknown = |code: FixCode| matches!(code, FixCode::Words | FixCode::Unknown);
    let states: Vec<usize> =
        layout.fixes.iter().filter(|(_, code)| is_unknown(*code)).map(|(column, _)| *column).collect();
    if states.is_empty() {
        return;
    }
    let located = located(rows);
    let step = |pair: &[usize]| distance(layout.frame, rows[pair[0]].position, rows[pair[1]].position);
    let steps: Vec<f64> = located.windows(2).map(step).collect();
    let is_jump = |index: usize| {
        let beside = [index.checked_sub(1), Some(index + 1)];
        let longest =
            beside.iter().flatten().filter_map(|&other| steps.get(other)).fold(0.0, |a, b| b.max(a));
        longest > 0.0 && steps[index] > JUMP_FACTOR * longest
    };
    let jumps: Vec<usize> = (0..steps.len()).filter(|&index| is_jump(index)).collect();
    let Some(&first_jump) = jumps.first() else { return };
    for column in states {
        let field = |row: usize| table.field(&table.rows[row], column);
        let changes: Vec<bool> = located.windows(2).map(|pair| field(pair[0]) != field(pair[1])).collect();
        let is_rare = changes.iter().filter(|changes| **changes).count() * 4 <= changes.len();
        if is_rare && jumps.iter().all(|&jump| changes[jump]) {
            let (before, after) = (located[first_jump], located[first_jump + 1]);
            notes.push(Note::warning(format!(
                "{} is not read, but the position jumps as it changes from `{}` to `{}` (line {}): \
                        remove the rows whose state means no position",
                layout.describe(column),
                field(before),
                field(after),
                table.rows[after].number
            )));
        }
    }
}
