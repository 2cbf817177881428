//! Sparse tables, merged from streams of several rates, in which no row has all quantities.
//!
//! Each quantity is interpolated linearly over time between the rows that have it: first the height of rows
//! with latitude and longitude only, then the position of rows with an attitude only. The later cleaning of
//! the log interpolates attitudes, as rotations, and drops rows outside the time span of a quantity.

use camsim_core::flight_log::Note;

use super::rows::ParsedRow;

/// Interpolates the missing positions of a sparse table. Times are nanoseconds.
pub(super) fn interpolate_positions(
    rows: &mut Vec<ParsedRow>,
    is_geodetic: bool,
    reads_attitude: bool,
    notes: &mut Vec<Note>,
) {
    let has_plane =
        |row: &ParsedRow| row.time.is_some() && row.position[0].is_finite() && row.position[1].is_finite();
    let has_height = |row: &ParsedRow| row.time.is_some() && row.position[2].is_finite();
    let count =
        |rows: &[ParsedRow], has: &dyn Fn(&ParsedRow) -> bool| rows.iter().filter(|row| has(row)).count();
    let mut filled = Vec::new();

    let (planes, heights) = (count(rows, &has_plane), count(rows, &has_height));
    let both = count(rows, &|row| has_plane(row) && has_height(row));
    if planes > 0 && heights > 1 && both * 2 < planes {
        interpolate(rows, 2..3, is_geodetic, &has_height, &|row: &ParsedRow| has_plane(row) && !has_height(row));
        filled.push("heights");
    }
    let has_position = |row: &ParsedRow| row.time.is_some() && row.has_position();
    let has_attitude = |row: &ParsedRow| row.time.is_some() && row.has_attitude();
    let attitudes = count(rows, &has_attitude);
    let lone_attitudes = count(rows, &|row| has_attitude(row) && !has_position(row));
    let positions = count(rows, &has_position);
    if reads_attitude && positions > 1 && lone_attitudes * 2 > attitudes {
        interpolate(rows, 0..3, is_geodetic, &has_position, &|row: &ParsedRow| has_attitude(row) && !has_position(row));
        filled.push("positions");
    }
    let is_empty_row = |row: &ParsedRow| !has_position(row) && !row.has_attitude();
    let empty = count(rows, &is_empty_row);
    if empty * 3 > rows.len() && empty < rows.len() {
        rows.retain(|row| !is_empty_row(row));
        let text = format!(
            "{empty} rows state neither a whole position nor an attitude, as in tables merged from several \
                streams, and are left out"
        );
        notes.push(Note { is_warning: false, text });
    }
    if !filled.is_empty() {
        notes.push(Note {
            is_warning: true,
            text: format!(
                "no row states everything: {} are interpolated between the rows that state them ({positions} \
                    with a position, {attitudes} with an attitude)",
                filled.join(" and ")
            ),
        });
    }
}

/// Interpolates `axes` of the positions of the rows that `is_wanted` selects, between those that `is_known`
/// selects. Outside of their time span the value becomes NaN. Longitudes, of geodetic positions, go the
/// shorter way.
pub(super) fn interpolate(
    rows: &mut [ParsedRow],
    axes: std::ops::Range<usize>,
    is_geodetic: bool,
    is_known: &dyn Fn(&ParsedRow) -> bool,
    is_wanted: &dyn Fn(&ParsedRow) -> bool,
) {
    let mut known: Vec<(i128, [f64; 3])> = rows
        .iter()
        .filter(|row| is_known(row))
        .filter_map(|row| row.time.map(|time| (time, row.position)))
        .collect();
    known.sort_by_key(|(time, _)| *time);
    for row in rows.iter_mut() {
        let Some(time) = row.time.filter(|_| is_wanted(row)) else { continue };
        let after = known.partition_point(|(other, _)| *other < time);
        let exact = known.get(after).filter(|(other, _)| *other == time);
        let pair = after.checked_sub(1).and_then(|before| known.get(before)).zip(known.get(after));
        for axis in axes.clone() {
            row.position[axis] = match (exact, pair) {
                (Some((_, position)), _) => position[axis],
                (None, Some((a, b))) => {
                    let fraction = (time - a.0) as f64 / (b.0 - a.0) as f64;
                    let change = b.1[axis] - a.1[axis];
                    let turns =
                        if is_geodetic && axis == 1 { (change / 360.0).round() * 360.0 } else { 0.0 };
                    a.1[axis] + (change - turns) * fraction
                }
                (None, None) => f64::NAN,
            };
        }
    }
}
