//! Checks of `[camera.shutter]` and `[camera.timing]`.

use super::Check;
use crate::scenario::{CameraSpec, FieldOr, LateStamp, Preset, Readout, Reset, Scenario, TimingSpec};

/// Fastest and slowest clock, millionths off.
const MOST_DRIFT_PPM: f64 = 1e5;
/// Rounded values, such as 33.3334 ms at 30 frames per second, are no longer than a period.
const ROUNDING: f64 = 1.0001;

/// Checks the times of the rows.
pub(super) fn check_shutter(check: &mut Check, camera: &CameraSpec) {
    let shutter = &camera.shutter;
    check.not_negative(
        "camera.shutter.delay_ms",
        shutter.delay_ms,
        "it is the age of the image centre at its stamp",
    );
    check.not_negative(
        "camera.shutter.readout_ms",
        shutter.readout_ms,
        "reverse the direction with camera.shutter.readout",
    );
    check.not_negative("camera.shutter.exposure_ms", shutter.exposure_ms, "0 is an instant");
    if let FieldOr::Ms(ms) = shutter.interlace_ms {
        check.not_negative(
            "camera.shutter.interlace_ms",
            ms,
            "choose the earlier rows with camera.shutter.first_field",
        );
    }
    if let Some(us) = shutter.line_time_us {
        check.not_negative(
            "camera.shutter.line_time_us",
            us,
            "reverse the direction with camera.shutter.readout",
        );
        check.require(shutter.readout_ms == 0.0, "camera.shutter.line_time_us", || {
            "states the readout a second time; leave it out, or camera.shutter.readout_ms".into()
        });
    }
    let is_split = matches!(shutter.readout, Readout::MiddleOutward | Readout::EdgesInward);
    let [_, height] = camera.size_px;
    check.require(!is_split || (height >= 4 && height.is_multiple_of(2)), "camera.shutter.readout", || {
        format!("reads two halves of the rows at once, but camera.size_px has {height}; an even number from 4 on has halves")
    });
    let is_interlaced = shutter.interlace_ms != FieldOr::Ms(0.0);
    let is_global = shutter.reset == Reset::Global;
    check.require(!is_interlaced || !(is_split || is_global), "camera.shutter.interlace_ms", || {
        format!(
            "cannot be combined with {}: no sensor has both; leave one of them out",
            if is_split { "a readout in halves" } else { "camera.shutter.reset = \"global\"" }
        )
    });
    check.require(!is_global || shutter.exposure_ms > 0.0, "camera.shutter.reset", || {
        "= \"global\" needs camera.shutter.exposure_ms above 0, the exposure of the row that is read first".into()
    });
}

/// Checks that a frame is read before the next one begins. A camera by itself has no frame rate that matters.
fn check_overlap(check: &mut Check, camera: &CameraSpec) {
    let shutter = &camera.shutter;
    let (readout_ms, period_ms) = (camera.readout_ms(), 1e3 / camera.fps);
    let key = match shutter.line_time_us {
        Some(_) => "camera.shutter.line_time_us",
        None => "camera.shutter.readout_ms",
    };
    // The next reset of all rows waits for the end of the readout.
    let (busy_ms, what) = match shutter.reset {
        Reset::Rolling => (readout_ms, "the readout takes"),
        Reset::Global => (readout_ms + shutter.exposure_ms, "exposure and readout take"),
    };
    let overlaps = readout_ms > 0.0 && busy_ms > ROUNDING * period_ms;
    check.require(shutter.allow_overlap || !overlaps, key, || {
        format!(
            "{what} {busy_ms} ms, longer than a frame's period of {period_ms:.3} ms (camera.fps = {}): the next frame \
             would begin before this one is read; make it shorter, lower camera.fps, or write \
             camera.shutter.allow_overlap = true",
            camera.fps
        )
    });
}

/// Checks the faults of trigger, stamps and delivery.
pub(super) fn check_timing(check: &mut Check, camera: &CameraSpec) {
    let Some(timing) = &camera.timing else { return };
    let TimingSpec {
        jitter_ms, drift_ppm, late_ms, late_stamp, drop_probability, double_probability, ..
    } = *timing;
    check.not_negative("camera.timing.jitter_ms", jitter_ms, "it is a standard deviation");
    check.require(drift_ppm.abs() < MOST_DRIFT_PPM, "camera.timing.drift_ppm", || {
        format!("must be between -{MOST_DRIFT_PPM} and {MOST_DRIFT_PPM}, not {drift_ppm}; 20 is usual")
    });
    check.not_negative("camera.timing.late_ms", late_ms, "0 is punctual");
    let period_ms = 1e3 / camera.fps;
    check.require(late_ms < period_ms || late_ms.is_nan(), "camera.timing.late_ms", || {
        format!(
            "must be below a frame's period of {period_ms:.3} ms, not {late_ms}: frames would change places"
        )
    });
    check.require(late_stamp == LateStamp::Nominal || late_ms > 0.0, "camera.timing.late_stamp", || {
        "is that of late triggers; write camera.timing.late_ms too, or leave it out".into()
    });
    for (key, probability) in
        [("drop_probability", drop_probability), ("double_probability", double_probability)]
    {
        check.require((0.0..1.0).contains(&probability), format!("camera.timing.{key}"), || {
            format!("must be 0 to below 1, not {probability}")
        });
    }
    let both = timing.double.iter().find(|frame| timing.drop.contains(frame));
    if let Some(frame) = both {
        check.fail(
            "camera.timing.double",
            format!("has frame {frame}, which camera.timing.drop has too; leave one out"),
        );
    }
    if timing.double.contains(&0) {
        check.fail("camera.timing.double", "has frame 0, before which no picture arrived; leave it out");
    }
}

/// Checks what only the rest of a scenario decides.
pub(super) fn check_with_quality(check: &mut Check, scenario: &Scenario) {
    check_overlap(check, &scenario.camera);
    let drops = |timing: &TimingSpec| !timing.drop.is_empty() || timing.drop_probability > 0.0;
    let video = scenario.output.format.iter().find(|format| format.is_video());
    if let (Some(video), Some(true)) = (video, scenario.camera.timing.as_ref().map(drops)) {
        check.fail("output.format", format!(
            "has the video {video:?}, whose frames have no numbers, but camera.timing drops some: write pictures, or drop none"
        ));
    }
    let is_global = scenario.camera.shutter.reset == Reset::Global;
    check.require(!is_global || scenario.quality.preset != Preset::Paper, "camera.shutter.reset", || {
        "= \"global\" is not in the paper's methods; write quality.preset = \"default\"".into()
    });
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scenario::{ShutterSpec, validate, validate::tests::good};

    fn problems(change: impl FnOnce(&mut Scenario)) -> Vec<(String, String)> {
        let mut scenario = good();
        change(&mut scenario);
        validate(&scenario).into_iter().map(|problem| (problem.key, problem.message)).collect()
    }

    fn of_shutter(shutter: ShutterSpec) -> Vec<(String, String)> {
        problems(|scenario| {
            (scenario.camera.shutter, scenario.camera.fps) = (shutter, 30.0);
        })
    }

    fn of_timing(timing: TimingSpec) -> Vec<(String, String)> {
        problems(|scenario| scenario.camera.timing = Some(timing))
    }

    #[test]
    fn a_readout_beyond_the_period_is_refused_or_allowed_by_name() {
        let long = ShutterSpec { readout_ms: 40.0, ..ShutterSpec::default() };
        let found = of_shutter(long.clone());
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].0 == "camera.shutter.readout_ms" && found[0].1.contains("allow_overlap = true"));
        assert_eq!(of_shutter(ShutterSpec { allow_overlap: true, ..long }), []);
        assert_eq!(of_shutter(ShutterSpec { readout_ms: 33.3334, ..ShutterSpec::default() }), []);
        // 480 lines of 80 us.
        let lines = ShutterSpec { line_time_us: Some(80.0), ..ShutterSpec::default() };
        assert_eq!(of_shutter(lines.clone())[0].0, "camera.shutter.line_time_us");
        // Two halves at once take half of it.
        assert_eq!(of_shutter(ShutterSpec { readout: Readout::EdgesInward, ..lines }), []);
        let global = ShutterSpec {
            readout_ms: 20.0,
            exposure_ms: 15.0,
            reset: Reset::Global,
            ..ShutterSpec::default()
        };
        assert!(of_shutter(global)[0].1.contains("exposure and readout take 35 ms"));
    }

    #[test]
    fn what_no_sensor_has_is_refused() {
        let interlaced =
            ShutterSpec { interlace_ms: FieldOr::Field, exposure_ms: 2.0, ..ShutterSpec::default() };
        let cases = [
            (
                ShutterSpec { readout: Readout::MiddleOutward, ..interlaced.clone() },
                "camera.shutter.interlace_ms",
            ),
            (ShutterSpec { reset: Reset::Global, ..interlaced }, "camera.shutter.interlace_ms"),
            (ShutterSpec { reset: Reset::Global, ..ShutterSpec::default() }, "camera.shutter.reset"),
            (
                ShutterSpec { readout_ms: 1.0, line_time_us: Some(2.0), ..ShutterSpec::default() },
                "camera.shutter.line_time_us",
            ),
        ];
        for (shutter, key) in cases {
            let found = of_shutter(shutter);
            assert!(found.len() == 1 && found[0].0 == key, "{key}: {found:?}");
        }
        let odd = problems(|scenario| {
            scenario.camera.shutter.readout = Readout::EdgesInward;
            scenario.camera.size_px[1] += 1;
        });
        assert!(odd.iter().any(|(key, _)| key == "camera.shutter.readout"), "{odd:?}");
        let paper = problems(|scenario| {
            (scenario.camera.shutter.reset, scenario.camera.shutter.exposure_ms) = (Reset::Global, 2.0);
            scenario.quality.preset = Preset::Paper;
        });
        assert!(paper.iter().any(|(key, _)| key == "camera.shutter.reset"), "{paper:?}");
    }

    #[test]
    fn faults_out_of_range_are_named_once() {
        let timing = TimingSpec::default;
        let cases = [
            (TimingSpec { jitter_ms: -1.0, ..timing() }, "camera.timing.jitter_ms"),
            (TimingSpec { drift_ppm: f64::NAN, ..timing() }, "camera.timing.drift_ppm"),
            (TimingSpec { late_ms: 1e4, ..timing() }, "camera.timing.late_ms"),
            (TimingSpec { late_ms: f64::NAN, ..timing() }, "camera.timing.late_ms"),
            (TimingSpec { late_stamp: LateStamp::Actual, ..timing() }, "camera.timing.late_stamp"),
            (TimingSpec { drop_probability: 1.0, ..timing() }, "camera.timing.drop_probability"),
            (TimingSpec { double_probability: -0.1, ..timing() }, "camera.timing.double_probability"),
            (TimingSpec { double: vec![3], drop: vec![3], ..timing() }, "camera.timing.double"),
            (TimingSpec { double: vec![0], ..timing() }, "camera.timing.double"),
        ];
        for (timing, key) in cases {
            let found = of_timing(timing);
            assert!(found.len() == 1 && found[0].0 == key, "{key}: {found:?}");
        }
        let legal = TimingSpec { drop: vec![3], double: vec![5], late_ms: 1.0, ..timing() };
        assert_eq!(of_timing(legal), []);
    }
}
