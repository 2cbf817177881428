//! What is shown, and how.

use eframe::egui::{self, Rangef, Role, Ui};

use super::canvas::{self, Placement};
use crate::{
    engine::Stage,
    message::{Message, Outbox},
    panes::{
        numbers::{self, Field},
        tips::{Aside, Explained},
        widgets::{choice, named},
    },
    state::State,
    view::{Compare, View},
};

/// Enlargement of differences.
const GAIN: [f64; 2] = [1.0, 64.0];

/// Lines above the picture.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let mut view = state.view.clone();
    // As high as it was in the last pass: explanations go below all of it.
    let top = ui.cursor().top();
    let height: f32 = ui.data(|data| data.get_temp(height())).unwrap_or_default();
    Aside::Below(Rangef::new(top, top + height)).set(ui.ctx());
    ui.horizontal_wrapped(|ui| {
        for compare in Compare::ALL {
            choice(
                ui,
                view.compare == compare,
                compare.label(),
                compare.label(),
                "how A and B are held against each other",
            )
            .clicked()
            .then(|| view.compare = compare);
        }
        if view.compare == Compare::Difference {
            let field = Field {
                name: "gain",
                label: "x",
                unit: "",
                range: GAIN,
                speed: 0.1,
                decimals: 1,
                whole: false,
                tip: "of the difference",
            };
            view.gain = numbers::slider(ui, &field, f64::from(view.gain), out) as f32;
        }
        ui.separator();
        zoom(ui, &mut view);
    });
    // One below the other, each stage of B below that of A. Overlays have a line of their own, so that the
    // picture stays where it is.
    ui.horizontal_wrapped(|ui| stages(ui, "A", &mut view.a));
    if view.compare != Compare::Single {
        ui.horizontal_wrapped(|ui| stages(ui, "B", &mut view.b));
    }
    let bottom = ui.horizontal_wrapped(|ui| overlays(ui, &mut view)).response.rect.bottom();
    ui.data_mut(|data| data.insert_temp(self::height(), bottom - top));
    if view != state.view {
        out.push(Message::View(view));
    }
}

/// Under which the height of the last pass is found.
fn height() -> egui::Id {
    egui::Id::unique("height of the lines above the picture")
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

/// How large the picture is in this pass, for the line above it in the next one: a fitted picture is as large
/// as its pane has it.
pub fn remember(ui: &Ui, placement: Option<&Placement>) {
    if let Some(placement) = placement {
        ui.data_mut(|data| data.insert_temp(shown_zoom(), placement.zoom()));
    }
}

fn zoom(ui: &mut Ui, view: &mut View) {
    let shown: Option<f32> = ui.data(|data| data.get_temp(shown_zoom()));
    let current = view.zoom.or(shown).unwrap_or(1.0);
    if ui.selectable_label(view.zoom.is_none(), "fit").explained("the whole picture (F)").clicked() {
        view.zoom = None;
    }
    if ui
        .selectable_label(view.zoom == Some(1.0), "1:1")
        .explained("a pixel of the screen for each pixel of the picture, whatever the screen's scale (1)")
        .clicked()
    {
        *view = canvas::zoomed_in_place(view, 1.0, 1.0);
    }
    for (text, name, factor) in [("-", "zoom out", 0.5), ("+", "zoom in", 2.0)] {
        let button = ui.small_button(text).explained(name);
        named(&button, Role::Button, name);
        if button.clicked() {
            *view = canvas::zoomed_in_place(view, current, factor);
        }
    }
    if view.zoom.is_some() || shown.is_some() {
        ui.weak(format!("{:.0} %", 100.0 * view.zoom.unwrap_or(current)))
            .explained("100 %: a pixel of the screen for each pixel of the picture");
    }
}

fn overlays(ui: &mut Ui, view: &mut View) {
    let over = &mut view.overlays;
    ui.weak("over it").explained("what is drawn over the pictures");
    ui.toggle_value(&mut over.invalid, "invalid")
        .explained("pixels without a ray, or outside of every ideal frame, in the paper's red (I)");
    ui.toggle_value(&mut over.grid, "grid")
        .explained("lines of equal ideal ray: what the lens does to a square grid (G)");
    ui.toggle_value(&mut over.motion, "motion").explained(
        "8 times as large: from where each place would be at the stamp to where it is at its row's time (eq. 16, blue), and its way over the exposure (orange) (M)",
    );
    ui.toggle_value(&mut over.rows, "row times").explained("mid-exposure of each row after the stamp");
    ui.toggle_value(&mut over.error, "predicted error")
        .explained("colours of the error of source coordinates that is predicted where the plan tried its methods: bright is large");
    ui.toggle_value(&mut over.depth, "depth").explained("planar depth in place of colour: near is bright");
}
