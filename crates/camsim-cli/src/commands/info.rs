//! `camsim info`.

use camsim_engine::{AdapterChoice, AdapterSummary, Engine, adapters};
use camsim_io::write::has_ffmpeg;
use serde::Serialize;

use crate::{backend::BackendArgs, console::Console, failure::Failure};

/// Show what renders, what works on this machine, and what each lack means
#[derive(Debug, clap::Args)]
#[command(
    after_help = "CAMSIM_ADAPTER=part-of-a-name picks another adapter. A software adapter (Mesa's llvmpipe) \
                  runs on the processor:\nthere the cpu renderer makes all passes that it vectorises, and \
                  the adapter the others. --backend cpu needs no adapter\nat all. Pictures of the two differ \
                  by rounding. Exit code 3 if an adapter is demanded and there is none."
)]
pub struct InfoArgs {
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    backend: BackendArgs,
}

#[derive(Serialize)]
struct Info {
    version: &'static str,
    renders: String,
    adapters: Vec<Adapter>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_side_px: Option<u32>,
    #[serde(skip_serializing_if = "Option::is_none")]
    max_storage_buffer_bytes: Option<u64>,
    cpu_threads: usize,
    /// Whether the processor has the vector instructions that make the cpu renderer fast.
    cpu_vectors: bool,
    parts: Vec<Part>,
}

/// Something that a machine or a build may lack.
#[derive(Serialize)]
struct Part {
    name: &'static str,
    here: bool,
    /// What its lack means.
    without: &'static str,
}

/// The interfaces to adapters of this system.
const GRAPHICS: &str = if cfg!(target_os = "macos") {
    "Metal"
} else if cfg!(windows) {
    "Vulkan or DX12"
} else {
    "Vulkan"
};

/// Whether a window can be opened, as far as the environment says.
fn has_display() -> bool {
    !cfg!(target_os = "linux")
        || ["DISPLAY", "WAYLAND_DISPLAY"].iter().any(|name| std::env::var_os(name).is_some())
}

/// What there is, and what each lack means.
fn parts(engine: &Engine) -> Vec<Part> {
    let part = |name, here, without| Part { name, here, without };
    let mut parts = vec![
        part(
            "graphics card",
            engine.adapter().is_some_and(|adapter| !adapter.limits().is_software),
            "the processor renders",
        ),
        part(
            GRAPHICS,
            engine.adapter().is_some(),
            "no --backend gpu and no `camsim viewer`; what the cpu renderer does not vectorise is computed in f64",
        ),
        part(
            "vector instructions",
            engine.capabilities().has_vectors,
            "the cpu renderer is slow (x86-64 needs AVX2, FMA and F16C)",
        ),
        part("ffmpeg", has_ffmpeg(), "no mp4 and mkv; exr, png and y4m need nothing"),
    ];
    parts.push(match (cfg!(feature = "viewer"), has_display()) {
        (false, _) => part("viewer", false, "no `camsim viewer`; build with --features viewer"),
        (true, here) => part("viewer", here, "no display: neither DISPLAY nor WAYLAND_DISPLAY is set"),
    });
    parts.push(part(
        "experiments",
        cfg!(feature = "lab"),
        "no `camsim study`, `bench` and `reproduce`; build with --features lab",
    ));
    parts
}

#[derive(Serialize)]
struct Adapter {
    name: String,
    kind: &'static str,
    backend: String,
    driver: String,
    used: bool,
}

impl Adapter {
    fn of(adapter: AdapterSummary, used: bool) -> Self {
        let AdapterSummary { name, kind, backend, driver } = adapter;
        Self { name, kind, backend, driver, used }
    }
}

/// Prints the adapters of this machine.
pub fn run(args: &InfoArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let engine = args.backend.open()?;
    let info = info(&engine);
    if args.json {
        console.json(&info)?;
        return Ok(());
    }
    console.line(format_args!("camsim {}", crate::version()))?;
    console.line(format_args!("renders on    {}", info.renders))?;
    for adapter in info.adapters.iter().filter(|adapter| !adapter.used) {
        console.line(format_args!(
            "also there    {} ({}, {}, {})",
            adapter.name, adapter.kind, adapter.backend, adapter.driver
        ))?;
    }
    if let (Some(side_px), Some(bytes)) = (info.max_side_px, info.max_storage_buffer_bytes) {
        let mib = bytes >> 20;
        console.line(format_args!(
            "adapter       pictures up to {side_px} px a side, buffers up to {mib} MiB"
        ))?;
    }
    console.line(format_args!("processors    {}", info.cpu_threads))?;
    let (here, lacking): (Vec<&Part>, Vec<&Part>) = info.parts.iter().partition(|part| part.here);
    let names: Vec<&str> = here.iter().map(|part| part.name).collect();
    console.line(format_args!("works here    {}", names.join(", ")))?;
    for part in lacking {
        console.line(format_args!("lacks         {}: {}", part.name, part.without))?;
    }
    Ok(())
}

fn info(engine: &Engine) -> Info {
    let listed = engine.adapter().map_or_else(Vec::new, |_| adapters(AdapterChoice::Best));
    let limits = engine.adapter().map(|adapter| adapter.limits());
    Info {
        version: env!("CARGO_PKG_VERSION"),
        renders: engine.to_string(),
        adapters: listed.into_iter().enumerate().map(|(i, adapter)| Adapter::of(adapter, i == 0)).collect(),
        max_side_px: limits.map(|limits| limits.max_side_px),
        max_storage_buffer_bytes: limits.map(|limits| limits.max_storage_bytes),
        cpu_threads: std::thread::available_parallelism().map_or(1, usize::from),
        cpu_vectors: engine.capabilities().has_vectors,
        parts: parts(engine),
    }
}
