//! `t_s,x,y,z,qw,qx,qy,qz` tables, and those of the TUM benchmarks.

use std::path::Path;

use camsim_core::apply::PoseRow;
use glam::{DQuat, DVec3};

use super::{FrameFileError, TrajectoryFormat};

const COLUMNS: [&str; 8] = ["t_s", "x", "y", "z", "qw", "qx", "qy", "qz"];

/// Rows with their time from `base_s`.
pub(super) fn read_poses(path: &Path, format: TrajectoryFormat, base_s: f64) -> Result<Vec<PoseRow>, FrameFileError> {
    match format {
        TrajectoryFormat::Csv => read_csv(path, base_s),
        TrajectoryFormat::Tum => read_tum(path, base_s),
    }
}

/// `t x y z qx qy qz qw`, with blanks between and lines of `#` for comments.
fn read_tum(path: &Path, base_s: f64) -> Result<Vec<PoseRow>, FrameFileError> {
    let fail = |line: Option<u64>, message: String| FrameFileError::Poses { path: path.into(), line, message };
    let text = std::fs::read_to_string(path)
        .map_err(|error| fail(None, format!("cannot be read as text: {error}; paths are relative to FRAME.toml")))?;
    let mut rows = Vec::new();
    for (line, words) in (1..).zip(text.lines()).filter_map(|(number, line)| Some((number, words_of(line)?))) {
        let numbers: Result<Vec<f64>, _> = words.iter().map(|word| word.parse::<f64>()).collect();
        let [t_s, x, y, z, qx, qy, qz, qw] = numbers.ok().and_then(|numbers| <[f64; 8]>::try_from(numbers).ok()).ok_or_else(|| {
            fail(
                Some(line),
                "is not the 8 numbers t x y z qx qy qz qw of motion.trajectory_format = \"tum\"; correct it or leave it out".into(),
            )
        })?;
        rows.push(PoseRow { t_s: t_s - base_s, position_m: DVec3::new(x, y, z), world_from_camera: DQuat::from_xyzw(qx, qy, qz, qw) });
    }
    Ok(rows)
}

/// The words of a line that is no comment.
pub(super) fn words_of(line: &str) -> Option<Vec<&str>> {
    let line = line.trim_start_matches('\u{feff}').trim();
    (!line.is_empty() && !line.starts_with('#')).then(|| line.split_whitespace().collect())
}

fn read_csv(path: &Path, base_s: f64) -> Result<Vec<PoseRow>, FrameFileError> {
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
            fail(Some(1), format!("the header names no column {name}; the columns are {} (world_from_camera); for t x y z qx qy qz qw without a header set trajectory_format = \"tum\"", COLUMNS.join(",")))
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
        rows.push(PoseRow { t_s: t_s - base_s, position_m: DVec3::new(x, y, z), world_from_camera: DQuat::from_xyzw(qx, qy, qz, qw) });
    }
    Ok(rows)
}
