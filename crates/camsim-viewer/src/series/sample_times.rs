//! At which times a flight is sampled for plots, and how samples are reduced to the points of a line.

use super::POINTS;

/// Samples for each step of a line, at most: every row of a 10 Hz log over ten hours.
const MAX_PER_STEP: u64 = 500;
/// Samples for each step of a line that need a ray to the ground, at most.
const MAX_RAYS_PER_STEP: u64 = 8;

/// Sample times of a span, path time, in order, both ends included.
#[derive(Debug)]
pub struct SampleTimes {
    /// Times of the quick quantities, seconds.
    pub all_s: Vec<f64>,
    /// Number of `all_s` for each step of a line.
    pub per_step: usize,
    /// Times of the quantities that need a ray to the ground, seconds.
    pub ground_s: Vec<f64>,
    /// Number of `ground_s` for each step of a line.
    pub ground_per_step: usize,
}

impl SampleTimes {
    /// For a span that has `rows` rows of the log. With `marked_s`, these times are included, and each step
    /// has one sample.
    pub fn new(span_s: [f64; 2], rows: usize, marked_s: &[f64]) -> Self {
        if marked_s.is_empty() {
            let per_step = (rows as u64 / POINTS + 1).min(MAX_PER_STEP);
            let rays = per_step.min(MAX_RAYS_PER_STEP);
            let [all_s, ground_s] = [per_step, rays].map(|count| linspace(span_s, POINTS * count).collect());
            return Self { all_s, per_step: per_step as usize, ground_s, ground_per_step: rays as usize };
        }
        let mut all_s: Vec<f64> = linspace(span_s, POINTS).chain(marked_s.iter().copied()).collect();
        all_s.sort_by(f64::total_cmp);
        all_s.dedup();
        Self { ground_s: all_s.clone(), all_s, per_step: 1, ground_per_step: 1 }
    }
}

/// Both ends and the borders between `steps` equal steps.
pub fn linspace([from_s, to_s]: [f64; 2], steps: u64) -> impl Iterator<Item = f64> {
    (0..=steps).map(move |k| from_s + (to_s - from_s) * k as f64 / steps as f64)
}

/// Keeps the least and the largest of every `per_step` points, in order of time. Plain decimation would alias
/// quick waves into slow ones.
pub fn decimate_min_max(points: Vec<[f64; 2]>, per_step: usize) -> Vec<[f64; 2]> {
    if per_step <= 1 {
        return points;
    }
    let min_and_max = |step: &[[f64; 2]]| {
        let (mut low, mut high) = (0, 0);
        for (index, point) in step.iter().enumerate() {
            low = if point[1] < step[low][1] { index } else { low };
            high = if point[1] > step[high][1] { index } else { high };
        }
        let [first, second] = [low.min(high), low.max(high)];
        [step[first], step[second]].into_iter().take(1 + usize::from(first != second)).collect::<Vec<_>>()
    };
    points.chunks(per_step).flat_map(min_and_max).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimation_keeps_minimum_and_maximum_of_each_step_in_order() {
        let points: Vec<[f64; 2]> = [3.0, 9.0, -1.0, 2.0, 2.0, 2.0, 7.0]
            .into_iter()
            .enumerate()
            .map(|(k, v)| [k as f64, v])
            .collect();
        assert_eq!(decimate_min_max(points.clone(), 3), [[1.0, 9.0], [2.0, -1.0], [3.0, 2.0], [6.0, 7.0]]);
        assert_eq!(decimate_min_max(points.clone(), 1), points);
        // A wave quicker than the steps keeps its amplitude.
        let wave: Vec<[f64; 2]> =
            linspace([0.0, 1000.0], 400_000).map(|t_s| [t_s, (t_s * 37.0).sin()]).collect();
        let decimated = decimate_min_max(wave, 500);
        assert!(
            decimated.len() > 1500
                && decimated
                    .chunks(2)
                    .take(799)
                    .all(|pair| pair.iter().any(|p| p[1] > 0.99) && pair.iter().any(|p| p[1] < -0.99))
        );
    }

    #[test]
    fn there_are_at_least_as_many_samples_as_rows() {
        for rows in [0, 1, 799, 5000, 360_000] {
            let times = SampleTimes::new([5.0, 36_005.0], rows, &[]);
            assert!(times.all_s.len() > rows && times.all_s.len() == POINTS as usize * times.per_step + 1);
            assert_eq!((times.all_s[0], times.all_s.last()), (5.0, Some(&36_005.0)));
            assert_eq!(times.ground_s.len(), POINTS as usize * times.ground_per_step + 1);
        }
        let marked = SampleTimes::new([0.0, 800.0], 3, &[0.5, 1.0, 7.25]);
        assert!(
            marked.all_s.len() == 803
                && [0.5, 1.0, 7.25].iter().all(|t_s| marked.all_s.contains(t_s))
                && marked.all_s.is_sorted()
        );
    }
}
