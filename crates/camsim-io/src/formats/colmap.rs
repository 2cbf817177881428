//! COLMAP.

use camsim_core::lens::ModelFacts;
use camsim_core::scenario::LensModel::{self, BrownConrady, Division, Eucm, Fisheye624, Fov, KannalaBrandt};

pub(crate) mod export;
pub(crate) mod read;
pub(crate) mod write;

/// A camera model. Its parameters are the focal length or fx and fy, then cx, cy and the coefficients.
struct Model {
    name: &'static str,
    /// Its number in binary files.
    number: i32,
    lens: LensModel,
    focal_lengths: &'static [&'static str],
    /// In camsim's order; those behind them are zero.
    coefficients: &'static [&'static str],
}

impl Model {
    const fn new(
        name: &'static str,
        number: i32,
        lens: LensModel,
        focal_lengths: &'static [&'static str],
        coefficients: &'static [&'static str],
    ) -> Self {
        Self { name, number, lens, focal_lengths, coefficients }
    }

    /// Names of all parameters.
    fn parameters(&self) -> Vec<&'static str> {
        [self.focal_lengths, &["cx", "cy"], self.coefficients].concat()
    }
}

const F: &[&str] = &["f"];
const FX_FY: &[&str] = &["fx", "fy"];

/// The models, from COLMAP's source. A camera is written as the first that holds it.
const MODELS: &[Model] = &[
    Model::new("SIMPLE_PINHOLE", 0, BrownConrady, F, &[]),
    Model::new("SIMPLE_RADIAL", 2, BrownConrady, F, &["k1"]),
    Model::new("RADIAL", 3, BrownConrady, F, &["k1", "k2"]),
    Model::new("PINHOLE", 1, BrownConrady, FX_FY, &[]),
    Model::new("OPENCV", 4, BrownConrady, FX_FY, &["k1", "k2", "p1", "p2"]),
    Model::new("FULL_OPENCV", 6, BrownConrady, FX_FY, ModelFacts::of(BrownConrady).coefficients),
    Model::new("OPENCV_FISHEYE", 5, KannalaBrandt, FX_FY, ModelFacts::of(KannalaBrandt).coefficients),
    Model::new("SIMPLE_RADIAL_FISHEYE", 8, KannalaBrandt, F, &["k1"]),
    Model::new("RADIAL_FISHEYE", 9, KannalaBrandt, F, &["k1", "k2"]),
    Model::new("FOV", 7, Fov, FX_FY, ModelFacts::of(Fov).coefficients),
    Model::new("DIVISION", 13, Division, FX_FY, ModelFacts::of(Division).coefficients),
    Model::new("SIMPLE_DIVISION", 12, Division, F, ModelFacts::of(Division).coefficients),
    Model::new("EUCM", 16, Eucm, FX_FY, ModelFacts::of(Eucm).coefficients),
    Model::new("RAD_TAN_THIN_PRISM_FISHEYE", 11, Fisheye624, FX_FY, ModelFacts::of(Fisheye624).coefficients),
];
