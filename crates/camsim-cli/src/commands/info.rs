//! `camsim info`.

use camsim_engine::{AdapterChoice, AdapterSummary, Engine, adapters};
use serde::Serialize;

use crate::{backend::BackendArgs, console::Console, failure::Failure};

/// Show what renders: graphics adapters with driver and limits, the processor, and which is used
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
        console.line(format_args!("largest side  {side_px} px"))?;
        console.line(format_args!("largest table {} MiB", bytes >> 20))?;
    }
    let vectors = if info.cpu_vectors { "with" } else { "without" };
    console.line(format_args!("processors    {}, {vectors} vector instructions", info.cpu_threads))?;
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
    }
}
