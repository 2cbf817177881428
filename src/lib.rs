//! Pictures of a real, imperfect airborne camera, and the truth about them.
//!
//! This package is the program `camsim` and, as a library, one name for the crates behind it.

pub use camsim_cli as cli;
pub use camsim_core as core;
pub use camsim_gpu as gpu;
pub use camsim_io as io;
pub use camsim_lab as lab;
pub use camsim_plan as plan;
pub use camsim_viewer as viewer;
