//! A frame as numpy arrays, and pictures from arrays.

use std::path::PathBuf;

use camsim::{
    core::{
        frame::{PlaneValues, RenderedFrame},
        pose::{CameraPose, wxyz},
        scenario::{Channel, OutputEncoding, PlaneKind},
        sequence::Sequence,
    },
    engine::Finished,
    io::write::{self, SourceFrame},
};
use numpy::{Element, IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::columns,
    error::{OrRaise, input_error},
};

/// A finished frame on its way to Python.
#[derive(Debug)]
pub struct Delivery {
    pub frame: RenderedFrame,
    /// Of the camera at the frame's stamp.
    pub pose: CameraPose,
    pub source: SourceFrame,
}

impl Delivery {
    /// A frame of a sequence.
    pub fn new(finished: Finished, sequence: &Sequence) -> Self {
        let plan = &finished.plan;
        let source = SourceFrame::new(plan.ideal_view(), plan.key_s, sequence.epoch_ns);
        Self { frame: finished.frame, pose: sequence.path.pose(plan.stamp_s), source }
    }

    /// The frame as a dictionary: `index`, `stamp_ns`, `pose`, `rows`, `source`, and `channels` with an array each.
    pub fn into_dict<'py>(self, py: Python<'py>, channels: &[Channel]) -> PyResult<Bound<'py, PyDict>> {
        let Self { frame, pose, source } = self;
        let parts = PyDict::new(py);
        parts.set_item("index", frame.index)?;
        parts.set_item("stamp_ns", frame.stamp_ns)?;
        parts.set_item("size_px", (frame.size_px[0], frame.size_px[1]))?;
        parts.set_item("pose", pose_dict(py, &pose)?)?;
        parts.set_item("rows", columns(py, &frame.rows)?)?;
        parts.set_item("source", source_dict(py, &source)?)?;
        parts.set_item("channels", arrays(py, frame, channels)?)?;
        Ok(parts)
    }
}

fn pose_dict<'py>(py: Python<'py>, pose: &CameraPose) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("position_ned_m", PyArray1::from_slice(py, &pose.position_ned_m.to_array()))?;
    dict.set_item("ned_from_camera_wxyz", PyArray1::from_slice(py, &wxyz(pose.ned_from_camera)))?;
    Ok(dict)
}

fn source_dict<'py>(py: Python<'py>, source: &SourceFrame) -> PyResult<Bound<'py, PyDict>> {
    let dict = pose_dict(py, &source.pose)?;
    dict.set_item("size_px", (source.size_px[0], source.size_px[1]))?;
    dict.set_item("focal_px", (source.focal_px[0], source.focal_px[1]))?;
    dict.set_item("principal_px", (source.principal_px[0], source.principal_px[1]))?;
    dict.set_item("t_ns", source.t_ns)?;
    Ok(dict)
}

/// The channels that were asked for, of the types that files have. All but the small ones are what the
/// renderer has allocated, which the arrays own.
fn arrays<'py>(py: Python<'py>, frame: RenderedFrame, channels: &[Channel]) -> PyResult<Bound<'py, PyDict>> {
    let size = frame.size_px.map(|side| side as usize);
    let size = [size[1], size[0]];
    let dict = PyDict::new(py);
    for mask in channels.iter().filter(|channel| channel.kind() == PlaneKind::Mask) {
        let valid = frame.color_rgba().chunks_exact(4).map(|rgba| if rgba[3] > 0.0 { u8::MAX } else { 0 });
        dict.set_item(mask.name(), image(py, valid.collect(), size)?)?;
    }
    for plane in frame.planes.into_iter().filter(|plane| channels.contains(&plane.channel)) {
        dict.set_item(plane.channel.name(), plane_array(py, plane.values, size)?)?;
    }
    Ok(dict)
}

/// The array of a plane.
pub fn plane_array(py: Python<'_>, values: PlaneValues, size: [usize; 2]) -> PyResult<Bound<'_, PyAny>> {
    match values {
        PlaneValues::Float(values) => image(py, values, size),
        // `object` and `class` of 65535 objects at most, as their files.
        PlaneValues::Index(numbers) => image(py, numbers.iter().map(|&number| number as u16).collect(), size),
        PlaneValues::Raw(raw) => image(py, raw.values, size),
    }
}

/// An array of height x width, and x components where a pixel has several.
pub fn image<'py, T: Element>(
    py: Python<'py>,
    values: Vec<T>,
    [height, width]: [usize; 2],
) -> PyResult<Bound<'py, PyAny>> {
    let components = values.len() / (height * width).max(1);
    let flat = values.into_pyarray(py);
    Ok(match components {
        1 => flat.reshape([height, width])?.into_any(),
        _ => flat.reshape([height, width, components])?.into_any(),
    })
}

/// A frame of a colour picture alone.
pub fn frame_of(color: &PyReadonlyArray3<'_, f32>) -> PyResult<RenderedFrame> {
    let [height, width, components] = [color.shape()[0], color.shape()[1], color.shape()[2]];
    let color_rgba = match components {
        4 => color.as_array().iter().copied().collect(),
        3 => color.as_array().rows().into_iter().flat_map(|p| [p[0], p[1], p[2], 1.0]).collect(),
        _ => return Err(input_error(format!("a picture has 3 or 4 components a pixel, not {components}"))),
    };
    let side = |pixels: usize| u32::try_from(pixels).map_err(|_| crate::error::too_large("the picture"));
    Ok(RenderedFrame::picture([side(width)?, side(height)?], color_rgba))
}

/// Writes a linear colour picture, height x width x 3 or 4, as `.png` (encoded) or `.exr`.
#[pyfunction]
pub fn write_picture(
    py: Python<'_>,
    path: PathBuf,
    color: PyReadonlyArray3<'_, f32>,
    encoding: &str,
) -> PyResult<()> {
    let frame = frame_of(&color)?;
    let encoding = self::encoding(encoding)?;
    py.detach(|| write::write_picture(&path, &frame, encoding)).or_run_error()
}

/// The nearest 8-bit sRGB codes of a linear colour picture, height x width x 3.
#[pyfunction]
pub fn srgb8<'py>(py: Python<'py>, color: PyReadonlyArray3<'py, f32>) -> PyResult<Bound<'py, PyAny>> {
    let frame = frame_of(&color)?;
    let rgb = |rgba: &[f32]| [0, 1, 2].map(|k: usize| write::srgb8(rgba[k]));
    let codes = py.detach(|| frame.color_rgba().chunks_exact(4).flat_map(rgb).collect());
    image(py, codes, [color.shape()[0], color.shape()[1]])
}

fn encoding(name: &str) -> PyResult<OutputEncoding> {
    toml::Value::String(name.to_owned())
        .try_into()
        .map_err(|error: toml::de::Error| input_error(format!("encoding {name:?}: {}", error.message())))
}
