//! Lamps that are small in the picture, by rays of their own.
//!
//! An ideal frame shows a surface where the centres of its pixels, or their samples, meet it: a lamp of half a pixel
//! in one picture of four, and then with four times its light. What is brighter than white makes that seen,
//! however small it is. So pixels that a small lamp may reach in their exposure are replaced by means over area
//! and exposure: of thousands of rays those are cast that pass within the lamp's sphere, and a few others
//! for what is beside it.

use std::sync::{Arc, LazyLock};

use camsim_core::{
    mount::CameraPath,
    noise::pcg4d,
    photometric::Photometry,
    scenario::Preset,
    scene::{Mesh, RigidMotion},
    sequence::Sequence,
};
use camsim_cpu::{Instant, MovingCaster, RayScratch};
use camsim_plan::FramePlan;
use glam::{DMat2, DVec2, DVec3, Vec3};

use super::{
    outline::{self, Swept},
    painter::{Painted, Painter, index},
};
use crate::{
    cancel::Cancel,
    truth::{RAYS, ray},
};

/// Longest side of the box, in the picture, of a lamp that gets rays of its own, pixels. Of larger ones the
/// borders are a small part.
pub const SMALL_LAMP_PX: f64 = 16.0;
/// Rays that are to pass a lamp, and most of a pixel: of a lamp of half a pixel a quarter passes it, 16 at each
/// instant.
const RAYS_OF_LAMP: f64 = 4096.0;
const MOST_RAYS: u32 = 16_384;
/// Rays that show first whether all is alike beside a lamp, how many of them must, and by how much.
const FIRST_RAYS: u32 = 16;
const FIRST_BESIDE: u32 = 8;
const ALIKE: f32 = 1.0 / 255.0;
/// Instants of an exposure; several rays share one.
const INSTANTS: u32 = 256;
/// How far beyond its borders an ideal frame may show a surface, ideal pixels, and beyond that in the picture.
const IDEAL_ROOM_PX: f64 = 1.5;
const ROOM_PX: f64 = 1.0;
/// Least fraction of an ideal pixel that is allowed for, per pixel.
const LEAST_SCALE: f64 = 0.25;

/// The lamps of a sequence: meshes that emit light above white.
#[derive(Debug)]
pub(crate) struct Lamps {
    painter: Painter,
    numbers: Vec<usize>,
}

/// A lamp that is small in a frame.
struct Small<'a> {
    mesh: &'a Mesh,
    swept: Swept,
    /// Rays of a pixel: a power of two.
    rays: u32,
}

/// The sphere about a lamp in a camera's axes.
#[derive(Clone, Copy)]
struct Sphere {
    centre_m: DVec3,
    radius_m: f64,
}

/// A row of the readout, with the lamps that it may see.
struct Line<'a> {
    number: usize,
    /// With the first and last pixels along it between which each may be.
    lamps: Vec<(&'a Small<'a>, Vec<[u32; 2]>)>,
    /// Of all lamps.
    spans: Vec<[u32; 2]>,
}

/// What the pixels of a row share.
struct Job<'a> {
    caster: &'a MovingCaster,
    plan: &'a FramePlan,
    line: &'a Line<'a>,
    instants: Vec<Instant>,
    /// Of each instant, those of all lamps.
    spheres: Vec<Vec<Sphere>>,
}

impl Lamps {
    /// `None` without any, and with the paper's methods. `before` has the scene of an earlier sequence.
    pub fn new(sequence: &Arc<Sequence>, before: Option<&Self>) -> Option<Self> {
        let numbers: Vec<usize> = sequence.scene.lamps().collect();
        let is_paper = sequence.scenario.quality.preset == Preset::Paper;
        (!numbers.is_empty() && !is_paper)
            .then(|| Self { painter: Painter::new(sequence, before.map(|before| &before.painter)), numbers })
    }

    /// Replaces the colours of the pixels that small lamps may reach: linear R G B A, row-major.
    pub fn paint(&self, color_rgba: &mut [f32], plan: &FramePlan, cancel: &Cancel) {
        let Sequence { scene, path, .. } = &*self.painter.sequence;
        let meshes = self.numbers.iter().map(|&number| &scene.meshes[number]);
        let small: Vec<Small<'_>> = meshes.filter_map(|mesh| self.small(plan, mesh)).collect();
        let lines = (0..super::line_count(plan)).filter_map(|number| {
            let (mut lamps, mut spans) = (Vec::new(), Vec::new());
            for lamp in small.iter().filter(|lamp| lamp.swept.may_be_in(plan, number)) {
                let own = lamp.swept.spans(path, plan, number);
                if !own.is_empty() {
                    spans.extend(&own);
                    lamps.push((lamp, own));
                }
            }
            spans.sort_unstable();
            let spans = outline::merged(&spans);
            (!spans.is_empty()).then_some(Line { number, lamps, spans })
        });
        let lines: Vec<Line<'_>> = lines.collect();
        if lines.is_empty() {
            return;
        }
        // Made here: nothing waits for it within the loop.
        let caster = self.painter.caster();
        Painter::paint(color_rgba, lines, cancel, |line, before| self.line(caster, plan, &line, before));
    }

    /// A lamp, if it is small in a frame and in view.
    fn small<'a>(&self, plan: &FramePlan, mesh: &'a Mesh) -> Option<Small<'a>> {
        let path = &self.painter.sequence.path;
        let [begin_s, end_s] = plan.window_s;
        let mid_s = 0.5 * (begin_s + end_s);
        let [width_px, height_px] =
            outline::size_px(plan, &[(mid_s, path.pose(mid_s))], &mesh.bounds_between(mid_s, mid_s))?;
        if width_px.max(height_px) > SMALL_LAMP_PX {
            return None;
        }
        let motion = mesh.motion.clone().unwrap_or_else(|| Arc::new(RigidMotion::new(Vec::new())));
        let swept = Swept::new(motion, mesh.bounds(), vec![[DVec3::ZERO; 2]], room_px(plan) + ROOM_PX);
        let swept = swept.in_view(path, plan)?.within_lines(path, plan);
        let wanted = (RAYS_OF_LAMP / (width_px * height_px)).clamp(f64::from(RAYS), f64::from(MOST_RAYS));
        let rays = (wanted as u32).next_power_of_two();
        Some(Small { mesh, swept, rays })
    }

    /// Colours of the pixels of a row of the readout that small lamps may reach.
    fn line(
        &self,
        caster: &MovingCaster,
        plan: &FramePlan,
        line: &Line<'_>,
        color_rgba: &[f32],
    ) -> Vec<Painted> {
        let along = line.spans.iter().flat_map(|&[first, last]| first..=last);
        let pixels = along.map(|along| (along, outline::pixel(plan, line.number, along)));
        let pixels: Vec<(u32, [u32; 2])> =
            pixels.filter(|&(_, pixel)| color_rgba[4 * index(plan, pixel) + 3] > 0.0).collect();
        let Some(&(_, first)) = pixels.first() else { return Vec::new() };
        let job = Job::new(caster, &self.painter.sequence.path, plan, (line, first));
        let stage = Photometry::new(&self.painter.sequence.scenario.camera, plan.exposure.as_ref());
        let mut scratch = RayScratch::default();
        let color = |(along, pixel)| {
            let light = job.light(along, pixel, &mut scratch)?;
            Some(self.painter.finished(&stage, plan, pixel, light))
        };
        pixels.into_iter().filter_map(color).collect()
    }
}

impl<'a> Job<'a> {
    /// For the lamps and the first pixel of a row.
    fn new(
        caster: &'a MovingCaster,
        path: &CameraPath,
        plan: &'a FramePlan,
        (line, [x, y]): (&'a Line<'a>, [u32; 2]),
    ) -> Self {
        let rays = line.lamps.iter().map(|(lamp, _)| lamp.rays).max().unwrap_or(RAYS);
        let mid_s = plan.stamp_s + plan.shutter.dt_pixel_s(x, y);
        let exposure_s = plan.shutter.exposure_pixel_s(x, y);
        let count = if exposure_s > 0.0 { INSTANTS.min(rays) } else { 1 };
        let (mut instants, mut spheres) = (Vec::new(), Vec::new());
        for k in 0..count {
            let t_s = mid_s + ((f64::from(k) + 0.5) / f64::from(count) - 0.5) * exposure_s;
            let pose = path.pose(t_s);
            let sphere = |(lamp, _): &(&Small<'_>, Vec<[u32; 2]>)| {
                let bounds = lamp.mesh.bounds_between(t_s, t_s);
                Sphere {
                    centre_m: pose.ned_from_camera.conjugate() * (bounds.centre() - pose.position_ned_m),
                    radius_m: 0.5 * (bounds.max - bounds.min).length(),
                }
            };
            spheres.push(line.lamps.iter().map(sphere).collect());
            instants.push(caster.at(t_s, pose));
        }
        Self { caster, plan, line, instants, spheres }
    }

    /// Mean light over the area and exposure of a pixel, whose position along the row is stated; `None` if no
    /// lamp comes near.
    fn light(&self, along: u32, pixel: [u32; 2], scratch: &mut RayScratch) -> Option<Vec3> {
        let camera = &self.plan.camera;
        let uv = camera.unproject(DVec2::from_array(pixel.map(f64::from)))?;
        let uv_from_px = (DMat2::from_diagonal(camera.focal_px) * camera.lens.jacobian(uv)).inverse();
        let half = 0.5 * (uv_from_px.x_axis.abs() + uv_from_px.y_axis.abs()).length();
        let room = half * (1.0 + 2.0 * room_px(self.plan));
        let is_in = |spans: &[[u32; 2]]| spans.iter().any(|&[first, last]| (first..=last).contains(&along));
        let lamps = self.line.lamps.iter().enumerate().filter(|(_, (_, spans))| is_in(spans));
        let (lamps, rays): (Vec<usize>, Vec<u32>) = lamps.map(|(i, (lamp, _))| (i, lamp.rays)).unzip();
        let rays = rays.into_iter().max()? as usize;
        let within = |k: usize, uv, room| lamps.iter().any(|&i| self.spheres[k][i].is_within(uv, room));
        let count = self.instants.len();
        let near: Vec<usize> = (0..count).filter(|&k| within(k, uv, room)).collect();
        if near.is_empty() {
            return None;
        }
        let mut pixel = Pixel { job: self, uv, uv_from_px, scratch };
        let (mut of_lamps, mut passing) = (Vec3::ZERO, 0_u32);
        for k in near {
            let shift = shift(k);
            for i in (k * rays).div_ceil(count)..((k + 1) * rays).div_ceil(count) {
                let position = POSITIONS[i] + shift;
                let position = position - (position + 0.5).floor();
                if within(k, uv + uv_from_px * position, 0.0) {
                    of_lamps += pixel.cast(k, position);
                    passing += 1;
                }
            }
        }
        Some(match pixel.beside(|k, uv| !within(k, uv, 0.0)) {
            None => of_lamps / passing.max(1) as f32,
            Some(beside) => {
                let fraction = passing as f32 / rays as f32;
                of_lamps / rays as f32 + (1.0 - fraction) * beside
            }
        })
    }
}

/// A pixel that is cast.
struct Pixel<'a> {
    job: &'a Job<'a>,
    uv: DVec2,
    uv_from_px: DMat2,
    scratch: &'a mut RayScratch,
}

impl Pixel<'_> {
    /// Linear R G B at an instant and a position in the pixel.
    fn cast(&mut self, k: usize, position: DVec2) -> Vec3 {
        // Each ray stands for its part of the pixel's area.
        let sides = DVec2::new(self.uv_from_px.row(0).length(), self.uv_from_px.row(1).length());
        let step_uv = sides / f64::from(RAYS).sqrt();
        let Job { caster, plan, instants, .. } = self.job;
        let uv = self.uv + self.uv_from_px * position;
        caster.color(&instants[k], uv, step_uv, plan.surface_reads, self.scratch)
    }

    /// Mean of the rays that are beside all lamps; `None` without any. Few will do where they are alike.
    fn beside(&mut self, is_beside: impl Fn(usize, DVec2) -> bool) -> Option<Vec3> {
        let mut mean = |rays: &mut dyn Iterator<Item = (DVec2, f64)>| {
            let count = self.job.instants.len();
            let (mut sum, mut low, mut high) = (Vec3::ZERO, Vec3::INFINITY, Vec3::NEG_INFINITY);
            let mut cast = 0_u32;
            for (position, phase) in rays {
                let k = (((phase + 0.5) * count as f64) as usize).min(count - 1);
                if is_beside(k, self.uv + self.uv_from_px * position) {
                    let color = self.cast(k, position);
                    (sum, low, high) = (sum + color, low.min(color), high.max(color));
                    cast += 1;
                }
            }
            (sum / cast.max(1) as f32, (high - low).max_element(), cast)
        };
        let phase = |i: u32| f64::from(11 * i % FIRST_RAYS) / f64::from(FIRST_RAYS) - 0.5;
        let first = &mut (0..FIRST_RAYS).map(|i| (POSITIONS[i as usize], phase(i)));
        let (color, spread, cast) = mean(first);
        if cast >= FIRST_BESIDE && spread < ALIKE {
            return Some(color);
        }
        let (color, _, cast) = mean(&mut (0..RAYS).map(ray));
        (cast > 0).then_some(color)
    }
}

impl Sphere {
    /// Whether the ray (u, v, 1) passes within it, or within `room` of it at the distance 1 along the axis.
    fn is_within(&self, uv: DVec2, room: f64) -> bool {
        let ray = uv.extend(1.0);
        let radius_m = self.radius_m + room * self.centre_m.length();
        self.centre_m.dot(ray) > -radius_m * ray.length()
            && self.centre_m.cross(ray).length_squared() <= radius_m * radius_m * ray.length_squared()
    }
}

/// How far beyond a lamp the renderer's picture may show it, pixels.
fn room_px(plan: &FramePlan) -> f64 {
    IDEAL_ROOM_PX / plan.ideal.scale(&plan.camera).max(LEAST_SCALE)
}

/// What the positions of an instant are shifted by, so that a lamp's steps from instant to instant do not beat
/// with them.
fn shift(instant: usize) -> DVec2 {
    let [x, y, ..] = pcg4d([instant as u32, 0, 0, 0]);
    DVec2::new(f64::from(x >> 8), f64::from(y >> 8)) / 2.0_f64.powi(24)
}

/// [`position`] of every ray.
static POSITIONS: LazyLock<Vec<DVec2>> = LazyLock::new(|| (0..MOST_RAYS).map(position).collect());

/// Position of ray i in its pixel, -0.5 to 0.5: the first two coordinates of Sobol's sequence. Any 2^k consecutive
/// ones from a multiple of it are a net: every box with sides of 2^-a and 2^-b, a + b = k, has one.
fn position(i: u32) -> DVec2 {
    let mut direction = 1_u32 << 31;
    let mut second = 0;
    for bit in 0..u32::BITS - i.leading_zeros() {
        if i >> bit & 1 == 1 {
            second ^= direction;
        }
        direction ^= direction >> 1;
    }
    let unit = |bits: u32| (f64::from(bits) + 0.5) / 2.0_f64.powi(32) - 0.5;
    DVec2::new(unit(i.reverse_bits()), unit(second))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_nets() {
        for (begin, log_count) in [(0_u32, 4_u32), (16, 4), (48, 4), (256, 8), (0, 12)] {
            for a in 0..=log_count {
                let sides = [1_u32 << a, 1 << (log_count - a)];
                let mut boxes = vec![0; 1 << log_count];
                for i in begin..begin + (1 << log_count) {
                    let position = position(i) + 0.5;
                    let cell = |at: f64, side: u32| (at * f64::from(side)) as usize;
                    boxes[cell(position.x, sides[0]) * sides[1] as usize + cell(position.y, sides[1])] += 1;
                }
                assert!(boxes.iter().all(|&count| count == 1), "{begin} {log_count} {a}");
            }
        }
    }
}
