//! Adapter and device.

use std::{
    fmt,
    sync::{Arc, LazyLock, Mutex},
};

use crate::layout::Truth;

/// Errors of the GPU side. Texts name the fix.
#[derive(Debug, thiserror::Error)]
pub enum GpuError {
    /// There is nothing to run on.
    #[error(
        "no usable graphics adapter found{0}: install a Vulkan driver (on Debian or Ubuntu without a GPU: `apt-get install mesa-vulkan-drivers libvulkan1`), or set CAMSIM_ADAPTER to part of an adapter's name from `camsim info`"
    )]
    NoAdapter(String),
    /// There are adapters, but none of this name.
    #[error(
        "no adapter has `{wanted}` in its name (CAMSIM_ADAPTER): there is {there}; set CAMSIM_ADAPTER to part of one of these names, or not at all"
    )]
    UnknownAdapter {
        /// As in the environment.
        wanted: String,
        /// What there is, in words.
        there: String,
    },
    /// The adapter would not give a device.
    #[error("adapter `{adapter}` gave no device: {reason}")]
    NoDevice {
        /// Adapter name.
        adapter: String,
        /// What wgpu says.
        reason: String,
    },
    /// The device stopped working.
    #[error(
        "the graphics device was lost or failed: {0}; run again, with fewer or smaller frames if memory ran out"
    )]
    Device(String),
    /// A picture or table does not fit the adapter.
    #[error("{what} needs {needed}, but the adapter's {limit_name} is {limit}: {fix}")]
    TooLarge {
        /// What does not fit.
        what: String,
        /// How much it needs.
        needed: u64,
        /// Name of the limit.
        limit_name: &'static str,
        /// Its value.
        limit: u64,
        /// What to do.
        fix: &'static str,
    },
}

/// Which adapter to use.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AdapterChoice {
    /// `CAMSIM_ADAPTER` (part of a name) if set, else discrete before integrated before software.
    #[default]
    Best,
    /// `CAMSIM_ADAPTER` if set, else a software adapter: tests use it, so that figures compare between
    /// machines unless a GPU is asked for.
    Software,
}

/// What an adapter is, for people.
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

impl AdapterSummary {
    fn of(info: &wgpu::AdapterInfo) -> Self {
        let kind = match info.device_type {
            wgpu::DeviceType::DiscreteGpu => "discrete",
            wgpu::DeviceType::IntegratedGpu => "integrated",
            wgpu::DeviceType::VirtualGpu => "virtual",
            wgpu::DeviceType::Cpu => "software",
            wgpu::DeviceType::Other => "other",
        };
        let driver = format!("{} {}", info.driver, info.driver_info).trim().to_owned();
        Self { name: info.name.clone(), kind, backend: format!("{:?}", info.backend), driver }
    }
}

impl fmt::Display for AdapterSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} ({}, {}, {})", self.name, self.kind, self.backend, self.driver)
    }
}

/// Pixels that a thread takes on a software adapter: reading a line's poses costs llvmpipe up to two fifths
/// of the kernel, and there are few processors to be kept busy (docs/DECISIONS.md, "Gpu
/// renderer").
const SOFTWARE_PIXELS: u32 = 16;

/// Device, queue, and what they run on.
#[derive(Debug)]
pub struct GpuContext {
    /// Logical device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Description of the adapter.
    pub adapter: AdapterSummary,
    /// Whether the device is this machine's processor.
    pub(crate) is_software: bool,
    /// Largest side of a picture that is held whole.
    pub(crate) max_picture_px: u32,
    /// Pixels of a line that a thread of the reverse kernel takes.
    pub(crate) pixels_a_thread: u32,
    /// The first error that the device reported outside of a call.
    fault: Arc<Mutex<Option<String>>>,
}

/// Vulkan, Metal, DirectX 12: what has compute shaders everywhere. GL is not even probed, it prints to stderr
/// on headless machines.
///
/// One for all engines, and never dropped: with the last instance the loader unloads the driver, and NVIDIA's
/// has left something to be done at the end of every thread that called it. A thread that ends after that
/// crashes.
///
/// Arguments of indirect calls come from camsim's own shaders, which bound them; wgpu's check of each would
/// be a pass of its own, and a buffer made for it.
static INSTANCE: LazyLock<wgpu::Instance> = LazyLock::new(|| {
    let from_env = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    let flags = from_env.flags.difference(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: from_env.backends & wgpu::Backends::PRIMARY,
        flags,
        ..from_env
    })
});

/// All adapters of this machine, the one that would be used first.
#[must_use]
pub fn adapters(choice: AdapterChoice) -> Vec<AdapterSummary> {
    ranked(choice).iter().map(|adapter| AdapterSummary::of(&adapter.get_info())).collect()
}

/// Nothing to run on, or nothing of the name that is wanted.
fn none_found(choice: AdapterChoice) -> GpuError {
    let Ok(wanted) = std::env::var("CAMSIM_ADAPTER") else { return GpuError::NoAdapter(String::new()) };
    let there: Vec<String> = named(choice, None)
        .iter()
        .map(|adapter| AdapterSummary::of(&adapter.get_info()).to_string())
        .collect();
    if there.is_empty() {
        return GpuError::NoAdapter(format!(" with CAMSIM_ADAPTER={wanted}"));
    }
    GpuError::UnknownAdapter { wanted, there: there.join("; ") }
}

fn ranked(choice: AdapterChoice) -> Vec<wgpu::Adapter> {
    named(choice, std::env::var("CAMSIM_ADAPTER").ok().map(|name| name.to_lowercase()))
}

fn named(choice: AdapterChoice, wanted: Option<String>) -> Vec<wgpu::Adapter> {
    let rank = |info: &wgpu::AdapterInfo| match (info.device_type, choice) {
        (wgpu::DeviceType::Cpu, AdapterChoice::Software) => 0,
        (wgpu::DeviceType::DiscreteGpu, _) => 1,
        (wgpu::DeviceType::IntegratedGpu, _) => 2,
        (wgpu::DeviceType::VirtualGpu, _) => 3,
        (wgpu::DeviceType::Cpu, _) => 4,
        (wgpu::DeviceType::Other, _) => 5,
    };
    let mut found = pollster::block_on(INSTANCE.enumerate_adapters(wgpu::Backends::PRIMARY));
    found.retain(|adapter| {
        let info = adapter.get_info();
        let of_kind =
            choice == AdapterChoice::Best || wanted.is_some() || info.device_type == wgpu::DeviceType::Cpu;
        let named = wanted.as_ref().is_none_or(|name| info.name.to_lowercase().contains(name));
        of_kind
            && named
            && adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
    });
    found.sort_by_key(|adapter| rank(&adapter.get_info()));
    found
}

/// Keeps the first error that a device reports outside of a call.
fn watch(device: &wgpu::Device) -> Arc<Mutex<Option<String>>> {
    let fault = Arc::new(Mutex::new(None));
    let note = |fault: &Arc<Mutex<Option<String>>>, text: String| {
        if let Ok(mut first) = fault.lock() {
            first.get_or_insert(text);
        }
    };
    let for_errors = fault.clone();
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| note(&for_errors, error.to_string())));
    let for_loss = fault.clone();
    device.set_device_lost_callback(move |reason, text| {
        if reason != wgpu::DeviceLostReason::Destroyed {
            note(&for_loss, text);
        }
    });
    fault
}

impl GpuContext {
    /// Opens the chosen adapter.
    ///
    /// # Errors
    /// [`GpuError::NoAdapter`] with nothing to run on, [`GpuError::NoDevice`] when the adapter refuses.
    pub fn new(choice: AdapterChoice) -> Result<Self, GpuError> {
        let mut candidates = ranked(choice);
        if candidates.is_empty() {
            return Err(none_found(choice));
        }
        let adapter = candidates.remove(0);
        let info = adapter.get_info();
        let summary = AdapterSummary::of(&info);
        let request = adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("camsim"),
            // Only for measuring; nothing else depends on it.
            required_features: adapter.features() & wgpu::Features::TIMESTAMP_QUERY,
            required_limits: adapter.limits(),
            experimental_features: wgpu::ExperimentalFeatures::disabled(),
            memory_hints: wgpu::MemoryHints::Performance,
            trace: wgpu::Trace::Off,
        });
        let (device, queue) = pollster::block_on(request).map_err(|error| GpuError::NoDevice {
            adapter: summary.name.clone(),
            reason: error.to_string(),
        })?;
        let max_picture_px = device.limits().max_texture_dimension_2d;
        let is_software = info.device_type == wgpu::DeviceType::Cpu;
        let pixels_a_thread = if is_software { SOFTWARE_PIXELS } else { 1 };
        let fault = watch(&device);
        Ok(Self { device, queue, adapter: summary, is_software, max_picture_px, pixels_a_thread, fault })
    }

    /// Whether the adapter is a driver that runs on this machine's processor.
    #[must_use]
    pub fn is_software(&self) -> bool {
        self.is_software
    }

    /// Largest side of a picture that is held whole.
    #[must_use]
    pub fn max_picture_px(&self) -> u32 {
        self.max_picture_px
    }

    /// Holds pictures with longer sides in tiles, as if textures ended there: for tests, and where the
    /// device's memory is short.
    pub fn limit_pictures(&mut self, max_side_px: u32) {
        self.max_picture_px = max_side_px.min(self.max_side_px());
    }

    /// Pixels of a row that each thread of the reverse kernel takes, 1 to 4096: by default 16 on a software
    /// adapter and 1 on a card. Pictures are the same, byte for byte.
    pub fn set_pixels_a_thread(&mut self, pixels: u32) {
        self.pixels_a_thread = pixels.clamp(1, 4096);
    }

    /// Most pixels of an output frame with depth and coordinates.
    #[must_use]
    pub fn most_pixels_with_truth(&self) -> u64 {
        self.max_storage_bytes() / size_of::<Truth>() as u64
    }

    /// Fails once the device has reported an error.
    ///
    /// # Errors
    /// [`GpuError::Device`].
    pub fn check(&self) -> Result<(), GpuError> {
        match self.fault.lock().ok().and_then(|fault| fault.clone()) {
            Some(text) => Err(GpuError::Device(text)),
            None => Ok(()),
        }
    }

    /// Largest side of a texture.
    #[must_use]
    pub fn max_side_px(&self) -> u32 {
        self.device.limits().max_texture_dimension_2d
    }

    /// Largest storage buffer, bytes.
    #[must_use]
    pub fn max_storage_bytes(&self) -> u64 {
        let limits = self.device.limits();
        limits.max_storage_buffer_binding_size.min(limits.max_buffer_size)
    }

    /// Refuses what does not fit one storage buffer.
    ///
    /// # Errors
    /// [`GpuError::TooLarge`].
    pub fn check_storage(&self, what: &str, bytes: u64, fix: &'static str) -> Result<(), GpuError> {
        let limit = self.max_storage_bytes();
        if bytes <= limit {
            return Ok(());
        }
        Err(GpuError::TooLarge {
            what: what.into(),
            needed: bytes,
            limit_name: "max_storage_buffer_binding_size (bytes)",
            limit,
            fix,
        })
    }
}
