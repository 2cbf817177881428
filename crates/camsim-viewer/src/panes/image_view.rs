//! The picture: stages, comparison, zoom and pan.

mod canvas;
mod overlays;
mod toolbar;

use eframe::egui::{
    self, Align2, Color32, CursorIcon, FontId, Rect, Role, Sense, Stroke, Ui, WidgetInfo, pos2,
};

use self::canvas::Placement;
use super::widgets::waiting;
use crate::{
    engine::{Size, Stage},
    heard::PixelTruth,
    message::{Message, Outbox},
    sheet::Place,
    state::State,
    view::Compare,
};

/// The pane.
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
    // Of the camera that took what is shown: another one may never have a picture.
    let Some(size_px) = state.heard.shown.as_ref().map(|shown| shown.reply.wanted.scenario.camera.size_px)
    else {
        if state.heard.fault.is_none() {
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
    let placements: Vec<Placement> =
        panes.iter().map(|pane| Placement::new(*pane, size_px, &state.view, ui.pixels_per_point())).collect();
    toolbar::remember(ui, placements.first());
    draw(ui, state, &placements);
    for placement in &placements {
        pinned(ui, state, placement);
    }
    let on_wipe = state.view.compare == Compare::Wipe
        && placements.first().is_some_and(|placement| wipe(ui, state, placement, out));
    canvas::interact(ui, &response, &placements, state, on_wipe, out);
}

fn draw(ui: &Ui, state: &State, placements: &[Placement]) {
    let view = &state.view;
    let Some(first) = placements.first() else { return };
    match view.compare {
        Compare::Single => side(ui, state, first, view.a, first.pane, Place::A),
        Compare::SideBySide => {
            side(ui, state, first, view.a, first.pane, Place::A);
            if let Some(second) = placements.get(1) {
                side(ui, state, second, view.b, second.pane, Place::B);
            }
        }
        Compare::Wipe => {
            let (left, right) = first.pane.split_left_right_at_x(wipe_x(state, first));
            side(ui, state, first, view.a, left, Place::A);
            side(ui, state, first, view.b, right, Place::B);
        }
        Compare::Difference => difference(ui, state, first),
    }
}

/// One picture with its overlays, within `clip`.
fn side(ui: &Ui, state: &State, placement: &Placement, stage: Stage, clip: Rect, place: Place) {
    let painter = ui.painter().with_clip_rect(clip.intersect(placement.pane));
    let Some(sight) = state.heard.sight(stage) else {
        painter.text(
            clip.center(),
            Align2::CENTER_CENTER,
            format!("{}: on its way", stage.label()),
            FontId::proportional(14.0),
            ui.visuals().text_color(),
        );
        return;
    };
    if state.view.overlays.invalid {
        painter.rect_filled(placement.picture_rect(sight.size_px), 0.0, Color32::from_rgb(255, 0, 0));
    }
    let depth = sight.depth.filter(|_| state.view.overlays.depth).map(|(_, sheet)| sheet);
    let errors = sight.errors.filter(|_| state.view.overlays.error).map(|(_, sheet)| sheet);
    placement.image(&painter, place, depth.or(errors).unwrap_or(sight.sheet), sight.size_px);
    overlays::draw(
        &painter.with_clip_rect(painter.clip_rect().intersect(placement.rect())),
        placement,
        state,
        &sight,
    );
    let corner = clip.intersect(placement.pane).left_top() + egui::vec2(6.0, 4.0);
    label(
        &painter,
        corner,
        &format!(
            "{place:?}: {}{}{}",
            stage.label(),
            if depth.is_some() { ", depth" } else { "" },
            progress(state, &sight)
        ),
    );
}

fn progress(state: &State, sight: &PixelTruth<'_>) -> String {
    if sight.stage == Stage::Oracle {
        return rows_done(state);
    }
    let is_preview = state.heard.shown.as_ref().is_some_and(|shown| shown.reply.wanted.size == Size::Preview);
    let size = if is_preview {
        format!(", preview {}x{}", sight.size_px[0], sight.size_px[1])
    } else {
        String::new()
    };
    let missing = state.view.overlays.error && sight.errors.is_none();
    if missing { format!("{size}; predicted error once the hand rests") } else { size }
}

/// How far the oracle is, as long as it is not through.
fn rows_done(state: &State) -> String {
    let Some(exact) = state.heard.current_exact() else { return String::new() };
    let (done, all) = (exact.picture.rows, exact.picture.sequence.scenario.camera.size_px[1]);
    if done < all { format!(", {done} of {all} rows") } else { String::new() }
}

fn difference(ui: &Ui, state: &State, placement: &Placement) {
    let view = &state.view;
    let painter = ui.painter().with_clip_rect(placement.pane);
    let corner = placement.pane.left_top() + egui::vec2(6.0, 4.0);
    let pair = format!("A: {} - B: {}", view.a.label(), view.b.label());
    if view.a == view.b {
        return label(&painter, corner, &format!("{pair}: the same picture"));
    }
    let Some((difference, sheet)) = state.heard.difference(view.wants_oracle()) else {
        return label(&painter, corner, &format!("{pair}: on its way"));
    };
    let size_px = difference.image.size.map(|side| side as u32);
    placement.image(&painter, Place::A, sheet, size_px);
    let one_sided = if difference.one_sided > 0.0 {
        format!(", {:.2} % valid in one alone", 100.0 * difference.one_sided)
    } else {
        String::new()
    };
    // The oracle is always what is taken away.
    let pair = if view.a == Stage::Oracle { format!("{} - oracle", view.b.label()) } else { pair };
    let so_far = if view.wants_oracle() { rows_done(state) } else { String::new() };
    label(
        &painter,
        corner,
        &format!(
            "{pair}, x{:.0}: RMS {:.3}, largest {:.2} of 255{one_sided}{so_far}",
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

/// A ring around the pixel that is kept in the inspector.
fn pinned(ui: &Ui, state: &State, placement: &Placement) {
    let Some([x, y]) = state.pinned else { return };
    let painter = ui.painter().with_clip_rect(placement.pane);
    let radius = (0.71 * placement.scale).max(6.0);
    for (width, color) in [(3.0, Color32::BLACK), (1.5, Color32::from_rgb(255, 220, 60))] {
        painter.circle_stroke(
            placement.screen(f64::from(x), f64::from(y)),
            radius,
            Stroke::new(width, color),
        );
    }
}

fn wipe_x(state: &State, placement: &Placement) -> f32 {
    let rect = placement.rect().intersect(placement.pane);
    rect.left() + state.view.wipe.clamp(0.0, 1.0) * rect.width()
}

/// The line of the wipe and the hand on it; whether the pointer is there.
fn wipe(ui: &Ui, state: &State, placement: &Placement, out: &mut Outbox) -> bool {
    let x = wipe_x(state, placement);
    let pane = placement.pane;
    // To be seen on bright ground too.
    for (width, color) in [(4.0, Color32::from_black_alpha(110)), (2.0, Color32::WHITE)] {
        ui.painter().vline(x, pane.y_range(), Stroke::new(width, color));
    }
    let handle = Rect::from_center_size(pos2(x, pane.center().y), egui::vec2(12.0, pane.height()));
    let response = ui
        .interact(handle, ui.scope_id().with("wipe"), Sense::drag())
        .on_hover_cursor(CursorIcon::ResizeHorizontal);
    response.widget_info(|| WidgetInfo::slider(true, f64::from(state.view.wipe), "wipe line"));
    if let Some(pointer) = response.interact_pointer_pos().filter(|_| response.dragged()) {
        let rect = placement.rect().intersect(pane);
        let mut view = state.view.clone();
        view.wipe = ((pointer.x - rect.left()) / rect.width().max(1.0)).clamp(0.0, 1.0);
        out.push(Message::View(view));
    }
    response.hovered() || response.dragged()
}
