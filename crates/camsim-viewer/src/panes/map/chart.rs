//! What of the map is the same from frame to frame: track, relief, and what stands in the scene.

use std::sync::{Arc, Weak};

use camsim_core::{
    camera::CameraModel,
    scene::{Scene, Terrain},
    sequence::Sequence,
    trajectory::Trajectory,
};
use eframe::egui::{Color32, ColorImage, Id, TextureHandle, TextureOptions, Ui};
use glam::DVec2;

use super::footprint::{footprint, is_flat};
use crate::panes::ramp_color;

/// Points of the track.
const POINTS: u64 = 1000;
/// Pixels of the relief along a side.
const RELIEF_PX: usize = 128;
/// What the camera sees farther away does not make the map larger.
const FARTHEST_M: f64 = 5000.0;
/// Boxes of models, at most: more would cover the map.
const MOST_BOXES: usize = 1000;
/// The smallest map, metres along a side.
const SMALLEST_M: f64 = 2.0;

/// Found once a sequence.
#[derive(Clone)]
pub struct Chart {
    of: Key,
    /// North and east, metres, with the time after the first frame, seconds.
    pub track: Arc<Vec<(DVec2, f64)>>,
    /// South-west and north-east corner.
    pub bounds: [DVec2; 2],
    /// Heights by colour.
    pub relief: Option<TextureHandle>,
    /// Corners of patterns and boards, all around.
    pub flats: Arc<Vec<[DVec2; 4]>>,
    /// Boxes around parts of models: south-west and north-east corner.
    pub boxes: Arc<Vec<[DVec2; 2]>>,
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

/// The last one, or another for another sequence.
pub fn chart(ui: &Ui, sequence: &Sequence) -> Chart {
    let id = Id::unique("map chart");
    let of = Key::of(sequence);
    if let Some(chart) = ui.data(|data| data.get_temp::<Chart>(id)).filter(|chart| chart.of.is(&of)) {
        return chart;
    }
    let stamp_s = |frame: u64| sequence.start_s + frame as f64 / sequence.scenario.camera.fps;
    let last = sequence.frames.saturating_sub(1);
    let count = POINTS.min(last + 1).max(1);
    let frames = (0..count).map(|k| if count > 1 { (u128::from(k) * u128::from(last) / u128::from(count - 1)) as u64 } else { 0 });
    let place = |frame: u64| sequence.path.pose(stamp_s(frame)).position_ned_m.truncate();
    let track: Vec<(DVec2, f64)> = frames.map(|frame| (place(frame), stamp_s(frame) - stamp_s(0))).collect();
    let seen = CameraModel::from_spec(&sequence.scenario.camera).map_or_else(|_| Vec::new(), |camera| seen(sequence, &camera));
    let (flats, boxes) = things(&sequence.scene);
    let bounds = bounds(track.iter().map(|(ne, _)| *ne).chain(seen), flats.iter().map(around).chain(boxes.iter().copied()));
    let terrain = sequence.scene.terrain.as_ref();
    let relief = terrain.map(|terrain| ui.ctx().load_texture("relief", relief(terrain, bounds), TextureOptions::LINEAR));
    let chart = Chart { of, track: Arc::new(track), bounds, relief, flats: Arc::new(flats), boxes: Arc::new(boxes) };
    ui.data_mut(|data| data.insert_temp(id, chart.clone()));
    chart
}

/// Footprints along the flight.
fn seen(sequence: &Sequence, camera: &CameraModel) -> Vec<DVec2> {
    let last = sequence.frames.saturating_sub(1);
    let of = |k: u64| {
        let pose = sequence.path.pose(sequence.start_s + (last * k / 4) as f64 / sequence.scenario.camera.fps);
        let here = pose.position_ned_m.truncate();
        let runs = footprint(&sequence.scene, camera, &pose);
        runs.into_iter().flatten().map(move |ne| here + (ne - here).clamp_length_max(FARTHEST_M)).collect::<Vec<_>>()
    };
    (0..=4).flat_map(of).collect()
}

/// Patterns and boards by their corners, all else by boxes.
fn things(scene: &Scene) -> (Vec<[DVec2; 4]>, Vec<[DVec2; 2]>) {
    let corner = |mesh: &camsim_core::scene::Mesh, vertex: u32| mesh.position_ned_m(vertex).truncate();
    let flat = |mesh: &&camsim_core::scene::Mesh| is_flat(mesh) && mesh.shape.vertices.len() == 4;
    let flats = scene.meshes.iter().filter(flat).map(|mesh| [0, 1, 3, 2].map(|vertex| corner(mesh, vertex))).collect();
    let others: Vec<_> = scene.meshes.iter().filter(|mesh| !flat(mesh)).collect();
    let every = others.len().div_ceil(MOST_BOXES).max(1);
    let boxes = others.iter().step_by(every).map(|mesh| mesh.bounds()).filter(|bounds| !bounds.is_empty());
    (flats, boxes.map(|bounds| [bounds.min.truncate(), bounds.max.truncate()]).collect())
}

fn around(corners: &[DVec2; 4]) -> [DVec2; 2] {
    corners.iter().fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], corner| [low.min(*corner), high.max(*corner)])
}

/// A square around the track and what the camera sees, and around what stands near it; what it stands on may reach beyond.
fn bounds(points: impl Iterator<Item = DVec2>, things: impl Iterator<Item = [DVec2; 2]>) -> [DVec2; 2] {
    let (low, high) = points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), ne| (low.min(ne), high.max(ne)));
    if !low.is_finite() || !high.is_finite() {
        return [DVec2::splat(-1.0), DVec2::splat(1.0)];
    }
    let reach = (high - low).max_element().max(5.0);
    let limits = [low - reach, high + reach];
    let near = things.filter(|[from, to]| from.cmple(limits[1]).all() && to.cmpge(limits[0]).all());
    let small = near.filter(|[from, to]| !(from.cmple(low).all() && to.cmpge(high).all()));
    let (low, high) = small.fold((low, high), |(low, high), [from, to]| (low.min(from.max(limits[0])), high.max(to.min(limits[1]))));
    let half = 0.55 * (high - low).max_element().max(SMALLEST_M);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_map_has_what_stands_near_the_track_but_not_all_of_what_lies_below() {
        let track = || [DVec2::ZERO, DVec2::new(100.0, 40.0)].into_iter();
        let side = |bounds: [DVec2; 2]| (bounds[1] - bounds[0]).x;
        let alone = bounds(track(), std::iter::empty());
        assert!((side(alone) - 110.0).abs() < 1e-9);
        assert_eq!(bounds(track(), [[DVec2::splat(-3e3), DVec2::splat(3e3)]].into_iter()), alone, "a pattern below all of it");
        let house = [DVec2::new(150.0, 0.0), DVec2::new(160.0, 10.0)];
        let [low, high] = bounds(track(), [house].into_iter());
        assert!(low.cmple(DVec2::ZERO).all() && high.cmpge(DVec2::new(160.0, 40.0)).all(), "{low} {high}");
        assert_eq!(bounds(track(), [house.map(|corner| corner + 1e4)].into_iter()), alone, "far away");
        let room = bounds([DVec2::ZERO, DVec2::splat(0.5)].into_iter(), std::iter::empty());
        assert!((side(room) - 1.1 * SMALLEST_M).abs() < 1e-9, "rooms are maps too: {}", side(room));
    }
}
