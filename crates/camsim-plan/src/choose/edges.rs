//! How pixels at silhouettes are made.

use camsim_core::{
    pose::CameraPose,
    scenario::{QualitySpec, Silhouettes},
    temporal::IdealGeometry,
};

use crate::{
    ir::{limits::SIZE_QUANTUM_PX, predicted::SilhouetteError, skip::Skip, stages::EdgeStage},
    view::scene_outline::SceneOutline,
};

/// From this tolerance (1/255 RMS) on silhouettes are left as one sample a pixel shows them.
pub(crate) const IGNORED_DN: f64 = 16.0;
/// Most fine pixels along a side of an ideal pixel.
pub(crate) const MOST_FINE: u32 = 3;
/// Depth of 4 samples and the border between them, and with more than one fine pixel a pixel the colours of
/// the samples.
pub(crate) const FINE_PIXEL_BYTES: u64 = 4 * 4 + 8 + 4 * 8;
/// Memory that one supersampled ideal frame may take; with more pixels it has 4 fine pixels a pixel instead
/// of 9.
const MAX_FINE_BYTES: u64 = 512 << 20;

/// What the edge stage of a frame depends on.
pub(crate) struct EdgeCase<'a> {
    pub outline: &'a SceneOutline,
    pub pose: &'a CameraPose,
    pub ideal: &'a IdealGeometry,
    pub travel_m: f64,
    pub quality: &'a QualitySpec,
    pub max_side_px: u32,
    /// Why no silhouette can be in view, if none can.
    pub reason_for_none: Option<&'a str>,
    /// Picture error of silhouettes that are left as they are, if they are to be.
    pub plain: Option<&'a SilhouetteError>,
    /// Fine pixels along a side of an ideal pixel.
    pub fine: u32,
    /// Rays of an output pixel.
    pub rays: u32,
}

/// The edge stage of a frame.
pub(crate) fn edge_stage(case: &EdgeCase<'_>, skipped: &mut Vec<Skip>) -> EdgeStage {
    let EdgeCase { outline, pose, ideal, quality, max_side_px, plain, .. } = *case;
    let mut skip = |what, reason: String| skipped.push(Skip { what, reason });
    if let Some(reason) = case.reason_for_none {
        skip("silhouette rays", reason.to_owned());
        return EdgeStage::None;
    }
    if quality.silhouettes == Silhouettes::Auto && quality.max_error_dn >= IGNORED_DN {
        skip("silhouette rays", format!("quality.max_error_dn is {IGNORED_DN} or more"));
        return EdgeStage::None;
    }
    if let Some(SilhouetteError { at_silhouettes_dn: at_dn, error_dn, .. }) = plain {
        skip(
            "silhouette rays",
            format!("without them {error_dn:.2}/255 over the picture, {at_dn:.1}/255 at silhouettes"),
        );
        return EdgeStage::None;
    }
    let scale = most_fine(ideal.size_px, max_side_px).min(case.fine);
    // Ground is not thin. What is drawn in colour keeps its order of drawing.
    let thin = scale > 1 || outline.meshes_in_view(pose, ideal.tangents(), case.travel_m);
    EdgeStage::Supersampled { scale, samples: case.rays, thin }
}

/// Fine pixels along a side of an ideal pixel that there is memory for.
pub(crate) fn most_fine(ideal_px: [u32; 2], max_side_px: u32) -> u32 {
    let [width, height] = ideal_px.map(|side| u64::from(side.next_multiple_of(SIZE_QUANTUM_PX)));
    let fits = |scale: u64| {
        width.max(height) * scale <= u64::from(max_side_px)
            && width * height * scale * scale * FINE_PIXEL_BYTES <= MAX_FINE_BYTES
    };
    (2..=MOST_FINE).rev().find(|&scale| fits(u64::from(scale))).unwrap_or(1)
}
