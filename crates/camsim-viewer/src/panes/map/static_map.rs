//! The part of the map that all frames share: track, relief, boards and models.

use std::{
    collections::BTreeMap,
    sync::{Arc, Weak},
};

use camsim_core::{
    camera::CameraModel,
    flight_log::FlightLog,
    scene::{Aabb, Mesh, RigidMotion, Scene, Terrain},
    sequence::Sequence,
    trajectory::Trajectory,
};
use camsim_io::load::Loaded;
use eframe::egui::{Color32, ColorImage, Id, TextureHandle, TextureOptions, Ui};
use glam::{DVec2, DVec3};

use super::footprint::{footprint, is_flat};
use crate::panes::ramp_color;

/// Points of the track, at most.
const TRACK_POINTS: u64 = 1000;
/// Rows of the log, at most.
const MAX_ROWS: usize = 600;
/// Pixels of the relief along a side.
const RELIEF_PX: usize = 128;
/// Distance, metres, beyond which a footprint does not enlarge the map.
const MAX_VIEW_M: f64 = 5000.0;
/// Bounding boxes of models, at most: more would cover the map.
const MAX_BOXES: usize = 1000;
/// Least side of the map, metres.
const MIN_SIDE_M: f64 = 2.0;

/// Computed once per sequence.
#[derive(Clone)]
pub struct StaticMap {
    key: MapKey,
    /// Path of the camera, NED, with time after frame 0, seconds.
    pub track: Arc<Vec<(DVec3, f64)>>,
    /// Path of the platform, NED.
    pub flown: Arc<Vec<DVec3>>,
    /// Positions of log rows within the window, NED; at most [`MAX_ROWS`].
    pub log: Arc<Vec<DVec3>>,
    /// South-west and north-east corner, north and east metres.
    pub bounds: [DVec2; 2],
    /// Shaded relief; `None` without terrain.
    pub relief: Option<TextureHandle>,
    /// Corners of patterns and boards, NED, in circular order.
    pub flats: Arc<Vec<[DVec3; 4]>>,
    /// Bounding boxes of meshes of models, NED: least and largest coordinates.
    pub boxes: Arc<Vec<[DVec3; 2]>>,
    movers: Arc<Vec<Mover>>,
}

/// What the map depends on; not the camera, so that dragging its parameters keeps the map.
#[derive(Clone)]
struct MapKey {
    scene: Weak<Scene>,
    trajectory: Weak<Trajectory>,
    start_s: f64,
    seconds: f64,
}

impl MapKey {
    fn new(sequence: &Sequence) -> Self {
        Self {
            scene: Arc::downgrade(&sequence.scene),
            trajectory: Arc::downgrade(&sequence.path.trajectory),
            start_s: sequence.start_s,
            seconds: sequence.frames as f64 / sequence.scenario.camera.fps,
        }
    }

    fn equals(&self, other: &Self) -> bool {
        self.scene.ptr_eq(&other.scene)
            && self.trajectory.ptr_eq(&other.trajectory)
            && (self.start_s, self.seconds) == (other.start_s, other.seconds)
    }
}

/// The cached map, or a new one for another sequence.
pub fn static_map(ui: &Ui, loaded: &Loaded) -> StaticMap {
    let sequence = &*loaded.sequence;
    let id = Id::unique("map chart");
    let key = MapKey::new(sequence);
    if let Some(map) = ui.data(|data| data.get_temp::<StaticMap>(id)).filter(|map| map.key.equals(&key)) {
        return map;
    }
    let stamp_s = |frame: u64| sequence.start_s + frame as f64 / sequence.scenario.camera.fps;
    let last = sequence.frames.saturating_sub(1);
    let count = TRACK_POINTS.min(last + 1).max(1);
    let frames = (0..count).map(|k| {
        if count > 1 { (u128::from(k) * u128::from(last) / u128::from(count - 1)) as u64 } else { 0 }
    });
    let position_ned_m = |frame: u64| sequence.path.pose(stamp_s(frame)).position_ned_m;
    let flown =
        frames.clone().map(|frame| sequence.path.trajectory.state(stamp_s(frame)).position_ned_m).collect();
    let track: Vec<(DVec3, f64)> =
        frames.map(|frame| (position_ned_m(frame), stamp_s(frame) - stamp_s(0))).collect();
    let footprints = CameraModel::from_spec(&sequence.scenario.camera)
        .map_or_else(|_| Vec::new(), |camera| footprint_points(sequence, &camera));
    let (flats, boxes) = objects(&sequence.scene);
    let movers = movers(&sequence.scene);
    let from_above = |corners: &[DVec3; 2]| corners.map(DVec3::truncate);
    let moving_rects = moving(&sequence.scene, &movers, sequence.start_s)
        .into_iter()
        .map(|thing| from_above(&thing.corners));
    let bounds = bounds(
        track.iter().map(|(ned, _)| ned.truncate()).chain(footprints),
        flats.iter().map(bounding_rect).chain(boxes.iter().map(from_above)).chain(moving_rects),
    );
    let terrain = sequence.scene.terrain.as_ref();
    let relief = terrain
        .map(|terrain| ui.ctx().load_texture("relief", relief(terrain, bounds), TextureOptions::LINEAR));
    let map = StaticMap {
        key,
        track: Arc::new(track),
        flown: Arc::new(flown),
        log: Arc::new(rows(&loaded.log, [stamp_s(0), stamp_s(last)])),
        bounds,
        relief,
        flats: Arc::new(flats),
        boxes: Arc::new(boxes),
        movers: Arc::new(movers),
    };
    ui.data_mut(|data| data.insert_temp(id, map.clone()));
    map
}

/// Points of footprints along the flight, north and east metres.
fn footprint_points(sequence: &Sequence, camera: &CameraModel) -> Vec<DVec2> {
    let last = sequence.frames.saturating_sub(1);
    let points = |k: u64| {
        let pose =
            sequence.path.pose(sequence.start_s + (last * k / 4) as f64 / sequence.scenario.camera.fps);
        let here = pose.position_ned_m.truncate();
        let runs = footprint(&sequence.scene, camera, &pose);
        runs.into_iter()
            .flatten()
            .map(move |ned| here + (ned.truncate() - here).clamp_length_max(MAX_VIEW_M))
            .collect::<Vec<_>>()
    };
    (0..=4).flat_map(points).collect()
}

/// Corners of patterns and boards, and bounding boxes of all other meshes that stand still.
fn objects(scene: &Scene) -> (Vec<[DVec3; 4]>, Vec<[DVec3; 2]>) {
    let flats = flats(scene).map(|mesh| [0, 1, 3, 2].map(|vertex| mesh.position_ned_m(vertex))).collect();
    let others: Vec<_> = scene.meshes.iter().filter(|mesh| !is_quad(mesh) && mesh.motion.is_none()).collect();
    let every = others.len().div_ceil(MAX_BOXES).max(1);
    let boxes = others.iter().step_by(every).map(|mesh| mesh.bounds()).filter(|bounds| !bounds.is_empty());
    (flats, boxes.map(|bounds| [bounds.min, bounds.max]).collect())
}

/// An object that moves, at one instant.
pub struct MovingThing {
    /// Name of the object.
    pub name: String,
    /// Least and largest coordinates, NED metres.
    pub corners: [DVec3; 2],
}

impl MovingThing {
    /// Middle of the box, NED metres.
    pub fn middle_ned_m(&self) -> DVec3 {
        0.5 * (self.corners[0] + self.corners[1])
    }
}

/// A mesh that moves, with its object's number and its box at path time 0.
type Mover = (u32, Arc<RigidMotion>, Aabb);

fn movers(scene: &Scene) -> Vec<Mover> {
    let mover = |mesh: &Mesh| Some((mesh.object, mesh.motion.clone()?, mesh.bounds()));
    scene.meshes.iter().filter_map(mover).filter(|(.., bounds)| !bounds.is_empty()).collect()
}

/// The objects that move, where they are at a path time; at most [`MAX_BOXES`].
fn moving(scene: &Scene, movers: &[Mover], t_s: f64) -> Vec<MovingThing> {
    let mut corners: BTreeMap<u32, [DVec3; 2]> = BTreeMap::new();
    for (object, motion, bounds) in movers {
        let bounds = motion.bounds(bounds, t_s, t_s);
        let hull = corners.entry(*object).or_insert([bounds.min, bounds.max]);
        *hull = [hull[0].min(bounds.min), hull[1].max(bounds.max)];
    }
    let named = corners.into_iter().take(MAX_BOXES).map(|(number, corners)| {
        let object = number.checked_sub(1).and_then(|index| scene.objects.get(index as usize));
        let name = object.map(|object| object.name.clone()).filter(|name| !name.is_empty());
        MovingThing { name: name.unwrap_or_else(|| format!("object {number}")), corners }
    });
    named.collect()
}

impl StaticMap {
    /// The objects that move, where they are at a path time; at most [`MAX_BOXES`].
    pub fn moving(&self, scene: &Scene, t_s: f64) -> Vec<MovingThing> {
        moving(scene, &self.movers, t_s)
    }
}

/// Meshes of patterns and boards, whose vertices are row-major corners.
pub fn flats(scene: &Scene) -> impl Iterator<Item = &Mesh> {
    scene.meshes.iter().filter(|mesh| is_quad(mesh))
}

fn is_quad(mesh: &Mesh) -> bool {
    is_flat(mesh) && mesh.shape.vertices.len() == 4
}

/// Positions of log rows in a span, with the row on either side.
fn rows(log: &FlightLog, [from_s, to_s]: [f64; 2]) -> Vec<DVec3> {
    let first = log.rows.partition_point(|row| row.t_s < from_s).saturating_sub(1);
    let end = (log.rows.partition_point(|row| row.t_s <= to_s) + 1).min(log.rows.len());
    let within = log.rows.get(first..end).unwrap_or_default();
    within.iter().step_by(within.len().div_ceil(MAX_ROWS).max(1)).map(|row| row.position_ned_m).collect()
}

/// Bounding rectangle of corners, north and east metres.
fn bounding_rect(corners: &[DVec3; 4]) -> [DVec2; 2] {
    let from_above = corners.map(DVec3::truncate);
    from_above.iter().fold([DVec2::INFINITY, DVec2::NEG_INFINITY], |[low, high], corner| {
        [low.min(*corner), high.max(*corner)]
    })
}

/// A square around `points` and near objects; objects that contain all points do not enlarge it.
fn bounds(points: impl Iterator<Item = DVec2>, objects: impl Iterator<Item = [DVec2; 2]>) -> [DVec2; 2] {
    let (low, high) =
        points.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), ne| (low.min(ne), high.max(ne)));
    if !low.is_finite() || !high.is_finite() {
        return [DVec2::splat(-1.0), DVec2::splat(1.0)];
    }
    let reach = (high - low).max_element().max(5.0);
    let limits = [low - reach, high + reach];
    let near = objects.filter(|[from, to]| from.cmple(limits[1]).all() && to.cmpge(limits[0]).all());
    let small = near.filter(|[from, to]| !(from.cmple(low).all() && to.cmpge(high).all()));
    let (low, high) = small.fold((low, high), |(low, high), [from, to]| {
        (low.min(from.max(limits[0])), high.max(to.min(limits[1])))
    });
    let half = 0.55 * (high - low).max_element().max(MIN_SIDE_M);
    let middle = 0.5 * (low + high);
    [middle - half, middle + half]
}

/// Heights in colours, lit from the north-west.
fn relief(terrain: &Terrain, [low, high]: [DVec2; 2]) -> ColorImage {
    let height_m = |x: usize, y: usize| {
        let fraction =
            DVec2::new(1.0 - (y as f64 + 0.5) / RELIEF_PX as f64, (x as f64 + 0.5) / RELIEF_PX as f64);
        let ne = low + fraction * (high - low);
        terrain.down_at(ne.x, ne.y).map(|down_m| -down_m)
    };
    let heights: Vec<Option<f64>> =
        (0..RELIEF_PX * RELIEF_PX).map(|i| height_m(i % RELIEF_PX, i / RELIEF_PX)).collect();
    let known = || heights.iter().flatten();
    let (lowest, highest) =
        known().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), h| (a.min(*h), b.max(*h)));
    let step_m = (high.x - low.x) / RELIEF_PX as f64;
    let pixels = (0..heights.len()).map(|i| {
        let Some(height) = heights[i] else { return Color32::from_gray(40) };
        let slope = |other: Option<usize>| {
            other
                .and_then(|i| heights.get(i).copied().flatten())
                .map_or(0.0, |neighbour| (height - neighbour) / step_m)
        };
        let light =
            0.75 + 0.35 * (slope(i.checked_sub(RELIEF_PX)) + slope(i.checked_sub(1))).clamp(-1.0, 1.0);
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
    fn bounds_include_near_objects_but_not_large_ground() {
        let track = || [DVec2::ZERO, DVec2::new(100.0, 40.0)].into_iter();
        let side = |bounds: [DVec2; 2]| (bounds[1] - bounds[0]).x;
        let alone = bounds(track(), std::iter::empty());
        assert!((side(alone) - 110.0).abs() < 1e-9);
        assert_eq!(
            bounds(track(), [[DVec2::splat(-3e3), DVec2::splat(3e3)]].into_iter()),
            alone,
            "a pattern below the whole track"
        );
        let house = [DVec2::new(150.0, 0.0), DVec2::new(160.0, 10.0)];
        let [low, high] = bounds(track(), [house].into_iter());
        assert!(low.cmple(DVec2::ZERO).all() && high.cmpge(DVec2::new(160.0, 40.0)).all(), "{low} {high}");
        assert_eq!(bounds(track(), [house.map(|corner| corner + 1e4)].into_iter()), alone, "far away");
        let room = bounds([DVec2::ZERO, DVec2::splat(0.5)].into_iter(), std::iter::empty());
        assert!((side(room) - 1.1 * MIN_SIDE_M).abs() < 1e-9, "least side: {}", side(room));
    }
}
