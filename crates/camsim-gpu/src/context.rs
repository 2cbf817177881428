//! Adapter and device.

use std::sync::{Arc, LazyLock, Mutex};

use crate::adapter::{AdapterChoice, AdapterSummary, GpuError};

fn summary_of(info: &wgpu::AdapterInfo) -> AdapterSummary {
    let kind = match info.device_type {
        wgpu::DeviceType::DiscreteGpu => "discrete",
        wgpu::DeviceType::IntegratedGpu => "integrated",
        wgpu::DeviceType::VirtualGpu => "virtual",
        wgpu::DeviceType::Cpu => "software",
        wgpu::DeviceType::Other => "other",
    };
    let driver = format!("{} {}", info.driver, info.driver_info).trim().to_owned();
    AdapterSummary { name: info.name.clone(), kind, backend: format!("{:?}", info.backend), driver }
}

/// Pixels per thread of the reverse kernel on a software adapter: reading a line's poses costs llvmpipe up to
/// two fifths of the kernel, and there are few processors to keep busy (docs/theory/DECISIONS.md,
/// "Gpu renderer").
const SOFTWARE_PIXELS_PER_THREAD: u32 = 16;

/// An open adapter: device and queue.
#[derive(Debug)]
pub struct GpuContext {
    /// Logical device.
    pub device: wgpu::Device,
    /// Queue of the device.
    pub queue: wgpu::Queue,
    /// Description of the adapter.
    pub adapter: AdapterSummary,
    /// Whether the driver runs on this machine's processor.
    pub(crate) is_software: bool,
    /// Largest side of a texture that is not split into tiles, pixels.
    pub(crate) max_picture_px: u32,
    /// Pixels of a line per thread of the reverse kernel.
    pub(crate) pixels_per_thread: u32,
    /// First error that the device reported outside of a call.
    fault: Arc<Mutex<Option<String>>>,
}

/// The wgpu instance. Vulkan, Metal and DirectX 12 have compute shaders everywhere; GL is not even probed, as
/// it prints to stderr on headless machines.
///
/// There is one instance for all engines, and it is never dropped: with the last instance the loader unloads
/// the driver, but NVIDIA's has registered a destructor for every thread that called it. A thread that ends
/// after the unloading crashes.
///
/// Validation of indirect calls is off: their arguments come from camsim's own shaders, which bound them, and
/// wgpu's check would be an extra pass and buffer for each.
static INSTANCE: LazyLock<wgpu::Instance> = LazyLock::new(|| {
    let from_env = wgpu::InstanceDescriptor::new_without_display_handle_from_env();
    let flags = from_env.flags.difference(wgpu::InstanceFlags::VALIDATION_INDIRECT_CALL);
    wgpu::Instance::new(wgpu::InstanceDescriptor {
        backends: from_env.backends & wgpu::Backends::PRIMARY,
        flags,
        ..from_env
    })
});

/// All adapters of this machine, the preferred one first.
#[must_use]
pub fn adapters(choice: AdapterChoice) -> Vec<AdapterSummary> {
    ranked_adapters(choice).iter().map(|adapter| summary_of(&adapter.get_info())).collect()
}

/// Error for an empty list of adapters.
fn no_adapter_error(choice: AdapterChoice) -> GpuError {
    let Ok(wanted_name) = std::env::var("CAMSIM_ADAPTER") else { return GpuError::NoAdapter(String::new()) };
    let available: Vec<String> = adapters_named(choice, None)
        .iter()
        .map(|adapter| summary_of(&adapter.get_info()).to_string())
        .collect();
    if available.is_empty() {
        return GpuError::NoAdapter(format!(" with CAMSIM_ADAPTER={wanted_name}"));
    }
    GpuError::UnknownAdapter { wanted_name, available: available.join("; ") }
}

fn ranked_adapters(choice: AdapterChoice) -> Vec<wgpu::Adapter> {
    adapters_named(choice, std::env::var("CAMSIM_ADAPTER").ok().map(|name| name.to_lowercase()))
}

fn adapters_named(choice: AdapterChoice, wanted_name: Option<String>) -> Vec<wgpu::Adapter> {
    let preference = |info: &wgpu::AdapterInfo| match (info.device_type, choice) {
        (wgpu::DeviceType::Cpu, AdapterChoice::Software) => 0,
        (wgpu::DeviceType::DiscreteGpu, _) => 1,
        (wgpu::DeviceType::IntegratedGpu, _) => 2,
        (wgpu::DeviceType::VirtualGpu, _) => 3,
        (wgpu::DeviceType::Cpu, _) => 4,
        (wgpu::DeviceType::Other, _) => 5,
    };
    let mut adapters = pollster::block_on(INSTANCE.enumerate_adapters(wgpu::Backends::PRIMARY));
    adapters.retain(|adapter| {
        let info = adapter.get_info();
        let is_allowed_kind = choice == AdapterChoice::Best
            || wanted_name.is_some()
            || info.device_type == wgpu::DeviceType::Cpu;
        let adapters_named = wanted_name.as_ref().is_none_or(|name| info.name.to_lowercase().contains(name));
        is_allowed_kind
            && adapters_named
            && adapter.get_downlevel_capabilities().flags.contains(wgpu::DownlevelFlags::COMPUTE_SHADERS)
    });
    adapters.sort_by_key(|adapter| preference(&adapter.get_info()));
    adapters
}

/// Installs callbacks that keep the first error that the device reports outside of a call.
fn record_faults(device: &wgpu::Device) -> Arc<Mutex<Option<String>>> {
    let fault = Arc::new(Mutex::new(None));
    let record = |fault: &Arc<Mutex<Option<String>>>, text: String| {
        if let Ok(mut first) = fault.lock() {
            first.get_or_insert(text);
        }
    };
    let for_errors = fault.clone();
    device.on_uncaptured_error(Arc::new(move |error: wgpu::Error| record(&for_errors, error.to_string())));
    let for_loss = fault.clone();
    device.set_device_lost_callback(move |reason, text| {
        if reason != wgpu::DeviceLostReason::Destroyed {
            record(&for_loss, text);
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
        let mut candidates = ranked_adapters(choice);
        if candidates.is_empty() {
            return Err(no_adapter_error(choice));
        }
        let adapter = candidates.remove(0);
        let info = adapter.get_info();
        let summary = summary_of(&info);
        let request = adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("camsim"),
            // Time stamps serve measurements only.
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
        let pixels_per_thread = if is_software { SOFTWARE_PIXELS_PER_THREAD } else { 1 };
        let fault = record_faults(&device);
        Ok(Self { device, queue, adapter: summary, is_software, max_picture_px, pixels_per_thread, fault })
    }

    /// Fails if the device has reported an error.
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

    /// Checks that a storage buffer of this size fits.
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
