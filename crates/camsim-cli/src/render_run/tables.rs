//! Tables beside the frames: `camera.toml`, the trajectories, `frames.csv`.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
};

use anyhow::anyhow;
use camsim_core::{
    mount::CameraPath,
    pose::BodyState,
    scenario::{Channel, PlaneKind, Scenario, TrajectorySpan},
    sequence::Sequence,
    shutter::Shutter,
    trajectory::Trajectory,
};
use camsim_io::{
    columns::CameraState,
    portable::write_camera,
    write::{
        FrameRecord, FrameTable, OBJECTS_CSV, SENSORS_FOLDER, SourceFrame, Stamped, TIMING_CSV,
        TRAJECTORY_CSV, TableKind, WriteError, frames_path, listed_frames, objects_csv, timing_csv,
        trajectory_csv, write_atomic, write_sensors,
    },
};
use camsim_plan::{FramePlan, Planner};

use super::{
    Job,
    pictures::{Pictures, Series},
};
use crate::{
    console::Console,
    failure::{Failure, OrFail},
};

/// Most rows of `trajectory.csv`: seven hours at 400 Hz, 3 GB.
const MOST_TRAJECTORY_ROWS: f64 = 10e6;
/// Tables of motion that are larger are told before the first frame.
const MUCH_BYTES: u64 = 20_000_000;

const CAMERA_TRAJECTORY_CSV: &str = "camera_trajectory.csv";

/// Whether a scenario writes numbers of objects or classes.
fn numbers_objects(scenario: &Scenario) -> bool {
    let has_numbers = |channel: &Channel| channel.kind() == PlaneKind::Index;
    scenario.output.channels.iter().any(has_numbers) && !scenario.output.format.is_empty()
}

/// Removes the table of objects of another scenario.
pub fn remove_objects(folder: &Path) -> Result<(), Failure> {
    remove(folder.join(OBJECTS_CSV))
}

/// Removes the table of triggers and stamps of another scenario.
pub fn remove_timing(folder: &Path) -> Result<(), Failure> {
    remove(folder.join(TIMING_CSV))
}

fn remove(path: PathBuf) -> Result<(), Failure> {
    match std::fs::remove_file(&path) {
        Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
            Err(WriteError::Io { path, source }).or_failed()
        }
        _ => Ok(()),
    }
}

/// Writes `objects.csv` if numbers of objects or classes are written.
pub fn write_objects(pictures: &Pictures) -> Result<(), Failure> {
    let sequence = &pictures.sequence;
    if !numbers_objects(&sequence.scenario) {
        return Ok(());
    }
    let objects = objects_csv(&sequence.scene.objects);
    write_atomic(&pictures.folder.join(OBJECTS_CSV), objects.as_bytes()).or_failed()
}

/// Writes `camera.toml`, the trajectories and the tables of sensors, which depend on scenario and frames only.
pub fn write_fixed(job: &Job<'_>, console: &mut Console<'_>) -> Result<(), Failure> {
    let sequence = job.sequence;
    write_camera(job.folder, &sequence.scenario.camera).or_failed()?;
    write_trajectories(job)?;
    if let Some(table) = timing_csv(sequence) {
        write_atomic(&job.folder.join(TIMING_CSV), table.as_bytes()).or_failed()?;
    }
    job.sensors.map(|sensors| write_sensors(job.folder, sensors)).transpose().or_failed()?;
    tell_size(job.folder, console);
    let (rate_hz, vibration_hz) = (sequence.scenario.tracker.rate_hz, sequence.path.highest_vibration_hz());
    if vibration_hz > 0.5 * rate_hz {
        let of_camera = job.camera.map_or_else(String::new, |name| format!("camera {name}: "));
        console.warn(console.whole(&format!(
            "{of_camera}camera_trajectory.csv has {rate_hz} rows per second, too few for the mount's vibration of \
             {vibration_hz} Hz (which the frames contain exactly): `camsim track SCENARIO.toml --of camera \
             --rate {:.0} -o poses.csv` writes more",
            8.0 * vibration_hz
        )));
    }
    Ok(())
}

/// Writes the trajectories of platform and camera.
fn write_trajectories(job: &Job<'_>) -> Result<(), Failure> {
    let sequence = job.sequence;
    let has_sensors = job.sensors.is_some_and(|sensors| !sensors.is_empty());
    let of_camera = [(&**sequence, covered_frames(sequence, job.frames, job.folder, has_sensors))];
    write_platform(job.folder, &of_camera)?;
    let Some(seen_s) = seen_s(&of_camera)? else { return Ok(()) };
    let epoch_ns = sequence.platform_epoch_ns();
    let ticks = ticks(&sequence.path.trajectory, sequence.scenario.tracker.rate_hz, seen_s);
    let optical = trajectory_csv(ticks.map(|t_s| camera_at(&sequence.path, epoch_ns, t_s)));
    write_atomic(&job.folder.join(CAMERA_TRAJECTORY_CSV), optical.as_bytes()).or_failed()
}

/// Writes the trajectories again if frames of other runs, which may have worked at the same time, are in the folder.
pub fn complete_trajectories(job: &Job<'_>) -> Result<(), Failure> {
    if has_others(job) { write_trajectories(job) } else { Ok(()) }
}

/// Whether a folder has frames before or after those of a run.
pub fn has_others(job: &Job<'_>) -> bool {
    let of_run = job.frame_range();
    listed_frames(job.folder).is_some_and(|[first, last]| first < of_run[0] || last >= of_run[1])
}

/// Says before the first frame what the tables of motion take, where that is much.
pub fn tell_size(folder: &Path, console: &mut Console<'_>) {
    let bytes = motion_bytes(folder);
    if bytes > MUCH_BYTES {
        console.note(format_args!(
            "trajectories and sensors in {} take {:.1} MB: output.trajectory, flight.window_s, tracker.rate_hz and the \
             rates of the sensors decide how much",
            folder.display(),
            bytes as f64 * 1e-6
        ));
    }
}

/// Bytes of the trajectories and of the sensors in a folder.
pub fn motion_bytes(folder: &Path) -> u64 {
    let tables = [TRAJECTORY_CSV, CAMERA_TRAJECTORY_CSV].map(|name| folder.join(name));
    let sensors = std::fs::read_dir(folder.join(SENSORS_FOLDER)).into_iter().flatten().flatten();
    let files = tables.into_iter().chain(sensors.map(|entry| entry.path()));
    files.filter_map(|path| std::fs::metadata(path).ok()).map(|file| file.len()).sum()
}

/// The first and the last frame that the trajectories of a camera cover, by `output.trajectory`: those of the run,
/// and those that the folder has from other runs, or all; sensors beside the camera cover all, and so does their
/// truth. `None` without a frame.
pub fn covered_frames(
    sequence: &Sequence,
    frames: &[u64],
    folder: &Path,
    has_sensors: bool,
) -> Option<[u64; 2]> {
    if sequence.scenario.output.trajectory == TrajectorySpan::Flight || has_sensors {
        return sequence.frames.checked_sub(1).map(|last| [0, last]);
    }
    let of_run = frames.first().zip(frames.last()).map(|(&first, &last)| [first, last]);
    let listed = listed_frames(folder);
    of_run.into_iter().chain(listed).reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
}

/// Writes `trajectory.csv` for the time that these frames of cameras of one platform see.
pub fn write_platform(folder: &Path, cameras: &[(&Sequence, Option<[u64; 2]>)]) -> Result<(), Failure> {
    let (Some((sequence, _)), Some(all_s)) = (cameras.first(), seen_s(cameras)?) else { return Ok(()) };
    let rate_hz = sequence.scenario.tracker.rate_hz;
    let rows = (all_s[1] - all_s[0]) * rate_hz;
    if rows > MOST_TRAJECTORY_ROWS {
        return Err(Failure::bad_input(anyhow!(
            "trajectory.csv would have {rows:.0} rows, more than {MOST_TRAJECTORY_ROWS:.0}: render fewer frames at once, \
             make flight.window_s shorter or tracker.rate_hz lower"
        )));
    }
    let trajectory = &sequence.path.trajectory;
    let epoch_ns = sequence.platform_epoch_ns();
    let body =
        trajectory_csv(ticks(trajectory, rate_hz, all_s).map(|t_s| body_at(trajectory, epoch_ns, t_s)));
    write_atomic(&folder.join(TRAJECTORY_CSV), body.as_bytes()).or_failed()
}

/// Path times that frames of these sequences see, the first and the last.
fn seen_s(cameras: &[(&Sequence, Option<[u64; 2]>)]) -> Result<Option<[f64; 2]>, Failure> {
    let mut all: Option<[f64; 2]> = None;
    for (sequence, frames) in cameras {
        let Some([first, last]) = *frames else { continue };
        let camera = &sequence.scenario.camera;
        let (begin_s, end_s) = Shutter::longest_of(camera).or_bad_input()?.window_s();
        let nominal_s = |frame: u64| sequence.start_s + (frame as f64 + camera.phase) / camera.fps;
        let late_s = camera.timing.as_ref().map_or(0.0, |timing| 1e-3 * timing.late_ms);
        let first_s = nominal_s(first).min(sequence.stamp_s(first as f64)) + begin_s;
        let last_s = (nominal_s(last) + late_s).max(sequence.stamp_s(last as f64)) + end_s;
        let before = all.unwrap_or([first_s, last_s]);
        all = Some([before[0].min(first_s), before[1].max(last_s)]);
    }
    Ok(all)
}

fn table_kind(pictures: &Pictures) -> TableKind {
    let sequence = &pictures.sequence;
    TableKind {
        has_geodetic: pictures.earth.is_some(),
        has_exposures: sequence.exposures.is_some(),
        has_instants: pictures.has_instants(),
    }
}

/// Rows of this scenario in the folder's `frames.csv`.
pub fn begin_frames(pictures: &Pictures, is_ours: bool) -> Result<(), Failure> {
    let path = frames_path(&pictures.folder);
    let kind = table_kind(pictures);
    let mut table = if is_ours { FrameTable::read(&path, kind) } else { FrameTable::new(kind) };
    table.retain_existing(&pictures.folder, &|_, _| false);
    table.write(&path).or_failed()
}

/// Updates `frames.csv`: rows of other runs stay with their files, `made` are those of this run, and frames
/// whose run did not write its rows get them from their plans. Without frame files (`format = []`) the rows
/// are those of the rendered frames. `series` is the last one that was rendered, with its planner. Returns the
/// frames that the table lists.
pub fn end_frames(
    pictures: &Pictures,
    series: &Series,
    planner: &Planner,
    made: &BTreeMap<(u64, Option<u32>), SourceFrame>,
) -> Result<BTreeSet<u64>, Failure> {
    let path = frames_path(&pictures.folder);
    let mut table = FrameTable::read(&path, table_kind(pictures));
    let Series { sequence, files } = series;
    let instant = files.instant();
    let writes = !sequence.scenario.output.format.is_empty();
    let made_here = |frame: u64| made.get(&(frame, instant));
    for frame in (0..sequence.frames).filter(|&frame| !writes || files.exist(frame)) {
        if let Some(source) = made_here(frame) {
            table.insert(&record(pictures, series, planner, frame, *source));
        } else if writes && !table.has_files(frame, instant, &files.names(frame)) {
            let plan = planner.plan(frame).or_bad_input()?;
            table.insert(&record(pictures, series, planner, frame, source_frame(sequence, &plan)));
        }
    }
    table
        .retain_existing(&pictures.folder, &|frame, instant| !writes && made.contains_key(&(frame, instant)));
    table.write(&path).or_failed()?;
    Ok(table.frames().collect())
}

/// The frame to which the source coordinates of a plan refer.
pub fn source_frame(sequence: &Sequence, plan: &FramePlan) -> SourceFrame {
    SourceFrame::new(plan.ideal_view(), plan.key_s, sequence.epoch_ns)
}

fn record(
    pictures: &Pictures,
    series: &Series,
    planner: &Planner,
    frame: u64,
    source: SourceFrame,
) -> FrameRecord {
    let Series { sequence, files } = series;
    let pose = sequence.path.pose(planner.stamp_s(frame));
    FrameRecord {
        frame,
        instant: files.instant(),
        stamp_ns: sequence.stamp_ns(frame),
        pose,
        geodetic: pictures.earth.map(|earth| earth.geodetic_from_ned(pose.position_ned_m)),
        source,
        exposure: sequence.exposure(frame),
        files: files.names(frame),
    }
}

/// Instants at `start + k / rate_hz` that enclose `seen_s`; outside of the log the platform coasts.
fn ticks(trajectory: &Trajectory, rate_hz: f64, seen_s: [f64; 2]) -> impl Iterator<Item = f64> + use<> {
    let start_s = trajectory.span_s().0;
    let tick = |t_s: f64| (t_s - start_s) * rate_hz;
    let (first, last) = ((tick(seen_s[0]) + 1e-6).floor() as i64, (tick(seen_s[1]) - 1e-6).ceil() as i64);
    (first..=last).map(move |k| start_s + k as f64 / rate_hz)
}

/// A row of `trajectory.csv`.
pub fn body_at(trajectory: &Trajectory, epoch_ns: i64, t_s: f64) -> Stamped<BodyState> {
    Stamped { t_ns: stamp_ns(epoch_ns, t_s), state: trajectory.state(t_s) }
}

/// A row of `camera_trajectory.csv`.
pub fn camera_at(path: &CameraPath, epoch_ns: i64, t_s: f64) -> Stamped<CameraState> {
    Stamped { t_ns: stamp_ns(epoch_ns, t_s), state: CameraState::at(path, t_s) }
}

/// Converts path time to a stamp, nanoseconds.
fn stamp_ns(epoch_ns: i64, t_s: f64) -> i64 {
    epoch_ns.saturating_add((t_s * 1e9).round() as i64)
}
