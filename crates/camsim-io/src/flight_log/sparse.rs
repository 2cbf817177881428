//! Tables merged from streams of several rates, in which no row has everything.
//!
//! Each quantity is interpolated linearly over time between the rows that state it: height where only
//! latitude and longitude are, then the position where only an attitude is. Rows outside of what is known are
//! left as they are, and dropped by the cleaning. Attitudes are interpolated there too, as rotations. So no
//! row that states something is lost.

use camsim_core::flight_log::Note;

use super::rows::Row;

/// Fills positions of a sparse table. Times are nanoseconds.
pub(super) fn fill(rows: &mut Vec<Row>, reads_attitude: bool, notes: &mut Vec<Note>) {
    let has_plane =
        |row: &Row| row.time.is_some() && row.position[0].is_finite() && row.position[1].is_finite();
    let has_height = |row: &Row| row.time.is_some() && row.position[2].is_finite();
    let count = |rows: &[Row], has: &dyn Fn(&Row) -> bool| rows.iter().filter(|row| has(row)).count();
    let mut filled = Vec::new();

    let (planes, heights) = (count(rows, &has_plane), count(rows, &has_height));
    let both = count(rows, &|row| has_plane(row) && has_height(row));
    if planes > 0 && heights > 1 && both * 2 < planes {
        interpolate(rows, 2..3, &has_height, &|row: &Row| has_plane(row) && !has_height(row));
        filled.push("heights");
    }
    let has_position = |row: &Row| row.time.is_some() && row.has_position();
    let has_attitude = |row: &Row| row.time.is_some() && row.states_attitude();
    let attitudes = count(rows, &has_attitude);
    let lone_attitudes = count(rows, &|row| has_attitude(row) && !has_position(row));
    let positions = count(rows, &has_position);
    if reads_attitude && positions > 1 && lone_attitudes * 2 > attitudes {
        interpolate(rows, 0..3, &has_position, &|row: &Row| has_attitude(row) && !has_position(row));
        filled.push("positions");
    }
    let states_nothing = |row: &Row| !has_position(row) && !row.states_attitude();
    let empty = count(rows, &states_nothing);
    if empty * 3 > rows.len() && empty < rows.len() {
        rows.retain(|row| !states_nothing(row));
        let text = format!(
            "{empty} rows state neither a whole position nor an attitude, as in tables merged from several streams, and are left out"
        );
        notes.push(Note { is_warning: false, text });
    }
    if !filled.is_empty() {
        notes.push(Note {
            is_warning: true,
            text: format!(
                "no row states everything: {} are interpolated between the rows that state them ({positions} with a position, {attitudes} with an attitude)",
                filled.join(" and ")
            ),
        });
    }
}

fn interpolate(
    rows: &mut [Row],
    axes: std::ops::Range<usize>,
    is_known: &dyn Fn(&Row) -> bool,
    is_wanted: &dyn Fn(&Row) -> bool,
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
                    a.1[axis] + (b.1[axis] - a.1[axis]) * fraction
                }
                (None, None) => f64::NAN,
            };
        }
    }
}
