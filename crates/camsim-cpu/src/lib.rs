//! Ideal frames and output frames on this machine's processor: no Vulkan, no driver.
//!
//! [`CpuRenderer`] draws the ideal frames of a scene and makes output frames from them, as a
//! [`FramePlan`](camsim_plan::FramePlan) says. The crate `camsim-engine` feeds it.
//!
//! * `ideal`: a rasteriser of triangles. It finds which triangle each pixel shows, then shades each pixel
//!   once.
//! * `reverse`: lens map, temporal inverse, gather, photometric stage and truth, for blocks of pixels side by
//!   side.
//! * `general`: the same in double precision for every plan that `reverse` does not vectorise.
//! * `cast`: ideal frames of every scene and plan, by rays.
//! * `simd`, `large_pages`: vector instructions and memory in large pages, where the processor and the system
//!   have them.

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
mod simd;

pub use general::RowTable;
pub use renderer::{CpuRenderer, IdealBuffer, ReverseInputs};
pub use reverse::{IdealTexels, suits_processor};
