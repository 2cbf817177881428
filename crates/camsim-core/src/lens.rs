//! Lens models: ideal `(u, v) = (x/z, y/z)` or a ray `(x, y, z)` to distorted normalised coordinates, and the
//! inverse on the principal branch.
//!
//! A lens is regular in a star-shaped domain about its axis, bounded among ideal points by
//! [`Lens::fold_radius`]: there the Jacobian's determinant or trace, or the model's denominator, reaches zero for
//! the first time along a ray from the axis. Beyond this fold the formula yields mirror images that no real lens
//! shows, so the inverse is `None` for points whose only pre-images lie there.
//!
//! An ideal plane ends before 90 degrees off axis; what reaches farther is asked by rays ([`Lens::image`],
//! [`Lens::ray`], [`Lens::contains_ray`]).
//!
//! A new model needs one file here with its facts and formula (of the radius, [`radial`], or of the ray,
//! [`direction`]), a variant of [`LensModel`] and its line in [`facts`].

use std::sync::Arc;

use glam::{DMat2, DVec2, DVec3};

use crate::scenario::{CameraSpec, Face, LoadedFile};

pub use crate::scenario::LensModel;

mod branch;
mod brown_conrady;
mod brown_conrady_prism;
mod bulk;
mod circle;
mod direction;
mod division;
mod double_sphere;
mod equirectangular;
mod eucm;
mod f_theta;
mod face;
mod facts;
mod fisheye624;
mod fold;
mod foreign;
mod fov;
mod kannala_brandt;
mod mei;
pub mod paper;
mod pinhole;
mod radial;
mod radial_table;
mod scaled;
mod spline;
mod table;
mod ucm;

pub use brown_conrady::BrownConrady;
pub(crate) use bulk::{BLOCK, Block, Bulk};
pub use circle::CircleLens;
pub use direction::DirectionLens;
pub use face::FaceLens;
pub use facts::ModelFacts;
pub use fold::{FOLD_RAYS, FoldCurve};
pub use foreign::{ForeignLens, ForeignLensError, foreign_f_theta, foreign_lens, foreign_model};
pub use pinhole::Pinhole;
pub use radial::RadialLens;
pub use radial_table::{RADIAL_TABLE_LEN, RadialTable};
pub use scaled::ScaledLens;
pub(crate) use scaled::largest_radius;
pub use table::{GridOf, LensGrid, LensGridError, RayChart};

use facts::Shape;
pub(crate) use fold::MAX_FIELD_RAD;
use scaled::RadialScale;

/// Default distorted radius covered by the start table of [`Lens::new`], in units of the focal length; see
/// [`Lens::with_reach`].
pub(crate) const DEFAULT_REACH: f64 = 2.0;

/// Invalid lens coefficients.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LensError {
    /// More coefficients than the model has.
    #[error(
        "lens.coefficients: model \"{model}\" takes at most {max} coefficients ({names}), but {got} are given: {fix}"
    )]
    TooManyCoefficients {
        /// The model's name in files.
        model: &'static str,
        /// Number of coefficients of the model.
        max: usize,
        /// Their names, in order.
        names: String,
        /// Number of coefficients given.
        got: usize,
        /// How to correct it.
        fix: &'static str,
    },
    /// NaN or infinite.
    #[error(
        "lens.coefficients[{index}] is {value}: every coefficient must be a finite number (use 0 for an unused one)"
    )]
    NotFinite {
        /// Position from 0.
        index: usize,
        /// The value.
        value: f64,
    },
    /// A model that is not made of coefficients.
    #[error(
        "lens.model \"table\" is a table of points, and its file has not been read: name it in camera.lens_table"
    )]
    NoTable,
    /// A reach that is not a positive finite number.
    #[error(
        "the lens must reach a positive finite distorted radius, not {0}: check focal_px, principal_point_px and size_px"
    )]
    Reach(f64),
}

/// A lens with the precomputed data of its inverse. Immutable.
#[derive(Clone, Debug, PartialEq)]
pub enum Lens {
    /// No distortion.
    Pinhole(Pinhole),
    /// Radial (polynomial or rational) and tangential.
    BrownConrady(Box<BrownConrady>),
    /// Rotation-symmetric, by the angle off axis.
    Radial(Box<RadialLens>),
    /// Any other function of the ray.
    Direction(Box<DirectionLens>),
    /// Another lens in the axes of one of its faces.
    Face(Box<FaceLens>),
    /// Another lens with its image scaled.
    Scaled(Box<ScaledLens>),
    /// Another lens within its image circle.
    Circle(Box<CircleLens>),
}

impl Lens {
    /// A lens from its model and coefficients in the order of [`ModelFacts::of`]; trailing ones may be left
    /// out.
    pub fn new(model: LensModel, coefficients: &[f64]) -> Result<Self, LensError> {
        Self::with_reach(model, coefficients, DEFAULT_REACH)
    }

    /// As [`Lens::new`], with a start table of the inverse that covers distorted radii `0..=reach` (units of
    /// the focal length), or less if the lens folds before. Points farther out are still solved, from a
    /// poorer start.
    pub fn with_reach(model: LensModel, coefficients: &[f64], reach: f64) -> Result<Self, LensError> {
        if !(reach.is_finite() && reach > 0.0) {
            return Err(LensError::Reach(reach));
        }
        if let Some((index, &value)) = coefficients.iter().enumerate().find(|(_, k)| !k.is_finite()) {
            return Err(LensError::NotFinite { index, value });
        }
        let facts = ModelFacts::of(model);
        let all = facts.complete(coefficients).ok_or_else(|| LensError::TooManyCoefficients {
            model: facts.name,
            max: facts.coefficients.len(),
            names: facts.order(),
            got: coefficients.len(),
            fix: facts.fix,
        })?;
        Ok(match (facts.shape)(&all) {
            Shape::Pinhole => Self::Pinhole(Pinhole),
            Shape::BrownConrady => {
                let mut k = [0.0; 8];
                k.copy_from_slice(&all);
                Self::BrownConrady(Box::new(BrownConrady::new(k, reach)))
            }
            Shape::Radial(formula, linear) => {
                Self::Radial(Box::new(RadialLens::new(model, all, formula, linear, reach)))
            }
            Shape::Direction(formula) => Self::Direction(Box::new(DirectionLens::new(model, all, formula))),
            Shape::Table => return Err(LensError::NoTable),
        })
    }

    /// A lens from a table of points.
    pub fn from_grid(grid: &Arc<LensGrid>) -> Self {
        let formula = table::formula(grid);
        Self::Direction(Box::new(DirectionLens::new(LensModel::Table, Vec::new(), formula)))
    }

    /// The lens of a camera, with this calibration instead of its own: the table that it names, or a model; of
    /// its primary, within its image circle, in the axes of its face.
    pub(crate) fn of_camera(
        spec: &CameraSpec,
        focal_px: DVec2,
        principal_px: DVec2,
        coefficients: &[f64],
        reach: f64,
    ) -> Result<Self, LensError> {
        let grid = spec.lens_table.as_ref().and_then(LoadedFile::content::<LensGrid>);
        let whole = match grid.filter(|_| spec.lens.model == LensModel::Table) {
            Some(grid) => Self::from_grid(&grid),
            None => Self::with_reach(spec.lens.model, coefficients, reach)?,
        };
        let [width, height] = spec.size_px;
        let half_short_px = 0.5 * f64::from(width.min(height));
        let scaled = match spec.primary_scale() {
            Some(terms) => {
                let scale = RadialScale::new(terms, focal_px / half_short_px);
                Self::Scaled(Box::new(ScaledLens::new(whole, scale)))
            }
            None => whole,
        };
        let within = match &spec.image_circle {
            Some(circle) => Self::Circle(Box::new(CircleLens::new(scaled, circle, focal_px, principal_px))),
            None => scaled,
        };
        Ok(match spec.face {
            Some(face) => Self::Face(Box::new(FaceLens::new(within, face))),
            None => within,
        })
    }

    /// The lens that this one alters, if it does: in a face's axes, scaled, or within an image circle.
    fn altered(&self) -> Option<&Self> {
        match self {
            Self::Face(lens) => Some(lens.whole()),
            Self::Scaled(lens) => Some(lens.whole()),
            Self::Circle(lens) => Some(lens.whole()),
            Self::Pinhole(_) | Self::BrownConrady(_) | Self::Radial(_) | Self::Direction(_) => None,
        }
    }

    /// Whether it is another lens that is altered, which is inverted by that one's inverse.
    #[must_use]
    pub fn is_altered(&self) -> bool {
        self.altered().is_some()
    }

    /// The lens in the axes of the whole camera.
    #[must_use]
    pub fn of_whole_camera(&self) -> &Self {
        match self {
            Self::Face(lens) => lens.whole(),
            _ => self,
        }
    }

    /// Which model this is.
    pub fn model(&self) -> LensModel {
        match self {
            Self::Pinhole(_) => LensModel::Pinhole,
            Self::BrownConrady(_) => LensModel::BrownConrady,
            Self::Radial(lens) => lens.model,
            Self::Direction(lens) => lens.model,
            Self::Face(_) | Self::Scaled(_) | Self::Circle(_) => {
                self.altered().map_or(LensModel::Pinhole, Self::model)
            }
        }
    }

    /// All coefficients in the model's order, zeros included.
    pub fn coefficients(&self) -> &[f64] {
        match self {
            Self::Pinhole(_) => &[],
            Self::BrownConrady(lens) => &lens.coefficients,
            Self::Radial(lens) => &lens.coefficients,
            Self::Direction(lens) => &lens.coefficients,
            Self::Face(_) | Self::Scaled(_) | Self::Circle(_) => {
                self.altered().map_or(&[], Self::coefficients)
            }
        }
    }

    /// Whether the lens maps every point to itself, so that neither lens map nor lens inverse is needed.
    pub fn is_identity(&self) -> bool {
        match self {
            Self::Pinhole(_) => true,
            Self::BrownConrady(lens) => lens.coefficients.iter().all(|k| *k == 0.0),
            _ => false,
        }
    }

    /// Forward: ideal to distorted. The formula is evaluated beyond the fold as well; [`Lens::contains`]
    /// tells whether the point is visible.
    #[inline]
    pub fn distort(&self, ideal: DVec2) -> DVec2 {
        match self {
            Self::Pinhole(lens) => lens.distort(ideal),
            Self::BrownConrady(lens) => lens.distort(ideal),
            Self::Radial(lens) => lens.distort(ideal),
            Self::Direction(lens) => lens.distort(ideal),
            Self::Face(lens) => lens.distort(ideal),
            Self::Scaled(lens) => lens.distort(ideal),
            Self::Circle(lens) => lens.distort(ideal),
        }
    }

    /// `d distorted / d ideal`, analytic.
    pub fn jacobian(&self, ideal: DVec2) -> DMat2 {
        match self {
            Self::Pinhole(lens) => lens.jacobian(ideal),
            Self::BrownConrady(lens) => lens.jacobian(ideal),
            Self::Radial(lens) => lens.jacobian(ideal),
            Self::Direction(lens) => lens.jacobian(ideal),
            Self::Face(lens) => lens.jacobian(ideal),
            Self::Scaled(lens) => lens.jacobian(ideal),
            Self::Circle(lens) => lens.jacobian(ideal),
        }
    }

    /// Inverse on the principal branch: the ideal point inside the fold with the image `distorted`. `None` if
    /// there is none, also for NaN and infinities.
    pub fn undistort(&self, distorted: DVec2) -> Option<DVec2> {
        match self {
            Self::Pinhole(lens) => lens.undistort(distorted),
            Self::BrownConrady(lens) => lens.undistort(distorted),
            Self::Radial(lens) => lens.undistort(distorted),
            Self::Direction(lens) => lens.undistort(distorted),
            Self::Face(lens) => lens.undistort(distorted),
            Self::Scaled(lens) => lens.undistort(distorted),
            Self::Circle(lens) => lens.undistort(distorted),
        }
    }

    /// Forward, from a ray of any length, also beside and behind the camera where the lens reaches so far
    /// ([`Lens::contains_ray`]).
    pub fn image(&self, ray: DVec3) -> DVec2 {
        match self {
            Self::Pinhole(_) | Self::BrownConrady(_) => self.distort(ray.truncate() / ray.z),
            Self::Radial(lens) => lens.image(ray),
            Self::Direction(lens) => lens.image(ray),
            Self::Face(lens) => lens.image(ray),
            Self::Scaled(lens) => lens.image(ray),
            Self::Circle(lens) => lens.whole().image(ray),
        }
    }

    /// `d image / d (x, y, z)`, analytic: one column each. The product with the ray is zero.
    pub fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        match self {
            Self::Pinhole(_) | Self::BrownConrady(_) => {
                direction::gradient_of_plane(self.jacobian(ray.truncate() / ray.z), ray)
            }
            Self::Radial(lens) => lens.gradient(ray),
            Self::Direction(lens) => lens.gradient(ray),
            Self::Face(lens) => lens.gradient(ray),
            Self::Scaled(lens) => lens.gradient(ray),
            Self::Circle(lens) => lens.whole().gradient(ray),
        }
    }

    /// Inverse on the principal branch: the unit ray with the image `distorted`. `None` if there is none.
    pub fn ray(&self, distorted: DVec2) -> Option<DVec3> {
        match self {
            Self::Pinhole(_) | Self::BrownConrady(_) => {
                self.undistort(distorted).map(|ideal| ideal.extend(1.0).normalize())
            }
            Self::Radial(lens) => lens.ray(distorted),
            Self::Direction(lens) => lens.ray(distorted),
            Self::Face(lens) => lens.ray(distorted),
            Self::Scaled(lens) => lens.ray(distorted),
            Self::Circle(lens) => lens.ray(distorted),
        }
    }

    /// Whether a ray lies on the principal branch, so that `ray(image(ray))` is its direction.
    pub fn contains_ray(&self, ray: DVec3) -> bool {
        match self {
            Self::Pinhole(_) | Self::BrownConrady(_) => ray.z > 0.0 && self.contains(ray.truncate() / ray.z),
            Self::Radial(lens) => lens.contains_ray(ray),
            Self::Direction(lens) => lens.contains_ray(ray),
            Self::Face(lens) => lens.contains_ray(ray),
            Self::Scaled(lens) => lens.contains_ray(ray),
            Self::Circle(lens) => lens.contains_ray(ray),
        }
    }

    /// Largest angle off axis of a ray, radians.
    pub fn angle_max_rad(&self) -> f64 {
        match self {
            Self::Pinhole(_) => std::f64::consts::FRAC_PI_2,
            Self::BrownConrady(lens) => lens.fold.range().1.atan(),
            Self::Radial(lens) => lens.angle_max_rad(),
            Self::Direction(lens) => lens.angle_max_rad(),
            // Measured from the axis of the face.
            Self::Face(_) => std::f64::consts::PI,
            Self::Scaled(lens) => lens.whole().angle_max_rad(),
            Self::Circle(lens) => lens.whole().angle_max_rad().min(lens.half_angle_rad()),
        }
    }

    /// How much the lens magnifies on its axis; 1 for models whose focal length is that of the centre.
    pub fn axial_magnification(&self) -> f64 {
        match self {
            Self::Pinhole(_) | Self::BrownConrady(_) => 1.0,
            Self::Face(lens) => lens.whole().axial_magnification(),
            Self::Scaled(lens) => lens.axial_scale() * lens.whole().axial_magnification(),
            Self::Circle(lens) => lens.whole().axial_magnification(),
            Self::Radial(_) | Self::Direction(_) => self.jacobian(DVec2::ZERO).determinant().abs().sqrt(),
        }
    }

    /// Border of the principal branch, or `None` for a model without one.
    pub fn fold_curve(&self) -> Option<&FoldCurve> {
        match self {
            Self::Pinhole(_) | Self::Face(_) => None,
            Self::BrownConrady(lens) => Some(&lens.fold),
            Self::Radial(lens) => Some(&lens.fold),
            Self::Direction(lens) => Some(&lens.fold),
            Self::Scaled(lens) => lens.whole().fold_curve(),
            Self::Circle(lens) => lens.whole().fold_curve(),
        }
    }

    /// Start table of the inverse, or `None` for a model without one.
    pub fn radial_table(&self) -> Option<&RadialTable> {
        match self {
            Self::BrownConrady(lens) => Some(&lens.table),
            Self::Radial(lens) => Some(&lens.table),
            _ => None,
        }
    }

    /// Bound on the distorted radius of ideal points of the principal branch; infinite for a pinhole.
    pub fn distorted_max(&self) -> f64 {
        match self {
            Self::Pinhole(_) => f64::INFINITY,
            Self::BrownConrady(lens) => lens.fold.distorted_max(),
            Self::Radial(lens) => lens.distorted_max(),
            Self::Direction(lens) => lens.fold.distorted_max(),
            Self::Face(lens) => lens.whole().distorted_max(),
            Self::Scaled(lens) => lens.distorted_max(),
            Self::Circle(lens) => lens.whole().distorted_max(),
        }
    }

    /// Ideal radius of the border of the principal branch in direction `phi` (radians from +u towards +v);
    /// infinite for a pinhole.
    pub fn fold_radius(&self, phi_rad: f64) -> f64 {
        self.fold_curve().map_or(f64::INFINITY, |fold| fold.radius(phi_rad))
    }

    /// Ideal radius within which all points lie on the principal branch; infinite for a pinhole.
    #[inline]
    pub fn contained_radius(&self) -> f64 {
        if self.is_altered() {
            return 0.0;
        }
        self.fold_curve().map_or(f64::INFINITY, FoldCurve::smallest)
    }

    /// Whether an ideal point lies on the principal branch, so that `undistort(distort(ideal))` is `ideal`.
    pub fn contains(&self, ideal: DVec2) -> bool {
        if self.is_altered() {
            return ideal.is_finite() && self.contains_ray(ideal.extend(1.0));
        }
        // Most points are within every radius, and need no angle.
        let is_near = ideal.length_squared() < self.contained_radius().powi(2);
        is_near || ideal.is_finite() && ideal.length() < self.fold_radius(ideal.y.atan2(ideal.x))
    }
}

impl Lens {
    /// The face whose axes this lens is in.
    #[must_use]
    pub fn face(&self) -> Option<Face> {
        match self {
            Self::Face(lens) => Some(lens.face()),
            _ => None,
        }
    }

    /// Whether an output point is made by this lens's camera: all are but for a face, which leaves to the
    /// others what is theirs.
    #[must_use]
    pub fn holds(&self, distorted: DVec2) -> bool {
        match self {
            Self::Face(lens) => lens.holds(distorted),
            _ => true,
        }
    }
}

#[cfg(test)]
mod tests;
