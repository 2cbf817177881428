//! Ideal frames and output frames on the processor, without Vulkan or a driver.
//!
//! [`CpuRenderer`] draws the ideal frames of a scene and makes output frames from them, as a
//! [`FramePlan`](camsim_plan::FramePlan) says. The crate `camsim-engine` drives it.
//!
//! * `ideal`: a triangle rasteriser with deferred shading: it finds the visible triangle of each pixel, then
//!   shades each pixel once.
//! * `reverse`: lens map, temporal inverse, gather, photometric stage and truth, vectorised over blocks of
//!   pixels.
//! * `general`: the same in double precision, for every plan that `reverse` does not vectorise.
//! * `silhouettes`: what silhouette rays read of ideal frames, and their march.
//! * `cast`: ideal frames of every scene and plan, by ray casting.
//! * `simd`, `large_pages`: vector instructions and huge memory pages, where processor and system have them.

#![warn(missing_docs)]

mod cast;
#[cfg(test)]
#[path = "../tests/fixtures/mod.rs"]
mod fixtures;
mod general;
mod ideal;
mod large_pages;
mod renderer;
mod reverse;
mod silhouettes;
mod simd;

pub use cast::{Instant, MovingCaster, RayScratch};
pub use general::RowTable;
pub use renderer::{BufferHandle, CpuRenderer, ReverseInputs};
pub use reverse::{IdealTexels, suits_processor};
