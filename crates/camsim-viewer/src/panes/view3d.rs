//! 3D view of the flight: terrain, boards and models, rows of the log, tracked path, camera frustum and
//! footprint. Drag rotates, drag with the right button or Shift pans, the wheel zooms, a click jumps to the
//! nearest frame.

mod canvas;
mod frustum;
mod static_scene;

#[cfg(test)]
use eframe::egui::Pos2;
use eframe::egui::{
    Align2, Color32, FontId, PointerButton, Rect, Role, Sense, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2,
};
use glam::{DVec2, DVec3};

use self::{
    canvas::Canvas,
    frustum::ViewFrustum,
    static_scene::{StaticScene, static_scene},
};
use super::{
    map::{
        MOVING_COLOR,
        static_map::{self, MovingThing, StaticMap},
    },
    number_field::{self, NumberField},
    tooltips::WithTooltip,
    widgets::{fact, fixed, small_button},
};
use crate::{
    message::{Message, Outbox},
    orbit::{BoundingSphere, DEPRESSION_DEG, Eye, Orbit, ZOOM},
    state::State,
    view::View,
};

/// Colour of the tracked path.
const PATH_COLOR: Color32 = Color32::from_rgb(70, 170, 255);
/// Colour of rows of the log.
const LOG_COLOR: Color32 = Color32::from_rgb(255, 225, 70);
/// Colour of frustum and footprint.
const CAMERA_COLOR: Color32 = Color32::from_rgb(255, 140, 40);
/// Colour of boards and models.
const OBJECT_COLOR: Color32 = Color32::from_rgb(120, 230, 255);
/// Background in both themes; the other colours are chosen for it.
const BACKGROUND: Color32 = Color32::from_rgb(24, 28, 34);
/// Distance within which a click selects a frame, points.
const CLICK_RADIUS: f32 = 40.0;
/// Height of the pane as a fraction of its width.
const HEIGHT: f32 = 0.95;

/// Draws the page.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let (Some(loaded), Some(stamp_s)) = (&state.engine.loaded, state.engine.stamp_s(state.timeline.frame))
    else {
        ui.label("no flight yet");
        return;
    };
    let map = static_map::static_map(ui, loaded);
    let scene = static_scene(ui, &loaded.sequence, &map);
    let pose = loaded.sequence.path.pose(stamp_s);
    let mut orbit = state.view.orbit;
    controls(ui, &mut orbit, scene.sphere, pose.position_ned_m, out);
    let width = ui.available_width().max(60.0);
    let (rect, response) = ui.allocate_exact_size(vec2(width, HEIGHT * width), Sense::click_and_drag());
    response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "3D view: drag to turn, click to jump"));
    let pane = DVec2::new(f64::from(rect.width()), f64::from(rect.height()));
    let drag = DVec2::new(f64::from(response.drag_delta().x), f64::from(response.drag_delta().y));
    let pans = response.dragged_by(PointerButton::Secondary)
        || response.dragged_by(PointerButton::Middle)
        || response.dragged() && ui.input(|input| input.modifiers.shift);
    if pans {
        orbit = orbit.panned(drag, scene.sphere, pane);
    } else if response.dragged() {
        orbit = orbit.rotated(drag);
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
    let frustum = ViewFrustum::cached(ui, state, &loaded.sequence, &pose, scene.sphere.radius_m);
    let eye = Eye::new(&orbit, scene.sphere, pane);
    let moving = map.moving(&loaded.sequence.scene, stamp_s);
    draw(ui, rect, &eye, &scene, &map, &moving, frustum.as_ref(), pose.position_ned_m);
    legend(ui, &map, frustum.as_ref(), pose.position_ned_m, state.timeline.frame);
    if let Some(clicked) = response.interact_pointer_pos().filter(|_| response.clicked())
        && let Some(after_s) = nearest(&eye, &map, clicked - rect.center())
    {
        out.push(Message::Seek(state.timeline.frame_at(after_s)));
    }
}

/// Controls for the viewpoint, for use without a mouse.
fn controls(ui: &mut Ui, orbit: &mut Orbit, sphere: BoundingSphere, camera_ned_m: DVec3, out: &mut Outbox) {
    ui.horizontal_wrapped(|ui| {
        if ui.button("whole scene").with_tooltip("the whole scene (double click)").clicked() {
            *orbit = Orbit::default();
        }
        if ui.button("from above").with_tooltip("from above, north up, as the map").clicked() {
            *orbit = Orbit::from_above();
        }
        if ui.button("to the camera").with_tooltip("centres the view on the camera").clicked() {
            *orbit = orbit.centred(camera_ned_m, sphere);
        }
        for (text, name, factor) in [("-", "farther", 1.0 / 1.5), ("+", "nearer", 1.5)] {
            if small_button(ui, text, name, name) {
                *orbit = orbit.zoomed(factor);
            }
        }
    });
    orbit_fields(ui, orbit, out);
}

/// Number fields of the viewpoint.
fn orbit_fields(ui: &mut Ui, orbit: &mut Orbit, out: &mut Outbox) {
    ui.horizontal_wrapped(|ui| {
        let angle = |name, label, range, tip| NumberField {
            name,
            label,
            unit: "deg",
            range,
            speed: 0.5,
            decimals: 1,
            whole: false,
            tip,
        };
        let zoom = NumberField {
            unit: "x",
            speed: 0.01,
            decimals: 2,
            ..angle("view zoom", "zoom", ZOOM, "1 shows the whole scene (wheel)")
        };
        for (field, value) in [
            (
                angle(
                    "view azimuth",
                    "azimuth",
                    [0.0, 360.0],
                    "azimuth of the view direction, east of north (drag)",
                ),
                &mut orbit.azimuth_deg,
            ),
            (
                angle(
                    "view depression",
                    "down",
                    DEPRESSION_DEG,
                    "depression of the view direction; 90 is from above (drag)",
                ),
                &mut orbit.depression_deg,
            ),
            (zoom, &mut orbit.zoom),
        ] {
            if let Some((changed, _)) = number_field::drag_value(ui, &field, *value, out) {
                *value = changed;
            }
        }
    });
}

/// Consumes the wheel, which would scroll the page, and returns its zoom factor.
fn wheel(ui: &Ui) -> f64 {
    let zoom = ui.input(|input| f64::from(input.zoom_delta()));
    let turn = ui.input_mut(|input| std::mem::take(&mut input.smooth_scroll_delta)).y;
    zoom * (f64::from(turn) / 200.0).exp()
}

fn draw(
    ui: &Ui,
    rect: Rect,
    eye: &Eye,
    scene: &StaticScene,
    map: &StaticMap,
    moving: &[MovingThing],
    frustum: Option<&ViewFrustum>,
    camera_ned_m: DVec3,
) {
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, BACKGROUND);
    let mut canvas = Canvas::new(*eye, rect.center());
    // Depth offset that keeps lines on the ground visible.
    let lift_m = scene.step_m;
    canvas.surface(&scene.ground);
    scene.flats.iter().for_each(|flat| canvas.surface(flat));
    for corners in map.flats.iter() {
        canvas.line(&[corners[0], corners[1], corners[2], corners[3], corners[0]], 1.5, OBJECT_COLOR, lift_m);
    }
    let outlined = map.boxes.len() <= static_scene::MAX_OUTLINED;
    map.boxes.iter().for_each(|corners| canvas.cuboid(*corners, OBJECT_COLOR, outlined));
    moving.iter().for_each(|thing| canvas.cuboid(thing.corners, MOVING_COLOR, outlined));
    // Log below path: both stay visible where they coincide.
    map.log.iter().for_each(|row| canvas.dot(*row, 3.0, LOG_COLOR, lift_m));
    canvas.line(&map.flown, 2.4, PATH_COLOR, 2.0 * lift_m);
    if let Some(frustum) = frustum {
        canvas.frustum(camera_ned_m, &frustum.rim, CAMERA_COLOR);
        frustum.ground.iter().for_each(|run| canvas.line(run, 1.5, CAMERA_COLOR, lift_m));
    }
    if let Some(foot) = scene.below(camera_ned_m) {
        canvas.line(&[camera_ned_m, foot], 1.0, Color32::from_gray(170), lift_m);
    }
    painter.add(canvas.mesh());
    for thing in moving {
        let eye_m = eye.eye_from_ned(thing.middle_ned_m());
        if eye_m.z >= eye.near_m() {
            let at = rect.center() + on_screen(eye.project(eye_m));
            painter.text(at, Align2::CENTER_BOTTOM, &thing.name, FontId::proportional(11.0), Color32::WHITE);
        }
    }
    // The camera is drawn in front of everything.
    let eye_m = eye.eye_from_ned(camera_ned_m);
    if eye_m.z >= eye.near_m() {
        let position = rect.center() + on_screen(eye.project(eye_m));
        painter.circle(position, 4.5, Color32::from_rgb(255, 60, 60), Stroke::new(1.0, Color32::WHITE));
    }
    compass(&painter.with_clip_rect(rect), rect, eye);
}

fn on_screen(points: DVec2) -> Vec2 {
    vec2(points.x as f32, points.y as f32)
}

/// Axes north, east and up, in the lower left corner.
fn compass(painter: &eframe::egui::Painter, rect: Rect, eye: &Eye) {
    let middle = pos2(rect.left() + 34.0, rect.bottom() - 34.0);
    painter.circle_filled(middle, 31.0, Color32::from_black_alpha(130));
    for (name, axis) in [("N", DVec3::X), ("E", DVec3::Y), ("up", DVec3::NEG_Z)] {
        let towards = on_screen(eye.rotate(axis).truncate());
        painter.line_segment([middle, middle + 20.0 * towards], Stroke::new(1.5, Color32::from_gray(220)));
        if towards.length() > 0.2 {
            let position = middle + 20.0 * towards + 8.0 * towards.normalized();
            painter.text(
                position,
                Align2::CENTER_CENTER,
                name,
                FontId::proportional(11.0),
                Color32::from_gray(220),
            );
        }
    }
}

fn legend(ui: &mut Ui, map: &StaticMap, frustum: Option<&ViewFrustum>, camera_ned_m: DVec3, frame: u64) {
    ui.horizontal_wrapped(|ui| {
        for (name, color) in [("log", LOG_COLOR), ("tracked path", PATH_COLOR), ("camera", CAMERA_COLOR)] {
            let (spot, _) = ui.allocate_exact_size(vec2(9.0, 9.0), Sense::hover());
            ui.painter().circle_filled(spot.center(), 4.0, color);
            ui.label(name);
        }
    });
    let size = map.bounds[1] - map.bounds[0];
    let decimals = if size.max_element() < 20.0 { 3 } else { 1 };
    let [north, east, down] = camera_ned_m.to_array().map(|m| fixed(m, decimals));
    fact(
        ui,
        &format!("frame {frame}"),
        format!("{north} N, {east} E, {down} D m"),
        "position of the camera at the frame's stamp",
    );
    if let Some(frustum) = frustum {
        let [across, down, corners] = frustum.fov_deg.map(|deg| fixed(deg, 2));
        fact(
            ui,
            "field of view",
            format!("{across} x {down} deg, {corners} between corners"),
            "between opposite borders of the picture, or the outermost rays if the lens ends before them",
        );
    }
    fact(
        ui,
        "extent",
        format!("{} x {} m", fixed(size.y, decimals), fixed(size.x, decimals)),
        "of the ground shown; heights are to the same scale",
    );
}

/// Time of the track point nearest to a clicked position, seconds after frame 0.
fn nearest(eye: &Eye, map: &StaticMap, clicked: Vec2) -> Option<f64> {
    let distance = |ned: &DVec3| {
        let eye_m = eye.eye_from_ned(*ned);
        (eye_m.z >= eye.near_m())
            .then(|| (on_screen(eye.project(eye_m)) - clicked).length())
            .filter(|points| *points < CLICK_RADIUS)
    };
    let near = map.track.iter().filter_map(|(ned, after_s)| Some((distance(ned)?, *after_s)));
    near.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, after_s)| after_s)
}

/// Screen position at which a point of the scene was drawn.
#[cfg(test)]
pub fn screen_position(context: &eframe::egui::Context, orbit: &Orbit, rect: Rect, ned_m: DVec3) -> Pos2 {
    let scene: StaticScene = context.data(|data| data.get_temp(static_scene::id())).expect("drawn");
    let eye = Eye::new(orbit, scene.sphere, DVec2::new(f64::from(rect.width()), f64::from(rect.height())));
    rect.center() + on_screen(eye.project(eye.eye_from_ned(ned_m)))
}
