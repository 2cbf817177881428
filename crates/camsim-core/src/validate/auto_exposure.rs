//! Checks of `[camera.auto_exposure]`.

use super::Check;
use crate::scenario::{BurstOver, CameraSpec, Preset, Reset, Scenario};

/// Full key of a leaf.
fn key(leaf: &str) -> String {
    format!("camera.auto_exposure.{leaf}")
}

pub(super) fn check_auto_exposure(check: &mut Check, camera: &CameraSpec) {
    let Some(spec) = &camera.auto_exposure else { return };
    let [left, top, right, bottom] = spec.window;
    let is_empty = left >= right || top >= bottom;
    check.require(!is_empty, key("window"), || {
        format!("must be [left, top, right, bottom], each side after the other, not {:?}", spec.window)
    });
    for (leaf, [least, most]) in [("exposure_ms", spec.exposure_ms), ("gain", spec.gain)] {
        let is_reversed = least > most;
        check.require(!is_reversed, key(leaf), || {
            format!("must be [smallest, largest], not [{least}, {most}]; two equal numbers fix the value")
        });
    }
    check_nominal(check, camera);
}

/// The exposure time that the light is scaled by.
fn check_nominal(check: &mut Check, camera: &CameraSpec) {
    let nominal_ms = camera.nominal_exposure_ms();
    check.require(nominal_ms > 0.0, "camera.shutter.exposure_ms", || {
        "is 0; with [camera.auto_exposure] it is the exposure that makes the scene's white white: give it"
            .into()
    });
    let of_sensor = camera.sensor.as_ref().and_then(|sensor| sensor.exposure_ms);
    check.require(of_sensor.is_none_or(|ms| ms == nominal_ms), "camera.sensor.exposure_ms", || {
        "fixes the exposure that [camera.auto_exposure] is to choose; leave one of them out".into()
    });
}

/// What concerns other tables of the scenario.
pub(super) fn check_with_scenario(check: &mut Check, scenario: &Scenario) {
    if scenario.camera.auto_exposure.is_none() {
        return;
    }
    check.require(scenario.quality.preset != Preset::Paper, "quality.preset", || {
        "\"paper\" has its own photometric model; leave [camera.auto_exposure] out, or write \"default\""
            .into()
    });
    check.require(scenario.camera.shutter.reset == Reset::Rolling, "camera.shutter.reset", || {
        "= \"global\" gives each row an exposure of its own, and [camera.auto_exposure] one to each frame; leave one of \
         them out"
            .into()
    });
    for (i, twin) in scenario.output.twin.iter().enumerate() {
        let over_exposure = twin.instants.is_some() && twin.over.unwrap_or_default() == BurstOver::Exposure;
        check.require(!over_exposure, format!("output.twin.{i}.over"), || {
            "divides an exposure that differs from frame to frame with [camera.auto_exposure]; write \"readout\", or \
             leave the burst or the automatic exposure out"
                .into()
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        scenario::{AutoExposureSpec, ImageSensorSpec, TwinSpec},
        validate::tests::good,
        validate::validate,
    };

    fn scenario() -> Scenario {
        let mut scenario = good();
        scenario.camera.shutter.exposure_ms = 4.0;
        scenario.camera.auto_exposure = Some(AutoExposureSpec::default());
        scenario
    }

    #[test]
    fn numbers_out_of_range_are_named() {
        assert_eq!(validate(&scenario()), []);
        type Edit = fn(&mut AutoExposureSpec);
        let cases: &[(&str, Edit)] = &[
            ("window", |a| a.window = [0.5, 0.0, 0.4, 1.0]),
            ("window", |a| a.window = [0.0, 0.0, 1.1, 1.0]),
            ("window", |a| a.window = [f64::NAN, 0.0, 1.0, 1.0]),
            ("target", |a| a.target = 1.0),
            ("exposure_ms", |a| a.exposure_ms = [0.0, 1.0]),
            ("gain", |a| a.gain = [4.0, 2.0]),
            ("gain", |a| a.gain = [1.0, f64::INFINITY]),
            ("speed", |a| a.speed = 0.0),
            ("delay", |a| a.delay = 0),
            ("nominal_ms", |a| a.nominal_ms = Some(-1.0)),
        ];
        for &(leaf, edit) in cases {
            let mut scenario = scenario();
            edit(scenario.camera.auto_exposure.as_mut().expect("given"));
            let problems = validate(&scenario);
            assert!(problems.iter().any(|problem| problem.key == key(leaf)), "{leaf}: {problems:?}");
        }
    }

    #[test]
    fn what_it_does_not_go_with_is_refused() {
        let problem = |edit: fn(&mut Scenario)| {
            let mut scenario = scenario();
            edit(&mut scenario);
            validate(&scenario).into_iter().map(|problem| problem.key).collect::<Vec<_>>()
        };
        assert!(
            problem(|s| s.camera.shutter.exposure_ms = 0.0)
                .contains(&"camera.shutter.exposure_ms".to_owned())
        );
        let sensor = |exposure_ms| {
            Some(ImageSensorSpec { white_e: Some(1e4), exposure_ms, ..ImageSensorSpec::default() })
        };
        let mut with_sensor = scenario();
        with_sensor.camera.sensor = sensor(None);
        assert_eq!(validate(&with_sensor), []);
        with_sensor.camera.sensor = sensor(Some(2.0));
        assert_eq!(validate(&with_sensor)[0].key, "camera.sensor.exposure_ms");
        assert_eq!(problem(|s| s.quality.preset = Preset::Paper), ["quality.preset"]);
        assert_eq!(problem(|s| s.camera.shutter.reset = Reset::Global), ["camera.shutter.reset"]);
        let bursts = problem(|s| {
            s.output.twin = vec![TwinSpec { name: "burst".into(), instants: Some(9), ..TwinSpec::default() }];
        });
        assert_eq!(bursts, ["output.twin.0.over"]);
    }
}
