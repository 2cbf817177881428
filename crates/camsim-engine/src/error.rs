//! Errors of rendering.

use camsim_plan::{PlanError, adapter::GpuError};

/// Errors of rendering; `E` is the error of the sink.
#[derive(Debug, thiserror::Error)]
pub enum RenderError<E: std::error::Error + 'static> {
    /// The adapter failed.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// Planning failed.
    #[error(transparent)]
    Plan(#[from] PlanError),
    /// The paper's methods do not show things that move.
    #[error(
        "scene.gltf.motion: quality.preset = \"paper\" has no method for things that move: write preset = \
         \"default\", or leave motion out"
    )]
    Moving,
    /// The frame was cancelled ([`crate::Session::set_cancel`]).
    #[error("the frame was cancelled")]
    Cancelled,
    /// The sink failed.
    #[error(transparent)]
    Sink(E),
}

/// Errors of functions without a sink.
pub(crate) type RenderErrorBase = RenderError<std::convert::Infallible>;

impl<E: std::error::Error + 'static> RenderError<E> {
    /// Converts the error to that of a function with a sink.
    pub(crate) fn lift(base: RenderErrorBase) -> Self {
        match base {
            RenderError::Gpu(error) => Self::Gpu(error),
            RenderError::Plan(error) => Self::Plan(error),
            RenderError::Moving => Self::Moving,
            RenderError::Cancelled => Self::Cancelled,
            RenderError::Sink(never) => match never {},
        }
    }
}
