//! Plots over the flight: log and tracker, speeds, blur and row skew. A click jumps to that time.

use std::sync::{Arc, Mutex, PoisonError};

use camsim_io::load::Loaded;
use eframe::egui::{self, Color32, Rangef, Ui};
use egui_plot::{AxisHints, HLine, Line, Plot, PlotPoints, Points, VLine};

use super::{
    tooltips::WithTooltip,
    widgets::{choice, waiting},
};
use crate::{
    message::{Message, Outbox},
    series::{Channel, Series, SeriesWorker},
    state::State,
};

/// Width of the vertical axis, points: the same for all plots, so that times align.
const AXIS_WIDTH: f32 = 40.0;
/// Colours of log, tracker and errors.
const LINE_COLORS: [Color32; 3] =
    [Color32::from_rgb(150, 150, 150), Color32::from_rgb(90, 180, 250), Color32::from_rgb(250, 150, 60)];
/// Least visible time span, seconds: below it axis labels lose their digits.
const MIN_SPAN_S: f64 = 0.02;
/// Rows of the log marked by dots, at most: more would merge into a line.
const MAX_MARKS: usize = 120;

/// What the page stores from pass to pass.
#[derive(Debug, Default)]
struct PlotCache {
    worker: SeriesWorker,
    /// Visible path time; `None` before the first pass.
    visible_s: Option<[f64; 2]>,
    /// Span of the series that was shown.
    span_s: Option<[f64; 2]>,
}

/// Draws the page.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(loaded) = &state.engine.loaded else {
        ui.label("no flight yet");
        return;
    };
    let id = egui::Id::unique("plots");
    let cache = ui.data_mut(|data| data.get_temp_mut_or_default::<Arc<Mutex<PlotCache>>>(id).clone());
    let mut cache = cache.lock().unwrap_or_else(PoisonError::into_inner);
    let Some((series, is_new_span)) = cache.series(loaded, ui.ctx()) else {
        waiting(ui);
        ui.label("computing errors, speeds and blur along the flight");
        return;
    };
    let mut view = state.view.clone();
    // Wrapped: a line wider than the page would widen the panel.
    ui.horizontal_wrapped(|ui| {
        for (errors, text, tip) in
            [(false, "values", "log and tracker"), (true, "errors", "tracker less log")]
        {
            if choice(ui, view.plot_errors == errors, text, &format!("plot {text}"), tip).clicked() {
                view.plot_errors = errors;
            }
        }
        ui.separator();
        if !view.plot_errors {
            for (name, color) in [("log", LINE_COLORS[0]), ("tracker", LINE_COLORS[1])] {
                ui.colored_label(color, name).with_tooltip("colour of its line");
            }
        }
        ui.weak("Ctrl+wheel zooms").with_tooltip(
            "zooms in time, at the pointer; so does a box drawn with the right button. Drag pans, a double \
             click shows all. The visible part is refined, with dots at rows of the log if there are few. \
             Summaries beside the titles are of the whole flight",
        );
    });
    if view != state.view {
        out.push(Message::View(view));
    }
    let plots = PlotContext {
        series: &series,
        visible_s: cache.visible_s.filter(|_| !is_new_span).unwrap_or(series.span_s),
        cursor_s: series.span_s[0] + state.timeline.seconds(state.timeline.frame),
        errors: state.view.plot_errors,
        is_new_span,
    };
    for channel in &series.channels {
        let (clicked_s, visible_s) = plots.plot(ui, channel);
        cache.visible_s = Some(visible_s);
        if let Some(t_s) = clicked_s {
            out.push(Message::Seek(state.timeline.frame_at(t_s - series.span_s[0])));
        }
    }
}

impl PlotCache {
    /// The series to plot, and whether its span is new: plots then show all of it.
    fn series(&mut self, loaded: &Arc<Loaded>, context: &egui::Context) -> Option<(Arc<Series>, bool)> {
        let series = self.worker.series(loaded, self.visible_s, context)?;
        let is_new_span = self.span_s.replace(series.span_s) != Some(series.span_s);
        Some((series, is_new_span))
    }
}

/// What all plots of a pass share.
struct PlotContext<'a> {
    series: &'a Series,
    /// Visible span, path time.
    visible_s: [f64; 2],
    /// Path time of the shown frame.
    cursor_s: f64,
    /// Whether errors are plotted, for channels that have them.
    errors: bool,
    /// Whether the bounds of plots are reset.
    is_new_span: bool,
}

impl PlotContext<'_> {
    /// Draws a plot; returns the clicked path time, and the visible span.
    fn plot(&self, ui: &mut Ui, channel: &Channel) -> (Option<f64>, [f64; 2]) {
        ui.horizontal_wrapped(|ui| {
            ui.strong(channel.name);
            ui.weak(&channel.note);
        });
        let plot = Plot::new(channel.name)
            .height(110.0)
            .show_x(true)
            // Axis labels are closer than egui_plot's default, for small plots.
            .custom_x_axes(vec![AxisHints::new_x().label_spacing(Rangef::new(44.0, 56.0))])
            .custom_y_axes(vec![
                AxisHints::new_y().label_spacing(Rangef::new(14.0, 20.0)).min_thickness(AXIS_WIDTH),
            ])
            .allow_scroll(false)
            // The vertical axis fits the values.
            .allow_zoom([true, false])
            .allow_drag([true, false])
            .link_axis(egui::Id::unique("flight time"), [true, false])
            .link_cursor(egui::Id::unique("flight time"), [true, false]);
        let errors = channel.error.as_ref().filter(|_| self.errors);
        let cursor = ui.visuals().strong_text_color();
        let shown = plot.show(ui, |ui| {
            match errors {
                Some(errors) => {
                    ui.line(Line::new("error", PlotPoints::new(errors.clone())).color(LINE_COLORS[2]))
                }
                None => {
                    for ((name, points), color) in channel.lines.iter().zip(LINE_COLORS) {
                        ui.line(Line::new(*name, PlotPoints::new(points.clone())).color(color));
                    }
                    if channel.lines.len() > 1 {
                        ui.points(Points::new("log", self.marks(channel)).color(LINE_COLORS[0]).radius(2.5));
                    }
                }
            }
            if let Some(limit) = channel.limit {
                ui.hline(HLine::new("", limit).color(Color32::from_rgb(220, 70, 60)));
            }
            ui.vline(VLine::new("", self.cursor_s).color(cursor));
            if self.is_new_span {
                ui.set_auto_bounds(true);
            } else {
                ui.set_plot_bounds_y(self.range(channel));
                let [from_s, to_s] = self.visible_s;
                if to_s - from_s < MIN_SPAN_S {
                    let middle_s = 0.5 * (from_s + to_s);
                    ui.set_plot_bounds_x(middle_s - 0.5 * MIN_SPAN_S..=middle_s + 0.5 * MIN_SPAN_S);
                }
            }
            ui.pointer_coordinate()
        });
        let bounds = shown.transform.bounds();
        let clicked_s = shown.inner.filter(|_| shown.response.clicked()).map(|point| point.x);
        (clicked_s, [bounds.min()[0], bounds.max()[0]])
    }

    /// Dots at rows of the log, if there are at most [`MAX_MARKS`].
    fn marks(&self, channel: &Channel) -> PlotPoints<'static> {
        let rows = &self.series.rows_s;
        let [first, end] = [
            rows.partition_point(|t_s| *t_s < self.visible_s[0]),
            rows.partition_point(|t_s| *t_s <= self.visible_s[1]),
        ];
        let Some((_, log)) = channel.lines.first().filter(|_| end - first <= MAX_MARKS) else {
            return PlotPoints::new(Vec::new());
        };
        let on_line = |t_s: &f64| log.get(log.partition_point(|point| point[0] < *t_s)).copied();
        PlotPoints::new(rows[first..end].iter().filter_map(on_line).collect())
    }

    /// Range of the visible values, with a margin. It includes the limit if all is visible or values are near
    /// it.
    fn range(&self, channel: &Channel) -> std::ops::RangeInclusive<f64> {
        let [from_s, to_s] = self.visible_s;
        let errors = channel.error.as_ref().filter(|_| self.errors);
        let lines: Vec<&Vec<[f64; 2]>> = errors
            .map_or_else(|| channel.lines.iter().map(|(_, points)| points).collect(), |errors| vec![errors]);
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for points in lines {
            // With the point on either side, which lines lead to.
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
        // A constant is shown as a straight line, not as rounding noise.
        let margin = (0.05 * (high - low)).max(1e-6 * low.abs().max(high.abs())).max(1e-9);
        low - margin..=high + margin
    }
}
