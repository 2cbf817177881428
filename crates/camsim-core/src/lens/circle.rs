//! A lens that shows a circle of its image only.

use glam::{DMat2, DVec2, DVec3};

use super::{Lens, class::LensClass};
use crate::scenario::ImageCircleSpec;

/// Pixels whose distance is the radius to within rounding are shown.
const HAIR_PX: f64 = 1e-9;

/// A lens and its image circle. Beyond it there are no rays.
#[derive(Clone, Debug, PartialEq)]
pub struct CircleLens {
    whole: Lens,
    focal_px: DVec2,
    /// Among distorted points.
    centre: DVec2,
    radius_px: f64,
    half_angle_rad: f64,
}

impl CircleLens {
    pub(super) fn new(whole: Lens, spec: &ImageCircleSpec, focal_px: DVec2, principal_px: DVec2) -> Self {
        let centre_px = spec.centre_px.map_or(principal_px, DVec2::from);
        Self {
            whole,
            focal_px,
            centre: (centre_px - principal_px) / focal_px,
            radius_px: spec.radius_px.unwrap_or(f64::INFINITY),
            half_angle_rad: spec.half_angle_deg.map_or(f64::INFINITY, f64::to_radians),
        }
    }

    /// The lens without its limit.
    #[must_use]
    pub fn whole(&self) -> &Lens {
        &self.whole
    }

    pub(super) fn shows(&self, ray: DVec3, distorted: DVec2) -> bool {
        ((distorted - self.centre) * self.focal_px).length() <= self.radius_px + HAIR_PX
            && ray.truncate().length().atan2(ray.z) <= self.half_angle_rad
    }
}

impl LensClass for CircleLens {
    fn altered(&self) -> Option<&Lens> {
        Some(&self.whole)
    }

    fn distort(&self, ideal: DVec2) -> DVec2 {
        self.whole.distort(ideal)
    }

    fn jacobian(&self, ideal: DVec2) -> DMat2 {
        self.whole.jacobian(ideal)
    }

    fn undistort(&self, distorted: DVec2) -> Option<DVec2> {
        self.whole.undistort(distorted).filter(|ideal| self.shows(ideal.extend(1.0), distorted))
    }

    fn image(&self, ray: DVec3) -> DVec2 {
        self.whole.image(ray)
    }

    fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        self.whole.gradient(ray)
    }

    fn ray(&self, distorted: DVec2) -> Option<DVec3> {
        self.whole.ray(distorted).filter(|ray| self.shows(*ray, distorted))
    }

    fn contains_ray(&self, ray: DVec3) -> bool {
        self.whole.contains_ray(ray) && self.shows(ray, self.whole.image(ray))
    }

    fn angle_max_rad(&self) -> f64 {
        self.whole.angle_max_rad().min(self.half_angle_rad)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::{
        camera::CameraModel,
        scenario::{CameraSpec, LensModel, LensSpec},
    };

    fn camera(circle: ImageCircleSpec) -> CameraModel {
        CameraModel::from_spec(&CameraSpec {
            size_px: [200, 160],
            focal_px: [80.0, 84.0],
            lens: LensSpec { model: LensModel::KannalaBrandt, coefficients: vec![0.02] },
            image_circle: Some(circle),
            ..CameraSpec::default()
        })
        .unwrap()
    }

    #[test]
    fn pixels_beyond_a_radius_or_an_angle_have_no_ray() {
        let centre = DVec2::new(110.0, 75.0);
        let by_radius = camera(ImageCircleSpec {
            radius_px: Some(60.0),
            centre_px: Some(centre.to_array()),
            ..ImageCircleSpec::default()
        });
        let by_angle = camera(ImageCircleSpec { half_angle_deg: Some(40.0), ..ImageCircleSpec::default() });
        let mut counts = [0; 2];
        for i in 0..200 * 160 {
            let pixel = DVec2::new(f64::from(i % 200), f64::from(i / 200));
            assert_eq!(by_radius.ray(pixel).is_some(), pixel.distance(centre) <= 60.0, "{pixel}");
            let distorted = by_angle.distorted_from_pixel(pixel).length();
            // The image of 40 degrees, by the model's formula.
            let angle = 40_f64.to_radians();
            let is_seen = distorted <= angle * (1.0 + 0.02 * angle * angle);
            assert_eq!(by_angle.ray(pixel).is_some(), is_seen, "{pixel}");
            assert_eq!(by_angle.unproject(pixel).is_some(), is_seen, "{pixel}");
            counts[0] += usize::from(is_seen);
            counts[1] += usize::from(by_radius.ray(pixel).is_some());
        }
        assert!(counts.iter().all(|count| (9000..13_000).contains(count)), "{counts:?}");
        let beyond = DVec3::new(1.0, 0.0, 1.0);
        assert!(!by_angle.lens.contains_ray(beyond) && !by_angle.lens.contains(DVec2::X));
        assert!(
            by_angle.lens.contains(DVec2::new(0.5, 0.5))
                && (by_angle.lens.angle_max_rad() - 40_f64.to_radians()).abs() < 1e-15
        );
    }
}
