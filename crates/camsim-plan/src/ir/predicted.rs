//! Predicted errors of a frame, by cause: what `camsim explain` prints and `camsim verify` sets beside the
//! measured ones.

use serde::Serialize;

/// Predicted errors of a frame. All `_px` are pixels of the ideal frame and bound the 99th percentile over
/// the valid pixels that are farther than 3 px from any silhouette. All `_dn` are expected RMS values over
/// the picture, 1/255 of the linear range.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Predicted {
    /// Lens inverse.
    pub lens_px: f64,
    /// Temporal inverse: model of the motion, look-ups of depth not made.
    pub temporal_px: f64,
    /// Depth between the ideal frame's pixels and by the terrain's level of detail.
    pub depth_px: f64,
    /// The part of `depth_px` that is the level of detail's.
    pub level_of_detail_px: f64,
    /// Curves between the nodes of the exposure; nothing at mid-exposure, which is solved for itself.
    pub nodes_px: f64,
    /// Single precision of poses, depth and coordinates.
    pub rounding_px: f64,
    /// Resampling, away from silhouettes.
    pub resampling_dn: f64,
    /// Too few samples over the exposure, away from silhouettes.
    pub blur_dn: f64,
    /// Misregistration by the source error, away from silhouettes.
    pub misregistration_dn: f64,
    /// The terrain's level of detail; `None` without a terrain.
    pub terrain: Option<TerrainError>,
    /// Silhouettes, as they are made: left as the ideal frame's pixels show them, or with rays of their own.
    /// `None` where none can be in view, or nothing depends on their error.
    pub silhouettes: Option<SilhouetteError>,
    /// One depth for light of several blended surfaces; `None` where nothing in the scene is blended.
    pub blended_depth: Option<BlendedDepthError>,
    /// Whether the picture error is within `quality.max_error_dn`.
    pub picture_error_kept: bool,
    /// What keeps the picture error above `quality.max_error_dn`, where it is.
    pub picture_error_obstacle: Option<String>,
    /// Source error by all causes: the bound on the 99th percentile.
    pub total_px: f64,
    /// Fraction of the pixels that are counted apart: at a silhouette or disoccluded. To within some hundredths,
    /// and too low where folds of depth lie between the nine rays that look for them.
    pub silhouette_fraction: f64,
    /// Fraction of the probes that have a ray but no source: what they see lies outside of the ideal frame
    /// ([`SourceError::NoSource`](super::error_map::SourceError::NoSource)).
    pub void_fraction: f64,
    /// Disocclusion with the plan's key frames; `None` where it is not looked for.
    pub disocclusion: Option<Disocclusion>,
    /// Disocclusion with a single key frame; `None` where it is not looked for.
    pub disocclusion_of_one_key: Option<Disocclusion>,
    /// Probes with a source, of all frames that share the ideal frame and are solved in the same way.
    pub probes: u32,
    /// Whether `total_px` is within `quality.max_error_px`, and no more than a hundredth of the probes are
    /// void.
    pub source_error_kept: bool,
    /// What keeps the source error above `quality.max_error_px`, where it is.
    pub source_error_obstacle: Option<String>,
}

impl Predicted {
    /// Picture error by all causes, which `quality.max_error_dn` bounds: RMS over the picture, 1/255 of the
    /// linear range.
    #[must_use]
    pub fn picture_dn(&self) -> f64 {
        self.without_blended_depth_dn().hypot(self.blended_depth.map_or(0.0, |blended| blended.error_dn))
    }

    /// Picture error by all causes but the one depth of blended surfaces.
    pub(crate) fn without_blended_depth_dn(&self) -> f64 {
        let silhouettes_dn = self.silhouettes.map_or(0.0, |silhouettes| silhouettes.error_dn);
        let terrain_dn = self.terrain.map_or(0.0, |terrain| terrain.error_dn());
        self.resampling_dn
            .hypot(self.blur_dn)
            .hypot(self.misregistration_dn)
            .hypot(terrain_dn)
            .hypot(silhouettes_dn)
    }
}

/// Picture error at silhouettes, as they are made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SilhouetteError {
    /// Fraction of the pixels within 3 px of one, folds of depth included.
    pub fraction: f64,
    /// RMS contrast across them, 1/255 of the linear range.
    pub contrast_dn: f64,
    /// Fraction of the picture that the ideal frame's camera does not see behind them.
    pub disoccluded_fraction: f64,
    /// RMS error of the pixels within 3 px of them, 1/255 of the linear range.
    pub at_silhouettes_dn: f64,
    /// RMS error over the picture by them, 1/255 of the linear range.
    pub error_dn: f64,
}

/// Scene that pixels see and the ideal frames of a plan do not show, as the probes find it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Disocclusion {
    /// Fraction of the picture, over its area and exposure.
    pub fraction: f64,
    /// Width of the strips, the mean over that fraction, pixels of the ideal frame.
    pub width_px: f64,
    /// Fraction of the picture in strips wider than `quality.max_error_px`.
    pub wide_fraction: f64,
    /// Fraction of the picture, where a strip narrower than a pixel counts as much less.
    pub weighted_fraction: f64,
    /// Expected error, RMS over the picture, 1/255 of the linear range. A strip narrower than a pixel is as
    /// much less of each that it crosses.
    pub error_dn: f64,
}

/// Picture error by the one depth that light of several blended surfaces has.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct BlendedDepthError {
    /// Fraction of the pixels that show blended surfaces.
    pub fraction: f64,
    /// RMS error over the picture, 1/255 of the linear range.
    pub error_dn: f64,
}

/// Picture error by the terrain's level of detail.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct TerrainError {
    /// RMS displacement over the picture, pixels of the camera's focal length.
    pub displacement_px: f64,
    /// RMS error over the picture by the displaced texture, 1/255 of the linear range.
    pub surface_dn: f64,
    /// RMS error over the picture by displaced silhouettes, 1/255 of the linear range.
    pub silhouettes_dn: f64,
}

impl TerrainError {
    /// Of surface and silhouettes.
    #[must_use]
    pub fn error_dn(&self) -> f64 {
        self.surface_dn.hypot(self.silhouettes_dn)
    }

    /// With so many times the tolerance: errors fall in proportion, or faster.
    pub(crate) fn times(self, times: f64) -> Self {
        Self {
            displacement_px: times * self.displacement_px,
            surface_dn: times * self.surface_dn,
            silhouettes_dn: times * self.silhouettes_dn,
        }
    }
}
