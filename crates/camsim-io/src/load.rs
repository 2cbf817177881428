//! Loads all files of a scenario, checks them against each other, and converts them to one local frame.

use std::{path::PathBuf, sync::Arc};

use crate::{
    board_file::BoardFileError,
    flight_log::{FlightLogError, read_flight_log},
    gltf_file::{GltfError, MAX_RADIUS_M},
    kernel_file::{KernelFileError, load_kernel},
    lens_table::{LensTableError, load_lens_table},
    raster::pictures::{PictureError, read_vignette},
    raster::{Ground, TerrainFileError, TerrainSummary},
};
use camsim_core::{
    auto_exposure::{ExposureError, ExposureTrack},
    flight_log::{FlightLog, HeightConversion},
    geodesy::Geodetic,
    mount::{CameraPath, MountError},
    resized::delivered,
    scenario::{
        Auto, CameraSpec, Channel, FieldOr, FlightHeight, FlightSpec, HeightReference, PlaneKind, Problem,
        Rig, Scenario, TrackerKind,
    },
    sensors::{SensorError, Sensors},
    sequence::Sequence,
    temporal::SAMPLES,
    tracker::{TrackResult, TrackerError, track},
};

mod coverage;
mod far_models;
mod motion;
mod objects;
mod optics;
mod placements;
mod pose_table;
mod position_columns;
mod scene;
mod sensors;
mod track_points;
mod unlikely;

pub use coverage::{Outlook, outlook};
pub use optics::vignette_warnings;
use optics::{load_zoom_track, optics_warnings};
pub use scene::board_position_ned_m;
use scene::load_scene;
pub use sensors::{load_sensors, sensor_warnings};
pub use track_points::TrackInputs;
use unlikely::unlikely_values;

/// Maximum number of frames of a sequence: four days at 30 per second. More is a mistake in `camera.fps`.
const MAX_FRAMES: f64 = 10e6;

/// Why a scenario cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The flight log cannot be read.
    #[error(transparent)]
    Log(#[from] FlightLogError),
    /// A camera of several cannot be loaded.
    #[error("camera {name}: {source}")]
    Camera {
        /// Its name.
        name: String,
        /// What is wrong.
        source: Box<LoadError>,
    },
    /// The log cannot be tracked.
    #[error(transparent)]
    Tracker(#[from] TrackerError),
    /// Pictures cannot be metered.
    #[error(transparent)]
    Exposure(#[from] ExposureError),
    /// The mount is not valid.
    #[error(transparent)]
    Mount(#[from] MountError),
    /// `camera.resized` cannot be applied.
    #[error("{}", .0.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))]
    Resized(Vec<Problem>),
    /// The terrain cannot be read.
    #[error(transparent)]
    Terrain(#[from] TerrainFileError),
    /// A picture cannot be read.
    #[error("{source}; check {key}")]
    Picture {
        /// Key that names the picture.
        key: &'static str,
        /// What is wrong.
        source: PictureError,
    },
    /// A log with local coordinates in a georeferenced scene.
    #[error(
        "{log} has local coordinates, but {key} is georeferenced: set flight.origin = [lat_deg, lon_deg, \
            height_m], the position on Earth of the log's (0, 0, 0)"
    )]
    NoOrigin {
        /// The log.
        log: PathBuf,
        /// Key that is georeferenced.
        key: &'static str,
    },
    /// A model cannot be read.
    #[error("scene.gltf: {0}")]
    Gltf(#[from] GltfError),
    /// `scene.gltf.classes` names nothing of its model.
    #[error("scene.gltf.classes: {}: has no {kind} `{name}`; its {kind}s are {}", file.display(), listed(known))]
    NoSuchPart {
        /// The model.
        file: PathBuf,
        /// `node` or `material`.
        kind: &'static str,
        /// The name.
        name: String,
        /// All names of that kind.
        known: Vec<String>,
    },
    /// More objects than `object` can number.
    #[error(
        "the scene has {0} objects, and output.channels object, class and coverage number at most \
            {MAX_OBJECTS}: set objects = \"placement\" for models, place fewer, or leave these channels out"
    )]
    TooManyObjects(usize),
    /// A table of placements cannot be read.
    #[error("{path}: {problem}")]
    Placements {
        /// The file.
        path: PathBuf,
        /// What is wrong, where, and what to do.
        problem: String,
    },
    /// A table of points to track cannot be read.
    #[error("{path}: {problem}")]
    TrackPoints {
        /// The file.
        path: PathBuf,
        /// What is wrong, where, and what to do.
        problem: String,
    },
    /// A table of poses cannot be read.
    #[error("{path}: {problem}")]
    Poses {
        /// The file.
        path: PathBuf,
        /// What is wrong, where, and what to do.
        problem: String,
    },
    /// A path without length.
    #[error("scene.gltf: the path of {file} has no length: give motion.path two different points")]
    Path {
        /// The model.
        file: PathBuf,
    },
    /// Models are to stand on the ground where there is none.
    #[error(
        "scene.gltf: {file} is to stand on the ground, but there is none at north {north_m:.1} m, east \
            {east_m:.1} m: move it onto the terrain, or leave on_ground out"
    )]
    NoGround {
        /// The model.
        file: PathBuf,
        /// North of the placement, metres.
        north_m: f64,
        /// East of the placement, metres.
        east_m: f64,
    },
    /// A model is farther away than [`MAX_RADIUS_M`].
    #[error(
        "scene.gltf: {file} reaches {reach_m:.1e} m from the local frame's origin, more than \
            {MAX_RADIUS_M:.0e}: check its position and scale"
    )]
    TooFar {
        /// The model.
        file: PathBuf,
        /// Largest distance of a vertex from the origin, metres.
        reach_m: f64,
    },
    /// A calibration board cannot be read.
    #[error("scene.board: {0}")]
    Board(#[from] BoardFileError),
    /// The window (start and end in seconds) holds no frame at this frame rate.
    #[error(
        "flight.window_s = [{0}, {1}] holds no frame at {2} frames a second: make the window longer or \
            camera.fps higher"
    )]
    NoFrame(f64, f64, f64),
    /// No frame lies within the log's first and last row.
    #[error(
        "flight.window_s: none of the {frames} frames, from {first_s:.3} s on, lies in the log, which has rows from \
            0 to {log_s:.3} s"
    )]
    OutsideLog {
        /// Number of frames.
        frames: u64,
        /// First frame, seconds after the log's first row.
        first_s: f64,
        /// Length of the log, seconds.
        log_s: f64,
    },
    /// The window holds more frames than [`MAX_FRAMES`]; frames and frame rate.
    #[error(
        "the window holds {0:.0} frames at {1} frames a second, more than {MAX_FRAMES:.0}: make \
            flight.window_s shorter or camera.fps lower"
    )]
    TooManyFrames(f64, f64),
    /// The zoom track cannot be read.
    #[error(
        "{path}{line}: {problem}; camera.zoom_track needs a header `t_s,zoom` (or t_ms, t_us, t_ns) and rows \
            of finite numbers by ascending time"
    )]
    ZoomTrack {
        /// The file.
        path: PathBuf,
        /// `, line N`, or nothing.
        line: String,
        /// What is wrong.
        problem: String,
    },
    /// The file of a lens cannot be used.
    #[error(transparent)]
    LensTable(#[from] LensTableError),
    /// The file of a kernel cannot be used.
    #[error("{0}; check camera.point_spread.kernel")]
    Kernel(#[from] KernelFileError),
    /// A sensor cannot be simulated.
    #[error(transparent)]
    Sensor(#[from] SensorError),
    /// A zoom lens without a track, or a track without a zoom lens.
    #[error("camera.zoom and camera.zoom_track belong together: give both, or neither for a fixed lens")]
    ZoomPair,
}

/// Largest number of an object: `object` is a picture of 16 bits.
pub const MAX_OBJECTS: usize = 65_535;

/// Names for a message, at most twenty.
fn listed(names: &[String]) -> String {
    const MOST: usize = 20;
    let shown: Vec<String> = names.iter().take(MOST).map(|name| format!("`{name}`")).collect();
    let more = if names.len() > MOST { format!(" and {} more", names.len() - MOST) } else { String::new() };
    if names.is_empty() { "none".to_owned() } else { shown.join(", ") + &more }
}

/// A loaded scenario, with warnings.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// Input of planner and renderers.
    pub sequence: Arc<Sequence>,
    /// The cleaned log; its report counts every repair.
    pub log: Arc<FlightLog>,
    /// The tracked trajectory, with the limits of the tracker.
    pub tracked: Arc<TrackResult>,
    /// Extent and resolution of the terrain.
    pub terrain: Option<TerrainSummary>,
    /// Points of `[output.tracks]` that files and keys give.
    pub tracks: TrackInputs,
    /// The sensors beside the camera.
    pub sensors: Sensors,
    /// Warnings for the user.
    pub warnings: Vec<String>,
    /// The part of [`Self::warnings`] that concerns the scene.
    scene_notes: Vec<String>,
}

/// Reads all files that a scenario names. Paths are used as they are.
///
/// # Errors
/// [`LoadError`] names the file or key and what to do.
pub fn load_sequence(scenario: &Scenario) -> Result<Loaded, LoadError> {
    load_or_reuse(scenario, None)
}

/// As [`load_sequence`], for each camera of a rig. Log, trajectory and scene are read once, and shared.
///
/// # Errors
/// As [`load_sequence`]; those of a camera of several name it.
pub fn load_rig(rig: &Rig) -> Result<Vec<Loaded>, LoadError> {
    reload_rig(rig, &[])
}

/// As [`load_rig`], but reuses parts of the cameras of `before` as [`reload_sequence`] does.
///
/// # Errors
/// As [`load_rig`].
pub fn reload_rig(rig: &Rig, before: &[Loaded]) -> Result<Vec<Loaded>, LoadError> {
    let mut all: Vec<Loaded> = Vec::new();
    for scenario in rig.scenarios() {
        let of_camera = |source| match rig.is_list() {
            true => LoadError::Camera { name: scenario.camera.name.clone(), source: Box::new(source) },
            false => source,
        };
        all.push(load_or_reuse(scenario, all.first().or(before.first())).map_err(of_camera)?);
    }
    Ok(all)
}

/// As [`load_sequence`], but reuses the parts of `before` whose keys are unchanged, even if their files have
/// changed since. For programs that edit a scenario. Reused parts are shared by `Arc`, so that renderers can
/// compare pointers.
///
/// # Errors
/// As [`load_sequence`].
pub fn reload_sequence(scenario: &Scenario, before: &Loaded) -> Result<Loaded, LoadError> {
    load_or_reuse(scenario, Some(before))
}

fn load_or_reuse(scenario: &Scenario, before: Option<&Loaded>) -> Result<Loaded, LoadError> {
    if scenario.camera.resized.is_some() {
        let camera = delivered(&scenario.camera).map_err(LoadError::Resized)?;
        return load_or_reuse(&Scenario { camera, ..scenario.clone() }, before);
    }
    let reusable = before.map(|before| (before, &before.sequence.scenario));
    let (log, trajectory, tracked) = match reusable.filter(|(_, old)| reads_same_flight(old, scenario)) {
        Some((before, _)) => {
            (before.log.clone(), before.sequence.path.trajectory.clone(), before.tracked.clone())
        }
        None => {
            let (log, tracked) = load_flight(scenario)?;
            (Arc::new(log), tracked.trajectory.clone(), Arc::new(tracked))
        }
    };
    let path = CameraPath::new(trajectory.clone(), &scenario.camera.mount)?;
    let sensors = load_sensors(scenario, &log, trajectory)?;
    let has_same_scene = |before: &Loaded, old: &Scenario| {
        old.scene == scenario.scene
            && old.log_datum() == scenario.log_datum()
            && before.log.frame == log.frame
            && (!has_pose_table(scenario)
                || (before.log.epoch_ns == log.epoch_ns && old.flight.speed == scenario.flight.speed))
    };
    let (scene, terrain, scene_notes) = match reusable.filter(|(before, old)| has_same_scene(before, old)) {
        Some((before, _)) => {
            (before.sequence.scene.clone(), before.terrain.clone(), before.scene_notes.clone())
        }
        None => {
            let (scene, terrain, notes) = load_scene(scenario, &log)?;
            (Arc::new(scene), terrain, notes)
        }
    };
    let numbers_objects =
        |channel: Channel| channel.kind() == PlaneKind::Index || channel == Channel::Coverage;
    if scene.objects.len() > MAX_OBJECTS && scenario.output.all_channels().any(numbers_objects) {
        return Err(LoadError::TooManyObjects(scene.objects.len()));
    }
    let vignette_error = |source| LoadError::Picture { key: "camera.photometric.vignette", source };
    let vignette = match reusable.filter(|(_, old)| has_same_vignette(&old.camera, &scenario.camera)) {
        Some((before, _)) => before.sequence.vignette.clone(),
        None => read_vignette(&scenario.camera).map_err(vignette_error)?.map(Arc::new),
    };
    let zoom_track = load_zoom_track(scenario, &log)?;
    let tracks = TrackInputs::load(scenario, &log)?;
    let (start_s, frames) = frames_of_window(scenario, &log)?;
    let platform_ns = scenario.output.stamp_epoch_ns(log.epoch_ns, start_s);
    let epoch_ns = platform_ns.saturating_add(scenario.camera.clock_offset_ns());
    let mut with_table = scenario.clone();
    load_lens_table(&mut with_table.camera)?;
    load_kernel(&mut with_table.camera)?;
    let sequence = Sequence {
        scenario: with_table,
        path: Arc::new(path),
        epoch_ns,
        start_s,
        frames,
        scene,
        vignette,
        zoom_track,
        exposures: None,
    };
    let (first_s, last_s) = sequence.path.span_s();
    if last_s > first_s && frames_outside(&sequence) as u64 == sequence.frames {
        let (frames, log_s) = (sequence.frames, last_s - first_s);
        return Err(LoadError::OutsideLog { frames, first_s: sequence.start_s, log_s });
    }
    let exposures = ExposureTrack::new(&sequence)?.map(|track| Arc::new(track) as _);
    let sequence = Sequence { exposures, ..sequence };
    let mut warnings = warnings(&sequence, &log, &tracked, terrain.as_ref());
    warnings.extend(sensor_warnings(scenario, &log, &sequence.path.trajectory));
    warnings.extend(scene_notes.iter().cloned());
    let output = &scenario.output;
    let has_numbers = output.channels.iter().any(|channel| channel.kind() == PlaneKind::Index);
    warnings.extend(
        (output.palette && !has_numbers).then(|| {
            "output.palette colours nothing: output.channels has neither object nor class".to_owned()
        }),
    );
    Ok(Loaded { sequence: Arc::new(sequence), log, tracked, terrain, tracks, sensors, warnings, scene_notes })
}

/// Whether two cameras have the same map of the same part of a picture.
fn has_same_vignette(a: &CameraSpec, b: &CameraSpec) -> bool {
    let is_of_same_part = a.files_of == b.files_of && (a.files_of.is_none() || a.size_px == b.size_px);
    a.photometric.vignette == b.photometric.vignette && is_of_same_part
}

/// Whether anything moves by a table of poses, whose times are on the log's clock.
fn has_pose_table(scenario: &Scenario) -> bool {
    let motions = scenario.scene.gltf.iter().filter_map(|model| model.motion.as_ref());
    motions.into_iter().any(|motion| motion.poses.is_some())
}

/// Whether two scenarios read and track the same log in the same way. The window may differ, as the whole log
/// is tracked.
fn reads_same_flight(a: &Scenario, b: &Scenario) -> bool {
    let without_window = |flight: &FlightSpec| FlightSpec { window_s: None, ..flight.clone() };
    without_window(&a.flight) == without_window(&b.flight)
        && a.effective_tracker() == b.effective_tracker()
        && raises_log(a) == raises_log(b)
        && (a.flight.height.datum().is_some() || a.scene.terrain == b.scene.terrain)
}

/// Reads and tracks the log alone, without the scene.
///
/// # Errors
/// As [`load_sequence`].
pub fn load_flight(scenario: &Scenario) -> Result<(FlightLog, TrackResult), LoadError> {
    let log = read_log(scenario)?;
    let tracked = track(&log.rows, &scenario.effective_tracker())?;
    Ok((log, tracked))
}

fn read_log(scenario: &Scenario) -> Result<FlightLog, LoadError> {
    let flight = &scenario.flight;
    let read = |height: HeightConversion<'_>| read_flight_log(&flight.log, flight, height);
    if flight.height.datum().is_some() {
        let height =
            if raises_log(scenario) { HeightConversion::MslToEllipsoid } else { HeightConversion::None };
        return Ok(read(height)?);
    }
    let ground = scenario.scene.terrain.as_ref().map(Ground::read).transpose()?;
    let ground_m = |at: Geodetic| ground.as_ref()?.height_m(at);
    let log = read(match flight.height {
        FlightHeight::Takeoff => HeightConversion::AboveTakeoff(&ground_m),
        _ => HeightConversion::AboveGround(&ground_m),
    })?;
    if log.frame.is_none() {
        return Err(LoadError::NoOrigin { log: flight.log.clone(), key: "scene.terrain" });
    }
    Ok(log)
}

/// Whether heights of the log above mean sea level become ellipsoidal, as those of the terrain are.
fn raises_log(scenario: &Scenario) -> bool {
    scenario.log_datum() == HeightReference::Msl && terrain_datum(scenario) == HeightReference::Ellipsoid
}

/// Whether heights of the terrain above mean sea level become ellipsoidal, as those of the log are.
fn raises_terrain(scenario: &Scenario) -> bool {
    scenario.log_datum() == HeightReference::Ellipsoid && terrain_datum(scenario) == HeightReference::Msl
}

/// The terrain's vertical datum; without a terrain, the log's.
fn terrain_datum(scenario: &Scenario) -> HeightReference {
    scenario.scene.terrain.as_ref().map_or_else(|| scenario.log_datum(), |terrain| terrain.height)
}

/// Start (path time, seconds) and number of frames: those whose stamps are inside the window.
fn frames_of_window(scenario: &Scenario, log: &FlightLog) -> Result<(f64, u64), LoadError> {
    let speed = scenario.flight.speed;
    let last_s = log.rows.last().map_or(0.0, |row| row.t_s);
    let [start_s, end_s] = scenario.flight.window_s.map_or([0.0, last_s], |window| window.map(|t| t / speed));
    let camera = &scenario.camera;
    // Without a window the last instant of the log is included, so that a log of one row gives one frame. An
    // explicit window is half-open, so that [0, 20] at 30 frames per second holds 600 frames.
    let periods = (end_s - start_s) * camera.fps - camera.phase;
    let count = if scenario.flight.window_s.is_none() {
        (periods + 1e-9).floor() + 1.0
    } else {
        (periods - 1e-9).ceil()
    };
    if count < 1.0 {
        return Err(LoadError::NoFrame(start_s * speed, end_s * speed, camera.fps));
    }
    if count > MAX_FRAMES {
        return Err(LoadError::TooManyFrames(count, camera.fps));
    }
    Ok((start_s, count as u64))
}

/// Number of frames whose image centre is exposed outside of the log, `(i + phase)/fps - delay` after
/// `start_s`.
fn frames_outside(sequence: &Sequence) -> usize {
    let (first_s, last_s) = sequence.path.span_s();
    let camera = &sequence.scenario.camera;
    let centre_s =
        |i: u64| sequence.start_s + (i as f64 + camera.phase) / camera.fps - camera.shutter.delay_ms * 1e-3;
    // The tolerance is a nanosecond, the resolution of a stamp.
    (0..sequence.frames).filter(|&i| centre_s(i) < first_s - 1e-9 || centre_s(i) > last_s + 1e-9).count()
}

/// Warnings of log and tracker: limits that the tracker reached, repairs of the log.
#[must_use]
pub fn flight_warnings(scenario: &Scenario, log: &FlightLog, tracked: &TrackResult) -> Vec<String> {
    let mut warnings = tracked.warnings();
    warnings
        .extend(tracked.distance_warning(&log.rows).filter(|_| scenario.tracker.kind != TrackerKind::Hold));
    if log.rows.len() == 1 {
        warnings
            .push(format!("{}: one usable row, so the platform stands still", scenario.flight.log.display()));
    }
    let log_warnings = log.notes.iter().filter(|note| note.is_warning);
    warnings.extend(log_warnings.map(|note| format!("{}: {}", scenario.flight.log.display(), note.text)));
    if !log.report.is_clean() {
        warnings.push(format!("{}: {}", scenario.flight.log.display(), log.report));
    }
    warnings
}

/// Distance of the flight from the origin above which a wrong origin is likely.
const FAR_FROM_ORIGIN_M: f64 = 500e3;

/// Warns of shutter times that no sensor has at this frame rate. They are rendered as they are.
fn shutter_warnings(camera: &CameraSpec) -> Vec<String> {
    let period_ms = 1e3 / camera.fps;
    let shutter = &camera.shutter;
    let interlace_ms = match shutter.interlace_ms {
        FieldOr::Ms(ms) => ms,
        FieldOr::Field => 0.0,
    };
    let auto_ms = camera.auto_exposure.as_ref().map_or(0.0, |auto| auto.exposure_ms[1]);
    let longer = [
        ("camera.shutter.exposure_ms", shutter.exposure_ms, "a row would be exposed for two frames at once"),
        ("camera.auto_exposure.exposure_ms", auto_ms, "a row could be exposed for two frames at once"),
        (
            "camera.shutter.interlace_ms",
            interlace_ms,
            "one field would belong to the frame before; \"field\" is half a period",
        ),
    ];
    let message = |(key, ms, reason): &(&str, f64, &str)| {
        format!(
            "{key} = {ms} is longer than a frame's period of {period_ms:.3} ms (camera.fps = \
                {}): {reason}",
            camera.fps
        )
    };
    // The tolerance allows rounded values, such as 33.3334 at 30 frames per second.
    longer.iter().filter(|(_, ms, _)| *ms > 1.0001 * period_ms).map(message).collect()
}

/// All warnings but those of the scene.
fn warnings(
    sequence: &Sequence,
    log: &FlightLog,
    tracked: &TrackResult,
    terrain: Option<&TerrainSummary>,
) -> Vec<String> {
    let mut warnings = flight_warnings(&sequence.scenario, log, tracked);
    warnings.extend(unlikely_values(&sequence.scenario.camera));
    warnings.extend(optics_warnings(sequence));
    let far_m = sequence.path.pose(sequence.start_s).position_ned_m.length();
    if far_m > FAR_FROM_ORIGIN_M {
        warnings.push(format!(
            "the flight starts {:.0} km from the origin of the local frame: check flight.origin and the \
                log's positions",
            far_m / 1e3
        ));
    }
    if sequence.scenario.quality.ideal_samples == Auto::Value(SAMPLES)
        && !sequence.scene.has_triangle_borders_only()
    {
        warnings.push(format!(
            "quality.ideal_samples = {SAMPLES} is not followed: surfaces of the scene have holes by their \
                pictures, or are mixed with what is behind them, and samples do not show such borders"
        ));
    }
    warnings.extend(shutter_warnings(&sequence.scenario.camera));
    let outside = frames_outside(sequence);
    if outside > 0 {
        warnings.push(format!(
            "{outside} of {} frames lie outside of the log and fly on at constant velocity: check \
                flight.window_s and camera.shutter.delay_ms",
            sequence.frames
        ));
    }
    warnings.extend(terrain.and_then(|summary| coverage::ortho_warning(sequence, summary)));
    warnings.extend(terrain.and_then(|summary| flight_over_terrain_warning(sequence, summary)));
    warnings.extend(coverage::sky_warning(sequence));
    warnings
}

/// Number of instants at which the position of the camera over the terrain is checked.
const TERRAIN_SAMPLES: u64 = 200;

/// Warns if the flight is never over the terrain, or partly below the ground.
fn flight_over_terrain_warning(sequence: &Sequence, summary: &TerrainSummary) -> Option<String> {
    let terrain = sequence.scene.terrain.as_ref()?;
    let fps = sequence.scenario.camera.fps;
    let step = (sequence.frames / TERRAIN_SAMPLES).max(1);
    let positions_ned_m = (0..sequence.frames)
        .step_by(step as usize)
        .map(|i| sequence.path.pose(sequence.start_s + i as f64 / fps).position_ned_m);
    let (mut over, mut outside, mut below, mut all) = (0, 0, 0, 0);
    for position in positions_ned_m {
        all += 1;
        if let Some(ground_down_m) = terrain.down_at(position.x, position.y) {
            over += 1;
            below += u32::from(position.z > ground_down_m);
        } else if !(terrain.bounds.min.x..=terrain.bounds.max.x).contains(&position.x)
            || !(terrain.bounds.min.y..=terrain.bounds.max.y).contains(&position.y)
        {
            outside += 1;
        }
    }
    if over == 0 && outside < all {
        Some(format!(
            "the flight is never over ground: {} of {all} positions looked at lie over parts of the terrain \
             without heights (missing, masked or not plausible)",
            all - outside
        ))
    } else if over == 0 {
        let [lat, lon] = summary.centre_rad.map(f64::to_degrees);
        Some(format!(
            "the flight is never over the terrain, whose middle is at latitude {lat:.5}, longitude {lon:.5} \
                deg"
        ))
    } else if below > 0 {
        Some(format!(
            "the camera is below the ground in {below} of {all} positions looked at: check flight.height, \
             scene.terrain.height and scene.terrain.height_unit"
        ))
    } else {
        None
    }
}
