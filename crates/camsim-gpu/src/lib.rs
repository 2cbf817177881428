//! The ideal render and the reverse pipeline on wgpu.
//!
//! Modules in the order of the data flow: context (adapter and device) -> shaders (WGSL composition) ->
//! layout (mirrors of shader structs) -> scene upload -> staging and recorder (a frame's writes and commands)
//! -> ideal frame -> reverse pipeline -> engine (frames in flight, read-back). The engine executes
//! [`camsim_plan::FramePlan`]s and decides nothing itself.

#![warn(missing_docs)]

pub mod context;

mod host;

pub mod shaders;

pub mod layout;

/// Tiles of large pictures.
pub mod tiles;
pub mod upload;

pub mod staging;

pub mod recorder;

pub mod ideal;

pub mod reverse;

pub mod engine;

pub use context::{AdapterChoice, GpuContext, GpuError};
pub use engine::{Engine, RenderError};
