//! Panes: they draw from the state and push messages. None of them uses the device or waits.

pub(crate) mod colors;
mod export;
mod image_view;
mod inspector;
mod map;
mod menu;
mod notices;
mod number_field;
pub(crate) mod parameters;
mod plan;
mod plots;
pub mod shortcuts;
mod timeline;
pub(crate) mod tooltips;
pub(crate) mod view3d;
mod widgets;

use eframe::egui;

use self::tooltips::TooltipPlacement;
use crate::{
    message::{Message, Outbox},
    state::State,
    view::Tab,
};

/// Least width of a window with the parameters, points.
const MIN_WIDTH_PARAMETERS: f32 = 640.0;
/// Least width of a window with parameters and pages, points.
const MIN_WIDTH_PAGES: f32 = 860.0;

/// Draws all panes.
pub fn show(ui: &mut egui::Ui, state: &State, out: &mut Outbox) {
    // Panels are transparent, because the window is cleared in their colour: painting it again would dominate
    // the time of a pass on a software adapter.
    let style = ui.global_style();
    let panel = egui::Frame::side_top_panel(&style).fill(egui::Color32::TRANSPARENT);
    egui::Panel::top("menu").frame(panel).show(ui, |ui| menu::show(ui, state, out));
    egui::Panel::bottom("timeline").frame(panel).show(ui, |ui| timeline::show(ui, state, out));
    // Side panels are hidden in narrow windows, where they would cover the picture.
    let width = ui.available_width();
    if width >= MIN_WIDTH_PARAMETERS {
        egui::Panel::left("parameters")
            .frame(panel)
            .resizable(true)
            .default_size(300.0)
            .size_range(180.0..=(0.4 * width).clamp(180.0, 600.0))
            .show(ui, |ui| widgets::within_panel(ui, |ui| parameters::show(ui, state, out)));
    }
    if width >= MIN_WIDTH_PAGES {
        egui::Panel::right("pages")
            .frame(panel)
            .resizable(true)
            .default_size(330.0)
            .size_range(220.0..=(0.4 * width).clamp(220.0, 700.0))
            .show(ui, |ui| widgets::within_panel(ui, |ui| pages(ui, state, out)));
    }
    egui::CentralPanel::default()
        .frame(egui::Frame::central_panel(&style).fill(egui::Color32::TRANSPARENT))
        .show(ui, |ui| {
            TooltipPlacement::Below(egui::Rangef::point(ui.max_rect().top())).set(ui.ctx());
            notices::show(ui, state, out);
            image_view::show(ui, state, out);
        });
    menu::windows(ui.ctx(), state, out);
    hovered_files(ui.ctx());
    shortcuts::window(ui.ctx(), state, out);
}

/// Names the files that are dragged over the window.
fn hovered_files(context: &egui::Context) {
    let names: Vec<String> = context.input(|input| {
        let name =
            |path: &std::path::PathBuf| path.file_name().map(|name| name.to_string_lossy().into_owned());
        input.raw.hovered_files.iter().filter_map(|file| file.path.as_ref().and_then(name)).collect()
    });
    if names.is_empty() {
        return;
    }
    let id = egui::Id::unique("files over the window");
    context.layer_painter(egui::LayerId::new(egui::Order::Foreground, id)).rect_filled(
        context.content_rect(),
        0.0,
        egui::Color32::from_black_alpha(150),
    );
    let text = format!("drop to open or use {}", names.join(", "));
    egui::Area::new(id)
        .order(egui::Order::Foreground)
        .anchor(egui::Align2::CENTER_CENTER, egui::Vec2::ZERO)
        .show(context, |ui| {
            ui.label(egui::RichText::new(text).size(20.0).color(egui::Color32::WHITE));
        });
}

/// The right panel: tabs, and the page of the chosen one.
fn pages(ui: &mut egui::Ui, state: &State, out: &mut Outbox) {
    TooltipPlacement::Left(ui.max_rect().x_range()).set(ui.ctx());
    ui.horizontal_wrapped(|ui| {
        for tab in Tab::ALL {
            if ui.selectable_label(state.view.tab == tab, tab.label()).clicked() {
                out.push(Message::Tab(tab));
            }
        }
    });
    ui.separator();
    egui::ScrollArea::vertical().id_salt(state.view.tab.label()).auto_shrink(false).show(
        ui,
        |ui| match state.view.tab {
            Tab::Pixel => inspector::show(ui, state, out),
            Tab::Plan => plan::show(ui, state),
            Tab::Plots => plots::show(ui, state, out),
            Tab::Map => map::show(ui, state, out),
            Tab::View3d => view3d::show(ui, state, out),
            Tab::Export => export::show(ui, state, out),
        },
    );
}

/// Colour scale from dark blue (0) to yellow (1).
fn ramp_color(fraction: f64) -> egui::Color32 {
    let [r, g, b] = crate::engine::ramp(fraction);
    egui::Color32::from_rgb(r, g, b)
}
