//! What a session hands over: the frame, how it was made, and where its time went.

use camsim_core::{frame::RenderedFrame, plan::FramePlan, scene::LodSelection};

use crate::recorder::PassTime;

/// Where a frame's time went, ms. Frames overlap: while one is waited for, the device may still be at the one before.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FrameTimes {
    /// The host planned it and computed its tables, on another thread than what follows.
    pub plan_ms: f64,
    /// The host wrote its tables and recorded its passes.
    pub record_ms: f64,
    /// The driver took it. Some (Mesa's software adapters) return only when they are done with the frame before.
    pub submit_ms: f64,
    /// The host waited for the device.
    pub wait_ms: f64,
    /// The host made the picture from the ideal frame, where it does that itself ([`crate::reverse::host`]).
    pub reverse_ms: Option<f64>,
    /// The host took the pictures; and where depth or coordinates are wanted, it looked for itself what pixels at silhouettes see.
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
    /// Blended triangles that are mixed before something behind them, since they cover each other in rings; of all ideal frames.
    pub out_of_order: u32,
    /// Where its time went.
    pub times: FrameTimes,
}
