//! A scenario with what it has loaded.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, Mutex},
};

use camsim::{
    cli::{self, failure::Failure},
    core::{
        scenario::{Channel, Preset, Rig},
        sequence::Sequence,
    },
    engine::verify::Verification,
    io::{
        builtin,
        load::{LoadError, Loaded, load_sequence, reload_sequence},
        portable::portable_rig,
        scenario_file::{self, RANDOMIZE, RandomScenario, drawn_json, rig_json, rig_table},
    },
};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    camera::Camera,
    engine::{Renderer, SessionKey, SessionPool, in_own_pool, lock},
    error::{OrRaise, input_error, raise},
    pictures::board_of,
    sensors,
    source::Source,
    stream::{FrameNumbers, Stream, render_one},
    trajectory::Trajectory,
};

const NO_SENSOR: &str =
    "channels: \"raw\" holds the digital numbers of an image sensor; add [camera.sensor], or leave it out";

/// A checked scenario of one camera, with the cameras beside it.
#[derive(Clone)]
struct State {
    source: Source,
    rig: Arc<Rig>,
    camera: usize,
    loaded: Option<Arc<Loaded>>,
    /// What was loaded before the last change, to be reused.
    before: Option<Arc<Loaded>>,
}

/// Native scenario; `camsim.Scenario` is what users see.
#[pyclass(frozen, module = "camsim._camsim")]
pub struct Scenario {
    state: Mutex<State>,
    sessions: SessionPool,
}

impl std::fmt::Debug for Scenario {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Scenario").field("source", &self.snapshot().source).finish_non_exhaustive()
    }
}

impl Scenario {
    fn new(source: Source, camera: Option<&str>) -> PyResult<Self> {
        let rig = source.rig()?;
        let camera = match camera {
            None => 0,
            Some(name) => rig.position(name).ok_or_else(|| no_camera(&rig, name))?,
        };
        let state = State { source, rig: Arc::new(rig), camera, loaded: None, before: None };
        Ok(Self { state: Mutex::new(state), sessions: SessionPool::default() })
    }

    /// Another scenario, that shares what the change does not touch.
    fn with_source(&self, change: impl FnOnce(&mut Source)) -> PyResult<Self> {
        let mut state = self.snapshot();
        change(&mut state.source);
        state.rig = Arc::new(state.source.rig()?);
        state.camera = state.camera.min(state.rig.scenarios().len() - 1);
        state.before = state.loaded.take().or(state.before);
        Ok(Self { state: Mutex::new(state), sessions: self.sessions.clone() })
    }

    fn snapshot(&self) -> State {
        lock(&self.state).clone()
    }

    /// What the scenario names, loaded at the first use after a change.
    fn loaded(&self) -> Result<Arc<Loaded>, LoadError> {
        let mut state = lock(&self.state);
        if let Some(loaded) = &state.loaded {
            return Ok(loaded.clone());
        }
        let scenario = &state.rig.scenarios()[state.camera];
        let loaded = in_own_pool(|| match &state.before {
            Some(before) => reload_sequence(scenario, before),
            None => load_sequence(scenario),
        })?;
        let loaded = Arc::new(loaded);
        state.before = None;
        state.loaded = Some(loaded.clone());
        Ok(loaded)
    }

    fn sequence(&self, py: Python<'_>) -> PyResult<Arc<Sequence>> {
        Ok(py.detach(|| self.loaded()).or_input_error()?.sequence.clone())
    }

    fn key(&self, py: Python<'_>, channels: Option<Vec<String>>) -> PyResult<SessionKey> {
        let sequence = self.sequence(py)?;
        let channels = match channels {
            None => sequence.scenario.output.channels.clone(),
            Some(names) => names.iter().map(|name| channel(name)).collect::<PyResult<_>>()?,
        };
        if channels.contains(&Channel::Raw) && sequence.scenario.camera.sensor.is_none() {
            return Err(input_error(NO_SENSOR));
        }
        let renderer = self.snapshot().source.renderer.of_sequence(&sequence);
        Ok(SessionKey { renderer, sequence, channels })
    }
}

fn no_camera(rig: &Rig, name: &str) -> PyErr {
    let names = rig.names().collect::<Vec<_>>().join(", ");
    input_error(match rig.is_list() {
        true => format!("camera {name:?}: there is no such camera; the cameras are {names}"),
        false => format!("camera {name:?}: the scenario has one [camera]; leave it out"),
    })
}

fn channel(name: &str) -> PyResult<Channel> {
    Channel::named(name).ok_or_else(|| {
        let names = Channel::NAMES.join(", ");
        input_error(format!("channel {name:?}: there is no such channel; the channels are {names}"))
    })
}

fn renderer(name: &str) -> PyResult<Renderer> {
    Renderer::by_name(name).ok_or_else(|| {
        input_error(format!("backend {name:?}: there are \"auto\", \"cpu\", \"gpu\" and \"reference\""))
    })
}

fn preset(name: Option<&str>) -> PyResult<Option<Preset>> {
    match name {
        None => Ok(None),
        Some("default") => Ok(Some(Preset::Default)),
        Some("paper") => Ok(Some(Preset::Paper)),
        Some(name) => Err(input_error(format!("preset {name:?}: there are \"default\" and \"paper\""))),
    }
}

#[pymethods]
impl Scenario {
    /// Reads a scenario file or `run.json`, with changes on top.
    #[staticmethod]
    #[pyo3(signature = (path, sets, preset_name, camera, backend))]
    fn load(
        py: Python<'_>,
        path: PathBuf,
        sets: Vec<(String, String)>,
        preset_name: Option<&str>,
        camera: Option<&str>,
        backend: &str,
    ) -> PyResult<Self> {
        let (preset, renderer) = (preset(preset_name)?, renderer(backend)?);
        py.detach(|| Self::new(Source::of_file(path, sets, preset, renderer)?, camera))
    }

    /// A scenario from TOML text; relative paths are those of a file at `path`.
    #[staticmethod]
    fn parse(
        py: Python<'_>,
        text: String,
        path: PathBuf,
        camera: Option<&str>,
        backend: &str,
    ) -> PyResult<Self> {
        let source = Source::of_text(path, Some(text), renderer(backend)?);
        py.detach(|| Self::new(source, camera))
    }

    /// Another scenario with changes on top, that shares what these do not touch.
    fn changed(&self, py: Python<'_>, sets: Vec<(String, String)>) -> PyResult<Self> {
        py.detach(|| self.with_source(|source| source.set(sets)))
    }

    /// Variation `index` of a scenario with `[randomize]`.
    fn variation(&self, py: Python<'_>, index: u64) -> PyResult<Self> {
        py.detach(|| self.with_source(|source| source.variation = Some(index)))
    }

    /// The scenario of a twin's pictures, of number `instant` if it is a burst.
    fn twin(&self, py: Python<'_>, name: String, instant: Option<u32>) -> PyResult<Self> {
        py.detach(|| self.with_source(|source| source.twin = Some((name, instant))))
    }

    /// Number of the variation that it is.
    #[getter]
    fn variation_index(&self) -> Option<u64> {
        self.snapshot().source.variation
    }

    /// Whether it has `[randomize]`.
    #[getter]
    fn is_random(&self) -> PyResult<bool> {
        Ok(self.snapshot().source.random().or_input_error()?.is_random())
    }

    /// Number of variations, if it is stated.
    #[getter]
    fn variations(&self) -> PyResult<Option<u64>> {
        Ok(self.snapshot().source.random().or_input_error()?.variations())
    }

    /// What variation `index` draws, as JSON by key.
    fn drawn(&self, index: u64) -> PyResult<String> {
        let source = self.snapshot().source;
        let values = drawn_json(&source.random().or_input_error()?.drawn(index).or_input_error()?);
        Ok(serde_json::Value::Object(values).to_string())
    }

    /// Checks variations, from `first` to before `end`.
    fn check_variations(&self, py: Python<'_>, first: u64, end: u64) -> PyResult<()> {
        let source = self.snapshot().source;
        let indices: Vec<u64> = (first..end).collect();
        py.detach(|| in_own_pool(|| source.random()?.check(&indices))).or_input_error()
    }

    /// Becomes a changed scenario.
    fn take(&self, py: Python<'_>, changed: &Self) {
        py.detach(|| *lock(&self.state) = changed.snapshot());
    }

    /// The same scenario of another of its cameras.
    fn of_camera(&self, py: Python<'_>, name: &str) -> PyResult<Self> {
        py.detach(|| {
            let mut state = self.snapshot();
            state.camera = state.rig.position(name).ok_or_else(|| no_camera(&state.rig, name))?;
            state.before = state.loaded.take().or(state.before);
            Ok(Self { state: Mutex::new(state), sessions: SessionPool::default() })
        })
    }

    /// Reads the files that the scenario names, if that was not done; returns warnings.
    fn warnings(&self, py: Python<'_>) -> PyResult<Vec<String>> {
        Ok(py.detach(|| self.loaded()).or_input_error()?.warnings.clone())
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        usize::try_from(self.sequence(py)?.frames)
            .map_err(|_| crate::error::too_large("the number of frames"))
    }

    /// Name of the camera; empty where it has none.
    #[getter]
    fn camera(&self) -> String {
        let state = self.snapshot();
        state.rig.scenarios()[state.camera].camera.name.clone()
    }

    /// Names of all cameras.
    #[getter]
    fn cameras(&self) -> Vec<String> {
        self.snapshot().rig.names().map(str::to_owned).collect()
    }

    /// Names of the channels of `output.channels`.
    #[getter]
    fn channels(&self) -> Vec<String> {
        let state = self.snapshot();
        let channels = &state.rig.scenarios()[state.camera].output.channels;
        channels.iter().map(|channel| channel.name().to_owned()).collect()
    }

    /// Encoding of pictures: `camera.photometric.output`.
    #[getter]
    fn encoding(&self) -> PyResult<String> {
        let state = self.snapshot();
        let encoding = state.rig.scenarios()[state.camera].camera.photometric.output;
        let name = toml::Value::try_from(encoding).or_run_error()?;
        Ok(name.as_str().unwrap_or_default().to_owned())
    }

    /// Name of the renderer.
    #[getter]
    fn backend(&self) -> &'static str {
        self.snapshot().source.renderer.name()
    }

    /// Every key with its value, as JSON; with `absolute` all paths are, and `[randomize]` is among the keys.
    fn json(&self, absolute: bool) -> PyResult<String> {
        let State { rig, source, .. } = self.snapshot();
        // Values are drawn for the camera before it is resized.
        let draws = if absolute && source.variation.is_none() {
            Some(source.random().or_input_error()?).filter(|random| random.is_random())
        } else {
            None
        };
        let rig = draws.map_or(&*rig, RandomScenario::stated);
        // Nothing is near the root, so that paths relative to it are absolute ones.
        let tree = if absolute { portable_rig(rig, Path::new("/")) } else { rig_json(rig) };
        let mut tree = tree.or_run_error()?;
        if let Some(draws) = draws {
            let table = draws.randomize_table().or_input_error()?;
            if let (Some(table), Some(root)) = (table, tree.as_object_mut()) {
                root.insert(RANDOMIZE.into(), table);
            }
        }
        Ok(tree.to_string())
    }

    /// Every key with its value, as TOML.
    fn toml(&self) -> PyResult<String> {
        let table = rig_table(&self.snapshot().rig).or_run_error()?;
        toml::to_string(&table).or_run_error()
    }

    /// The keys of the camera.
    fn camera_keys(&self) -> Camera {
        let state = self.snapshot();
        Camera { spec: state.rig.scenarios()[state.camera].camera.clone() }
    }

    /// Motion of platform and camera.
    fn trajectory(&self, py: Python<'_>) -> PyResult<Trajectory> {
        Ok(Trajectory::of(&*self.sequence(py)?))
    }

    /// Columns of the samples of a sensor.
    fn samples<'py>(&self, py: Python<'py>, kind: &str, name: Option<&str>) -> PyResult<Bound<'py, PyDict>> {
        let loaded = py.detach(|| self.loaded()).or_input_error()?;
        sensors::samples(py, &loaded.sensors, kind, name)
    }

    /// The board of the scene.
    fn board<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyDict>>> {
        let loaded = py.detach(|| self.loaded()).or_input_error()?;
        board_of(py, &loaded)
    }

    /// Number, name and class of every object of the scene.
    fn objects(&self, py: Python<'_>) -> PyResult<Vec<(String, u16)>> {
        let sequence = self.sequence(py)?;
        Ok(sequence.scene.objects.iter().map(|object| (object.name.clone(), object.class)).collect())
    }

    /// One frame.
    fn render_one<'py>(
        &self,
        py: Python<'py>,
        frame: u64,
        channels: Option<Vec<String>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let key = self.key(py, channels)?;
        let delivery = py.detach(|| render_one(&self.sessions, &key, frame))?;
        delivery.into_dict(py, &key.channels)
    }

    /// The plan of a frame, as text for people or as JSON.
    fn explain(&self, py: Python<'_>, frame: u64, as_json: bool) -> PyResult<String> {
        let loaded = py.detach(|| self.loaded()).or_input_error()?;
        let renderer = self.snapshot().source.renderer;
        py.detach(|| cli::explain(&loaded, renderer.engine()?, frame, as_json))
            .map_err(|failure| raise(&failure))
    }

    /// Measured errors of frames beside the predicted ones, as JSON.
    fn verify(&self, py: Python<'_>, frames: Option<Vec<u64>>, with_pictures: bool) -> PyResult<String> {
        let sequence = self.sequence(py)?;
        let renderer = self.snapshot().source.renderer;
        let report = py.detach(|| {
            Verification::new(renderer.engine()?, &sequence, frames, with_pictures)?
                .run::<Failure>(&mut |_| Ok(()))
        });
        serde_json::to_string(&report.map_err(|failure| raise(&failure))?).or_run_error()
    }

    /// `count` frames from `first` on by `step`, rendered ahead.
    fn stream(
        &self,
        py: Python<'_>,
        first: u64,
        step: i64,
        count: u64,
        channels: Option<Vec<String>>,
    ) -> PyResult<Stream> {
        let key = self.key(py, channels)?;
        Stream::begin(self.sessions.clone(), key, FrameNumbers { first, step, count })
    }
}

/// Writes the built-in flight to a folder, and returns the path of its scenario.
#[pyfunction]
pub fn unpack_demo(folder: PathBuf) -> PyResult<PathBuf> {
    builtin::unpack(&folder).or_run_error()
}

/// Every key of a scenario file, as `camsim render --print-default` prints it.
#[pyfunction]
pub fn default_scenario() -> String {
    scenario_file::print_default()
}
