//! The timeline: play, scrub, loop, and when the rows of the frame are exposed.

use std::sync::Arc;

use camsim_core::shutter::Shutter;
use camsim_io::load::Loaded;
use eframe::egui::{self, Color32, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::widgets::{fixed, named, signed};
use crate::{
    message::{Message, Outbox},
    state::State,
    timeline::{SPEEDS, Timeline},
};

/// Height of the bar, points.
const BAR: f32 = 22.0;
/// Height of the drawing of the rows' times.
const ROWS: f32 = 34.0;
/// Steps between two rows of the log that are marked, seconds of the log.
const GAP_S: f64 = 1.0;
/// Gaps that are marked, at most: more would cover the bar.
const MOST_GAPS: usize = 200;

/// The pane.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    ui.add_space(2.0);
    ui.add_enabled_ui(state.timeline.frames > 0, |ui| {
        ui.horizontal_wrapped(|ui| controls(ui, state, out));
        bar(ui, state, out);
        row_times(ui, state);
    });
    ui.add_space(2.0);
}

fn controls(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let timeline = &state.timeline;
    let mut button = |ui: &mut Ui, text: &str, name: &str, message: Message| {
        let response = ui.button(text).on_hover_text(name);
        named(&response, Role::Button, name);
        if response.clicked() {
            out.push(message);
        }
    };
    button(ui, "|<", "first frame", Message::Seek(timeline.bounds()[0]));
    button(ui, "<", "previous frame", Message::Step(-1));
    button(ui, if timeline.playing { "stop" } else { "play" }, if timeline.playing { "stop" } else { "play" }, Message::TogglePlay);
    button(ui, ">", "next frame", Message::Step(1));
    button(ui, ">|", "last frame", Message::Seek(timeline.bounds()[1]));
    let mut changed = timeline.clone();
    let speed = ui.add(egui::Slider::new(&mut changed.speed, SPEEDS[0]..=SPEEDS[1]).logarithmic(true).suffix("x").max_decimals(2));
    named(&speed, Role::Slider, "speed");
    loop_controls(ui, timeline, &mut changed);
    if changed != *timeline {
        out.push(Message::Timeline(changed));
    }
    ui.separator();
    let mut seconds = timeline.seconds(timeline.frame);
    let last_s = timeline.seconds(timeline.last());
    let time = ui.add(egui::DragValue::new(&mut seconds).range(0.0..=last_s).speed(0.5 / timeline.fps).suffix(" s").max_decimals(4));
    named(&time, Role::SpinButton, "time");
    if time.on_hover_text("from the beginning of the window; click to type a time").changed() {
        out.push(Message::Seek(timeline.frame_at(seconds)));
    }
    ui.label(format!("of {last_s:.2} s"));
    let flight = state.heard.stamp_s(timeline.frame).map_or_else(String::new, |t_s| format!(", flight time {} s", fixed(t_s, 3)));
    ui.label(format!("frame {} of {}{flight}", timeline.frame, timeline.frames))
        .on_hover_text("frames are counted from 0; flight time is that of the frame's stamp, from the log's first good row");
}

fn loop_controls(ui: &mut Ui, timeline: &Timeline, changed: &mut Timeline) {
    let [first, last] = timeline.bounds();
    let frame = timeline.frame;
    if ui.button("loop from").on_hover_text("the loop begins at this frame").clicked() && frame < timeline.last() {
        changed.range = Some([frame, if last > frame { last } else { timeline.last() }]);
    }
    if ui.button("loop to").on_hover_text("the loop ends at this frame").clicked() && frame > 0 {
        changed.range = Some([if first < frame { first } else { 0 }, frame]);
    }
    if let Some([first, last]) = timeline.range
        && ui.button(format!("loop {first}-{last} off")).clicked()
    {
        changed.range = None;
    }
}

fn bar(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let timeline = &state.timeline;
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), BAR), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::slider(ui.is_enabled(), timeline.frame as f64, "timeline"));
    let last = timeline.last().max(1) as f64;
    let inner = rect.shrink2(vec2(6.0, 4.0));
    let x_of = |frame: f64| inner.left() + inner.width() * (frame / last) as f32;
    let painter = ui.painter_at(rect);
    painter.rect_filled(inner, 3.0, ui.visuals().extreme_bg_color);
    if let Some([first, end]) = timeline.range {
        let span = Rect::from_x_y_ranges(x_of(first as f64)..=x_of(end as f64), inner.y_range());
        painter.rect_filled(span, 0.0, ui.visuals().selection.bg_fill.gamma_multiply(0.5));
    }
    gaps(state, |from, to| {
        let span = Rect::from_x_y_ranges(x_of(from).max(inner.left())..=x_of(to).min(inner.right()).max(x_of(from) + 1.0), inner.y_range());
        painter.rect_filled(span, 0.0, ui.visuals().warn_fg_color.gamma_multiply(0.6));
    });
    let mut marked = f32::NEG_INFINITY;
    for x in repaired(state).map(x_of) {
        // Of thousands side by side a line a point is enough.
        if x >= marked + 1.0 {
            painter.vline(x, inner.y_range(), Stroke::new(1.0, ui.visuals().error_fg_color));
            marked = x;
        }
    }
    let x = x_of(timeline.frame as f64);
    painter.vline(x, rect.y_range(), Stroke::new(2.0, ui.visuals().strong_text_color()));
    let dragged = response.is_pointer_button_down_on();
    if let Some(pointer) = response.interact_pointer_pos().filter(|_| dragged || response.clicked()) {
        let share = f64::from((pointer.x - inner.left()) / inner.width().max(1.0)).clamp(0.0, 1.0);
        if dragged != timeline.dragged {
            out.push(Message::Timeline(Timeline { dragged, ..timeline.clone() }));
        }
        out.push(Message::Seek((share * timeline.last() as f64).round() as u64));
    } else if timeline.dragged {
        out.push(Message::Timeline(Timeline { dragged: false, ..timeline.clone() }));
    }
    response.on_hover_ui(|ui| log_report(ui, state));
}

/// Spans without rows of the log, in frames.
fn gaps(state: &State, mut mark: impl FnMut(f64, f64)) {
    let Some(loaded) = &state.heard.loaded else { return };
    let (sequence, rows) = (&loaded.sequence, &loaded.log.rows);
    if loaded.log.report.gaps.count == 0 {
        return;
    }
    let speed = sequence.scenario.flight.speed;
    let frame_at = |t_s: f64| (t_s - sequence.start_s) * sequence.scenario.camera.fps;
    let [first_s, last_s] = [0, sequence.frames].map(|frame| sequence.start_s + frame as f64 / sequence.scenario.camera.fps);
    let from = rows.partition_point(|row| row.t_s < first_s).saturating_sub(1);
    let to = (rows.partition_point(|row| row.t_s <= last_s) + 1).min(rows.len());
    let pairs = rows.get(from..to).unwrap_or_default().windows(2);
    let wide = pairs.filter(|pair| (pair[1].t_s - pair[0].t_s) * speed > GAP_S);
    wide.take(MOST_GAPS).for_each(|pair| mark(frame_at(pair[0].t_s), frame_at(pair[1].t_s)));
}

/// Frames at rows of the log that were repaired, in order.
fn repaired(state: &State) -> impl Iterator<Item = f64> + '_ {
    let last = state.timeline.last() as f64;
    let of = |loaded: &'_ Arc<Loaded>| {
        let sequence = loaded.sequence.clone();
        move |t_s: &f64| (t_s - sequence.start_s) * sequence.scenario.camera.fps
    };
    let frames = state.heard.loaded.iter().flat_map(move |loaded| loaded.log.report.repaired_s.iter().map(of(loaded)));
    frames.filter(move |frame| (0.0..=last).contains(frame))
}

fn log_report(ui: &mut Ui, state: &State) {
    ui.label("drag to scrub; arrow keys step");
    if let Some(loaded) = &state.heard.loaded {
        ui.label(loaded.log.report.to_string());
        for warning in &loaded.warnings {
            ui.label(egui::RichText::new(warning).color(ui.visuals().warn_fg_color));
        }
    }
}

/// Rows downwards, time to the right: each row's exposure as it lies about the frame's stamp.
fn row_times(ui: &mut Ui, state: &State) {
    let Some(document) = &state.document else { return };
    let camera = &document.scenario.camera;
    let Ok(shutter) = Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px) else { return };
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROWS), Sense::hover());
    let painter = ui.painter_at(rect);
    let (first_s, last_s) = shutter.window_s();
    let period_s = 1.0 / camera.fps;
    // Two periods, or what the frame takes.
    let (left_s, right_s) = (first_s.min(-period_s) - 0.05 * period_s, last_s.max(period_s) + 0.05 * period_s);
    let x_of = |t_s: f64| rect.left() + rect.width() * ((t_s - left_s) / (right_s - left_s)) as f32;
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    for period in -3..=3 {
        painter.vline(x_of(f64::from(period) * period_s), rect.y_range(), Stroke::new(1.0, ui.visuals().weak_text_color()));
    }
    let steps = 64.min(shutter.lines());
    let half_s = 0.5 * shutter.exposure_s();
    let exposed = ui.visuals().selection.bg_fill;
    for step in 0..steps {
        let line = (u64::from(step) * u64::from(shutter.lines() - 1) / u64::from(steps.max(2) - 1)) as u32;
        let y = rect.top() + rect.height() * (line as f32 + 0.5) / shutter.lines() as f32;
        let mid_s = shutter.dt_line_s(line);
        let ends = [pos2(x_of(mid_s - half_s), y), pos2((x_of(mid_s + half_s)).max(x_of(mid_s - half_s) + 2.0), y)];
        painter.line_segment(ends, Stroke::new((rect.height() / steps as f32).max(1.0), exposed));
    }
    painter.vline(x_of(0.0), rect.y_range(), Stroke::new(1.5, Color32::from_rgb(220, 70, 60)));
    let text = format!("{} to {} ms", signed(1e3 * first_s, 1), signed(1e3 * last_s, 1));
    // Left of the next frame's line.
    let at = pos2(x_of(period_s).min(rect.right()) - 4.0, rect.top() + 2.0);
    painter.text(at, egui::Align2::RIGHT_TOP, text, egui::FontId::proportional(11.0), ui.visuals().text_color());
    response
        .on_hover_text("each row's exposure about the frame's stamp (red), with the periods of the frames beside it; time to the right");
}
