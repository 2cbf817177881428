//! What it costs that the terrain is drawn coarser than it is.
//!
//! What is drawn at a probe lies before or behind the full surface along its ray. The full surface shows the
//! same position of its picture above or below that: as far as that looks is how far the ground is displaced
//! there. In the picture that costs what any displacement does (`misregistration.rs`), and at the ground's
//! silhouettes the pixels that these then pass over (`silhouettes.rs`), where that is the sky by what is
//! drawn there itself (`skyline.rs`).

use camsim_core::scene::TerrainDetail;

use super::{misregistration::ShownSpectrum, silhouettes::SilhouetteModel};
use crate::{ir::predicted::TerrainError, source_error::exact_sources::ExactSources};

/// What a level of detail costs, in an ideal frame of so many pixels for each of the camera's.
pub(crate) fn terrain_error(
    sources: &ExactSources<'_>,
    detail: &TerrainDetail<'_>,
    scale: f64,
    shown: &ShownSpectrum,
    silhouettes: Option<&SilhouetteModel>,
) -> TerrainError {
    let px: Vec<f64> = sources.terrain_px(detail).map(|px| px / scale).collect();
    let displacement_px = (px.iter().map(|px| px * px).sum::<f64>() / px.len().max(1) as f64).sqrt();
    TerrainError {
        displacement_px,
        surface_dn: shown.misregistration_dn(px.into_iter()),
        silhouettes_dn: silhouettes
            .map_or(0.0, |silhouettes| silhouettes.terrain_dn(displacement_px, detail)),
    }
}
