//! What keeps the picture error above `quality.max_error_dn`.

use camsim_core::scenario::{Auto, Preset, QualitySpec};

use super::picture::PictureChoice;
use crate::ir::{margins, predicted::Predicted};

/// What keeps the picture error above the tolerance; `None` if nothing does.
pub(crate) fn to_picture_error(
    quality: &QualitySpec,
    picture: &PictureChoice,
    predicted: &Predicted,
) -> Option<String> {
    let total_dn = predicted.picture_dn();
    if total_dn <= margins::ROUNDED * quality.max_error_dn {
        return None;
    }
    if quality.preset == Preset::Paper {
        return Some(format!("quality.preset \"paper\": {total_dn:.2}/255 and what is not in it"));
    }
    let Predicted { resampling_dn, blur_dn, misregistration_dn, terrain, silhouettes, .. } = *predicted;
    let sampling_dn = resampling_dn.hypot(blur_dn);
    let silhouettes_dn = silhouettes.map_or(0.0, |silhouettes| silhouettes.error_dn);
    let blended_dn = predicted.blended_depth.map_or(0.0, |blended| blended.error_dn);
    let terrain_dn = terrain.map_or(0.0, |terrain| terrain.error_dn());
    if terrain_dn > misregistration_dn.max(sampling_dn).max(silhouettes_dn).max(blended_dn) {
        return Some(format!(
            "the terrain's level of detail (quality.max_terrain_error_px): {terrain_dn:.2}/255"
        ));
    }
    if misregistration_dn > sampling_dn.max(silhouettes_dn).max(blended_dn) {
        let by = if quality.solver == Auto::Auto { "" } else { " (quality.solver is given)" };
        return Some(format!("misregistration{by}: {misregistration_dn:.2}/255"));
    }
    if blended_dn > sampling_dn.max(silhouettes_dn) {
        return Some(format!("blended surfaces move with one depth: {blended_dn:.2}/255"));
    }
    if silhouettes_dn > sampling_dn {
        let how = if picture.is_plain { "where they are left as they are" } else { "with rays of their own" };
        return Some(format!("quality.silhouettes: {silhouettes_dn:.2}/255 {how}"));
    }
    Some(match (blur_dn > resampling_dn, quality.blur_samples, quality.footprint_taps, quality.ideal_scale) {
        (true, Auto::Value(_), ..) => format!("quality.blur_samples: {blur_dn:.2}/255"),
        (true, ..) => format!("samples over the exposure: {blur_dn:.2}/255"),
        (false, _, Auto::Value(_), _) => format!("quality.footprint_taps: {resampling_dn:.2}/255"),
        (false, _, _, Auto::Value(_)) => format!("quality.ideal_scale: {resampling_dn:.2}/255"),
        _ => format!(
            "detail finer than an ideal frame of {:.2} times the camera's scale holds (quality.ideal_scale may be more): {resampling_dn:.2}/255",
            picture.plan.scale
        ),
    })
}
