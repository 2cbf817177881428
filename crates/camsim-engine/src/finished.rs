//! What a session hands over: the frame, how it was made, and where its time went; and how that is taken from
//! device and host.

use camsim_core::{
    frame::{COORDS_CHANNELS, RenderedFrame, sky_direction_ned},
    mount::CameraPath,
    pose::CameraPose,
    scene::LodSelection,
};
use camsim_plan::{FramePlan, uniforms::Truth};
use glam::DVec2;
use rayon::prelude::*;

use camsim_gpu::recorder::PassTime;

/// Where a frame's time went, ms. Frames overlap: while one is waited for, the device may still be at the one
/// before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameTimes {
    /// The host planned it and computed its tables, on another thread than what follows.
    pub plan_ms: f64,
    /// The host wrote its tables and recorded its passes.
    pub record_ms: f64,
    /// The driver took it. Some (Mesa's software adapters) return only when they are done with the frame
    /// before.
    pub submit_ms: f64,
    /// The host drew the ideal frame, where it does that itself; none where an
    /// earlier frame's is kept.
    pub ideal_ms: Option<f64>,
    /// The host waited for the device.
    pub wait_ms: f64,
    /// The host made the picture from the ideal frame, where it does that itself.
    pub reverse_ms: Option<f64>,
    /// The host took the pictures; and where depth or coordinates are wanted, it looked for itself what
    /// pixels at silhouettes see.
    pub read_ms: f64,
    /// What ran on the device, if asked for ([`crate::Session::time_passes`]) and if the adapter has time
    /// stamps.
    pub passes: Vec<PassTime>,
}

/// A finished frame with the plan it was made by.
#[derive(Debug)]
pub struct Finished {
    /// The pictures.
    pub frame: RenderedFrame,
    /// The plan.
    pub plan: FramePlan,
    /// The terrain's level of detail.
    pub lod: LodSelection,
    /// Blended triangles that are mixed before something behind them, since they cover each other in rings;
    /// of all ideal frames.
    pub out_of_order: u32,
    /// Where its time went.
    pub times: FrameTimes,
}

/// What was found beside the picture, with each pixel's time shift, and the direction of the sky where there
/// is a ray (alpha) and nothing that it meets.
pub(crate) fn coords(
    truth: &[Truth],
    color_rgba: &[f32],
    plan: &FramePlan,
    path: &CameraPath,
) -> Vec<[f32; COORDS_CHANNELS]> {
    let width = plan.camera.size_px[0] as usize;
    let of_row = |(y, (row, alphas)): (usize, (&[Truth], &[f32]))| {
        // Where lines are rows, all pixels of one look at one instant.
        let mut last: Option<(f64, CameraPose)> = None;
        let of_pixel = |(x, (t, rgba)): (usize, (&Truth, &[f32]))| {
            let dt_s = plan.shutter.dt_pixel_s(x as u32, y as u32);
            let [mut n, mut e, mut d] = t.point_ned_m;
            if t.depth_m == 0.0 && rgba[3] > 0.0 {
                let pose = last
                    .filter(|(of_s, _)| *of_s == dt_s)
                    .map_or_else(|| path.pose(plan.stamp_s + dt_s), |(_, pose)| pose);
                last = Some((dt_s, pose));
                let uv = DVec2::new(f64::from(t.uv[0]), f64::from(t.uv[1]));
                [n, e, d] = sky_direction_ned(&pose, uv).as_vec3().to_array();
            }
            [t.uv[0], t.uv[1], t.source_px[0], t.source_px[1], dt_s as f32, n, e, d]
        };
        row.iter().zip(alphas.chunks_exact(4)).enumerate().map(of_pixel).collect::<Vec<_>>()
    };
    truth.par_chunks(width).zip(color_rgba.par_chunks(4 * width)).enumerate().flat_map_iter(of_row).collect()
}
