//! The timeline: play, scrubbing, loop, and the exposure times of the frame's rows.

use camsim_core::shutter::Shutter;
use camsim_io::load::Loaded;
use eframe::egui::{self, Color32, Rect, Sense, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::{
    number_field::{self, NumberField},
    tooltips::{TooltipPlacement, WithTooltip},
    widgets::{button, fixed, signed},
};
use crate::{
    message::{Message, Outbox},
    state::State,
    timeline::{SPEEDS, Timeline},
};

/// Height of the scrub bar, points.
const BAR_HEIGHT: f32 = 22.0;
/// Height of the diagram of row times, points.
const ROWS_HEIGHT: f32 = 34.0;

/// Draws the pane.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    TooltipPlacement::Above(ui.max_rect().y_range()).set(ui.ctx());
    ui.add_space(2.0);
    ui.add_enabled_ui(state.timeline.frames > 0, |ui| {
        ui.horizontal_wrapped(|ui| controls(ui, state, out));
        scrub_bar(ui, state, out);
        row_times(ui, state);
    });
    ui.add_space(2.0);
}

fn controls(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let timeline = &state.timeline;
    let mut button = |ui: &mut Ui, text: &str, name: &str, message: Message| {
        if button(ui, text, name, name) {
            out.push(message);
        }
    };
    button(ui, "|<", "first frame", Message::Seek(timeline.bounds()[0]));
    button(ui, "<", "previous frame", Message::Step(-1));
    button(
        ui,
        if timeline.playing { "stop" } else { "play" },
        if timeline.playing { "stop" } else { "play" },
        Message::TogglePlay,
    );
    button(ui, ">", "next frame", Message::Step(1));
    button(ui, ">|", "last frame", Message::Seek(timeline.bounds()[1]));
    let mut changed = timeline.clone();
    let field = NumberField {
        name: "speed",
        label: "",
        unit: "x",
        range: SPEEDS,
        speed: 0.01,
        decimals: 2,
        whole: false,
        tip: "speed of play, times real time",
    };
    changed.speed = number_field::slider(ui, &field, timeline.speed, out);
    loop_controls(ui, timeline, &mut changed);
    if changed != *timeline {
        out.push(Message::Timeline(changed));
    }
    ui.separator();
    let last_s = timeline.seconds(timeline.last());
    let field = NumberField {
        name: "time",
        label: "",
        unit: "s",
        range: [0.0, last_s],
        speed: 0.5 / timeline.fps,
        decimals: 4,
        whole: false,
        tip: "time from the window's begin; click to type",
    };
    if let Some((seconds, _)) = number_field::drag_value(ui, &field, timeline.seconds(timeline.frame), out) {
        out.push(Message::Seek(timeline.frame_at(seconds)));
    }
    ui.label(format!("of {last_s:.2} s"));
    let flight = state
        .engine
        .stamp_s(timeline.frame)
        .map_or_else(String::new, |t_s| format!(", flight time {} s", fixed(t_s, 3)));
    ui.label(format!("frame {} of {}{flight}", timeline.frame, timeline.frames))
        .with_tooltip("frames count from 0; flight time is the frame's stamp, from the log's first good row");
}

fn loop_controls(ui: &mut Ui, timeline: &Timeline, changed: &mut Timeline) {
    let [first, last] = timeline.bounds();
    let frame = timeline.frame;
    if ui.button("loop from").with_tooltip("begin the loop at this frame").clicked()
        && frame < timeline.last()
    {
        changed.range = Some([frame, if last > frame { last } else { timeline.last() }]);
    }
    if ui.button("loop to").with_tooltip("end the loop at this frame").clicked() && frame > 0 {
        changed.range = Some([if first < frame { first } else { 0 }, frame]);
    }
    if let Some([first, last]) = timeline.range
        && ui.button(format!("loop {first}-{last} off")).clicked()
    {
        changed.range = None;
    }
}

/// The scrub bar, with marks at gaps and repaired rows of the log.
fn scrub_bar(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let timeline = &state.timeline;
    let (rect, response) =
        ui.allocate_exact_size(vec2(ui.available_width(), BAR_HEIGHT), Sense::click_and_drag());
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
    let mut marked_until = f32::NEG_INFINITY;
    for [from, to] in gaps(state) {
        let left = x_of(from.max(0.0));
        let right = x_of(to.min(last)).max(left + 1.0);
        // At most one mark per point.
        if right >= marked_until + 1.0 {
            let span = Rect::from_x_y_ranges(left..=right, inner.y_range());
            painter.rect_filled(span, 0.0, ui.visuals().warn_fg_color.gamma_multiply(0.6));
            marked_until = right;
        }
    }
    let mut marked_until = f32::NEG_INFINITY;
    for x in repaired(state).map(x_of) {
        // At most one line per point.
        if x >= marked_until + 1.0 {
            painter.vline(x, inner.y_range(), Stroke::new(1.0, ui.visuals().error_fg_color));
            marked_until = x;
        }
    }
    let x = x_of(timeline.frame as f64);
    painter.vline(x, rect.y_range(), Stroke::new(2.0, ui.visuals().strong_text_color()));
    let dragged = response.is_pointer_button_down_on();
    if let Some(pointer) = response.interact_pointer_pos().filter(|_| dragged || response.clicked()) {
        let fraction = f64::from((pointer.x - inner.left()) / inner.width().max(1.0)).clamp(0.0, 1.0);
        if dragged != timeline.dragged {
            out.push(Message::Timeline(Timeline { dragged, ..timeline.clone() }));
        }
        out.push(Message::Seek((fraction * timeline.last() as f64).round() as u64));
    } else if timeline.dragged {
        out.push(Message::Timeline(Timeline { dragged: false, ..timeline.clone() }));
    }
    response.with_tooltip_ui(|ui| log_report(ui, state));
}

/// Path times of the log on the timeline, in frames.
fn in_frames(loaded: &Loaded) -> impl Fn(f64) -> f64 {
    let sequence = &loaded.sequence;
    let (start_s, fps) = (sequence.start_s, sequence.scenario.camera.fps);
    move |t_s| (t_s - start_s) * fps
}

/// Gaps of the log on the timeline, in frames, in order.
fn gaps(state: &State) -> impl Iterator<Item = [f64; 2]> + '_ {
    let last = state.timeline.last() as f64;
    let spans = state.engine.loaded.iter().flat_map(|loaded| {
        let frame = in_frames(loaded);
        state.engine.gaps_s.iter().map(move |span| span.map(&frame))
    });
    spans.filter(move |[from, to]| *to >= 0.0 && *from <= last)
}

/// Frames of repaired rows of the log, in order.
fn repaired(state: &State) -> impl Iterator<Item = f64> + '_ {
    let last = state.timeline.last() as f64;
    let frames = state.engine.loaded.iter().flat_map(|loaded| {
        let frame = in_frames(loaded);
        loaded.log.report.repaired_s.iter().map(move |t_s| frame(*t_s))
    });
    frames.filter(move |frame| (0.0..=last).contains(frame))
}

/// Tooltip of the scrub bar: report and warnings of the log.
fn log_report(ui: &mut Ui, state: &State) {
    ui.label("drag to scrub; arrow keys step");
    if let Some(loaded) = &state.engine.loaded {
        let report = loaded.log.report.to_string();
        // Repairs are also among the warnings.
        if !loaded.warnings.iter().any(|warning| warning.contains(&report)) {
            ui.label(report);
        }
        for warning in &loaded.warnings {
            ui.label(egui::RichText::new(warning).color(ui.visuals().warn_fg_color));
        }
    }
}

/// Diagram of exposures about the frame's stamp: rows downwards, time to the right.
fn row_times(ui: &mut Ui, state: &State) {
    let Some(document) = &state.document else { return };
    let camera = &document.scenario.camera;
    let Ok(shutter) = Shutter::from_spec(&camera.shutter, camera.fps, camera.size_px) else { return };
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), ROWS_HEIGHT), Sense::hover());
    let painter = ui.painter_at(rect);
    let (first_s, last_s) = shutter.window_s();
    let period_s = 1.0 / camera.fps;
    // Two frame periods, or the frame's window if it is longer.
    let (left_s, right_s) =
        (first_s.min(-period_s) - 0.05 * period_s, last_s.max(period_s) + 0.05 * period_s);
    let x_of = |t_s: f64| rect.left() + rect.width() * ((t_s - left_s) / (right_s - left_s)) as f32;
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    for period in -3..=3 {
        painter.vline(
            x_of(f64::from(period) * period_s),
            rect.y_range(),
            Stroke::new(1.0, ui.visuals().weak_text_color()),
        );
    }
    let steps = 64.min(shutter.lines());
    let exposed = ui.visuals().selection.bg_fill;
    for step in 0..steps {
        let line = (u64::from(step) * u64::from(shutter.lines() - 1) / u64::from(steps.max(2) - 1)) as u32;
        let y = rect.top() + rect.height() * (line as f32 + 0.5) / shutter.lines() as f32;
        let (mid_s, half_s) = (shutter.dt_row_s(line), 0.5 * shutter.exposure_row_s(line));
        let ends =
            [pos2(x_of(mid_s - half_s), y), pos2((x_of(mid_s + half_s)).max(x_of(mid_s - half_s) + 2.0), y)];
        painter.line_segment(ends, Stroke::new((rect.height() / steps as f32).max(1.0), exposed));
    }
    painter.vline(x_of(0.0), rect.y_range(), Stroke::new(1.5, Color32::from_rgb(220, 70, 60)));
    let text = format!("{} to {} ms", signed(1e3 * first_s, 1), signed(1e3 * last_s, 1));
    // Left of the next frame's stamp.
    let position = pos2(x_of(period_s).min(rect.right()) - 4.0, rect.top() + 2.0);
    painter.text(
        position,
        egui::Align2::RIGHT_TOP,
        text,
        egui::FontId::proportional(11.0),
        ui.visuals().text_color(),
    );
    response.with_tooltip(
        "exposure of each row about the frame's stamp (red); grey lines are stamps of other frames; \
         time to the right",
    );
}
