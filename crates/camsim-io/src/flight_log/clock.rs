//! Clocks that begin again: at midnight, with the week, or where a counter is full.

use camsim_core::flight_log::Note;

use super::rows::Row;

const DAY_NS: i128 = 86_400_000_000_000;
const MINUTE_NS: i128 = 60_000_000_000;

/// After how long a clock begins again, and what that is.
const TURNS: [(i128, &str); 4] = [
    (DAY_NS, "a day: midnight"),
    (7 * DAY_NS, "a week of GPS time"),
    (4_294_967_296_000, "a counter of 32 bits for microseconds"),
    (4_294_967_296_000_000, "a counter of 32 bits for milliseconds"),
];

/// Adds a turn of the clock wherever it begins again. Times are nanoseconds in the file's order. A clock of
/// the day knows only days.
///
/// Rows are merely out of order unless the clock falls by more than half a turn and goes on where the turn
/// ends, within a minute or 20 usual steps.
pub(super) fn unroll(rows: &mut [Row], is_clock_of_day: bool, notes: &mut Vec<Note>) {
    let times: Vec<i128> = rows.iter().filter_map(|row| row.time).collect();
    let (Some(&least), Some(&most)) = (times.iter().min(), times.iter().max()) else { return };
    let mut steps: Vec<i128> =
        times.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0).collect();
    steps.sort_unstable();
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(0);
    let furthest = MINUTE_NS.max(20 * usual);
    let goes_on = |before: i128, after: i128, turn: i128| {
        let step = after + turn - before;
        before - after > turn / 2 && step > 0 && (step <= furthest || is_clock_of_day)
    };
    let turn = TURNS.into_iter().take(if is_clock_of_day { 1 } else { TURNS.len() }).find(|&(turn, _)| {
        least >= 0 && most <= turn && times.windows(2).any(|pair| goes_on(pair[0], pair[1], turn))
    });
    let Some((turn, what)) = turn else { return };
    let (mut turns, mut before, mut lines) = (0, None, Vec::new());
    for row in rows.iter_mut() {
        let Some(time) = row.time else { continue };
        if before.is_some_and(|before| goes_on(before, time, turn)) {
            turns += 1;
            lines.push(row.line.to_string());
        }
        before = Some(time);
        row.time = Some(time + turns * turn);
    }
    lines.truncate(8);
    notes.push(Note {
        is_warning: true,
        text: format!(
            "the clock begins again at line {}, after {what}: the times go on from there",
            lines.join(", ")
        ),
    });
}

/// Fewer rows than this at one end are slips of the clock.
const FEW_ROWS: usize = 3;
/// More falls than this are rows in any order.
const MOST_FALLS: usize = 3;

/// Refuses two flights in one file, which sorting by time would mix.
///
/// # Errors
/// The times fall by more than half of their span, and there are positions on both sides.
pub(super) fn one_flight(rows: &[Row]) -> Result<(), String> {
    let timed: Vec<(i128, usize)> = rows
        .iter()
        .filter(|row| row.has_position())
        .filter_map(|row| row.time.map(|time| (time, row.line)))
        .collect();
    let times = || timed.iter().map(|(time, _)| *time);
    let (Some(least), Some(most)) = (times().min(), times().max()) else { return Ok(()) };
    let falls: Vec<usize> =
        (1..timed.len()).filter(|&row| timed[row - 1].0 - timed[row].0 > (most - least) / 2).collect();
    let is_between = |&&fall: &&usize| fall >= FEW_ROWS && timed.len() - fall >= FEW_ROWS;
    match falls.iter().find(is_between) {
        Some(&fall) if falls.len() <= MOST_FALLS => Err(format!(
            "the times begin again at line {}: if there are several flights in the file, keep one; if it is one, sort its rows by time",
            timed[fall].1
        )),
        _ => Ok(()),
    }
}
