//! The choice of the points that are tracked.

use camsim_core::{scenario::PointSource, tracks::TrackPoint};

use super::{terrain_corners, vertices, views::Views};
use crate::{ir::plan_error::PlanError, planner::Planner};

/// The points of `[output.tracks]` in the order of its sources, and remarks on them.
pub(super) fn points(
    planner: &Planner,
    given: &[Vec<TrackPoint>],
) -> Result<(Vec<TrackPoint>, Vec<String>), PlanError> {
    let (mut points, mut notes) = (Vec::new(), Vec::new());
    let sequence = planner.sequence();
    let Some(spec) = &sequence.scenario.output.tracks else { return Ok((points, notes)) };
    let (count, seed) = (spec.count as usize, sequence.scenario.seed);
    let needs_views = |source: &PointSource| matches!(source, PointSource::Terrain | PointSource::Vertices);
    let views = if spec.points.iter().any(needs_views) { Views::new(planner)? } else { Views::default() };
    for (i, source) in spec.points.iter().enumerate() {
        let (of_source, what) = match source {
            PointSource::Terrain => {
                (terrain_corners::corners(planner, &views, count, seed), "corner of the terrain")
            }
            PointSource::Vertices => (vertices::corners(planner, &views, count, seed), "corner of a model"),
            PointSource::Board | PointSource::Table(_) => (given.get(i).cloned().unwrap_or_default(), ""),
        };
        if of_source.is_empty() && !what.is_empty() {
            notes.push(format!("output.tracks: the frames see no {what}, so none is tracked"));
        }
        points.extend(of_source);
    }
    Ok((points, notes))
}
