//! Stages that a frame's kernels are made of.

use serde::Serialize;

pub use camsim_core::{
    scene::SurfaceReads,
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

/// How a line's own instant is taken back to the ideal frame's.
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
