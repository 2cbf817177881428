//! Errors of the passes.

use crate::{adapter::GpuError, shaders::ComposeError};

/// Why a pass cannot be recorded or read back.
#[derive(Debug, thiserror::Error)]
pub enum PassError {
    /// The device failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The shader files are inconsistent.
    #[error(transparent)]
    Shader(#[from] ComposeError),
}
