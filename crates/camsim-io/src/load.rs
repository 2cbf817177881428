//! A scenario's files, read, checked against each other, and brought to one local frame: what rendering
//! starts from.

use std::{path::PathBuf, sync::Arc};

use camsim_core::{
    camera::CameraModel,
    flight_log::{FlightLog, HeightConversion},
    mount::{CameraPath, MountError},
    scenario::{Auto, CameraSpec, FieldOr, FlightSpec, HeightReference, Scenario, TrackerKind},
    sequence::Sequence,
    temporal::SAMPLES,
    tracker::{TrackResult, TrackerError, track},
};
use glam::DVec2;

use crate::{
    board_file::BoardFileError,
    flight_log::{FlightLogError, read_flight_log},
    gltf_file::{GltfError, MAX_RADIUS_M},
    pictures::{PictureError, read_gray_image},
    terrain::{TerrainFileError, TerrainSummary},
};

mod beyond;
mod optics;
mod placements;
mod scene;

pub use optics::vignette_warnings;
use optics::{load_zoom_track, optics_warnings};
pub use scene::board_place;
use scene::load_scene;

/// Frames that a sequence may have: four days at 30 a second. More is a slip in `camera.fps`, and tables of
/// it would not end.
const MOST_FRAMES: f64 = 10e6;

/// Why a scenario cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    /// The flight log.
    #[error(transparent)]
    Log(#[from] FlightLogError),
    /// The tracker.
    #[error(transparent)]
    Tracker(#[from] TrackerError),
    /// The mount.
    #[error(transparent)]
    Mount(#[from] MountError),
    /// The terrain.
    #[error(transparent)]
    Terrain(#[from] TerrainFileError),
    /// A picture.
    #[error("{source}; check {key}")]
    Picture {
        /// Which one it is.
        key: &'static str,
        /// What is wrong.
        source: PictureError,
    },
    /// A local log over a georeferenced scene.
    #[error(
        "{log} has local coordinates, but {key} is georeferenced: set flight.origin = [lat_deg, lon_deg, height_m], the place on Earth of the log's (0, 0, 0)"
    )]
    NoOrigin {
        /// The log.
        log: PathBuf,
        /// What has a place on Earth.
        key: &'static str,
    },
    /// A model.
    #[error("scene.gltf: {0}")]
    Gltf(#[from] GltfError),
    /// A table of places.
    #[error("{path}: {problem}")]
    Placements {
        /// The file.
        path: PathBuf,
        /// What is wrong, where, and what to do.
        problem: String,
    },
    /// A place without ground.
    #[error(
        "scene.gltf: {file} is to stand on the ground, but there is none at north {north_m:.1} m, east {east_m:.1} m: move it onto the terrain, or leave on_ground out"
    )]
    NoGround {
        /// The model.
        file: PathBuf,
        /// The place.
        north_m: f64,
        /// The place.
        east_m: f64,
    },
    /// A model farther away than anything can be.
    #[error(
        "scene.gltf: {file} reaches {reach_m:.1e} m from the local frame's origin, more than {MAX_RADIUS_M:.0e}: check its place and scale"
    )]
    TooFar {
        /// The model.
        file: PathBuf,
        /// How far.
        reach_m: f64,
    },
    /// A calibration board.
    #[error("scene.board: {0}")]
    Board(#[from] BoardFileError),
    /// No frame falls into the window.
    #[error(
        "flight.window_s = [{0}, {1}] holds no frame at {2} frames a second: make the window longer or camera.fps higher"
    )]
    NoFrame(f64, f64, f64),
    /// More frames than a sequence may have.
    #[error(
        "the window holds {0:.0} frames at {1} frames a second, more than {MOST_FRAMES:.0}: make flight.window_s shorter or camera.fps lower"
    )]
    TooManyFrames(f64, f64),
    /// The zoom track.
    #[error(
        "{path}{line}: {problem}; camera.zoom_track needs a header `t_s,zoom` (or t_ms, t_us, t_ns) and rows of finite numbers by ascending time"
    )]
    ZoomTrack {
        /// The file.
        path: PathBuf,
        /// `, line N`, or nothing.
        line: String,
        /// What is wrong.
        problem: String,
    },
    /// A zoom lens without a track or the other way round.
    #[error("camera.zoom and camera.zoom_track belong together: give both, or neither for a fixed lens")]
    ZoomPair,
}

/// A loaded scenario and what there is to say about it.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// What rendering needs.
    pub sequence: Arc<Sequence>,
    /// The cleaned log; its report counts every repair.
    pub log: Arc<FlightLog>,
    /// The tracked trajectory with its limits.
    pub tracked: Arc<TrackResult>,
    /// Where the terrain lies.
    pub terrain: Option<TerrainSummary>,
    /// What a user should know but need not stop for.
    pub warnings: Vec<String>,
    /// Those of them that came with the scene.
    scene_notes: Vec<String>,
}

/// Reads everything that a scenario names (paths as they stand).
///
/// # Errors
/// [`LoadError`] names the file or key and what to do.
pub fn load_sequence(scenario: &Scenario) -> Result<Loaded, LoadError> {
    load_beside(scenario, None)
}

/// As [`load_sequence`], but what `before` has read for the same keys is not read again, even if files have
/// changed since: for programs that change a scenario value by value. What is taken over is shared, so that
/// renderers can see that it is the same.
///
/// # Errors
/// As [`load_sequence`].
pub fn reload_sequence(scenario: &Scenario, before: &Loaded) -> Result<Loaded, LoadError> {
    load_beside(scenario, Some(before))
}

fn load_beside(scenario: &Scenario, before: Option<&Loaded>) -> Result<Loaded, LoadError> {
    let known = before.map(|before| (before, &before.sequence.scenario));
    let (log, trajectory, tracked) = match known.filter(|(_, of)| reads_same_flight(of, scenario)) {
        Some((before, _)) => {
            (before.log.clone(), before.sequence.path.trajectory.clone(), before.tracked.clone())
        }
        None => {
            let (log, tracked) = load_flight(scenario)?;
            (Arc::new(log), tracked.trajectory.clone(), Arc::new(tracked))
        }
    };
    let path = CameraPath::new(trajectory, &scenario.camera.mount)?;
    let same_scene = |before: &Loaded, of: &Scenario| {
        of.scene == scenario.scene
            && of.flight.height == scenario.flight.height
            && before.log.frame == log.frame
    };
    let (scene, terrain, scene_notes) = match known.filter(|(before, of)| same_scene(before, of)) {
        Some((before, _)) => {
            (before.sequence.scene.clone(), before.terrain.clone(), before.scene_notes.clone())
        }
        None => {
            let (scene, terrain, notes) = load_scene(scenario, &log)?;
            (Arc::new(scene), terrain, notes)
        }
    };
    let picture = &scenario.camera.photometric.vignette;
    let of_vignette = |source| LoadError::Picture { key: "camera.photometric.vignette", source };
    let vignette = match known.filter(|(_, of)| of.camera.photometric.vignette == *picture) {
        Some((before, _)) => before.sequence.vignette.clone(),
        None => picture.as_deref().map(read_gray_image).transpose().map_err(of_vignette)?.map(Arc::new),
    };
    let zoom_track = load_zoom_track(scenario, &log)?;
    let (start_s, frames) = frames_of_window(scenario, &log)?;
    let epoch_ns = scenario.output.stamp_epoch_ns(log.epoch_ns, start_s);
    let sequence = Sequence {
        scenario: scenario.clone(),
        path: Arc::new(path),
        epoch_ns,
        start_s,
        frames,
        scene,
        vignette,
        zoom_track,
    };
    let mut warnings = warnings(&sequence, &log, &tracked, terrain.as_ref());
    warnings.extend(scene_notes.iter().cloned());
    Ok(Loaded { sequence: Arc::new(sequence), log, tracked, terrain, warnings, scene_notes })
}

/// Whether two scenarios have the same log, read and tracked in the same way. The window does not matter: all
/// of the log is tracked.
fn reads_same_flight(a: &Scenario, b: &Scenario) -> bool {
    let whole = |flight: &FlightSpec| FlightSpec { window_s: None, ..flight.clone() };
    whole(&a.flight) == whole(&b.flight)
        && a.effective_tracker() == b.effective_tracker()
        && height_plan(a).0 == height_plan(b).0
}

/// The log and its trajectory alone: no scene is read.
///
/// # Errors
/// As [`load_sequence`].
pub fn load_flight(scenario: &Scenario) -> Result<(FlightLog, TrackResult), LoadError> {
    let (log_height, _) = height_plan(scenario);
    let log = read_flight_log(&scenario.flight.log, &scenario.flight, log_height)?;
    let tracked = track(&log.rows, &scenario.effective_tracker())?;
    Ok((log, tracked))
}

/// Equal vertical datums need no conversion; else whichever is above mean sea level goes through the geoid.
fn height_plan(scenario: &Scenario) -> (HeightConversion, bool) {
    let log = scenario.flight.height;
    let terrain = scenario.scene.terrain.as_ref().map_or(log, |terrain| terrain.height);
    match (log, terrain) {
        (HeightReference::Msl, HeightReference::Ellipsoid) => (HeightConversion::MslToEllipsoid, false),
        (HeightReference::Ellipsoid, HeightReference::Msl) => (HeightConversion::None, true),
        _ => (HeightConversion::None, false),
    }
}

/// Start (path time) and number of frames: frame i counts while its stamp is inside the window.
fn frames_of_window(scenario: &Scenario, log: &FlightLog) -> Result<(f64, u64), LoadError> {
    let speed = scenario.flight.speed;
    let last_s = log.rows.last().map_or(0.0, |row| row.t_s);
    let [start_s, end_s] = scenario.flight.window_s.map_or([0.0, last_s], |window| window.map(|t| t / speed));
    let camera = &scenario.camera;
    // Without a window the whole log is flown, its last instant included (a log of one row is a still camera:
    // one frame); an explicit window is half-open, so that [0, 20] at 30 frames a second holds 600 frames.
    let periods = (end_s - start_s) * camera.fps - camera.phase;
    let count = if scenario.flight.window_s.is_none() {
        (periods + 1e-9).floor() + 1.0
    } else {
        (periods - 1e-9).ceil()
    };
    if count < 1.0 {
        return Err(LoadError::NoFrame(start_s * speed, end_s * speed, camera.fps));
    }
    if count > MOST_FRAMES {
        return Err(LoadError::TooManyFrames(count, camera.fps));
    }
    Ok((start_s, count as u64))
}

/// How many frames have the instant of their image centre, `(i + phase)/fps - delay` after `start_s`, outside
/// of the log.
fn frames_outside(sequence: &Sequence) -> usize {
    let (first_s, last_s) = sequence.path.span_s();
    let camera = &sequence.scenario.camera;
    let centre_s =
        |i: u64| sequence.start_s + (i as f64 + camera.phase) / camera.fps - camera.shutter.delay_ms * 1e-3;
    // A nanosecond, the resolution of a stamp, is no excursion.
    (0..sequence.frames).filter(|&i| centre_s(i) < first_s - 1e-9 || centre_s(i) > last_s + 1e-9).count()
}

/// What log and tracker have to say: limits that held the platform back, repairs.
#[must_use]
pub fn flight_warnings(scenario: &Scenario, log: &FlightLog, tracked: &TrackResult) -> Vec<String> {
    let mut warnings = tracked.warnings();
    warnings
        .extend(tracked.distance_warning(&log.rows).filter(|_| scenario.tracker.kind != TrackerKind::Hold));
    if log.rows.len() == 1 {
        warnings
            .push(format!("{}: one usable row, so the platform stands still", scenario.flight.log.display()));
    }
    let of_file = log.notes.iter().filter(|note| note.is_warning);
    warnings.extend(of_file.map(|note| format!("{}: {}", scenario.flight.log.display(), note.text)));
    if !log.report.is_clean() {
        warnings.push(format!("{}: {}", scenario.flight.log.display(), log.report));
    }
    warnings
}

/// A flight this far from its origin is likelier a slip than a flight.
const FAR_FROM_ORIGIN_M: f64 = 500e3;

/// Says how much of the picture no ray reaches, by every 16th pixel of a fixed lens.
fn blind_share_warning(sequence: &Sequence) -> Option<String> {
    let camera = CameraModel::from_spec(&sequence.scenario.camera).ok()?;
    let [width, height] = camera.size_px;
    let (mut all, mut blind) = (0_u32, 0_u32);
    for y in (8..height).step_by(16) {
        for x in (8..width).step_by(16) {
            all += 1;
            blind += u32::from(camera.unproject(DVec2::new(f64::from(x), f64::from(y))).is_none());
        }
    }
    let share = 100.0 * f64::from(blind) / f64::from(all.max(1));
    (share >= 0.5).then(|| {
        format!(
            "about {share:.0} % of the picture has no ray through the lens and stays empty (alpha 0): see `camsim lens SCENARIO.toml check`"
        )
    })
}

/// Times of the shutter that no sensor keeps at this frame rate. They are rendered as they stand.
fn shutter_warnings(camera: &CameraSpec) -> Vec<String> {
    let period_ms = 1e3 / camera.fps;
    let shutter = &camera.shutter;
    let interlace_ms = match shutter.interlace_ms {
        FieldOr::Ms(ms) => ms,
        FieldOr::Field => 0.0,
    };
    let longer = [
        ("readout_ms", shutter.readout_ms, "the next frame would begin before this one is read"),
        ("exposure_ms", shutter.exposure_ms, "a row would be exposed for two frames at once"),
        (
            "interlace_ms",
            interlace_ms,
            "one field would belong to the frame before; \"field\" is half a period",
        ),
    ];
    let told = |(key, ms, why): &(&str, f64, &str)| {
        format!(
            "camera.shutter.{key} = {ms} is longer than a frame's period of {period_ms:.3} ms (camera.fps = {}): {why}",
            camera.fps
        )
    };
    // To the hair, so that 33.3334 at 30 frames a second passes.
    longer.iter().filter(|(_, ms, _)| *ms > 1.0001 * period_ms).map(told).collect()
}

fn warnings(
    sequence: &Sequence,
    log: &FlightLog,
    tracked: &TrackResult,
    terrain: Option<&TerrainSummary>,
) -> Vec<String> {
    let mut warnings = flight_warnings(&sequence.scenario, log, tracked);
    warnings.extend(blind_share_warning(sequence));
    warnings.extend(optics_warnings(sequence));
    let far_m = sequence.path.pose(sequence.start_s).position_ned_m.length();
    if far_m > FAR_FROM_ORIGIN_M {
        warnings.push(format!(
            "the flight starts {:.0} km from the origin of the local frame: check flight.origin and the log's positions",
            far_m / 1e3
        ));
    }
    if sequence.scenario.quality.ideal_samples == Auto::Value(SAMPLES)
        && !sequence.scene.has_triangle_borders_only()
    {
        warnings.push(format!(
            "quality.ideal_samples = {SAMPLES} is not followed: surfaces of the scene have holes by their pictures, or are mixed with what is behind them, and samples do not show such borders"
        ));
    }
    warnings.extend(shutter_warnings(&sequence.scenario.camera));
    let fps = sequence.scenario.camera.fps;
    let outside = frames_outside(sequence);
    if outside > 0 {
        warnings.push(format!(
            "{outside} of {} frames lie outside of the log and fly on at constant velocity: check flight.window_s and camera.shutter.delay_ms",
            sequence.frames
        ));
    }
    warnings.extend(terrain.and_then(|summary| beyond::beyond_picture_warning(sequence, summary)));
    if let (Some(terrain), Some(summary)) = (&sequence.scene.terrain, terrain) {
        let step = (sequence.frames / 200).max(1);
        let places = (0..sequence.frames)
            .step_by(step as usize)
            .map(|i| sequence.path.pose(sequence.start_s + i as f64 / fps).position_ned_m);
        let (mut over, mut beside, mut below, mut all) = (0, 0, 0, 0);
        for place in places {
            all += 1;
            if let Some(ground_down_m) = terrain.down_at(place.x, place.y) {
                over += 1;
                below += u32::from(place.z > ground_down_m);
            } else if !(terrain.bounds.min.x..=terrain.bounds.max.x).contains(&place.x)
                || !(terrain.bounds.min.y..=terrain.bounds.max.y).contains(&place.y)
            {
                beside += 1;
            }
        }
        let [lat, lon] = summary.centre_rad.map(f64::to_degrees);
        if over == 0 && beside < all {
            warnings.push(format!(
                "the flight is never over ground: {} of {all} places looked at lie over parts of the terrain without heights (missing, masked or not plausible)",
                all - beside
            ));
        } else if over == 0 {
            warnings.push(format!("the flight is never over the terrain, whose middle is at latitude {lat:.5}, longitude {lon:.5} deg"));
        } else if below > 0 {
            warnings.push(format!(
                "the camera is below the ground in {below} of {all} places looked at: check flight.height, scene.terrain.height and scene.terrain.height_unit"
            ));
        }
    }
    warnings
}
