//! The flight in three dimensions: terrain, what stands on it, the log's rows, the tracked path, and the
//! camera with what it sees. Drag to turn, with the right button (or Shift) to move, wheel to zoom; a click
//! jumps to the nearest frame.

mod canvas;
mod scene;
mod sight;

#[cfg(test)]
use eframe::egui::Pos2;
use eframe::egui::{
    Align2, Color32, FontId, PointerButton, Rect, Role, Sense, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2,
};
use glam::{DVec2, DVec3};

use self::{
    canvas::Canvas,
    scene::{Model, model},
    sight::PixelTruth,
};
use super::{
    map::chart::{self, Chart},
    numbers::{self, Field},
    tips::Explained,
    widgets::{fact, facts, fixed, named},
};
use crate::{
    message::{Message, Outbox},
    orbit::{Ball, DEPRESSION_DEG, Eye, Orbit, ZOOM},
    state::State,
    view::View,
};

/// Of the path that is flown.
const OF_PATH: Color32 = Color32::from_rgb(70, 170, 255);
/// Of the log's rows.
const OF_LOG: Color32 = Color32::from_rgb(255, 225, 70);
/// Of the camera and what it sees.
const OF_CAMERA: Color32 = Color32::from_rgb(255, 140, 40);
/// Of boards and models.
const OF_THINGS: Color32 = Color32::from_rgb(120, 230, 255);
/// The ground behind all of it, in both themes: colours are chosen for it.
const BEHIND: Color32 = Color32::from_rgb(24, 28, 34);
/// A click finds a frame within so many points.
const REACH: f32 = 40.0;
/// Height of the pane as a share of its width.
const HEIGHT: f32 = 0.95;

/// The page.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let (Some(loaded), Some(stamp_s)) = (&state.heard.loaded, state.heard.stamp_s(state.timeline.frame))
    else {
        ui.label("no flight yet");
        return;
    };
    let chart = chart::chart(ui, loaded);
    let model = model(ui, &loaded.sequence, &chart);
    let pose = loaded.sequence.path.pose(stamp_s);
    let mut orbit = state.view.orbit;
    controls(ui, &mut orbit, model.ball, pose.position_ned_m, out);
    let width = ui.available_width().max(60.0);
    let (rect, response) = ui.allocate_exact_size(vec2(width, HEIGHT * width), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "3D view: drag to turn, click to jump"));
    let pane = DVec2::new(f64::from(rect.width()), f64::from(rect.height()));
    let drag = DVec2::new(f64::from(response.drag_delta().x), f64::from(response.drag_delta().y));
    let moves = response.dragged_by(PointerButton::Secondary)
        || response.dragged_by(PointerButton::Middle)
        || response.dragged() && ui.input(|input| input.modifiers.shift);
    if moves {
        orbit = orbit.panned(drag, model.ball, pane);
    } else if response.dragged() {
        orbit = orbit.turned(drag);
    }
    if response.contains_pointer() {
        orbit = orbit.zoomed(wheel(ui));
    }
    if response.double_clicked() {
        orbit = Orbit::default();
    }
    if orbit != state.view.orbit {
        out.push(Message::View(View { orbit, ..state.view.clone() }));
    }
    let sight = PixelTruth::new(ui, state, &loaded.sequence, &pose, model.ball.radius_m);
    let eye = Eye::new(&orbit, model.ball, pane);
    draw(ui, rect, &eye, &model, &chart, sight.as_ref(), pose.position_ned_m);
    legend(ui, &chart, sight.as_ref(), pose.position_ned_m, state.timeline.frame);
    if let Some(at) = response.interact_pointer_pos().filter(|_| response.clicked())
        && let Some(after_s) = nearest(&eye, &chart, at - rect.center())
    {
        out.push(Message::Seek(state.timeline.frame_at(after_s)));
    }
}

/// Whatever a hand can do with the mouse can be done without, too.
fn controls(ui: &mut Ui, orbit: &mut Orbit, ball: Ball, camera_ned_m: DVec3, out: &mut Outbox) {
    ui.horizontal_wrapped(|ui| {
        if ui.button("reset").explained("all of the scene (double click)").clicked() {
            *orbit = Orbit::default();
        }
        if ui.button("from above").explained("north up, as the map").clicked() {
            *orbit = Orbit::from_above();
        }
        if ui
            .button("to the camera")
            .explained("the camera in the middle; then the wheel goes nearer")
            .clicked()
        {
            *orbit = orbit.centred(camera_ned_m, ball);
        }
        for (text, name, factor) in [("-", "farther", 1.0 / 1.5), ("+", "nearer", 1.5)] {
            let button = ui.small_button(text).explained(name);
            named(&button, Role::Button, name);
            if button.clicked() {
                *orbit = orbit.zoomed(factor);
            }
        }
    });
    ui.horizontal_wrapped(|ui| {
        let angle = |name, label, range, tip| Field {
            name,
            label,
            unit: "deg",
            range,
            speed: 0.5,
            decimals: 1,
            whole: false,
            tip,
        };
        let zoom = Field {
            unit: "x",
            speed: 0.01,
            decimals: 2,
            ..angle("view zoom", "zoom", ZOOM, "1 shows all of the scene (wheel)")
        };
        for (field, value) in [
            (
                angle("view azimuth", "azimuth", [0.0, 360.0], "where the look goes, east of north (drag)"),
                &mut orbit.azimuth_deg,
            ),
            (
                angle(
                    "view depression",
                    "down",
                    DEPRESSION_DEG,
                    "how far the look goes down; 90 is from above (drag)",
                ),
                &mut orbit.depression_deg,
            ),
            (zoom, &mut orbit.zoom),
        ] {
            if let Some((changed, _)) = numbers::number(ui, &field, *value, out) {
                *value = changed;
            }
        }
    });
}

/// Takes the turn of the wheel, which would else move the page; by which factor it comes nearer.
fn wheel(ui: &Ui) -> f64 {
    let zoom = ui.input(|input| f64::from(input.zoom_delta()));
    let turn = ui.input_mut(|input| std::mem::take(&mut input.smooth_scroll_delta)).y;
    zoom * (f64::from(turn) / 200.0).exp()
}

fn draw(
    ui: &Ui,
    rect: Rect,
    eye: &Eye,
    model: &Model,
    chart: &Chart,
    sight: Option<&PixelTruth>,
    camera_ned_m: DVec3,
) {
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, BEHIND);
    let mut canvas = Canvas::new(*eye, rect.center());
    // Lines on the ground must not sink into it.
    let lift_m = model.step_m;
    canvas.surface(&model.ground);
    model.flats.iter().for_each(|flat| canvas.surface(flat));
    for corners in chart.flats.iter() {
        canvas.line(&[corners[0], corners[1], corners[2], corners[3], corners[0]], 1.5, OF_THINGS, lift_m);
    }
    let outlined = chart.boxes.len() <= scene::MOST_OUTLINED;
    chart.boxes.iter().for_each(|corners| canvas.cuboid(*corners, OF_THINGS, outlined));
    // Both are seen where they agree.
    chart.log.iter().for_each(|row| canvas.dot(*row, 3.0, OF_LOG, lift_m));
    canvas.line(&chart.flown, 2.4, OF_PATH, 2.0 * lift_m);
    if let Some(sight) = sight {
        canvas.pyramid(camera_ned_m, &sight.rim, OF_CAMERA);
        sight.ground.iter().for_each(|run| canvas.line(run, 1.5, OF_CAMERA, lift_m));
    }
    if let Some(foot) = model.below(camera_ned_m) {
        canvas.line(&[camera_ned_m, foot], 1.0, Color32::from_gray(170), lift_m);
    }
    painter.add(canvas.mesh());
    // What is asked for is seen whatever stands before it.
    let seen = eye.seen(camera_ned_m);
    if seen.z >= eye.near_m() {
        let at = rect.center() + on_screen(eye.place(seen));
        painter.circle(at, 4.5, Color32::from_rgb(255, 60, 60), Stroke::new(1.0, Color32::WHITE));
    }
    compass(&painter.with_clip_rect(rect), rect, eye);
}

fn on_screen(place: DVec2) -> Vec2 {
    vec2(place.x as f32, place.y as f32)
}

/// Where north, east and up are, in the lower left corner.
fn compass(painter: &eframe::egui::Painter, rect: Rect, eye: &Eye) {
    let middle = pos2(rect.left() + 34.0, rect.bottom() - 34.0);
    painter.circle_filled(middle, 31.0, Color32::from_black_alpha(130));
    for (name, axis) in [("N", DVec3::X), ("E", DVec3::Y), ("up", DVec3::NEG_Z)] {
        let towards = on_screen(eye.turned(axis).truncate());
        painter.line_segment([middle, middle + 20.0 * towards], Stroke::new(1.5, Color32::from_gray(220)));
        if towards.length() > 0.2 {
            let at = middle + 20.0 * towards + 8.0 * towards.normalized();
            painter.text(
                at,
                Align2::CENTER_CENTER,
                name,
                FontId::proportional(11.0),
                Color32::from_gray(220),
            );
        }
    }
}

fn legend(ui: &mut Ui, chart: &Chart, sight: Option<&PixelTruth>, camera_ned_m: DVec3, frame: u64) {
    ui.horizontal_wrapped(|ui| {
        for (name, color) in [("log", OF_LOG), ("tracked path", OF_PATH), ("camera", OF_CAMERA)] {
            let (spot, _) = ui.allocate_exact_size(vec2(9.0, 9.0), Sense::hover());
            ui.painter().circle_filled(spot.center(), 4.0, color);
            ui.label(name);
        }
    });
    let size = chart.bounds[1] - chart.bounds[0];
    let decimals = if size.max_element() < 20.0 { 3 } else { 1 };
    facts(ui, "3D", |ui| {
        let [north, east, down] = camera_ned_m.to_array().map(|m| fixed(m, decimals));
        fact(
            ui,
            &format!("frame {frame}"),
            format!("{north} N, {east} E, {down} D m"),
            "where the camera is at the frame's stamp",
        );
        if let Some(sight) = sight {
            let [across, down, corners] = sight.field_deg.map(|deg| fixed(deg, 2));
            fact(
                ui,
                "field of view",
                format!("{across} x {down} deg, {corners} between corners"),
                "angle between the outermost pixels that have rays, through the middle of the picture",
            );
        }
        fact(
            ui,
            "around",
            format!("{} x {} m", fixed(size.y, decimals), fixed(size.x, decimals)),
            "of the ground that is drawn; to scale, heights too",
        );
    });
}

/// The time of the nearest point of the track that is seen near a place of the pane.
fn nearest(eye: &Eye, chart: &Chart, at: Vec2) -> Option<f64> {
    let away = |ned: &DVec3| {
        let seen = eye.seen(*ned);
        (seen.z >= eye.near_m())
            .then(|| (on_screen(eye.place(seen)) - at).length())
            .filter(|points| *points < REACH)
    };
    let near = chart.track.iter().filter_map(|(ned, after_s)| Some((away(ned)?, *after_s)));
    near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, after_s)| after_s)
}

/// Where a place of the scene was drawn.
#[cfg(test)]
pub fn place_of(context: &eframe::egui::Context, orbit: &Orbit, rect: Rect, ned_m: DVec3) -> Pos2 {
    let model: Model = context.data(|data| data.get_temp(scene::id())).expect("drawn");
    let eye = Eye::new(orbit, model.ball, DVec2::new(f64::from(rect.width()), f64::from(rect.height())));
    rect.center() + on_screen(eye.place(eye.seen(ned_m)))
}
