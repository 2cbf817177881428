//! Motion of platform and camera at any instants.

use std::sync::Arc;

use camsim::core::{mount::CameraPath, pose::BodyState, sequence::Sequence};
use glam::{DQuat, DVec3};
use numpy::PyReadonlyArray1;
use pyo3::{prelude::*, types::PyDict};

use crate::arrays::{numbers, quaternions, vectors};

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

/// Motion of the camera at one instant.
struct CameraState {
    position_ned_m: DVec3,
    ned_from_camera: DQuat,
    velocity_ned_m_s: DVec3,
    rate_camera_rad_s: DVec3,
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
        let dict = PyDict::new(py);
        dict.set_item("position_ned_m", vectors(py, &states, |state| state.position_ned_m)?)?;
        dict.set_item("velocity_ned_m_s", vectors(py, &states, |state| state.velocity_ned_m_s)?)?;
        dict.set_item("acceleration_ned_m_s2", vectors(py, &states, |state| state.acceleration_ned_m_s2)?)?;
        dict.set_item("ned_from_body_wxyz", quaternions(py, &states, |state| state.ned_from_body)?)?;
        dict.set_item("rate_body_rad_s", vectors(py, &states, |state| state.rate_body_rad_s)?)?;
        let angular = vectors(py, &states, |state| state.angular_acceleration_body_rad_s2)?;
        dict.set_item("angular_acceleration_body_rad_s2", angular)?;
        Ok(dict)
    }

    /// States of the camera at instants of path time.
    fn camera_at<'py>(
        &self,
        py: Python<'py>,
        t_s: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let t_s = numbers(&t_s)?;
        let state = |t_s: &f64| {
            let pose = self.path.pose(*t_s);
            CameraState {
                position_ned_m: pose.position_ned_m,
                ned_from_camera: pose.ned_from_camera,
                velocity_ned_m_s: self.path.velocity_ned(*t_s),
                rate_camera_rad_s: self.path.rate_camera(*t_s),
            }
        };
        let states: Vec<CameraState> = py.detach(|| t_s.iter().map(state).collect());
        let dict = PyDict::new(py);
        dict.set_item("position_ned_m", vectors(py, &states, |state| state.position_ned_m)?)?;
        dict.set_item("velocity_ned_m_s", vectors(py, &states, |state| state.velocity_ned_m_s)?)?;
        dict.set_item("ned_from_camera_wxyz", quaternions(py, &states, |state| state.ned_from_camera)?)?;
        dict.set_item("rate_camera_rad_s", vectors(py, &states, |state| state.rate_camera_rad_s)?)?;
        Ok(dict)
    }
}
