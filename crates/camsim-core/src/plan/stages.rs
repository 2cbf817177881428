//! Stages that a frame's kernels are made of.

use serde::Serialize;

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

/// How a pixel of the ideal frame reads the picture of the surface that it shows. The order is that of cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum SurfaceReads {
    /// One, of a version of the picture for the pixel's longer axis.
    One,
    /// Two reads along the pixel's longer axis.
    Two,
    /// Four: two by two, or in a row where the pixel is long.
    Four,
    /// One or two across, and up to 32 along.
    Grid,
}

impl SurfaceReads {
    /// All of them, each at its own number.
    pub const ALL: [Self; 4] = [Self::One, Self::Two, Self::Four, Self::Grid];
}

/// Where the key frame's depth is looked up that the nodes of an exposure take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NodeDepths {
    /// At mid-exposure, for all.
    Mid,
    /// At both ends; what is between takes what lies between. The second look-up begins with what the first has found, and so takes one
    /// iteration less.
    Ends,
    /// At mid-exposure and, beginning with what that has found, at both ends; what is between takes the parabola through them.
    Three,
    /// In each, beginning with what the one before has found.
    Each,
}

impl NodeDepths {
    /// All of them, in the order of their time.
    pub const ALL: [Self; 4] = [Self::Mid, Self::Ends, Self::Three, Self::Each];
}

/// The curve that joins the nodes of an exposure: one polynomial of time through each so many of them, the last of which is the next one's
/// first. With h from node to node it misses a path p by at most `h^2 |p''| / 8`, `h^3 |p'''| / 15.6` or `h^5 |p'''''| / 33`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PathStage {
    /// Two nodes.
    Straight,
    /// Three.
    Parabola,
    /// Five.
    Quartic,
}

impl PathStage {
    /// All of them, in the order of their degree.
    pub const ALL: [Self; 3] = [Self::Straight, Self::Parabola, Self::Quartic];

    /// Steps from node to node along one polynomial: its degree.
    #[must_use]
    pub fn steps(self) -> u32 {
        match self {
            Self::Straight => 1,
            Self::Parabola => 2,
            Self::Quartic => 4,
        }
    }
}

/// Motion blur.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct BlurStage {
    /// Exactly known poses over the exposure, equally far apart in time. Rays of their own at silhouettes take poses linear between them.
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
