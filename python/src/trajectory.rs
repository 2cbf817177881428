//! Motion of platform and camera at any instants.

use std::sync::Arc;

use camsim::{
    core::{mount::CameraPath, pose::BodyState, sequence::Sequence},
    io::columns::CameraState,
};
use numpy::PyReadonlyArray1;
use pyo3::{prelude::*, types::PyDict};

use crate::arrays::{columns, numbers};

/// Native trajectory; `camsim.Trajectory` is what users see.
#[pyclass(frozen, module = "camsim._camsim")]
#[derive(Debug)]
pub struct Trajectory {
    path: Arc<CameraPath>,
    /// Time of the clock of stamps at path time 0.
    #[pyo3(get)]
    epoch_ns: i64,
}

impl Trajectory {
    pub fn of(sequence: &Sequence) -> Self {
        Self { path: sequence.path.clone(), epoch_ns: sequence.platform_epoch_ns() }
    }
}

#[pymethods]
impl Trajectory {
    /// First and last instant of the log, seconds of path time.
    #[getter]
    fn span_s(&self) -> (f64, f64) {
        self.path.span_s()
    }

    /// States of the platform at instants of path time.
    fn body_at<'py>(&self, py: Python<'py>, t_s: PyReadonlyArray1<'py, f64>) -> PyResult<Bound<'py, PyDict>> {
        let t_s = numbers(&t_s)?;
        let states: Vec<BodyState> =
            py.detach(|| t_s.iter().map(|t_s| self.path.trajectory.state(*t_s)).collect());
        columns(py, &states)
    }

    /// States of the camera at instants of path time.
    fn camera_at<'py>(
        &self,
        py: Python<'py>,
        t_s: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let t_s = numbers(&t_s)?;
        let states: Vec<CameraState> =
            py.detach(|| t_s.iter().map(|t_s| CameraState::at(&self.path, *t_s)).collect());
        columns(py, &states)
    }
}
