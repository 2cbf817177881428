//! Tables of the sensors beside the camera, in `OUT/sensors`: `NAME.csv` with one row a sample, `NAME.toml`
//! with what the sensor is, and `NAME_kalibr.yaml` for inertial units.
//!
//! Rows are streamed, and every file is written whole or not at all. They depend on the scenario only, so that
//! all shards and resumed runs write the same bytes.

use std::{
    fs::{self, File},
    io::{self, BufRead as _, BufReader, Write},
    path::{Path, PathBuf},
};

use camsim_core::sensors::{
    BarometerSample, GnssSample, ImuSample, MagnetometerSample, SampleTime, SensorInput, Sensors,
};

use super::{WriteError, atomic::write_atomic_with, write_atomic};
use crate::columns::{Columns, TableRow};

mod description;
mod kalibr;

use description::Description;
pub(crate) use description::SensorFile;
pub use kalibr::kalibr_yaml;
pub(crate) use kalibr::{KalibrFigures, imu_yaml};

/// Folder of the sensors' files, within an output folder.
pub const SENSORS_FOLDER: &str = "sensors";

/// Begin of every `NAME.toml`, by which camsim knows its own files.
const MARK: &str = "# A sensor of camsim: ";

/// What was written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SensorSummary {
    /// Number of sensors.
    pub sensors: usize,
    /// Rows of all tables.
    pub rows: u64,
}

/// Counts over the rows of a table.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Counts {
    rows: u64,
    outside_log: u64,
    /// Rows with an axis at the end of its range, or without a fix.
    flagged: u64,
    /// First and last stamp.
    stamps_ns: Option<[i64; 2]>,
}

impl Counts {
    fn add(&mut self, time: &SampleTime, is_flagged: bool, input: &SensorInput) {
        let (first_s, last_s) = input.trajectory.span_s();
        self.rows += 1;
        self.flagged += u64::from(is_flagged);
        // The tolerance is a nanosecond, the resolution of a stamp.
        self.outside_log += u64::from(time.t_s < first_s - 1e-9 || time.t_s > last_s + 1e-9);
        let first_ns = self.stamps_ns.map_or(time.stamp_ns, |stamps| stamps[0]);
        self.stamps_ns = Some([first_ns, time.stamp_ns]);
    }
}

/// Writes the files of all sensors below `folder/sensors`, and removes those of sensors that there are no
/// more.
///
/// # Errors
/// A file cannot be written, or would replace one that camsim has not made.
pub fn write_sensors(folder: &Path, sensors: &Sensors) -> Result<SensorSummary, WriteError> {
    let folder = folder.join(SENSORS_FOLDER);
    let descriptions = Description::of_all(sensors);
    remove_others(&folder, &descriptions)?;
    for description in &descriptions {
        refuse_foreign(&folder, description.name)?;
    }
    let mut summary = SensorSummary { sensors: descriptions.len(), rows: 0 };
    for description in &descriptions {
        let counts = (description.write_table)(&folder.join(format!("{}.csv", description.name)))?;
        summary.rows += counts.rows;
        description.write(&folder, &counts)?;
    }
    Ok(summary)
}

/// Writes a table, row by row. `mark` gives a sample's time, and whether an axis is at the end of its range or
/// there is no fix.
fn write_table<R: TableRow>(
    path: &Path,
    input: &SensorInput,
    samples: impl Iterator<Item = R>,
    mark: impl Fn(&R) -> (SampleTime, bool),
) -> Result<Counts, WriteError> {
    let mut counts = Counts::default();
    let mut samples = Some(samples);
    let columns = Columns::all();
    write_atomic_with(path, &mut |out| {
        writeln!(out, "{}", columns.header())?;
        let mut line = String::new();
        for sample in samples.take().into_iter().flatten() {
            let (time, is_flagged) = mark(&sample);
            counts.add(&time, is_flagged, input);
            line.clear();
            columns.push_line(&mut line, &sample);
            out.write_all(line.as_bytes())?;
        }
        Ok(())
    })?;
    Ok(counts)
}

fn description_path(folder: &Path, name: &str) -> PathBuf {
    folder.join(format!("{name}.toml"))
}

/// Whether a description is one that camsim has written.
fn is_ours(path: &Path) -> bool {
    let mut line = String::new();
    File::open(path)
        .is_ok_and(|file| BufReader::new(file).read_line(&mut line).is_ok_and(|_| line.starts_with(MARK)))
}

/// Refuses to replace a table that something else has made: one whose description is not camsim's, or whose
/// columns are not those of a sensor. Tables of inertial units that are older than `is_saturated` count as camsim's.
fn refuse_foreign(folder: &Path, name: &str) -> Result<(), WriteError> {
    let table = folder.join(format!("{name}.csv"));
    let description = description_path(folder, name);
    let known = [
        Columns::<ImuSample>::all().header(),
        Columns::<ImuSample>::all().header().replace(",is_saturated", ""),
        Columns::<GnssSample>::all().header(),
        Columns::<BarometerSample>::all().header(),
        Columns::<MagnetometerSample>::all().header(),
    ];
    let has_our_columns = |file: File| {
        let mut line = String::new();
        BufReader::new(file)
            .read_line(&mut line)
            .is_ok_and(|_| known.iter().any(|known| known == line.trim_end()))
    };
    let foreign = if File::open(&table).is_ok_and(|file| !has_our_columns(file)) {
        table
    } else if description.exists() && !is_ours(&description) {
        description
    } else {
        return Ok(());
    };
    let source = io::Error::new(io::ErrorKind::AlreadyExists, "it is no file of a sensor that camsim made");
    Err(WriteError::Io { path: foreign, source })
}

/// Removes the files of sensors that the scenario does not name.
fn remove_others(folder: &Path, descriptions: &[Description<'_>]) -> Result<(), WriteError> {
    // A missing folder has no files.
    for entry in fs::read_dir(folder).into_iter().flatten().flatten() {
        let path = entry.path();
        let name = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        let is_description = path.extension().is_some_and(|ending| ending == "toml");
        if !is_description || descriptions.iter().any(|one| one.name == name) || !is_ours(&path) {
            continue;
        }
        // The description goes last, so that an interrupted removal goes on next time.
        for path in [folder.join(format!("{name}.csv")), folder.join(format!("{name}_kalibr.yaml")), path] {
            match fs::remove_file(&path) {
                Err(source) if source.kind() != io::ErrorKind::NotFound => {
                    return Err(WriteError::Io { path, source });
                }
                _ => {}
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
