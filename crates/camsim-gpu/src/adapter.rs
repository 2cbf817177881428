//! What is said of adapters, with and without the feature `wgpu`.

use std::fmt;

/// Errors of the GPU side. Texts name the fix.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// No adapter found; holds the setting of `CAMSIM_ADAPTER`, in words.
    #[error(
        "no usable graphics adapter found{0}: install a Vulkan driver (on Debian or Ubuntu without a GPU: \
         `apt-get install mesa-vulkan-drivers libvulkan1`), or set CAMSIM_ADAPTER to part of an adapter's \
         name from `camsim info`"
    )]
    NoAdapter(String),
    /// The program was built without the feature `gpu`.
    #[error(
        "this camsim was built without the feature `gpu`: use `--backend cpu`, or build it with the default \
         features"
    )]
    NotBuilt,
    /// There are adapters, but none with this name.
    #[error(
        "no adapter has `{wanted_name}` in its name (CAMSIM_ADAPTER): there is {available}; set \
         CAMSIM_ADAPTER to part of one of these names, or not at all"
    )]
    UnknownAdapter {
        /// Value of `CAMSIM_ADAPTER`.
        wanted_name: String,
        /// Available adapters, in words.
        available: String,
    },
    /// The adapter refused to open a device.
    #[error("adapter `{adapter}` gave no device: {reason}")]
    NoDevice {
        /// Adapter name.
        adapter: String,
        /// Error text of wgpu.
        reason: String,
    },
    /// The device stopped working.
    #[error(
        "the graphics device was lost or failed: {0}; run again, with fewer or smaller frames if memory ran \
         out"
    )]
    Device(String),
    /// An image or table exceeds a limit of the adapter.
    #[error("{what} needs {needed}, but the adapter's {limit_name} is {limit}: {fix}")]
    TooLarge {
        /// What does not fit, in words.
        what: String,
        /// Required size, in the unit of the limit.
        needed: u64,
        /// Name of the limit.
        limit_name: &'static str,
        /// Value of the limit.
        limit: u64,
        /// What the user can do.
        fix: &'static str,
    },
}

/// How an adapter is selected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// `CAMSIM_ADAPTER` (part of a name) if set, else discrete before integrated before software.
    #[default]
    Best,
    /// `CAMSIM_ADAPTER` if set, else a software adapter. Tests use it, so that results are comparable between
    /// machines unless a GPU is asked for.
    Software,
}

/// Description of an adapter, for display.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AdapterSummary {
    /// Device name.
    pub name: String,
    /// `discrete`, `integrated`, `virtual`, `software` or `other`.
    pub kind: &'static str,
    /// Graphics API.
    pub backend: String,
    /// Driver name and version.
    pub driver: String,
}

impl fmt::Display for AdapterSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}, {}, {})", self.name, self.kind, self.backend, self.driver)
    }
}
