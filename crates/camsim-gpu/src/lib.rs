//! Ideal frames and output frames on a GPU, by wgpu: passes, buffers and read-back. Software adapters (Mesa's
//! lavapipe) count as GPUs.
//!
//! [`GpuContext`] opens an adapter; [`GpuSession`] holds one sequence on it and records the passes of a
//! [`FramePlan`](camsim_plan::FramePlan). It decides nothing itself; the crate `camsim-engine` drives it.
//!
//! Without the feature `wgpu` (on by default in the programs) nothing of wgpu is compiled: opening an adapter
//! fails with [`GpuError::NotBuilt`].
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

mod adapter;
mod error;

#[cfg(not(feature = "wgpu"))]
mod absent;
#[cfg(feature = "wgpu")]
pub mod context;
#[cfg(feature = "wgpu")]
pub mod ideal;
#[cfg(feature = "wgpu")]
pub mod layout;
#[cfg(feature = "wgpu")]
pub mod recorder;
#[cfg(feature = "wgpu")]
pub mod reverse;
#[cfg(feature = "wgpu")]
pub mod session;
#[cfg(feature = "wgpu")]
pub mod shaders;
#[cfg(feature = "wgpu")]
pub mod staging;
#[cfg(feature = "wgpu")]
pub mod tiles;
#[cfg(feature = "wgpu")]
pub mod upload;

#[cfg(not(feature = "wgpu"))]
pub use absent::{context, recorder, session, shaders};
pub use adapter::{AdapterChoice, AdapterSummary, GpuError};
pub use context::GpuContext;
pub use error::PassError;
pub use session::{GpuJob, GpuSession, IdealImages, Readback, Submitted};
