//! The flight from above: track, terrain, what stands on it, where the camera is and what it sees of the
//! ground. A click jumps to the nearest frame.

pub(super) mod chart;
pub(super) mod footprint;

use std::sync::{Arc, Weak};

use camsim_core::{camera::CameraModel, pose::CameraPose, sequence::Sequence};
use eframe::egui::{
    Color32, Id, Painter, Pos2, Rect, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2,
};
use glam::{DVec2, DVec3};

use self::chart::Chart;
use super::widgets::fixed;
use crate::{
    message::{Message, Outbox},
    motion,
    state::State,
};

const OF_CAMERA: Color32 = Color32::from_rgb(255, 140, 40);
const OF_THINGS: Color32 = Color32::from_rgb(120, 230, 255);
/// Length of the lines along the picture's left and right border, as a share of the map.
const LOOK: f64 = 0.08;

/// The page.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let (Some(loaded), Some(stamp_s)) = (&state.heard.loaded, state.heard.stamp_s(state.timeline.frame))
    else {
        ui.label("no flight yet");
        return;
    };
    let sequence = &loaded.sequence;
    let chart = chart::chart(ui, loaded);
    let side = ui.available_width().max(60.0);
    let (rect, response) = ui.allocate_exact_size(vec2(side, side), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, "map: click to jump"));
    let size = chart.bounds[1] - chart.bounds[0];
    let scale = f64::from(side) / size.max_element();
    let middle = 0.5 * (chart.bounds[0] + chart.bounds[1]);
    // North is up.
    let screen = |ne: DVec2| {
        rect.center() + vec2(((ne.y - middle.y) * scale) as f32, (-(ne.x - middle.x) * scale) as f32)
    };
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    background(&painter, &chart, ui.visuals().text_color(), &screen);
    let pose = sequence.path.pose(stamp_s);
    if let Some(camera) = motion::camera_of(&sequence.scenario.camera) {
        let footprint = footprint(ui, sequence, state.timeline.frame, &camera, &pose);
        seen(&painter, &camera, &footprint, &pose, LOOK * size.x, &screen);
    }
    let metres = |size: f64| if size < 100.0 { fixed(size, 1) } else { fixed(size, 0) };
    let models =
        if chart.boxes.is_empty() && chart.flats.is_empty() { "" } else { ", boards and models in blue" };
    ui.label(format!(
        "{} x {} m, north is up; what the camera sees of the ground in orange{models}",
        metres(size.y),
        metres(size.x)
    ));
    let place = pose.position_ned_m;
    let decimals = if size.max_element() < 20.0 { 3 } else { 1 };
    let [north, east, down] = place.to_array().map(|m| fixed(m, decimals));
    ui.label(format!("camera at {north} m north, {east} m east, {down} m down"));
    if let Some(at) = response.interact_pointer_pos().filter(|_| response.clicked())
        && let Some(after_s) = nearest(&chart, |ne| screen(ne).distance_sq(at))
    {
        out.push(Message::Seek(state.timeline.frame_at(after_s)));
    }
}

/// Relief, pattern, boards, models, track.
fn background(painter: &Painter, chart: &Chart, text: Color32, screen: &impl Fn(DVec2) -> Pos2) {
    if let Some(relief) = &chart.relief {
        let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        let corners = Rect::from_two_pos(screen(chart.bounds[0]), screen(chart.bounds[1]));
        painter.image(relief.id(), corners, uv, Color32::WHITE);
    }
    for [low, high] in chart.boxes.iter() {
        let rect = Rect::from_two_pos(screen(low.truncate()), screen(high.truncate()));
        let seen = Rect::from_center_size(rect.center(), rect.size().max(vec2(2.0, 2.0)));
        painter.rect_filled(seen, 0.0, OF_THINGS.gamma_multiply(0.6));
    }
    for corners in chart.flats.iter() {
        painter.add(Shape::closed_line(
            corners.map(|corner| screen(corner.truncate())).to_vec(),
            Stroke::new(2.0, OF_THINGS),
        ));
    }
    let points: Vec<Pos2> = chart.track.iter().map(|(ned, _)| screen(ned.truncate())).collect();
    // A relief is dark in both themes.
    let color = if chart.relief.is_some() { Color32::WHITE } else { text };
    painter.add(Shape::line(points, Stroke::new(1.5, color)));
}

/// The camera, what it sees of the ground, and where it looks.
fn seen(
    painter: &Painter,
    camera: &CameraModel,
    footprint: &[Vec<DVec3>],
    pose: &CameraPose,
    look_m: f64,
    screen: &impl Fn(DVec2) -> Pos2,
) {
    let place = pose.position_ned_m.truncate();
    let here = screen(place);
    for part in footprint {
        let on_screen: Vec<Pos2> = part.iter().map(|ned| screen(ned.truncate())).collect();
        painter.add(Shape::line(on_screen, Stroke::new(1.5, OF_CAMERA)));
    }
    for side in [DVec2::NEG_X, DVec2::X] {
        if let Some(uv) = footprint::outermost(camera, side, Some) {
            let ray = pose.ned_from_camera * uv.extend(1.0).normalize();
            painter
                .line_segment([here, screen(place + look_m * ray.truncate())], Stroke::new(1.0, OF_CAMERA));
        }
    }
    painter.circle_filled(here, 4.0, Color32::from_rgb(255, 60, 60));
}

/// Found once a frame: it takes hundreds of rays.
pub fn footprint(
    ui: &Ui,
    sequence: &Arc<Sequence>,
    frame: u64,
    camera: &CameraModel,
    pose: &CameraPose,
) -> Arc<Vec<Vec<DVec3>>> {
    type Kept = (Weak<Sequence>, u64, Arc<Vec<Vec<DVec3>>>);
    let id = Id::unique("footprint");
    let kept = ui.data(|data| data.get_temp::<Kept>(id));
    if let Some((_, _, runs)) =
        kept.filter(|(of, at, _)| std::ptr::eq(of.as_ptr(), Arc::as_ptr(sequence)) && *at == frame)
    {
        return runs;
    }
    let runs = Arc::new(footprint::footprint(&sequence.scene, camera, pose));
    ui.data_mut(|data| data.insert_temp::<Kept>(id, (Arc::downgrade(sequence), frame, runs.clone())));
    runs
}

/// The time of the nearest point of the track.
fn nearest(chart: &Chart, distance: impl Fn(DVec2) -> f32) -> Option<f64> {
    let away = |place: &DVec3| distance(place.truncate());
    chart.track.iter().min_by(|a, b| away(&a.0).total_cmp(&away(&b.0))).map(|(_, after_s)| *after_s)
}
