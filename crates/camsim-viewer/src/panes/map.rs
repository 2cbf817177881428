//! Map of the flight: track, terrain, boards and models, the camera and its footprint. A click jumps to the
//! nearest frame.

pub(super) mod footprint;
pub(super) mod static_map;

use std::sync::{Arc, Weak};

use camsim_core::{camera::CameraModel, pose::CameraPose, sequence::Sequence};
use eframe::egui::{
    Align2, Color32, FontId, Id, Painter, Pos2, Rect, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2,
};
use glam::{DVec2, DVec3};

use self::static_map::StaticMap;
use super::widgets::fixed;
use crate::{
    message::{Message, Outbox},
    motion,
    state::State,
};

const CAMERA_COLOR: Color32 = Color32::from_rgb(255, 140, 40);
const OBJECT_COLOR: Color32 = Color32::from_rgb(120, 230, 255);
/// Colour of what moves.
pub const MOVING_COLOR: Color32 = Color32::from_rgb(255, 120, 220);
/// Length of the rays at the picture's left and right border, as a fraction of the map.
const VIEW_RAY_SHARE: f64 = 0.08;

/// Draws the page.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let (Some(loaded), Some(stamp_s)) = (&state.engine.loaded, state.engine.stamp_s(state.timeline.frame))
    else {
        ui.label("no flight yet");
        return;
    };
    let sequence = &loaded.sequence;
    let map = static_map::static_map(ui, loaded);
    let side = ui.available_width().max(60.0);
    let (rect, response) = ui.allocate_exact_size(vec2(side, side), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, "map: click to jump"));
    let size = map.bounds[1] - map.bounds[0];
    let scale = f64::from(side) / size.max_element();
    let middle = 0.5 * (map.bounds[0] + map.bounds[1]);
    // North is up.
    let screen = |ne: DVec2| {
        rect.center() + vec2(((ne.y - middle.y) * scale) as f32, (-(ne.x - middle.x) * scale) as f32)
    };
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    background(&painter, &map, ui.visuals().text_color(), &screen);
    for thing in map.moving(&sequence.scene, stamp_s) {
        let rect = box_from_above(&thing.corners, &screen);
        painter.rect_filled(rect, 0.0, MOVING_COLOR);
        let font = FontId::proportional(11.0);
        painter.text(rect.right_top(), Align2::LEFT_BOTTOM, &thing.name, font, MOVING_COLOR);
    }
    let pose = sequence.path.pose(stamp_s);
    if let Some(camera) = motion::camera_model(&sequence.scenario.camera) {
        let footprint = cached_footprint(ui, sequence, state.timeline.frame, &camera, &pose);
        draw_camera(&painter, &camera, &footprint, &pose, VIEW_RAY_SHARE * size.x, &screen);
    }
    let metres = |size: f64| if size < 100.0 { fixed(size, 1) } else { fixed(size, 0) };
    let models =
        if map.boxes.is_empty() && map.flats.is_empty() { "" } else { ", boards and models in blue" };
    ui.label(format!(
        "{} x {} m, north is up; the camera's footprint in orange{models}",
        metres(size.y),
        metres(size.x)
    ));
    let position_ned_m = pose.position_ned_m;
    let decimals = if size.max_element() < 20.0 { 3 } else { 1 };
    let [north, east, down] = position_ned_m.to_array().map(|m| fixed(m, decimals));
    ui.label(format!("camera at {north} m north, {east} m east, {down} m down"));
    if let Some(clicked) = response.interact_pointer_pos().filter(|_| response.clicked())
        && let Some(after_s) = nearest(&map, |ne| screen(ne).distance_sq(clicked))
    {
        out.push(Message::Seek(state.timeline.frame_at(after_s)));
    }
}

/// Draws relief, pattern, boards, models and track.
fn background(painter: &Painter, map: &StaticMap, text: Color32, screen: &impl Fn(DVec2) -> Pos2) {
    if let Some(relief) = &map.relief {
        let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        let corners = Rect::from_two_pos(screen(map.bounds[0]), screen(map.bounds[1]));
        painter.image(relief.id(), corners, uv, Color32::WHITE);
    }
    for corners in map.boxes.iter() {
        painter.rect_filled(box_from_above(corners, screen), 0.0, OBJECT_COLOR.gamma_multiply(0.6));
    }
    for corners in map.flats.iter() {
        painter.add(Shape::closed_line(
            corners.map(|corner| screen(corner.truncate())).to_vec(),
            Stroke::new(2.0, OBJECT_COLOR),
        ));
    }
    let points: Vec<Pos2> = map.track.iter().map(|(ned, _)| screen(ned.truncate())).collect();
    // The relief is dark in both themes.
    let color = if map.relief.is_some() { Color32::WHITE } else { text };
    painter.add(Shape::line(points, Stroke::new(1.5, color)));
}

/// A box from above, large enough to be seen.
fn box_from_above([low, high]: &[DVec3; 2], screen: &impl Fn(DVec2) -> Pos2) -> Rect {
    let rect = Rect::from_two_pos(screen(low.truncate()), screen(high.truncate()));
    Rect::from_center_size(rect.center(), rect.size().max(vec2(2.0, 2.0)))
}

/// Draws the camera, its footprint, and the rays at its left and right border.
fn draw_camera(
    painter: &Painter,
    camera: &CameraModel,
    footprint: &[Vec<DVec3>],
    pose: &CameraPose,
    ray_m: f64,
    screen: &impl Fn(DVec2) -> Pos2,
) {
    let position_ne_m = pose.position_ned_m.truncate();
    let here = screen(position_ne_m);
    for part in footprint {
        let on_screen: Vec<Pos2> = part.iter().map(|ned| screen(ned.truncate())).collect();
        painter.add(Shape::line(on_screen, Stroke::new(1.5, CAMERA_COLOR)));
    }
    for side in [DVec2::NEG_X, DVec2::X] {
        if let Some(ray) = footprint::outermost(camera, side, Some) {
            let ray = pose.ned_from_camera * ray;
            painter.line_segment(
                [here, screen(position_ne_m + ray_m * ray.truncate())],
                Stroke::new(1.0, CAMERA_COLOR),
            );
        }
    }
    painter.circle_filled(here, 4.0, Color32::from_rgb(255, 60, 60));
}

/// The footprint of a frame, cached: it takes hundreds of rays.
pub fn cached_footprint(
    ui: &Ui,
    sequence: &Arc<Sequence>,
    frame: u64,
    camera: &CameraModel,
    pose: &CameraPose,
) -> Arc<Vec<Vec<DVec3>>> {
    type FootprintCache = (Weak<Sequence>, u64, Arc<Vec<Vec<DVec3>>>);
    let id = Id::unique("footprint");
    let cached = ui.data(|data| data.get_temp::<FootprintCache>(id));
    if let Some((_, _, runs)) = cached.filter(|(cached_sequence, cached_frame, _)| {
        std::ptr::eq(cached_sequence.as_ptr(), Arc::as_ptr(sequence)) && *cached_frame == frame
    }) {
        return runs;
    }
    let runs = Arc::new(footprint::footprint(&sequence.scene, camera, pose));
    ui.data_mut(|data| {
        data.insert_temp::<FootprintCache>(id, (Arc::downgrade(sequence), frame, runs.clone()))
    });
    runs
}

/// Time of the nearest point of the track, seconds after frame 0.
fn nearest(map: &StaticMap, distance: impl Fn(DVec2) -> f32) -> Option<f64> {
    let distance = |ned_m: &DVec3| distance(ned_m.truncate());
    map.track.iter().min_by(|a, b| distance(&a.0).total_cmp(&distance(&b.0))).map(|(_, after_s)| *after_s)
}
