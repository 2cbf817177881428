//! nerfstudio.

use camsim_core::scenario::LensModel;

use super::named_lens::NamedLens;

pub(crate) mod export;
pub(crate) mod read;
pub(crate) mod write;

const OPENCV_FISHEYE: &str = "OPENCV_FISHEYE";

/// Values of `camera_model`, with the keys of their coefficients. Panoramas are read only.
const LENSES: &[NamedLens] = &[
    NamedLens::new(OPENCV_FISHEYE, LensModel::KannalaBrandt, "k1 k2 k3 k4"),
    NamedLens::new("OPENCV", LensModel::BrownConrady, "k1 k2 p1 p2 k3"),
    NamedLens::new("PERSPECTIVE", LensModel::BrownConrady, "k1 k2 p1 p2 k3"),
    NamedLens::new("PINHOLE", LensModel::BrownConrady, ""),
    NamedLens::new("SIMPLE_PINHOLE", LensModel::BrownConrady, ""),
    NamedLens::new("EQUIRECTANGULAR", LensModel::Equirectangular, ""),
];
