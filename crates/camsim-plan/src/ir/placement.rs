//! Who makes the passes of a frame, and what the machine has.

use std::fmt;

use serde::Serialize;

/// A renderer of passes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Renderer {
    /// Vectorised code on this machine's processor.
    Cpu,
    /// An adapter of wgpu.
    #[default]
    Gpu,
}

impl fmt::Display for Renderer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Cpu => "cpu",
            Self::Gpu => "gpu",
        })
    }
}

/// Who makes the passes of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize)]
pub struct Placement {
    /// The ideal frames.
    pub ideal: Renderer,
    /// The output frame, from lens map to noise.
    pub reverse: Renderer,
}

impl Placement {
    /// All passes by one renderer.
    #[must_use]
    pub fn all(renderer: Renderer) -> Self {
        Self { ideal: renderer, reverse: renderer }
    }
}

/// Which renderers may be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Backend {
    /// A graphics card where there is one, else the cpu where it is faster than a software adapter.
    #[default]
    Auto,
    /// The cpu alone; no adapter is opened.
    Cpu,
    /// The gpu alone.
    Gpu,
    /// Ideal frames by the gpu, output frames by the cpu where it vectorises their plan: for comparisons.
    GpuThenCpu,
}

/// What an adapter is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AdapterClass {
    /// A processor of its own.
    Card,
    /// A driver that runs on this machine's processor.
    Software,
}

/// What the machine has, as far as plans depend on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capabilities {
    /// Which renderers may be used.
    pub backend: Backend,
    /// The adapter, if one is open.
    pub adapter: Option<AdapterClass>,
    /// Whether the processor has the vector instructions that make the cpu renderer fast.
    pub has_vectors: bool,
    /// Largest side of a picture that the adapter holds in one texture.
    pub max_picture_px: u32,
}

impl Capabilities {
    /// Whether a graphics card makes the ideal frames.
    #[must_use]
    pub fn draws_on_card(&self) -> bool {
        self.adapter == Some(AdapterClass::Card) && self.backend != Backend::Cpu
    }
}

impl Default for Capabilities {
    /// A graphics card with usual limits.
    fn default() -> Self {
        Self {
            backend: Backend::Auto,
            adapter: Some(AdapterClass::Card),
            has_vectors: true,
            max_picture_px: 16_384,
        }
    }
}
