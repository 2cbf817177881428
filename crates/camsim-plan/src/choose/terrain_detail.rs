//! How coarse the terrain may be drawn: as far as `quality.max_terrain_error_px` allows in the picture, or as
//! the errors of sources and of the picture allow.

use camsim_core::{scenario::Preset, scene::TerrainDetail};

use super::temporal_task::TemporalTask;
use crate::{
    ir::{
        budget::{self, ErrorBudget},
        margins,
        predicted::TerrainError,
    },
    picture_error::terrain::terrain_error,
    source_error::exact_sources::ExactSources,
};

/// Errors fall in proportion to the tolerance, or nearly: part of the allowed error that is aimed at, and
/// tries.
const AIM: f64 = 0.85;
const TRIES: usize = 3;

/// The terrain that was chosen.
pub(crate) struct TerrainChoice<'a> {
    /// Tolerance of its level of detail, ideal pixels.
    pub tolerance_px: f64,
    pub detail: Option<TerrainDetail<'a>>,
    /// `None` without a terrain.
    pub error: Option<TerrainError>,
}

/// The coarsest terrain within the tolerances.
pub(crate) fn coarsest<'a>(task: &TemporalTask<'a>, sources: &ExactSources<'_>) -> TerrainChoice<'a> {
    let quality = &task.sequence.scenario.quality;
    let scale = task.ideal.scale(&task.reach.camera);
    let mut tolerance_px = quality.max_terrain_error_px * scale;
    let mut tries = 0;
    loop {
        let Some(detail) = task.terrain_detail(tolerance_px) else {
            return TerrainChoice { tolerance_px, detail: None, error: None };
        };
        let error = terrain_error(sources, &detail, scale, &task.shown, task.silhouette_model);
        let of_sources = margins::SOURCE_ERROR * sources.level_of_detail_px(Some(&detail))
            / ErrorBudget::new(quality).terrain_source_px();
        // The paper's errors are not judged.
        let is_judged = quality.preset != Preset::Paper && error.error_dn() > 0.0;
        let of_picture =
            if is_judged { error.error_dn() / budget::terrain_dn(task.most_misregistration_dn) } else { 0.0 };
        let of_allowed = of_sources.max(of_picture);
        if of_allowed <= 1.0 || tries == TRIES {
            return TerrainChoice { tolerance_px, detail: Some(detail), error: Some(error) };
        }
        tolerance_px *= AIM / of_allowed;
        tries += 1;
    }
}
