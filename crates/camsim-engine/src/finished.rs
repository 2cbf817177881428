//! A finished frame with its plan and times, and its coordinates.

use camsim_core::{
    frame::{COORDS_CHANNELS, RenderedFrame, sky_direction_ned},
    mount::CameraPath,
    pose::CameraPose,
    scene::LodSelection,
};
use camsim_plan::{FramePlan, adapter::PassTime, uniforms::Truth};
use glam::DVec2;
use rayon::prelude::*;

/// Times of the stages of a frame, ms. Frames overlap: while the program waits for one, the gpu may still
/// work on the one before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameTimes {
    /// Planning and row tables, on another thread than the other stages.
    pub plan_ms: f64,
    /// Upload of tables and recording of gpu passes.
    pub record_ms: f64,
    /// Submission to the driver. Some drivers (Mesa's software adapters) return only after the frame before.
    pub submit_ms: f64,
    /// Ideal frame by the cpu renderer; `None` if the gpu draws it or an earlier one is shared.
    pub ideal_ms: Option<f64>,
    /// Waiting for the gpu.
    pub wait_ms: f64,
    /// Output frame by the cpu renderer; `None` if the gpu renders it.
    pub reverse_ms: Option<f64>,
    /// Read-back from the gpu, and the rays of the truth.
    pub read_ms: f64,
    /// Gpu passes, if [`crate::Session::time_passes`] was called and the adapter has time stamps.
    pub passes: Vec<PassTime>,
}

impl FrameTimes {
    /// Adds the times of another face of the same frame.
    pub(crate) fn add(&mut self, other: &Self) {
        let sum = |a: Option<f64>, b: Option<f64>| a.zip(b).map(|(a, b)| a + b).or(a).or(b);
        self.plan_ms += other.plan_ms;
        self.record_ms += other.record_ms;
        self.submit_ms += other.submit_ms;
        self.ideal_ms = sum(self.ideal_ms, other.ideal_ms);
        self.wait_ms += other.wait_ms;
        self.reverse_ms = sum(self.reverse_ms, other.reverse_ms);
        self.read_ms += other.read_ms;
        self.passes.extend(other.passes.iter().cloned());
    }
}

/// A finished frame with its plan.
#[derive(Debug)]
pub struct Finished {
    /// Colour and truth channels.
    pub frame: RenderedFrame,
    /// The plan; of a wide field that of its first face.
    pub plan: FramePlan,
    /// The plans of the other faces that a wide field is divided among.
    pub faces: Vec<FramePlan>,
    /// Level of detail of the terrain.
    pub lod: LodSelection,
    /// Number of blended triangles drawn in the wrong order because they overlap in cycles, over all ideal
    /// frames.
    pub out_of_order: u32,
    /// Times of the stages.
    pub times: FrameTimes,
}

impl Finished {
    /// The plans of all faces; one without.
    pub fn plans(&self) -> impl Iterator<Item = &FramePlan> {
        std::iter::once(&self.plan).chain(&self.faces)
    }
}

/// The channel `coords`: ray, source, time shift and point of each pixel, with the direction instead of the
/// point where a valid pixel shows the sky.
pub(crate) fn coords(
    truth: &[Truth],
    color_rgba: &[f32],
    plan: &FramePlan,
    path: &CameraPath,
) -> Vec<[f32; COORDS_CHANNELS]> {
    let width = plan.camera.size_px[0] as usize;
    let row_coords = |(y, (row, alphas)): (usize, (&[Truth], &[f32]))| {
        // If sensor rows are image rows, all pixels of a row have one instant.
        let mut last: Option<(f64, CameraPose)> = None;
        let pixel_coords = |(x, (t, rgba)): (usize, (&Truth, &[f32]))| {
            let dt_s = plan.shutter.dt_pixel_s(x as u32, y as u32);
            let [mut n, mut e, mut d] = t.point_ned_m;
            if t.depth_m == 0.0 && rgba[3] > 0.0 {
                let pose = last
                    .filter(|(last_s, _)| *last_s == dt_s)
                    .map_or_else(|| path.pose(plan.stamp_s + dt_s), |(_, pose)| pose);
                last = Some((dt_s, pose));
                let uv = DVec2::new(f64::from(t.uv[0]), f64::from(t.uv[1]));
                [n, e, d] = sky_direction_ned(&pose, uv).as_vec3().to_array();
            }
            [t.uv[0], t.uv[1], t.source_px[0], t.source_px[1], dt_s as f32, n, e, d]
        };
        row.iter().zip(alphas.chunks_exact(4)).enumerate().map(pixel_coords).collect::<Vec<_>>()
    };
    truth
        .par_chunks(width)
        .zip(color_rgba.par_chunks(4 * width))
        .enumerate()
        .flat_map_iter(row_coords)
        .collect()
}
