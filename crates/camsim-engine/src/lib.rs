//! Renders sequences: plans ahead on other threads, keeps two frames in flight, and runs each pass on the
//! renderer that its plan names.
//!
//! ```no_run
//! use std::{convert::Infallible, sync::Arc};
//!
//! use camsim_core::{scenario::Channel, sequence::Sequence};
//! use camsim_engine::{Engine, RenderError};
//!
//! fn brightness(sequence: Arc<Sequence>) -> Result<(), RenderError<Infallible>> {
//!     let engine = Engine::cpu();
//!     let mut session = engine.session(sequence, &[Channel::Color])?;
//!     session.render(0..10, &mut |finished| {
//!         let frame = finished.frame;
//!         println!("{}: {}", frame.index, frame.color_rgba().iter().sum::<f32>());
//!         Ok(())
//!     })
//! }
//! ```
//!
//! * [`Engine`]: the renderers of this machine ([`camsim_plan::Backend`]).
//! * [`Session`]: one sequence.
//! * [`Finished`]: a frame with its plan and times.
//! * [`CameraReference`]: exact rays of the same camera.
//! * [`verify`]: measured errors of frames beside the predicted ones.

#![warn(missing_docs)]

mod camera_reference;
mod cancel;
mod engine;
mod error;
mod finished;
mod lane;
mod memory;
mod moving;
mod planner_threads;
mod prepare_ahead;
mod session;
mod truth;
pub mod verify;
mod whole_frame;

pub use camera_reference::CameraReference;
#[cfg(feature = "gpu")]
pub use camsim_gpu::GpuContext;
pub use camsim_plan::{
    Backend,
    adapter::{AdapterChoice, AdapterSummary, GpuError, IdealPlanes},
};
pub use engine::{Engine, adapters};
pub use error::RenderError;
pub use finished::{Finished, FrameTimes};
pub use memory::peak_memory_mb;
pub use moving::{MOVING_RAYS, SMALL_LAMP_PX};
pub use session::Session;
