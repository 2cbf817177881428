//! A camera's lens over arrays of points.

use camsim::core::{
    camera::CameraModel,
    scenario::{CameraSpec, LensModel},
};
use glam::{DVec2, DVec3};
use numpy::{IntoPyArray, PyReadonlyArray2};
use pyo3::prelude::*;
use rayon::prelude::*;

use crate::{
    arrays::{rows, table},
    engine::in_own_pool,
    error::{OrRaise, input_error},
};

/// Points that a task takes: a hundred microseconds of work.
const BATCH: usize = 1024;

/// Native lens; `camsim.Lens` is what users see.
#[pyclass(frozen, module = "camsim._camsim")]
#[derive(Debug)]
pub struct Lens {
    camera: CameraModel,
}

impl Lens {
    pub fn of_spec(spec: &CameraSpec) -> PyResult<Self> {
        Ok(Self { camera: CameraModel::from_spec(spec).or_input_error()? })
    }
}

/// The ideal point of a point in camera axes; NaN beside and behind the camera.
fn ideal_of([x, y, z]: [f64; 3]) -> DVec2 {
    if z > 0.0 { DVec2::new(x / z, y / z) } else { DVec2::NAN }
}

/// Maps every row, on all processors.
fn map<const N: usize, const M: usize>(
    py: Python<'_>,
    points: &[[f64; N]],
    each: impl Fn([f64; N]) -> [f64; M] + Sync,
) -> Vec<f64> {
    py.detach(|| {
        let mut mapped = vec![[0.0; M]; points.len()];
        in_own_pool(|| {
            mapped.par_chunks_mut(BATCH).zip(points.par_chunks(BATCH)).for_each(|(mapped, points)| {
                mapped.iter_mut().zip(points).for_each(|(mapped, point)| *mapped = each(*point));
            });
        });
        mapped.into_flattened()
    })
}

#[pymethods]
impl Lens {
    /// A lens from plain numbers.
    #[new]
    fn new(
        size_px: [u32; 2],
        focal_px: [f64; 2],
        principal_point_px: Option<[f64; 2]>,
        model: &str,
        coefficients: Vec<f64>,
    ) -> PyResult<Self> {
        let model: LensModel = toml::Value::String(model.to_owned())
            .try_into()
            .map_err(|error: toml::de::Error| input_error(format!("model {model:?}: {}", error.message())))?;
        let camera = CameraModel::new(size_px, focal_px, principal_point_px, model, &coefficients);
        Ok(Self { camera: camera.or_input_error()? })
    }

    #[getter]
    fn size_px(&self) -> (u32, u32) {
        (self.camera.size_px[0], self.camera.size_px[1])
    }

    #[getter]
    fn focal_px(&self) -> (f64, f64) {
        self.camera.focal_px.into()
    }

    #[getter]
    fn principal_point_px(&self) -> (f64, f64) {
        self.camera.principal_point_px.into()
    }

    #[getter]
    fn model(&self) -> PyResult<String> {
        let name = toml::Value::try_from(self.camera.lens.model()).or_run_error()?;
        Ok(name.as_str().unwrap_or_default().to_owned())
    }

    #[getter]
    fn coefficients(&self) -> Vec<f64> {
        self.camera.lens.coefficients().to_vec()
    }

    /// Pixels of points in camera axes.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let pixels =
            map(py, rows(&points, "points")?, |point| self.camera.project(ideal_of(point)).to_array());
        table(py, pixels, 2)
    }

    /// Pixels of ideal points.
    fn distort<'py>(
        &self,
        py: Python<'py>,
        ideal: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let pixels =
            map(py, rows(&ideal, "ideal")?, |uv| self.camera.project(DVec2::from_array(uv)).to_array());
        table(py, pixels, 2)
    }

    /// Ideal points of pixels; NaN where the lens has no inverse.
    fn undistort<'py>(
        &self,
        py: Python<'py>,
        pixels: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let ideal = |pixel| self.camera.unproject(DVec2::from_array(pixel)).unwrap_or(DVec2::NAN).to_array();
        table(py, map(py, rows(&pixels, "pixels")?, ideal), 2)
    }

    /// Unit rays of pixels in camera axes; NaN where the lens has no inverse.
    fn unproject<'py>(
        &self,
        py: Python<'py>,
        pixels: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let ray = |pixel| {
            let ideal = self.camera.unproject(DVec2::from_array(pixel));
            ideal.map_or(DVec3::NAN, |ideal| ideal.extend(1.0).normalize()).to_array()
        };
        table(py, map(py, rows(&pixels, "pixels")?, ray), 3)
    }

    /// Derivatives of the pixels of points in camera axes by these: two rows of three.
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let focal_px = self.camera.focal_px;
        let derivatives = |point: [f64; 3]| {
            let ideal = ideal_of(point);
            let by_ideal = self.camera.lens.jacobian(ideal);
            let (by_u, by_v) = (by_ideal.x_axis * focal_px / point[2], by_ideal.y_axis * focal_px / point[2]);
            let by_z = -(by_u * ideal.x + by_v * ideal.y);
            [by_u.x, by_v.x, by_z.x, by_u.y, by_v.y, by_z.y]
        };
        table(py, map(py, rows(&points, "points")?, derivatives), 6)
    }

    /// Whether the lens images points in camera axes: before the camera, inside the fold, and finite.
    fn valid<'py>(&self, py: Python<'py>, points: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyAny>> {
        let is_valid = |point| {
            let ideal = ideal_of(point);
            [f64::from(u8::from(ideal.is_finite() && self.camera.lens.contains(ideal)))]
        };
        let valid: Vec<bool> =
            map(py, rows(&points, "points")?, is_valid).into_iter().map(|valid| valid > 0.0).collect();
        Ok(valid.into_pyarray(py).into_any())
    }
}
