//! Finding dark circles in a picture, as somebody without the truth must.

use camsim_core::{frame::RenderedFrame, reference::ErrorStats};
use glam::DVec2;

use super::pattern::Seen;

/// Linear light that separates black circles from the white target.
const THRESHOLD: f32 = 0.5;
/// Pixels around what lies below the threshold that still belong to the circle: they carry its antialiased
/// rim.
const RIM_PX: i32 = 2;
/// Smallest area of a circle that counts, pixels.
pub const LEAST_PX: usize = 12;

/// A dark spot.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spot {
    /// Centre of its area, pixels.
    pub centroid_px: DVec2,
    /// Its area, square pixels.
    pub area_px2: f64,
}

/// All dark spots that touch neither the border of the picture nor a pixel without a ray. A pixel that is
/// half dark counts half, so that the centroid is that of the area, not of a staircase.
#[must_use]
pub fn spots(frame: &RenderedFrame) -> Vec<Spot> {
    let [width, height] = frame.size_px.map(|side| side as i32);
    let light = |x: i32, y: i32| {
        let at = 4 * (y * width + x) as usize;
        let [r, g, b, a] = [0, 1, 2, 3].map(|k| frame.color_rgba[at + k]);
        (a > 0.0).then_some((r + g + b) / 3.0)
    };
    let inside = |x: i32, y: i32| x >= 0 && y >= 0 && x < width && y < height;
    let mut taken = vec![false; (width * height) as usize];
    let mut found = Vec::new();
    for start in 0..width * height {
        let seed = (start % width, start / width);
        if taken[start as usize] || light(seed.0, seed.1).is_none_or(|value| value >= THRESHOLD) {
            continue;
        }
        taken[start as usize] = true;
        let (mut core, mut next) = (vec![seed], 0);
        while let Some(&(x, y)) = core.get(next) {
            next += 1;
            for (x, y) in [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)] {
                if inside(x, y)
                    && !taken[(y * width + x) as usize]
                    && light(x, y).is_some_and(|value| value < THRESHOLD)
                {
                    taken[(y * width + x) as usize] = true;
                    core.push((x, y));
                }
            }
        }
        found.extend(spot(&core, &light, &inside));
    }
    found
}

/// Centroid over a core of dark pixels and its rim; `None` where picture or rays end too close by, or hardly
/// anything is there.
fn spot(
    core: &[(i32, i32)],
    light: &impl Fn(i32, i32) -> Option<f32>,
    inside: &impl Fn(i32, i32) -> bool,
) -> Option<Spot> {
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
    Some(Spot { centroid_px: origin + moment / area, area_px2: area })
}

/// Circles found and missed in one picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Matches {
    /// Where a circle must be, and the spot found there.
    pub pairs: Vec<(Seen, Spot)>,
    /// Circles wholly in view that were not found.
    pub missed: usize,
}

/// Gives each circle the spot in its place: nearer than half its size, of an area within a third of its own.
#[must_use]
pub fn matches(seen: &[Seen], spots: &[Spot]) -> Matches {
    let mut matches = Matches::default();
    for circle in seen {
        let reach_px = 0.5 * (circle.area_px2 / std::f64::consts::PI).sqrt();
        let fits = |spot: &&Spot| {
            spot.centroid_px.distance(circle.centroid_px) < reach_px
                && (spot.area_px2 / circle.area_px2 - 1.0).abs() < 0.34
        };
        let distance = |spot: &&Spot| spot.centroid_px.distance(circle.centroid_px);
        match spots.iter().filter(fits).min_by(|a, b| distance(a).total_cmp(&distance(b))) {
            Some(spot) => matches.pairs.push((*circle, *spot)),
            None => matches.missed += 1,
        }
    }
    matches
}

impl Matches {
    /// Statistics of [`Matches::errors_px`]; not a number where nothing was found, which is not an error of
    /// 0.
    #[must_use]
    pub fn stats(&self) -> ErrorStats {
        match self.pairs.is_empty() {
            true => ErrorStats { count: 0, rms_px: f64::NAN, p99_px: f64::NAN, max_px: f64::NAN },
            false => ErrorStats::of(self.errors_px()),
        }
    }

    /// Distance of each spot from its circle's true centroid, pixels.
    #[must_use]
    pub fn errors_px(&self) -> Vec<f64> {
        self.pairs.iter().map(|(seen, spot)| seen.centroid_px.distance(spot.centroid_px)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A white picture with dark discs, each pixel by its area.
    fn picture(discs: &[(DVec2, f64)]) -> RenderedFrame {
        let size_px = [64, 48];
        let light = |i: u32| {
            let inside = |k: u32| {
                let place = DVec2::new(f64::from(i % 64), f64::from(i / 64))
                    + (DVec2::new(f64::from(k % 64), f64::from(k / 64)) + 0.5) / 64.0
                    - 0.5;
                discs.iter().any(|(centre, radius)| place.distance(*centre) < *radius)
            };
            1.0 - (0..4096).filter(|&k| inside(k)).count() as f32 / 4096.0
        };
        let color_rgba = (0..64 * 48).flat_map(|i| [light(i), light(i), light(i), 1.0]).collect();
        RenderedFrame { size_px, color_rgba, ..RenderedFrame::default() }
    }

    #[test]
    fn centres_are_found_to_a_fraction_of_a_pixel() {
        let discs = [(DVec2::new(20.3, 15.7), 6.2), (DVec2::new(44.9, 30.1), 4.4)];
        let mut frame = picture(&[discs[0], discs[1], (DVec2::new(1.0, 40.0), 5.0)]);
        let found = spots(&frame);
        assert_eq!(found.len(), 2, "the one at the border does not count: {found:?}");
        for (spot, (centre, radius)) in found.iter().zip(discs) {
            // What the picture itself, of 64 x 64 places a pixel, does not know of the disc is below 1e-3. A
            // rim pixel's share counts at the pixel's centre, not at that of the part covered: 0.0017 and
            // 0.0035 px for these two discs.
            let area_px2 = std::f64::consts::PI * radius * radius;
            let (shift, growth) = (spot.centroid_px.distance(centre), spot.area_px2 / area_px2 - 1.0);
            assert!(shift < 5e-3 && growth.abs() < 5e-3, "{spot:?}: {shift} {growth}");
        }
        // A pixel without a ray in the rim spoils a spot.
        frame.color_rgba[4 * (15 * 64 + 27) + 3] = 0.0;
        assert_eq!(spots(&frame).len(), 1);
    }

    #[test]
    fn only_what_is_in_place_matches() {
        let seen = |x: f64| Seen {
            centroid_px: DVec2::new(x, 9.0),
            area_px2: 100.0,
            centre_px: DVec2::ZERO,
            bounds_px: [DVec2::ZERO; 2],
        };
        let spot = |x: f64, area_px2: f64| Spot { centroid_px: DVec2::new(x, 9.0), area_px2 };
        let matches = matches(
            &[seen(10.0), seen(40.0), seen(80.0)],
            &[spot(10.5, 95.0), spot(44.0, 100.0), spot(80.1, 30.0)],
        );
        assert_eq!((matches.pairs.len(), matches.missed), (1, 2));
        assert_eq!(matches.errors_px(), [0.5]);
        assert_eq!(matches.stats().rms_px, 0.5);
        assert!(Matches::default().stats().rms_px.is_nan(), "nothing found is no error of 0");
    }
}
