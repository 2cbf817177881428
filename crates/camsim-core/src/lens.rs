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
//! [`direction`]), its two lines below, and a variant of [`LensModel`].

use std::sync::Arc;

use glam::{DMat2, DVec2, DVec3};

use crate::scenario::{CameraSpec, Face, LoadedFile};

pub use crate::scenario::LensModel;

mod branch;
mod brown_conrady;
mod brown_conrady_prism;
mod bulk;
mod circle;
mod class;
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

use class::LensClass;
use facts::Shape;
pub(crate) use fold::MAX_FIELD_RAD;
use scaled::RadialScale;

impl ModelFacts {
    /// What is known of a model.
    #[must_use]
    pub const fn of(model: LensModel) -> &'static Self {
        match model {
            LensModel::Pinhole => &pinhole::FACTS,
            LensModel::BrownConrady => &brown_conrady::FACTS,
            LensModel::KannalaBrandt => &kannala_brandt::FACTS,
            LensModel::BrownConradyPrism => &brown_conrady_prism::FACTS,
            LensModel::Fisheye624 => &fisheye624::FACTS,
            LensModel::FTheta => &f_theta::FACTS,
            LensModel::FThetaInverse => &f_theta::INVERSE_FACTS,
            LensModel::DoubleSphere => &double_sphere::FACTS,
            LensModel::Eucm => &eucm::FACTS,
            LensModel::Ucm => &ucm::FACTS,
            LensModel::Mei => &mei::FACTS,
            LensModel::Division => &division::FACTS,
            LensModel::Fov => &fov::FACTS,
            LensModel::Equirectangular => &equirectangular::FACTS,
            LensModel::Table => &table::FACTS,
        }
    }
}

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

/// What a lens does by its class.
macro_rules! of_class {
    ($lens:expr, $class:ident => $value:expr) => {
        match $lens {
            Lens::Pinhole($class) => $value,
            Lens::BrownConrady($class) => $value,
            Lens::Radial($class) => $value,
            Lens::Direction($class) => $value,
            Lens::Face($class) => $value,
            Lens::Scaled($class) => $value,
            Lens::Circle($class) => $value,
        }
    };
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
            model: model.name(),
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

    /// Whether it is another lens that is altered, which is inverted by that one's inverse: in a face's axes, scaled, or
    /// within an image circle.
    #[must_use]
    pub fn is_altered(&self) -> bool {
        of_class!(self, lens => lens.altered().is_some())
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
        of_class!(self, lens => lens.model())
    }

    /// All coefficients in the model's order, zeros included.
    pub fn coefficients(&self) -> &[f64] {
        of_class!(self, lens => lens.coefficients())
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
        of_class!(self, lens => lens.distort(ideal))
    }

    /// `d distorted / d ideal`, analytic.
    pub fn jacobian(&self, ideal: DVec2) -> DMat2 {
        of_class!(self, lens => lens.jacobian(ideal))
    }

    /// Inverse on the principal branch: the ideal point inside the fold with the image `distorted`. `None` if
    /// there is none, also for NaN and infinities.
    pub fn undistort(&self, distorted: DVec2) -> Option<DVec2> {
        of_class!(self, lens => lens.undistort(distorted))
    }

    /// Forward, from a ray of any length, also beside and behind the camera where the lens reaches so far
    /// ([`Lens::contains_ray`]).
    pub fn image(&self, ray: DVec3) -> DVec2 {
        of_class!(self, lens => lens.image(ray))
    }

    /// `d image / d (x, y, z)`, analytic: one column each. The product with the ray is zero.
    pub fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        of_class!(self, lens => lens.gradient(ray))
    }

    /// Inverse on the principal branch: the unit ray with the image `distorted`. `None` if there is none.
    pub fn ray(&self, distorted: DVec2) -> Option<DVec3> {
        of_class!(self, lens => lens.ray(distorted))
    }

    /// Whether a ray lies on the principal branch, so that `ray(image(ray))` is its direction.
    pub fn contains_ray(&self, ray: DVec3) -> bool {
        of_class!(self, lens => lens.contains_ray(ray))
    }

    /// Largest angle off axis of a ray, radians.
    pub fn angle_max_rad(&self) -> f64 {
        of_class!(self, lens => lens.angle_max_rad())
    }

    /// How much the lens magnifies on its axis; 1 for models whose focal length is that of the centre.
    pub fn axial_magnification(&self) -> f64 {
        of_class!(self, lens => lens.axial_magnification())
    }

    /// Border of the principal branch, or `None` for a model without one.
    pub fn fold_curve(&self) -> Option<&FoldCurve> {
        of_class!(self, lens => lens.fold_curve())
    }

    /// Start table of the inverse, or `None` for a model without one.
    pub fn radial_table(&self) -> Option<&RadialTable> {
        of_class!(self, lens => lens.radial_table())
    }

    /// Bound on the distorted radius of ideal points of the principal branch; infinite for a pinhole.
    pub fn distorted_max(&self) -> f64 {
        of_class!(self, lens => lens.distorted_max())
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
        of_class!(self, lens => lens.contains(ideal))
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
