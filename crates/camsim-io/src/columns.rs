//! Columns of the tables of samples. Each table has one list, from which come the files, the arrays in Python and
//! docs/reference/COLUMNS.md.

use std::fmt::Write as _;

use camsim_core::{mount::CameraPath, pose::CameraPose};
use glam::{DQuat, DVec3};

use crate::write::Number;

mod lists;
#[cfg(test)]
mod tests;

/// A row of a table.
pub trait TableRow: Sized + 'static {
    /// The columns, in the order of files.
    const COLUMNS: &'static [Column<Self>];
}

/// A column of a table, of several cells if it is of vectors.
#[derive(Debug)]
pub struct Column<R> {
    /// Name of the array in Python, which ends in the unit.
    pub array: &'static str,
    /// Name in files, with `*` for the axis.
    cells: &'static str,
    /// What it is.
    pub about: &'static str,
    /// Its value.
    pub get: Get<R>,
}

/// How a row gives the value of a column, and which type that has. What is absent is an empty cell, and NaN in Python.
#[derive(Debug)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Get<R> {
    Index(fn(&R) -> u32),
    Whole(fn(&R) -> i64),
    Flag(fn(&R) -> bool),
    Number(fn(&R) -> f64),
    MaybeNumber(fn(&R) -> Option<f64>),
    Xyz(fn(&R) -> DVec3),
    Ned(fn(&R) -> DVec3),
    MaybeNed(fn(&R) -> Option<DVec3>),
    Wxyz(fn(&R) -> DQuat),
}

const fn column<R>(array: &'static str, cells: &'static str, about: &'static str, get: Get<R>) -> Column<R> {
    Column { array, cells, about, get }
}

/// A column with one name everywhere.
const fn plain<R>(name: &'static str, about: &'static str, get: Get<R>) -> Column<R> {
    column(name, name, about, get)
}

impl<R> Column<R> {
    /// Names of its cells in files.
    fn names(&self) -> impl Iterator<Item = String> {
        let axes: &[&str] = match self.get {
            Get::Xyz(_) => &["x", "y", "z"],
            Get::Ned(_) | Get::MaybeNed(_) => &["n", "e", "d"],
            Get::Wxyz(_) => &["w", "x", "y", "z"],
            _ => &[""],
        };
        axes.iter().map(|axis| self.cells.replace('*', axis))
    }

    /// Appends its cells, each with a comma behind it.
    fn push(&self, row: &R, text: &mut String) {
        match &self.get {
            Get::Index(get) => push_whole(text, get(row).into()),
            Get::Whole(get) => push_whole(text, get(row)),
            Get::Flag(get) => push_whole(text, get(row).into()),
            Get::Number(get) => push_numbers(text, &[get(row)]),
            Get::Xyz(get) | Get::Ned(get) => push_numbers(text, &get(row).to_array()),
            Get::Wxyz(get) => push_numbers(text, &wxyz(get(row))),
            Get::MaybeNumber(get) => match get(row) {
                Some(value) => push_numbers(text, &[value]),
                None => text.push(','),
            },
            Get::MaybeNed(get) => match get(row) {
                Some(value) => push_numbers(text, &value.to_array()),
                None => text.push_str(",,,"),
            },
        }
    }
}

/// Names of the cells of columns, with commas between them.
pub(crate) fn header<R>(columns: &[Column<R>]) -> String {
    columns.iter().flat_map(Column::names).collect::<Vec<_>>().join(",")
}

/// Appends the cells of a row, and ends the line.
pub(crate) fn push_line<R>(text: &mut String, columns: &[Column<R>], row: &R) {
    for column in columns {
        column.push(row, text);
    }
    text.pop();
    text.push('\n');
}

fn push_whole(text: &mut String, value: i64) {
    // Writing to a String cannot fail.
    let _ = write!(text, "{value},");
}

fn push_numbers(text: &mut String, values: &[f64]) {
    for value in values {
        text.push_str(Number(*value).digits(&mut zmij::Buffer::new()));
        text.push(',');
    }
}

/// Components of a quaternion, scalar first.
#[must_use]
pub fn wxyz(q: DQuat) -> [f64; 4] {
    [q.w, q.x, q.y, q.z]
}

/// Motion of the camera at one instant.
#[derive(Clone, Copy, Debug)]
pub struct CameraState {
    /// Optical centre and attitude.
    pub pose: CameraPose,
    /// Velocity of the optical centre, m/s.
    pub velocity_ned_m_s: DVec3,
    /// Angular rate relative to NED, in camera axes, rad/s.
    pub rate_camera_rad_s: DVec3,
}

impl CameraState {
    /// The motion at path time `t_s`.
    #[must_use]
    pub fn at(path: &CameraPath, t_s: f64) -> Self {
        Self {
            pose: path.pose(t_s),
            velocity_ned_m_s: path.velocity_ned(t_s),
            rate_camera_rad_s: path.rate_camera(t_s),
        }
    }
}
