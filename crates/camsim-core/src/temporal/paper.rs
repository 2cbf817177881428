//! The paper's gather: samples on the straight segment between the two ends of the exposure, both ends
//! included, on stored (encoded) values. f64 twins of `camsim-gpu/shaders/reverse/gather/straight.wgsl` and
//! `camsim-gpu/shaders/reverse/color/srgb.wgsl`.

use glam::{DVec2, DVec3};

use super::ColorImage;

/// Mean of `samples` samples of equal weight from the first end to the last; a single sample is taken at the
/// middle.
///
/// Because both ends are included, the mean is over a path that is too long by `samples / (samples - 1)`.
/// That is the paper's choice (eq. 20 in steps).
#[must_use]
pub fn gather_straight(ends_px: [DVec2; 2], samples: u32, stored: &ColorImage<'_>) -> DVec3 {
    let fraction = |i: u32| if samples < 2 { 0.5 } else { f64::from(i) / f64::from(samples - 1) };
    let count = samples.max(1);
    (0..count).map(|i| stored.sample(ends_px[0].lerp(ends_px[1], fraction(i)))).sum::<DVec3>()
        / f64::from(count)
}

/// The paper's linear fog on stored values: `mix(color, sky, clamp(distance / end, 0, 1))`. Sky
/// (`inverse_depth` 0) is entirely fog.
#[must_use]
pub fn linear_fog(color: DVec3, sky: DVec3, uv: DVec2, inverse_depth: f64, end_m: f64) -> DVec3 {
    let amount = uv.extend(1.0).length() / (inverse_depth * end_m).max(1e-30);
    color.lerp(sky, amount.clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_ends_count_as_much_as_the_middle() {
        let rgba: Vec<f32> =
            (0..16).flat_map(|i| [if i == 4 { 1.0 } else { 0.0 }, i as f32, 0.0, 1.0]).collect();
        let image = ColorImage { size_px: [16, 1], rgba: &rgba };
        let ends = [DVec2::new(4.0, 0.0), DVec2::new(12.0, 0.0)];
        let mean = gather_straight(ends, 5, &image);
        assert!((mean.x - 0.2).abs() < 1e-12 && (mean.y - 8.0).abs() < 1e-12, "{mean}");
        assert!((gather_straight(ends, 1, &image).y - 8.0).abs() < 1e-12);
    }

    #[test]
    fn fog_grows_with_slant_range() {
        let (black, sky) = (DVec3::ZERO, DVec3::ONE);
        assert!((linear_fog(black, sky, DVec2::ZERO, 1.0 / 250.0, 1000.0).x - 0.25).abs() < 1e-12);
        assert!(
            (linear_fog(black, sky, DVec2::X, 1.0 / 250.0, 1000.0).x - 0.25 * 2_f64.sqrt()).abs() < 1e-12
        );
        assert_eq!(linear_fog(black, sky, DVec2::ZERO, 0.0, 1000.0), sky);
    }
}
