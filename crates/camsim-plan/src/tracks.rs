//! Tracks: where each frame shows points of the scene, and whether anything hides them there.

mod hidden;
mod select;
mod terrain_corners;
mod vertices;
mod views;

use camsim_core::{
    scenario::Channel,
    tracks::{Sighting, TrackPoint},
};
use rayon::prelude::*;

use crate::{ir::plan_error::PlanError, planner::Planner};
use hidden::is_hidden;

/// Points that a thread takes at once.
const POINTS_AT_ONCE: usize = 64;

/// Points that are looked for in the frames of a sequence.
#[derive(Debug)]
pub struct Tracks {
    planner: Planner,
    points: Vec<TrackPoint>,
    /// Remarks on the choice of the points, for the user.
    notes: Vec<String>,
}

impl Tracks {
    /// Chooses the points of `[output.tracks]` of the planner's scenario. `given` has those of the board and of
    /// tables, source by source; without that table of the scenario there are no points.
    ///
    /// # Errors
    /// A camera that cannot be used.
    pub fn new(planner: &Planner, given: &[Vec<TrackPoint>]) -> Result<Self, PlanError> {
        // What is known of the scene is shared.
        let planner = planner.renewed(planner.sequence().clone(), &[] as &[Channel])?;
        let (points, notes) = select::points(&planner, given)?;
        Ok(Self { planner, points, notes })
    }

    /// The points.
    #[must_use]
    pub fn points(&self) -> &[TrackPoint] {
        &self.points
    }

    /// Remarks on the choice of the points, for the user.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    /// All positions within the picture at which a frame shows the points, by point.
    ///
    /// # Errors
    /// A zoom value without a usable camera.
    pub fn sightings(&self, frame: u64) -> Result<Vec<Sighting>, PlanError> {
        let camera = self.planner.frame_camera(frame as i64)?;
        let surfaces = self.planner.surfaces();
        let scene = &self.planner.sequence().scene;
        let of_point = |(point, at): (usize, &TrackPoint)| {
            let (world_point, at_ned_m) = (at.world_point(scene), at.position_ned_m);
            let found = camera.find_all(world_point).into_iter();
            found.map(move |seen| {
                let now_ned_m = world_point.position_ned_m(seen.t_s).unwrap_or(at_ned_m);
                let is_visible = !is_hidden(surfaces, seen.t_s, seen.pose.position_ned_m, now_ned_m);
                Sighting { point, seen, is_visible }
            })
        };
        let points = self.points.par_iter().enumerate().with_min_len(POINTS_AT_ONCE);
        Ok(points.flat_map_iter(of_point).collect())
    }
}
