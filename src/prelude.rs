//! What most programs need: `use camsim::prelude::*`.

use std::{error::Error, path::Path};

pub use std::convert::Infallible as NoError;

pub use camsim_core::{
    frame::{RenderedFrame, RowRecord},
    scenario::{Channel, Scenario},
    sequence::Sequence,
};
pub use camsim_engine::{Backend, Engine, Finished, RenderError, Session};
pub use camsim_io::load::Loaded;
pub use camsim_plan::{FramePlan, Planner};

/// Reads a scenario (TOML) or the `run.json` of an earlier run, and everything that it names.
///
/// # Errors
/// The message names the file, line or key and what to do.
pub fn load(scenario: impl AsRef<Path>) -> Result<Loaded, Box<dyn Error + Send + Sync>> {
    let scenario = camsim_io::scenario_file::read_scenario(scenario.as_ref(), &[], None)?;
    Ok(camsim_io::load::load_sequence(&scenario)?)
}
