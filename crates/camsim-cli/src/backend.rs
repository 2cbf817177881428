//! `--backend`: which renderer makes the frames.

use camsim_engine::{Engine, GpuError};

/// `--backend`, for commands that render.
#[derive(Clone, Copy, Debug, Default, clap::Args)]
pub struct BackendArgs {
    /// Renderer [default: gpu on a graphics card, cpu elsewhere]
    #[arg(long, value_enum)]
    backend: Option<EngineBackend>,
}

/// A renderer of the engine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum EngineBackend {
    /// This machine's processor alone; needs no Vulkan driver
    Cpu,
    /// The graphics adapter alone, a software adapter where there is no card
    Gpu,
}

impl BackendArgs {
    /// Opens what renders.
    pub fn open(self) -> Result<Engine, GpuError> {
        open(self.backend)
    }
}

/// Opens what renders, by [`camsim_engine::Backend::Auto`] if nothing is named.
pub fn open(backend: Option<EngineBackend>) -> Result<Engine, GpuError> {
    Engine::open(match backend {
        None => camsim_engine::Backend::Auto,
        Some(EngineBackend::Cpu) => camsim_engine::Backend::Cpu,
        Some(EngineBackend::Gpu) => camsim_engine::Backend::Gpu,
    })
}
