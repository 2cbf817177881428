//! Cameras along the flight, which tell what its frames see.

use std::sync::Arc;

use camsim_core::{camera::CameraModel, pose::CameraPose, row_time::WorldPoint};
use glam::DVec2;
use rayon::prelude::*;

use super::hidden::is_hidden;
use crate::{ir::plan_error::PlanError, planner::Planner, view::surfaces::Surfaces};

/// Frames that are looked through, at most, evenly spaced over the flight.
const MOST_VIEWS: u64 = 256;
/// Points that a thread takes at once.
const POINTS_AT_ONCE: usize = 16;

/// Cameras of some frames at the mid-exposure of their centre.
#[derive(Debug, Default)]
pub(super) struct Views {
    pub cameras: Vec<(Arc<CameraModel>, f64, CameraPose)>,
}

impl Views {
    pub fn new(planner: &Planner) -> Result<Self, PlanError> {
        let frames = planner.sequence().frames;
        let count = frames.min(MOST_VIEWS);
        let frame = |k: u64| k * (frames - 1) / (count - 1).max(1);
        let cameras = (0..count).map(|k| planner.middle_view(frame(k))).collect::<Result<_, _>>()?;
        Ok(Self { cameras })
    }

    /// Whether any of them shows a point that nothing hides.
    fn see(&self, surfaces: &Surfaces, point: WorldPoint<'_>) -> bool {
        self.cameras.iter().any(|(camera, t_s, pose)| {
            let [width, height] = camera.size_px.map(f64::from);
            let is_inside = |px: DVec2| {
                px.cmpge(DVec2::splat(-0.5)).all() && px.cmplt(DVec2::new(width, height) - 0.5).all()
            };
            let shown = camera.show(pose, *t_s, point);
            shown.is_some_and(|(px, _)| is_inside(px))
                && point
                    .position_ned_m(*t_s)
                    .is_some_and(|now_ned_m| !is_hidden(surfaces, *t_s, pose.position_ned_m, now_ned_m))
        })
    }

    /// Those of `items` whose point they show.
    pub fn seen<'a, T: Send>(
        &self,
        surfaces: &Surfaces,
        items: Vec<T>,
        point: impl Fn(&T) -> WorldPoint<'a> + Sync,
    ) -> Vec<T> {
        let items = items.into_par_iter().with_min_len(POINTS_AT_ONCE);
        items.filter(|item| self.see(surfaces, point(item))).collect()
    }
}
