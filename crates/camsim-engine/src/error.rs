//! What can go wrong while frames are rendered.

use camsim_gpu::{GpuError, PassError};
use camsim_plan::PlanError;

/// Errors of rendering; `E` is the sink's own.
#[derive(Debug, thiserror::Error)]
pub enum RenderError<E: std::error::Error + 'static> {
    /// The adapter or its device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Planning.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The shader files.
    #[error(transparent)]
    Shader(#[from] camsim_gpu::shaders::ComposeError),
    /// The sink that takes the frames.
    #[error(transparent)]
    Sink(E),
}

/// Errors before a sink is involved.
pub(crate) type RenderErrorBase = RenderError<std::convert::Infallible>;

impl<E: std::error::Error + 'static> From<PassError> for RenderError<E> {
    fn from(error: PassError) -> Self {
        match error {
            PassError::Gpu(error) => Self::Gpu(error),
            PassError::Shader(error) => Self::Shader(error),
        }
    }
}

impl<E: std::error::Error + 'static> RenderError<E> {
    /// As the error of a sink of another kind.
    pub(crate) fn lift(base: RenderErrorBase) -> Self {
        match base {
            RenderError::Gpu(error) => Self::Gpu(error),
            RenderError::Plan(error) => Self::Plan(error),
            RenderError::Shader(error) => Self::Shader(error),
            RenderError::Sink(never) => match never {},
        }
    }
}
