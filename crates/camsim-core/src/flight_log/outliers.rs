//! Rows that leave the motion of their neighbours and come back at once: GPS spikes, angles interpolated
//! through +-180 by a logger.
//!
//! A block of one to three rows is an outlier if each of its rows deviates from the interpolation between the
//! rows around the block
//! - by more than 12 times the 90th percentile of that deviation over the whole log, and a floor;
//! - by more than 8 times the median deviation of the rows nearby;
//! - and the rows around the block are closer to each other than 0.3 of the deviation.
//!
//! The last condition is what tells a fault from motion: real motion, however violent, does not return within
//! a row. On the FSR2015 log the faults deviate by 9.6 to 134 degrees and the next largest row by 0.46; on
//! hand-held logs (TUM-VI, EuRoC, TUM RGB-D) no deviation above the first threshold meets the third
//! condition.

/// Shorter logs are taken as they are: there is no typical deviation to compare with.
const MIN_ROWS: usize = 8;
const TYPICAL_QUANTILE: f64 = 0.9;
const TYPICAL_FACTOR: f64 = 12.0;
const NEARBY_FACTOR: f64 = 8.0;
const NEIGHBOURS_AGREE: f64 = 0.3;
/// Over longer times, leaving and returning may be a real motion.
const MAX_SINGLE_SPAN_S: f64 = 10.0;
const MAX_BLOCK_SPAN_S: f64 = 0.5;
const MAX_BLOCK: usize = 3;

/// A quantity of consecutive rows to be tested: `deviation(i, a, b, f)` is the distance of row i from the
/// interpolation at fraction f between rows a and b, `distance(a, b)` that of two rows. NaN means unknown and
/// is never flagged.
pub(super) trait OutlierSignal {
    fn deviation(&self, row: usize, before: usize, after: usize, fraction: f64) -> f64;
    fn distance(&self, a: usize, b: usize) -> f64;
}

/// Marks outliers among rows at non-decreasing times `t_s`. `floor` is the least deviation that counts.
pub(super) fn find(t_s: &[f64], channel: &impl OutlierSignal, floor: f64) -> Vec<bool> {
    let count = t_s.len();
    let mut is_outlier = vec![false; count];
    if count < MIN_ROWS {
        return is_outlier;
    }
    let deviation_of = |row: usize, before: usize, after: usize| {
        let span_s = t_s[after] - t_s[before];
        let fraction = if span_s > 0.0 { (t_s[row] - t_s[before]) / span_s } else { 0.5 };
        channel.deviation(row, before, after, fraction)
    };
    let deviations: Vec<f64> = (1..count - 1).map(|row| deviation_of(row, row - 1, row + 1)).collect();
    let threshold = floor.max(TYPICAL_FACTOR * quantile(&deviations, TYPICAL_QUANTILE));
    // The rows next to a fault deviate as well, so the nearest ones do not count in the median.
    let nearby_median = |first: usize, last: usize| {
        let range = first.saturating_sub(7)..(last + 6).min(deviations.len());
        let nearby: Vec<f64> = range.filter(|&i| i + 2 < first || i > last).map(|i| deviations[i]).collect();
        quantile(&nearby, 0.5)
    };
    for length in 1..=MAX_BLOCK {
        let max_span_s = if length == 1 { MAX_SINGLE_SPAN_S } else { MAX_BLOCK_SPAN_S };
        let mut first = 1;
        while first + length < count {
            let (before, after) = (first - 1, first + length);
            let block = first..after;
            let untouched = !is_outlier[before..=after].iter().any(|&flag| flag);
            if untouched && t_s[after] - t_s[before] <= max_span_s {
                let deviation =
                    block.clone().map(|row| deviation_of(row, before, after)).fold(f64::INFINITY, nan_min);
                let fault = deviation > threshold
                    && channel.distance(before, after) < NEIGHBOURS_AGREE * deviation
                    && deviation > NEARBY_FACTOR * nearby_median(first, after - 1);
                if fault {
                    is_outlier[block].fill(true);
                }
            }
            first += 1;
        }
    }
    flag_end(t_s, channel, threshold, &mut is_outlier, |i| i);
    flag_end(t_s, channel, threshold, &mut is_outlier, |i| count - 1 - i);
    is_outlier
}

/// The end rows have a single neighbour. A fault there is a step above the threshold and more than 20 times
/// the usual one at the same speed. `from_end` counts rows from that end.
fn flag_end(
    t_s: &[f64],
    channel: &impl OutlierSignal,
    threshold: f64,
    is_outlier: &mut [bool],
    from_end: impl Fn(usize) -> usize,
) {
    let step = |i: usize| channel.distance(from_end(i), from_end(i + 1));
    let step_s = |i: usize| (t_s[from_end(i + 1)] - t_s[from_end(i)]).abs();
    let inner = 1..MIN_ROWS - 1;
    let usual = quantile(&inner.clone().map(step).collect::<Vec<_>>(), 0.5);
    let usual_s = quantile(&inner.map(step_s).collect::<Vec<_>>(), 0.5);
    let pace = if usual_s > 0.0 { (step_s(0) / usual_s).max(1.0) } else { 1.0 };
    if step_s(0) <= MAX_SINGLE_SPAN_S && step(0) > threshold.max(20.0 * usual * pace) {
        is_outlier[from_end(0)] = true;
    }
}

/// The smaller of two numbers; NaN if one is NaN.
fn nan_min(a: f64, b: f64) -> f64 {
    if a.is_nan() || b.is_nan() { f64::NAN } else { a.min(b) }
}

/// Quantile of the values that are numbers; 0 if there are none.
pub(super) fn quantile(values: &[f64], q: f64) -> f64 {
    let mut numbers: Vec<f64> = values.iter().copied().filter(|value| !value.is_nan()).collect();
    if numbers.is_empty() {
        return 0.0;
    }
    let index = ((numbers.len() - 1) as f64 * q).round() as usize;
    *numbers.select_nth_unstable_by(index, f64::total_cmp).1
}
