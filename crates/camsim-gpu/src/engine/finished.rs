//! What a session hands over: the frame, how it was made, and where its time went; and how that is taken from
//! device and host.

use std::time::Instant;

use camsim_core::{frame::RenderedFrame, scene::LodSelection};
use camsim_plan::FramePlan;

use super::{
    InFlight, Session,
    ahead::Lines,
    exact_truth, ms_since,
    readback::{Output, coords, read_mapped},
};
use crate::{context::GpuError, layout::Truth, recorder::PassTime};

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
    /// The host drew the ideal frame, where it does that itself ([`crate::reverse::host`]); none where an
    /// earlier frame's is kept.
    pub ideal_ms: Option<f64>,
    /// The host waited for the device.
    pub wait_ms: f64,
    /// The host made the picture from the ideal frame, where it does that itself ([`crate::reverse::host`]).
    pub reverse_ms: Option<f64>,
    /// The host took the pictures; and where depth or coordinates are wanted, it looked for itself what
    /// pixels at silhouettes see.
    pub read_ms: f64,
    /// What ran on the device, if asked for ([`Session::time_passes`]) and if the adapter has time stamps.
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

impl Session<'_> {
    /// Waits for a frame and takes its pictures.
    pub(super) fn finish(&mut self, done: InFlight) -> Result<Finished, GpuError> {
        let gpu = &self.engine.gpu;
        let wait = wgpu::PollType::Wait { submission_index: Some(done.submission), timeout: None };
        let mut times = done.times;
        let begun = Instant::now();
        gpu.device.poll(wait).map_err(|error| GpuError::Device(error.to_string()))?;
        self.engine.check()?;
        times.wait_ms = ms_since(begun);
        let plan = done.plan;
        let begun = Instant::now();
        let by_host = match (&mut self.on_host, &done.on_host) {
            (Some(on_host), Some((frame, Lines::Poses(poses)))) => {
                Some(on_host.render(&plan, frame, &poses.entries)?)
            }
            _ => None,
        };
        times.reverse_ms = by_host.as_ref().map(|_| ms_since(begun));
        let begun = Instant::now();
        let slot = &self.slots[done.slot];
        let from_device = || slot.truth.as_ref().map(Output::read::<Truth>).transpose();
        let (color_rgba, mut truth) = match by_host {
            Some(made) => made,
            None => (slot.color.read()?, from_device()?),
        };
        if let Some(truth) = truth.as_mut().filter(|_| plan.tells_exact_truth()) {
            exact_truth::complete(truth, &color_rgba, &self.planner, &plan, f64::from(self.coords_phase));
        }
        let size_px = plan.camera.size_px;
        let coords =
            truth.as_ref().map(|truth| coords(truth, &color_rgba, &plan, &self.planner.sequence().path));
        let frame = RenderedFrame {
            index: plan.frame,
            stamp_ns: self.planner.sequence().epoch_ns.saturating_add((plan.stamp_s * 1e9).round() as i64),
            size_px,
            color_rgba,
            depth_m: truth.as_ref().map(|truth| truth.iter().map(|t| t.depth_m).collect()),
            coords,
            rows: self.planner.rows(&plan),
        };
        times.read_ms = ms_since(begun);
        if let Some(clock) = &slot.clock {
            times.passes = clock.passes(gpu, &read_mapped(clock.on_host())?);
        }
        Ok(Finished { frame, plan, lod: done.lod, out_of_order: done.out_of_order, times })
    }
}
