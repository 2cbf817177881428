//! Stages that a frame's kernels are made of.

use camsim_core::temporal::{Footprint, samples_for};
use serde::Serialize;

pub use camsim_core::{
    scene::PrefilterTaps,
    temporal::{NodeDepths, PathStage},
};

/// How an output pixel gets its ideal ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum RayStage {
    /// Closed form, no map.
    Pinhole,
    /// A lens map, computed once per lens and zoom value.
    LensMap,
    /// The paper's Gauss-Newton inverse, for each pixel of each frame.
    GaussNewton,
}

/// How a ray at its row's instant is taken back to the ideal frame's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TemporalStage {
    /// Nothing moves within the frame.
    Identity,
    /// Rotation only.
    Rotation,
    /// Relative pose and depth.
    Reproject {
        /// Depth look-ups.
        iterations: u32,
    },
    /// One straight step at constant twist and depth (eq. 16).
    Linear,
    /// Heun's steps of at most 2.5 deg at constant twist and depth (eq. 18).
    Rk2,
}

/// Motion blur.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BlurStage {
    /// Exactly known poses over the exposure, equally far apart in time. Rays of their own at silhouettes
    /// take poses linear between them.
    pub nodes: u32,
    /// The path of a source goes through every so many of them.
    pub stride: u32,
    /// What joins those.
    pub path: PathStage,
    /// What depth they take.
    pub depths: NodeDepths,
    /// Samples a pixel of path (up to 16 px; one a pixel beyond).
    pub samples_per_px: f64,
    /// Cap of the samples on one polynomial.
    pub max_samples: u32,
}

impl BlurStage {
    /// Nodes that the path goes through.
    #[must_use]
    pub fn solved(&self) -> u32 {
        (self.nodes - 1) / self.stride + 1
    }

    /// Polynomials of the path.
    #[must_use]
    pub fn stretches(&self) -> u32 {
        (self.nodes - 1) / (self.stride * self.path.steps())
    }
}

/// How the ideal frame gets the sun's shadows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub struct ShadowStage {
    /// Rays towards the sun over the area of an ideal pixel beside whose middle light turns into shadow.
    /// Elsewhere a pixel takes one, or one for each of its samples.
    pub border_rays: u32,
}

/// How pixels at silhouettes are made.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EdgeStage {
    /// No silhouette in view: one sample a pixel of the ideal frame.
    None,
    /// The ideal frame keeps `4 scale^2` samples of depth a pixel (with `scale` above 1 of colour too), and
    /// an output pixel that sees a silhouette takes `samples` rays of its own.
    Supersampled {
        /// Fine pixels along a side of an ideal pixel, each with 4 samples.
        scale: u32,
        /// Rays over the area and exposure of an output pixel.
        samples: u32,
        /// Whether something thinner than a pixel may be in view: silhouettes are then looked for among all
        /// samples, otherwise between the middles of pixels, and only what is near them is drawn with
        /// samples.
        thin: bool,
    },
}

impl EdgeStage {
    /// Whether the colours of pixels at silhouettes come from rays of their own.
    #[must_use]
    pub fn has_rays(self) -> bool {
        matches!(self, Self::Supersampled { samples: 1.., .. })
    }
}

/// Fine pixels along a side of an ideal pixel.
pub(crate) fn scale_of(edges: EdgeStage) -> u32 {
    match edges {
        EdgeStage::None => 1,
        EdgeStage::Supersampled { scale, .. } => scale,
    }
}

/// Samples of a pixel whose path is so long, if it is equally long in each of its stretches.
pub(crate) fn sample_count(blur: &BlurStage, length_px: f64, area: &Footprint) -> u32 {
    let stretches = blur.stretches();
    let at_least = (area.taps[0] * area.taps[1]).div_ceil(stretches);
    stretches * samples_for(length_px / f64::from(stretches), blur.samples_per_px, at_least, blur.max_samples)
}
