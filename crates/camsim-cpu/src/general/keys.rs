//! The ideal frames of an output frame. Twin of `camsim-gpu/shaders/reverse/keys`.

use camsim_core::temporal::{ColorImage, IdealGeometry, InverseDepthImage};
use camsim_plan::FramePlan;
use glam::{DVec2, DVec3};

use super::{
    rows::{Pose, Rows},
    solver::DepthLookup,
};
use crate::silhouettes::{Colors, KeyImage, SilhouetteImage};

/// An ideal frame in the form that the stages read.
#[derive(Debug)]
pub(super) struct Key<'a> {
    pub color: ColorImage<'a>,
    pub depth: DepthLookup<'a>,
    /// Pose of the key camera relative to the mid-window camera; `None` if both are the same.
    reference: Option<Pose>,
    pub silhouettes: Option<SilhouetteImage<'a>>,
}

/// A point seen by a key camera, in the mid-window camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct ReferencePoint {
    /// The point times `inverse_depth`.
    pub scaled: DVec3,
    /// Inverse planar depth in the key camera, 1/m; 0 = at infinity.
    pub inverse_depth: f64,
}

impl<'a> Key<'a> {
    /// The key frame of a number.
    pub fn new(plan: &FramePlan, number: usize, image: KeyImage<'a>, rows: &Rows) -> Self {
        let size_px = image.geometry.size_px;
        let [width, height] = size_px.map(|side| side as usize);
        let rgba = if let Colors::Floats(rgba) = image.colors { rgba } else { &[] };
        assert!(
            image.inverse_depth.len() == width * height
                && (rgba.is_empty() || rgba.len() == 4 * width * height),
            "an ideal frame of {width}x{height} pixels"
        );
        let depth = DepthLookup {
            ideal: image.geometry,
            image: InverseDepthImage { size_px, values: image.inverse_depth },
            plane: plan.plane.seen_from(&plan.keys[number].pose),
            sky_reach_px: plan.sky_reach_px,
        };
        Self {
            color: ColorImage { size_px, rgba },
            depth,
            reference: rows.reference(number),
            silhouettes: image.fine.map(|fine| SilhouetteImage::new(image, fine, plan.mark_reach_px())),
        }
    }

    /// The point at a position and inverse depth (1/m) of this key camera.
    pub fn reference_point(&self, position_px: DVec2, in_key: f64) -> ReferencePoint {
        let ideal = self.depth.ideal;
        let ray = ((position_px - ideal.principal_px) / ideal.focal_px).extend(1.0);
        let scaled = match &self.reference {
            Some(pose) => pose.rotation * ray + in_key * pose.shift_m,
            None => ray,
        };
        ReferencePoint { scaled, inverse_depth: in_key }
    }

    /// Projection of that point into the mid-window camera, ideal pixels.
    pub fn reference_px(&self, position_px: DVec2, in_key: f64) -> DVec2 {
        match &self.reference {
            Some(_) => self.depth.ideal.px_from_point(self.reference_point(position_px, in_key).scaled),
            None => position_px,
        }
    }

    /// Its depth for truth: sky pixels do not move with the surfaces beside them.
    pub fn depth_of_truth(&self) -> DepthLookup<'a> {
        DepthLookup { sky_reach_px: 0.0, ..self.depth }
    }

    pub fn ideal(&self) -> &'a IdealGeometry {
        self.depth.ideal
    }
}
