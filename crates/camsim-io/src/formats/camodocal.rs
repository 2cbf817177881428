//! camodocal, whose camera files VINS-Mono and VINS-Fusion read.

use camsim_core::scenario::LensModel;

use super::named_lens::NamedLens;

pub(crate) mod read;
pub(crate) mod write;

const PINHOLE: &str = "PINHOLE";
const MEI: &str = "MEI";
const KANNALA_BRANDT: &str = "KANNALA_BRANDT";

/// Values of `model_type`.
const LENSES: &[NamedLens] = &[
    NamedLens::new(MEI, LensModel::Mei, "mirror.xi distortion.k1 distortion.k2 distortion.p1 distortion.p2"),
    // Its k1 is 1 and not written: r = theta + k2 theta^3 + k3 theta^5 + k4 theta^7 + k5 theta^9.
    NamedLens::new(
        KANNALA_BRANDT,
        LensModel::KannalaBrandt,
        "projection.k2 projection.k3 projection.k4 projection.k5",
    ),
    NamedLens::new(
        PINHOLE,
        LensModel::BrownConrady,
        "distortion.k1 distortion.k2 distortion.p1 distortion.p2",
    ),
    NamedLens::new(
        "PINHOLE_FULL",
        LensModel::BrownConrady,
        "distortion.k1 distortion.k2 distortion.p1 distortion.p2 distortion.k3 distortion.k4 distortion.k5 \
         distortion.k6",
    ),
];

/// Keys of fx, fy, cx, cy among the parameters of the projection.
fn intrinsic_keys(model: &str) -> [&'static str; 4] {
    match model {
        MEI => ["gamma1", "gamma2", "u0", "v0"],
        KANNALA_BRANDT => ["mu", "mv", "u0", "v0"],
        _ => ["fx", "fy", "cx", "cy"],
    }
}
