//! When to look at a flight: often enough that nothing that a log tells is passed over, and what is left of
//! it for a plot.

use super::POINTS;

/// Instants between two points of a line, at most: every row of a log of 10 Hz over ten hours.
const MOST_BETWEEN: u64 = 500;
/// ... of what needs a ray to the ground.
const MOST_RAYS_BETWEEN: u64 = 8;

/// Instants of a span.
#[derive(Debug)]
pub struct Instants {
    /// In order, both ends included.
    pub all: Vec<f64>,
    /// So many of them for each step of a line.
    pub for_each: usize,
    /// Fewer, for what takes longer.
    pub of_ground: Vec<f64>,
    /// So many of these for each step of a line.
    pub for_each_of_ground: usize,
}

impl Instants {
    /// For a span with so many `rows` of the log. `marked` ones are instants of their own, and nothing is
    /// then left out.
    pub fn of(span_s: [f64; 2], rows: usize, marked_s: &[f64]) -> Self {
        if marked_s.is_empty() {
            let between = (rows as u64 / POINTS + 1).min(MOST_BETWEEN);
            let rays = between.min(MOST_RAYS_BETWEEN);
            let [all, of_ground] = [between, rays].map(|between| even(span_s, POINTS * between).collect());
            return Self { all, for_each: between as usize, of_ground, for_each_of_ground: rays as usize };
        }
        let mut all: Vec<f64> = even(span_s, POINTS).chain(marked_s.iter().copied()).collect();
        all.sort_by(f64::total_cmp);
        all.dedup();
        Self { of_ground: all.clone(), all, for_each: 1, for_each_of_ground: 1 }
    }
}

/// Both ends and so many steps between them.
pub fn even([from_s, to_s]: [f64; 2], steps: u64) -> impl Iterator<Item = f64> {
    (0..=steps).map(move |k| from_s + (to_s - from_s) * k as f64 / steps as f64)
}

/// Of so many points at a time the least and the largest, in order of time: a line through every so-manyth
/// would show slow waves where there are quick ones.
pub fn thinned(points: Vec<[f64; 2]>, for_each: usize) -> Vec<[f64; 2]> {
    if for_each <= 1 {
        return points;
    }
    let ends = |part: &[[f64; 2]]| {
        let (mut low, mut high) = (0, 0);
        for (at, point) in part.iter().enumerate() {
            low = if point[1] < part[low][1] { at } else { low };
            high = if point[1] > part[high][1] { at } else { high };
        }
        let [first, second] = [low.min(high), low.max(high)];
        [part[first], part[second]].into_iter().take(1 + usize::from(first != second)).collect::<Vec<_>>()
    };
    points.chunks(for_each).flat_map(ends).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_each_step_the_least_and_the_largest_are_left_in_order() {
        let points: Vec<[f64; 2]> = [3.0, 9.0, -1.0, 2.0, 2.0, 2.0, 7.0]
            .into_iter()
            .enumerate()
            .map(|(k, v)| [k as f64, v])
            .collect();
        assert_eq!(thinned(points.clone(), 3), [[1.0, 9.0], [2.0, -1.0], [3.0, 2.0], [6.0, 7.0]]);
        assert_eq!(thinned(points.clone(), 1), points);
        // A wave quicker than the steps keeps its height.
        let wave: Vec<[f64; 2]> = even([0.0, 1000.0], 400_000).map(|t_s| [t_s, (t_s * 37.0).sin()]).collect();
        let left = thinned(wave, 500);
        assert!(
            left.len() > 1500
                && left
                    .chunks(2)
                    .take(799)
                    .all(|pair| pair.iter().any(|p| p[1] > 0.99) && pair.iter().any(|p| p[1] < -0.99))
        );
    }

    #[test]
    fn there_are_as_many_instants_as_rows_or_more() {
        for rows in [0, 1, 799, 5000, 360_000] {
            let found = Instants::of([5.0, 36_005.0], rows, &[]);
            assert!(found.all.len() > rows && found.all.len() == POINTS as usize * found.for_each + 1);
            assert_eq!((found.all[0], found.all.last()), (5.0, Some(&36_005.0)));
            assert_eq!(found.of_ground.len(), POINTS as usize * found.for_each_of_ground + 1);
        }
        let marked = Instants::of([0.0, 800.0], 3, &[0.5, 1.0, 7.25]);
        assert!(
            marked.all.len() == 803
                && [0.5, 1.0, 7.25].iter().all(|t_s| marked.all.contains(t_s))
                && marked.all.is_sorted()
        );
    }
}
