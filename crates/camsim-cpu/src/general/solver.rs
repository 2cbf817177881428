//! The temporal inverse: from a ray at its own instant to its source in a key frame. Twin of
//! `camsim-gpu/shaders/reverse/temporal_inverse`.

use camsim_core::{
    scenario::Preset,
    temporal::{
        IdealGeometry, InverseDepthImage, KeyDepth,
        displacement::{RK2_STEP_DEG, Twist, linear, rk2},
        iterate_depth, row_inverse_depth,
    },
};
use camsim_plan::{FramePlan, TemporalStage};
use glam::{DVec2, DVec3};

use super::rows::Pose;

/// Lower bound of the ratio of a point's depths in the row's and in the key camera.
const MIN_DEPTH_RATIO: f64 = 1e-3;

/// Depth of a key frame for look-ups; owns the image view that [`KeyDepth`] borrows.
#[derive(Clone, Copy, Debug)]
pub(super) struct DepthLookup<'a> {
    pub ideal: &'a IdealGeometry,
    pub image: InverseDepthImage<'a>,
    /// Plane at which the iteration starts, as in [`KeyDepth::plane`].
    pub plane: DVec3,
    /// Distance from a surface within which sky pixels move with it, ideal pixels.
    pub sky_reach_px: f64,
}

impl DepthLookup<'_> {
    fn view(&self) -> KeyDepth<'_> {
        let Self { ideal, image, plane, sky_reach_px } = self;
        KeyDepth { ideal, depth: image, plane: *plane, sky_reach_px: *sky_reach_px }
    }
}

/// Source of an output ray in a key frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Source {
    pub position_px: DVec2,
    /// Inverse planar depth in the row's own camera, 1/m; 0 = sky.
    pub inverse_depth: f64,
    /// Whether it is in front of the key camera and within the ideal frame.
    pub inside: bool,
    /// Projection of the ray's point at infinity, ideal pixels.
    pub far_px: DVec2,
}

/// Temporal solver.
#[derive(Clone, Copy, Debug)]
pub(super) enum Solver {
    /// Nothing moves within the frame.
    Identity,
    /// Rotation only: depth is irrelevant.
    Rotation,
    /// Relative pose and depth, by a fixed number of depth look-ups.
    Reproject { iterations: u32 },
    /// Constant twist, and constant depth read at the ray's own position in the ideal frame.
    ConstantTwist { twist: Twist, steps: Steps, nearest_depth: bool },
}

/// How a constant twist is integrated.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Steps {
    One,
    Heun,
}

impl Solver {
    pub fn new(plan: &FramePlan) -> Self {
        let constant_twist = |steps| Self::ConstantTwist {
            twist: plan.key_twist,
            steps,
            nearest_depth: plan.preset == Preset::Paper,
        };
        match plan.temporal {
            TemporalStage::Identity => Self::Identity,
            TemporalStage::Rotation => Self::Rotation,
            TemporalStage::Reproject { iterations } => Self::Reproject { iterations },
            TemporalStage::Linear => constant_twist(Steps::One),
            TemporalStage::Rk2 => constant_twist(Steps::Heun),
        }
    }

    /// Whether the source of a ray depends on depth.
    pub fn has_parallax(&self) -> bool {
        matches!(self, Self::Reproject { .. } | Self::ConstantTwist { .. })
    }

    /// Whether the solver uses exact poses, so that sources are where the points are.
    pub fn is_exact(&self) -> bool {
        !matches!(self, Self::ConstantTwist { .. })
    }

    /// The point of a ray at inverse planar depth `w` in the key camera, scaled by `w`.
    pub fn point(&self, uv: DVec2, pose: &Pose, w: f64) -> DVec3 {
        match self {
            Self::Identity => uv.extend(1.0),
            Self::Rotation => pose.rotation * uv.extend(1.0),
            Self::Reproject { .. } => pose.rotation * uv.extend(1.0) + w * pose.shift_m,
            Self::ConstantTwist { twist, steps: Steps::One, .. } => {
                linear(uv, w, twist, pose.dt_s).extend(1.0)
            }
            Self::ConstantTwist { twist, steps: Steps::Heun, .. } => {
                rk2(uv, w, twist, pose.dt_s, RK2_STEP_DEG.to_radians()).extend(1.0)
            }
        }
    }

    /// Inverse depth in the row's camera of a point with inverse depth `in_key` in the key camera, 1/m.
    pub fn inverse_depth_in_row(&self, uv: DVec2, pose: &Pose, in_key: f64) -> f64 {
        match self {
            Self::Reproject { .. } => moved_inverse_depth(uv, pose, in_key),
            Self::Identity | Self::Rotation | Self::ConstantTwist { .. } => in_key,
        }
    }

    /// The source of a ray.
    pub fn source(&self, uv: DVec2, pose: &Pose, key: &DepthLookup<'_>) -> Source {
        match *self {
            Self::Identity | Self::Rotation => self.source_at_depth(uv, pose, 0.0, key.ideal),
            Self::Reproject { iterations } => {
                let depth = iterate_depth(uv, (pose.rotation, pose.shift_m), None, iterations, &key.view());
                self.source_at_depth(uv, pose, depth.on_row, key.ideal)
            }
            Self::ConstantTwist { nearest_depth, .. } => {
                let own_px = key.ideal.px_from_point(uv.extend(1.0));
                let w = match nearest_depth {
                    true => key.image.nearest(own_px),
                    false => key.image.inverse_depth(own_px),
                };
                self.source_at_depth(uv, pose, w, key.ideal)
            }
        }
    }

    /// The source of a ray, with the depth of the key frame at that source.
    pub fn source_with_depth(&self, uv: DVec2, pose: &Pose, key: &DepthLookup<'_>) -> Source {
        let mut source = self.source(uv, pose, key);
        let in_key = key.image.inverse_depth(source.position_px);
        source.inverse_depth = match self {
            Self::Identity => in_key,
            Self::Rotation | Self::Reproject { .. } => moved_inverse_depth(uv, pose, in_key),
            Self::ConstantTwist { twist, .. } => {
                let direction =
                    ((source.position_px - key.ideal.principal_px) / key.ideal.focal_px).extend(1.0);
                let z_rate = -in_key * twist.velocity_m_s.z - twist.rate_rad_s.cross(direction).z;
                in_key / (1.0 + pose.dt_s * z_rate).max(MIN_DEPTH_RATIO)
            }
        };
        source
    }

    /// Inverse depth in the key frame after the last look-up of [`Solver::Reproject`], 1/m. With the `guess`
    /// of another node one look-up fewer is made.
    pub fn depth_in_key(
        uv: DVec2,
        pose: &Pose,
        guess: Option<f64>,
        iterations: u32,
        key: &DepthLookup<'_>,
    ) -> f64 {
        let look_ups = if guess.is_some() { iterations.max(2) - 1 } else { iterations };
        iterate_depth(uv, (pose.rotation, pose.shift_m), guess, look_ups, &key.view()).in_key
    }

    /// Source of a surface with inverse depth `in_key` in the key frame.
    pub fn source_of_surface(&self, uv: DVec2, pose: &Pose, in_key: f64, ideal: &IdealGeometry) -> Source {
        // A surface at or behind the row's image plane has no depth there: infinity replaces it.
        let w = row_inverse_depth(pose.rotation * uv.extend(1.0), pose.shift_m, in_key).unwrap_or(0.0);
        self.source_at_depth(uv, pose, w, ideal)
    }

    /// Source of a ray's point at inverse depth `w`.
    fn source_at_depth(&self, uv: DVec2, pose: &Pose, w: f64, ideal: &IdealGeometry) -> Source {
        let point = self.point(uv, pose, w);
        let position_px = ideal.px_from_point(point);
        let far_px =
            if self.has_parallax() { ideal.px_from_point(self.point(uv, pose, 0.0)) } else { position_px };
        let inside = point.z > 0.0 && ideal.contains(position_px);
        Source { position_px, inverse_depth: w, inside, far_px }
    }
}

/// Inverse depth in the row's camera after the relative motion, 1/m.
fn moved_inverse_depth(uv: DVec2, pose: &Pose, in_key: f64) -> f64 {
    let direction_z = (pose.rotation * uv.extend(1.0)).z;
    in_key * direction_z / (1.0 - pose.shift_m.z * in_key).max(MIN_DEPTH_RATIO)
}
