//! The plan of the shown frame: passes and times, predicted errors, passes that are skipped.

use camsim_core::scenario::Face;
use camsim_plan::{FramePlan, Predicted};
use eframe::egui::{self, RichText, Ui};

use super::widgets::fact;
use crate::{
    engine::{Picture, Size},
    state::State,
};

/// Draws the page.
pub fn show(ui: &mut Ui, state: &State) {
    let Some(shown) = &state.engine.shown else {
        ui.label("no frame yet");
        return;
    };
    if shown.reply.request.size == Size::Preview {
        ui.weak("plan of the preview; that of the full frame follows after a pause of the input");
    }
    let has_terrain = state.engine.sequence().is_some_and(|sequence| sequence.scene.terrain.is_some());
    for picture in &shown.reply.pictures {
        ui.strong(format!("frame {}, {}", picture.plan.frame, picture.stage.label()));
        times(ui, picture);
        for plan in picture.plans() {
            // Unique on the page: grids and headers have names.
            let face = plan.camera.lens.face();
            let name = format!("{} {}", picture.stage.label(), face.map_or("", Face::name));
            if let Some(face) = face {
                ui.strong(format!("{} face", face.name()));
            }
            passes(ui, plan);
            errors(ui, plan, has_terrain);
            skipped(ui, plan, &name);
        }
        ui.separator();
    }
    if let Some(ms) = state.engine.full_ms {
        ui.label(format!("{:.1} frames/s in full size, one by one", 1e3 / ms.max(1e-3)));
    }
    ui.weak(format!("on {}", state.engine.adapter));
    for warning in state.engine.loaded.iter().flat_map(|loaded| &loaded.warnings) {
        ui.label(RichText::new(warning).color(ui.visuals().warn_fg_color));
    }
}

/// What each stage of a picture took.
fn times(ui: &mut Ui, picture: &Picture) {
    let times = &picture.times;
    let stages = [
        ("planned", Some(times.plan_ms), "on the cpu: choice of methods, triangles, poses"),
        ("recorded", Some(times.record_ms), "on the cpu: passes for the gpu"),
        ("submitted", Some(times.submit_ms), "by the driver"),
        ("ideal frame", times.ideal_ms, "drawn on the cpu"),
        ("waited", Some(times.wait_ms), "for the gpu"),
        ("output frame", times.reverse_ms, "rendered on the cpu"),
        ("read", Some(times.read_ms), "from the gpu, with rays of truth"),
    ];
    let known = stages.iter().filter_map(|(name, ms, tip)| Some((*name, (*ms)?, *tip)));
    let known: Vec<_> = known.filter(|(_, ms, _)| *ms > 0.0).collect();
    let sum_ms: f64 = known.iter().map(|(_, ms, _)| ms).sum();
    for (name, ms, tip) in known {
        fact(ui, name, format!("{ms:.1} ms"), tip);
    }
    let rest_ms = picture.took_ms - sum_ms;
    if rest_ms >= 0.0 {
        fact(
            ui,
            "the rest",
            format!("{rest_ms:.1} ms"),
            "scene for this stage, optics, sensor, picture for the screen",
        );
    }
    let tip = "for this picture; faces overlap, so that their stages may sum to more";
    fact(ui, "in all", format!("{:.1} ms", picture.took_ms), tip);
    for pass in &times.passes {
        fact(ui, pass.name, format!("{:.2} ms", pass.ms), "on the gpu, by time stamps, while waited for");
    }
}

/// Passes of a plan.
fn passes(ui: &mut Ui, plan: &FramePlan) {
    for pass in plan.passes() {
        ui.label(format!("- {pass}"));
    }
}

/// Predicted errors, and whether they are within the scenario's tolerances.
fn errors(ui: &mut Ui, plan: &FramePlan, has_terrain: bool) {
    let predicted = &plan.predicted;
    if predicted.probes == 0 {
        verdict(ui, false, Some("no probe has a source in the ideal frame: the picture is empty"));
        return;
    }
    source_error(ui, plan, has_terrain);
    verdict(ui, predicted.source_error_kept, predicted.source_error_obstacle.as_deref());
    picture_error(ui, predicted);
    verdict(ui, predicted.picture_error_kept, predicted.picture_error_obstacle.as_deref());
    if plan.extrapolated {
        ui.label(
            RichText::new("beyond the log: extrapolated at constant velocity")
                .color(ui.visuals().warn_fg_color),
        );
    }
}

/// Whether a tolerance is kept, and otherwise why not.
fn verdict(ui: &mut Ui, is_kept: bool, cause: Option<&str>) {
    if is_kept {
        ui.weak("within the tolerance");
    } else {
        let text = format!("the tolerance is EXCEEDED: {}", cause.unwrap_or("see camsim explain"));
        ui.label(RichText::new(text).color(ui.visuals().warn_fg_color));
    }
}

/// Source error by cause.
fn source_error(ui: &mut Ui, plan: &FramePlan, has_terrain: bool) {
    let predicted = &plan.predicted;
    fact(
        ui,
        "predicted error",
        format!("{:.4} px", predicted.total_px),
        "bound on the 99th percentile of the source error",
    );
    let parts = [
        ("lens", predicted.lens_px, "lens inverse"),
        ("temporal", predicted.temporal_px, "model of the motion"),
        ("depth", predicted.depth_px, "interpolation of the ideal frame's depth"),
        ("nodes", predicted.nodes_px, "interpolation between nodes of the exposure path"),
        ("single precision", predicted.rounding_px, "rounding of poses, depth, coordinates"),
    ];
    for (what, px, tip) in parts {
        fact(ui, what, format!("{px:.5} px"), tip);
    }
    if has_terrain {
        fact(
            ui,
            "terrain",
            format!("{:.3} px", plan.terrain_error_px / plan.ideal.scale(&plan.camera)),
            "bound on the image error of its level of detail",
        );
    }
    if predicted.silhouette_fraction > 0.0 {
        let fraction = format!("at least {:.1} %", 100.0 * predicted.silhouette_fraction);
        fact(
            ui,
            "silhouettes",
            fraction,
            "pixels at silhouettes and creases: no bound on their source error",
        );
    }
    if let Some(disocclusion) = predicted.disocclusion {
        let text = format!("{:.4} %, {:.2} px wide", 100.0 * disocclusion.fraction, disocclusion.width_px);
        fact(
            ui,
            "disocclusion",
            text,
            "fraction of the picture that no ideal frame shows, behind silhouettes",
        );
    }
}

/// Picture error by cause.
fn picture_error(ui: &mut Ui, predicted: &Predicted) {
    fact(
        ui,
        "picture error",
        format!("{:.3} of 255", predicted.picture_dn()),
        "expected RMS picture error, all causes",
    );
    fact(
        ui,
        "resampling",
        format!("{:.3}", predicted.resampling_dn),
        "resampling of the ideal frame, away from silhouettes",
    );
    fact(ui, "blur samples", format!("{:.3}", predicted.blur_dn), "finite number of exposure samples");
    fact(
        ui,
        "misregistration",
        format!("{:.3}", predicted.misregistration_dn),
        "by source errors, away from silhouettes",
    );
    if let Some(terrain) = predicted.terrain {
        fact(ui, "terrain", format!("{:.3}", terrain.error_dn()), "level of detail, also at silhouettes");
    }
    if let Some(silhouettes) = predicted.silhouettes {
        fact(
            ui,
            "silhouettes",
            format!("{:.3}", silhouettes.error_dn),
            "by pixels of the ideal frame or by silhouette rays",
        );
    }
    if let Some(blended) = predicted.blended_depth {
        let text = format!("{:.3}, {:.0} % of the picture", blended.error_dn, 100.0 * blended.fraction);
        fact(ui, "blended surfaces", text, "blended surfaces, reprojected by the depth of one");
    }
}

/// Passes that are skipped, with reasons.
fn skipped(ui: &mut Ui, plan: &FramePlan, name: &str) {
    egui::CollapsingHeader::new(format!("skipped ({})", plan.skipped.len()))
        .id_salt(("skipped", name))
        .default_open(plan.camera.lens.face().is_none_or(|face| face == Face::Front))
        .show(ui, |ui| {
            for skip in &plan.skipped {
                ui.label(RichText::new(skip.what).strong());
                ui.indent((skip.what, name), |ui| ui.label(&skip.reason));
            }
        });
}
