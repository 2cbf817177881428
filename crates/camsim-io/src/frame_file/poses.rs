//! Reads tables of poses: CSV `t_s,x,y,z,qw,qx,qy,qz`, and the format of the TUM benchmarks.

use std::path::Path;

use camsim_core::apply::PoseRow;
use glam::{DQuat, DVec3};

use super::{
    FrameFileError, TrajectoryFormat,
    columns::{TableColumn, parse_column},
};
use crate::table::open_table;

/// Required columns, in the order of the slots of [`ColumnIndices`].
const COLUMNS: [&str; 8] = ["t_s", "x", "y", "z", "qw", "qx", "qy", "qz"];
/// Slots of the columns of a TUM file.
const TUM_SLOTS: [usize; 8] = [0, 1, 2, 3, 5, 6, 7, 4];
/// Largest plausible time, seconds. Larger ones are milliseconds or less.
const MAX_TIME_S: f64 = 1e11;

/// For each of [`COLUMNS`], its index in a row and the factor of its numbers.
type ColumnIndices = [(usize, f64); 8];

/// Reads the rows of a table, with times relative to `base_s`, and notes about it.
pub(super) fn read_poses(
    path: &Path,
    format: TrajectoryFormat,
    base_s: f64,
) -> Result<(Vec<PoseRow>, Vec<String>), FrameFileError> {
    match format {
        TrajectoryFormat::Csv => read_csv(path, base_s),
        TrajectoryFormat::Tum => Ok((read_tum(path, base_s)?, Vec::new())),
    }
}

/// An error about a table of poses.
fn failure(path: &Path, line: Option<u64>, message: impl Into<String>) -> FrameFileError {
    FrameFileError::Poses { path: path.into(), line, message: message.into() }
}

/// Reads lines `t x y z qx qy qz qw`, separated by blanks. A `#` comment may name the columns in another
/// order.
fn read_tum(path: &Path, base_s: f64) -> Result<Vec<PoseRow>, FrameFileError> {
    let fail = |line: Option<u64>, message: String| failure(path, line, message);
    let text = std::fs::read_to_string(path).map_err(|error| {
        fail(None, format!("cannot be read as text: {error}; paths are relative to FRAME.toml"))
    })?;
    let mut columns: ColumnIndices =
        std::array::from_fn(|slot| (TUM_SLOTS.iter().position(|other| *other == slot).unwrap_or(0), 1.0));
    let mut rows: Vec<PoseRow> = Vec::new();
    for (line, text) in (1..).zip(text.lines()) {
        let Some(words) = split_words(text) else {
            if let Some(named) = columns_of_comment(text)
                .map_err(|message| fail(Some(line), message))?
                .filter(|_| rows.is_empty())
            {
                columns = named;
            }
            continue;
        };
        let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse::<f64>().ok()).collect();
        let numbers = numbers.and_then(|numbers| <[f64; 8]>::try_from(numbers).ok()).ok_or_else(|| {
            fail(
                Some(line),
                "is not the 8 numbers t x y z qx qy qz qw of motion.trajectory_format = \"tum\"; correct it \
                    or leave it out"
                    .into(),
            )
        })?;
        rows.push(
            pose(columns.map(|(index, factor)| factor * numbers[index]), base_s)
                .map_err(|message| fail(Some(line), message))?,
        );
    }
    Ok(rows)
}

/// The columns that a comment names, if it ends with the names of all: `# timestamp tx ty tz qw qx qy qz`.
fn columns_of_comment(line: &str) -> Result<Option<ColumnIndices>, String> {
    let line = line.trim_start_matches(['\u{feff}', '#', ' ', '\t']).replace(',', " ");
    let words: Vec<&str> = line.split_whitespace().collect();
    let Some(names) = words.len().checked_sub(8).map(|start| &words[start..]) else { return Ok(None) };
    let mut slots: [Option<(usize, f64)>; 8] = [None; 8];
    for (index, name) in names.iter().enumerate() {
        match slot_and_factor(parse_column(name), true) {
            Some((slot, factor)) if slots[slot].is_none() => slots[slot] = Some((index, factor)),
            _ => return Ok(None),
        }
    }
    let columns: Vec<(usize, f64)> = slots.into_iter().flatten().collect();
    columns.try_into().map(Some).map_err(|_| "names a column twice".to_owned())
}

/// Slot of a column in [`COLUMNS`], and the factor of its numbers. A time without a unit is accepted only
/// with `default_seconds`.
fn slot_and_factor(column: TableColumn, default_seconds: bool) -> Option<(usize, f64)> {
    match column {
        TableColumn::Time(Some(unit)) => Some((0, unit.factor)),
        TableColumn::Time(None) if default_seconds => Some((0, 1.0)),
        TableColumn::Position(axis, unit) => Some((1 + axis, unit.factor)),
        TableColumn::Quaternion(part) => Some((4 + part, 1.0)),
        TableColumn::Time(None) | TableColumn::WrongUnit | TableColumn::Other => None,
    }
}

/// Splits a line into words; `None` for comments and empty lines.
pub(super) fn split_words(line: &str) -> Option<Vec<&str>> {
    let line = line.trim_start_matches('\u{feff}').trim();
    (!line.is_empty() && !line.starts_with('#')).then(|| line.split_whitespace().collect())
}

/// A pose from the values of [`COLUMNS`].
fn pose([t_s, x, y, z, qw, qx, qy, qz]: [f64; 8], base_s: f64) -> Result<PoseRow, String> {
    if t_s.abs() > MAX_TIME_S {
        return Err(format!(
            "its time is {t_s:e} s, which no clock has: give a CSV whose header says the unit, t_ms, t_us or \
                t_ns"
        ));
    }
    Ok(PoseRow {
        t_s: t_s - base_s,
        position_m: DVec3::new(x, y, z),
        world_from_camera: DQuat::from_xyzw(qx, qy, qz, qw),
    })
}

/// The columns of a CSV header, and the names of those that are not read.
fn columns_of_header(header: &csv::StringRecord) -> Result<(ColumnIndices, Vec<String>), String> {
    let mut slots: [Option<(usize, f64)>; 8] = [None; 8];
    let mut unread = Vec::new();
    for (index, cell) in header.iter().enumerate() {
        match (parse_column(cell), slot_and_factor(parse_column(cell), false)) {
            (_, Some((slot, factor))) => {
                if let Some((before, _)) = slots[slot].replace((index, factor)) {
                    let (a, b) = (header.get(before).unwrap_or_default(), cell);
                    return Err(format!(
                        "the header names two columns for {}, `{a}` and `{b}`: leave one out",
                        COLUMNS[slot]
                    ));
                }
            }
            (TableColumn::Time(None), None) => {
                return Err(format!(
                    "the column `{cell}` does not say its unit: call it t_s, t_ms, t_us or t_ns"
                ));
            }
            (TableColumn::WrongUnit, None) => {
                let units = "of time s, ms, us, ns and min are known, of length m, mm, cm, km, ft and in";
                return Err(format!("the column `{cell}` is in a unit that is not known: {units}"));
            }
            _ => unread.push(cell.to_owned()),
        }
    }
    if let Some(missing) = slots.iter().position(Option::is_none) {
        return Err(format!(
            "the header names no column {}; the columns are {} (world_from_camera), units as in t_ms or \
                x_mm; for t x y z qx qy qz qw without a \
             header set trajectory_format = \"tum\"",
            COLUMNS[missing],
            COLUMNS.join(",")
        ));
    }
    Ok((slots.map(Option::unwrap_or_default), unread))
}

fn read_csv(path: &Path, base_s: f64) -> Result<(Vec<PoseRow>, Vec<String>), FrameFileError> {
    let fail = |line: Option<u64>, message: String| failure(path, line, message);
    let mut reader = open_table(path)
        .map_err(|error| fail(None, format!("cannot be read: {error}; paths are relative to FRAME.toml")))?;
    let header = reader.headers().map_err(|error| fail(Some(1), error.to_string()))?.clone();
    // Columns are found by name, as the order of quaternions differs between programs.
    let (columns, unread) = columns_of_header(&header).map_err(|message| fail(Some(1), message))?;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record =
            record.map_err(|error| fail(error.position().map(csv::Position::line), error.to_string()))?;
        let line = record.position().map(csv::Position::line);
        let mut values = [0.0; 8];
        for (value, (index, factor)) in values.iter_mut().zip(columns) {
            let text = record.get(index).unwrap_or_default();
            let number: f64 = text.parse().map_err(|_| {
                let name = header.get(index).unwrap_or_default();
                fail(line, format!("{name} is `{text}`, which is no number"))
            })?;
            *value = factor * number;
        }
        rows.push(pose(values, base_s).map_err(|message| fail(line, message))?);
    }
    let note = || {
        format!(
            "{}: the columns {} are not read: poses are t_s,x,y,z,qw,qx,qy,qz",
            path.display(),
            unread.join(", ")
        )
    };
    Ok((rows, if unread.is_empty() { Vec::new() } else { vec![note()] }))
}

#[cfg(test)]
mod tests;
