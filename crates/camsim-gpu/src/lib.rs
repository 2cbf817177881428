//! Ideal frames and output frames on a GPU, by wgpu: passes, buffers and read-back. Software adapters (Mesa's
//! lavapipe) count as GPUs.
//!
//! [`GpuContext`] opens an adapter; [`GpuSession`] holds one sequence on it and records the passes of a
//! [`FramePlan`](camsim_plan::FramePlan). It decides nothing itself; the crate `camsim-engine` drives it, by the
//! traits of [`camsim_plan::adapter`].
//!
//! | module | holds |
//! |---|---|
//! | [`context`] | adapter and device |
//! | [`shaders`] | composition of the WGSL |
//! | [`layout`] | Rust mirrors of shader structs |
//! | [`upload`], [`tiles`] | the scene on the GPU; tiles of large textures |
//! | [`staging`], [`recorder`] | uploads and commands of a frame, time stamps of its passes |
//! | [`ideal`] | ideal frames |
//! | [`reverse`] | lens map and output frames |
//! | [`session`] | all passes of a frame, read-back |

#![warn(missing_docs)]

pub mod context;
mod engine_adapter;
pub mod ideal;
pub mod layout;
pub mod recorder;
pub mod reverse;
pub mod session;
pub mod shaders;
pub mod staging;
pub mod tiles;
pub mod upload;

pub use camsim_plan::adapter;
pub use context::GpuContext;
pub use session::GpuSession;
