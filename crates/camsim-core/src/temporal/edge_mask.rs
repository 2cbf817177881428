//! Edge mask of an ideal frame: the pixels that, with their neighbours, show more than one surface. f64 twin
//! of `camsim-gpu/shaders/ideal/edge_mask.wgsl` and `camsim-gpu/shaders/ideal/thin_surfaces/`.

use super::supersampled::PixelCentre;

/// Depth step, relative to the nearer surface, above which a pixel is at an edge. Curved surfaces stay below
/// it within a pixel.
pub const EDGE_STEP: f64 = 0.01;
/// Threshold for supersampled frames. It is lower because the foot of a wall, where another texture begins,
/// bends less.
pub const FINE_EDGE_STEP: f64 = 0.003;

/// Whether there is an edge along one direction: a second difference of inverse depth above that of a smooth
/// surface (it is 0 on a plane), or sky beside a surface.
#[must_use]
pub fn steps(before: f64, here: f64, after: f64, edge_step: f64) -> bool {
    let high = before.max(here).max(after);
    let low = before.min(here).min(after);
    (before - 2.0 * here + after).abs() > edge_step * high || (low == 0.0 && high > 0.0)
}

/// Edge mask of an ideal frame of `size_px` (width, height), row-major. `centres` are the values at the pixel
/// centres. `samples` are `4 scale^2` per pixel, laid out as in
/// [`super::supersampled::SupersampledImage::samples`]; they detect surfaces thinner than a pixel, and are
/// empty if there are none.
#[must_use]
pub fn edge_mask(size_px: [u32; 2], scale: u32, centres: &[PixelCentre], samples: &[f64]) -> Vec<bool> {
    let [width, height] = size_px.map(i64::from);
    let inverse_depth = |[x, y]: [i64; 2]| centres[(y * width + x) as usize].inverse_depth;
    let of_pixel = |[x, y]: [i64; 2]| {
        let (x, y, scale) = (x as usize, y as usize, scale as usize);
        let row = 4 * width as usize * scale;
        (0..scale).flat_map(move |j| {
            let first = (y * scale + j) * row + 4 * x * scale;
            samples[first..first + 4 * scale].iter().copied()
        })
    };
    let is_edge = |pixel: [i64; 2]| {
        let range = (!samples.is_empty()).then(|| {
            of_pixel(pixel).fold([f64::INFINITY, 0.0], |[low, high]: [f64; 2], w| [low.min(w), high.max(w)])
        });
        is_edge(pixel, size_px, scale, inverse_depth, range)
    };
    (0..width * height).map(|i| is_edge([i % width, i / width])).collect()
}

/// Edge mask of one pixel of an ideal frame with `scale` fine pixels along a side of an ideal pixel.
/// `inverse_depth` is that at the centre of a pixel within the frame. `range` is the least and the largest
/// inverse depth of the pixel's samples, if surfaces may be thinner than a pixel.
pub fn is_edge(
    [x, y]: [i64; 2],
    size_px: [u32; 2],
    scale: u32,
    inverse_depth: impl Fn([i64; 2]) -> f64,
    range: Option<[f64; 2]>,
) -> bool {
    let [width, height] = size_px.map(i64::from);
    let edge_step = if scale > 1 { FINE_EDGE_STEP } else { EDGE_STEP };
    let near =
        |dx: i64, dy: i64| inverse_depth([(x + dx).clamp(0, width - 1), (y + dy).clamp(0, height - 1)]);
    // The samples differ by more than the slope around the pixel explains.
    let is_thin = |[low, high]: [f64; 2]| {
        let slope = (near(1, 0) - near(-1, 0)).abs() + (near(0, 1) - near(0, -1)).abs();
        (low == 0.0 && high > 0.0) || high - low > slope + edge_step * high
    };
    [[1, 0], [0, 1], [1, 1], [1, -1]]
        .into_iter()
        .any(|[dx, dy]| steps(near(-dx, -dy), near(0, 0), near(dx, dy), edge_step))
        || range.is_some_and(is_thin)
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
        // Values that are not finite are no edge and cause no panic.
        assert!(!steps(f64::NAN, f64::NAN, f64::NAN, EDGE_STEP));
    }

    fn marked(scale: u32, look: impl Fn(i64) -> f64, samples: &[f64]) -> Vec<usize> {
        let centres: Vec<PixelCentre> =
            (0..64).map(|i| PixelCentre { inverse_depth: look(i % 8), ..PixelCentre::default() }).collect();
        let marks = edge_mask([8, 8], scale, &centres, samples);
        (0..8).filter(|&x| marks[3 * 8 + x]).collect()
    }

    #[test]
    fn pixels_beside_a_step_are_marked() {
        assert_eq!(marked(1, |x| if x < 4 { 0.1 } else { 0.02 }, &[]), [3, 4]);
        assert_eq!(marked(1, |x| if x < 4 { 0.1 } else { 0.0 }, &[]), [3, 4]);
        // A slope is no edge, however steep. At the border of the frame a steep one cannot be told from a
        // step, because there is no pixel beyond.
        assert_eq!(marked(1, |x| 0.1 - 0.0009 * x as f64, &[]), [0; 0]);
        assert_eq!(marked(1, |x| 0.1 - 0.01 * x as f64, &[]), [0, 7]);
    }

    #[test]
    fn thin_surfaces_are_found_among_the_samples() {
        let mut samples = vec![0.02; 4 * 64];
        samples[4 * (3 * 8 + 5) + 2] = 0.1;
        assert_eq!(marked(1, |_| 0.02, &[]), [0; 0]);
        assert_eq!(marked(1, |_| 0.02, &samples), [5]);
        let mut finer = vec![0.02; 4 * 4 * 64];
        // Fine pixel (10, 7) is in pixel (5, 3).
        finer[4 * (7 * 16 + 10) + 1] = 0.0;
        assert_eq!(marked(2, |_| 0.02, &finer), [5]);
    }
}
