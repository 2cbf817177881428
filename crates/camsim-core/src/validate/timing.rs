//! Checks of `[camera.shutter]` and `[camera.timing]`.

use super::{
    Check,
    names::{ADVICE, is_portable},
};
use crate::scenario::{
    CameraSpec, FieldOr, LateStamp, Preset, Readout, Reset, Scenario, StampedBy, TimingSpec,
};

/// Rounded values, such as 33.3334 ms at 30 frames per second, are no longer than a period.
const ROUNDING: f64 = 1.0001;

/// Checks the times of the rows.
pub(super) fn check_shutter(check: &mut Check, camera: &CameraSpec) {
    let shutter = &camera.shutter;
    if shutter.line_time_us.is_some() {
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

/// Time from a frame to the next. A rate that is none, of which its own check tells, leaves all time.
fn period_ms(camera: &CameraSpec) -> f64 {
    if camera.fps > 0.0 { 1e3 / camera.fps } else { f64::INFINITY }
}

/// Checks that a frame is read before the next one begins. A camera by itself has no frame rate that matters.
fn check_overlap(check: &mut Check, camera: &CameraSpec) {
    let shutter = &camera.shutter;
    let (readout_ms, period_ms) = (camera.readout_ms(), period_ms(camera));
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
    let TimingSpec { late_ms, late_stamp, .. } = *timing;
    let period_ms = period_ms(camera);
    check.require(late_ms < period_ms || late_ms.is_nan(), "camera.timing.late_ms", || {
        format!(
            "must be below a frame's period of {period_ms:.3} ms, not {late_ms}: frames would change places"
        )
    });
    check.require(late_stamp == LateStamp::Nominal || late_ms > 0.0, "camera.timing.late_stamp", || {
        "is that of late triggers; write camera.timing.late_ms too, or leave it out".into()
    });
    for (key, lost) in [("drop", &timing.drop), ("miss", &timing.miss)] {
        if let Some(frame) = timing.double.iter().find(|frame| lost.contains(frame)) {
            check.fail(
                "camera.timing.double",
                format!("has frame {frame}, which camera.timing.{key} has too; leave one out"),
            );
        }
    }
    if timing.double.contains(&0) {
        check.fail("camera.timing.double", "has frame 0, before which no picture arrived; leave it out");
    }
    let name = timing.trigger.as_deref();
    check.require(name.is_none_or(is_portable), "camera.timing.trigger", || {
        format!("names a trigger that cameras share; give it a name of {ADVICE}, or leave it out")
    });
    let is_named = timing.stamped_by == StampedBy::Camera || name.is_some();
    check.require(is_named, "camera.timing.stamped_by", || {
        "= \"trigger\" needs camera.timing.trigger, the name of that trigger".into()
    });
}

/// Checks that cameras of one trigger say the same of it: the first that does not is named.
pub(super) fn check_triggers(check: &mut Check, cameras: &[&CameraSpec]) {
    for (i, camera) in cameras.iter().enumerate() {
        let Some((timing, trigger)) = with_trigger(camera) else { continue };
        let first =
            cameras[..i].iter().find(|other| with_trigger(other).is_some_and(|(_, it)| it == trigger));
        let Some((first, of_first)) = first.and_then(|first| Some((first, with_trigger(first)?.0))) else {
            continue;
        };
        let is_stamped = [timing, of_first].iter().all(|spec| spec.stamped_by == StampedBy::Trigger);
        let same = |a: f64, b: f64| a == b || a.is_nan() || b.is_nan();
        let agreements = [
            ("fps", same(camera.fps, first.fps)),
            ("phase", same(camera.phase, first.phase)),
            ("timing.late_ms", same(timing.late_ms, of_first.late_ms)),
            ("timing.miss", timing.miss == of_first.miss),
            ("timing.miss_probability", same(timing.miss_probability, of_first.miss_probability)),
            ("timing.jitter_ms", !is_stamped || same(timing.jitter_ms, of_first.jitter_ms)),
            ("timing.drift_ppm", !is_stamped || same(timing.drift_ppm, of_first.drift_ppm)),
            ("timing.late_stamp", !is_stamped || timing.late_stamp == of_first.late_stamp),
        ];
        for (key, agrees) in agreements {
            check.require(agrees, format!("cameras.{i}.{key}"), || {
                format!(
                    "differs from that of camera {}, which has the same trigger \"{trigger}\": give both the same \
                     value, or triggers of their own",
                    first.name
                )
            });
        }
    }
}

fn with_trigger(camera: &CameraSpec) -> Option<(&TimingSpec, &str)> {
    let timing = camera.timing.as_ref()?;
    Some((timing, timing.trigger.as_deref()?))
}

/// Checks what only the rest of a scenario decides.
pub(super) fn check_with_quality(check: &mut Check, scenario: &Scenario) {
    check_overlap(check, &scenario.camera);
    let drops = |timing: &TimingSpec| {
        let lists = timing.drop.len() + timing.miss.len();
        lists > 0 || timing.drop_probability > 0.0 || timing.miss_probability > 0.0
    };
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
    use crate::{scenario::ShutterSpec, validate::tests::good, validate::validate};

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
        let backwards =
            problems(|scenario| (scenario.camera.shutter, scenario.camera.fps) = (long.clone(), -3.0));
        assert!(matches!(&backwards[..], [(key, _)] if key == "camera.fps"), "{backwards:?}");
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
            (TimingSpec { double: vec![3], miss: vec![3], ..timing() }, "camera.timing.double"),
            (TimingSpec { miss_probability: f64::NAN, ..timing() }, "camera.timing.miss_probability"),
            (TimingSpec { trigger: Some("a/b".into()), ..timing() }, "camera.timing.trigger"),
            (TimingSpec { stamped_by: StampedBy::Trigger, ..timing() }, "camera.timing.stamped_by"),
        ];
        for (timing, key) in cases {
            let found = of_timing(timing);
            assert!(found.len() == 1 && found[0].0 == key, "{key}: {found:?}");
        }
        let legal = TimingSpec { drop: vec![3], double: vec![5], late_ms: 1.0, ..timing() };
        assert_eq!(of_timing(legal), []);
    }

    #[test]
    fn cameras_of_one_trigger_agree_on_it() {
        let timing = TimingSpec {
            trigger: Some("wire".into()),
            late_ms: 2.0,
            stamped_by: StampedBy::Trigger,
            ..TimingSpec::default()
        };
        let left = CameraSpec { name: "left".into(), timing: Some(timing.clone()), ..CameraSpec::default() };
        let keys = |right: CameraSpec| {
            let mut check = Check::default();
            check_triggers(&mut check, &[&CameraSpec::default(), &left, &right]);
            check.problems.into_iter().map(|problem| problem.key).collect::<Vec<_>>()
        };
        let right = |timing| CameraSpec { timing: Some(timing), ..left.clone() };
        let drops = TimingSpec { drop_probability: 0.1, ..timing.clone() };
        assert_eq!(keys(right(drops)), [""; 0]);
        let alone = TimingSpec { trigger: Some("other".into()), late_ms: 9.0, ..timing.clone() };
        assert_eq!(keys(right(alone)), [""; 0]);
        assert_eq!(keys(CameraSpec { fps: 7.0, ..left.clone() }), ["cameras.2.fps"]);
        assert_eq!(keys(CameraSpec { phase: 0.5, ..left.clone() }), ["cameras.2.phase"]);
        let other = TimingSpec { late_ms: 3.0, miss: vec![1], jitter_ms: 0.1, ..timing.clone() };
        assert_eq!(
            keys(right(other)),
            ["cameras.2.timing.late_ms", "cameras.2.timing.miss", "cameras.2.timing.jitter_ms"]
        );
        let own = TimingSpec { jitter_ms: 0.1, stamped_by: StampedBy::Camera, ..timing };
        assert_eq!(keys(right(own)), [""; 0]);
    }
}
