//! Detection of dark circles in a picture, without use of the ground truth.

use camsim_core::{frame::RenderedFrame, reference::ErrorStats};
use glam::DVec2;

use super::circle_grid::CircleImage;

/// Linear value that separates black circles from the white target.
const THRESHOLD: f32 = 0.5;
/// Width of the antialiased rim around the pixels below the threshold.
const RIM_PX: i32 = 2;
/// Smallest number of dark pixels of a circle.
pub const LEAST_PX: usize = 12;

/// A dark blob.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Blob {
    /// Centroid of the area, pixels.
    pub centroid_px: DVec2,
    /// Area, square pixels.
    pub area_px2: f64,
}

/// All dark blobs that touch neither the border of the picture nor a pixel without a ray. Pixels are weighted
/// by their darkness, so that centroids are accurate to a fraction of a pixel.
#[must_use]
pub fn detect_blobs(frame: &RenderedFrame) -> Vec<Blob> {
    let [width, height] = frame.size_px.map(|side| side as i32);
    let light = |x: i32, y: i32| {
        let index = 4 * (y * width + x) as usize;
        let [r, g, b, a] = [0, 1, 2, 3].map(|k| frame.color_rgba()[index + k]);
        (a > 0.0).then_some((r + g + b) / 3.0)
    };
    let inside = |x: i32, y: i32| x >= 0 && y >= 0 && x < width && y < height;
    let mut visited = vec![false; (width * height) as usize];
    let mut blobs = Vec::new();
    for start in 0..width * height {
        let seed = (start % width, start / width);
        if visited[start as usize] || light(seed.0, seed.1).is_none_or(|value| value >= THRESHOLD) {
            continue;
        }
        visited[start as usize] = true;
        let (mut core, mut next) = (vec![seed], 0);
        while let Some(&(x, y)) = core.get(next) {
            next += 1;
            for (x, y) in [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)] {
                if inside(x, y)
                    && !visited[(y * width + x) as usize]
                    && light(x, y).is_some_and(|value| value < THRESHOLD)
                {
                    visited[(y * width + x) as usize] = true;
                    core.push((x, y));
                }
            }
        }
        blobs.extend(blob(&core, &light, &inside));
    }
    blobs
}

/// The blob of a core of dark pixels with its rim; `None` if it touches the border or a pixel without a ray,
/// or is too small.
fn blob(
    core: &[(i32, i32)],
    light: &impl Fn(i32, i32) -> Option<f32>,
    inside: &impl Fn(i32, i32) -> bool,
) -> Option<Blob> {
    if core.len() < LEAST_PX {
        return None;
    }
    let bound = |pick: fn(&(i32, i32)) -> i32| {
        let values = core.iter().map(pick);
        Some((values.clone().min()? - RIM_PX, values.max()? + RIM_PX))
    };
    let ((x0, x1), (y0, y1)) = (bound(|p| p.0)?, bound(|p| p.1)?);
    let columns = (x1 - x0 + 1) as usize;
    let mut near = vec![false; columns * (y1 - y0 + 1) as usize];
    for &(x, y) in core {
        for dy in -RIM_PX..=RIM_PX {
            for dx in -RIM_PX..=RIM_PX {
                near[(y + dy - y0) as usize * columns + (x + dx - x0) as usize] = true;
            }
        }
    }
    let (mut area, mut moment) = (0.0, DVec2::ZERO);
    let origin = DVec2::new(f64::from(x0), f64::from(y0));
    for (i, _) in near.iter().enumerate().filter(|(_, near)| **near) {
        let (x, y) = (x0 + (i % columns) as i32, y0 + (i / columns) as i32);
        let value = if inside(x, y) { light(x, y)? } else { return None };
        let dark = f64::from((1.0 - value).clamp(0.0, 1.0));
        area += dark;
        moment += dark * (DVec2::new(f64::from(x), f64::from(y)) - origin);
    }
    Some(Blob { centroid_px: origin + moment / area, area_px2: area })
}

/// True circles of a picture, matched with detected blobs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CircleMatches {
    /// Matched circles with their blobs.
    pub pairs: Vec<(CircleImage, Blob)>,
    /// Number of circles without a blob.
    pub missed: usize,
}

/// Matches each circle with the nearest blob within half its radius whose area differs by less than a third.
#[must_use]
pub fn match_circles(circles: &[CircleImage], blobs: &[Blob]) -> CircleMatches {
    let mut matches = CircleMatches::default();
    for circle in circles {
        let reach_px = 0.5 * (circle.area_px2 / std::f64::consts::PI).sqrt();
        let is_match = |blob: &&Blob| {
            blob.centroid_px.distance(circle.centroid_px) < reach_px
                && (blob.area_px2 / circle.area_px2 - 1.0).abs() < 0.34
        };
        let distance = |blob: &&Blob| blob.centroid_px.distance(circle.centroid_px);
        match blobs.iter().filter(is_match).min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            Some(blob) => matches.pairs.push((*circle, *blob)),
            None => matches.missed += 1,
        }
    }
    matches
}

impl CircleMatches {
    /// Statistics of [`CircleMatches::errors_px`]; NaN without matched circles.
    #[must_use]
    pub fn stats(&self) -> ErrorStats {
        match self.pairs.is_empty() {
            true => ErrorStats { count: 0, rms_px: f64::NAN, p99_px: f64::NAN, max_px: f64::NAN },
            false => ErrorStats::of(self.errors_px()),
        }
    }

    /// Distance of each blob from the true centroid of its circle, pixels.
    #[must_use]
    pub fn errors_px(&self) -> Vec<f64> {
        self.pairs.iter().map(|(circle, blob)| circle.centroid_px.distance(blob.centroid_px)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A white picture with dark discs, integrated over each pixel.
    fn picture(discs: &[(DVec2, f64)]) -> RenderedFrame {
        let size_px = [64, 48];
        let light = |i: u32| {
            let inside = |k: u32| {
                let point = DVec2::new(f64::from(i % 64), f64::from(i / 64))
                    + (DVec2::new(f64::from(k % 64), f64::from(k / 64)) + 0.5) / 64.0
                    - 0.5;
                discs.iter().any(|(centre, radius)| point.distance(*centre) < *radius)
            };
            1.0 - (0..4096).filter(|&k| inside(k)).count() as f32 / 4096.0
        };
        let color_rgba = (0..64 * 48).flat_map(|i| [light(i), light(i), light(i), 1.0]).collect();
        RenderedFrame::picture(size_px, color_rgba)
    }

    #[test]
    fn centroids_are_accurate_to_a_fraction_of_a_pixel() {
        let discs = [(DVec2::new(20.3, 15.7), 6.2), (DVec2::new(44.9, 30.1), 4.4)];
        let mut frame = picture(&[discs[0], discs[1], (DVec2::new(1.0, 40.0), 5.0)]);
        let blobs = detect_blobs(&frame);
        assert_eq!(blobs.len(), 2, "the one at the border does not count: {blobs:?}");
        for (blob, (centre, radius)) in blobs.iter().zip(discs) {
            // The picture itself, of 64 x 64 samples per pixel, is accurate to 1e-3. The covered fraction of a
            // rim pixel counts at the pixel's centre, which shifts these two centroids by 0.0017 and 0.0035
            // px.
            let area_px2 = std::f64::consts::PI * radius * radius;
            let (shift, growth) = (blob.centroid_px.distance(centre), blob.area_px2 / area_px2 - 1.0);
            assert!(shift < 5e-3 && growth.abs() < 5e-3, "{blob:?}: {shift} {growth}");
        }
        // A blob with a pixel without a ray in its rim is skipped.
        frame.color_rgba_mut()[4 * (15 * 64 + 27) + 3] = 0.0;
        assert_eq!(detect_blobs(&frame).len(), 1);
    }

    #[test]
    fn blobs_match_by_position_and_area() {
        let circle = |x: f64| CircleImage {
            centroid_px: DVec2::new(x, 9.0),
            area_px2: 100.0,
            centre_px: DVec2::ZERO,
            bounds_px: [DVec2::ZERO; 2],
        };
        let blob = |x: f64, area_px2: f64| Blob { centroid_px: DVec2::new(x, 9.0), area_px2 };
        let matches = match_circles(
            &[circle(10.0), circle(40.0), circle(80.0)],
            &[blob(10.5, 95.0), blob(44.0, 100.0), blob(80.1, 30.0)],
        );
        assert_eq!((matches.pairs.len(), matches.missed), (1, 2));
        assert_eq!(matches.errors_px(), [0.5]);
        assert_eq!(matches.stats().rms_px, 0.5);
        assert!(CircleMatches::default().stats().rms_px.is_nan(), "NaN without matches");
    }
}
