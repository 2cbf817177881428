//! The flight over time: log against tracker, speeds, blur and row skew. The cursor is the timeline's; a
//! click jumps.

use std::sync::{Arc, Mutex, PoisonError};

use camsim_io::load::Loaded;
use eframe::egui::{self, Color32, Rangef, Ui};
use egui_plot::{AxisHints, HLine, Line, Plot, PlotPoints, Points, VLine};

use super::{
    tips::Explained,
    widgets::{choice, waiting},
};
use crate::{
    message::{Message, Outbox},
    series::{Channel, Desk, Series},
    state::State,
};

/// Points for numbers on the left, so that instants lie above each other.
const AXIS: f32 = 40.0;
/// Colours of the log, of the tracker and of errors.
const LINES: [Color32; 3] =
    [Color32::from_rgb(150, 150, 150), Color32::from_rgb(90, 180, 250), Color32::from_rgb(250, 150, 60)];
/// The shortest time that is shown, seconds: closer, nothing is left of the numbers.
const SHORTEST_S: f64 = 0.02;
/// Rows of the log that are marked, at most: more of them in a plot are a thick line.
const MOST_MARKS: usize = 120;

/// What the page keeps from pass to pass.
#[derive(Debug, Default)]
struct Kept {
    desk: Desk,
    /// Path time that plots show; `None` before the first pass.
    seen_s: Option<[f64; 2]>,
    /// The window that it is of.
    span_s: Option<[f64; 2]>,
}

/// The page.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(loaded) = &state.heard.loaded else {
        ui.label("no flight yet");
        return;
    };
    let id = egui::Id::unique("plots");
    let kept = ui.data_mut(|data| data.get_temp_mut_or_default::<Arc<Mutex<Kept>>>(id).clone());
    let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
    let Some((series, is_other)) = kept.series(loaded, ui.ctx()) else {
        waiting(ui);
        ui.label("working out errors, speeds and blur along the flight");
        return;
    };
    let mut view = state.view.clone();
    // Never wider than the page: it would make room by moving what is beside it.
    ui.horizontal_wrapped(|ui| {
        for (errors, text, tip) in
            [(false, "values", "the log and the tracker"), (true, "errors", "the tracker less the log, where there is a log")]
        {
            if choice(ui, view.plot_errors == errors, text, &format!("plot {text}"), tip).clicked() {
                view.plot_errors = errors;
            }
        }
        ui.separator();
        if !view.plot_errors {
            for (name, color) in [("log", LINES[0]), ("tracker", LINES[1])] {
                ui.colored_label(color, name).explained("the colour of its line");
            }
        }
        ui.weak("Ctrl+wheel zooms").explained(
            "in time, at the pointer; also a box with the right button. Dragging moves on, a double click shows all. What is seen is worked out anew, \
             and where there are few rows of the log each has a dot. Numbers beside the names are of the whole flight",
        );
    });
    if view != state.view {
        out.push(Message::View(view));
    }
    let sheet = Sheet {
        series: &series,
        seen_s: kept.seen_s.filter(|_| !is_other).unwrap_or(series.span_s),
        cursor_s: series.span_s[0] + state.timeline.seconds(state.timeline.frame),
        errors: state.view.plot_errors,
        is_other,
    };
    for channel in &series.channels {
        let (clicked_s, seen_s) = sheet.plot(ui, channel);
        kept.seen_s = Some(seen_s);
        if let Some(t_s) = clicked_s {
            out.push(Message::Seek(state.timeline.frame_at(t_s - series.span_s[0])));
        }
    }
}

impl Kept {
    /// What to plot, and whether it is of another window than before: its plots then show all of it.
    fn series(&mut self, loaded: &Arc<Loaded>, context: &egui::Context) -> Option<(Arc<Series>, bool)> {
        let series = self.desk.series(loaded, self.seen_s, context)?;
        let is_other = self.span_s.replace(series.span_s) != Some(series.span_s);
        Some((series, is_other))
    }
}

/// What all plots of a pass have in common.
struct Sheet<'a> {
    series: &'a Series,
    /// What is seen, path time.
    seen_s: [f64; 2],
    cursor_s: f64,
    /// Whether errors are plotted where there are some.
    errors: bool,
    /// Whether plots forget what they showed.
    is_other: bool,
}

impl Sheet<'_> {
    /// Draws one; when a click was, and what is seen.
    fn plot(&self, ui: &mut Ui, channel: &Channel) -> (Option<f64>, [f64; 2]) {
        ui.horizontal_wrapped(|ui| {
            ui.strong(channel.name);
            ui.weak(&channel.note);
        });
        let plot = Plot::new(channel.name)
            .height(110.0)
            .show_x(true)
            // Numbers stand closer than in plots that have a window of their own, and are not faint where
            // there is room for them.
            .custom_x_axes(vec![AxisHints::new_x().label_spacing(Rangef::new(44.0, 56.0))])
            .custom_y_axes(vec![
                AxisHints::new_y().label_spacing(Rangef::new(14.0, 20.0)).min_thickness(AXIS),
            ])
            .allow_scroll(false)
            // Up and down each shows what there is.
            .allow_zoom([true, false])
            .allow_drag([true, false])
            .link_axis(egui::Id::unique("flight time"), [true, false])
            .link_cursor(egui::Id::unique("flight time"), [true, false]);
        let errors = channel.error.as_ref().filter(|_| self.errors);
        let cursor = ui.visuals().strong_text_color();
        let shown = plot.show(ui, |ui| {
            match errors {
                Some(errors) => ui.line(Line::new("error", PlotPoints::new(errors.clone())).color(LINES[2])),
                None => {
                    for ((name, points), color) in channel.lines.iter().zip(LINES) {
                        ui.line(Line::new(*name, PlotPoints::new(points.clone())).color(color));
                    }
                    if channel.lines.len() > 1 {
                        ui.points(Points::new("log", self.marks(channel)).color(LINES[0]).radius(2.5));
                    }
                }
            }
            if let Some(limit) = channel.limit {
                ui.hline(HLine::new("", limit).color(Color32::from_rgb(220, 70, 60)));
            }
            ui.vline(VLine::new("", self.cursor_s).color(cursor));
            if self.is_other {
                ui.set_auto_bounds(true);
            } else {
                ui.set_plot_bounds_y(self.range(channel));
                let [from_s, to_s] = self.seen_s;
                if to_s - from_s < SHORTEST_S {
                    let middle_s = 0.5 * (from_s + to_s);
                    ui.set_plot_bounds_x(middle_s - 0.5 * SHORTEST_S..=middle_s + 0.5 * SHORTEST_S);
                }
            }
            ui.pointer_coordinate()
        });
        let bounds = shown.transform.bounds();
        let clicked_s = shown.inner.filter(|_| shown.response.clicked()).map(|at| at.x);
        (clicked_s, [bounds.min()[0], bounds.max()[0]])
    }

    /// Dots for rows of the log, if there are few.
    fn marks(&self, channel: &Channel) -> PlotPoints<'static> {
        let rows = &self.series.rows_s;
        let [first, end] = [
            rows.partition_point(|t_s| *t_s < self.seen_s[0]),
            rows.partition_point(|t_s| *t_s <= self.seen_s[1]),
        ];
        let Some((_, log)) = channel.lines.first().filter(|_| end - first <= MOST_MARKS) else {
            return PlotPoints::new(Vec::new());
        };
        let on_line = |t_s: &f64| log.get(log.partition_point(|point| point[0] < *t_s)).copied();
        PlotPoints::new(rows[first..end].iter().filter_map(on_line).collect())
    }

    /// From the least to the largest value that is seen, with a margin; the limit counts where all is seen,
    /// or values come near it.
    fn range(&self, channel: &Channel) -> std::ops::RangeInclusive<f64> {
        let [from_s, to_s] = self.seen_s;
        let errors = channel.error.as_ref().filter(|_| self.errors);
        let lines: Vec<&Vec<[f64; 2]>> = errors
            .map_or_else(|| channel.lines.iter().map(|(_, points)| points).collect(), |errors| vec![errors]);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for points in lines {
            // With the points on either side, to which lines go.
            let first = points.partition_point(|point| point[0] < from_s).saturating_sub(1);
            let end = (points.partition_point(|point| point[0] <= to_s) + 1).min(points.len());
            for [_, value] in points.get(first..end).unwrap_or_default() {
                (low, high) = (low.min(*value), high.max(*value));
            }
        }
        let is_all = to_s - from_s >= self.series.span_s[1] - self.series.span_s[0];
        if let Some(limit) = channel.limit.filter(|limit| is_all || high > 0.7 * limit) {
            (low, high) = (low.min(limit), high.max(limit));
        }
        if !(low.is_finite() && high.is_finite()) {
            return -1.0..=1.0;
        }
        // What is the same everywhere is a line in the middle, not noise of the last digit.
        let margin = (0.05 * (high - low)).max(1e-6 * low.abs().max(high.abs())).max(1e-9);
        low - margin..=high + margin
    }
}
