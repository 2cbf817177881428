//! Lamps that are small in the picture, by rays of their own.
//!
//! An ideal frame shows a surface where the centres of its pixels, or their samples, meet it: a lamp of half a pixel
//! in one picture of four, and then with four times its light. What is brighter than white makes that seen,
//! however small it is. So pixels that a small lamp may reach in their exposure are replaced by means over area
//! and exposure: of thousands of rays those are cast that pass within the lamp's sphere, and a few others
//! for what is beside it.

use std::sync::Arc;

use camsim_core::{
    mount::CameraPath,
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
use crate::truth::{RAYS, ray};

/// Longest side of the box, in the picture, of a lamp that gets rays of its own, pixels. Of larger ones the borders are
/// a small part.
pub const SMALL_LAMP_PX: f64 = 16.0;
/// Rays that are to pass a lamp, and most of a pixel: of a lamp of half a pixel a quarter passes it, 16 at each
/// instant.
const RAYS_OF_LAMP: f64 = 4096.0;
const MOST_RAYS: u32 = 16_384;
/// Instants of an exposure; several rays share one.
const INSTANTS: u32 = 256;
/// How far beyond its borders an ideal frame may show a surface, ideal pixels, and beyond that in the picture.
const IDEAL_ROOM_PX: f64 = 1.5;
const ROOM_PX: f64 = 1.0;
/// Least share of an ideal pixel that is allowed for, per pixel.
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
    lamps: Vec<&'a Small<'a>>,
    spans: Vec<[u32; 2]>,
}

/// What the pixels of a row share.
struct Job<'a> {
    caster: &'a MovingCaster,
    plan: &'a FramePlan,
    rays: u32,
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
    pub fn paint(&self, color_rgba: &mut [f32], plan: &FramePlan) {
        let Sequence { scene, path, .. } = &*self.painter.sequence;
        let meshes = self.numbers.iter().map(|&number| &scene.meshes[number]);
        let small: Vec<Small<'_>> = meshes.filter_map(|mesh| self.small(plan, mesh)).collect();
        let lines = (0..super::line_count(plan)).filter_map(|number| {
            let (mut lamps, mut spans) = (Vec::new(), Vec::new());
            for lamp in small.iter().filter(|lamp| lamp.swept.may_be_in(plan, number)) {
                let own = lamp.swept.spans(path, plan, number);
                if !own.is_empty() {
                    lamps.push(lamp);
                    spans.extend(own);
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
        Painter::paint(color_rgba, lines, |line, before| self.line(caster, plan, &line, before));
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
        let pixels = line.spans.iter().flat_map(|&[first, last]| first..=last);
        let pixels = pixels.map(|along| outline::pixel(plan, line.number, along));
        let pixels: Vec<[u32; 2]> =
            pixels.filter(|&pixel| color_rgba[4 * index(plan, pixel) + 3] > 0.0).collect();
        let Some(&first) = pixels.first() else { return Vec::new() };
        let job = Job::new(caster, &self.painter.sequence.path, plan, (&line.lamps, first));
        let stage = Photometry::new(&self.painter.sequence.scenario.camera, plan.exposure.as_ref());
        let mut scratch = RayScratch::default();
        let color = |pixel| {
            let light = job.light(pixel, &mut scratch)?;
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
        (lamps, [x, y]): (&[&Small<'_>], [u32; 2]),
    ) -> Self {
        let rays = lamps.iter().map(|lamp| lamp.rays).max().unwrap_or(RAYS);
        let mid_s = plan.stamp_s + plan.shutter.dt_pixel_s(x, y);
        let exposure_s = plan.shutter.exposure_pixel_s(x, y);
        let count = if exposure_s > 0.0 { INSTANTS.min(rays) } else { 1 };
        let (mut instants, mut spheres) = (Vec::new(), Vec::new());
        for k in 0..count {
            let t_s = mid_s + ((f64::from(k) + 0.5) / f64::from(count) - 0.5) * exposure_s;
            let pose = path.pose(t_s);
            let sphere = |lamp: &&Small<'_>| {
                let bounds = lamp.mesh.bounds_between(t_s, t_s);
                Sphere {
                    centre_m: pose.ned_from_camera.conjugate() * (bounds.centre() - pose.position_ned_m),
                    radius_m: 0.5 * (bounds.max - bounds.min).length(),
                }
            };
            spheres.push(lamps.iter().map(sphere).collect());
            instants.push(caster.at(t_s, pose));
        }
        Self { caster, plan, rays, instants, spheres }
    }

    /// Mean light over a pixel's area and exposure; `None` if no lamp comes near.
    fn light(&self, pixel: [u32; 2], scratch: &mut RayScratch) -> Option<Vec3> {
        let camera = &self.plan.camera;
        let uv = camera.unproject(DVec2::from_array(pixel.map(f64::from)))?;
        let uv_from_px = (DMat2::from_diagonal(camera.focal_px) * camera.lens.jacobian(uv)).inverse();
        let half = 0.5 * (uv_from_px.x_axis.abs() + uv_from_px.y_axis.abs()).length();
        let room = half * (1.0 + 2.0 * room_px(self.plan));
        let is_near = |spheres: &Vec<Sphere>| spheres.iter().any(|sphere| sphere.is_within(uv, room));
        if !self.spheres.iter().any(is_near) {
            return None;
        }
        // Each ray stands for its part of the pixel's area.
        let step_uv =
            DVec2::new(uv_from_px.row(0).length(), uv_from_px.row(1).length()) / f64::from(RAYS).sqrt();
        let count = self.instants.len();
        let mut cast = |k: usize, uv: DVec2| {
            self.caster.color(&self.instants[k], uv, step_uv, self.plan.surface_reads, scratch)
        };
        let passes = |k: usize, uv: DVec2| self.spheres[k].iter().any(|sphere| sphere.is_within(uv, 0.0));
        let (mut of_lamps, mut passing) = (Vec3::ZERO, 0_u32);
        for i in 0..self.rays {
            let k = (i as usize * count) / self.rays as usize;
            let uv = uv + uv_from_px * place(i);
            if passes(k, uv) {
                of_lamps += cast(k, uv);
                passing += 1;
            }
        }
        let (mut beside, mut others) = (Vec3::ZERO, 0_u32);
        for (place, phase) in (0..RAYS).map(ray) {
            let k = (((phase + 0.5) * count as f64) as usize).min(count - 1);
            let uv = uv + uv_from_px * place;
            if !passes(k, uv) {
                beside += cast(k, uv);
                others += 1;
            }
        }
        Some(match (passing, others) {
            (_, 0) => of_lamps / passing.max(1) as f32,
            _ => {
                let share = passing as f32 / self.rays as f32;
                of_lamps / self.rays as f32 + (1.0 - share) * beside / others as f32
            }
        })
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

/// Place of ray i in its pixel, -0.5 to 0.5: the first two coordinates of Sobol's sequence. Any 2^k consecutive ones
/// from a multiple of it are a net: every box with sides of 2^-a and 2^-b, a + b = k, has one.
fn place(i: u32) -> DVec2 {
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
    fn places_are_nets() {
        for (begin, log_count) in [(0_u32, 4_u32), (16, 4), (48, 4), (256, 8), (0, 12)] {
            for a in 0..=log_count {
                let sides = [1_u32 << a, 1 << (log_count - a)];
                let mut boxes = vec![0; 1 << log_count];
                for i in begin..begin + (1 << log_count) {
                    let place = place(i) + 0.5;
                    let cell = |at: f64, side: u32| (at * f64::from(side)) as usize;
                    boxes[cell(place.x, sides[0]) * sides[1] as usize + cell(place.y, sides[1])] += 1;
                }
                assert!(boxes.iter().all(|&count| count == 1), "{begin} {log_count} {a}");
            }
        }
    }
}
