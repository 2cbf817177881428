//! Tables: rows of a frame, trajectories of platform and camera, objects.

use camsim_core::{frame::RowRecord, scene::SceneObject};

use super::seconds;
use crate::columns::{Columns, T_S, TableRow};

/// Name of the table of the platform's motion.
pub const TRAJECTORY_CSV: &str = "trajectory.csv";
/// Name of the table of objects.
pub const OBJECTS_CSV: &str = "objects.csv";

/// Motion at one instant: a line of `trajectory.csv` or `camera_trajectory.csv`.
#[derive(Clone, Copy, Debug)]
pub struct Stamped<S> {
    /// Nanoseconds on the clock of stamps.
    pub t_ns: i64,
    /// The motion.
    pub state: S,
}

/// A line of `objects.csv`.
#[derive(Clone, Debug)]
pub(crate) struct ObjectRecord {
    pub(crate) number: u32,
    pub(crate) object: SceneObject,
}

/// Text of `rows/*.csv` of one frame.
pub fn rows_csv(rows: &[RowRecord]) -> String {
    let differ = rows.windows(2).any(|pair| pair[0].exposure_ns != pair[1].exposure_ns);
    Columns::with(|_| differ).csv(rows.iter().copied())
}

/// Text of `objects.csv`.
pub fn objects_csv(objects: &[SceneObject]) -> String {
    let record = |(number, object): (u32, &SceneObject)| ObjectRecord { number, object: object.clone() };
    Columns::all().csv((1..).zip(objects).map(record))
}

/// Text of `trajectory.csv` and of `camsim track`, or of `camera_trajectory.csv` and of `camsim track --of camera`.
pub fn trajectory_csv<S: TableRow>(records: impl IntoIterator<Item = Stamped<S>>) -> String {
    let columns = Columns::<S>::all();
    let mut text = format!("{T_S},{}\n", columns.header());
    for Stamped { t_ns, state } in records {
        text += &seconds(t_ns);
        text.push(',');
        columns.push_line(&mut text, &state);
    }
    text
}
