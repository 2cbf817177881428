//! The ideal frames of an output frame. Twin of `shaders/reverse/keys`.

use camsim_core::temporal::{ColorImage, IdealGeometry, InverseDepthImage, MAX_KEYS};
use camsim_plan::FramePlan;
use glam::{DVec2, DVec3};

use super::{
    IdealImage,
    rows::{Pose, Rows},
    silhouettes::SilhouetteImage,
    solver::DepthLookup,
};

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
    pub fn new(plan: &FramePlan, number: usize, image: &'a IdealImage, rows: &Rows) -> Self {
        let [width, height] = image.geometry.size_px.map(|side| side as usize);
        assert!(
            image.inverse_depth.len() == width * height && image.color_rgba.len() == 4 * width * height,
            "an ideal frame of {width}x{height} pixels"
        );
        let size_px = image.geometry.size_px;
        let depth = DepthLookup {
            ideal: &image.geometry,
            image: InverseDepthImage { size_px, values: &image.inverse_depth },
            plane: plan.plane.seen_from(&plan.keys[number].pose),
            sky_reach_px: plan.sky_reach_px,
        };
        Self {
            color: ColorImage { size_px, rgba: &image.color_rgba },
            depth,
            reference: rows.reference(number),
            silhouettes: image.fine.as_ref().map(|fine| SilhouetteImage::new(plan, image, fine)),
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

/// Key frames in order of their distance in time from a share of the window: they stand at the middles of
/// equal parts of it. Twin of [`camsim_core::temporal::silhouette_rays::nearest_key`].
pub(super) fn nearest_first(share: f64, count: usize) -> impl Iterator<Item = usize> {
    let mut used = [false; MAX_KEYS as usize];
    let distance = move |key: usize| (share * count as f64 - key as f64 - 0.5).abs();
    (0..count).map(move |_| {
        let free = (0..count).filter(|&key| !used[key]);
        let nearest = free.min_by(|&a, &b| distance(a).total_cmp(&distance(b))).unwrap_or_default();
        used[nearest] = true;
        nearest
    })
}

#[cfg(test)]
mod tests {
    use camsim_core::temporal::silhouette_rays::nearest_key;

    use super::*;

    #[test]
    fn keys_are_ordered_as_by_the_twin() {
        for count in 1..=MAX_KEYS as usize {
            for step in -10..=30 {
                let share = f64::from(step) * 0.05;
                let expected: Vec<_> = (0..count).map(|rank| nearest_key(share, count, rank)).collect();
                let found: Vec<_> = nearest_first(share, count).collect();
                assert_eq!(found, expected, "{share} of {count}");
            }
        }
    }
}
