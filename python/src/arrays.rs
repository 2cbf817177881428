//! Tables of numbers from numpy and to it.

use camsim::{
    core::pose::wxyz,
    io::columns::{Column, Get, TableRow},
};
use glam::DVec3;
use numpy::{
    Element, IntoPyArray, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::{
    prelude::*,
    types::{PyDict, PyList},
};

use crate::error::input_error;

/// Rows of `width` values each, which the array owns.
pub fn table<'py, T: Element>(py: Python<'py>, values: Vec<T>, width: usize) -> PyResult<Bound<'py, PyAny>> {
    let rows = values.len() / width;
    Ok(values.into_pyarray(py).reshape([rows, width])?.into_any())
}

/// A table of a vector for each item.
pub fn vectors<'py, T>(
    py: Python<'py>,
    items: &[T],
    part: impl Fn(&T) -> DVec3,
) -> PyResult<Bound<'py, PyAny>> {
    table(py, items.iter().flat_map(|item| part(item).to_array()).collect(), 3)
}

/// An array of a number for each item.
pub fn column<'py, T, V: Element>(py: Python<'py>, items: &[T], part: impl Fn(&T) -> V) -> Bound<'py, PyAny> {
    items.iter().map(part).collect::<Vec<V>>().into_pyarray(py).into_any()
}

/// The columns of a table by name.
pub fn columns<'py, R: TableRow>(py: Python<'py>, rows: &[R]) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    for Column { array, get, .. } in R::COLUMNS {
        let values = match get {
            Get::Text(get) => PyList::new(py, rows.iter().map(get))?.into_any(),
            Get::Index(get) => column(py, rows, get),
            Get::Whole(get) => column(py, rows, get),
            Get::Flag(get) => column(py, rows, get),
            Get::Number(get) => column(py, rows, get),
            Get::MaybeNumber(get) => column(py, rows, |row| get(row).unwrap_or(f64::NAN)),
            Get::Xyz(get) | Get::Ned(get) => vectors(py, rows, get)?,
            Get::MaybeNed(get) => vectors(py, rows, |row| get(row).unwrap_or(DVec3::NAN))?,
            Get::Wxyz(get) => table(py, rows.iter().flat_map(|row| wxyz(get(row))).collect(), 4)?,
        };
        dict.set_item(array, values)?;
    }
    Ok(dict)
}

/// A table from Python as rows of N numbers.
pub fn rows<'a, const N: usize>(
    array: &'a PyReadonlyArray2<'_, f64>,
    what: &str,
) -> PyResult<&'a [[f64; N]]> {
    let (rows, width) = (array.shape()[0], array.shape()[1]);
    if width != N {
        return Err(input_error(format!(
            "{what}: an array of shape (N, {N}) is needed, not ({rows}, {width})"
        )));
    }
    let (rows, _) = array.as_slice()?.as_chunks();
    Ok(rows)
}

/// A list of numbers from Python.
pub fn numbers<'a>(array: &'a PyReadonlyArray1<'_, f64>) -> PyResult<&'a [f64]> {
    Ok(array.as_slice()?)
}
