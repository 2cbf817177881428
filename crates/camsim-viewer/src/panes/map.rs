//! The flight from above: track, terrain, where the camera is and what it sees of the ground. A click jumps to the nearest frame.

use std::sync::{Arc, Weak};

use camsim_core::{
    camera::CameraModel,
    pose::CameraPose,
    scene::{Scene, Terrain},
    sequence::Sequence,
    trajectory::Trajectory,
};
use eframe::egui::{
    Color32, ColorImage, Pos2, Rect, Role, Sense, Shape, Stroke, TextureHandle, TextureOptions, Ui, WidgetInfo, pos2, vec2,
};
use glam::{DVec2, DVec3};

use crate::{
    message::{Message, Outbox},
    panes::ramp_color,
    state::State,
};

/// Points of the track.
const POINTS: u64 = 1000;
/// Pixels of the relief along a side.
const RELIEF_PX: usize = 128;
/// What the camera sees farther away does not make the map larger.
const FARTHEST_M: f64 = 5000.0;
/// Rays along each side of the footprint.
const SIDE_RAYS: u32 = 6;

/// What is drawn from frame to frame, found once a sequence.
#[derive(Clone)]
struct Chart {
    of: Key,
    /// North and east, metres, with the time after the first frame, seconds.
    track: Arc<Vec<(DVec2, f64)>>,
    /// South-west and north-east corner.
    bounds: [DVec2; 2],
    relief: Option<TextureHandle>,
}

/// What it depends on: not on the camera, so that a dragged parameter does not draw it anew.
#[derive(Clone)]
struct Key {
    scene: Weak<Scene>,
    trajectory: Weak<Trajectory>,
    start_s: f64,
    seconds: f64,
}

impl Key {
    fn of(sequence: &Sequence) -> Self {
        Self {
            scene: Arc::downgrade(&sequence.scene),
            trajectory: Arc::downgrade(&sequence.path.trajectory),
            start_s: sequence.start_s,
            seconds: sequence.frames as f64 / sequence.scenario.camera.fps,
        }
    }

    fn is(&self, other: &Self) -> bool {
        self.scene.ptr_eq(&other.scene)
            && self.trajectory.ptr_eq(&other.trajectory)
            && (self.start_s, self.seconds) == (other.start_s, other.seconds)
    }
}

/// The page.
pub fn show(ui: &mut Ui, state: &State, out: &mut Outbox) {
    let Some(sequence) = state.heard.sequence() else {
        ui.label("no flight yet");
        return;
    };
    let chart = chart(ui, sequence);
    let side = ui.available_width().max(60.0);
    let (rect, response) = ui.allocate_exact_size(vec2(side, side), Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, true, "map: click to jump"));
    let size = chart.bounds[1] - chart.bounds[0];
    let scale = f64::from(side) / size.x.max(size.y).max(1.0);
    let middle = 0.5 * (chart.bounds[0] + chart.bounds[1]);
    // North is up.
    let screen = |ne: DVec2| rect.center() + vec2(((ne.y - middle.y) * scale) as f32, (-(ne.x - middle.x) * scale) as f32);
    let painter = ui.painter_at(rect);
    painter.rect_filled(rect, 2.0, ui.visuals().extreme_bg_color);
    if let Some(relief) = &chart.relief {
        let uv = Rect::from_min_max(pos2(0.0, 0.0), pos2(1.0, 1.0));
        let corners = Rect::from_two_pos(screen(chart.bounds[0]), screen(chart.bounds[1]));
        painter.image(relief.id(), corners, uv, Color32::WHITE);
    }
    let points: Vec<Pos2> = chart.track.iter().map(|(ne, _)| screen(*ne)).collect();
    painter.add(Shape::line(points, Stroke::new(1.5, Color32::from_rgb(250, 250, 250))));
    let stamp_s = stamp_s(sequence, state.timeline.frame);
    let pose = sequence.path.pose(stamp_s);
    let here = screen(pose.position_ned_m.truncate());
    for part in footprint(sequence, &pose) {
        let on_screen: Vec<Pos2> = part.iter().map(|ne| screen(*ne)).collect();
        painter.add(Shape::line(on_screen.clone(), Stroke::new(1.5, Color32::from_rgb(255, 140, 40))));
        for corner in [on_screen.first(), on_screen.last()].into_iter().flatten() {
            painter.line_segment([here, *corner], Stroke::new(1.0, Color32::from_rgba_unmultiplied(255, 140, 40, 120)));
        }
    }
    painter.circle_filled(here, 4.0, Color32::from_rgb(255, 60, 60));
    ui.label(format!("{:.0} x {:.0} m, north is up; the camera's footprint in orange", size.y, size.x));
    let place = pose.position_ned_m;
    ui.label(format!("camera at {:.1} m north, {:.1} m east, {:.1} m down", place.x, place.y, place.z));
    if let Some(at) = response.interact_pointer_pos().filter(|_| response.clicked())
        && let Some(after_s) = nearest(&chart, |ne| screen(ne).distance_sq(at))
    {
        out.push(Message::Seek(state.timeline.frame_at(after_s)));
    }
}

fn stamp_s(sequence: &Sequence, frame: u64) -> f64 {
    let camera = &sequence.scenario.camera;
    sequence.start_s + (frame as f64 + camera.phase) / camera.fps
}

/// The time of the nearest point of the track.
fn nearest(chart: &Chart, distance: impl Fn(DVec2) -> f32) -> Option<f64> {
    chart.track.iter().min_by(|a, b| distance(a.0).total_cmp(&distance(b.0))).map(|(_, after_s)| *after_s)
}

fn chart(ui: &Ui, sequence: &Arc<Sequence>) -> Chart {
    let id = eframe::egui::Id::unique("map chart");
    let of = Key::of(sequence);
    if let Some(chart) = ui.data(|data| data.get_temp::<Chart>(id)).filter(|chart| chart.of.is(&of)) {
        return chart;
    }
    let last = sequence.frames.saturating_sub(1);
    let count = POINTS.min(last + 1).max(1);
    let frames = (0..count).map(|k| if count > 1 { (u128::from(k) * u128::from(last) / u128::from(count - 1)) as u64 } else { 0 });
    let track: Vec<(DVec2, f64)> = frames
        .map(|frame| {
            (sequence.path.pose(stamp_s(sequence, frame)).position_ned_m.truncate(), stamp_s(sequence, frame) - stamp_s(sequence, 0))
        })
        .collect();
    let seen = (0..=4).flat_map(|k| {
        let pose = sequence.path.pose(stamp_s(sequence, last * k / 4));
        let here = pose.position_ned_m.truncate();
        footprint(sequence, &pose).into_iter().flatten().map(move |ne| here + (ne - here).clamp_length_max(FARTHEST_M)).collect::<Vec<_>>()
    });
    let bounds = bounds(track.iter().map(|(ne, _)| *ne).chain(seen));
    let terrain = sequence.scene.terrain.as_ref();
    let relief = terrain.map(|terrain| ui.ctx().load_texture("relief", relief(terrain, bounds), TextureOptions::LINEAR));
    let chart = Chart { of, track: Arc::new(track), bounds, relief };
    ui.data_mut(|data| data.insert_temp(id, chart.clone()));
    chart
}

/// A square around the track and what the camera sees.
fn bounds(points: impl Iterator<Item = DVec2>) -> [DVec2; 2] {
    let (low, high) = points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), ne| (low.min(ne), high.max(ne)));
    if !low.is_finite() || !high.is_finite() {
        return [DVec2::splat(-1.0), DVec2::splat(1.0)];
    }
    let half = 0.55 * (high - low).max_element().max(100.0);
    let middle = 0.5 * (low + high);
    [middle - half, middle + half]
}

/// Heights by colour, with light from the north-west.
fn relief(terrain: &Terrain, [low, high]: [DVec2; 2]) -> ColorImage {
    let at = |x: usize, y: usize| {
        let share = DVec2::new(1.0 - (y as f64 + 0.5) / RELIEF_PX as f64, (x as f64 + 0.5) / RELIEF_PX as f64);
        let ne = low + share * (high - low);
        terrain.down_at(ne.x, ne.y).map(|down_m| -down_m)
    };
    let heights: Vec<Option<f64>> = (0..RELIEF_PX * RELIEF_PX).map(|i| at(i % RELIEF_PX, i / RELIEF_PX)).collect();
    let known = || heights.iter().flatten();
    let (lowest, highest) = known().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), h| (a.min(*h), b.max(*h)));
    let step_m = (high.x - low.x) / RELIEF_PX as f64;
    let pixels = (0..heights.len()).map(|i| {
        let Some(height) = heights[i] else { return Color32::from_gray(40) };
        let slope =
            |other: Option<usize>| other.and_then(|i| heights.get(i).copied().flatten()).map_or(0.0, |there| (height - there) / step_m);
        let light = 0.75 + 0.35 * (slope(i.checked_sub(RELIEF_PX)) + slope(i.checked_sub(1))).clamp(-1.0, 1.0);
        let color = ramp_color(0.15 + 0.6 * (height - lowest) / (highest - lowest).max(1.0));
        Color32::from_rgb(shade(color.r(), light), shade(color.g(), light), shade(color.b(), light))
    });
    ColorImage::new([RELIEF_PX, RELIEF_PX], pixels.collect())
}

fn shade(value: u8, light: f64) -> u8 {
    (f64::from(value) * light).clamp(0.0, 255.0) as u8
}

/// Where rays through the picture's border meet the ground, as runs without a ray into the sky between.
fn footprint(sequence: &Sequence, pose: &CameraPose) -> Vec<Vec<DVec2>> {
    let Ok(camera) = CameraModel::from_spec(&sequence.scenario.camera) else { return Vec::new() };
    let [right, bottom] = camera.size_px.map(|side| f64::from(side) - 1.0);
    let corners = [DVec2::ZERO, DVec2::new(right, 0.0), DVec2::new(right, bottom), DVec2::new(0.0, bottom)];
    let border = (0..4)
        .flat_map(|side| (0..SIDE_RAYS).map(move |k| corners[side].lerp(corners[(side + 1) % 4], f64::from(k) / f64::from(SIDE_RAYS))));
    let mut runs: Vec<Vec<DVec2>> = vec![Vec::new()];
    for pixel in border.chain([corners[0]]) {
        let met = camera.unproject(pixel).and_then(|uv| ground(sequence, pose, pose.ned_from_camera * uv.extend(1.0)));
        match (met, runs.last_mut()) {
            (Some(point), Some(run)) => run.push(point),
            (None, Some(run)) if !run.is_empty() => runs.push(Vec::new()),
            _ => {}
        }
    }
    runs.retain(|run| run.len() > 1);
    runs
}

/// The terrain along a ray; without one, the level of the origin.
fn ground(sequence: &Sequence, pose: &CameraPose, direction_ned: DVec3) -> Option<DVec2> {
    let origin = pose.position_ned_m;
    let t = match &sequence.scene.terrain {
        Some(terrain) => terrain.intersect(origin, direction_ned, f64::INFINITY).map(|hit| hit.t),
        None => Some(-origin.z / direction_ned.z).filter(|t| *t > 0.0 && t.is_finite()),
    }?;
    Some((origin + t * direction_ned).truncate())
}
