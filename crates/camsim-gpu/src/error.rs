//! Faults of the passes.

use crate::{context::GpuError, shaders::ComposeError};

/// Why a pass cannot be recorded or read.
#[derive(Debug, thiserror::Error)]
pub enum PassError {
    /// The device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The shader files.
    #[error(transparent)]
    Shader(#[from] ComposeError),
}
