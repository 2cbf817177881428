//! The error budget: how the tolerances are divided among the causes of error.

use camsim_core::{scenario::QualitySpec, scene::Scene};

use super::predicted::SilhouetteError;

/// Part of `quality.max_error_px` that the exposure's path between its nodes may miss.
const EXPOSURE_PATH: f64 = 0.5;
/// Part of `quality.max_error_px` that a bound on what is omitted may take.
const BOUND: f64 = 0.5;
/// Part of `quality.max_error_px` that the terrain's level of detail may take.
const TERRAIN_OF_PX: f64 = 0.3;
/// Part of `quality.max_error_px` that the displacement of models by their level of detail may take by
/// parallax.
const MODEL_PARALLAX: f64 = 0.1;
/// Part of the terrain's level of detail that models get: they are silhouettes all over, of other colours
/// than what is behind them.
const MODELS_OF_TERRAIN: f64 = 0.25;
/// Part of the source error from which on more nodes of the exposure's path are worth a try.
const WORTHWHILE_NODES: f64 = 0.3;

/// Part of `quality.max_error_dn` that is always left for misregistration, so that all else may take 0.995 of
/// it.
const LEFT_FOR_MISREGISTRATION: f64 = 0.1;
/// Part of `quality.max_error_dn` that is left for misregistration and the terrain's level of detail, so that
/// all else may take 0.954 of it.
const LEFT_WITH_TERRAIN: f64 = 0.3;
/// Part of a picture error above `quality.max_error_dn` that misregistration and terrain may add.
const OF_BROKEN: f64 = 0.3;
/// Part of what is left of `quality.max_error_dn` that the terrain's level of detail may take: the rest is
/// for misregistration.
const TERRAIN_OF_DN: f64 = 0.95;
/// Part of `quality.max_error_dn` that silhouettes may take, and how many times that tolerance the pixels at
/// them may be off, RMS.
const SILHOUETTES: f64 = 0.9;
const TIMES_AT_SILHOUETTES: f64 = 6.0;
/// Parts of `quality.max_error_dn` that a frame of a group is sampled for, one after the other, so that the
/// others keep all of it: neighbours differ by a few percent.
pub(crate) const GROUP_SHARES: [f64; 3] = [0.95, 1.0, 0.85];

/// Part of either tolerance that disocclusion may take.
const DISOCCLUSION: f64 = 0.5;
/// Fraction of the pixels in which `quality.max_error_px` is kept.
const PERCENTILE: f64 = 0.99;

/// Where nothing keeps a tolerance: times the least error there is.
pub(crate) const NEARLY: f64 = 1.15;

/// The tolerances of a scenario and their parts.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ErrorBudget {
    /// `quality.max_error_px`.
    pub source_px: f64,
    /// `quality.max_error_dn`.
    pub picture_dn: f64,
    /// `quality.max_terrain_error_px`.
    terrain_px: f64,
}

impl ErrorBudget {
    pub fn new(quality: &QualitySpec) -> Self {
        Self {
            source_px: quality.max_error_px,
            picture_dn: quality.max_error_dn,
            terrain_px: quality.max_terrain_error_px,
        }
    }

    /// With another tolerance of the source error.
    pub fn with_source_px(self, source_px: f64) -> Self {
        Self { source_px, ..self }
    }

    /// Miss of the exposure's path between its nodes, ideal pixels.
    pub fn exposure_path_px(&self) -> f64 {
        EXPOSURE_PATH * self.source_px
    }

    /// Bound on what is omitted, ideal pixels.
    pub fn bound_px(&self) -> f64 {
        BOUND * self.source_px
    }

    /// Displacement of sources by the terrain's level of detail, ideal pixels.
    pub fn terrain_source_px(&self) -> f64 {
        TERRAIN_OF_PX * self.source_px
    }

    /// Displacement of models by parallax, ideal pixels.
    pub fn model_parallax_px(&self) -> f64 {
        MODEL_PARALLAX * self.source_px
    }

    /// Displacement of models, pixels.
    pub fn model_px(&self) -> f64 {
        MODELS_OF_TERRAIN * self.terrain_px
    }

    /// What sampling, silhouettes and blended depth may take, 1/255: the rest is kept for terrain and
    /// misregistration.
    pub fn sampling_dn(&self, scene: &Scene) -> f64 {
        let left = if scene.terrain.is_some() { LEFT_WITH_TERRAIN } else { LEFT_FOR_MISREGISTRATION };
        (1.0 - left * left).sqrt() * self.picture_dn
    }

    /// What the terrain's level of detail and misregistration may cost beside all others, 1/255: what these
    /// leave of the tolerance.
    pub fn misregistration_dn(&self, scene: &Scene, others_dn: f64) -> f64 {
        if others_dn > self.sampling_dn(scene) {
            return OF_BROKEN * others_dn;
        }
        (self.picture_dn.powi(2) - others_dn.powi(2)).max(0.0).sqrt()
    }

    /// What disocclusion may cost, 1/255.
    pub fn disocclusion_dn(&self) -> f64 {
        DISOCCLUSION * self.picture_dn
    }
}

/// What the terrain's level of detail may take of what is left for it and misregistration, 1/255.
pub(crate) fn terrain_dn(misregistration_dn: f64) -> f64 {
    TERRAIN_OF_DN * misregistration_dn
}

/// Fraction of the picture that may be disoccluded in strips wider than `quality.max_error_px`.
pub(crate) fn disoccluded_fraction() -> f64 {
    DISOCCLUSION * (1.0 - PERCENTILE)
}

/// Part of the source error from which on more nodes of the exposure's path are worth a try.
pub(crate) fn worthwhile_nodes_px(total_px: f64) -> f64 {
    WORTHWHILE_NODES * total_px
}

/// Whether silhouettes cost little enough of a tolerance.
pub(crate) fn are_affordable(silhouettes: &SilhouetteError, max_error_dn: f64) -> bool {
    silhouettes.error_dn <= SILHOUETTES * max_error_dn
        && silhouettes.at_silhouettes_dn <= TIMES_AT_SILHOUETTES * max_error_dn
}
