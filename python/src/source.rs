//! Where a scenario comes from: a file or text, with changes on top.

use std::{
    path::PathBuf,
    sync::{Arc, OnceLock},
};

use camsim::{
    cli::frame_source::with_reference,
    core::{
        scenario::{Preset, Rig, Scenario as Keys},
        twin::scenario_of,
    },
    io::scenario_file::{RandomScenario, ScenarioError, parse_random_scenario, read_random_scenario},
};
use pyo3::PyResult;

use crate::{
    engine::Renderer,
    error::{OrRaise, input_error, raise},
};

/// Where a scenario comes from.
#[derive(Clone, Debug)]
pub struct Source {
    path: PathBuf,
    /// Text of the file; `None` for a `run.json`, which is read again.
    text: Option<String>,
    sets: Vec<(String, String)>,
    preset: Option<Preset>,
    /// What was read, with these changes: thousands of variations are made of it.
    read: Arc<OnceLock<RandomScenario>>,
    /// Which variation of a scenario with `[randomize]` it is.
    pub variation: Option<u64>,
    /// Which twin of the frames, and which picture of a burst.
    pub twin: Option<(String, Option<u32>)>,
    pub renderer: Renderer,
}

impl Source {
    /// A file, read at once, with changes on top.
    ///
    /// # Errors
    /// The message says what is wrong with the file.
    pub fn of_file(
        path: PathBuf,
        sets: Vec<(String, String)>,
        preset: Option<Preset>,
        renderer: Renderer,
    ) -> PyResult<Self> {
        let mut source = Self { sets, preset, ..Self::of_text(path, None, renderer) };
        source.random().or_input_error()?;
        let text = std::fs::read_to_string(&source.path).unwrap_or_default();
        let text = text.strip_prefix('\u{feff}').unwrap_or(&text);
        source.text = (!is_json(text)).then(|| text.to_owned());
        Ok(source)
    }

    /// Text of TOML; relative paths are those of a file at `path`.
    pub fn of_text(path: PathBuf, text: Option<String>, renderer: Renderer) -> Self {
        let (sets, read) = (Vec::new(), Arc::default());
        Self { path, text, sets, preset: None, read, variation: None, twin: None, renderer }
    }

    /// Adds changes.
    pub fn set(&mut self, sets: Vec<(String, String)>) {
        self.sets.extend(sets);
        self.read = Arc::default();
    }

    /// The scenario with its `[randomize]`.
    pub fn random(&self) -> Result<&RandomScenario, ScenarioError> {
        if let Some(read) = self.read.get() {
            return Ok(read);
        }
        let read = match &self.text {
            Some(text) if self.preset.is_none() => parse_random_scenario(text, &self.path, &self.sets),
            _ => read_random_scenario(&self.path, &self.sets, self.preset),
        }?;
        Ok(self.read.get_or_init(|| read))
    }

    /// The scenario of each camera.
    pub fn rig(&self) -> PyResult<Rig> {
        let scenario = self.random().or_input_error()?;
        let mut rig = match self.variation {
            None => scenario.base().clone(),
            Some(index) => scenario.variation(index).or_input_error()?.rig,
        };
        if self.renderer == Renderer::Reference {
            rig = rig.try_map(with_reference).map_err(|failure| raise(&failure))?;
        }
        match &self.twin {
            None => Ok(rig),
            Some((name, instant)) => rig.try_map(|keys| twin_of(&keys, name, *instant)),
        }
    }
}

/// The scenario of a twin's pictures, of number `instant` if it is a burst.
fn twin_of(keys: &Keys, name: &str, instant: Option<u32>) -> PyResult<Keys> {
    let twins = &keys.output.twin;
    let Some(twin) = twins.iter().find(|twin| twin.name == name) else {
        let names: Vec<&str> = twins.iter().map(|twin| twin.name.as_str()).collect();
        return Err(input_error(match names.is_empty() {
            true => format!("twin {name:?}: the scenario has no [[output.twin]]"),
            false => {
                format!("twin {name:?}: there is no such [[output.twin]]; there are {}", names.join(", "))
            }
        }));
    };
    if !twin.instants().any(|known| known == instant) {
        return Err(input_error(match twin.instants {
            None => format!("twin {name:?} is one picture of each frame: leave the instant out"),
            Some(count) => format!("twin {name:?} is a burst: the instant is 0 to {}", count - 1),
        }));
    }
    scenario_of(keys, twin, instant).or_input_error()
}

/// Whether a file is a `run.json`: no TOML file begins with a brace.
fn is_json(text: &str) -> bool {
    text.trim_start().starts_with('{')
}
