//! `t_s,x,y,z,qw,qx,qy,qz` tables.

use std::path::Path;

use camsim_core::apply::PoseRow;
use glam::{DQuat, DVec3};

use super::FrameFileError;

const COLUMNS: [&str; 8] = ["t_s", "x", "y", "z", "qw", "qx", "qy", "qz"];

/// Rows with their time from `stamp_s`.
pub(super) fn read_poses(path: &Path, stamp_s: f64) -> Result<Vec<PoseRow>, FrameFileError> {
    let fail = |line: Option<u64>, message: String| FrameFileError::Poses { path: path.into(), line, message };
    let mut reader = csv::ReaderBuilder::new()
        .trim(csv::Trim::All)
        .comment(Some(b'#'))
        .from_path(path)
        .map_err(|error| fail(None, format!("cannot be read: {error}; paths are relative to FRAME.toml")))?;
    let header = reader.headers().map_err(|error| fail(Some(1), error.to_string()))?.clone();
    // The order of quaternions is the classical mistake, so columns go by name.
    let place = |name: &str| header.iter().position(|cell| cell.trim_start_matches('\u{feff}').eq_ignore_ascii_case(name));
    let mut places = [0; 8];
    for (slot, name) in places.iter_mut().zip(COLUMNS) {
        *slot = place(name).ok_or_else(|| {
            fail(Some(1), format!("the header names no column {name}; the columns are {} (world_from_camera)", COLUMNS.join(",")))
        })?;
    }
    let mut rows = Vec::new();
    for record in reader.records() {
        let record = record.map_err(|error| fail(error.position().map(csv::Position::line), error.to_string()))?;
        let line = record.position().map(csv::Position::line);
        let mut values = [0.0; 8];
        for (i, value) in values.iter_mut().enumerate() {
            let text = record.get(places[i]).unwrap_or_default();
            *value = text.parse().map_err(|_| fail(line, format!("{} is `{text}`, which is no number", COLUMNS[i])))?;
        }
        let [t_s, x, y, z, qw, qx, qy, qz] = values;
        rows.push(PoseRow { t_s: t_s - stamp_s, position_m: DVec3::new(x, y, z), world_from_camera: DQuat::from_xyzw(qx, qy, qz, qw) });
    }
    Ok(rows)
}
