//! Tables: rows of a frame, trajectories of platform and camera.

use std::fmt::Write as _;

use camsim_core::{frame::RowRecord, scene::SceneObject};

use crate::columns::{TableRow, header, push_line};

/// Motion at one instant: a line of `trajectory.csv` or `camera_trajectory.csv`.
#[derive(Clone, Copy, Debug)]
pub struct Stamped<S> {
    /// Nanoseconds on the clock of stamps.
    pub t_ns: i64,
    /// The motion.
    pub state: S,
}

/// Appends nanoseconds as decimal seconds, exactly, with a comma behind.
fn push_seconds(text: &mut String, t_ns: i64) {
    let (whole, rest) = (t_ns.unsigned_abs() / 1_000_000_000, t_ns.unsigned_abs() % 1_000_000_000);
    // Writing to a String cannot fail.
    let _ = write!(text, "{}{whole}.{rest:09},", if t_ns < 0 { "-" } else { "" });
}

/// Text of `rows/*.csv` of one frame. The last column, `exposure_ns`, is there where rows differ in it.
pub fn rows_csv(rows: &[RowRecord]) -> String {
    let differ = rows.windows(2).any(|pair| pair[0].exposure_ns != pair[1].exposure_ns);
    let columns = &RowRecord::COLUMNS[..RowRecord::COLUMNS.len() - usize::from(!differ)];
    let mut text = header(columns) + "\n";
    rows.iter().for_each(|row| push_line(&mut text, columns, row));
    text
}

/// Columns of `objects.csv`.
pub const OBJECTS_COLUMNS: &str = "number,name,class";

/// Text of `objects.csv`: number (from 1), name and class of each object. Names with commas, quotes or line
/// breaks are quoted, as RFC 4180 has it.
pub fn objects_csv(objects: &[SceneObject]) -> String {
    let mut text = format!("{OBJECTS_COLUMNS}\n");
    for (number, SceneObject { name, class }) in (1..).zip(objects) {
        let number: u32 = number;
        let name = match name.contains([',', '"', '\n', '\r']) {
            true => format!("\"{}\"", name.replace('"', "\"\"")),
            false => name.clone(),
        };
        let _ = writeln!(text, "{number},{name},{class}");
    }
    text
}

/// Text of `trajectory.csv` and of `camsim track`, or of `camera_trajectory.csv` and of `camsim track --of camera`.
pub fn trajectory_csv<S: TableRow>(records: impl IntoIterator<Item = Stamped<S>>) -> String {
    let mut text = format!("t_s,{}\n", header(S::COLUMNS));
    for Stamped { t_ns, state } in records {
        push_seconds(&mut text, t_ns);
        push_line(&mut text, S::COLUMNS, &state);
    }
    text
}
