//! A scan of the forward function: where each direction ends, and the image of the border.

use std::f64::consts::{PI, TAU};

use camsim_core::lens::{Lens, LensModel};
use glam::{DVec2, DVec3};

use crate::sets::Set;

pub const RAYS: usize = 240;
const STEPS: usize = 500;
/// Finite differences of images beyond, in units of the focal length, are rounding errors.
const UNDECIDED: f64 = 1e6;
/// Neighbouring directions whose ends differ by more than this ratio end on different sheets of the border.
const SHEET_RATIO: f64 = 1.1;

pub fn ray(phi: f64, theta: f64) -> DVec3 {
    (DVec2::from_angle(phi) * theta.sin()).extend(theta.cos())
}

/// The directions lie between the rays of the library's fold curves.
pub fn direction(i: usize) -> f64 {
    (i as f64 + 0.37) * TAU / RAYS as f64
}

/// Where a scan along a direction ends: the last regular angle and the first that is not.
pub struct Border {
    pub last_good: f64,
    pub first_bad: f64,
    /// The first regular angle whose image is far from the picture.
    far: Option<f64>,
    /// The image was flung to infinity and came back from the other side.
    is_pole: bool,
}

impl Set {
    fn distorted(&self, ray: DVec3) -> DVec2 {
        (self.camera.project_ray(ray) - self.camera.principal_point_px) / self.camera.focal_px
    }

    /// Whether the forward function is regular at the angle theta in the direction phi: finite, and with a positive
    /// determinant of its finite differences in the plane of angles; of rotation-symmetric lenses both
    /// magnifications are positive.
    fn is_regular(&self, phi: f64, theta: f64) -> bool {
        let image = |at: DVec2| self.distorted(ray(at.y.atan2(at.x), at.length()));
        let (at, h) = (DVec2::from_angle(phi) * theta, 1e-6);
        let [a, b] =
            [DVec2::X, DVec2::Y].map(|axis| (image(at + h * axis) - image(at - h * axis)) / (2.0 * h));
        let is_positive = !matches!(self.camera.lens, Lens::Radial(_)) || a.x + b.y > 0.0;
        a.perp_dot(b) > 0.0 && is_positive
    }

    /// Angles that a lens may have: those of a plane, or all.
    pub fn limit(&self) -> f64 {
        let is_flat =
            matches!(self.camera.lens.model(), LensModel::BrownConrady | LensModel::BrownConradyPrism);
        if is_flat { 89.0 * PI / 180.0 } else { PI * (1.0 - 1e-4) }
    }

    pub fn border(&self, phi: f64, to: f64) -> Border {
        let step = self.limit() / STEPS as f64;
        let (mut before, mut far) = (DVec2::ZERO, None);
        let far_px = 3.0 * DVec2::from(self.camera.size_px.map(f64::from)).length();
        for i in 1..=STEPS {
            let theta = i as f64 * step;
            let image = self.distorted(ray(phi, theta));
            let is_pole = image.dot(before) < 0.0 && image.length().min(before.length()) > 1.0;
            if image.length() > UNDECIDED {
                return Border {
                    last_good: theta - step,
                    first_bad: self.limit() + step,
                    far,
                    is_pole: false,
                };
            }
            if is_pole || theta > to || !self.is_regular(phi, theta) {
                return Border { last_good: theta - step, first_bad: theta, far, is_pole };
            }
            if (image * self.camera.focal_px).length() > far_px {
                far.get_or_insert(theta);
            }
            before = image;
        }
        Border { last_good: self.limit(), first_bad: self.limit() + step, far, is_pole: false }
    }
}

/// The image of the border, or of a curve within it where the border's is far.
pub struct Rim {
    pub px: Vec<DVec2>,
    pub is_whole: bool,
}

/// `None` if a direction ends at a pole nearby, or beside one that ends much farther out: between both the curve
/// is not known.
pub fn border_px(set: &Set, borders: &[Border], limit: f64) -> Option<Rim> {
    let end = |(i, border): (usize, &Border)| {
        let phi = direction(i);
        if let Some(far) = border.far.filter(|far| *far < limit) {
            return (phi, far);
        }
        // The scan ends within a step of the border: here by bisection.
        let (mut low, mut high) = (border.last_good, border.first_bad.min(set.limit()));
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            *(if set.is_regular(phi, middle) { &mut low } else { &mut high }) = middle;
        }
        (phi, low.min(limit) * (1.0 - 1e-6))
    };
    let image = |(phi, theta): (f64, f64)| {
        let px = set.camera.project_ray(ray(phi, theta));
        (px.is_finite() && px.length() < 1e5).then_some(px)
    };
    let ends: Vec<(f64, f64)> = borders.iter().enumerate().map(end).collect();
    let is_one_sheet = ends.iter().zip(ends.iter().cycle().skip(1)).all(|((_, a), (_, b))| {
        let ratio = a / b;
        (1.0 / SHEET_RATIO..SHEET_RATIO).contains(&ratio)
    });
    let is_whole = !borders.iter().any(|border| border.far.is_some_and(|far| far < limit));
    let is_known = borders.iter().all(|border| border.far.is_some() || !border.is_pole);
    let px = ends.into_iter().map(image).collect::<Option<Vec<DVec2>>>();
    px.filter(|_| is_known && is_one_sheet).map(|px| Rim { px, is_whole })
}
