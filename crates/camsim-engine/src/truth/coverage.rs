//! Fraction of each pixel that the object at its centre has.
//!
//! A pixel is an area of 1 x 1 and an exposure of its row. Its coverage is the fraction of rays through that box
//! that meet the object that the pixel's centre sees at mid-exposure. Only pixels near a border between objects
//! (or the sky) can have less than 1: those within the reach of a pixel that has another object beside it. The
//! reach of a pixel is the path of its point in the picture during the exposure, across and down, plus 1 px.

use camsim_core::{
    camera::CameraModel,
    pose::CameraPose,
    scene::ray_packet::{PACKET_RAYS, PacketRay, RayPacket},
    shutter::RowAxis,
};
use camsim_plan::{Among, PHASES};
use glam::DVec2;
use rayon::prelude::*;

use super::{
    flow::moved_px,
    planes::{FramePixels, Pixel},
};

/// Rays of a pixel near a border.
pub(crate) const RAYS: u32 = 64;
/// Largest error of a ray between those that are solved, pixels.
const QUADRATIC_PX: f64 = 1e-4;
/// Part of the path to a model by which ground is in front of it, at least.
const ROUNDING: f64 = 1e-12;
/// Longest reach, pixels. Beyond it a picture is all blur.
const MOST_REACH_PX: f64 = 256.0;

/// Position of ray i in its pixel and phase, each -0.5 to 0.5: the Hammersley set with the first two coordinates of
/// Sobol's sequence, a (0, 6, 3) net in base 2. Every box with sides of 2^-a, 2^-b and 2^-c, a + b + c = 6,
/// has one ray. For a straight border that crosses the pixel at any speed the error of a coverage is 0.015 RMS
/// and 0.1 at most.
pub(crate) fn ray(i: u32) -> (DVec2, f64) {
    let unit = |bits: u32| (f64::from(bits) + 0.5) / f64::from(RAYS) - 0.5;
    let position = DVec2::new(unit(i), unit(i.reverse_bits() >> 26));
    // Direction numbers of the Sobol sequence for the polynomial x + 1, of 6 bits.
    let direction = [32_u32, 48, 40, 60, 34, 51];
    let phase = (0..6).filter(|bit| i >> bit & 1 == 1).fold(0, |sum, bit: usize| sum ^ direction[bit]);
    (position, unit(phase))
}

/// Coverage of every pixel; 0 without a ray.
pub(super) fn coverage(pixels: &FramePixels<'_>) -> Vec<f32> {
    let objects = pixels.map(&None, |pixel| Some(object(pixels, pixel)));
    let near = near_borders(pixels, &objects);
    let rays: Vec<(DVec2, f64)> = (0..RAYS).map(ray).collect();
    let cameras = LineCameras::new(pixels, &near, &rays);
    let of_pixel = |packet: &mut RayPacket, i: usize| {
        let Some(Pixel { position, .. }) = pixels.pixel(i) else { return 0.0 };
        let Some(near) = near[i] else { return 1.0 };
        let uvs = uvs(&pixels.plan.camera, position, &rays);
        let of_rays: [PacketRay; PACKET_RAYS] = std::array::from_fn(|k| {
            let (t_s, CameraPose { position_ned_m, ned_from_camera }) = cameras.of(position)[k];
            let to = |uv: DVec2| PacketRay {
                t_s,
                origin_ned_m: position_ned_m,
                direction_ned: ned_from_camera * uv.extend(1.0),
                limit: f64::INFINITY,
            };
            uvs[k].map_or(PacketRay::NONE, to)
        });
        let surfaces = surfaces(pixels, packet, &of_rays, near);
        let seen = surfaces.iter().zip(&of_rays).filter(|(_, ray)| ray.is_there());
        let is_same = |surface: Option<u32>| Some(object_of(pixels, surface)) == objects[i];
        let (same, all) =
            seen.fold((0_u32, 0_u32), |(same, all), (&seen, _)| (same + u32::from(is_same(seen)), all + 1));
        // Rays fail at the border of the lens's field only.
        if all == 0 { 1.0 } else { same as f32 / all as f32 }
    };
    (0..pixels.truth.len()).into_par_iter().with_min_len(256).map_init(RayPacket::default, of_pixel).collect()
}

/// Surface that each ray meets first. Where no sky is near, a ray that meets no model meets the ground, and another
/// meets it only before the model.
fn surfaces(
    pixels: &FramePixels<'_>,
    packet: &mut RayPacket,
    rays: &[PacketRay; PACKET_RAYS],
    near: Border,
) -> [Option<u32>; PACKET_RAYS] {
    let among = if near == Border::OfModels { Among::Models } else { Among::All };
    let first = pixels.rays.first_hits(packet, rays, among).map(|hit| hit.map(|hit| (hit.t, hit.surface)));
    if near == Border::OfSky {
        return first.map(|hit| hit.map(|(_, surface)| surface));
    }
    let mut to_models = *rays;
    for (ray, hit) in to_models.iter_mut().zip(first) {
        *ray = hit.map_or(PacketRay::NONE, |(t, _)| PacketRay { limit: (1.0 - ROUNDING) * t, ..*ray });
    }
    let is_any = first.iter().any(Option::is_some);
    let ground = if is_any { pixels.rays.first_hits(packet, &to_models, Among::Ground) } else { [None; _] };
    std::array::from_fn(|k| Some(first[k].filter(|_| ground[k].is_none()).map_or(0, |(_, surface)| surface)))
}

/// Ideal rays of a pixel's positions. The lens's inverse is solved at nine, and quadratic between these if that is
/// exact to [`QUADRATIC_PX`] where a cubic term is largest.
fn uvs(camera: &CameraModel, pixel: [u32; 2], rays: &[(DVec2, f64)]) -> [Option<DVec2>; PACKET_RAYS] {
    let from_px = DVec2::from_array(pixel.map(f64::from));
    let steps = [-0.5, 0.0, 0.5];
    let nodes = steps.map(|y| steps.map(|x| camera.unproject(from_px + DVec2::new(x, y))));
    // Weights of -0.5, 0 and 0.5.
    let weights = |s: f64| [s * (2.0 * s - 1.0), 1.0 - 4.0 * s * s, s * (2.0 * s + 1.0)];
    let between = |DVec2 { x, y }: DVec2| -> Option<DVec2> {
        let across = weights(x);
        let row = |nodes: &[Option<DVec2>; 3]| -> Option<DVec2> {
            Some(across[0] * nodes[0]? + across[1] * nodes[1]? + across[2] * nodes[2]?)
        };
        let down = weights(y);
        Some(down[0] * row(&nodes[0])? + down[1] * row(&nodes[1])? + down[2] * row(&nodes[2])?)
    };
    let largest = DVec2::new(0.5, -0.5) / 3.0_f64.sqrt();
    let off =
        between(largest).zip(camera.unproject(from_px + largest)).map(|(a, b)| (a - b) * camera.focal_px);
    let is_quadratic = off.is_some_and(|off| off.length() <= QUADRATIC_PX);
    std::array::from_fn(|k| {
        let (position, _) = rays[k];
        if is_quadratic { between(position) } else { camera.unproject(from_px + position) }
    })
}

/// Instants of the rays (path time, seconds) and cameras. Pixels of a line of the readout (and field) share
/// them.
struct LineCameras {
    axis: RowAxis,
    /// By line; empty for lines without a pixel near a border.
    of_line: Vec<Vec<(f64, CameraPose)>>,
}

impl LineCameras {
    fn new(pixels: &FramePixels<'_>, near: &[Option<Border>], rays: &[(DVec2, f64)]) -> Self {
        let [width, height] = pixels.plan.camera.size_px;
        let axis = pixels.plan.shutter.row_axis();
        let lines = if axis == RowAxis::Rows { height } else { 2 * width };
        let mut first = vec![None; lines as usize];
        for i in (0..near.len()).filter(|&i| near[i].is_some()) {
            let pixel = [i as u32 % width, i as u32 / width];
            first[line(axis, pixel)].get_or_insert(pixel);
        }
        let exposes = pixels.plan.shutter.exposure_s() > 0.0;
        let camera = |pixel, phase| pixels.rays.camera_at(pixel, if exposes { phase } else { 0.0 });
        let of_pixel = |pixel: [u32; 2]| rays.iter().map(|&(_, phase)| camera(pixel, phase)).collect();
        Self {
            axis,
            of_line: first.into_par_iter().map(|pixel| pixel.map_or_else(Vec::new, of_pixel)).collect(),
        }
    }

    fn of(&self, pixel: [u32; 2]) -> &[(f64, CameraPose)] {
        &self.of_line[line(self.axis, pixel)]
    }
}

/// Line of the readout of a pixel; columns have one for each field.
fn line(axis: RowAxis, [x, y]: [u32; 2]) -> usize {
    match axis {
        RowAxis::Rows => y as usize,
        RowAxis::Columns => 2 * x as usize + (y % 2) as usize,
    }
}

fn object(pixels: &FramePixels<'_>, pixel: Pixel<'_>) -> u32 {
    object_of(pixels, pixel.hit.map(|hit| hit.surface))
}

fn object_of(pixels: &FramePixels<'_>, surface: Option<u32>) -> u32 {
    surface.map_or(0, |surface| pixels.planner.sequence().scene.object_of_surface(surface))
}

/// What a pixel may be near.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Border {
    /// Borders of models with the ground, or with other models.
    OfModels,
    /// Borders with the sky, or with what is not in the picture.
    OfSky,
}

/// Borders within whose reach each pixel is: those of pixels with another object, or nothing, beside them.
fn near_borders(pixels: &FramePixels<'_>, objects: &[Option<u32>]) -> Vec<Option<Border>> {
    let around = || (-1..=1).flat_map(|dy| (-1..=1).map(move |dx| [dx, dy]));
    let sky = Some(object_of(pixels, None));
    let reaches = pixels.map(&None, |pixel| {
        let [x, y] = pixel.position.map(i64::from);
        let object = |[dx, dy]: [i64; 2]| index(pixels, [x + dx, y + dy]).and_then(|i| objects[i]);
        let is_at_border = around().any(|to| object(to) != object([0, 0]));
        let has_sky = || around().map(object).any(|object| object.is_none() || object == sky);
        let border = || if has_sky() { Border::OfSky } else { Border::OfModels };
        is_at_border.then(|| (border(), reach_px(pixels, pixel)))
    });
    let [width, height] = pixels.plan.camera.size_px.map(|side| side as usize);
    let mut near = vec![None; width * height];
    for (i, (border, [across, down])) in reaches.iter().enumerate().filter_map(|(i, at)| Some((i, (*at)?))) {
        let (x, y) = (i % width, i / width);
        for row in y.saturating_sub(down)..(y + down + 1).min(height) {
            let within = x.saturating_sub(across)..(x + across + 1).min(width);
            near[row * width..][within].iter_mut().for_each(|near| *near = (*near).max(Some(border)));
        }
    }
    near
}

/// Whole pixels across and down from a pixel that the point it sees may come to in the exposure, and 1 px more: a
/// border to a neighbour is within half a pixel of one of the two centres, and the area of a pixel extends as far.
fn reach_px(pixels: &FramePixels<'_>, pixel: Pixel<'_>) -> [usize; 2] {
    let phases = (0..=PHASES).map(|k| k as f64 / PHASES as f64 - 0.5);
    // A point that its camera does not show at an instant has left the picture.
    let most = DVec2::splat(MOST_REACH_PX);
    let path_px = phases
        .map(|phase| moved_px(pixels, pixel, phase).map_or(most, DVec2::abs))
        .fold(DVec2::ZERO, DVec2::max);
    path_px.min(most).to_array().map(|px| (px + 1.0) as usize)
}

fn index(pixels: &FramePixels<'_>, [x, y]: [i64; 2]) -> Option<usize> {
    let [width, height] = pixels.plan.camera.size_px.map(i64::from);
    ((0..width).contains(&x) && (0..height).contains(&y)).then_some((y * width + x) as usize)
}

#[cfg(test)]
mod tests;
