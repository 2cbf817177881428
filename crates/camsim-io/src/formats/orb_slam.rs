//! ORB-SLAM2 and ORB-SLAM3.

use camsim_core::scenario::LensModel;

use super::named_lens::NamedLens;

pub(crate) mod read;
pub(crate) mod write;

/// Values of `Camera.type`, with the names of their coefficients.
const LENSES: &[NamedLens] = &[
    NamedLens::new("KannalaBrandt8", LensModel::KannalaBrandt, "k1 k2 k3 k4"),
    NamedLens::new("PinHole", LensModel::BrownConrady, "k1 k2 p1 p2 k3"),
];
