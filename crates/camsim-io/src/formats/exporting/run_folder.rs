//! What an output folder of `camsim render` holds: cameras, frames with poses and files, twins, the platform.

use std::path::{Path, PathBuf};

use camsim_core::{
    frame::RowRecord,
    pose::{BodyState, CameraPose},
    scenario::{CameraSpec, FieldOr, FlowInstant, TwinSpec},
    sensors::ImuSample,
    shutter::Shutter,
    timing_faults::TimingFaults,
};
use glam::{DQuat, DVec3};
use serde_json::Value;

use super::DatasetError;
use super::csv_rows::CsvRows;
use crate::columns::{Column, T_S, T_TRUE_NS, TableRow};
use crate::formats::axes::Rigid;
use crate::formats::writing::{Calibration, Intrinsics};
use crate::manifest::RunManifest;
use crate::write::{FRAMES_CSV, FrameRecord, TRAJECTORY_CSV, VARIATIONS_CSV};
use crate::write::{RIG_TOML, rig_names};

/// An output folder.
#[derive(Clone, Debug)]
pub struct RunFolder {
    /// Where it is.
    pub path: PathBuf,
    /// Whether the run is finished.
    pub is_finished: bool,
    /// Its cameras that have frames, in the scenario's order; at least one.
    pub cameras: Vec<RunCamera>,
    /// Names of its cameras that have none, as no frame was asked for that they take.
    pub empty: Vec<String>,
    /// What is added to every stamp.
    shift_ns: i64,
}

/// The pictures of a camera, or of a twin.
#[derive(Clone, Debug)]
pub struct RunCamera {
    /// Name within the rig; empty for the only camera of a run.
    pub name: String,
    /// Folder of its channels.
    pub folder: PathBuf,
    /// Its `run.json`.
    pub manifest: RunManifest,
    /// The camera.
    pub spec: CameraSpec,
    /// Its timing.
    pub shutter: Shutter,
    /// Its frames by number, and by instant in a burst.
    pub frames: Vec<RunFrame>,
    /// Names of the columns of files.
    columns: Vec<String>,
    /// What is added to its stamps.
    shift_ns: i64,
}

/// A row of `frames.csv`.
#[derive(Clone, Debug)]
pub struct RunFrame {
    /// Frame number.
    pub number: u64,
    /// Number within the frame's burst.
    pub instant: Option<u32>,
    /// Stamp, nanoseconds.
    pub stamp_ns: i64,
    /// Pose at the stamp.
    pub pose: CameraPose,
    /// Exposure time.
    pub exposure_ms: f64,
    /// Paths by the columns of files, relative to the folder; empty where there is none.
    files: Vec<String>,
}

/// Motion of the platform at one instant.
#[derive(Clone, Copy, Debug)]
pub struct PlatformState {
    /// Time on the clock of stamps, nanoseconds.
    pub t_ns: i64,
    /// Position, north, east, down, metres.
    pub position_ned_m: DVec3,
    /// Velocity, m/s.
    pub velocity_ned_m_s: DVec3,
    /// Attitude.
    pub ned_from_body: DQuat,
    /// Angular rate in body axes, rad/s.
    pub rate_body_rad_s: DVec3,
}

impl RunFolder {
    /// Reads the tables of an output folder.
    ///
    /// # Errors
    /// A file is missing or malformed, or no frame has been written.
    pub fn open(path: &Path) -> Result<Self, DatasetError> {
        let run = read_run(path)?;
        let all: Vec<RunCamera> = if run.get("cameras").is_none() {
            vec![RunCamera::open(path, String::new())?]
        } else {
            let names = rig_names(path);
            // Those that --camera does not name have no folder.
            let rendered = names.iter().filter(|name| path.join(name).join(FRAMES_CSV).is_file());
            rendered.map(|name| RunCamera::open(&path.join(name), name.clone())).collect::<Result<_, _>>()?
        };
        if all.is_empty() {
            let message = "names no camera that has been rendered: render the folder again".to_owned();
            return Err(DatasetError::Input { path: path.join(RIG_TOML), message });
        }
        let first_table = all[0].folder.join(FRAMES_CSV);
        let (cameras, empty): (Vec<_>, Vec<_>) =
            all.into_iter().partition(|camera| !camera.frames.is_empty());
        if cameras.is_empty() {
            let message = "has no frames with files: render them, with output.format not empty".to_owned();
            return Err(DatasetError::Input { path: first_table, message });
        }
        let is_finished = run.get("finished").and_then(Value::as_bool).unwrap_or(false);
        let empty = empty.into_iter().map(|camera| camera.name).collect();
        Ok(Self { path: path.into(), is_finished, cameras, empty, shift_ns: 0 })
    }

    /// The cameras with these names alone.
    ///
    /// # Errors
    /// The run has no frames of one of them; the message lists those that it has.
    pub fn of_cameras(mut self, names: &[String]) -> Result<Self, DatasetError> {
        let has = |name: &&String| self.cameras.iter().any(|camera| camera.name == **name);
        if let Some(unknown) = names.iter().find(|name| !has(name)) {
            let known: Vec<&str> = self.cameras.iter().map(|camera| camera.name.as_str()).collect();
            let which = match known[..] {
                [""] => "the run has one camera, without a name: leave --camera out".to_owned(),
                _ => format!("the run has frames of {}", known.join(", ")),
            };
            return Err(DatasetError::Refused(format!("--camera {unknown}: {which}")));
        }
        self.cameras.retain(|camera| names.contains(&camera.name));
        self.empty.clear();
        Ok(self)
    }

    /// The run with later stamps.
    #[must_use]
    pub(crate) fn shifted(&self, shift_ns: i64) -> Self {
        let mut later = self.clone();
        later.shift_ns += shift_ns;
        later.cameras.iter_mut().for_each(|camera| camera.shift(shift_ns));
        later
    }

    /// What is added to the stamps of the run.
    pub(crate) fn shift_ns(&self) -> i64 {
        self.shift_ns
    }

    /// The folder with what cameras and twins share: this one, or one above it.
    pub(crate) fn shared_folder(&self) -> &Path {
        let above = self.path.ancestors().take(3);
        let has_it = |path: &&Path| path.join(TRAJECTORY_CSV).is_file() && path.join("run.json").is_file();
        above.into_iter().find(has_it).unwrap_or(&self.path)
    }

    /// The `run.json` of the first camera; all have the same but for their camera.
    #[must_use]
    pub fn manifest(&self) -> &RunManifest {
        &self.cameras[0].manifest
    }

    /// The motion of the platform, row by row.
    pub(crate) fn platform(&self) -> Result<PlatformRows, DatasetError> {
        PlatformRows::open(&self.shared_folder().join(TRAJECTORY_CSV), self.shift_ns)
    }

    /// Number of frames of all cameras.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.cameras.iter().map(|camera| camera.frames.len() as u64).sum()
    }
}

/// Reads `run.json`.
fn read_run(folder: &Path) -> Result<Value, DatasetError> {
    let path = folder.join("run.json");
    let fail = |message: String| DatasetError::Input { path: path.clone(), message };
    let text = std::fs::read_to_string(&path).map_err(|error| {
        let advice = if folder.join(VARIATIONS_CSV).is_file() {
            "the folder has variations: name one of them, such as variation_000000"
        } else {
            "name a folder that camsim render has made"
        };
        fail(format!("cannot be read: {error}; {advice}"))
    })?;
    serde_json::from_str(&text).map_err(|error| fail(format!("is no run.json of camsim: {error}")))
}

impl RunCamera {
    fn open(folder: &Path, name: String) -> Result<Self, DatasetError> {
        let fail = |message: String| DatasetError::Input { path: folder.join("run.json"), message };
        let run = read_run(folder)?;
        let manifest: RunManifest = serde_json::from_value(run)
            .map_err(|error| fail(format!("is not of this version of camsim: {error}")))?;
        let spec = manifest.scenario.camera.clone();
        let shutter =
            Shutter::from_spec(&spec.shutter, spec.fps, spec.size_px).map_err(|e| fail(e.to_string()))?;
        let (columns, frames) = read_frames(&folder.join(FRAMES_CSV), spec.shutter.exposure_ms)?;
        Ok(Self { name, folder: folder.into(), manifest, spec, shutter, frames, columns, shift_ns: 0 })
    }

    fn shift(&mut self, shift_ns: i64) {
        self.shift_ns += shift_ns;
        self.frames.iter_mut().for_each(|frame| frame.stamp_ns = frame.stamp_ns.saturating_add(shift_ns));
    }

    /// Twins beside its frames.
    #[must_use]
    pub fn twins(&self) -> &[TwinSpec] {
        &self.manifest.scenario.output.twin
    }

    /// The pictures of a twin of this camera.
    ///
    /// # Errors
    /// As [`RunFolder::open`].
    pub fn twin(&self, twin: &TwinSpec) -> Result<Self, DatasetError> {
        let mut twin = Self::open(&self.folder.join(&twin.name), self.name.clone())?;
        twin.shift(self.shift_ns);
        Ok(twin)
    }

    /// Columns and paths of a frame's own files; not the video, which has all frames.
    pub fn files<'a>(&'a self, frame: &'a RunFrame) -> impl Iterator<Item = (String, PathBuf)> + 'a {
        let files = self.columns.iter().zip(&frame.files).filter(|(_, file)| file.contains('/'));
        files.map(|(column, file)| (column.clone(), self.folder.join(file)))
    }

    /// Whether every frame has a file in this column.
    #[must_use]
    pub fn has(&self, column: &str) -> bool {
        self.index(column).is_some_and(|index| self.frames.iter().all(|frame| !frame.files[index].is_empty()))
    }

    fn index(&self, column: &str) -> Option<usize> {
        self.columns.iter().position(|known| known == column)
    }

    /// Path of a frame's file; empty if there is none.
    #[must_use]
    pub fn file(&self, frame: &RunFrame, column: &str) -> PathBuf {
        let name = self.index(column).map_or("", |index| frame.files[index].as_str());
        if name.is_empty() { PathBuf::new() } else { self.folder.join(name) }
    }

    /// Checks that every frame has a file in each of these columns.
    ///
    /// # Errors
    /// [`DatasetError::Missing`] with the key that writes it.
    pub fn require(&self, format: &str, columns: &[&str]) -> Result<(), DatasetError> {
        let Some(missing) = columns.iter().find(|column| !self.has(column)) else { return Ok(()) };
        let key = match *missing {
            "color_png" => "\"png\" to output.format, and \"color\" to output.channels".to_owned(),
            "color_exr" => "\"exr\" to output.format, and \"color\" to output.channels".to_owned(),
            channel => format!("\"{channel}\" to output.channels"),
        };
        let frame = self.frames.iter().find(|frame| self.file(frame, missing).as_os_str().is_empty());
        let which = frame.map_or_else(String::new, |frame| format!(" (frame {} is the first)", frame.number));
        Err(DatasetError::Missing(format!(
            "{format} needs {missing} of every frame, which {} lacks{which}: add {key} and render again, or export \
             the scenario itself, which renders what is needed",
            self.folder.display()
        )))
    }

    /// Time of the mid-exposure of the image's centre on the platform's clock, nanoseconds, by the frame's stamp,
    /// with its errors.
    #[must_use]
    pub fn centre_ns(&self, frame: &RunFrame) -> i64 {
        frame.stamp_ns.saturating_add((self.stamp_to_centre_s() * 1e9).round() as i64)
    }

    /// As [`Self::centre_ns`], but when it was really exposed.
    #[must_use]
    pub fn true_centre_ns(&self, frame: &RunFrame) -> i64 {
        self.centre_ns(frame).saturating_sub(self.stamp_error_ns(frame))
    }

    /// How much a stamp is ahead of the trigger of its picture, but for the clock's offset, nanoseconds.
    #[must_use]
    pub fn stamp_error_ns(&self, frame: &RunFrame) -> i64 {
        let faults = TimingFaults::new(&self.spec, self.manifest.scenario.seed);
        faults.map_or(0, |faults| (faults.stamp_error_s(frame.number as i64) * 1e9).round() as i64)
    }

    /// What is added to a stamp to get the mid-exposure of the image's centre on the platform's clock, seconds.
    #[must_use]
    pub fn stamp_to_centre_s(&self) -> f64 {
        let dt_s = self.shutter.dt_instant_s(FlowInstant::Centre) - self.spec.clock_offset_ns() as f64 * 1e-9;
        // Without the sign of a zero.
        dt_s + 0.0
    }

    /// Whether the centre is exposed at the stamp.
    #[must_use]
    pub fn is_prompt(&self) -> bool {
        self.shutter.delay_s() == 0.0
    }

    /// Pose at the mid-exposure of the image's centre: that at the stamp, or that between two rows.
    ///
    /// # Errors
    /// The camera has a delay, and the frames no `rows`.
    pub fn centre_pose(&self, format: &str, frame: &RunFrame) -> Result<CameraPose, DatasetError> {
        if self.is_prompt() {
            return Ok(frame.pose);
        }
        self.require(format, &["rows"])?;
        let columns = ["row", "position_ned_m", "ned_from_camera_wxyz"];
        let mut rows = CsvRows::open::<RowRecord>(&self.file(frame, "rows"), &columns)?;
        let (first, second, fraction) = self.shutter.centre_lines();
        let mut middle: Vec<(DVec3, DQuat)> = Vec::with_capacity(2);
        while rows.advance()? {
            let row: u32 = rows.whole(0)?;
            if row == first || row == second {
                middle.push((rows.vector(1)?, rows.wxyz(2)?));
            }
        }
        let (Some(a), Some(b)) = (middle.first(), middle.last()) else {
            let message = "has no row of the image's middle; render it again".to_owned();
            return Err(DatasetError::Input { path: self.file(frame, "rows"), message });
        };
        Ok(CameraPose { position_ned_m: a.0.lerp(b.0, fraction), ned_from_camera: a.1.slerp(b.1, fraction) })
    }

    /// Camera matrix and lens.
    ///
    /// # Errors
    /// The camera zooms: no layout can hold that.
    pub fn intrinsics(&self) -> Result<Intrinsics, DatasetError> {
        Ok(Intrinsics::of(&self.spec)?)
    }

    /// The camera as calibration files describe it.
    ///
    /// # Errors
    /// As [`Self::intrinsics`].
    pub fn calibration(&self) -> Result<Calibration, DatasetError> {
        Ok(Calibration::new(&self.spec)?)
    }

    /// The camera's pose in the body (forward, right, down), without vibration.
    #[must_use]
    pub fn body_from_camera(&self) -> Rigid {
        Rigid::of_mount(&self.spec.mount)
    }

    /// Whether the camera shakes against the body.
    #[must_use]
    pub fn vibrates(&self) -> bool {
        !self.spec.mount.vibration.is_empty()
    }

    /// Whether all pixels have one instant.
    #[must_use]
    pub fn is_global(&self) -> bool {
        self.shutter.readout_s() == 0.0 && self.spec.shutter.interlace_ms == FieldOr::Ms(0.0)
    }
}

/// Names of the columns of files, and the frames.
fn read_frames(path: &Path, nominal_ms: f64) -> Result<(Vec<String>, Vec<RunFrame>), DatasetError> {
    let columns = ["frame", "stamp_ns", "position_ned_m", "ned_from_camera_wxyz"];
    let mut rows = CsvRows::open::<FrameRecord>(path, &columns)?;
    let header: Vec<String> = rows.header().iter().map(str::to_owned).collect();
    let index = |of: &str| header.iter().position(|name| name == of);
    let (instant, exposure) = (index("instant"), index("exposure_ms"));
    // Those of values stand before them.
    let values: Vec<String> = FrameRecord::COLUMNS.iter().flat_map(Column::names).collect();
    let first = header.iter().take_while(|name| values.contains(name)).count();
    let columns = header[first..].to_vec();
    let mut frames = Vec::new();
    while rows.advance()? {
        let own_ms = |index: usize| rows.cell(index).parse().ok();
        frames.push(RunFrame {
            number: rows.whole(0)?,
            instant: instant.and_then(|index| rows.cell(index).parse().ok()),
            stamp_ns: rows.whole(1)?,
            pose: CameraPose { position_ned_m: rows.vector(2)?, ned_from_camera: rows.wxyz(3)? },
            // Pictures of one instant have no exposure time, however long they collect light.
            exposure_ms: exposure.filter(|_| nominal_ms > 0.0).and_then(own_ms).unwrap_or(nominal_ms),
            files: (0..columns.len()).map(|k| rows.cell(first + k).to_owned()).collect(),
        });
    }
    Ok((columns, frames))
}

/// Rows of `trajectory.csv`, or the true motion of an inertial sensor.
pub(crate) struct PlatformRows {
    rows: CsvRows,
    /// Whether times are nanoseconds, not seconds.
    has_ns: bool,
    shift_ns: i64,
}

impl PlatformRows {
    fn open(path: &Path, shift_ns: i64) -> Result<Self, DatasetError> {
        let columns = [T_S, "position_ned_m", "velocity_ned_m_s", "ned_from_body_wxyz", "rate_body_rad_s"];
        Ok(Self { rows: CsvRows::open::<BodyState>(path, &columns)?, has_ns: false, shift_ns })
    }

    /// The sensor is the body.
    pub(crate) fn of_sensor(path: &Path, shift_ns: i64) -> Result<Self, DatasetError> {
        let columns =
            [T_TRUE_NS, "position_ned_m", "velocity_ned_m_s", "ned_from_sensor_wxyz", "true_gyro_rad_s"];
        Ok(Self { rows: CsvRows::open::<ImuSample>(path, &columns)?, has_ns: true, shift_ns })
    }

    /// The next row; `None` at the end.
    pub(crate) fn next_state(&mut self) -> Result<Option<PlatformState>, DatasetError> {
        let rows = &mut self.rows;
        if !rows.advance()? {
            return Ok(None);
        }
        let t_ns: i64 = if self.has_ns { rows.whole(0)? } else { rows.seconds_ns(0)? };
        Ok(Some(PlatformState {
            t_ns: t_ns.saturating_add(self.shift_ns),
            position_ned_m: rows.vector(1)?,
            velocity_ned_m_s: rows.vector(2)?,
            ned_from_body: rows.wxyz(3)?,
            rate_body_rad_s: rows.vector(4)?,
        }))
    }
}
