//! Predicted errors of a frame, by cause: what `camsim explain` prints and `camsim verify` sets beside the
//! measured ones.

use serde::Serialize;

use super::{Contours, Ground, Holes, Layers};

/// Predicted errors of a frame. All `_px` are pixels of the ideal frame and bound the 99th percentile over
/// the valid pixels that are farther than 3 px from any silhouette.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Predicted {
    /// Lens inverse.
    pub lens_px: f64,
    /// Temporal inverse: model of the motion, look-ups of depth not made.
    pub temporal_px: f64,
    /// Depth between the ideal frame's pixels and by the terrain's level of detail.
    pub depth_px: f64,
    /// The part of it that is the level of detail's.
    pub level_of_detail_px: f64,
    /// Curves between the nodes of the exposure; nothing at mid-exposure, which is solved for itself.
    pub nodes_px: f64,
    /// Single precision of poses, depth and coordinates.
    pub format_px: f64,
    /// Resampling: what is expected of its RMS over the picture away from silhouettes, 1/255 of the linear
    /// range.
    pub resampling_dn: f64,
    /// The same of too few samples over the exposure.
    pub blur_dn: f64,
    /// The same of sources beside their place.
    pub displaced_dn: f64,
    /// What it costs that the terrain is drawn coarser than it is; `None` without one.
    pub ground: Option<Ground>,
    /// What silhouettes cost, as they are made: left as the ideal frame's pixels show them, or with rays of
    /// their own. `None` where none can be in view, or nobody asks.
    pub silhouettes: Option<Contours>,
    /// Light that is mixed of several surfaces, and what it costs that it follows the depth of one. `None`
    /// where nothing in the scene is.
    pub layers: Option<Layers>,
    /// Whether all of them together are within `quality.max_error_dn`.
    pub levels_kept: bool,
    /// If not: what is in the way.
    pub levels_in_the_way: Option<String>,
    /// All together: the bound on the 99th percentile.
    pub total_px: f64,
    /// Share of the pixels that are counted apart: at a silhouette or not seen from the key pose. To within
    /// some hundredths, and too low where folds of depth lie between the nine rays that look for them.
    pub silhouette_share: f64,
    /// Share of the probes that have a ray but no source: what they see lies outside of the ideal frame, and
    /// their pixels stay empty.
    pub void_share: f64,
    /// What no ideal frame sees, and what a single one would not; `None` where nobody looks behind
    /// silhouettes.
    pub holes: Option<Holes>,
    /// See above.
    pub holes_of_one: Option<Holes>,
    /// Probes with a source, of all frames that share the ideal frame and are solved in the same way.
    pub probes: u32,
    /// Whether `total_px` is within `quality.max_error_px`, and no more than a hundredth of the probes are
    /// void.
    pub kept: bool,
    /// If not: what is in the way.
    pub in_the_way: Option<String>,
}

impl Predicted {
    /// What `quality.max_error_dn` bounds, all together: RMS over the picture, 1/255 of the linear range.
    #[must_use]
    pub fn picture_dn(&self) -> f64 {
        self.without_layers_dn().hypot(self.layers.map_or(0.0, |layers| layers.error_dn))
    }

    /// The same without what mixed light costs by having one depth.
    pub(super) fn without_layers_dn(&self) -> f64 {
        let at_silhouettes_dn = self.silhouettes.map_or(0.0, |silhouettes| silhouettes.error_dn);
        let by_ground_dn = self.ground.map_or(0.0, |ground| ground.error_dn());
        self.resampling_dn
            .hypot(self.blur_dn)
            .hypot(self.displaced_dn)
            .hypot(by_ground_dn)
            .hypot(at_silhouettes_dn)
    }
}
