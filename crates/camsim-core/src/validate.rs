//! Range checks: values that no run can use, each with its key and a remedy.

use crate::scenario::{
    Auto, Axis, CameraSpec, IDEAL_SAMPLES, LensModel, Origin, Preset, Problem, QualitySpec, Scenario,
    Silhouettes, Solver, Stamps,
    keys::{Table, join, violations},
};

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

/// All values of `scenario` that are out of range, in the order of the file; empty if the scenario can be
/// run.
pub fn validate(scenario: &Scenario) -> Vec<Problem> {
    let mut check = Check::of_intervals(scenario, "");
    check_flight(&mut check, scenario);
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
    let mut check = Check::of_intervals(camera, "camera");
    check_camera(&mut check, camera);
    check.problems
}

#[derive(Default)]
struct Check {
    problems: Vec<Problem>,
    /// How many of the problems are numbers outside of their intervals: they come first.
    intervals: usize,
}

impl Check {
    /// The numbers of a table that are outside of their legal intervals.
    fn of_intervals(table: &dyn Table, prefix: &str) -> Self {
        let problem = |(key, message): (String, String)| Problem { key: join(prefix, &key), message };
        let problems: Vec<Problem> = violations(table).into_iter().map(problem).collect();
        Self { intervals: problems.len(), problems }
    }

    /// Adds a problem of a key; a number outside of its interval is told once.
    fn fail(&mut self, key: impl Into<String>, message: impl Into<String>) {
        let key = key.into();
        if self.problems[..self.intervals].iter().all(|problem| problem.key != key) {
            self.problems.push(Problem { key, message: message.into() });
        }
    }

    fn require(&mut self, ok: bool, key: impl Into<String>, message: impl FnOnce() -> String) {
        if !ok {
            self.fail(key, message());
        }
    }
}

fn check_flight(check: &mut Check, scenario: &Scenario) {
    let flight = &scenario.flight;
    check.require(!flight.log.as_os_str().is_empty(), "flight.log", || {
        "is empty; give the path of the flight log".into()
    });
    check.require(flight.height.datum().is_some() || scenario.scene.terrain.is_some(), "flight.height", || {
        format!(
            "is \"{}\", above the ground of scene.terrain: add [scene.terrain], or write \"msl\" or \"ellipsoid\"",
            flight.height.name()
        )
    });
    if let Some([from, to]) = flight.window_s {
        check.require(from.is_finite() && to.is_finite() && from < to, "flight.window_s", || {
            format!(
                "must be [begin, end] with begin < end, in seconds from the first row, not [{from}, {to}]"
            )
        });
    }
    if let Origin::Geodetic([lat_deg, lon_deg, height_m]) = flight.origin {
        let ok = lat_deg.abs() <= 90.0 && lon_deg.abs() <= 360.0 && height_m.is_finite();
        check.require(ok, "flight.origin", || {
            format!("must be [latitude_deg -90..90, longitude_deg, height_m], not [{lat_deg}, {lon_deg}, {height_m}]")
        });
    }
}

fn check_camera(check: &mut Check, camera: &CameraSpec) {
    for (i, vibration) in camera.mount.vibration.iter().enumerate() {
        let key = |name: &str| format!("camera.mount.vibration.{i}.{name}");
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

    let [_, t2] = camera.photometric.vignette_thresholds;
    check.require(t2 != 0.0, "camera.photometric.vignette_thresholds", || {
        "must have a second number above 0, which the map is divided by; [0.05, 0.5] is the default".into()
    });
    image_sensor::check_image_sensor(check, camera);
    auto_exposure::check_auto_exposure(check, camera);
    point_spread::check_point_spread(check, camera);
    optics::check_optics(check, camera);
    resized::check_resized(check, camera);
}

fn check_quality_and_output(check: &mut Check, scenario: &Scenario) {
    let quality = &scenario.quality;
    if quality.preset == Preset::Paper {
        check_paper(check, scenario);
    }
    check.require(
        quality.iterations == Auto::Auto
            || !matches!(quality.solver, Auto::Value(Solver::Linear | Solver::Rk2 | Solver::Reference)),
        "quality.iterations",
        || "counts the depth look-ups of \"reproject\"; leave it out with any other quality.solver".into(),
    );
    check.require(
        quality.silhouettes != Silhouettes::Rays || quality.ideal_samples != Auto::Value(IDEAL_SAMPLES),
        "quality.ideal_samples",
        || "excludes silhouette rays (quality.silhouettes = \"rays\"); leave one of them out".into(),
    );
    check.require(!scenario.output.channels.is_empty(), "output.channels", || {
        "is empty; name what to write, for example [\"color\"] (to encode nothing, write format = [])".into()
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
    check.require(matches!(quality.key_frames, Auto::Auto | Auto::Value(1)), "quality.key_frames", || {
        "is 1 with quality.preset = \"paper\"; leave it out, or write preset = \"default\"".into()
    });
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
