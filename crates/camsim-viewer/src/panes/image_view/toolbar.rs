//! What is shown, and how.

use eframe::egui::{self, Role, Ui};

use super::canvas::{self, Placement};
use crate::{
    engine::Stage,
    message::{Message, Outbox},
    panes::widgets::{choice, named},
    state::State,
    view::{Compare, View},
};

/// Lines above the picture.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let mut view = state.view.clone();
    ui.horizontal_wrapped(|ui| {
        for compare in Compare::ALL {
            choice(ui, view.compare == compare, compare.label(), compare.label(), "how A and B are held against each other")
                .clicked()
                .then(|| view.compare = compare);
        }
        if view.compare == Compare::Difference {
            let gain = ui.add(egui::Slider::new(&mut view.gain, 1.0..=64.0).logarithmic(true).prefix("x").max_decimals(1));
            named(&gain, Role::Slider, "gain");
        }
        ui.separator();
        zoom(ui, &mut view);
    });
    let one = view.compare == Compare::Single;
    ui.horizontal_wrapped(|ui| {
        stages(ui, "A", &mut view.a);
        if one {
            ui.separator();
            overlays(ui, &mut view);
        }
    });
    // One below the other, each stage of B below that of A.
    if !one {
        ui.horizontal_wrapped(|ui| stages(ui, "B", &mut view.b));
        ui.horizontal_wrapped(|ui| overlays(ui, &mut view));
    }
    if view != state.view {
        out.push(Message::View(view));
    }
}

fn stages(ui: &mut Ui, name: &str, of: &mut Stage) {
    ui.strong(name);
    for stage in Stage::ALL {
        let full = format!("{name}: {}", stage.label());
        if choice(ui, *of == stage, stage.label(), &full, stage.explanation()).clicked() {
            *of = stage;
        }
    }
}

/// Under which the zoom of the last pass is found.
fn shown_zoom() -> egui::Id {
    egui::Id::unique("zoom of the picture as it was shown")
}

/// How large the picture is in this pass, for the line above it in the next one: a fitted picture is as large as its pane has it.
pub fn remember(ui: &Ui, placement: Option<&Placement>) {
    if let Some(placement) = placement {
        ui.data_mut(|data| data.insert_temp(shown_zoom(), placement.zoom()));
    }
}

fn zoom(ui: &mut Ui, view: &mut View) {
    let shown: Option<f32> = ui.data(|data| data.get_temp(shown_zoom()));
    let current = view.zoom.or(shown).unwrap_or(1.0);
    if ui.selectable_label(view.zoom.is_none(), "fit").on_hover_text("the whole picture (F)").clicked() {
        view.zoom = None;
    }
    if ui
        .selectable_label(view.zoom == Some(1.0), "1:1")
        .on_hover_text("a pixel of the screen for each pixel of the picture, whatever the screen's scale (1)")
        .clicked()
    {
        *view = canvas::zoomed_in_place(view, 1.0, 1.0);
    }
    for (text, name, factor) in [("-", "zoom out", 0.5), ("+", "zoom in", 2.0)] {
        let button = ui.small_button(text).on_hover_text(name);
        named(&button, Role::Button, name);
        if button.clicked() {
            *view = canvas::zoomed_in_place(view, current, factor);
        }
    }
    if view.zoom.is_some() || shown.is_some() {
        ui.weak(format!("{:.0} %", 100.0 * view.zoom.unwrap_or(current)))
            .on_hover_text("100 %: a pixel of the screen for each pixel of the picture");
    }
}

fn overlays(ui: &mut Ui, view: &mut View) {
    let over = &mut view.overlays;
    ui.toggle_value(&mut over.invalid, "invalid")
        .on_hover_text("pixels without a ray, or outside of every ideal frame, in the paper's red (I)");
    ui.toggle_value(&mut over.grid, "grid").on_hover_text("lines of equal ideal ray: what the lens does to a square grid (G)");
    ui.toggle_value(&mut over.motion, "motion").on_hover_text(
        "8 times as large: from where each place would be at the stamp to where it is at its row's time (eq. 16, blue), and its way over the exposure (orange) (M)",
    );
    ui.toggle_value(&mut over.rows, "row times").on_hover_text("mid-exposure of each row after the stamp");
    ui.toggle_value(&mut over.error, "predicted error")
        .on_hover_text("colours of the error of source coordinates that is predicted where the plan tried its methods: bright is large");
    ui.toggle_value(&mut over.depth, "depth").on_hover_text("planar depth in place of colour: near is bright");
}
