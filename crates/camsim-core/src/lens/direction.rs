//! Lenses that are any function of the ray, and the chart in which they are inverted.

use std::{f64::consts::PI, fmt::Debug, sync::Arc};

use glam::{DMat2, DVec2, DVec3};

use super::LensModel;
use super::branch::{Branch, ChartMap};
use super::bulk::PlaneFormula;
use super::class::LensClass;
use super::fold::{FoldCurve, MAX_FIELD_RAD};

/// A distorted point as a function of the ray.
pub(super) trait DirectionFormula: Debug + Send + Sync {
    /// Forward: depends on the ray's direction alone; NaN where the formula is not defined.
    fn image(&self, ray: DVec3) -> DVec2;

    /// `d image / d (x, y, z)`: one column each.
    fn gradient(&self, ray: DVec3) -> [DVec2; 3];

    /// Positive where the formula is defined.
    fn margin(&self, _ray: DVec3) -> f64 {
        1.0
    }

    /// Largest angle off axis for which the formula is meant.
    fn angle_max(&self) -> f64 {
        PI
    }

    /// The inverse, for a formula that knows it. Its image is then one-to-one wherever it is finite.
    fn closed_inverse(&self) -> Option<&dyn ClosedInverse> {
        None
    }

    /// The formula as a map of a plane, for inverses of many points.
    fn plane(&self) -> Option<&dyn PlaneFormula> {
        None
    }
}

/// An inverse without iterations, or one that certifies itself.
pub(super) trait ClosedInverse {
    /// The unit ray of a distorted point.
    fn ray(&self, distorted: DVec2) -> Option<DVec3>;

    /// Ideal radius of the last ideal point in a direction of the plane; `None` if only the plane ends.
    fn ideal_radius(&self, phi_rad: f64) -> Option<f64>;
}

/// A lens that is any function of the ray.
///
/// It is inverted in the chart `a = theta (cos phi, sin phi)` of rays at the angle theta off axis, which holds
/// all rays but the one straight behind.
#[derive(Clone, Debug)]
pub struct DirectionLens {
    pub(super) model: LensModel,
    pub(super) coefficients: Vec<f64>,
    formula: Arc<dyn DirectionFormula>,
    /// Border of the principal branch among ideal points.
    pub(super) fold: FoldCurve,
    /// `None` where the formula has a closed inverse.
    branch: Option<Arc<Branch>>,
}

impl PartialEq for DirectionLens {
    fn eq(&self, other: &Self) -> bool {
        self.model == other.model && self.coefficients == other.coefficients && self.fold == other.fold
    }
}

impl DirectionLens {
    pub(super) fn new(model: LensModel, coefficients: Vec<f64>, formula: Arc<dyn DirectionFormula>) -> Self {
        let distort = |ideal: DVec2| formula.image(ideal.extend(1.0));
        let angles = Angles(&*formula);
        let branch = formula.closed_inverse().is_none().then(|| {
            Arc::new(Branch::new(&angles, formula.angle_max().min(PI * (1.0 - 1e-9)), MAX_FIELD_RAD))
        });
        let fold = match formula.closed_inverse() {
            Some(closed) => FoldCurve::new(|phi| closed.ideal_radius(phi), false, distort),
            None => {
                // The rays of both curves are the same.
                let radius = |phi: f64| branch.as_ref().map(|branch| branch.radius(phi));
                let ideal = |phi: f64| radius(phi).filter(|angle| *angle < MAX_FIELD_RAD).map(f64::tan);
                FoldCurve::new(ideal, false, distort)
            }
        };
        Self { model, coefficients, formula, fold, branch }
    }

    /// Angle off axis within which every ray lies on the principal branch, radians.
    pub(super) fn smallest_angle(&self) -> f64 {
        self.branch.as_ref().map_or(0.0, |branch| branch.radius_min())
    }

    pub(super) fn plane(&self) -> Option<&dyn PlaneFormula> {
        self.formula.plane()
    }
}

impl LensClass for DirectionLens {
    fn model(&self) -> LensModel {
        self.model
    }

    fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    fn undistort(&self, distorted: DVec2) -> Option<DVec2> {
        let ray = self.ray(distorted)?;
        (ray.z > MAX_FIELD_RAD.cos() * ray.length()).then(|| ray.truncate() / ray.z)
    }

    fn image(&self, ray: DVec3) -> DVec2 {
        self.formula.image(ray)
    }

    fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        self.formula.gradient(ray)
    }

    fn ray(&self, distorted: DVec2) -> Option<DVec3> {
        if !distorted.is_finite() {
            return None;
        }
        match (&self.branch, self.formula.closed_inverse()) {
            (Some(branch), _) => branch.solve(&Angles(&*self.formula), distorted).map(ray_of),
            (None, Some(closed)) => closed.ray(distorted),
            (None, None) => None,
        }
    }

    fn contains_ray(&self, ray: DVec3) -> bool {
        match &self.branch {
            Some(branch) => branch.contains(&Angles(&*self.formula), angles_of(ray)),
            None => self.formula.image(ray).is_finite(),
        }
    }

    fn angle_max_rad(&self) -> f64 {
        self.branch.as_ref().map_or(PI, |branch| branch.radius_max())
    }

    fn axial_magnification(&self) -> f64 {
        self.jacobian(DVec2::ZERO).determinant().abs().sqrt()
    }

    fn fold_curve(&self) -> Option<&FoldCurve> {
        Some(&self.fold)
    }

    fn distorted_max(&self) -> f64 {
        self.fold.distorted_max()
    }
}

/// A formula in the chart of angles.
struct Angles<'a>(&'a dyn DirectionFormula);

impl ChartMap for Angles<'_> {
    fn value(&self, angles: DVec2) -> DVec2 {
        self.0.image(ray_of(angles))
    }

    fn jacobian(&self, angles: DVec2) -> DMat2 {
        let [x, y, z] = self.0.gradient(ray_of(angles));
        let theta = angles.length();
        let fraction = sinc(theta);
        // d(sin t e)/da = sinc I + (cos t - sinc) e e^T, d(cos t)/da = -sin t e.
        let e = if theta > 0.0 { angles / theta } else { DVec2::X };
        let along = (theta.cos() - fraction) * (x * e.x + y * e.y) - theta.sin() * z;
        DMat2::from_cols(x * fraction + along * e.x, y * fraction + along * e.y)
    }

    fn margin(&self, angles: DVec2) -> f64 {
        self.0.margin(ray_of(angles))
    }
}

/// Unit ray of a point of the chart.
pub(super) fn ray_of(angles: DVec2) -> DVec3 {
    let theta = angles.length();
    (angles * sinc(theta)).extend(theta.cos())
}

/// Point of the chart of a ray; for the one straight behind, one of its many.
pub(super) fn angles_of(ray: DVec3) -> DVec2 {
    let across = ray.truncate();
    let r = across.length();
    if r < 1e-9 * ray.z {
        return across / ray.z;
    }
    across.try_normalize().unwrap_or(DVec2::X) * r.atan2(ray.z)
}

/// `d angles_of / d (x, y, z)`: one column each.
pub(super) fn angles_gradient(ray: DVec3) -> [DVec2; 3] {
    let (across, n2) = (ray.truncate(), ray.length_squared());
    let r = across.length();
    if r < 1e-9 * ray.z {
        return [DVec2::X / ray.z, DVec2::Y / ray.z, -across / (ray.z * ray.z)];
    }
    let (e, theta) = (across.try_normalize().unwrap_or(DVec2::X), r.atan2(ray.z));
    let (tangential, meridional) = (theta / r, ray.z / n2);
    let column = |axis: DVec2| axis * tangential + e * (e.dot(axis) * (meridional - tangential));
    [column(DVec2::X), column(DVec2::Y), e * (-r / n2)]
}

/// Gradient of a function of `(x/z, y/z)` from its Jacobian.
pub(super) fn gradient_of_plane(jacobian: DMat2, ray: DVec3) -> [DVec2; 3] {
    let ideal = ray.truncate() / ray.z;
    [jacobian.x_axis / ray.z, jacobian.y_axis / ray.z, -(jacobian * ideal) / ray.z]
}

fn sinc(theta: f64) -> f64 {
    if theta < 1e-9 { 1.0 } else { theta.sin() / theta }
}

/// A model that is any function of the ray.
pub(super) fn direction(formula: impl DirectionFormula + 'static) -> super::facts::Shape {
    super::facts::Shape::Direction(Arc::new(formula))
}
