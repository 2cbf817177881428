//! Rotation-symmetric lenses: the distorted radius is a function of the angle off axis.

use std::{f64::consts::PI, fmt::Debug, sync::Arc};

use glam::{DMat2, DVec2, DVec3};

use super::LensModel;
use super::class::LensClass;
use super::fold::{FoldCurve, MAX_FIELD_RAD, first_irregular, first_irregular_angle};
use super::radial_table::RadialTable;

/// Below this ideal radius a lens is linear to the last bit.
const ON_AXIS: f64 = 1e-9;

/// Residual of a solution, in units of the focal length (relative beyond 1).
const MAX_RESIDUAL: f64 = 1e-9;

/// Distorted radius as a function of the angle off axis.
pub(super) trait RadialFormula: Debug + Send + Sync {
    /// Distorted radius at an angle of 0 to pi, in units of the focal length; NaN where there is none.
    fn radius(&self, angle: f64) -> f64;

    /// Its derivative.
    fn slope(&self, angle: f64) -> f64;

    /// Positive where the formula is defined: a denominator or the argument of a root.
    fn margin(&self, _angle: f64) -> f64 {
        1.0
    }

    /// Largest angle that the calibration covers.
    fn angle_max(&self) -> f64 {
        PI
    }
}

/// A rotation-symmetric lens, with a linear map of the image after it.
///
/// The principal branch ends at the first angle at which the radius stops growing or the formula ends. Within,
/// the radius is monotone, so the inverse is unique. Ideal points of a plane end at `MAX_FIELD_RAD`, rays at
/// 180 degrees.
#[derive(Clone, Debug)]
pub struct RadialLens {
    pub(super) model: LensModel,
    pub(super) coefficients: Vec<f64>,
    formula: Arc<dyn RadialFormula>,
    /// The linear map and its inverse, unless it is the identity.
    linear: Option<[DMat2; 2]>,
    pub(super) fold: FoldCurve,
    /// Angle over distorted radius against distorted radius.
    pub(super) table: RadialTable,
    /// Largest angle of an ideal point.
    theta_max: f64,
    /// Largest angle of a ray.
    angle_max: f64,
}

impl PartialEq for RadialLens {
    fn eq(&self, other: &Self) -> bool {
        self.model == other.model && self.coefficients == other.coefficients && self.table == other.table
    }
}

impl RadialLens {
    pub(super) fn new(
        model: LensModel,
        coefficients: Vec<f64>,
        formula: Arc<dyn RadialFormula>,
        linear: DMat2,
        reach: f64,
    ) -> Self {
        let covered = formula.angle_max();
        let margins = |angle: f64| {
            let is_covered = angle <= covered && formula.margin(angle) > 0.0;
            [formula.slope(angle), if is_covered { 1.0 } else { -1.0 }]
        };
        let fold_angle = first_irregular_angle(margins);
        let angle_max = fold_angle.or_else(|| first_irregular(PI, margins)).unwrap_or(PI);
        let theta_max = fold_angle.unwrap_or(MAX_FIELD_RAD);
        let at_axis = formula.slope(0.0).recip();
        let table = RadialTable::new(theta_max, reach, at_axis, |theta| formula.radius(theta));
        let linear = (linear != DMat2::IDENTITY).then(|| [linear, linear.inverse()]);
        let forward = |ideal| distort(&*formula, linear.as_ref(), ideal);
        let fold = FoldCurve::new(|_| fold_angle.map(f64::tan), true, forward);
        Self { model, coefficients, formula, linear, fold, table, theta_max, angle_max }
    }

    /// Largest angle off axis of an ideal point, radians.
    pub fn theta_max_rad(&self) -> f64 {
        self.theta_max
    }

    /// Whether there is no linear map of the image.
    pub(super) fn is_linear_identity(&self) -> bool {
        self.linear.is_none()
    }

    /// Distorted radius at an angle off axis.
    pub(super) fn radius(&self, angle: f64) -> f64 {
        self.formula.radius(angle)
    }

    /// A distorted point before the linear map of the image.
    pub(super) fn without_linear(&self, distorted: DVec2) -> DVec2 {
        self.linear.map_or(distorted, |[_, inverse]| inverse * distorted)
    }

    /// Angle off axis of a distorted radius, up to a largest one. Bracketed Newton iteration, started from the
    /// table.
    pub(super) fn angle_of(&self, radius: f64, angle_max: f64) -> f64 {
        let (mut low, mut high) = (0.0, angle_max);
        let mut theta = (radius * self.table.ratio(radius)).clamp(low, high);
        for _ in 0..60 {
            let error = self.formula.radius(theta) - radius;
            if error > 0.0 {
                high = theta;
            } else {
                low = theta;
            }
            let newton = theta - error / self.formula.slope(theta);
            // `>=` and `<=`, not strict: once a bracket end is the root itself, a strict test would bisect
            // away from it.
            let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
            let moved = (next - theta).abs();
            theta = next;
            if moved <= 2e-16 * theta {
                break;
            }
        }
        let is_there = (self.formula.radius(theta) - radius).abs() <= MAX_RESIDUAL * (1.0 + radius);
        if is_there { theta } else { self.bisect(radius, angle_max) }
    }

    /// Beside a pole Newton's steps are too short.
    fn bisect(&self, radius: f64, angle_max: f64) -> f64 {
        let (mut low, mut high) = (0.0, angle_max);
        for _ in 0..60 {
            let middle = 0.5 * (low + high);
            *(if self.formula.radius(middle) > radius { &mut high } else { &mut low }) = middle;
        }
        0.5 * (low + high)
    }
}

impl LensClass for RadialLens {
    fn model(&self) -> LensModel {
        self.model
    }

    fn coefficients(&self) -> &[f64] {
        &self.coefficients
    }

    fn distort(&self, ideal: DVec2) -> DVec2 {
        distort(&*self.formula, self.linear.as_ref(), ideal)
    }

    /// `t I + (m - t) e e^T` with `e = (u, v)/r`, the tangential magnification `t = g(theta) / r` and the
    /// meridional one `m = g'(theta) / (1 + r^2)`.
    fn jacobian(&self, ideal: DVec2) -> DMat2 {
        let r = ideal.length();
        let jacobian = if r < ON_AXIS {
            DMat2::IDENTITY * self.formula.slope(0.0)
        } else {
            let theta = r.atan();
            let tangential = self.formula.radius(theta) / r;
            let meridional = self.formula.slope(theta) / (1.0 + r * r);
            let e = ideal / r;
            let outer = DMat2::from_cols(e * e.x, e * e.y);
            DMat2::IDENTITY * tangential + outer * (meridional - tangential)
        };
        self.linear.map_or(jacobian, |[linear, _]| linear * jacobian)
    }

    fn undistort(&self, distorted: DVec2) -> Option<DVec2> {
        let distorted = self.without_linear(distorted);
        let radius = distorted.length();
        if !distorted.is_finite() || radius > self.formula.radius(self.theta_max) {
            return None;
        }
        if radius < 1e-12 {
            return Some(distorted / self.formula.slope(0.0));
        }
        Some(distorted * (self.angle_of(radius, self.theta_max).tan() / radius))
    }

    fn image(&self, ray: DVec3) -> DVec2 {
        let across = ray.truncate();
        let r = across.length();
        let image = if r < ON_AXIS * ray.z {
            across * (self.formula.slope(0.0) / ray.z)
        } else {
            // Straight behind, every direction of the image is as good.
            let e = across.try_normalize().unwrap_or(DVec2::X);
            e * self.formula.radius(r.atan2(ray.z))
        };
        self.linear.map_or(image, |[linear, _]| linear * image)
    }

    fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        let (across, n2) = (ray.truncate(), ray.length_squared());
        let r = across.length();
        let columns = if r < ON_AXIS * ray.z {
            let slope = self.formula.slope(0.0) / ray.z;
            [DVec2::X * slope, DVec2::Y * slope, -across * (slope / ray.z)]
        } else {
            let theta = r.atan2(ray.z);
            let (e, slope) = (across.try_normalize().unwrap_or(DVec2::X), self.formula.slope(theta));
            let tangential = self.formula.radius(theta) / r;
            let meridional = slope * ray.z / n2;
            let column = |axis: DVec2| axis * tangential + e * (e.dot(axis) * (meridional - tangential));
            [column(DVec2::X), column(DVec2::Y), e * (-slope * r / n2)]
        };
        self.linear.map_or(columns, |[linear, _]| columns.map(|column| linear * column))
    }

    fn ray(&self, distorted: DVec2) -> Option<DVec3> {
        let distorted = self.without_linear(distorted);
        let radius = distorted.length();
        if !distorted.is_finite() || radius > self.formula.radius(self.angle_max) {
            return None;
        }
        if radius < 1e-12 {
            return Some((distorted / self.formula.slope(0.0)).extend(1.0));
        }
        let (sin, cos) = self.angle_of(radius, self.angle_max).sin_cos();
        Some((distorted * (sin / radius)).extend(cos))
    }

    fn contains_ray(&self, ray: DVec3) -> bool {
        ray.truncate().length().atan2(ray.z) < self.angle_max
    }

    fn angle_max_rad(&self) -> f64 {
        self.angle_max
    }

    fn axial_magnification(&self) -> f64 {
        self.jacobian(DVec2::ZERO).determinant().abs().sqrt()
    }

    fn fold_curve(&self) -> Option<&FoldCurve> {
        Some(&self.fold)
    }

    fn radial_table(&self) -> Option<&RadialTable> {
        Some(&self.table)
    }

    fn distorted_max(&self) -> f64 {
        match self.linear {
            None => self.formula.radius(self.theta_max),
            Some(_) => self.fold.distorted_max(),
        }
    }
}

fn distort(formula: &dyn RadialFormula, linear: Option<&[DMat2; 2]>, ideal: DVec2) -> DVec2 {
    let r = ideal.length();
    let image = if r < ON_AXIS { ideal * formula.slope(0.0) } else { ideal * (formula.radius(r.atan()) / r) };
    linear.map_or(image, |[linear, _]| *linear * image)
}

/// A radial model without a linear map.
pub(super) fn radial(formula: impl RadialFormula + 'static) -> super::facts::Shape {
    super::facts::Shape::Radial(Arc::new(formula), DMat2::IDENTITY)
}
