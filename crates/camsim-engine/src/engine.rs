//! The renderers of this machine.

use std::{fmt, sync::Arc};

use camsim_core::{scenario::Channel, sequence::Sequence};
use camsim_plan::{
    AdapterClass, Backend, Capabilities,
    adapter::{Adapter, AdapterChoice, AdapterLimits, AdapterSummary, GpuError},
    uniforms::Truth,
};

use crate::{RenderError, Session};

/// Largest side of an ideal frame where no adapter limits it.
const CPU_MAX_SIDE_PX: u32 = 16_384;

/// The opened adapter, if any, and the renderers that may be used.
#[derive(Debug)]
pub struct Engine {
    gpu: Option<Box<dyn Adapter>>,
    backend: Backend,
    /// The class that plans are made for, if it is not the adapter's own.
    planned_class: Option<AdapterClass>,
}

impl Engine {
    /// Opens an adapter, with [`Backend::Auto`].
    ///
    /// # Errors
    /// There is no usable adapter.
    pub fn new(choice: AdapterChoice) -> Result<Self, GpuError> {
        Ok(Self { gpu: Some(open_adapter(choice)?), backend: automatic(), planned_class: None })
    }

    /// The cpu renderer alone, without opening an adapter or loading a driver.
    #[must_use]
    pub fn cpu() -> Self {
        Self { gpu: None, backend: Backend::Cpu, planned_class: None }
    }

    /// Opens the renderers of a backend: with [`Backend::Auto`] the best adapter, or the cpu alone without
    /// one.
    ///
    /// # Errors
    /// There is no adapter and the backend needs one, or none with the name in `CAMSIM_ADAPTER`.
    pub fn open(backend: Backend) -> Result<Self, GpuError> {
        match backend {
            Backend::Cpu => Ok(Self::cpu()),
            Backend::Auto => match Self::new(AdapterChoice::Best) {
                Err(GpuError::NotBuilt) => Ok(Self::cpu()),
                Err(GpuError::NoAdapter(wanted)) if wanted.is_empty() => Ok(Self::cpu()),
                opened => opened,
            },
            Backend::Gpu | Backend::GpuThenCpu => {
                Ok(Self { gpu: Some(open_adapter(AdapterChoice::Best)?), backend, planned_class: None })
            }
        }
    }

    /// The opened adapter.
    #[must_use]
    pub fn adapter(&self) -> Option<&dyn Adapter> {
        self.gpu.as_deref()
    }

    /// The opened adapter, with its wgpu device.
    #[cfg(feature = "gpu")]
    #[must_use]
    pub fn gpu(&self) -> Option<&camsim_gpu::GpuContext> {
        let adapter: &dyn std::any::Any = self.adapter()?;
        adapter.downcast_ref()
    }

    fn limits(&self) -> Option<AdapterLimits> {
        self.adapter().map(Adapter::limits)
    }

    /// Tiles textures with longer sides in new sessions, as if the adapter had this limit: for tests, and for
    /// cards with little memory.
    pub fn limit_pictures(&mut self, max_side_px: u32) {
        self.gpu.iter_mut().for_each(|gpu| gpu.limit_pictures(max_side_px));
    }

    /// Sets the number of pixels of a row per thread of the gpu's reverse kernel
    /// ([`Adapter::set_pixels_per_thread`]) in new sessions.
    pub fn set_pixels_a_thread(&mut self, pixels: u32) {
        self.gpu.iter_mut().for_each(|gpu| gpu.set_pixels_per_thread(pixels));
    }

    /// Sets the renderers that new sessions may use. Without an adapter it is always the cpu.
    pub fn set_backend(&mut self, backend: Backend) {
        self.backend = backend;
    }

    /// Plans new sessions for an adapter of another class than this machine's: to try plans for graphics cards
    /// on a software adapter. Without an adapter it has no effect.
    pub fn plan_for(&mut self, class: AdapterClass) {
        self.planned_class = Some(class);
    }

    /// Capabilities of this machine, which plans depend on.
    #[must_use]
    pub fn capabilities(&self) -> Capabilities {
        let limits = self.limits();
        let class = |limits: AdapterLimits| match limits.is_software {
            true => AdapterClass::Software,
            false => AdapterClass::Card,
        };
        let adapter = limits.map(|limits| self.planned_class.unwrap_or(class(limits)));
        Capabilities {
            backend: self.backend,
            adapter,
            has_vectors: camsim_cpu::suits_processor(),
            max_picture_px: limits.map_or(u32::MAX, |limits| limits.max_picture_px),
        }
    }

    /// Largest side of an ideal frame, px.
    #[must_use]
    pub fn max_side_px(&self) -> u32 {
        self.limits().map_or(CPU_MAX_SIDE_PX, |limits| limits.max_side_px)
    }

    /// Largest number of pixels of an output frame with depth and coordinates.
    #[must_use]
    pub fn most_pixels_with_truth(&self) -> u64 {
        self.limits().map_or(u64::MAX, |limits| limits.max_storage_bytes / size_of::<Truth>() as u64)
    }

    /// Whether frames are rendered on the processor that also plans them.
    pub(crate) fn shares_processor(&self) -> bool {
        self.limits().is_none_or(|limits| limits.is_software)
    }

    /// Opens a session for a sequence, and uploads its scene if an adapter is open.
    ///
    /// # Errors
    /// The scene is too large for the adapter, or the camera is invalid.
    pub fn session<E: std::error::Error + 'static>(
        &self,
        sequence: Arc<Sequence>,
        channels: &[Channel],
    ) -> Result<Session<'_>, RenderError<E>> {
        Session::new(self, sequence, channels).map_err(RenderError::lift)
    }
}

#[cfg(feature = "gpu")]
fn open_adapter(choice: AdapterChoice) -> Result<Box<dyn Adapter>, GpuError> {
    Ok(Box::new(camsim_gpu::GpuContext::new(choice)?))
}

#[cfg(not(feature = "gpu"))]
fn open_adapter(_: AdapterChoice) -> Result<Box<dyn Adapter>, GpuError> {
    Err(GpuError::NotBuilt)
}

/// All adapters of this machine, the preferred one first; none without the feature `gpu`.
#[must_use]
#[cfg_attr(not(feature = "gpu"), expect(unused_variables, reason = "there are none to choose from"))]
pub fn adapters(choice: AdapterChoice) -> Vec<AdapterSummary> {
    #[cfg(feature = "gpu")]
    return camsim_gpu::context::adapters(choice);
    #[cfg(not(feature = "gpu"))]
    Vec::new()
}

/// The gpu if `CAMSIM_SHADER_DIR` names shader files to try, otherwise automatic.
fn automatic() -> Backend {
    match std::env::var_os("CAMSIM_SHADER_DIR") {
        Some(_) => Backend::Gpu,
        None => Backend::Auto,
    }
}

impl fmt::Display for Engine {
    /// Name of the renderer, for users.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let threads = rayon::current_num_threads();
        match (&self.gpu, self.backend) {
            (None, _) | (_, Backend::Cpu) => write!(f, "cpu ({threads} threads)"),
            (Some(gpu), Backend::Auto) if gpu.limits().is_software && camsim_cpu::suits_processor() => {
                write!(f, "cpu ({threads} threads); {} for what the cpu does not vectorise", gpu.summary())
            }
            (Some(gpu), Backend::GpuThenCpu) => {
                write!(f, "ideal frames {}, output frames cpu", gpu.summary())
            }
            (Some(gpu), _) => write!(f, "{}", gpu.summary()),
        }
    }
}
