//! Ideal frames and output frames on a GPU, by wgpu: passes, buffers and read-back. Software adapters (Mesa's
//! lavapipe) count as GPUs.
//!
//! [`GpuContext`] opens an adapter; [`GpuSession`] holds one sequence on it and records the passes that a
//! [`FramePlan`](camsim_plan::FramePlan) names. It decides nothing itself. The crate `camsim-engine` feeds it.
//!
//! Modules in the order of the data flow: [`context`] (adapter and device), [`shaders`] (WGSL composition),
//! [`layout`] (mirrors of shader structs), [`upload`] (the scene), [`staging`] and [`recorder`] (a frame's
//! writes and commands), [`ideal`] (ideal frames), [`reverse`] (output frames), [`session`] (all passes of a
//! frame, read-back).

#![warn(missing_docs)]

pub mod context;
mod error;
pub mod ideal;
pub mod layout;
pub mod recorder;
pub mod reverse;
pub mod session;
pub mod shaders;
pub mod staging;
/// Tiles of large pictures.
pub mod tiles;
pub mod upload;

pub use context::{AdapterChoice, AdapterSummary, GpuContext, GpuError};
pub use error::PassError;
pub use session::{GpuJob, GpuSession, IdealImages, Submitted, Wanted};
