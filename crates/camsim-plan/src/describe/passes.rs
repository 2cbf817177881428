//! The passes of a plan as text.

use camsim_core::{
    scenario::{Preset, Primary},
    temporal::{TapStage, displacement::RK2_STEP_DEG},
};

use crate::ir::{
    frame_plan::FramePlan,
    stages::{
        BlurStage, EdgeStage, NodeDepths, PathStage, PrefilterTaps, RayStage, ShadowStage, TemporalStage,
    },
};

/// Names of the passes, in order.
pub(crate) fn passes(plan: &FramePlan) -> Vec<String> {
    let mut passes = Vec::new();
    if plan.ray == RayStage::LensMap {
        passes.push("lens_inverse: lens map, kept while the lens holds".to_owned());
    }
    passes.push(ideal_pass(plan));
    passes.extend(plan.shadows.map(|ShadowStage { border_rays }| {
        format!(
            "shadows: a ray to the sun from each sample of the ideal frame, {border_rays} a pixel at their borders; by \
             the cpu, as are all passes of this frame"
        )
    }));
    passes.extend(edge_passes(plan));
    let truth = if plan.truth { ", depth and coordinates" } else { "" };
    let (ray, temporal) = (ray(plan.ray), temporal(plan.temporal));
    let (gather, taps) = (gather(plan), taps(plan.taps));
    passes.push(format!("reverse: {ray} -> {temporal} -> {gather} ({taps}) -> photometric{truth}"));
    for other in plan.other_colors() {
        let name = other.primary.map_or("", Primary::name);
        passes.push(format!("reverse: as before, of {name}, by a lens of its own"));
    }
    if let EdgeStage::Supersampled { samples, .. } = plan.edges {
        passes.push(format!("rays: {samples} a pixel, where it may see a silhouette"));
    }
    passes.push("readback".to_owned());
    passes.extend(plan.finishing.iter().map(ToString::to_string));
    if plan.has_exact_truth() {
        passes.push("cpu: a ray in f64 a pixel for depth and coordinates".to_owned());
    }
    passes
}

/// Several ideal frames, as part of a sentence.
fn frames(plan: &FramePlan) -> String {
    match plan.keys.len() {
        1 => String::new(),
        count => {
            let spacing_ms = 1e3 * (plan.window_s[1] - plan.window_s[0]) / count as f64;
            format!("{count} frames, {spacing_ms:.1} ms apart, of ")
        }
    }
}

fn ideal_pass(plan: &FramePlan) -> String {
    let [width, height] = plan.ideal.size_px;
    let frames = frames(plan);
    let reads = match plan.surface_reads {
        PrefilterTaps::One => "1 texture read a pixel",
        PrefilterTaps::Two => "2 texture reads a pixel",
        PrefilterTaps::Four => "4 texture reads a pixel",
        PrefilterTaps::Grid => "up to 2x32 texture reads a pixel",
    };
    let samples = match plan.samples_a_pixel {
        1 => String::new(),
        several => format!(" of {several} samples"),
    };
    let shared = match (plan.shared_frames, plan.unshared_reason) {
        (Some([first, last]), _) => format!(", one for frames {first} to {last}"),
        (None, Some(why)) => format!(", for this frame alone ({why})"),
        (None, None) => String::new(),
    };
    let color = if plan.preset == Preset::Paper { "rgba8unorm (sRGB as stored)" } else { "rgba16float" };
    let blended = if plan.predicted.blended_depth.is_some() {
        ", blended surfaces last and from behind to the front"
    } else {
        ""
    };
    format!(
        "ideal: {frames}{width}x{height} px {color} + depth32float (reversed){samples}, {reads}{blended}{shared}"
    )
}

fn edge_passes(plan: &FramePlan) -> Vec<String> {
    let EdgeStage::Supersampled { scale, thin, .. } = plan.edges else { return Vec::new() };
    let [width, height] = plan.ideal.size_px;
    let frames = frames(plan);
    let mask = format!("{width}x{height} px, marked where several surfaces are seen");
    let color = if scale > 1 { "rgba16float + " } else { "" };
    let fine = format!("{frames}{}x{} px {color}depth32float, 4 samples each", width * scale, height * scale);
    let mut passes = if thin {
        vec![format!("ideal_fine: {fine}"), format!("edge_mask: {mask}, by their samples too")]
    } else {
        vec![
            format!("edge_mask: {mask}"),
            "triangles_near_edges: those near marked pixels".to_owned(),
            format!("ideal_fine: {fine}, of those triangles"),
        ]
    };
    passes.push("edge_mask_to_alpha: into the alpha of the colour".to_owned());
    passes.push("borders: lines within marked pixels; what lies within reach".to_owned());
    passes
}

fn ray(ray: RayStage) -> &'static str {
    match ray {
        RayStage::Pinhole => "pinhole ray",
        RayStage::LensMap => "lens map",
        RayStage::GaussNewton => "Gauss-Newton lens inverse",
    }
}

fn temporal(temporal: TemporalStage) -> String {
    match temporal {
        TemporalStage::Identity => "no motion".to_owned(),
        TemporalStage::Rotation => "rotation per row".to_owned(),
        TemporalStage::Reproject { iterations } => {
            let s = if iterations == 1 { "" } else { "s" };
            format!("reproject per row, {iterations} depth look-up{s}")
        }
        TemporalStage::Linear => "linear displacement (eq. 16) at the key instant's twist".to_owned(),
        TemporalStage::Rk2 => {
            format!("RK2 displacement (eq. 18), steps of {RK2_STEP_DEG} deg, at the key instant's twist")
        }
    }
}

fn gather(plan: &FramePlan) -> String {
    match plan.blur {
        None => "sharp".to_owned(),
        Some(blur) if plan.preset == Preset::Paper => {
            format!("straight blur of {} samples, ends included", blur.max_samples)
        }
        Some(blur) => exact_gather(plan.temporal, &blur),
    }
}

fn exact_gather(temporal: TemporalStage, blur: &BlurStage) -> String {
    let depth = match (temporal, blur.depths) {
        (TemporalStage::Reproject { .. }, NodeDepths::Mid) => " of one depth",
        (TemporalStage::Reproject { .. }, NodeDepths::Ends) => " with depth of both ends",
        (TemporalStage::Reproject { .. }, NodeDepths::Three) => " with depth of both ends and the middle",
        _ => "",
    };
    let curve = match blur.path {
        PathStage::Straight => "straight lines",
        PathStage::Parabola => "parabolas",
        PathStage::Quartic => "quartics",
    };
    format!(
        "blur along {curve} through {} nodes{depth}, {:.2} samples a px of path, at most {} a pixel",
        blur.solved(),
        blur.samples_per_px,
        blur.stretches() * blur.max_samples
    )
}

fn taps(taps: TapStage) -> String {
    match taps {
        TapStage::Bilinear => "bilinear".to_owned(),
        TapStage::Spline => "spline".to_owned(),
        TapStage::Area => "spline, or mean over the pixel's area".to_owned(),
        TapStage::Grid { most } => format!("up to {most}x{most} taps a pixel"),
        TapStage::SplineOrGrid { most } => format!("spline, or up to {most}x{most} taps a pixel"),
    }
}
