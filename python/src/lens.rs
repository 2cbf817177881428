//! A camera's lens over arrays of points.

use std::sync::OnceLock;

use camsim::core::{
    camera::{BulkInverse, CameraModel},
    lens::foreign_model,
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

/// Points that a task takes: some ten microseconds of work and more.
const BATCH: usize = 1024;

/// Native lens; `camsim.Lens` is what users see.
#[pyclass(frozen, module = "camsim._camsim")]
#[derive(Debug)]
pub struct Lens {
    camera: CameraModel,
    /// Made at its first use.
    inverse: OnceLock<BulkInverse>,
}

impl Lens {
    pub fn of_spec(spec: &CameraSpec) -> PyResult<Self> {
        Ok(Self::of_camera(CameraModel::from_spec(spec).or_input_error()?))
    }

    fn of_camera(camera: CameraModel) -> Self {
        Self { camera, inverse: OnceLock::new() }
    }

    fn inverse(&self) -> &BulkInverse {
        self.inverse.get_or_init(|| BulkInverse::new(self.camera.clone()))
    }

    /// A ray beside or behind the camera that the lens does not image: formulas mirror some of these.
    fn is_lost(&self, ray: DVec3) -> bool {
        let is_before = ray.z > 0.0;
        !(is_before || ray.is_finite() && self.camera.lens.contains_ray(ray))
    }
}

/// The exception of a model that is not known, or by another program's name.
fn wrong_model(name: &str, error: &toml::de::Error) -> PyErr {
    let known = foreign_model(name).and_then(|model| toml::Value::try_from(model).ok());
    input_error(match known {
        Some(model) => format!("model {name:?}: write {model}, its name here"),
        None => format!("model {name:?}: {}", error.message().trim_end()),
    })
}

/// Maps all rows, a batch at a time, on all processors.
fn map_batches<const N: usize, const M: usize>(
    points: &[[f64; N]],
    each: impl Fn(&[[f64; N]], &mut [[f64; M]]) + Sync,
) -> Vec<f64> {
    let mut mapped = vec![[0.0; M]; points.len()];
    in_own_pool(|| {
        let batches = mapped.par_chunks_mut(BATCH).zip(points.par_chunks(BATCH));
        batches.for_each(|(mapped, points)| each(points, mapped));
    });
    mapped.into_flattened()
}

/// Maps every row.
fn map<const N: usize, const M: usize>(
    py: Python<'_>,
    points: &[[f64; N]],
    each: impl Fn([f64; N]) -> [f64; M] + Sync,
) -> Vec<f64> {
    py.detach(|| {
        map_batches(points, |points, mapped: &mut [[f64; M]]| {
            mapped.iter_mut().zip(points).for_each(|(mapped, point)| *mapped = each(*point));
        })
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
        let named = toml::Value::String(model.to_owned()).try_into();
        let model: LensModel = named.map_err(|error| wrong_model(model, &error))?;
        let camera = CameraModel::new(size_px, focal_px, principal_point_px, model, &coefficients);
        Ok(Self::of_camera(camera.or_input_error()?))
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

    /// Whether the lens has the same numbers and the same tables.
    fn equals(&self, other: &Self) -> bool {
        self.camera == other.camera
    }

    /// Whether model and coefficients say all of it.
    #[getter]
    fn is_plain(&self) -> bool {
        let (size_px, focal_px) = (self.camera.size_px, self.camera.focal_px.into());
        let (lens, centre_px) = (&self.camera.lens, self.camera.principal_point_px.into());
        CameraModel::new(size_px, focal_px, Some(centre_px), lens.model(), lens.coefficients())
            .is_ok_and(|plain| plain == self.camera)
    }

    /// Pixels of points in camera axes; NaN beside and behind the camera, but for what the lens images there.
    fn project<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let pixel = |point| {
            let ray = DVec3::from_array(point);
            if self.is_lost(ray) { [f64::NAN; 2] } else { self.camera.project_ray(ray).to_array() }
        };
        table(py, map(py, rows(&points, "points")?, pixel), 2)
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

    /// Ideal points of pixels; NaN where the lens has none.
    fn undistort<'py>(
        &self,
        py: Python<'py>,
        pixels: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let pixels = rows(&pixels, "pixels")?;
        let ideal = py.detach(|| {
            let inverse = self.inverse();
            map_batches::<2, 2>(pixels, |pixels, ideal| inverse.unproject(pixels, ideal))
        });
        table(py, ideal, 2)
    }

    /// Unit rays of pixels in camera axes; NaN where the lens has none.
    fn unproject<'py>(
        &self,
        py: Python<'py>,
        pixels: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let pixels = rows(&pixels, "pixels")?;
        let seen = py.detach(|| {
            let inverse = self.inverse();
            map_batches::<2, 3>(pixels, |pixels, seen| inverse.rays(pixels, seen))
        });
        table(py, seen, 3)
    }

    /// Derivatives of the pixels of points in camera axes by these: two rows of three.
    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'py, f64>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let focal_px = self.camera.focal_px;
        let derivatives = |point: [f64; 3]| {
            let ray = DVec3::from_array(point);
            if self.is_lost(ray) {
                return [f64::NAN; 6];
            }
            let [by_x, by_y, by_z] = self.camera.lens.gradient(ray).map(|column| column * focal_px);
            [by_x.x, by_y.x, by_z.x, by_x.y, by_y.y, by_z.y]
        };
        table(py, map(py, rows(&points, "points")?, derivatives), 6)
    }

    /// Whether the lens images points in camera axes: inside the fold, and finite.
    fn valid<'py>(&self, py: Python<'py>, points: PyReadonlyArray2<'py, f64>) -> PyResult<Bound<'py, PyAny>> {
        let is_valid = |point| {
            let ray = DVec3::from_array(point);
            [f64::from(u8::from(ray.is_finite() && ray != DVec3::ZERO && self.camera.lens.contains_ray(ray)))]
        };
        let valid: Vec<bool> =
            map(py, rows(&points, "points")?, is_valid).into_iter().map(|valid| valid > 0.0).collect();
        Ok(valid.into_pyarray(py).into_any())
    }
}
