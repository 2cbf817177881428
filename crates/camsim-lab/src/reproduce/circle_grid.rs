//! The paper's calibration target, OpenCV's asymmetric grid of 11 x 4 circles, and the exact images of its
//! circles.

use std::sync::Arc;

use camsim_core::scene::{Encoding, Mesh, Scene, Texture};
use glam::{DVec2, DVec3};

/// Size of the texture, as in the paper's program.
const SIZE_PX: [u32; 2] = [1830, 1330];
/// Number of columns, and of circles per column.
const GRID: [u32; 2] = [11, 4];
/// Distance between columns. Circles of a column are twice as far apart, and every second column is shifted
/// by this distance.
const SPACING_PX: f64 = 112.0;
/// Centre of the first circle of the first column; integers are pixel centres.
const FIRST_PX: [f64; 2] = [354.0, 384.0];
/// Radius of the circles.
const RADIUS_PX: f64 = 45.0;
/// Vertices of the polygon that approximates a circle: its area is too small by 5e-5, its centroid exact.
const RIM_VERTICES: u32 = 360;

/// Linear colour around the target: sRGB (0.65, 0.85, 1) as in the paper.
pub const SKY_LINEAR: [f32; 3] = [0.3801, 0.6921, 1.0];

/// A circle of the target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    /// Centre on the ground, NED, metres.
    pub centre_ned_m: DVec3,
    /// Radius on the ground, metres.
    pub radius_m: f64,
}

/// Image of a circle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CircleImage {
    /// Centroid of the area, pixels.
    pub centroid_px: DVec2,
    /// Area, square pixels.
    pub area_px2: f64,
    /// Image of the circle's centre, pixels: with perspective or distortion it differs from the centroid.
    pub centre_px: DVec2,
    /// Smallest and largest coordinates, pixels.
    pub bounds_px: [DVec2; 2],
}

/// Centres of the circles, pixels of the texture.
fn centres_px() -> impl Iterator<Item = DVec2> {
    (0..GRID[0]).flat_map(|column| {
        (0..GRID[1]).map(move |row| {
            let shift = if column % 2 == 0 { 0.0 } else { -SPACING_PX };
            DVec2::new(
                FIRST_PX[0] + SPACING_PX * f64::from(column),
                FIRST_PX[1] + shift + 2.0 * SPACING_PX * f64::from(row),
            )
        })
    })
}

/// The target: black circles on white, with antialiased rims.
#[must_use]
pub fn texture() -> Texture {
    let [width, height] = SIZE_PX;
    let mut rgba8 = vec![255; 4 * (width * height) as usize];
    for centre in centres_px() {
        let reach = RADIUS_PX as i64 + 2;
        for dy in -reach..=reach {
            for dx in -reach..=reach {
                let index = 4 * ((centre.y as i64 + dy) * i64::from(width) + centre.x as i64 + dx) as usize;
                let white = 1.0 - coverage(dx as f64, dy as f64);
                let code = (255.0 * camsim_core::scene::srgb_from_linear(white as f32)).round() as u8;
                rgba8[index..index + 3].fill(code);
            }
        }
    }
    Texture { size_px: SIZE_PX, rgba8, encoding: Encoding::Srgb }
}

/// Fraction of the pixel at (dx, dy) from a circle's centre that the circle covers, from 8 x 8 samples.
fn coverage(dx: f64, dy: f64) -> f64 {
    let is_inside = |i: i32| {
        let [x, y] = [i % 8, i / 8].map(|k| (f64::from(k) + 0.5) / 8.0 - 0.5);
        (dx + x).hypot(dy + y) <= RADIUS_PX
    };
    (0..64).filter(|&i| is_inside(i)).count() as f64 / 64.0
}

/// The level target, centred on the origin, with its top to the north.
#[must_use]
pub fn scene(texture: Texture, width_m: f64) -> Scene {
    Scene {
        meshes: vec![Mesh::level_picture(Arc::new(texture), DVec3::ZERO, width_m)],
        sky_linear: SKY_LINEAR,
        ..Scene::default()
    }
}

/// The circles of a target of width `width_m`.
#[must_use]
pub fn circles(width_m: f64) -> Vec<Circle> {
    let metre_per_px = width_m / f64::from(SIZE_PX[0]);
    let middle = 0.5 * DVec2::new(f64::from(SIZE_PX[0]) - 1.0, f64::from(SIZE_PX[1]) - 1.0);
    centres_px()
        .map(|centre| {
            let right = metre_per_px * (centre - middle);
            Circle { centre_ned_m: DVec3::new(-right.y, right.x, 0.0), radius_m: metre_per_px * RADIUS_PX }
        })
        .collect()
}

impl Circle {
    /// The circle's image under a projection of ground points; `None` if a point has no image.
    #[must_use]
    pub fn image(&self, project: impl Fn(DVec3) -> Option<DVec2>) -> Option<CircleImage> {
        let rim = (0..RIM_VERTICES).map(|i| {
            let (sin, cos) = (std::f64::consts::TAU * f64::from(i) / f64::from(RIM_VERTICES)).sin_cos();
            project(self.centre_ned_m + self.radius_m * DVec3::new(cos, sin, 0.0))
        });
        let rim: Vec<DVec2> = rim.collect::<Option<_>>()?;
        let centre_px = project(self.centre_ned_m)?;
        // Moments of the polygon about the centre, to avoid cancellation.
        let (mut twice_area, mut moment) = (0.0, DVec2::ZERO);
        for i in 0..rim.len() {
            let (a, b) = (rim[i] - centre_px, rim[(i + 1) % rim.len()] - centre_px);
            let cross = a.perp_dot(b);
            twice_area += cross;
            moment += (a + b) * cross;
        }
        let low = rim.iter().copied().fold(centre_px, DVec2::min);
        let high = rim.iter().copied().fold(centre_px, DVec2::max);
        let centroid_px = centre_px + moment / (3.0 * twice_area);
        centroid_px.is_finite().then_some(CircleImage {
            centroid_px,
            area_px2: 0.5 * twice_area.abs(),
            centre_px,
            bounds_px: [low, high],
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn centroid_of_a_tilted_circle_is_not_the_image_of_its_centre() {
        let circle = Circle { centre_ned_m: DVec3::new(1.0, 2.0, 0.0), radius_m: 0.5 };
        let flat = circle.image(|p| Some(p.truncate() * 100.0)).expect("in view");
        assert!(flat.centroid_px.distance(DVec2::new(100.0, 200.0)) < 1e-9);
        assert!((flat.area_px2 / (std::f64::consts::PI * 2500.0) - 1.0).abs() < 1e-4);
        // Perspective along x only: the image is a conic whose centre is the mean of both ends of its axis.
        let tilted =
            circle.image(|p| Some(DVec2::new(p.x, p.y - 2.0) / (3.0 - p.x) * 100.0)).expect("in view");
        let ends = [0.5, 1.5].map(|x| 100.0 * x / (3.0 - x));
        assert!((tilted.centroid_px.x - 0.5 * (ends[0] + ends[1])).abs() < 1e-3, "{tilted:?}");
        assert!((tilted.centre_px.x - 50.0).abs() < 1e-12 && tilted.centroid_px.x > 55.0);
        assert_eq!(circle.image(|_| None), None);
    }

    #[test]
    fn texture_has_the_listed_circles() {
        let (texture, circles) = (texture(), circles(1830.0));
        assert_eq!(circles.len(), 44);
        let dark = texture.rgba8.chunks_exact(4).filter(|pixel| pixel[0] < 188).count() as f64;
        assert!((dark / 44.0 / (std::f64::consts::PI * 45.0 * 45.0) - 1.0).abs() < 0.01, "{dark}");
        for circle in circles {
            // One metre per pixel; north is up.
            let [x, y] = [circle.centre_ned_m.y + 914.5, 664.5 - circle.centre_ned_m.x];
            let value = |dx: f64, dy: f64| texture.rgba8[4 * ((y + dy) * 1830.0 + x + dx).round() as usize];
            assert_eq!([value(0.0, 0.0), value(44.0, 0.0), value(0.0, -44.0)], [0, 0, 0]);
            assert_eq!([value(46.0, 0.0), value(0.0, -46.0)], [255, 255]);
        }
    }
}
