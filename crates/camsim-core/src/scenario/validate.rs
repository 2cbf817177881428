//! Range checks: values that no run can use, each with its key and a remedy.

use std::fmt;

use super::{
    Auto, Axis, CameraSpec, LensModel, Origin, Preset, QualitySpec, Scenario, Silhouettes, Solver, Stamps,
    TrackerSpec,
};
use crate::temporal::{MAX_KEYS, SAMPLES};

mod auto_exposure;
mod image_sensor;
mod lens;
mod motion;
mod names;
mod optics;
mod point_spread;
mod resized;
mod rig;
mod scene;
mod sensors;
mod timing;
mod tracks;
mod twins;
mod video;

use lens::check_coefficients;

pub use resized::{checked_camera, checked_cameras, checked_rig};
pub use rig::{validate_cameras, validate_rig};

/// Largest number of depth look-ups of `reproject`. The planner uses at most 8; a pixel that has not
/// converged after this many never does.
pub const MAX_ITERATIONS: u32 = 64;
/// Largest number of samples per pixel of path, or per exposure in the paper's preset. Two per pixel keep the
/// error below 1/255 on white texture (docs/accuracy/stress.md).
pub const MAX_BLUR_SAMPLES: u32 = 4096;
/// Largest number of footprint taps per side of a pixel; the planner uses at most 4.
pub const MAX_FOOTPRINT_TAPS: u32 = 64;
/// Largest number of output frames per ideal frame.
pub const MAX_FRAMES_PER_IDEAL: u32 = 64;

/// Largest offset of a camera's clock, 127 years: stamps of this century stay within 64 bits.
const MAX_CLOCK_OFFSET_MS: f64 = 4e12;

/// An invalid value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// Dotted key, array elements by index (`camera.zoom.1.at`).
    pub key: String,
    /// What is wrong, and what to write instead.
    pub message: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.key, self.message)
    }
}

/// All values of `scenario` that are out of range, in the order of the file; empty if the scenario can be
/// run.
pub fn validate(scenario: &Scenario) -> Vec<Problem> {
    let mut check = Check::default();
    check_flight(&mut check, scenario);
    check_tracker(&mut check, &scenario.tracker);
    check_camera(&mut check, &scenario.camera);
    scene::check_scene(&mut check, &scenario.scene);
    check_quality_and_output(&mut check, scenario);
    tracks::check_tracks(&mut check, scenario);
    video::check_video(&mut check, scenario);
    sensors::check_sensors(&mut check, scenario);
    image_sensor::check_with_output(&mut check, scenario);
    auto_exposure::check_with_scenario(&mut check, scenario);
    timing::check_with_quality(&mut check, scenario);
    point_spread::check_with_preset(&mut check, scenario);
    twins::check_twins(&mut check, scenario);
    check.problems
}

/// As [`validate`], for a camera alone; keys begin with `camera.`.
pub fn validate_camera(camera: &CameraSpec) -> Vec<Problem> {
    let mut check = Check::default();
    check_camera(&mut check, camera);
    check.problems
}

#[derive(Default)]
struct Check {
    problems: Vec<Problem>,
}

impl Check {
    fn fail(&mut self, key: impl Into<String>, message: impl Into<String>) {
        self.problems.push(Problem { key: key.into(), message: message.into() });
    }

    fn require(&mut self, ok: bool, key: impl Into<String>, message: impl FnOnce() -> String) {
        if !ok {
            self.fail(key, message());
        }
    }

    fn positive(&mut self, key: impl Into<String>, value: f64, fix: &str) {
        self.require(value.is_finite() && value > 0.0, key, || {
            format!("must be a finite number above 0, not {value}; {fix}")
        });
    }

    fn not_negative(&mut self, key: impl Into<String>, value: f64, fix: &str) {
        self.require(value.is_finite() && value >= 0.0, key, || {
            format!("must be a finite number, 0 or more, not {value}; {fix}")
        });
    }

    fn finite(&mut self, key: impl Into<String>, values: &[f64]) {
        self.require(values.iter().all(|value| value.is_finite()), key, || {
            format!("must be finite, not {values:?}")
        });
    }

    fn count(&mut self, key: &str, value: Auto<u32>, most: u32) {
        self.require(value.value().is_none_or(|count| (1..=most).contains(&count)), key, || {
            format!("must be 1 to {most}; leave it out or write \"auto\" for the planner's choice")
        });
    }
}

fn check_flight(check: &mut Check, scenario: &Scenario) {
    let flight = &scenario.flight;
    check.require(!flight.log.as_os_str().is_empty(), "flight.log", || {
        "is empty; give the path of the flight log".into()
    });
    if let Some([from, to]) = flight.window_s {
        check.require(from.is_finite() && to.is_finite() && from < to, "flight.window_s", || {
            format!(
                "must be [begin, end] with begin < end, in seconds from the first row, not [{from}, {to}]"
            )
        });
    }
    check.positive("flight.speed", flight.speed, "1 flies the log in its own time, 2 twice as fast");
    if let Origin::Geodetic([lat_deg, lon_deg, height_m]) = flight.origin {
        let ok = lat_deg.abs() <= 90.0 && lon_deg.abs() <= 360.0 && height_m.is_finite();
        check.require(ok, "flight.origin", || {
            format!("must be [latitude_deg -90..90, longitude_deg, height_m], not [{lat_deg}, {lon_deg}, {height_m}]")
        });
    }
}

fn check_tracker(check: &mut Check, tracker: &TrackerSpec) {
    check.require(tracker.rate_hz >= 1.0 && tracker.rate_hz <= 100_000.0, "tracker.rate_hz", || {
        format!("must lie in 1..100000, not {}; 400 is the default", tracker.rate_hz)
    });
    for (key, limit) in [
        ("tracker.max_speed_m_s", tracker.max_speed_m_s),
        ("tracker.max_acceleration_m_s2", tracker.max_acceleration_m_s2),
        ("tracker.max_angular_rate_deg_s", tracker.max_angular_rate_deg_s),
        ("tracker.max_angular_acceleration_deg_s2", tracker.max_angular_acceleration_deg_s2),
    ] {
        if let Auto::Value(limit) = limit {
            check.positive(key, limit, "or write \"auto\"");
        }
    }
}

/// Largest side of an image; larger ones are typing errors on every adapter.
pub const MAX_SIDE_PX: u32 = crate::camera::MAX_SIZE_PX;

fn check_camera(check: &mut Check, camera: &CameraSpec) {
    check.require(
        camera.size_px.iter().all(|&side| (1..=MAX_SIDE_PX).contains(&side)),
        "camera.size_px",
        || format!("must be [width, height], each 1..{MAX_SIDE_PX}, not {:?}", camera.size_px),
    );
    check_focal(check, "camera.focal_px", camera.focal_px);
    check.finite("camera.principal_point_px", &camera.principal_point_px.unwrap_or_default());
    check.positive("camera.fps", camera.fps, "give frames per second, for example 30");
    check.finite("camera.phase", &[camera.phase]);
    check.require(camera.clock_offset_ms.abs() <= MAX_CLOCK_OFFSET_MS, "camera.clock_offset_ms", || {
        format!(
            "must lie within {MAX_CLOCK_OFFSET_MS:e} milliseconds of 0, not {}; it is how much the camera's clock \
             is ahead",
            camera.clock_offset_ms
        )
    });

    check.finite("camera.mount.angles_deg", &camera.mount.angles_deg);
    check.finite("camera.mount.offset_m", &camera.mount.offset_m);
    for (i, vibration) in camera.mount.vibration.iter().enumerate() {
        let key = |name: &str| format!("camera.mount.vibration.{i}.{name}");
        check.finite(key("amplitude_deg"), &[vibration.amplitude_deg]);
        check.finite(key("amplitude_m"), &[vibration.amplitude_m]);
        check.not_negative(key("hz"), vibration.hz, "give the frequency in hertz");
        check.finite(key("phase_deg"), &[vibration.phase_deg]);
        let rotation = matches!(vibration.axis, Axis::Roll | Axis::Pitch | Axis::Yaw);
        check.require(!rotation || vibration.amplitude_m.abs() == 0.0, key("amplitude_m"), || {
            "is for translation axes; use amplitude_deg".into()
        });
        check.require(rotation || vibration.amplitude_deg.abs() == 0.0, key("amplitude_deg"), || {
            "is for rotation axes; use amplitude_m".into()
        });
    }

    check_coefficients(
        check,
        "camera.lens.coefficients",
        camera.lens.model,
        camera.focal_px,
        &camera.lens.coefficients,
    );
    let is_table = camera.lens.model == LensModel::Table;
    check.require(is_table == camera.lens_table.is_some(), "camera.lens_table", || match is_table {
        true => "is missing: camera.lens.model is \"table\"; name the file of its points".into(),
        false => "goes with camera.lens.model = \"table\"; write that, or leave it out".into(),
    });
    check.require(!is_table || camera.zoom.is_empty(), "camera.zoom", || {
        "cannot be combined with camera.lens.model = \"table\", which holds for one focal length".into()
    });
    for (i, zoom) in camera.zoom.iter().enumerate() {
        check.finite(format!("camera.zoom.{i}.at"), &[zoom.at]);
        check_focal(check, &format!("camera.zoom.{i}.focal_px"), zoom.focal_px);
        check.finite(
            format!("camera.zoom.{i}.principal_point_px"),
            &zoom.principal_point_px.unwrap_or_default(),
        );
        check_coefficients(
            check,
            &format!("camera.zoom.{i}.coefficients"),
            camera.lens.model,
            zoom.focal_px,
            &zoom.coefficients,
        );
    }
    for (i, pair) in camera.zoom.windows(2).enumerate() {
        check.require(pair[0].at < pair[1].at, format!("camera.zoom.{}.at", i + 1), || {
            format!(
                "must be above the row before ({}), not {}; sort the table by `at`",
                pair[0].at, pair[1].at
            )
        });
    }
    check.require(camera.zoom_track.is_none() || !camera.zoom.is_empty(), "camera.zoom_track", || {
        "needs a table of calibrations; add [[camera.zoom]] entries".into()
    });

    timing::check_shutter(check, camera);
    timing::check_timing(check, camera);

    let photometric = &camera.photometric;
    let [t1, t2] = photometric.vignette_thresholds;
    check.require(
        t1.is_finite() && t2.is_finite() && t1 >= 0.0 && t2 > 0.0,
        "camera.photometric.vignette_thresholds",
        || format!("must be [t1 >= 0, t2 > 0], not [{t1}, {t2}]; [0.05, 0.5] is the default"),
    );
    check.not_negative("camera.photometric.light", photometric.light, "1 leaves the light as it is");
    check.not_negative("camera.photometric.noise_sigma", photometric.noise_sigma, "0 is no noise");
    image_sensor::check_image_sensor(check, camera);
    auto_exposure::check_auto_exposure(check, camera);
    point_spread::check_point_spread(check, camera);
    optics::check_optics(check, camera);
    resized::check_resized(check, camera);
}

fn check_focal(check: &mut Check, key: &str, focal_px: [f64; 2]) {
    check.require(focal_px.iter().all(|&f| f.is_finite() && f > 0.0), key, || {
        format!("must be [fx, fy], both finite and above 0, not {focal_px:?}; a 60 degree lens on 640 px has about 554")
    });
}

fn check_quality_and_output(check: &mut Check, scenario: &Scenario) {
    let quality = &scenario.quality;
    if quality.preset == Preset::Paper {
        check_paper(check, scenario);
    }
    check.positive("quality.max_error_px", quality.max_error_px, "0.05 is the default");
    check.positive("quality.max_error_dn", quality.max_error_dn, "1 is the default");
    check.positive("quality.max_terrain_error_px", quality.max_terrain_error_px, "0.25 is the default");
    check.count("quality.iterations", quality.iterations, MAX_ITERATIONS);
    check.require(
        quality.iterations == Auto::Auto
            || !matches!(quality.solver, Auto::Value(Solver::Linear | Solver::Rk2 | Solver::Oracle)),
        "quality.iterations",
        || "counts the depth look-ups of \"reproject\"; leave it out with any other quality.solver".into(),
    );
    check.count("quality.blur_samples", quality.blur_samples, MAX_BLUR_SAMPLES);
    check.count("quality.footprint_taps", quality.footprint_taps, MAX_FOOTPRINT_TAPS);
    check.require(
        quality.ideal_samples.value().is_none_or(|samples| [1, SAMPLES].contains(&samples)),
        "quality.ideal_samples",
        || format!("must be \"auto\", 1 or {SAMPLES} samples of each pixel of the ideal frame"),
    );
    check.require(
        quality.silhouettes != Silhouettes::Rays || quality.ideal_samples != Auto::Value(SAMPLES),
        "quality.ideal_samples",
        || "excludes silhouette rays (quality.silhouettes = \"rays\"); leave one of them out".into(),
    );
    check.require(
        quality.ideal_scale.value().is_none_or(|scale| (1.0..=5.0).contains(&scale)),
        "quality.ideal_scale",
        || "must be 1 to 5 ideal pixels per camera pixel, or \"auto\"".into(),
    );
    check.require(
        (1..=MAX_FRAMES_PER_IDEAL).contains(&quality.frames_per_ideal),
        "quality.frames_per_ideal",
        || {
            format!(
                "must be 1 (each frame its own) to {MAX_FRAMES_PER_IDEAL}, not {}; 8 is the default",
                quality.frames_per_ideal
            )
        },
    );
    check.require(
        quality.key_frames.value().is_none_or(|frames| (1..=MAX_KEYS).contains(&frames)),
        "quality.key_frames",
        || format!("must be 1 to {MAX_KEYS} ideal frames for each output frame, or \"auto\""),
    );
    check.require(!scenario.output.channels.is_empty(), "output.channels", || {
        "is empty; name what to write, for example [\"color\"] (to encode nothing, write format = [])".into()
    });
    check.require(scenario.output.flow_step >= 1, "output.flow_step", || {
        "must be at least 1: flow leads from frame i to frame i + flow_step".into()
    });
    check.require(scenario.output.epoch_ns == 0 || scenario.output.stamps == Stamps::Zero, "output.epoch_ns", || {
        "is what stamps begin with where they do not follow the log: write output.stamps = \"zero\" too, or leave it out".into()
    });
    check.require(i64::try_from(scenario.output.epoch_ns).is_ok(), "output.epoch_ns", || {
        format!("must be at most {} nanoseconds: stamps have 64 bits and a sign", i64::MAX)
    });
}

/// Combinations that the paper's methods do not support, and keys without an effect in that preset.
fn check_paper(check: &mut Check, scenario: &Scenario) {
    let (quality, camera) = (&scenario.quality, &scenario.camera);
    optics::check_paper(check, camera);
    let coefficients = camera.zoom.iter().map(|zoom| &zoom.coefficients).chain([&camera.lens.coefficients]);
    let rational = coefficients.flat_map(|k| k.iter().skip(5)).any(|&k| k != 0.0);
    let is_papers = matches!(camera.lens.model, LensModel::Pinhole | LensModel::BrownConrady);
    check.require(is_papers && !rational, "quality.preset", || {
        "\"paper\" supports only pinhole and brown-conrady lenses with k1 k2 p1 p2 k3; write \"default\""
            .into()
    });
    check.require(matches!(quality.solver, Auto::Auto | Auto::Value(Solver::Rk2)), "quality.solver", || {
        "is rk2 with quality.preset = \"paper\"; leave it out, or write preset = \"default\"".into()
    });
    check.require(quality.iterations == Auto::Auto, "quality.iterations", || {
        "cannot be combined with quality.preset = \"paper\", which looks the depth up once; leave it out"
            .into()
    });
    check.require(
        matches!(quality.key_frames, Auto::Auto | Auto::Value(0 | 1)),
        "quality.key_frames",
        || "is 1 with quality.preset = \"paper\"; leave it out, or write preset = \"default\"".into(),
    );
    check.require(
        [1, QualitySpec::default().frames_per_ideal].contains(&quality.frames_per_ideal),
        "quality.frames_per_ideal",
        || "is 1 with quality.preset = \"paper\"; leave it out, or write preset = \"default\"".into(),
    );
    check.require(quality.ideal_scale == Auto::Auto, "quality.ideal_scale", || {
        "is 1 with quality.preset = \"paper\"; leave it out, or write preset = \"default\"".into()
    });
    check.require(
        matches!(quality.ideal_samples, Auto::Auto | Auto::Value(1)),
        "quality.ideal_samples",
        || "is 1 with quality.preset = \"paper\"; leave it out, or write preset = \"default\"".into(),
    );
    check.require(quality.silhouettes != Silhouettes::Rays, "quality.silhouettes", || {
        "are plain with quality.preset = \"paper\"; leave it out, or write preset = \"default\"".into()
    });
    check.require(
        matches!(quality.footprint_taps, Auto::Auto | Auto::Value(1)),
        "quality.footprint_taps",
        || "is 1 with quality.preset = \"paper\"; leave it out, or write preset = \"default\"".into(),
    );
}

#[cfg(test)]
pub(crate) mod tests;
