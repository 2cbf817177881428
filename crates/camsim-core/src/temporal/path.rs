//! Path of a source over the exposure: polynomials of time through a few positions that are known exactly.
//! f64 twin of `camsim-gpu/shaders/reverse/gather/path/*.wgsl`.

use glam::DVec2;

use super::PathStage;

/// Most points on one polynomial.
const MAX_POINTS: usize = 5;

/// The polynomial through up to five points that are equally spaced in time, by Newton's forward differences.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Curve {
    differences: [DVec2; MAX_POINTS],
    /// Length of the chords between the points, pixels.
    pub length_px: f64,
}

impl Curve {
    /// The polynomial through `points`; points after the fifth are ignored.
    #[must_use]
    pub fn through(points: &[DVec2]) -> Self {
        let mut row = [DVec2::ZERO; MAX_POINTS];
        let count = points.len().min(MAX_POINTS);
        row[..count].copy_from_slice(&points[..count]);
        let mut differences = [row[0]; MAX_POINTS];
        for (order, difference) in differences.iter_mut().enumerate().skip(1) {
            for i in 0..count.saturating_sub(order) {
                row[i] = row[i + 1] - row[i];
            }
            *difference = if order < count { row[0] } else { DVec2::ZERO };
        }
        Self { differences, length_px: points.windows(2).map(|pair| pair[0].distance(pair[1])).sum() }
    }

    /// Position after `steps` steps from the first point.
    #[must_use]
    pub fn at(&self, steps: f64) -> DVec2 {
        let [p, d1, d2, d3, d4] = self.differences;
        p + steps * (d1 + (steps - 1.0) / 2.0 * (d2 + (steps - 2.0) / 3.0 * (d3 + (steps - 3.0) / 4.0 * d4)))
    }
}

/// The polynomials through all of `points`, one after the other; `stage` sets the number of points of each.
pub fn curves(points: &[DVec2], stage: PathStage) -> impl ExactSizeIterator<Item = Curve> + '_ {
    let steps = stage.steps() as usize;
    (0..points.len().saturating_sub(1) / steps)
        .map(move |k| Curve::through(&points[k * steps..=(k + 1) * steps]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn curve_interpolates_its_points() {
        for steps in 1..MAX_POINTS {
            // A path of the same degree is reproduced everywhere.
            let path = |t: f64| DVec2::new(3.0 - t + 0.5 * t.powi(steps as i32), 2.0 * t);
            let points: Vec<DVec2> = (0..=steps).map(|k| path(k as f64)).collect();
            let curve = Curve::through(&points);
            for t in [0.0, 0.3, 1.0, 0.5 * steps as f64, steps as f64] {
                assert!(curve.at(t).distance(path(t)) < 1e-12, "{steps} steps, {t}");
            }
        }
        assert_eq!(Curve::through(&[]).at(0.7), DVec2::ZERO);
    }

    #[test]
    fn sinusoidal_paths_stay_within_the_bound_of_each_stage() {
        // p = sin(w t), with the step h between nodes.
        for (stage, bound) in PathStage::ALL.into_iter().zip([1.0 / 8.0, 1.0 / 15.58, 1.0 / 33.0]) {
            for wh in [0.2_f64, 0.5, 1.0] {
                let path = |t: f64| DVec2::new((wh * t + 0.4).sin(), 0.0);
                let points: Vec<DVec2> = (0..=8).map(|k| path(f64::from(k))).collect();
                let steps = f64::from(stage.steps());
                let mut worst = 0.0_f64;
                for (k, curve) in curves(&points, stage).enumerate() {
                    for i in 0..=100 {
                        let t = steps * f64::from(i) / 100.0;
                        worst = worst.max(curve.at(t).distance(path(k as f64 * steps + t)));
                    }
                }
                let order = 1 + stage.steps() as i32;
                assert!(
                    worst <= bound * wh.powi(order) && worst > 0.4 * bound * wh.powi(order),
                    "{stage:?} {wh}: {worst:.2e}"
                );
            }
        }
    }
}
