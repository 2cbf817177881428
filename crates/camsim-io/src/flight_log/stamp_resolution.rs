//! Clocks that are coarser than the rows: several rows share each stamp, though the platform moves on.

use camsim_core::flight_log::Note;

use super::{rows::ParsedRow, time_unit::format_short};
use crate::median::median;

/// Consecutive rows of one stamp: indices of rows.
struct Group {
    time_ns: i128,
    rows: Vec<usize>,
}

/// Spreads rows that share the stamps of a coarse clock over its steps. Times are nanoseconds, in the file's
/// order.
pub(super) fn spread_equal_stamps(mut rows: Vec<ParsedRow>, notes: &mut Vec<Note>) -> Vec<ParsedRow> {
    let groups = groups(&rows);
    let [first, .., last] = &groups[..] else { return rows };
    let steps = || groups.windows(2).map(|pair| pair[1].time_ns - pair[0].time_ns);
    let resolution_ns = steps().min().unwrap_or(0);
    let shared: Vec<&Group> = groups.iter().filter(|group| group.rows.len() > 1).collect();
    let moving = shared.iter().filter(|group| has_motion(&rows, &group.rows)).count();
    if resolution_ns <= 0 || shared.len() * 2 < groups.len() || moving * 2 < shared.len() {
        return rows;
    }
    let mut sizes: Vec<usize> = groups.iter().map(|group| group.rows.len()).collect();
    let usual_size = median(&mut sizes, Ord::cmp).unwrap_or(1);
    let times = at_equal_steps(&groups, resolution_ns).unwrap_or_else(|| {
        let usual_step_ns = resolution_ns / usual_size as i128;
        let mut times = Vec::new();
        for group in &groups {
            let count = group.rows.len() as i128;
            let even_ns = resolution_ns / count;
            let (start_ns, step_ns) = if group.time_ns == first.time_ns {
                // The first step of the clock had begun before the first row.
                let step_ns = even_ns.min(usual_step_ns);
                (resolution_ns - count * step_ns, step_ns)
            } else if group.time_ns == last.time_ns {
                (0, even_ns.min(usual_step_ns))
            } else {
                (0, even_ns)
            };
            times.extend((0..count).map(|index| group.time_ns + start_ns + index * step_ns));
        }
        times
    });
    for (&row, time) in groups.iter().flat_map(|group| &group.rows).zip(times) {
        rows[row].time = Some(time);
    }
    notes.push(Note::warning(format!(
            "the clock of the log counts in steps of {} s, with {usual_size} rows in most: they are spread evenly \
                over each step",
            format_short(resolution_ns as f64 * 1e-9)
        )));
    rows
}

fn groups(rows: &[ParsedRow]) -> Vec<Group> {
    let mut groups: Vec<Group> = Vec::new();
    for (index, row) in rows.iter().enumerate() {
        let Some(time_ns) = row.time.filter(|_| row.has_position() || row.has_attitude()) else { continue };
        match groups.last_mut() {
            Some(group) if group.time_ns == time_ns => group.rows.push(index),
            _ => groups.push(Group { time_ns, rows: vec![index] }),
        }
    }
    groups
}

/// Whether positions or attitudes differ between rows that state them.
fn has_motion(rows: &[ParsedRow], group: &[usize]) -> bool {
    let differ = |states: &dyn Fn(&ParsedRow) -> bool, differ: &dyn Fn(&ParsedRow, &ParsedRow) -> bool| {
        let mut stating = group.iter().map(|&row| &rows[row]).filter(|row| states(row));
        stating.next().is_some_and(|first| stating.any(|row| differ(first, row)))
    };
    differ(&ParsedRow::has_position, &|a, b| a.position != b.position)
        || differ(&ParsedRow::has_attitude, &|a, b| a.attitude[..3] != b.attitude[..3])
}

/// Times at equal steps that fall into the steps of the clock as the rows do; `None` if there are none.
///
/// A step between rows leaves a range of possible times of the first row. The step that leaves the widest one
/// counts; the width is concave in it.
fn at_equal_steps(groups: &[Group], resolution_ns: i128) -> Option<Vec<i128>> {
    let (first, last) = (groups.first()?, groups.last()?);
    let rows: usize = groups.iter().map(|group| group.rows.len()).sum();
    // Stamp, first row and last row of each group.
    let mut begin = 0;
    let spans: Vec<(f64, f64, f64)> = groups
        .iter()
        .map(|group| {
            let from = begin;
            begin += group.rows.len();
            ((group.time_ns - first.time_ns) as f64, from as f64, (begin - 1) as f64)
        })
        .collect();
    let range = |step_ns: f64| {
        spans.iter().fold((f64::NEG_INFINITY, f64::INFINITY), |(low, high), (stamp, from, to)| {
            (low.max(stamp - from * step_ns), high.min(stamp + resolution_ns as f64 - to * step_ns))
        })
    };
    let width = |step_ns: f64| {
        let (low, high) = range(step_ns);
        high - low
    };
    let mean_ns = (last.time_ns - first.time_ns) as f64 / rows as f64;
    let (mut from_ns, mut to_ns) = (0.5 * mean_ns, 2.0 * mean_ns);
    for _ in 0..100 {
        let third_ns = (to_ns - from_ns) / 3.0;
        if width(from_ns + third_ns) < width(to_ns - third_ns) {
            from_ns += third_ns;
        } else {
            to_ns -= third_ns;
        }
    }
    let step_ns = 0.5 * (from_ns + to_ns);
    let (low, high) = range(step_ns);
    let time = |index: usize| first.time_ns + (low + index as f64 * step_ns).round() as i128;
    (low < high).then(|| (0..rows).map(time).collect())
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;

    fn rows(stamps_s: &[i128]) -> Vec<ParsedRow> {
        let row = |(index, time): (usize, &i128)| ParsedRow {
            line: index + 2,
            time: Some(time * 1_000_000_000),
            position: [47.0 + index as f64 * 1e-5, 8.0, 500.0],
            attitude: [f64::NAN; 4],
        };
        stamps_s.iter().enumerate().map(row).collect()
    }

    fn spread(stamps_s: &[i128]) -> Vec<f64> {
        let rows = spread_equal_stamps(rows(stamps_s), &mut Vec::new());
        rows.iter().map(|row| row.time.unwrap() as f64 * 1e-9).collect()
    }

    #[test]
    fn rows_are_spread_over_the_steps_of_the_clock() {
        assert_eq!(spread(&[0, 0, 1, 1, 2, 2]), [0.0, 0.5, 1.0, 1.5, 2.0, 2.5]);
        // A first second that had begun, and a last one that is not over.
        assert_eq!(spread(&[0, 1, 1, 2, 2, 3]), [0.5, 1.0, 1.5, 2.0, 2.5, 3.0]);
        // A second is missing.
        assert_eq!(spread(&[0, 0, 1, 1, 3, 3]), [0.0, 0.5, 1.0, 1.5, 3.0, 3.5]);
        // Equal steps that are no part of a second.
        let times = spread(&[0, 0, 0, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4]);
        assert!(times.windows(2).all(|pair| (pair[1] - pair[0] - 0.4).abs() < 1e-6), "{times:?}");
        // One pair among many is left to the cleaning.
        assert_eq!(spread(&[0, 1, 1, 2, 3, 4]), [0.0, 1.0, 1.0, 2.0, 3.0, 4.0]);
    }
}
