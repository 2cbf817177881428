//! `camsim info`.

use camsim_gpu::{
    Engine,
    context::{AdapterChoice, AdapterSummary, adapters},
};
use serde::Serialize;

use crate::{console::Console, failure::Failure};

/// Show graphics adapters, driver and limits, and which one is used
#[derive(Debug, clap::Args)]
#[command(
    after_help = "CAMSIM_ADAPTER=part-of-a-name picks another adapter. Exit code 3 if there is none.\n\nOn a software adapter the host draws ideal frames and makes output frames from them where it can; CAMSIM_REVERSE=device leaves both to the\nadapter, CAMSIM_REVERSE=host makes all output frames that it can, beside any adapter; CAMSIM_IDEAL=device or host says who draws the ideal\nframes of those. Pictures differ by rounding, and at borders\nof surfaces a little more where ideal frames have four samples a pixel."
)]
pub struct Args {
    /// Print JSON
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Info {
    version: &'static str,
    adapters: Vec<Adapter>,
    max_side_px: u32,
    max_storage_buffer_bytes: u64,
    reverse_on_host: bool,
    /// And whether it draws the ideal frames of those, where it can.
    ideal_on_host: bool,
    cpu_threads: usize,
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

/// Prints what this machine renders with.
pub fn run(args: &Args, console: &mut Console<'_>) -> Result<(), Failure> {
    let engine = Engine::new(AdapterChoice::Best)?;
    let used = engine.gpu().describe();
    let limits = engine.gpu().device.limits();
    let info = Info {
        version: env!("CARGO_PKG_VERSION"),
        adapters: adapters(AdapterChoice::Best)
            .into_iter()
            .enumerate()
            .map(|(i, adapter)| Adapter::of(adapter, i == 0))
            .collect(),
        max_side_px: engine.gpu().max_side_px(),
        max_storage_buffer_bytes: limits.max_storage_buffer_binding_size.min(limits.max_buffer_size),
        reverse_on_host: engine.gpu().reverses_on_host(),
        ideal_on_host: engine.gpu().draws_on_host(),
        cpu_threads: std::thread::available_parallelism().map_or(1, usize::from),
    };
    if args.json {
        console.json(&info)?;
        return Ok(());
    }
    console.line(format_args!("camsim {}", info.version))?;
    console.line(format_args!("used          {used}"))?;
    for adapter in info.adapters.iter().filter(|adapter| !adapter.used) {
        console.line(format_args!(
            "also there    {} ({}, {}, {})",
            adapter.name, adapter.kind, adapter.backend, adapter.driver
        ))?;
    }
    console.line(format_args!("largest side  {} px", info.max_side_px))?;
    console.line(format_args!("largest table {} MiB", info.max_storage_buffer_bytes >> 20))?;
    console.line(format_args!("processors    {}", info.cpu_threads))?;
    Ok(())
}
