//! The picture pane: stages, comparison, overlays, zoom and pan.

mod overlays;
mod toolbar;
mod viewport;

use eframe::egui::{
    self, Align2, Color32, CursorIcon, FontId, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2,
};

use self::viewport::ImageViewport;
use super::widgets::waiting;
use crate::{
    display_image::ImageSlot,
    engine::{Size, Stage},
    engine_state::StagePicture,
    message::{Message, Outbox},
    state::State,
    view::Compare,
};

/// Draws the pane.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    toolbar::show(ui, state, out);
    let pane = ui.available_rect_before_wrap();
    let response = ui.allocate_rect(pane, Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "picture"));
    if pane.width() < 8.0 || pane.height() < 8.0 {
        return;
    }
    if state.document.is_none() {
        ui.put(pane, egui::Label::new("open a scenario, or drop one here"));
        return;
    }
    // The camera of the shown frame: the scenario's present one may have no picture yet.
    let Some(size_px) = state.engine.shown.as_ref().map(|shown| shown.reply.request.scenario.camera.size_px)
    else {
        if state.engine.fault.is_none() {
            ui.put(pane, waiting);
        }
        return;
    };
    let panes = match state.view.compare {
        Compare::SideBySide => {
            let (left, right) = pane.split_left_right_at_fraction(0.5);
            vec![left.with_max_x(left.right() - 1.0), right.with_min_x(right.left() + 1.0)]
        }
        _ => vec![pane],
    };
    let viewports: Vec<ImageViewport> = panes
        .iter()
        .map(|pane| ImageViewport::new(*pane, size_px, &state.view, ui.pixels_per_point()))
        .collect();
    toolbar::store_zoom(ui, viewports.first());
    draw(ui, state, &viewports);
    pending(ui, state, pane);
    for viewport in &viewports {
        pinned_ring(ui, state, viewport);
    }
    let on_wipe = state.view.compare == Compare::Wipe
        && viewports.first().is_some_and(|viewport| wipe_line(ui, state, viewport, out));
    viewport::interact(ui, &response, &viewports, state, on_wipe, out);
}

/// Draws the pictures as the view compares them.
fn draw(ui: &Ui, state: &State, viewports: &[ImageViewport]) {
    let view = &state.view;
    let Some(first) = viewports.first() else { return };
    match view.compare {
        Compare::Single => draw_stage(ui, state, first, view.a, first.pane, ImageSlot::A),
        Compare::SideBySide => {
            draw_stage(ui, state, first, view.a, first.pane, ImageSlot::A);
            if let Some(second) = viewports.get(1) {
                draw_stage(ui, state, second, view.b, second.pane, ImageSlot::B);
            }
        }
        Compare::Wipe => {
            let (left, right) = first.pane.split_left_right_at_x(wipe_x(state, first));
            draw_stage(ui, state, first, view.a, left, ImageSlot::A);
            draw_stage(ui, state, first, view.b, right, ImageSlot::B);
        }
        Compare::Difference => difference(ui, state, first),
    }
}

/// Draws the picture of a stage with its overlays, within `clip`.
fn draw_stage(ui: &Ui, state: &State, viewport: &ImageViewport, stage: Stage, clip: Rect, slot: ImageSlot) {
    let painter = ui.painter().with_clip_rect(clip.intersect(viewport.pane));
    let Some(picture) = state.engine.stage_picture(stage) else {
        painter.text(
            clip.center(),
            Align2::CENTER_CENTER,
            format!("{}: rendering", stage.label()),
            FontId::proportional(14.0),
            ui.visuals().text_color(),
        );
        return;
    };
    if state.view.overlays.invalid {
        painter.rect_filled(viewport.picture_rect(picture.size_px), 0.0, Color32::from_rgb(255, 0, 0));
    }
    let depth = picture.depth.filter(|_| state.view.overlays.depth).map(|(_, image)| image);
    let raw = picture.raw.filter(|_| state.view.overlays.raw);
    let errors = picture.errors.filter(|_| state.view.overlays.error).map(|(_, image)| image);
    viewport.image(&painter, slot, depth.or(raw).or(errors).unwrap_or(picture.image), picture.size_px);
    overlays::draw(
        &painter.with_clip_rect(painter.clip_rect().intersect(viewport.rect())),
        viewport,
        state,
        &picture,
    );
    let corner = clip.intersect(viewport.pane).left_top() + egui::vec2(6.0, 4.0);
    let instead = match (depth, raw) {
        (Some(_), _) => ", depth",
        (None, Some(_)) => ", raw",
        (None, None) => "",
    };
    let text = format!("{slot:?}: {}, {}{instead}{}", stage.label(), frame(state), progress(state, &picture));
    label(&painter, corner, &text);
}

/// The frame of the shown picture, and the timeline's if it is another one.
fn frame(state: &State) -> String {
    let shown = state.engine.shown.as_ref().map_or(0, |shown| shown.reply.frame);
    let wanted = state.timeline.frame;
    let is_late = shown != wanted && !state.timeline.playing;
    if is_late { format!("frame {shown} ({wanted} not ready)") } else { format!("frame {shown}") }
}

/// Marks a picture that is not the wanted one.
fn pending(ui: &mut Ui, state: &State, pane: Rect) {
    let Some(pending_s) = state.pending_s() else { return };
    let since =
        if pending_s < 1.0 { String::new() } else { format!(", {pending_s:.0} s{}", usual_time(state)) };
    let text = format!("rendering frame {}{since}", state.timeline.frame);
    let galley = ui.painter().layout_no_wrap(text.clone(), FontId::proportional(13.0), Color32::WHITE);
    let height = ui.spacing().interact_size.y;
    let size = egui::vec2(galley.size().x + height + 16.0, height + 6.0);
    let rect = Rect::from_min_size(pos2(pane.right() - size.x - 6.0, pane.top() + 4.0), size);
    ui.painter().rect_filled(rect, 3.0, Color32::from_rgb(120, 70, 0));
    let spinner = Rect::from_min_size(rect.left_top() + egui::vec2(4.0, 3.0), egui::Vec2::splat(height));
    ui.put(spinner, waiting);
    let at = pos2(spinner.right() + 4.0, rect.center().y - 0.5 * galley.size().y);
    ui.painter().galley(at, galley, Color32::WHITE);
    let response = ui.interact(rect, ui.scope_id().with("pending"), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &text));
}

/// The time that the last full frame took.
fn usual_time(state: &State) -> String {
    let full_s = state.engine.full_ms.map(|ms| 1e-3 * ms).filter(|full_s| *full_s >= 1.0);
    full_s.map_or_else(String::new, |full_s| format!(" (the last one took {full_s:.0} s)"))
}

/// Size of a preview, rows of the reference, and whether predicted errors are pending.
fn progress(state: &State, picture: &StagePicture<'_>) -> String {
    if picture.stage == Stage::Reference {
        return rows_done(state);
    }
    let is_preview =
        state.engine.shown.as_ref().is_some_and(|shown| shown.reply.request.size == Size::Preview);
    let size = if is_preview {
        format!(", preview {}x{}", picture.size_px[0], picture.size_px[1])
    } else {
        String::new()
    };
    let missing = state.view.overlays.error && picture.errors.is_none();
    if missing { format!("{size}; predicted error follows") } else { size }
}

/// Progress of the reference's picture; empty when it is complete.
fn rows_done(state: &State) -> String {
    let Some(reference) = state.engine.current_reference_picture() else { return String::new() };
    let (done, all) = (reference.picture.rows, reference.picture.sequence.scenario.camera.size_px[1]);
    if done < all { format!(", {done} of {all} rows") } else { String::new() }
}

/// Draws the difference of the two pictures.
fn difference(ui: &Ui, state: &State, viewport: &ImageViewport) {
    let view = &state.view;
    let painter = ui.painter().with_clip_rect(viewport.pane);
    let corner = viewport.pane.left_top() + egui::vec2(6.0, 4.0);
    let pair = format!("A: {} - B: {}, {}", view.a.label(), view.b.label(), frame(state));
    if view.a == view.b {
        return label(&painter, corner, &format!("{pair}: the same picture"));
    }
    let Some((difference, image)) = state.engine.difference(view.wants_reference()) else {
        return label(&painter, corner, &format!("{pair}: rendering"));
    };
    let size_px = difference.image.size.map(|side| side as u32);
    viewport.image(&painter, ImageSlot::A, image, size_px);
    let one_sided = if difference.one_sided > 0.0 {
        format!(", {:.2} % valid in one alone", 100.0 * difference.one_sided)
    } else {
        String::new()
    };
    // The reference's picture is always subtracted.
    let pair = match view.a {
        Stage::Reference => format!("{} - reference, {}", view.b.label(), frame(state)),
        _ => pair,
    };
    let progress = if view.wants_reference() { rows_done(state) } else { String::new() };
    label(
        &painter,
        corner,
        &format!(
            "{pair}, x{:.0}: RMS {:.3}, largest {:.2} of 255{one_sided}{progress}",
            view.gain, difference.rms_dn, difference.max_dn
        ),
    );
}

fn label(painter: &egui::Painter, at: egui::Pos2, text: &str) {
    let galley = painter.layout_no_wrap(text.to_owned(), FontId::proportional(12.0), Color32::WHITE);
    let rect = Rect::from_min_size(at, galley.size()).expand(3.0);
    painter.rect_filled(rect, 3.0, Color32::from_black_alpha(150));
    painter.galley(at, galley, Color32::WHITE);
}

/// Draws a ring around the pinned pixel.
fn pinned_ring(ui: &Ui, state: &State, viewport: &ImageViewport) {
    let Some([x, y]) = state.pinned else { return };
    let painter = ui.painter().with_clip_rect(viewport.pane);
    let radius = (0.71 * viewport.scale).max(6.0);
    for (width, color) in [(3.0, Color32::BLACK), (1.5, Color32::from_rgb(255, 220, 60))] {
        painter.circle_stroke(viewport.screen(f64::from(x), f64::from(y)), radius, Stroke::new(width, color));
    }
}

/// Screen position of the wipe line.
fn wipe_x(state: &State, viewport: &ImageViewport) -> f32 {
    let rect = viewport.rect().intersect(viewport.pane);
    rect.left() + state.view.wipe.clamp(0.0, 1.0) * rect.width()
}

/// Draws the wipe line and handles its drag; returns whether the pointer is on it.
fn wipe_line(ui: &Ui, state: &State, viewport: &ImageViewport, out: &mut Outbox) -> bool {
    let x = wipe_x(state, viewport);
    let pane = viewport.pane;
    // With a dark border, for contrast on bright pictures.
    for (width, color) in [(4.0, Color32::from_black_alpha(110)), (2.0, Color32::WHITE)] {
        ui.painter().vline(x, pane.y_range(), Stroke::new(width, color));
    }
    let handle = Rect::from_center_size(pos2(x, pane.center().y), egui::vec2(12.0, pane.height()));
    let response = ui
        .interact(handle, ui.scope_id().with("wipe"), Sense::drag())
        .on_hover_cursor(CursorIcon::ResizeHorizontal);
    response.widget_info(|| WidgetInfo::slider(true, f64::from(state.view.wipe), "wipe line"));
    if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged()) {
        let rect = viewport.rect().intersect(pane);
        let mut view = state.view.clone();
        view.wipe = ((pointer.x - rect.left()) / rect.width().max(1.0)).clamp(0.0, 1.0);
        out.push(Message::View(view));
    }
    response.hovered() || response.dragged()
}
