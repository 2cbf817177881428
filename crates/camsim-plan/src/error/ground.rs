//! How coarse the terrain may be drawn: as far as `quality.max_terrain_error_px` allows in the picture, or as
//! the errors of sources and of the picture allow.
//!
//! What is drawn at a probe lies before or behind the full surface along its ray. The full surface shows the
//! same place of its picture above or below that: as far as that looks is how far the ground is displaced
//! there. In grey levels that costs what any displacement does (`displaced.rs`), and at the ground's borders
//! the pixels that these then pass over (`contours.rs`), where that is the sky by what is drawn there itself
//! (`skyline.rs`).

use serde::Serialize;

use super::{Case, SAFETY, Truths};
use camsim_core::{scenario::Preset, scene::TerrainDetail};

/// Part of the tolerance of sources that the level of detail may take.
const SHARE_OF_PX: f64 = 0.3;
/// Part of what is left of the tolerance of pictures that it may take: the rest is for sources beside their
/// place.
pub(super) const SHARE_OF_DN: f64 = 0.95;
/// Errors fall in proportion to what is allowed, or nearly: aimed at, of what they may be, and tries.
const AIM: f64 = 0.85;
const TRIES: usize = 3;

/// What it costs that the terrain is drawn coarser than it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Ground {
    /// RMS displacement over the picture, pixels of the camera's focal length.
    pub displaced_px: f64,
    /// RMS error over the picture by that, 1/255 of the linear range: of its surface,
    pub surface_dn: f64,
    /// and at its borders.
    pub borders_dn: f64,
}

impl Ground {
    /// Of both.
    #[must_use]
    pub fn error_dn(&self) -> f64 {
        self.surface_dn.hypot(self.borders_dn)
    }

    /// With so many times the tolerance: errors fall in proportion, or faster.
    pub(crate) fn times(self, times: f64) -> Self {
        let Self { displaced_px, surface_dn, borders_dn } = self;
        Self {
            displaced_px: times * displaced_px,
            surface_dn: times * surface_dn,
            borders_dn: times * borders_dn,
        }
    }
}

/// The terrain that was chosen.
pub(super) struct Coarsened<'a> {
    /// Its tolerance, ideal pixels.
    pub error_px: f64,
    pub detail: Option<TerrainDetail<'a>>,
    /// `None` without a terrain.
    pub ground: Option<Ground>,
}

impl Ground {
    fn of(case: &Case<'_>, truths: &Truths<'_>, detail: &TerrainDetail<'_>) -> Self {
        let scale = case.ideal.scale(&case.reach.camera);
        let px: Vec<f64> = truths
            .looked
            .iter()
            .map(|looked| truths.trial.ground_px(&looked.truth, detail) / scale)
            .collect();
        let displaced_px = (px.iter().map(|px| px * px).sum::<f64>() / px.len().max(1) as f64).sqrt();
        Self {
            displaced_px,
            surface_dn: case.shown.displaced_dn(px.into_iter()),
            borders_dn: case.outlook.map_or(0.0, |outlook| outlook.ground_dn(displaced_px, detail)),
        }
    }
}

/// The coarsest terrain within the tolerances.
pub(super) fn coarsest<'a>(case: &Case<'a>, truths: &Truths<'_>) -> Coarsened<'a> {
    let quality = &case.sequence.scenario.quality;
    let mut error_px = quality.max_terrain_error_px * case.ideal.scale(&case.reach.camera);
    let mut tries = 0;
    loop {
        let Some(detail) = case.terrain_detail(error_px) else {
            return Coarsened { error_px, detail: None, ground: None };
        };
        let ground = Ground::of(case, truths, &detail);
        let of_sources =
            SAFETY * truths.level_of_detail_px(Some(&detail)) / (SHARE_OF_PX * quality.max_error_px);
        // The paper's errors are not judged.
        let is_judged = quality.preset != Preset::Paper && ground.error_dn() > 0.0;
        let of_picture =
            if is_judged { ground.error_dn() / (SHARE_OF_DN * case.most_displaced_dn) } else { 0.0 };
        let of_allowed = of_sources.max(of_picture);
        if of_allowed <= 1.0 || tries == TRIES {
            return Coarsened { error_px, detail: Some(detail), ground: Some(ground) };
        }
        error_px *= AIM / of_allowed;
        tries += 1;
    }
}
