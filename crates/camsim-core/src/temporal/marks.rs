//! Which pixels of an ideal frame are marked: those that, with their neighbours, show more than one surface.
//! f64 twin of `shaders/ideal/marks.wgsl` and `shaders/ideal/spread/`.

use super::fine::Centre;

/// A step of depth, relative to the nearer surface, that a curved surface does not make within a pixel.
pub const EDGE_STEP: f64 = 0.01;
/// The same where the frame is drawn with more than one fine pixel a pixel: a wall's foot, where another
/// picture begins, bends less.
pub const FINE_EDGE_STEP: f64 = 0.003;

/// Along one direction: a second difference of inverse depth beyond what a smooth surface has (a plane has
/// none), or sky beside a surface.
#[must_use]
pub fn steps(before: f64, here: f64, after: f64, edge_step: f64) -> bool {
    let high = before.max(here).max(after);
    let low = before.min(here).min(after);
    (before - 2.0 * here + after).abs() > edge_step * high || (low == 0.0 && high > 0.0)
}

/// Marks of an ideal frame of `size_px` (width, height), row-major, from what is at the middles of its
/// pixels, and from `4 scale^2` samples a pixel (laid out as in [`super::fine::FineImage::samples`]) where
/// surfaces may be thinner than a pixel; empty where they are not.
#[must_use]
pub fn marks(size_px: [u32; 2], scale: u32, centres: &[Centre], samples: &[f64]) -> Vec<bool> {
    let [width, height] = size_px.map(i64::from);
    let edge_step = if scale > 1 { FINE_EDGE_STEP } else { EDGE_STEP };
    let is_marked = |x: i64, y: i64| {
        let at = |dx: i64, dy: i64| {
            let [x, y] = [(x + dx).clamp(0, width - 1), (y + dy).clamp(0, height - 1)];
            centres[(y * width + x) as usize].inverse_depth
        };
        let slope = (at(1, 0) - at(-1, 0)).abs() + (at(0, 1) - at(0, -1)).abs();
        [[1, 0], [0, 1], [1, 1], [1, -1]]
            .into_iter()
            .any(|[dx, dy]| steps(at(-dx, -dy), at(0, 0), at(dx, dy), edge_step))
            || (!samples.is_empty()
                && is_thin(size_px[0], scale, samples, [x as usize, y as usize], slope, edge_step))
    };
    (0..width * height).map(|i| is_marked(i % width, i / width)).collect()
}

/// Whether the samples of a pixel lie farther apart than the slope around it explains.
fn is_thin(width: u32, scale: u32, samples: &[f64], [x, y]: [usize; 2], slope: f64, edge_step: f64) -> bool {
    let (scale, row) = (scale as usize, 4 * (width * scale) as usize);
    let of_pixel = (0..scale).flat_map(|j| {
        let first = (y * scale + j) * row + 4 * x * scale;
        &samples[first..first + 4 * scale]
    });
    let (low, high) = of_pixel.fold((f64::INFINITY, 0.0_f64), |(low, high), &w| (low.min(w), high.max(w)));
    (low == 0.0 && high > 0.0) || high - low > slope + edge_step * high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn planes_have_no_steps() {
        assert!(!steps(0.001, 0.011, 0.021, EDGE_STEP) && !steps(0.0, 0.0, 0.0, EDGE_STEP));
        assert!(
            steps(0.01, 0.01, 0.02, EDGE_STEP)
                && steps(0.0, 0.0, 0.01, EDGE_STEP)
                && steps(0.01, 0.01, 0.0, EDGE_STEP)
        );
        assert!(!steps(0.01, 0.01, 0.010_05, EDGE_STEP) && steps(0.01, 0.01, 0.010_05, FINE_EDGE_STEP));
        // No depth is no step and no panic.
        assert!(!steps(f64::NAN, f64::NAN, f64::NAN, EDGE_STEP));
    }

    fn marked(scale: u32, look: impl Fn(i64) -> f64, samples: &[f64]) -> Vec<usize> {
        let centres: Vec<Centre> =
            (0..64).map(|i| Centre { inverse_depth: look(i % 8), ..Centre::default() }).collect();
        let marks = marks([8, 8], scale, &centres, samples);
        (0..8).filter(|&x| marks[3 * 8 + x]).collect()
    }

    #[test]
    fn pixels_beside_a_step_are_marked() {
        assert_eq!(marked(1, |x| if x < 4 { 0.1 } else { 0.02 }, &[]), [3, 4]);
        assert_eq!(marked(1, |x| if x < 4 { 0.1 } else { 0.0 }, &[]), [3, 4]);
        // A slope, however steep; but the frame's border has no pixel beyond it that would tell a steep one
        // from a step.
        assert_eq!(marked(1, |x| 0.1 - 0.0009 * x as f64, &[]), [0; 0]);
        assert_eq!(marked(1, |x| 0.1 - 0.01 * x as f64, &[]), [0, 7]);
    }

    #[test]
    fn what_misses_all_middles_is_found_among_the_samples() {
        let mut samples = vec![0.02; 4 * 64];
        samples[4 * (3 * 8 + 5) + 2] = 0.1;
        assert_eq!(marked(1, |_| 0.02, &[]), [0; 0]);
        assert_eq!(marked(1, |_| 0.02, &samples), [5]);
        let mut finer = vec![0.02; 4 * 4 * 64];
        // Fine pixel (10, 7) of the pixel (5, 3).
        finer[4 * (7 * 16 + 10) + 1] = 0.0;
        assert_eq!(marked(2, |_| 0.02, &finer), [5]);
    }
}
