//! Depth and coordinates of pixels whose depth look-up is unreliable: by f64 rays on the processor.

use camsim_core::temporal::unreliable_depth::{DepthGrid, changed};
use camsim_plan::{FramePlan, PixelTruth, Planner};
use glam::DVec2;
use rayon::prelude::*;

use camsim_plan::uniforms::Truth;

/// Replaces unreliable depths and coordinates by those of exact rays: of pixels that the renderer has marked
/// (depth below 0), of pixels whose depth may belong to no surface or to the wrong one, and, repeatedly, of
/// the neighbours of each pixel that a ray has changed. `phase` is that of the source coordinates; valid
/// pixels have alpha in `color_rgba`.
pub(crate) fn complete(
    truth: &mut [Truth],
    color_rgba: &[f32],
    planner: &Planner,
    plan: &FramePlan,
    phase: f64,
) {
    let width = plan.camera.size_px[0] as usize;
    let exact_truth = |i: usize, truth: &Truth| {
        let uv = DVec2::new(f64::from(truth.uv[0]), f64::from(truth.uv[1]));
        planner.pixel_truth(plan, [(i % width) as u32, (i / width) as u32], uv, phase)
    };
    let cast = |truth: &[Truth], pixels: &[usize]| -> Vec<(usize, PixelTruth)> {
        pixels.par_iter().map(|&i| (i, exact_truth(i, &truth[i]))).collect()
    };
    let mut is_exact: Vec<bool> = truth.iter().map(|pixel| pixel.depth_m < 0.0).collect();
    let marked: Vec<usize> = (0..truth.len()).filter(|&i| is_exact[i]).collect();
    for (i, exact) in cast(truth, &marked) {
        set(&mut truth[i], &exact);
    }
    let valid: Vec<bool> = color_rgba.chunks_exact(4).map(|rgba| rgba[3] > 0.0).collect();
    let inverse_depth: Vec<f32> = truth.iter().map(inverse_depth).collect();
    let row_step = if plan.shutter.interlace_s() > 0.0 { 2 } else { 1 };
    let grid = DepthGrid { width, row_step, inverse_depth: &inverse_depth, valid: &valid };
    let mut pixels: Vec<usize> = grid
        .unreliable_pixels()
        .into_iter()
        .enumerate()
        .filter(|&(i, is_unreliable)| is_unreliable && !is_exact[i])
        .map(|(i, _)| i)
        .collect();
    pixels.iter().for_each(|&i| is_exact[i] = true);
    while !pixels.is_empty() {
        let results = cast(truth, &pixels);
        pixels.clear();
        for (i, exact) in results {
            set(&mut truth[i], &exact);
            if !changed(inverse_depth[i], self::inverse_depth(&truth[i])) {
                continue;
            }
            for neighbour in grid.neighbours(i).filter(|&neighbour| valid[neighbour]) {
                if !std::mem::replace(&mut is_exact[neighbour], true) {
                    pixels.push(neighbour);
                }
            }
        }
    }
}

/// Inverse depth, 1/m; 0 for the sky.
fn inverse_depth(truth: &Truth) -> f32 {
    if truth.depth_m > 0.0 { 1.0 / truth.depth_m } else { 0.0 }
}

fn set(truth: &mut Truth, exact: &PixelTruth) {
    truth.source_px = exact.source_px.as_vec2().to_array();
    truth.point_ned_m = exact.hit.map_or([0.0; 3], |(point_ned_m, _)| point_ned_m.as_vec3().to_array());
    truth.depth_m = exact.hit.map_or(0.0, |(_, depth_m)| depth_m as f32);
}
