//! Depth and coordinates where a look-up in the ideal frame does not tell them: by rays in f64, cast by the
//! host.

use camsim_core::temporal::unreliable_depth::{DepthGrid, changed};
use camsim_plan::{FramePlan, PixelTruth, Planner};
use glam::DVec2;
use rayon::prelude::*;

use camsim_plan::uniforms::Truth;

/// Casts rays for the pixels that the device has left to the host (their depth is below 0), for those whose
/// depth may belong to no surface or to the wrong one, and from each pixel that a ray has corrected on for
/// its neighbours. `phase` is that of the coordinates; pixels are valid where `color_rgba` says so.
pub(crate) fn complete(
    truth: &mut [Truth],
    color_rgba: &[f32],
    planner: &Planner,
    plan: &FramePlan,
    phase: f64,
) {
    let width = plan.camera.size_px[0] as usize;
    let sight = |i: usize, truth: &Truth| {
        let uv = DVec2::new(f64::from(truth.uv[0]), f64::from(truth.uv[1]));
        planner.pixel_truth(plan, [(i % width) as u32, (i / width) as u32], uv, phase)
    };
    let cast = |truth: &[Truth], pixels: &[usize]| -> Vec<(usize, PixelTruth)> {
        pixels.par_iter().map(|&i| (i, sight(i, &truth[i]))).collect()
    };
    let mut by_ray: Vec<bool> = truth.iter().map(|of| of.depth_m < 0.0).collect();
    let unknown: Vec<usize> = (0..truth.len()).filter(|&i| by_ray[i]).collect();
    for (i, sight) in cast(truth, &unknown) {
        tell(&mut truth[i], &sight);
    }
    let valid: Vec<bool> = color_rgba.chunks_exact(4).map(|rgba| rgba[3] > 0.0).collect();
    let inverse_depth: Vec<f32> = truth.iter().map(inverse_depth).collect();
    let row_step = if plan.shutter.interlace_s() > 0.0 { 2 } else { 1 };
    let grid = DepthGrid { width, row_step, inverse_depth: &inverse_depth, valid: &valid };
    let mut pixels: Vec<usize> = grid
        .unreliable_pixels()
        .into_iter()
        .enumerate()
        .filter(|&(i, suspect)| suspect && !by_ray[i])
        .map(|(i, _)| i)
        .collect();
    pixels.iter().for_each(|&i| by_ray[i] = true);
    while !pixels.is_empty() {
        let found = cast(truth, &pixels);
        pixels.clear();
        for (i, sight) in found {
            tell(&mut truth[i], &sight);
            if !changed(inverse_depth[i], self::inverse_depth(&truth[i])) {
                continue;
            }
            for beside in grid.neighbours(i).filter(|&beside| valid[beside]) {
                if !std::mem::replace(&mut by_ray[beside], true) {
                    pixels.push(beside);
                }
            }
        }
    }
}

/// 1/m; 0 where nothing is.
fn inverse_depth(truth: &Truth) -> f32 {
    if truth.depth_m > 0.0 { 1.0 / truth.depth_m } else { 0.0 }
}

fn tell(truth: &mut Truth, sight: &PixelTruth) {
    truth.source_px = sight.source_px.as_vec2().to_array();
    truth.point_ned_m = sight.hit.map_or([0.0; 3], |(point_ned_m, _)| point_ned_m.as_vec3().to_array());
    truth.depth_m = sight.hit.map_or(0.0, |(_, depth_m)| depth_m as f32);
}
