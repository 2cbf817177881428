//! The light meter: what a coarse grid of points of a picture sees, by rays.
//!
//! Each point is in a cell of the metered window and looks through the camera's lens at the mid-exposure of its own
//! row. The points of a row or column of cells are not in line, so that a border which is parallel to the picture's
//! sides, as a horizon is, crosses them one by one. Texture is read all over the parallelogram that the cell covers
//! on a surface, which the neighbouring points tell: else a coarse grid on a rough texture would flicker.

use std::sync::Arc;

use glam::{DMat2, DVec2, DVec3};

use crate::{
    camera::{CameraError, CameraModel, ZoomTable},
    photometric::vignette_weights,
    pose::CameraPose,
    reference::{Hit, ReferenceRenderer, zoom_at},
    scenario::{AutoExposureSpec, MeterWeights},
    scene::LUMINANCE_F64,
    sequence::Sequence,
    shutter::Shutter,
};

/// Points of the grid.
const COLUMNS: usize = 24;
const ROWS: usize = 18;
/// Texture is read at so many positions along each side of a cell's parallelogram.
const READS: u32 = 4;
/// Least cosine between the normals of neighbouring points on one face of a mesh.
const SAME_FACE: f64 = 0.99;

/// The meter of a camera.
#[derive(Debug)]
pub(super) struct Meter {
    reference: ReferenceRenderer,
    lens: MeterLens,
    shutter: Shutter,
    points: Vec<MeterPoint>,
    /// Size of a cell.
    cell_px: DVec2,
}

/// The camera, or its table of zoom values.
#[derive(Debug)]
pub(super) enum MeterLens {
    Fixed(Box<CameraModel>),
    Zoom(ZoomTable),
}

impl MeterLens {
    pub fn new(sequence: &Sequence) -> Result<Self, CameraError> {
        let camera = &sequence.scenario.camera;
        Ok(match ZoomTable::from_spec(camera)? {
            Some(table) => Self::Zoom(table),
            None => Self::Fixed(Box::new(CameraModel::from_spec(camera)?)),
        })
    }
}

/// A point of the grid.
#[derive(Clone, Copy, Debug)]
struct MeterPoint {
    position_px: DVec2,
    /// The pixel that it is in: its row has the time.
    pixel: [u32; 2],
    /// Weight in the mean.
    weight: f64,
    /// Fraction of the light that the vignette leaves.
    vignette: f64,
}

/// Light of a picture: luminances at positions that have a ray, and their weights.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct MeteredLight {
    samples: Vec<[f32; 2]>,
}

impl MeteredLight {
    /// Mean of `min(gain * light, most)`; 0 where no position has a ray.
    pub fn level(&self, gain: f64, most: f64) -> f64 {
        let (mut sum, mut weights) = (0.0, 0.0);
        for [light, weight] in self.samples.iter().map(|sample| sample.map(f64::from)) {
            sum += weight * (gain * light).min(most);
            weights += weight;
        }
        if weights > 0.0 { sum / weights } else { 0.0 }
    }

    fn add(&mut self, color: DVec3, point: &MeterPoint, fraction: f64) {
        let light = point.vignette * DVec3::from_array(LUMINANCE_F64).dot(color);
        // What is no number is dark.
        let light = if light.is_finite() { light.max(0.0) } else { 0.0 };
        self.samples.push([light, point.weight * fraction].map(|value| value as f32));
    }
}

/// What a point sees.
struct Seen {
    ray_ned: DVec3,
    pose: CameraPose,
    t_s: f64,
    hit: Option<Hit>,
}

impl Meter {
    pub fn new(sequence: Arc<Sequence>, spec: &AutoExposureSpec, lens: MeterLens, shutter: Shutter) -> Self {
        let points = points(&sequence, spec);
        let [left, top, right, bottom] = spec.window;
        let cells = DVec2::new(COLUMNS as f64, ROWS as f64);
        let size_px = DVec2::from_array(sequence.scenario.camera.size_px.map(f64::from));
        let cell_px = DVec2::new(right - left, bottom - top) * size_px / cells;
        Self { reference: ReferenceRenderer::of_scene(sequence), lens, shutter, points, cell_px }
    }

    /// Light of the picture of a frame.
    pub fn light(&self, frame: u64) -> MeteredLight {
        let seen = self.seen(frame);
        let mut light = MeteredLight::default();
        for (i, here) in seen.iter().enumerate() {
            if let Some(here) = here {
                self.read(&mut light, here, &seen, i);
            }
        }
        light
    }

    /// What the points of a frame see; `None` without a ray.
    fn seen(&self, frame: u64) -> Vec<Option<Seen>> {
        let sequence = self.reference.sequence();
        let stamp_s = sequence.stamp_s(frame as f64);
        let zoomed = match &self.lens {
            MeterLens::Fixed(_) => None,
            MeterLens::Zoom(table) => table.at(zoom_at(&sequence.zoom_track, stamp_s)).ok(),
        };
        let camera = match &self.lens {
            MeterLens::Fixed(camera) => Some(&**camera),
            MeterLens::Zoom(_) => zoomed.as_ref(),
        };
        let mut last: Option<(f64, CameraPose)> = None;
        let see = |point: &MeterPoint| {
            let ray = camera?.ray(point.position_px)?;
            let [x, y] = point.pixel;
            let t_s = stamp_s + self.shutter.dt_pixel_s(x, y);
            let pose = match last {
                Some((of_s, pose)) if of_s == t_s => pose,
                _ => sequence.path.pose(t_s),
            };
            last = Some((t_s, pose));
            let ray_ned = pose.ned_from_camera * ray;
            Some(Seen { ray_ned, pose, t_s, hit: self.reference.lit(t_s, pose.position_ned_m, ray_ned) })
        };
        self.points.iter().map(see).collect()
    }

    /// Adds the light of the cell of point `i`.
    fn read(&self, light: &mut MeteredLight, here: &Seen, all: &[Option<Seen>], i: usize) {
        let point = &self.points[i];
        if self.reference.has_blended() {
            let color = self.reference.radiance_along(here.t_s, here.pose.position_ned_m, here.ray_ned, 1.0);
            return light.add(color, point, 1.0);
        }
        let sides = here.hit.and_then(|hit| Some((hit, self.sides(&hit, all, i)?)));
        let Some((hit, sides)) = sides else {
            return light.add(self.reference.light_of(here.hit.as_ref()), point, 1.0);
        };
        let position = |k: u32| (f64::from(k) + 0.5) / f64::from(READS) - 0.5;
        for j in 0..READS {
            for k in 0..READS {
                let uv = DVec2::from_array(hit.texture_uv) + sides * DVec2::new(position(k), position(j));
                let hit = Hit { texture_uv: uv.to_array(), ..hit };
                light.add(self.reference.light_of(Some(&hit)), point, 1.0 / f64::from(READS * READS));
            }
        }
    }

    /// Texture coordinates along both sides of the cell of point `i`, by its neighbours on the same face; `None`
    /// where it has none.
    fn sides(&self, hit: &Hit, all: &[Option<Seen>], i: usize) -> Option<DMat2> {
        let (column, row) = (i % COLUMNS, i / COLUMNS);
        let difference = |k: usize| {
            let other = all[k].as_ref()?.hit.as_ref()?;
            let is_near = other.surface == hit.surface
                && (hit.surface == 0 || other.normal_ned.dot(hit.normal_ned) > SAME_FACE);
            let uv = DVec2::from_array(other.texture_uv) - DVec2::from_array(hit.texture_uv);
            is_near.then(|| (uv, self.points[k].position_px - self.points[i].position_px))
        };
        let after = |step: usize, index: usize, count: usize| {
            let next = (index + 1 < count).then(|| difference(i + step)).flatten();
            next.or_else(|| (index > 0).then(|| difference(i - step)).flatten())
        };
        let ((uv_along, px_along), (uv_down, px_down)) =
            after(1, column, COLUMNS).zip(after(COLUMNS, row, ROWS))?;
        let uv_from_px = DMat2::from_cols(uv_along, uv_down) * DMat2::from_cols(px_along, px_down).inverse();
        let sides = uv_from_px * DMat2::from_diagonal(self.cell_px);
        sides.is_finite().then_some(sides)
    }
}

/// Positions of the points of neighbouring cells within them, -0.5 to 0.5: multiples of the golden ratio's fraction.
fn spread(k: usize) -> f64 {
    (k as f64 * 0.618_033_988_749_894_9 + 0.5).fract() - 0.5
}

/// The grid over the metered window.
fn points(sequence: &Sequence, spec: &AutoExposureSpec) -> Vec<MeterPoint> {
    let camera = &sequence.scenario.camera;
    let [width, height] = camera.size_px;
    let [left, top, right, bottom] = spec.window;
    let vignette = sequence
        .vignette
        .as_ref()
        .map(|map| vignette_weights(map, camera.size_px, camera.photometric.vignette_thresholds));
    let cells = (0..ROWS).flat_map(|row| (0..COLUMNS).map(move |column| [column, row]));
    cells
        .map(|[column, row]| {
            let in_cell = DVec2::new(spread(row), spread(column)) + 0.5;
            let fraction =
                (DVec2::new(column as f64, row as f64) + in_cell) / DVec2::new(COLUMNS as f64, ROWS as f64);
            let from_middle = (fraction - 0.5) / 0.25;
            let in_picture = DVec2::new(left, top) + fraction * DVec2::new(right - left, bottom - top);
            let position_px = in_picture * DVec2::new(f64::from(width), f64::from(height)) - 0.5;
            let [x, y] = position_px.round().to_array().map(|px| px.max(0.0) as u32);
            let pixel = [x.min(width.saturating_sub(1)), y.min(height.saturating_sub(1))];
            let of_pixel = |weights: &Vec<f32>| {
                weights.get((pixel[1] * width + pixel[0]) as usize).copied().map_or(1.0, f64::from)
            };
            MeterPoint {
                position_px,
                pixel,
                weight: match spec.weights {
                    MeterWeights::Even => 1.0,
                    MeterWeights::Centre => (-0.5 * from_middle.length_squared()).exp(),
                },
                vignette: vignette.as_ref().map_or(1.0, of_pixel),
            }
        })
        .collect()
}
