//! The ideal frame in closed form or by rays in f64.

use camsim_core::reference::ReferenceRenderer;
use camsim_engine::IdealPlanes;
use camsim_plan::FramePlan;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::{cases::Case, stage::IdealOutput};

/// Rays along a side of a pixel, for its mean.
const SIDE: u32 = 8;
/// Pixels of which one is compared with its mean.
const PIXELS_A_MEAN: usize = 3;

/// Where the values of the ideal frame come from.
#[derive(Clone, Copy, Debug)]
pub enum TwinSource {
    /// Nowhere: it is compared with those of other implementations only.
    None,
    /// The formula of [`super::common::pattern`] of such a width on level ground: depth of the centre, mean
    /// colour of the pixel; where the frame shows ground.
    Pattern { width_m: f64 },
    /// Rays through the centres of pixels.
    Rays,
}

/// The values that are compared; `None` elsewhere.
pub fn ideal_twin(
    case: &Case,
    plan: &FramePlan,
    (geometry, color_rgba, inverse_depth): &IdealPlanes,
) -> IdealOutput {
    let pose = &plan.keys[0].pose;
    let count = inverse_depth.len();
    let width = geometry.size_px[0] as usize;
    let uv = |i: usize, offset_px: DVec2| {
        let position_px = DVec2::new((i % width) as f64, (i / width) as f64) + offset_px;
        (position_px - geometry.principal_px) / geometry.focal_px
    };
    let ray = |i: usize, offset_px: DVec2| pose.ned_from_camera * uv(i, offset_px).extend(1.0);
    let values: Vec<(Option<f64>, Option<DVec3>)> = match case.ideal_twin {
        TwinSource::None => vec![(None, None); count],
        TwinSource::Rays => {
            let reference = ReferenceRenderer::new(case.sequence.clone()).expect("a usable camera");
            let value = |i: usize| {
                let hit = reference.cast(pose.position_ned_m, ray(i, DVec2::ZERO));
                let color_dn = 255.0 * reference.radiance(pose, uv(i, DVec2::ZERO));
                (Some(hit.map_or(0.0, |hit| 1.0 / hit.depth_m)), Some(color_dn))
            };
            (0..count).into_par_iter().map(value).collect()
        }
        TwinSource::Pattern { width_m } => {
            let offset = |k: u32| (f64::from(k) + 0.5) / f64::from(SIDE) - 0.5;
            let value = |i: usize| {
                if inverse_depth[i] <= 0.0 || !i.is_multiple_of(PIXELS_A_MEAN) {
                    return (None, None);
                }
                let color = |k: u32| {
                    let ray = ray(i, DVec2::new(offset(k % SIDE), offset(k / SIDE)));
                    let ground_ned_m = pose.position_ned_m - ray * (pose.position_ned_m.z / ray.z);
                    pattern_color_dn(ground_ned_m, width_m).filter(|_| ray.z > 0.0)
                };
                let sum = (0..SIDE * SIDE).map(color).sum::<Option<DVec3>>();
                let w = -ray(i, DVec2::ZERO).z / pose.position_ned_m.z;
                (Some(w), sum.map(|sum| sum / f64::from(SIDE * SIDE)))
            };
            (0..count).into_par_iter().map(value).collect()
        }
    };
    let (inverse_depth, color_dn) = values.into_iter().unzip();
    IdealOutput {
        geometry: *geometry,
        alpha: color_rgba.chunks_exact(4).map(|rgba| rgba[3]).collect(),
        color_dn,
        inverse_depth,
    }
}

/// Colour of the pattern at a position; `None` at its border and outside.
fn pattern_color_dn(ground_ned_m: DVec3, width_m: f64) -> Option<DVec3> {
    let texel = |fraction: f64| 512.0 * fraction - 0.5;
    let [x, y] = [0.5 + ground_ned_m.y / width_m, 0.5 - ground_ned_m.x / width_m].map(texel);
    let inside = x > 2.0 && y > 2.0 && x < 509.0 && y < 509.0;
    let level = |k: f64, phase: f64| {
        let wave = std::f64::consts::TAU * k / 512.0;
        127.5 + 110.0 * (wave * x + phase).sin() * (wave * y).cos()
    };
    inside.then(|| DVec3::new(level(8.0, 0.0), level(5.0, 1.0), level(11.0, 2.0)))
}
