//! `camsim explain`: the plan of one frame, without rendering it.

mod camera;
mod report;
mod sensors;
mod text;
mod twins;

use camsim_core::{
    scenario::{Auto, Solver},
    sequence::Sequence,
    timing_faults::Delivery,
};
use camsim_engine::Engine;
use camsim_io::load::Loaded;

use crate::{
    backend::BackendArgs,
    console::Console,
    failure::Failure,
    frame_list::{FrameListError, whole_number},
    inputs::{self, ScenarioArgs},
};

use report::Plans;

/// Show the plan of a frame: passes, sizes, samples, error bounds, and what is skipped and why
#[derive(Debug, clap::Args)]
#[command(after_help = "Example: camsim explain flight.toml --frame 7 --set camera.shutter.exposure_ms=0")]
pub struct ExplainArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
    /// Frame number, from 0
    #[arg(long, default_value_t = 0, value_name = "N", value_parser = whole_number, allow_hyphen_values = true)]
    frame: u64,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    backend: BackendArgs,
}

/// Says where a frame does not arrive, or with another picture.
fn warn_of_delivery(sequence: &Sequence, frame: u64, console: &mut Console<'_>) {
    match sequence.timing_faults().map(|faults| faults.delivery(frame)) {
        Some(Delivery::Dropped) => console.warn(format_args!(
            "frame {frame} is dropped by camera.timing: `render` leaves it out; this is the plan that it would have"
        )),
        Some(Delivery::Doubled(picture)) => console.warn(format_args!(
            "frame {frame} is doubled by camera.timing: it has the picture of frame {picture}, whose plan this is"
        )),
        Some(Delivery::Missed) => console.warn(format_args!(
            "frame {frame} has no trigger by camera.timing: `render` leaves it out; this is the plan that it would have"
        )),
        Some(Delivery::Own) | None => {}
    }
}

/// Loads the scenario and prints the plan of one frame.
pub fn run(args: &ExplainArgs, console: &mut Console<'_>) -> Result<(), Failure> {
    let scenario = args.scenario.read(console)?;
    let loaded = inputs::load(&scenario, console)?;
    let frames = loaded.sequence.frames;
    if args.frame >= frames {
        return Err(Failure::bad_input(FrameListError::Outside {
            asked_by: "--frame",
            frame: args.frame,
            frames,
        }));
    }
    if scenario.quality.solver == Auto::Value(Solver::Reference) {
        console.warn(
            "quality.solver is \"reference\": `render` casts every ray without a plan; this is the plan \
                   of the default solver",
        );
    }
    warn_of_delivery(&loaded.sequence, args.frame, console);
    print(&loaded, &args.backend.open()?, args.frame, args.json, console)
}

fn print(
    loaded: &Loaded,
    engine: &Engine,
    frame: u64,
    as_json: bool,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let plans = Plans::new(loaded, engine, frame)?;
    let report = plans.report(loaded)?;
    if as_json {
        return Ok(console.json(&report)?);
    }
    text::print(&plans, &report, loaded, console)
}

/// What `camsim explain` prints of a frame that exists, as text for people or as JSON.
///
/// # Errors
/// The frame cannot be planned.
pub fn explain(loaded: &Loaded, engine: &Engine, frame: u64, as_json: bool) -> Result<String, Failure> {
    let (mut text, mut notes) = (Vec::new(), Vec::new());
    let mut console = Console::new(&mut text, &mut notes);
    print(loaded, engine, frame, as_json, &mut console)?;
    console.flush()?;
    drop(console);
    Ok(String::from_utf8_lossy(&text).into_owned())
}
