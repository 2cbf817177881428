//! What each class of lenses does.

use std::f64::consts::FRAC_PI_2;

use glam::{DMat2, DVec2, DVec3};

use super::{FoldCurve, Lens, LensModel, RadialTable, direction::gradient_of_plane};

/// Lenses that share an inverse. The functions are those of [`Lens`]; what is omitted is as of the lens that it
/// alters, or else as of a pinhole. A class has a [`LensClass::distort`] or an [`LensClass::image`] of its own, and a
/// [`LensClass::jacobian`] or a [`LensClass::gradient`].
pub(super) trait LensClass {
    /// The lens that it alters.
    fn altered(&self) -> Option<&Lens> {
        None
    }

    fn model(&self) -> LensModel {
        self.altered().map_or(LensModel::Pinhole, Lens::model)
    }

    fn coefficients(&self) -> &[f64] {
        self.altered().map_or(&[], Lens::coefficients)
    }

    fn distort(&self, ideal: DVec2) -> DVec2 {
        self.image(ideal.extend(1.0))
    }

    fn jacobian(&self, ideal: DVec2) -> DMat2 {
        let [x, y, _] = self.gradient(ideal.extend(1.0));
        DMat2::from_cols(x, y)
    }

    fn undistort(&self, distorted: DVec2) -> Option<DVec2>;

    fn image(&self, ray: DVec3) -> DVec2 {
        self.distort(ray.truncate() / ray.z)
    }

    fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        gradient_of_plane(self.jacobian(ray.truncate() / ray.z), ray)
    }

    fn ray(&self, distorted: DVec2) -> Option<DVec3> {
        self.undistort(distorted).map(|ideal| ideal.extend(1.0).normalize())
    }

    fn contains_ray(&self, ray: DVec3) -> bool {
        ray.z > 0.0 && self.contains(ray.truncate() / ray.z)
    }

    fn contains(&self, ideal: DVec2) -> bool {
        if self.altered().is_some() {
            return ideal.is_finite() && self.contains_ray(ideal.extend(1.0));
        }
        let fold = self.fold_curve();
        // Most points are within every radius, and need no angle.
        let is_near = ideal.length_squared() < fold.map_or(f64::INFINITY, FoldCurve::smallest).powi(2);
        let radius = || fold.map_or(f64::INFINITY, |fold| fold.radius(ideal.y.atan2(ideal.x)));
        is_near || ideal.is_finite() && ideal.length() < radius()
    }

    fn angle_max_rad(&self) -> f64 {
        self.altered().map_or(FRAC_PI_2, Lens::angle_max_rad)
    }

    fn axial_magnification(&self) -> f64 {
        self.altered().map_or(1.0, Lens::axial_magnification)
    }

    fn fold_curve(&self) -> Option<&FoldCurve> {
        self.altered().and_then(Lens::fold_curve)
    }

    fn radial_table(&self) -> Option<&RadialTable> {
        None
    }

    fn distorted_max(&self) -> f64 {
        self.altered().map_or(f64::INFINITY, Lens::distorted_max)
    }
}
