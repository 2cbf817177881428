//! `docs/reference/COLUMNS.md`; the classes of Python have the arrays of the lists.

#![allow(clippy::unwrap_used, reason = "tests")]

use camsim_core::{
    frame::RowRecord,
    pose::BodyState,
    sensors::{BarometerSample, GnssSample, ImuSample, MagnetometerSample},
};

use super::*;
use crate::write::{FrameRecord, ObjectRecord, PointRecord, TimingRecord, TrackRecord};

const HEAD: &str = "\
# Columns of tables

Made from the lists of columns by `CAMSIM_BLESS=1 cargo test -p camsim-io --lib columns`. Numbers in \
files have the fewest digits that read back to the same bits, flags are 0 or 1. In Python, which has some of the \
tables, each line is one array, of a value or a vector for each row. What is not measured is an empty cell in files, and NaN in Python. n, e, d are north, \
east, down; x, y, z are the axes of body, camera or sensor, from which quaternions (scalar first) lead to north, east, \
down.
";

/// Units by the ends of names, the longer ones first.
const UNITS: [(&str, &str); 12] = [
    ("_px", "px"),
    ("_ms", "ms"),
    ("_rad_s2", "rad/s^2"),
    ("_rad_s", "rad/s"),
    ("_m_s2", "m/s^2"),
    ("_m_s", "m/s"),
    ("_m", "m"),
    ("_ns", "ns"),
    ("_deg", "degrees"),
    ("_pa", "Pa"),
    ("_ut", "microtesla"),
    ("", ""),
];

fn unit(array: &str) -> &'static str {
    UNITS.iter().find(|(end, _)| array.ends_with(end)).unwrap().1
}

/// numpy's type of a column.
fn dtype<R>(column: &Column<R>) -> &'static str {
    match column.get {
        Get::Text(_) => "str",
        Get::Index(_) => "uint32",
        Get::Whole(_) => "int64",
        Get::Flag(_) => "bool",
        _ => "float64",
    }
}

fn cell_names<R>(column: &Column<R>) -> Vec<String> {
    column.names().map(|name| format!("`{name}`")).collect()
}

/// Adds a table that is a file alone.
fn add_file<R: TableRow>(page: &mut String, title: &str, file: &str) {
    *page += &format!("\n## {title}\n\n`{file}`.\n\n| column | unit | what |\n|---|---|---|\n");
    for column in R::COLUMNS {
        *page +=
            &format!("| {} | {} | {} |\n", cell_names(column).join(" "), unit(column.array), column.about);
    }
}

fn add_table<R: TableRow>(page: &mut String, title: &str, file: &str, python: &str) {
    *page += &format!("\n## {title}\n\n`{file}`; in Python `{python}`.\n\n");
    *page += "| file | Python | unit | what |\n|---|---|---|---|\n";
    if file.contains("trajectory") {
        *page += &format!("| `{T_S}` | | s | instant on the clock of stamps, in Python the argument |\n");
    }
    for column in R::COLUMNS {
        let names = cell_names(column);
        let width = if names.len() > 1 { format!(", N x {}", names.len()) } else { String::new() };
        let Column { array, about, .. } = column;
        let (names, dtype, unit) = (names.join(" "), dtype(column), unit(array));
        *page += &format!("| {names} | `{array}`: {dtype}{width} | {unit} | {about} |\n");
    }
}

#[test]
fn the_page_is_up_to_date() {
    let page = &mut HEAD.to_owned();
    add_table::<RowRecord>(page, "Rows", "rows/frame_000123.csv", "frame.rows");
    add_table::<BodyState>(page, "Platform", "trajectory.csv", "scenario.trajectory.at(t_s)");
    add_table::<CameraState>(page, "Camera", "camera_trajectory.csv", "scenario.trajectory.camera_at(t_s)");
    add_table::<ImuSample>(page, "imu", "sensors/NAME.csv", "scenario.imu()");
    add_table::<GnssSample>(page, "gnss", "sensors/NAME.csv", "scenario.gnss()");
    add_table::<BarometerSample>(page, "barometer", "sensors/NAME.csv", "scenario.barometer()");
    add_table::<MagnetometerSample>(page, "magnetometer", "sensors/NAME.csv", "scenario.magnetometer()");
    add_file::<FrameRecord>(page, "Frames", "frames.csv");
    *page += "| `color_png`, ... | | path of each file of the frame, empty if it is missing |\n";
    add_file::<TimingRecord>(page, "Timing", "timing.csv");
    add_file::<ObjectRecord>(page, "Objects", "objects.csv");
    add_file::<PointRecord>(page, "Points", "points.csv");
    add_file::<TrackRecord>(page, "Tracks", "tracks.csv");
    crate::inputs_page::check("../COLUMNS.md", page);
}

/// Checks that a class has a field for each column, of its type.
fn check_class<R: TableRow>(module: &str, class: &str) {
    let (_, rest) = module.split_once(&format!("\nclass {class}")).unwrap();
    let body = rest.split("\n\n\n").next().unwrap();
    let field = |line: &str| {
        let (name, dtype) = line.strip_prefix("    ")?.split_once(": NDArray[np.")?;
        Some((name.to_owned(), dtype.trim_end_matches(['_', ']']).to_owned()))
    };
    let mut fields: Vec<_> = body.lines().filter_map(field).collect();
    let mut columns: Vec<_> =
        R::COLUMNS.iter().map(|one| (one.array.to_owned(), dtype(one).to_owned())).collect();
    fields.sort();
    columns.sort();
    assert_eq!(fields, columns, "{class}");
}

#[test]
fn the_classes_of_python_have_the_columns() {
    let frame = include_str!("../../../../python/camsim/frame.py");
    check_class::<RowRecord>(frame, "Rows:");
    let trajectory = include_str!("../../../../python/camsim/trajectory.py");
    check_class::<BodyState>(trajectory, "BodyStates:");
    check_class::<CameraState>(trajectory, "CameraStates:");
    check_class::<ImuSample>(trajectory, "ImuSamples(");
    check_class::<GnssSample>(trajectory, "GnssSamples(");
    check_class::<BarometerSample>(trajectory, "BarometerSamples(");
    check_class::<MagnetometerSample>(trajectory, "MagnetometerSamples(");
}
