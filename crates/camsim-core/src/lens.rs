//! Lens models: ideal `(u, v) = (x/z, y/z)` to distorted normalised coordinates, and the inverse on the
//! principal branch.
//!
//! A lens is regular in a star-shaped domain about its axis, bounded by [`Lens::fold_radius`]: there the
//! Jacobian's determinant or trace, or the model's denominator, reaches zero for the first time along a ray
//! from the axis. Beyond this fold the formula yields mirror images that no real lens shows, so the inverse
//! is `None` for points whose only pre-images lie there.
//!
//! A new model needs one file here with the same five functions (`distort`, `jacobian`, `undistort`, domain,
//! start table), one WGSL file of the same name, and one line in each `match` below.

use glam::{DMat2, DVec2};

pub use crate::scenario::LensModel;

mod brown_conrady;
mod fold;
mod kannala_brandt;
pub mod paper;
mod pinhole;
mod radial_table;

pub use brown_conrady::BrownConrady;
pub use fold::{FOLD_RAYS, FoldCurve};
pub use kannala_brandt::KannalaBrandt;
pub use pinhole::Pinhole;
pub use radial_table::{RADIAL_TABLE_LEN, RadialTable};

/// Default distorted radius covered by the start table of [`Lens::new`], in units of the focal length; see
/// [`Lens::with_reach`].
const DEFAULT_REACH: f64 = 2.0;

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
        names: &'static str,
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
    /// Equidistant fisheye polynomial.
    KannalaBrandt(Box<KannalaBrandt>),
}

impl Lens {
    /// A lens from its model and coefficients: `k1 k2 p1 p2 k3 k4 k5 k6` (Brown-Conrady), `k1 k2 k3 k4`
    /// (Kannala-Brandt), none (pinhole); trailing zeros may be left out.
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
        Ok(match model {
            LensModel::Pinhole => {
                padded::<0>(
                    coefficients,
                    "pinhole",
                    "none",
                    "leave them out, or set lens.model to the model they belong to",
                )?;
                Self::Pinhole(Pinhole)
            }
            LensModel::BrownConrady => {
                let fix = "OpenCV's thin-prism and tilt terms are not modelled; leave them out if they are zero, else recalibrate without";
                let k = padded(coefficients, "brown-conrady", "k1 k2 p1 p2 k3 k4 k5 k6", fix)?;
                Self::BrownConrady(Box::new(BrownConrady::new(k, reach)))
            }
            LensModel::KannalaBrandt => {
                let k = padded(
                    coefficients,
                    "kannala-brandt",
                    "k1 k2 k3 k4",
                    "leave the others out, or set model = \"brown-conrady\"",
                )?;
                Self::KannalaBrandt(Box::new(KannalaBrandt::new(k, reach)))
            }
        })
    }

    /// Which model this is.
    pub fn model(&self) -> LensModel {
        match self {
            Self::Pinhole(_) => LensModel::Pinhole,
            Self::BrownConrady(_) => LensModel::BrownConrady,
            Self::KannalaBrandt(_) => LensModel::KannalaBrandt,
        }
    }

    /// All coefficients in the model's order, zeros included.
    pub fn coefficients(&self) -> &[f64] {
        match self {
            Self::Pinhole(_) => &[],
            Self::BrownConrady(lens) => &lens.coefficients,
            Self::KannalaBrandt(lens) => &lens.coefficients,
        }
    }

    /// Whether the lens maps every point to itself, so that neither lens map nor lens inverse is needed.
    pub fn is_identity(&self) -> bool {
        match self {
            Self::Pinhole(_) => true,
            Self::BrownConrady(lens) => lens.coefficients.iter().all(|k| *k == 0.0),
            Self::KannalaBrandt(_) => false,
        }
    }

    /// Forward: ideal to distorted. The formula is evaluated beyond the fold as well; [`Lens::contains`]
    /// tells whether the point is visible.
    #[inline]
    pub fn distort(&self, ideal: DVec2) -> DVec2 {
        match self {
            Self::Pinhole(lens) => lens.distort(ideal),
            Self::BrownConrady(lens) => lens.distort(ideal),
            Self::KannalaBrandt(lens) => lens.distort(ideal),
        }
    }

    /// `d distorted / d ideal`, analytic. Symmetric for every model here.
    pub fn jacobian(&self, ideal: DVec2) -> DMat2 {
        match self {
            Self::Pinhole(lens) => lens.jacobian(ideal),
            Self::BrownConrady(lens) => lens.jacobian(ideal),
            Self::KannalaBrandt(lens) => lens.jacobian(ideal),
        }
    }

    /// Inverse on the principal branch: the ideal point inside the fold with the image `distorted`. `None` if
    /// there is none, also for NaN and infinities.
    pub fn undistort(&self, distorted: DVec2) -> Option<DVec2> {
        match self {
            Self::Pinhole(lens) => lens.undistort(distorted),
            Self::BrownConrady(lens) => lens.undistort(distorted),
            Self::KannalaBrandt(lens) => lens.undistort(distorted),
        }
    }

    /// Border of the principal branch, or `None` for a model without one.
    pub fn fold_curve(&self) -> Option<&FoldCurve> {
        match self {
            Self::Pinhole(_) => None,
            Self::BrownConrady(lens) => Some(&lens.fold),
            Self::KannalaBrandt(lens) => Some(&lens.fold),
        }
    }

    /// Start table of the inverse, or `None` for a model without one.
    pub fn radial_table(&self) -> Option<&RadialTable> {
        match self {
            Self::Pinhole(_) => None,
            Self::BrownConrady(lens) => Some(&lens.table),
            Self::KannalaBrandt(lens) => Some(&lens.table),
        }
    }

    /// Bound on the distorted radius of the principal branch; infinite for a pinhole.
    pub fn distorted_max(&self) -> f64 {
        match self {
            Self::Pinhole(_) => f64::INFINITY,
            Self::BrownConrady(lens) => lens.fold.distorted_max(),
            Self::KannalaBrandt(lens) => lens.distorted_max(),
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
        self.fold_curve().map_or(f64::INFINITY, FoldCurve::smallest)
    }

    /// Whether an ideal point lies on the principal branch, so that `undistort(distort(ideal))` is `ideal`.
    pub fn contains(&self, ideal: DVec2) -> bool {
        // Most points are within every radius, and need no angle.
        let is_near = ideal.length_squared() < self.contained_radius().powi(2);
        is_near || ideal.is_finite() && ideal.length() < self.fold_radius(ideal.y.atan2(ideal.x))
    }
}

/// Coefficients padded with zeros to the model's count.
fn padded<const N: usize>(
    coefficients: &[f64],
    model: &'static str,
    names: &'static str,
    fix: &'static str,
) -> Result<[f64; N], LensError> {
    let mut all = [0.0; N];
    match all.get_mut(..coefficients.len()) {
        Some(head) => head.copy_from_slice(coefficients),
        None => {
            return Err(LensError::TooManyCoefficients {
                model,
                max: N,
                names,
                got: coefficients.len(),
                fix,
            });
        }
    }
    Ok(all)
}

#[cfg(test)]
mod tests;
