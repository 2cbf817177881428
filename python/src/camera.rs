//! A camera as files describe it.

use std::path::PathBuf;

use camsim::{
    core::scenario::CameraSpec,
    io::{formats::reading::import_camera_named, scenario_file::read_checked_camera},
};
use pyo3::prelude::*;

use crate::{error::OrRaise, lens::Lens};

/// Native camera: the keys of `[camera]`.
#[pyclass(frozen, module = "camsim._camsim")]
#[derive(Debug)]
pub struct Camera {
    pub spec: CameraSpec,
}

#[pymethods]
impl Camera {
    /// Reads a CAMERA.toml, or another program's calibration, in which `camera` is the name of one of several.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf, camera: Option<&str>) -> PyResult<Self> {
        let is_toml = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("toml"));
        let spec = py.detach(|| match is_toml {
            true => read_checked_camera(&path).or_input_error(),
            false => Ok(import_camera_named(&path, None, camera).or_input_error()?.spec),
        })?;
        Ok(Self { spec })
    }

    /// Its lens at its own zoom.
    fn lens(&self) -> PyResult<Lens> {
        Lens::of_spec(&self.spec)
    }
}
