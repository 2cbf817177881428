//! Multisampled ideal frames: positions of the four samples of a pixel, and the depth to which they resolve.
//!
//! f64 twin of `camsim-gpu/shaders/ideal/resolve_depth.wgsl`.

use glam::DVec2;

use crate::scenario::IDEAL_SAMPLES;

/// Samples per pixel of a multisampled frame.
pub const SAMPLES: u32 = IDEAL_SAMPLES;
/// Sample positions from the centre of the pixel, pixels: the standard pattern of 4x multisampling. No two
/// share a row or column, so axis-aligned borders are known to a quarter of a pixel.
pub const SAMPLE_POSITIONS: [DVec2; 4] = [
    DVec2::new(-0.125, -0.375),
    DVec2::new(0.375, -0.125),
    DVec2::new(-0.375, 0.125),
    DVec2::new(0.125, 0.375),
];
/// Inverse depths that differ by no more than this fraction of the nearest one belong to one surface.
const ONE_SURFACE: f32 = 0.02;

/// Resolves the inverse depths of the four samples (0 = infinitely far) to that of the pixel's centre.
/// `slopes` is the change of inverse depth per pixel along x and y. The result is the mean of all four, which
/// is exact on a plane. If they belong to several surfaces, it is the mean over the nearest surface, or, if
/// only one sample lies on that one, over the next surface behind it.
#[must_use]
pub fn resolve_depth(all: [f32; 4], slopes: [f32; 2]) -> f32 {
    // Values extrapolated to the centre of the pixel.
    let positions = SAMPLE_POSITIONS.map(|position| position.as_vec2());
    let middle: [f32; 4] =
        std::array::from_fn(|k| all[k] - slopes[0] * positions[k].x - slopes[1] * positions[k].y);
    let most = all.iter().fold(0.0_f32, |most, &of| most.max(of));
    let range = |of: &[f32; 4]| {
        of.iter().fold([f32::INFINITY, 0.0_f32], |[low, high], &of| [low.min(of), high.max(of)])
    };
    let mean = 0.25 * ((all[0] + all[3]) + (all[1] + all[2]));
    let is_one = |of: &[f32; 4]| {
        let [low, high] = range(of);
        high - low <= ONE_SURFACE * most
    };
    if is_one(&middle) || is_one(&all) {
        return mean;
    }
    let near = mean_from(all, most);
    if near[1] > 1.0 {
        return near[0];
    }
    let behind = all
        .iter()
        .fold(0.0_f32, |next, &of| if of < (1.0 - ONE_SURFACE) * most { next.max(of) } else { next });
    mean_from(all, behind)[0]
}

/// Mean and number of the samples that belong to the surface of `first`, the nearest of them.
fn mean_from(all: [f32; 4], first: f32) -> [f32; 2] {
    let least = (1.0 - ONE_SURFACE) * first;
    let alike = all.iter().filter(|&&of| of >= least && of <= first);
    let [sum, count] = alike.fold([0.0, 0.0], |[sum, count], of| [sum + of, count + 1.0]);
    [sum / count, count]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of a plane with inverse depth `middle` at the centre of the pixel and the given slopes.
    fn plane(middle: f32, slopes: [f32; 2]) -> [f32; 4] {
        SAMPLE_POSITIONS
            .map(|position| middle + slopes[0] * position.x as f32 + slopes[1] * position.y as f32)
    }

    #[test]
    fn sample_positions_are_centred_with_distinct_rows_and_columns() {
        assert_eq!(SAMPLE_POSITIONS.iter().sum::<DVec2>(), DVec2::ZERO);
        for along in [DVec2::X, DVec2::Y] {
            let mut positions = SAMPLE_POSITIONS.map(|position| position.dot(along));
            positions.sort_by(f64::total_cmp);
            assert_eq!(positions, [-0.375, -0.125, 0.125, 0.375]);
        }
    }

    #[test]
    fn resolved_depth_is_exact_on_planes() {
        for slopes in [[0.0, 0.0], [1e-4, -2e-4], [0.002, 0.001], [-0.004, 0.004]] {
            assert!((resolve_depth(plane(0.01, slopes), slopes) - 0.01).abs() < 1e-8, "{slopes:?}");
        }
        assert_eq!(resolve_depth([0.0; 4], [0.0; 2]), 0.0);
    }

    #[test]
    fn resolved_depth_is_that_of_one_surface() {
        let (near, far) = (0.02, 0.01);
        // Two and two in columns. A plane would show the same difference within the pixel.
        assert_eq!(resolve_depth([near, far, near, far], [0.0; 2]), near);
        assert_eq!(resolve_depth([near, far, near, far], [0.5 * (far - near), 0.0]), near);
        assert_eq!(resolve_depth([far, near, near, near], [0.0; 2]), near);
        assert_eq!(resolve_depth([far, far, near, far], [0.0; 2]), far);
        assert_eq!(resolve_depth([0.0, 0.0, near, 0.0], [0.0; 2]), 0.0, "the sky");
        assert_eq!(resolve_depth([0.0, 0.005, near, 0.005], [0.0; 2]), 0.005);
        assert!(resolve_depth([f32::NAN; 4], [f32::NAN; 2]).is_nan());
    }
}
