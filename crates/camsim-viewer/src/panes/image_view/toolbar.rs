//! Controls above the picture: comparison, zoom, stages, overlays.

use eframe::egui::{self, Rangef, Role, Ui};

use super::viewport::{self, ImageViewport};
use crate::{
    engine::Stage,
    message::{Message, Outbox},
    panes::{
        number_field::{self, NumberField},
        tooltips::{TooltipPlacement, WithTooltip},
        widgets::{choice, named, small_button},
    },
    state::State,
    view::{Compare, View},
};

/// Range of the gain of differences.
const GAIN: [f64; 2] = [1.0, 64.0];

/// Draws the lines above the picture.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let mut view = state.view.clone();
    // The height of the last pass: tooltips go below all lines.
    let top = ui.cursor().top();
    let height: f32 = ui.data(|data| data.get_temp(height())).unwrap_or_default();
    TooltipPlacement::Below(Rangef::new(top, top + height)).set(ui.ctx());
    ui.horizontal_wrapped(|ui| {
        camera(ui, state, out);
        for compare in Compare::ALL {
            choice(ui, view.compare == compare, compare.label(), compare.label(), "how A and B are compared")
                .clicked()
                .then(|| view.compare = compare);
        }
        if view.compare == Compare::Difference {
            let field = NumberField {
                name: "gain",
                label: "x",
                unit: "",
                range: GAIN,
                speed: 0.1,
                decimals: 1,
                whole: false,
                tip: "gain of the difference",
            };
            view.gain = number_field::slider(ui, &field, f64::from(view.gain), out) as f32;
        }
        ui.separator();
        zoom(ui, &mut view);
    });
    // Stages of B are below those of A. Overlays have their own line, so that the picture does not move.
    ui.horizontal_wrapped(|ui| stages(ui, "A", &mut view.a));
    if view.compare != Compare::Single {
        ui.horizontal_wrapped(|ui| stages(ui, "B", &mut view.b));
    }
    let has_sensor =
        state.document.as_ref().is_some_and(|document| document.scenario.camera.sensor.is_some());
    let bottom = ui.horizontal_wrapped(|ui| overlays(ui, &mut view, has_sensor)).response.rect.bottom();
    ui.data_mut(|data| data.insert_temp(self::height(), bottom - top));
    if view != state.view {
        out.push(Message::View(view));
    }
}

/// The choice of a camera, if there are several.
fn camera(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(document) = state.document.as_ref().filter(|document| document.rig().is_list()) else { return };
    let shown = document.camera();
    let mut chosen = shown;
    let name = document.scenario.camera.name.as_str();
    let combo = egui::ComboBox::from_id_salt("shown camera").selected_text(name).show_ui(ui, |ui| {
        for (index, name) in document.rig().names().enumerate() {
            ui.selectable_value(&mut chosen, index, name);
        }
    });
    named(&combo.response, Role::ComboBox, "shown camera");
    combo.response.with_tooltip("camera that is shown and edited");
    ui.separator();
    if chosen != shown {
        out.push(Message::ShowCamera(chosen));
    }
}

/// egui's data has the height of the last pass under this id.
fn height() -> egui::Id {
    egui::Id::unique("height of the lines above the picture")
}

/// One choice of stage.
fn stages(ui: &mut Ui, name: &str, chosen: &mut Stage) {
    ui.strong(name);
    for stage in Stage::ALL {
        let full = format!("{name}: {}", stage.label());
        if choice(ui, *chosen == stage, stage.label(), &full, stage.tooltip()).clicked() {
            *chosen = stage;
        }
    }
}

/// egui's data has the zoom of the last pass under this id.
fn shown_zoom() -> egui::Id {
    egui::Id::unique("zoom of the picture as it was shown")
}

/// Stores the zoom of this pass for the toolbar of the next one: that of a fitted picture depends on its
/// pane.
pub fn store_zoom(ui: &Ui, viewport: Option<&ImageViewport>) {
    if let Some(viewport) = viewport {
        ui.data_mut(|data| data.insert_temp(shown_zoom(), viewport.zoom()));
    }
}

fn zoom(ui: &mut Ui, view: &mut View) {
    let shown: Option<f32> = ui.data(|data| data.get_temp(shown_zoom()));
    let current = view.zoom.or(shown).unwrap_or(1.0);
    if ui.selectable_label(view.zoom.is_none(), "fit").with_tooltip("the whole picture (F)").clicked() {
        view.zoom = None;
    }
    if ui
        .selectable_label(view.zoom == Some(1.0), "1:1")
        .with_tooltip("one screen pixel per camera pixel, whatever the screen's scale (1)")
        .clicked()
    {
        *view = viewport::zoomed_about_middle(view, 1.0, 1.0);
    }
    for (text, name, factor) in [("-", "zoom out", 0.5), ("+", "zoom in", 2.0)] {
        if small_button(ui, text, name, name) {
            *view = viewport::zoomed_about_middle(view, current, factor);
        }
    }
    if view.zoom.is_some() || shown.is_some() {
        // Not broken between number and sign.
        let percent = egui::RichText::new(format!("{:.0} %", 100.0 * view.zoom.unwrap_or(current))).weak();
        ui.add(egui::Label::new(percent).extend()).with_tooltip("100 %: one screen pixel per camera pixel");
    }
}

fn overlays(ui: &mut Ui, view: &mut View, has_sensor: bool) {
    let over = &mut view.overlays;
    ui.weak("over it").with_tooltip("overlays of the pictures");
    ui.toggle_value(&mut over.invalid, "invalid")
        .with_tooltip("pixels without a ray, or outside every ideal frame, in red as in the paper (I)");
    ui.toggle_value(&mut over.grid, "grid")
        .with_tooltip("distortion grid: lines of equal u or v of the ideal ray (G)");
    ui.toggle_value(&mut over.motion, "motion").with_tooltip(
        "magnified 8 times: displacement from the stamp to the row's time (eq. 16, blue), and path over the \
         exposure (orange) (M)",
    );
    ui.toggle_value(&mut over.rows, "row times").with_tooltip("mid-exposure of each row, after the stamp");
    ui.toggle_value(&mut over.error, "predicted error").with_tooltip(
        "predicted source error at the planner's probes: bright is large, red is above the frame's bound",
    );
    ui.toggle_value(&mut over.depth, "depth").with_tooltip("planar depth instead of colour: near is bright");
    if has_sensor {
        ui.toggle_value(&mut over.raw, "raw")
            .with_tooltip("raw picture of the image sensor: each pixel in the colour of its filter");
    }
    ui.toggle_value(&mut over.histogram, "histogram")
        .with_tooltip("counts of sRGB codes, or of the raw picture's numbers where that is shown");
}
