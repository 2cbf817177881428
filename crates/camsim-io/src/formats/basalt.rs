//! Basalt.

use camsim_core::scenario::LensModel;

use super::named_lens::NamedLens;

pub(crate) mod read;
pub(crate) mod write;

/// Values of `camera_type`, with the keys of their coefficients.
const LENSES: &[NamedLens] = &[
    NamedLens::new("kb4", LensModel::KannalaBrandt, "k1 k2 k3 k4"),
    NamedLens::new("ds", LensModel::DoubleSphere, "xi alpha"),
    NamedLens::new("eucm", LensModel::Eucm, "alpha beta"),
    NamedLens::new("ucm", LensModel::Ucm, "alpha"),
    NamedLens::new("pinhole", LensModel::BrownConrady, ""),
    NamedLens::new(RADTAN8, LensModel::BrownConrady, "k1 k2 p1 p2 k3 k4 k5 k6"),
];
const RADTAN8: &str = "pinhole-radtan8";
