//! Clock rollover: times that restart at midnight, at the end of the GPS week, or where a 32-bit counter
//! overflows.

use camsim_core::flight_log::Note;

use super::{
    rows::ParsedRow,
    time_fields::{Clock, TimeFormat},
};
use crate::median::median;

const DAY_NS: i128 = 86_400_000_000_000;
const MINUTE_NS: i128 = 60_000_000_000;

/// Periods after which a clock rolls over, in nanoseconds, with their names in messages.
const ROLLOVER_PERIODS: [(i128, &str); 4] = [
    (DAY_NS, "a day: midnight"),
    (7 * DAY_NS, "a week of GPS time"),
    (4_294_967_296_000, "a counter of 32 bits for microseconds"),
    (4_294_967_296_000_000, "a counter of 32 bits for milliseconds"),
];

/// Times that go on where the clock restarts, in the weeks of which they are, without those of a clock that is
/// not set yet.
///
/// # Errors
/// There are several flights, or years between the rows.
pub(super) fn continuous(
    mut rows: Vec<ParsedRow>,
    clock: Clock,
    week: Option<f64>,
    notes: &mut Vec<Note>,
) -> Result<Vec<ParsedRow>, String> {
    if clock.format != TimeFormat::DateTime && !clock.has_dates {
        unroll_rollovers(&mut rows, clock.format == TimeFormat::Clock, notes);
    }
    if let Some(week) = week.filter(|_| clock.format == TimeFormat::Number) {
        add_week(&mut rows, week, notes);
    }
    leave_out_unset_clock(&mut rows, notes)?;
    check_single_flight(&rows)?;
    Ok(rows)
}

/// Adds one rollover period wherever the clock restarts. Times are nanoseconds in the file's order. A clock
/// time of day (`is_clock_of_day`) rolls over at midnight only.
///
/// A rollover is a fall by more than half a period, to a time that continues the clock within one minute or
/// 20 median steps. Other falls are rows out of order, which are sorted later.
fn unroll_rollovers(rows: &mut [ParsedRow], is_clock_of_day: bool, notes: &mut Vec<Note>) {
    let times_ns: Vec<i128> = rows.iter().filter_map(|row| row.time).collect();
    let (Some(&min_ns), Some(&max_ns)) = (times_ns.iter().min(), times_ns.iter().max()) else { return };
    let mut steps_ns: Vec<i128> =
        times_ns.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0).collect();
    let median_step_ns = median(&mut steps_ns, Ord::cmp).unwrap_or(0);
    let max_step_ns = MINUTE_NS.max(20 * median_step_ns);
    let rolls_over = |before_ns: i128, after_ns: i128, period_ns: i128| {
        let step_ns = after_ns + period_ns - before_ns;
        before_ns - after_ns > period_ns / 2 && step_ns > 0 && (step_ns <= max_step_ns || is_clock_of_day)
    };
    let candidates = if is_clock_of_day { 1 } else { ROLLOVER_PERIODS.len() };
    let period = ROLLOVER_PERIODS.into_iter().take(candidates).find(|&(period_ns, _)| {
        min_ns >= 0
            && max_ns <= period_ns
            && times_ns.windows(2).any(|pair| rolls_over(pair[0], pair[1], period_ns))
    });
    let Some((period_ns, period_name)) = period else { return };
    let (mut rollovers, mut before_ns, mut lines) = (0, None, Vec::new());
    for row in rows.iter_mut() {
        let Some(time_ns) = row.time else { continue };
        if before_ns.is_some_and(|before_ns| rolls_over(before_ns, time_ns, period_ns)) {
            rollovers += 1;
            lines.push(row.line.to_string());
        }
        before_ns = Some(time_ns);
        row.time = Some(time_ns + rollovers * period_ns);
    }
    lines.truncate(8);
    notes.push(Note::warning(format!(
        "the clock begins again at line {}, after {period_name}: the times go on from there",
        lines.join(", ")
    )));
}

/// The beginning of the first GPS week, 1980-01-06.
const FIRST_WEEK_NS: i128 = 315_964_800_000_000_000;
/// GPS weeks of this century, to 2100.
const WEEKS: std::ops::Range<f64> = 1000.0..6300.0;

/// Adds the week of the first row to seconds of the week, which go on at its end already.
fn add_week(rows: &mut [ParsedRow], week: f64, notes: &mut Vec<Note>) {
    let first_ns = rows.iter().find_map(|row| row.time);
    if !WEEKS.contains(&week) || !first_ns.is_some_and(|time| (0..=7 * DAY_NS).contains(&time)) {
        return;
    }
    for time in rows.iter_mut().filter_map(|row| row.time.as_mut()) {
        *time += FIRST_WEEK_NS + week as i128 * 7 * DAY_NS;
    }
    notes
        .push(Note::information(format!("the times count from GPS week {week:.0} on, without leap seconds")));
}

/// The year 2000. Clocks that are not set yet begin in 1970, 1980, 2000 or at the date of their firmware.
const YEAR_2000_NS: i128 = 946_684_800_000_000_000;
/// A year without rows is no pause of a flight.
const YEAR_NS: i128 = 365 * DAY_NS;

/// Leaves out the rows of a clock that was not set yet: those years before the others, if they are fewer.
///
/// # Errors
/// Years lie between the rows, and most of them are before.
fn leave_out_unset_clock(rows: &mut Vec<ParsedRow>, notes: &mut Vec<Note>) -> Result<(), String> {
    let mut times: Vec<(i128, usize)> =
        rows.iter().filter_map(|row| row.time.map(|time| (time, row.line))).collect();
    times.sort_unstable();
    let is_jump = |pair: &[(i128, usize)]| pair[1].0 - pair[0].0 > YEAR_NS && pair[1].0 >= YEAR_2000_NS;
    let Some(last_unset) = times.windows(2).rposition(is_jump) else { return Ok(()) };
    let (unset, set) = (last_unset + 1, times.len() - last_unset - 1);
    let years = (times[unset].0 - times[last_unset].0) as f64 / YEAR_NS as f64;
    if unset > set {
        return if set < MIN_FLIGHT_ROWS { Ok(()) } else { Err(jump_message(times[unset].1, years)) };
    }
    let first_set_ns = times[unset].0;
    rows.retain(|row| row.time.is_none_or(|time| time >= first_set_ns));
    notes.push(Note::warning(format!(
        "{unset} rows have times {years:.0} years before the others, as of a clock that is not set yet, \
                and are skipped"
    )));
    Ok(())
}

fn jump_message(line: usize, years: f64) -> String {
    format!(
        "the times jump by {years:.0} years at line {line}, as when a clock is set: keep the rows before it or \
            those from it on"
    )
}

/// With fewer rows than this before or after it, a fall of the times is an outlier, not a second flight.
const MIN_FLIGHT_ROWS: usize = 3;
/// With more falls than this the rows are unsorted, not several flights.
const MAX_FALLS: usize = 3;

/// Refuses a file with two flights, which sorting by time would interleave.
///
/// # Errors
/// The times fall by more than half of their span, with enough rows that have a position on both sides.
pub(super) fn check_single_flight(rows: &[ParsedRow]) -> Result<(), String> {
    let timed: Vec<(i128, usize)> = rows
        .iter()
        .filter(|row| row.has_position())
        .filter_map(|row| row.time.map(|time| (time, row.line)))
        .collect();
    let times = || timed.iter().map(|(time, _)| *time);
    let (Some(min_ns), Some(max_ns)) = (times().min(), times().max()) else { return Ok(()) };
    let falls: Vec<usize> =
        (1..timed.len()).filter(|&row| timed[row - 1].0 - timed[row].0 > (max_ns - min_ns) / 2).collect();
    let is_between = |&&fall: &&usize| fall >= MIN_FLIGHT_ROWS && timed.len() - fall >= MIN_FLIGHT_ROWS;
    match falls.iter().find(is_between) {
        Some(&fall) if falls.len() <= MAX_FALLS => Err(format!(
            "the times begin again at line {}: if there are several flights in the file, keep one; if it is \
                one, sort its rows by time",
            timed[fall].1
        )),
        _ => Ok(()),
    }
}
