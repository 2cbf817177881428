//! Comparison of pictures, and calibration boards.

use std::path::PathBuf;

use camsim::{
    core::{
        metrics::{self, ImageView},
        scenario::BoardSpec,
        scene::{Board, ned_from_board},
    },
    io::{
        board_file::read_board,
        compare::{Figures, compare_paths},
        load::{Loaded, board_position_ned_m},
    },
};
use glam::DVec3;
use numpy::{PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{column, table, vectors},
    error::{OrRaise, input_error, too_large},
    frame::image,
};

/// Differences between two pictures, as JSON of `camsim compare`.
#[pyfunction]
pub fn compare(
    py: Python<'_>,
    a: PyReadonlyArray3<'_, f32>,
    b: PyReadonlyArray3<'_, f32>,
) -> PyResult<String> {
    let (a, b) = (view(&a)?, view(&b)?);
    let figures = py.detach(|| metrics::compare(a, b)).or_input_error()?;
    serde_json::to_string(&Figures::from(&figures)).or_run_error()
}

/// Differences between two pictures in files, or between those of the same name in two folders, as JSON of `camsim
/// compare`.
#[pyfunction]
pub fn compare_files(py: Python<'_>, a: PathBuf, b: PathBuf) -> PyResult<String> {
    let report = py.detach(|| compare_paths(&a, &b)).or_input_error()?;
    serde_json::to_string(&report).or_run_error()
}

/// A picture of height x width x channels, of which a fourth is alpha.
fn view<'a>(array: &'a PyReadonlyArray3<'_, f32>) -> PyResult<ImageView<'a>> {
    let side = |pixels: usize| u32::try_from(pixels).map_err(|_| too_large("the picture"));
    let shape = array.shape();
    Ok(ImageView {
        size_px: [side(shape[1])?, side(shape[0])?],
        channels: shape[2],
        alpha: (shape[2] == 4).then_some(3),
        samples: array.as_slice()?,
    })
}

/// A board of the keys of `[scene.board]` as JSON.
#[pyfunction]
pub fn board_of_keys<'py>(py: Python<'py>, json: &str) -> PyResult<Bound<'py, PyDict>> {
    let spec: BoardSpec =
        serde_json::from_str(json).map_err(|error| input_error(format!("board: {error}")))?;
    let board = py.detach(|| read_board(&spec)).or_input_error()?;
    parts(py, &board, None)
}

/// The board of a target file of Kalibr.
#[pyfunction]
pub fn board_of_file(py: Python<'_>, path: PathBuf) -> PyResult<Bound<'_, PyDict>> {
    let spec = BoardSpec { target: Some(path), ..BoardSpec::default() };
    let board = py.detach(|| read_board(&spec)).or_input_error()?;
    parts(py, &board, None)
}

/// The board of a scenario; `None` without one.
pub fn board_of<'py>(py: Python<'py>, loaded: &Loaded) -> PyResult<Option<Bound<'py, PyDict>>> {
    let scenario = &loaded.sequence.scenario;
    let Some(spec) = &scenario.scene.board else { return Ok(None) };
    let board = py.detach(|| read_board(spec)).or_input_error()?;
    let centre_ned_m = board_position_ned_m(scenario, spec, &loaded.log).or_input_error()?;
    let turn = ned_from_board(spec.angles_deg);
    let position = move |point: DVec3| centre_ned_m + turn * point;
    parts(py, &board, Some(&position)).map(Some)
}

/// Picture and points of a board, with their positions in the world where it has one.
fn parts<'py>(
    py: Python<'py>,
    board: &Board,
    position: Option<&dyn Fn(DVec3) -> DVec3>,
) -> PyResult<Bound<'py, PyDict>> {
    let texture = py.detach(|| board.picture());
    let [width, height] = texture.size_px.map(|side| side as usize);
    // Boards are black and white: one channel holds all.
    let gray: Vec<u8> = texture.rgba8.chunks_exact(4).map(|rgba| rgba[0]).collect();
    let points = board.points();
    let dict = PyDict::new(py);
    dict.set_item("picture", image(py, gray, [height, width])?)?;
    dict.set_item("ids", column(py, points, |point| point.id))?;
    let flat = points.iter().flat_map(|point| point.position_m.to_array()).collect();
    dict.set_item("points_m", table(py, flat, 2)?)?;
    let ned = position
        .map(|position| vectors(py, points, |point| position(point.position_m.extend(0.0))))
        .transpose()?;
    dict.set_item("points_ned_m", ned)?;
    Ok(dict)
}
