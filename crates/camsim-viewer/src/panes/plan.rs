//! The frame's plan: passes with their times, what is left out and why, and how far off the pixels will be.

use eframe::egui::{self, RichText, Ui};

use super::widgets::{fact, facts};
use crate::{
    engine::{Picture, Size},
    state::State,
};

/// The page.
pub fn show(ui: &mut Ui, state: &State) {
    let Some(shown) = &state.heard.shown else {
        ui.label("no frame yet");
        return;
    };
    if shown.reply.wanted.size == Size::Preview {
        ui.weak("of the preview; the frame's own plan follows when the hand rests");
    }
    for picture in &shown.reply.pictures {
        ui.strong(format!("frame {}, {}", picture.plan.frame, picture.stage.label()));
        passes(ui, picture);
        errors(ui, picture);
        skipped(ui, picture);
        ui.separator();
    }
    if let Some(ms) = state.heard.full_ms {
        ui.label(format!("{:.1} frames/s one by one in full size", 1e3 / ms.max(1e-3)));
    }
    ui.weak(format!("on {}", state.heard.adapter));
    for warning in state.heard.loaded.iter().flat_map(|loaded| &loaded.warnings) {
        ui.label(RichText::new(warning).color(ui.visuals().warn_fg_color));
    }
}

fn passes(ui: &mut Ui, picture: &Picture) {
    for pass in picture.plan.passes() {
        ui.label(format!("- {pass}"));
    }
    let times = &picture.times;
    facts(ui, &format!("times {}", picture.stage.label()), |ui| {
        fact(ui, "planned in", format!("{:.1} ms", times.plan_ms), "on the host: choice of methods by dry runs, triangles, poses");
        fact(ui, "recorded in", format!("{:.1} ms", times.record_ms), "on the host");
        fact(ui, "submitted in", format!("{:.1} ms", times.submit_ms), "by the driver");
        fact(ui, "waited", format!("{:.1} ms", times.wait_ms), "for the device");
        fact(ui, "read in", format!("{:.1} ms", times.read_ms), "from the device");
        for pass in &times.passes {
            fact(ui, pass.name, format!("{:.2} ms", pass.ms), "on the device, by its time stamps");
        }
    });
}

fn errors(ui: &mut Ui, picture: &Picture) {
    let predicted = &picture.plan.predicted;
    let kept = if predicted.kept {
        String::new()
    } else {
        format!(" - not within the tolerance: {}", predicted.in_the_way.as_deref().unwrap_or(""))
    };
    facts(ui, &format!("errors {}", picture.stage.label()), |ui| {
        fact(
            ui,
            "predicted error",
            format!("{:.4} px{kept}", predicted.total_px),
            "bound on the 99th percentile of the source coordinate's error",
        );
        let parts = [
            ("lens", predicted.lens_px, "lens inverse"),
            ("temporal", predicted.temporal_px, "model of the motion"),
            ("depth", predicted.depth_px, "depth between pixels of the ideal frame"),
            ("nodes", predicted.nodes_px, "curves between the nodes of the exposure"),
            ("single precision", predicted.format_px, "poses, depth, coordinates"),
        ];
        for (what, px, tip) in parts {
            fact(ui, what, format!("{px:.5} px"), tip);
        }
        fact(ui, "grey levels", format!("{:.3} of 255", predicted.picture_dn()), "expected RMS of the picture");
    });
}

fn skipped(ui: &mut Ui, picture: &Picture) {
    egui::CollapsingHeader::new(format!("left out ({})", picture.plan.skipped.len()))
        .id_salt(("skipped", picture.stage.label()))
        .default_open(true)
        .show(ui, |ui| {
            for skip in &picture.plan.skipped {
                ui.label(RichText::new(skip.what).strong());
                ui.indent((skip.what, picture.stage.label()), |ui| ui.label(&skip.reason));
            }
        });
}
