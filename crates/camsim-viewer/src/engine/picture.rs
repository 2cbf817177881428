//! Rendered frames, differences and depth as images for the screen.

use std::sync::Arc;

use camsim_core::{frame::RenderedFrame, scene::srgb_from_linear_f64};
use camsim_engine::FrameTimes;
use camsim_io::write::srgb8;
use camsim_plan::FramePlan;
use eframe::egui::{Color32, ColorImage};

use super::{messages::Stage, raw::RawScale};

/// A rendered frame with its plan and times.
#[derive(Debug)]
pub struct Picture {
    /// The stage that it shows.
    pub stage: Stage,
    /// Linear values and row poses.
    pub frame: RenderedFrame,
    /// The plan that it was rendered by; of a wide field that of its first face.
    pub plan: FramePlan,
    /// The plans of the other faces.
    pub faces: Vec<FramePlan>,
    /// Times of its passes.
    pub times: FrameTimes,
    /// Time of all that was done for it, ms.
    pub took_ms: f64,
    /// How the raw picture of the frame is to be read; `None` without sensor.
    pub raw_scale: Option<RawScale>,
    /// sRGB picture for the screen.
    pub image: Arc<ColorImage>,
}

impl Picture {
    /// The plans of all faces; one without.
    pub fn plans(&self) -> impl Iterator<Item = &FramePlan> {
        std::iter::once(&self.plan).chain(&self.faces)
    }

    /// The plan of the face that shows a pixel; that of the first face where none does.
    pub fn plan_at(&self, pixel: [u32; 2]) -> &FramePlan {
        self.plans().find(|plan| plan.camera.unproject_pixel(pixel).is_some()).unwrap_or(&self.plan)
    }

    /// Bound on the source error of 99 % of the pixels.
    pub fn predicted_px(&self) -> f64 {
        self.plans().map(|plan| plan.predicted.total_px).fold(0.0, f64::max)
    }
}

/// The difference of two pictures.
#[derive(Debug, Default)]
pub struct Difference {
    /// Difference times gain about middle grey; magenta where one picture alone is valid.
    pub image: Arc<ColorImage>,
    /// RMS over pixels that are valid in both, DN.
    pub rms_dn: f64,
    /// Largest absolute difference, DN.
    pub max_dn: f64,
    /// Fraction of the pixels that are valid in one picture alone.
    pub one_sided: f64,
}

/// The codes that an sRGB PNG of these linear values has; transparent at invalid pixels.
pub fn srgb_image(size_px: [u32; 2], color_rgba: &[f32]) -> ColorImage {
    let rgba: Vec<u8> = color_rgba
        .as_chunks::<4>()
        .0
        .iter()
        .flat_map(|&[r, g, b, a]| if a > 0.0 { [srgb8(r), srgb8(g), srgb8(b), 255] } else { [0; 4] })
        .collect();
    ColorImage::from_rgba_unmultiplied(size_px.map(|side| side as usize), &rgba)
}

/// `a - b` times `gain` about middle grey, in linear values, over the first `rows` rows. `None` for pictures
/// of different size.
pub fn difference(size_px: [u32; 2], a: &[f32], b: &[f32], gain: f32, rows: u32) -> Option<Difference> {
    if a.len() != b.len() || a.len() != 4 * size_px[0] as usize * size_px[1] as usize {
        return None;
    }
    let (mut squares, mut max, mut both, mut one) = (0.0_f64, 0.0_f64, 0_u64, 0_u64);
    let pixels =
        a.as_chunks::<4>().0.iter().zip(b.as_chunks::<4>().0).map(|(a, b)| match (a[3] > 0.0, b[3] > 0.0) {
            (true, true) => {
                both += 1;
                let rgb: [f32; 3] = std::array::from_fn(|k| a[k] - b[k]);
                squares += rgb.iter().map(|d| f64::from(*d).powi(2)).sum::<f64>();
                max = rgb.iter().fold(max, |max, d| max.max(f64::from(d.abs())));
                let [r, g, b] = rgb.map(|d| (255.0 * (0.5 + gain * d).clamp(0.0, 1.0)).round() as u8);
                Color32::from_rgb(r, g, b)
            }
            (false, false) => Color32::TRANSPARENT,
            _ => {
                one += 1;
                Color32::from_rgb(255, 0, 255)
            }
        });
    let all = a.len() / 4;
    let compared = all.min(size_px[0] as usize * rows as usize);
    let mut pixels: Vec<Color32> = pixels.take(compared).collect();
    pixels.resize(all, Color32::TRANSPARENT);
    let image = Arc::new(ColorImage::new(size_px.map(|side| side as usize), pixels));
    let rms_dn = 255.0 * (squares / (3 * both.max(1)) as f64).sqrt();
    let one_sided = one as f64 / compared.max(1) as f64;
    Some(Difference { image, rms_dn, max_dn: 255.0 * max, one_sided })
}

/// Least and largest depth, metres; `None` if no pixel has a surface.
pub fn depth_range_m(depth_m: &[f32]) -> Option<[f32; 2]> {
    let known = depth_m.iter().copied().filter(|d| *d > 0.0 && d.is_finite());
    known.map(|d| [d, d]).reduce(|[near, far], [d, _]| [near.min(d), far.max(d)])
}

/// Depth on a logarithmic colour scale from near (bright) to far (dark); transparent for the sky.
pub fn depth_image(size_px: [u32; 2], depth_m: &[f32], range_m: Option<[f32; 2]>) -> ColorImage {
    let [near, far] = range_m.unwrap_or([1.0; 2]);
    let span = (far / near).ln().max(1e-6);
    let pixels = depth_m.iter().map(|&d| {
        if d <= 0.0 || !d.is_finite() {
            return Color32::TRANSPARENT;
        }
        let fraction = f64::from((d / near).ln() / span).clamp(0.0, 1.0);
        let [r, g, b] = ramp(1.0 - fraction);
        Color32::from_rgb(r, g, b)
    });
    ColorImage::new(size_px.map(|side| side as usize), pixels.collect())
}

/// Colour scale from dark blue (0) over green to yellow (1) with increasing lightness.
pub fn ramp(fraction: f64) -> [u8; 3] {
    let fraction = fraction.clamp(0.0, 1.0);
    let linear = [0.9 * fraction.powi(2), 0.02 + 0.8 * fraction, 0.25 * (1.0 - fraction).powi(2) + 0.08];
    linear.map(|value| (255.0 * srgb_from_linear_f64(value)).round() as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_are_srgb_with_transparent_invalid_pixels() {
        let image = srgb_image([2, 1], &[0.215_861, 0.0, 1.0, 1.0, 0.3, 0.0, 0.0, 0.0]);
        assert_eq!(image.pixels[0].to_array(), [128, 0, 255, 255]);
        assert_eq!(image.pixels[1], Color32::TRANSPARENT);
    }

    #[test]
    fn difference_has_rms_maximum_and_one_sided_fraction() {
        let a = [0.5, 0.5, 0.5, 1.0, 0.1, 0.1, 0.1, 1.0, 0.0, 0.0, 0.0, 0.0];
        let b = [0.4, 0.5, 0.5, 1.0, 0.1, 0.1, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0];
        let result = difference([3, 1], &a, &b, 4.0, 1).expect("of one size");
        assert!((result.rms_dn - 255.0 * 0.1 / 3.0_f64.sqrt()).abs() < 1e-4, "{}", result.rms_dn);
        assert!((result.max_dn - 25.5).abs() < 1e-4);
        assert!((result.one_sided - 1.0 / 3.0).abs() < 1e-9);
        assert_eq!(result.image.pixels[0].to_array(), [230, 128, 128, 255]);
        assert_eq!(result.image.pixels[2], Color32::TRANSPARENT);
        assert!(difference([2, 1], &a, &b, 4.0, 1).is_none());
    }

    #[test]
    fn missing_rows_are_not_compared() {
        let a = [0.5, 0.5, 0.5, 1.0, 0.2, 0.2, 0.2, 1.0, 0.7, 0.7, 0.7, 1.0];
        let b = [0.4, 0.5, 0.5, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
        let result = difference([1, 3], &a, &b, 4.0, 1).expect("of one size");
        assert!(
            (result.max_dn - 25.5).abs() < 1e-4 && result.one_sided == 0.0,
            "{} {}",
            result.max_dn,
            result.one_sided
        );
        assert_eq!(result.image.pixels[1..], [Color32::TRANSPARENT; 2]);
        let all = difference([1, 3], &a, &b, 4.0, 3).expect("of one size");
        assert!((all.one_sided - 2.0 / 3.0).abs() < 1e-9 && all.image.pixels[2] != Color32::TRANSPARENT);
    }

    #[test]
    fn near_depth_is_bright_and_sky_is_transparent() {
        let depth_m = [10.0, 1000.0, 0.0];
        assert_eq!((depth_range_m(&depth_m), depth_range_m(&[0.0])), (Some([10.0, 1000.0]), None));
        let image = depth_image([3, 1], &depth_m, depth_range_m(&depth_m));
        let light = |pixel: Color32| u32::from(pixel.r()) + u32::from(pixel.g()) + u32::from(pixel.b());
        assert!(light(image.pixels[0]) > light(image.pixels[1]));
        assert_eq!(image.pixels[2], Color32::TRANSPARENT);
    }
}
