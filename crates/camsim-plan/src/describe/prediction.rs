//! The predicted errors as text.

use std::fmt;

use crate::ir::predicted::{BlendedDepthError, Disocclusion, Predicted};

/// Source error and picture error by cause.
pub(crate) fn write_prediction(predicted: &Predicted, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    writeln!(f, "predicted source error, ideal px (99th percentile; pixels at silhouettes are not counted)")?;
    if predicted.probes == 0 {
        return writeln!(
            f,
            "  nothing predicted: no pixel tried has a source in the ideal frame; the picture will be empty"
        );
    }
    write_source_error(predicted, f)?;
    write_picture_error(predicted, f)
}

fn verdict(kept: bool) -> &'static str {
    if kept { "within the tolerance" } else { "the tolerance is NOT KEPT" }
}

/// By cause, the largest first.
fn write_source_error(predicted: &Predicted, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let Predicted { total_px, probes, silhouette_fraction, level_of_detail_px, .. } = *predicted;
    let verdict = verdict(predicted.source_error_kept);
    writeln!(f, "  99 % of the pixels: at most {total_px:.2e}, from dry runs of {probes} pixels: {verdict}")?;
    if let Some(cause) = &predicted.source_error_obstacle {
        writeln!(f, "  obstacle: {cause}")?;
    }
    let detail = if level_of_detail_px > 0.0 {
        format!(" (level of detail {level_of_detail_px:.2e})")
    } else {
        String::new()
    };
    let mut causes = [
        (predicted.lens_px, "lens inverse", ""),
        (predicted.temporal_px, "temporal inverse", ""),
        (predicted.depth_px, "depth between pixels", detail.as_str()),
        (predicted.nodes_px, "path between exposure nodes", ""),
        (predicted.rounding_px, "single precision", ""),
    ];
    causes.sort_by(|a, b| b.0.total_cmp(&a.0));
    for (px, cause, more) in causes.into_iter().filter(|cause| cause.0 > 0.0) {
        writeln!(f, "  {px:.2e} {cause}{more}")?;
    }
    if silhouette_fraction > 0.0 {
        writeln!(
            f,
            "  not counted: at least {:.0} % of the pixels, at silhouettes or creases",
            100.0 * silhouette_fraction
        )?;
    }
    let Some(Disocclusion { fraction, width_px, .. }) = predicted.disocclusion else { return Ok(()) };
    let of_one = predicted
        .disocclusion_of_one_key
        .filter(|_| predicted.disocclusion != predicted.disocclusion_of_one_key);
    let beside = of_one.map_or_else(String::new, |one| {
        format!(" (of a single one {:.4} %, {:.2} px)", 100.0 * one.fraction, one.width_px)
    });
    let fraction = 100.0 * fraction;
    writeln!(
        f,
        "  disocclusion: {fraction:.4} % of the picture is hidden from the ideal frames, in strips of \
         {width_px:.2} px{beside}"
    )
}

fn write_picture_error(predicted: &Predicted, f: &mut fmt::Formatter<'_>) -> fmt::Result {
    let Predicted { blur_dn, resampling_dn, misregistration_dn, .. } = *predicted;
    let terrain = predicted.terrain.map_or_else(String::new, |terrain| {
        format!(", {:.2} by the terrain's level of detail", terrain.error_dn())
    });
    let silhouettes = predicted
        .silhouettes
        .map_or_else(String::new, |silhouettes| format!(", {:.2} at silhouettes", silhouettes.error_dn));
    let blended =
        predicted.blended_depth.map_or_else(String::new, |BlendedDepthError { fraction, error_dn }| {
            format!(
                ", {error_dn:.2} by the one depth of blended surfaces ({:.0} % of the picture)",
                100.0 * fraction
            )
        });
    writeln!(
        f,
        "predicted picture error, 1/255 of the linear range (RMS): {resampling_dn:.2} by resampling, {blur_dn:.2} by blur samples, {misregistration_dn:.2} by misregistration{terrain}{silhouettes}{blended}: {}",
        verdict(predicted.picture_error_kept)
    )?;
    match &predicted.picture_error_obstacle {
        Some(cause) => writeln!(f, "  obstacle: {cause}"),
        None => Ok(()),
    }
}
