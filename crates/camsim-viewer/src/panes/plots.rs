//! The flight over time: log against tracker, speeds, blur and row skew. The cursor is the timeline's; a click jumps.

use std::sync::{Arc, Mutex, PoisonError};

use eframe::egui::{self, Color32, Ui};
use egui_plot::{Corner, HLine, Legend, Line, Plot, PlotPoints, VLine};

use super::widgets::choice;
use crate::{
    message::{Message, Outbox},
    series::{Channel, Desk},
    state::State,
};

/// The page.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(loaded) = &state.heard.loaded else {
        ui.label("no flight yet");
        return;
    };
    let id = egui::Id::unique("plot series");
    let desk = ui.data_mut(|data| data.get_temp_mut_or_default::<Arc<Mutex<Desk>>>(id).clone());
    let series = desk.lock().unwrap_or_else(PoisonError::into_inner).series(loaded, ui.ctx());
    let Some(series) = series else {
        ui.spinner();
        ui.label("working out errors, speeds and blur along the flight");
        return;
    };
    let mut view = state.view.clone();
    ui.horizontal(|ui| {
        for (errors, text, tip) in
            [(false, "values", "the log and the tracker"), (true, "errors", "the tracker less the log, where there is a log")]
        {
            if choice(ui, view.plot_errors == errors, text, &format!("plot {text}"), tip).clicked() {
                view.plot_errors = errors;
            }
        }
    });
    if view != state.view {
        out.push(Message::View(view));
    }
    let cursor_s = series.start_s + state.timeline.seconds(state.timeline.frame);
    for channel in &series.channels {
        plot(ui, state, channel, cursor_s, series.start_s, out);
    }
}

fn plot(ui: &mut Ui, state: &State, channel: &Channel, cursor_s: f64, start_s: f64, out: &mut Outbox) {
    ui.horizontal(|ui| {
        ui.strong(channel.name);
        ui.weak(&channel.note);
    });
    let plot = Plot::new(channel.name)
        .height(110.0)
        .show_x(true)
        .allow_scroll(false)
        .link_axis(egui::Id::unique("flight time"), [true, false])
        .link_cursor(egui::Id::unique("flight time"), [true, false]);
    let errors = channel.error.as_ref().filter(|_| state.view.plot_errors);
    let plot = if channel.lines.len() > 1 && errors.is_none() {
        plot.legend(Legend::default().position(Corner::LeftTop).background_alpha(0.5))
    } else {
        plot
    };
    let colors = [Color32::from_rgb(150, 150, 150), Color32::from_rgb(90, 180, 250), Color32::from_rgb(250, 150, 60)];
    let cursor = ui.visuals().strong_text_color();
    let shown = plot.show(ui, |ui| {
        match errors {
            Some(errors) => ui.line(Line::new("error", PlotPoints::new(errors.clone())).color(colors[2])),
            None => {
                for ((name, points), color) in channel.lines.iter().zip(colors) {
                    ui.line(Line::new(*name, PlotPoints::new(points.clone())).color(color));
                }
            }
        }
        if let Some(limit) = channel.limit {
            ui.hline(HLine::new("", limit).color(Color32::from_rgb(220, 70, 60)));
        }
        ui.vline(VLine::new("", cursor_s).color(cursor));
        ui.pointer_coordinate()
    });
    if shown.response.clicked()
        && let Some(at) = shown.inner
    {
        out.push(Message::Seek(state.timeline.frame_at(at.x - start_s)));
    }
}
