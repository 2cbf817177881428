//! Ideal frames of four samples a pixel: where these are, and which depth their pixel has.
//!
//! Twin of `shaders/ideal/samples.wgsl`.

use glam::DVec2;

/// Samples of a pixel where it has several.
pub const SAMPLES: u32 = 4;
/// Where they are from the pixel's middle on, pixels: the standard places of devices. No two are in one row
/// or column, so that borders along these are known to a quarter of a pixel.
pub const SAMPLE_PLACES: [DVec2; 4] = [
    DVec2::new(-0.125, -0.375),
    DVec2::new(0.375, -0.125),
    DVec2::new(-0.375, 0.125),
    DVec2::new(0.125, 0.375),
];
/// Inverse depths that differ by no more than this part of the nearest one are of one surface.
const ONE_SURFACE: f32 = 0.02;

/// Inverse depth of a pixel's middle from those of its samples, 0 of what is infinitely far, and how it
/// changes from pixel to pixel across and down. It is their mean, which is exact on a plane; where they are
/// of several surfaces the mean of those of the nearest one, or if that has but one, of the nearest one
/// behind it.
#[must_use]
pub fn middle_depth(all: [f32; 4], slopes: [f32; 2]) -> f32 {
    // As they would be at the pixel's middle.
    let places = SAMPLE_PLACES.map(|place| place.as_vec2());
    let middle: [f32; 4] =
        std::array::from_fn(|k| all[k] - slopes[0] * places[k].x - slopes[1] * places[k].y);
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

/// Mean and number of the samples of the surface that one shows, from it on.
fn mean_from(all: [f32; 4], first: f32) -> [f32; 2] {
    let least = (1.0 - ONE_SURFACE) * first;
    let alike = all.iter().filter(|&&of| of >= least && of <= first);
    let [sum, count] = alike.fold([0.0, 0.0], |[sum, count], of| [sum + of, count + 1.0]);
    [sum / count, count]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Samples of a surface whose inverse depth is so in the pixel's middle, and changes so.
    fn plane(middle: f32, slopes: [f32; 2]) -> [f32; 4] {
        SAMPLE_PLACES.map(|place| middle + slopes[0] * place.x as f32 + slopes[1] * place.y as f32)
    }

    #[test]
    fn samples_are_as_far_on_one_side_as_on_the_other_and_in_rows_and_columns_of_their_own() {
        assert_eq!(SAMPLE_PLACES.iter().sum::<DVec2>(), DVec2::ZERO);
        for along in [DVec2::X, DVec2::Y] {
            let mut places = SAMPLE_PLACES.map(|place| place.dot(along));
            places.sort_by(f64::total_cmp);
            assert_eq!(places, [-0.375, -0.125, 0.125, 0.375]);
        }
    }

    #[test]
    fn planes_have_their_own_depth_however_steep() {
        for slopes in [[0.0, 0.0], [1e-4, -2e-4], [0.002, 0.001], [-0.004, 0.004]] {
            assert!((middle_depth(plane(0.01, slopes), slopes) - 0.01).abs() < 1e-8, "{slopes:?}");
        }
        assert_eq!(middle_depth([0.0; 4], [0.0; 2]), 0.0);
    }

    #[test]
    fn of_several_surfaces_one_is_taken_and_none_between_them() {
        let (near, far) = (0.02, 0.01);
        // Two by two in columns, which a plane's would be as far apart as.
        assert_eq!(middle_depth([near, far, near, far], [0.0; 2]), near);
        assert_eq!(middle_depth([near, far, near, far], [0.5 * (far - near), 0.0]), near);
        assert_eq!(middle_depth([far, near, near, near], [0.0; 2]), near);
        assert_eq!(middle_depth([far, far, near, far], [0.0; 2]), far);
        assert_eq!(middle_depth([0.0, 0.0, near, 0.0], [0.0; 2]), 0.0, "the sky");
        assert_eq!(middle_depth([0.0, 0.005, near, 0.005], [0.0; 2]), 0.005);
        assert!(middle_depth([f32::NAN; 4], [f32::NAN; 2]).is_nan());
    }
}
