//! The light meter: what a coarse grid of points of a picture sees, by rays.
//!
//! Each point is in the middle of a cell of the metered window and looks through the camera's lens at the
//! mid-exposure of its own row. The texture is averaged over the parallelogram that the cell covers on a surface,
//! which the neighbouring points tell; without this, a coarse grid on a rough texture would flicker.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::{
    camera::{CameraError, CameraModel, ZoomTable},
    photometric::vignette_weights,
    pose::CameraPose,
    reference::{Hit, Oracle, zoom_at},
    scenario::{AutoExposureSpec, MeterWeights},
    sequence::Sequence,
    shutter::Shutter,
};

/// Points of the grid.
const COLUMNS: usize = 24;
const ROWS: usize = 18;
/// Texture is read at so many places along each side of a cell.
const READS: u32 = 4;
/// Least cosine between the normals of neighbouring points on one face of a mesh.
const SAME_FACE: f64 = 0.99;
/// Rec. 709.
const LUMINANCE: DVec3 = DVec3::new(0.2126, 0.7152, 0.0722);

/// The meter of a camera.
#[derive(Debug)]
pub(super) struct Meter {
    oracle: Oracle,
    lens: MeterLens,
    shutter: Shutter,
    points: Vec<MeterPoint>,
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
    /// Share of the light that the vignette leaves.
    vignette: f64,
}

/// Light at the points of a picture that have a ray: luminance and weight.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MeteredLight {
    points: Vec<[f64; 2]>,
    weight: f64,
}

impl MeteredLight {
    /// Mean of `min(gain * light, most)`; 0 where no point has a ray.
    pub fn level(&self, gain: f64, most: f64) -> f64 {
        let sum: f64 = self.points.iter().map(|[light, weight]| weight * (gain * light).min(most)).sum();
        if self.weight > 0.0 { sum / self.weight } else { 0.0 }
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
        Self { oracle: Oracle::of_scene(sequence), lens, shutter, points }
    }

    /// Light of the picture of a frame.
    pub fn light(&self, frame: u64) -> MeteredLight {
        let seen = self.seen(frame);
        let mut light = MeteredLight { points: Vec::with_capacity(seen.len()), weight: 0.0 };
        for (i, (point, here)) in self.points.iter().zip(&seen).enumerate() {
            let Some(here) = here else { continue };
            let luminance = LUMINANCE.dot(self.color(here, &seen, i)).max(0.0);
            // A scene without numbers is dark.
            let luminance = if luminance.is_finite() { luminance } else { 0.0 };
            light.points.push([point.vignette * luminance, point.weight]);
            light.weight += point.weight;
        }
        light
    }

    /// What the points of a frame see; `None` without a ray.
    fn seen(&self, frame: u64) -> Vec<Option<Seen>> {
        let sequence = self.oracle.sequence();
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
            Some(Seen { ray_ned, pose, t_s, hit: self.oracle.lit(t_s, pose.position_ned_m, ray_ned) })
        };
        self.points.iter().map(see).collect()
    }

    /// Mean colour of the cell of point `i`.
    fn color(&self, here: &Seen, all: &[Option<Seen>], i: usize) -> DVec3 {
        if self.oracle.has_blended() {
            return self.oracle.radiance_along(here.t_s, here.pose.position_ned_m, here.ray_ned, 1.0);
        }
        let Some(hit) = here.hit else { return self.oracle.light_of(None) };
        let (column, row) = (i % COLUMNS, i / COLUMNS);
        let along = side(&hit, all, [i + 1, i.wrapping_sub(1)], [column + 1 < COLUMNS, column > 0]);
        let down = side(&hit, all, [i + COLUMNS, i.wrapping_sub(COLUMNS)], [row + 1 < ROWS, row > 0]);
        let (Some(along), Some(down)) = (along, down) else { return self.oracle.light_of(Some(&hit)) };
        let place = |k: u32| (f64::from(k) + 0.5) / f64::from(READS) - 0.5;
        let mut sum = DVec3::ZERO;
        for j in 0..READS {
            for k in 0..READS {
                let uv = DVec2::from_array(hit.texture_uv) + place(k) * along + place(j) * down;
                sum += self.oracle.light_of(Some(&Hit { texture_uv: uv.to_array(), ..hit }));
            }
        }
        sum / f64::from(READS * READS)
    }
}

/// Texture coordinates along a side of a cell, from the point after it or before it, whichever sees the same
/// face.
fn side(hit: &Hit, all: &[Option<Seen>], others: [usize; 2], exist: [bool; 2]) -> Option<DVec2> {
    let uv = |hit: &Hit| DVec2::from_array(hit.texture_uv);
    let is_near = |other: &Hit| {
        other.surface == hit.surface && (hit.surface == 0 || other.normal_ned.dot(hit.normal_ned) > SAME_FACE)
    };
    let of = |k: usize| {
        let seen = all.get(others[k]).filter(|_| exist[k])?.as_ref()?;
        seen.hit.as_ref().filter(|other| is_near(other))
    };
    of(0).map(|after| uv(after) - uv(hit)).or_else(|| of(1).map(|before| uv(hit) - uv(before)))
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
            let share =
                DVec2::new((column as f64 + 0.5) / COLUMNS as f64, (row as f64 + 0.5) / ROWS as f64);
            let from_middle = (share - 0.5) / 0.25;
            let in_picture = DVec2::new(left, top) + share * DVec2::new(right - left, bottom - top);
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
