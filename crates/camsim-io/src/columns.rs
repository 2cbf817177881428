//! Columns of tables. Each table has one list, from which come the files, what reads them, the arrays in Python and
//! docs/reference/COLUMNS.md.

use std::{borrow::Cow, fmt::Write as _};

use camsim_core::{
    mount::CameraPath,
    pose::{CameraPose, wxyz},
};
use glam::{DQuat, DVec3};

use crate::text::number::Number;

mod lists;
pub(crate) use lists::{T_NS, T_S, T_TRUE_NS};
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
    /// What a table is about that has it; `None`: every table of its kind has it.
    part: Option<Part>,
}

/// Subjects that only some tables of a kind have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Part {
    /// Positions on Earth.
    Geodetic,
    /// Exposures that differ.
    Exposures,
    /// Pictures of a burst.
    Instants,
    /// Things that move.
    Motion,
    /// Poses of samples.
    Poses,
}

/// A cell of a row.
pub(crate) enum Cell<'a> {
    Text(&'a str),
    Whole(i64),
    Number(f64),
    Empty,
}

/// How a row gives the value of a column, and which type that has. What is absent is an empty cell, and NaN in Python.
#[derive(Debug)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Get<R> {
    Text(fn(&R) -> &str),
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

pub(crate) const fn column<R>(
    array: &'static str,
    cells: &'static str,
    about: &'static str,
    get: Get<R>,
) -> Column<R> {
    Column { array, cells, about, get, part: None }
}

/// A column with one name everywhere.
pub(crate) const fn plain<R>(name: &'static str, about: &'static str, get: Get<R>) -> Column<R> {
    column(name, name, about, get)
}

/// A column of those tables alone that are about this.
pub(crate) const fn of<R>(part: Part, mut column: Column<R>) -> Column<R> {
    column.part = Some(part);
    column
}

impl<R> Column<R> {
    /// Names of its cells in files.
    pub(crate) fn names(&self) -> impl Iterator<Item = String> {
        let axes: &[&str] = match self.get {
            Get::Xyz(_) => &["x", "y", "z"],
            Get::Ned(_) | Get::MaybeNed(_) => &["n", "e", "d"],
            Get::Wxyz(_) => &["w", "x", "y", "z"],
            _ => &[""],
        };
        axes.iter().map(|axis| self.cells.replace('*', axis))
    }

    /// Calls `put` with each of its cells.
    fn each_cell(&self, row: &R, put: &mut dyn FnMut(Cell<'_>)) {
        let mut numbers = |values: &[f64]| values.iter().for_each(|value| put(Cell::Number(*value)));
        match &self.get {
            Get::Number(get) => numbers(&[get(row)]),
            Get::Xyz(get) | Get::Ned(get) => numbers(&get(row).to_array()),
            Get::Wxyz(get) => numbers(&wxyz(get(row))),
            Get::Text(get) => put(Cell::Text(get(row))),
            Get::Index(get) => put(Cell::Whole(get(row).into())),
            Get::Whole(get) => put(Cell::Whole(get(row))),
            Get::Flag(get) => put(Cell::Whole(get(row).into())),
            Get::MaybeNumber(get) => put(get(row).map_or(Cell::Empty, Cell::Number)),
            Get::MaybeNed(get) => match get(row) {
                Some(value) => numbers(&value.to_array()),
                None => (0..3).for_each(|_| put(Cell::Empty)),
            },
        }
    }
}

/// The columns that one table has.
pub(crate) struct Columns<R: 'static>(Vec<&'static Column<R>>);

impl<R: TableRow> Columns<R> {
    /// Those of every table, and of the parts that this one has.
    pub(crate) fn with(has: impl Fn(Part) -> bool) -> Self {
        Self(R::COLUMNS.iter().filter(|column| column.part.is_none_or(&has)).collect())
    }

    /// All columns.
    pub(crate) fn all() -> Self {
        Self::with(|_| true)
    }

    /// Names of their cells.
    pub(crate) fn names(&self) -> impl Iterator<Item = String> {
        self.0.iter().flat_map(|column| column.names())
    }

    /// The line of names.
    pub(crate) fn header(&self) -> String {
        self.names().collect::<Vec<_>>().join(",")
    }

    /// Calls `put` with each cell of a row.
    pub(crate) fn each_cell(&self, row: &R, put: &mut dyn FnMut(Cell<'_>)) {
        self.0.iter().for_each(|column| column.each_cell(row, put));
    }

    /// Appends the cells of a row, with commas between them.
    pub(crate) fn push_cells(&self, text: &mut String, row: &R) {
        self.each_cell(row, &mut |cell| {
            match cell {
                Cell::Text(value) => text.push_str(&csv_cell(value)),
                // Writing to a String cannot fail.
                Cell::Whole(value) => _ = write!(text, "{value}"),
                Cell::Number(value) => text.push_str(Number(value).digits(&mut zmij::Buffer::new())),
                Cell::Empty => {}
            }
            text.push(',');
        });
        text.pop();
    }

    /// Appends the cells of a row, and ends the line.
    pub(crate) fn push_line(&self, text: &mut String, row: &R) {
        self.push_cells(text, row);
        text.push('\n');
    }

    /// The table.
    pub(crate) fn csv(&self, rows: impl IntoIterator<Item = R>) -> String {
        let mut text = self.header() + "\n";
        rows.into_iter().for_each(|row| self.push_line(&mut text, &row));
        text
    }
}

/// Names of the cells in files of the column with this name.
pub(crate) fn cells<R: TableRow>(array: &str) -> Vec<String> {
    let column = R::COLUMNS.iter().find(|column| column.array == array);
    column.map_or_else(|| vec![array.to_owned()], |column| column.names().collect())
}

/// A text as a cell of a CSV file: in quotes if it has commas, quotes or line breaks (RFC 4180).
#[must_use]
pub fn csv_cell(text: &str) -> Cow<'_, str> {
    match text.contains(['"', ',', '\n', '\r']) {
        true => format!("\"{}\"", text.replace('"', "\"\"")).into(),
        false => text.into(),
    }
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
