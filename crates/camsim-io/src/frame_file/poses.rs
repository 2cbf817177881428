//! `t_s,x,y,z,qw,qx,qy,qz` tables, and those of the TUM benchmarks.

use std::path::Path;

use camsim_core::apply::PoseRow;
use glam::{DQuat, DVec3};

use super::{
    FrameFileError, TrajectoryFormat,
    columns::{Column, column},
};

/// What a table must have, as its messages name it; what [`slot_of`] gives are places in this.
const COLUMNS: [&str; 8] = ["t_s", "x", "y", "z", "qw", "qx", "qy", "qz"];
/// TUM's order of them.
const TUM: [usize; 8] = [0, 1, 2, 3, 5, 6, 7, 4];
/// No clock that counts seconds is as late, be it since 1970: it counts milliseconds or less.
const LATEST_S: f64 = 1e11;

/// Where each of [`COLUMNS`] is in a row, and what its numbers are multiplied by.
type Places = [(usize, f64); 8];

/// Rows with their time from `base_s`, and what there is to say about the table.
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

fn failure(path: &Path, line: Option<u64>, message: impl Into<String>) -> FrameFileError {
    FrameFileError::Poses { path: path.into(), line, message: message.into() }
}

/// `t x y z qx qy qz qw`, with blanks between and lines of `#` for comments, of which one may name the
/// columns in another order.
fn read_tum(path: &Path, base_s: f64) -> Result<Vec<PoseRow>, FrameFileError> {
    let fail = |line: Option<u64>, message: String| failure(path, line, message);
    let text = std::fs::read_to_string(path).map_err(|error| {
        fail(None, format!("cannot be read as text: {error}; paths are relative to FRAME.toml"))
    })?;
    let mut places: Places =
        std::array::from_fn(|slot| (TUM.iter().position(|of| *of == slot).unwrap_or(0), 1.0));
    let mut rows: Vec<PoseRow> = Vec::new();
    for (line, text) in (1..).zip(text.lines()) {
        let Some(words) = words_of(text) else {
            if let Some(named) = named_in_comment(text)
                .map_err(|message| fail(Some(line), message))?
                .filter(|_| rows.is_empty())
            {
                places = named;
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
            pose(places.map(|(at, factor)| factor * numbers[at]), base_s)
                .map_err(|message| fail(Some(line), message))?,
        );
    }
    Ok(rows)
}

/// The columns that a comment names, if it ends with the names of all of them: `# timestamp tx ty tz qw qx qy
/// qz`.
fn named_in_comment(line: &str) -> Result<Option<Places>, String> {
    let line = line.trim_start_matches(['\u{feff}', '#', ' ', '\t']).replace(',', " ");
    let words: Vec<&str> = line.split_whitespace().collect();
    let Some(names) = words.len().checked_sub(8).map(|from| &words[from..]) else { return Ok(None) };
    let mut places: [Option<(usize, f64)>; 8] = [None; 8];
    for (at, name) in names.iter().enumerate() {
        match slot_of(column(name), true) {
            Some((slot, factor)) if places[slot].is_none() => places[slot] = Some((at, factor)),
            _ => return Ok(None),
        }
    }
    let found: Vec<(usize, f64)> = places.into_iter().flatten().collect();
    found.try_into().map(Some).map_err(|_| "names a column twice".to_owned())
}

/// Which of [`COLUMNS`] a column is, and its factor. Without a unit time counts only where it is known to be
/// seconds.
fn slot_of(column: Column, seconds: bool) -> Option<(usize, f64)> {
    match column {
        Column::Time(Some(unit)) => Some((0, unit.factor)),
        Column::Time(None) if seconds => Some((0, 1.0)),
        Column::Position(axis, unit) => Some((1 + axis, unit.factor)),
        Column::Turn(part) => Some((4 + part, 1.0)),
        Column::Time(None) | Column::WrongUnit | Column::Other => None,
    }
}

/// The words of a line that is no comment.
pub(super) fn words_of(line: &str) -> Option<Vec<&str>> {
    let line = line.trim_start_matches('\u{feff}').trim();
    (!line.is_empty() && !line.starts_with('#')).then(|| line.split_whitespace().collect())
}

fn pose([t_s, x, y, z, qw, qx, qy, qz]: [f64; 8], base_s: f64) -> Result<PoseRow, String> {
    if t_s.abs() > LATEST_S {
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

/// The columns of a header by their names.
fn places_of(header: &csv::StringRecord) -> Result<(Places, Vec<String>), String> {
    let mut places: [Option<(usize, f64)>; 8] = [None; 8];
    let mut unread = Vec::new();
    for (at, cell) in header.iter().enumerate() {
        match (column(cell), slot_of(column(cell), false)) {
            (_, Some((slot, factor))) => {
                if let Some((before, _)) = places[slot].replace((at, factor)) {
                    let (a, b) = (header.get(before).unwrap_or_default(), cell);
                    return Err(format!(
                        "the header names two columns for {}, `{a}` and `{b}`: leave one out",
                        COLUMNS[slot]
                    ));
                }
            }
            (Column::Time(None), None) => {
                return Err(format!(
                    "the column `{cell}` does not say its unit: call it t_s, t_ms, t_us or t_ns"
                ));
            }
            (Column::WrongUnit, None) => {
                let units = "of time s, ms, us, ns and min are known, of length m, mm, cm, km, ft and in";
                return Err(format!("the column `{cell}` is in a unit that is not known: {units}"));
            }
            _ => unread.push(cell.to_owned()),
        }
    }
    if let Some(missing) = places.iter().position(Option::is_none) {
        return Err(format!(
            "the header names no column {}; the columns are {} (world_from_camera), units as in t_ms or \
                x_mm; for t x y z qx qy qz qw without a \
             header set trajectory_format = \"tum\"",
            COLUMNS[missing],
            COLUMNS.join(",")
        ));
    }
    Ok((places.map(Option::unwrap_or_default), unread))
}

fn read_csv(path: &Path, base_s: f64) -> Result<(Vec<PoseRow>, Vec<String>), FrameFileError> {
    let fail = |line: Option<u64>, message: String| failure(path, line, message);
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_path(path).map_err(
            |error| fail(None, format!("cannot be read: {error}; paths are relative to FRAME.toml")),
        )?;
    let header = reader.headers().map_err(|error| fail(Some(1), error.to_string()))?.clone();
    // The order of quaternions is the classical mistake, so columns go by name.
    let (places, unread) = places_of(&header).map_err(|message| fail(Some(1), message))?;
    let mut rows = Vec::new();
    for record in reader.records() {
        let record =
            record.map_err(|error| fail(error.position().map(csv::Position::line), error.to_string()))?;
        let line = record.position().map(csv::Position::line);
        let mut values = [0.0; 8];
        for (value, (at, factor)) in values.iter_mut().zip(places) {
            let text = record.get(at).unwrap_or_default();
            let number: f64 = text.parse().map_err(|_| {
                let name = header.get(at).unwrap_or_default().trim_start_matches('\u{feff}');
                fail(line, format!("{name} is `{text}`, which is no number"))
            })?;
            *value = factor * number;
        }
        rows.push(pose(values, base_s).map_err(|message| fail(line, message))?);
    }
    let left_out = || {
        format!(
            "{}: the columns {} are not read: poses are t_s,x,y,z,qw,qx,qy,qz",
            path.display(),
            unread.join(", ")
        )
    };
    Ok((rows, if unread.is_empty() { Vec::new() } else { vec![left_out()] }))
}

#[cfg(test)]
mod tests;
