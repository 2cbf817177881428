//! Checks of `[camera.point_spread]`.

use super::Check;
use crate::{
    imaging::with_facts,
    scenario::{CameraSpec, PerChannel, PointSpreadSpec, Preset, Scenario},
};

/// Full key of a leaf.
fn key(leaf: &str) -> String {
    format!("camera.point_spread.{leaf}")
}

pub(super) fn check_point_spread(check: &mut Check, camera: &CameraSpec) {
    let Some(spec) = &camera.point_spread else { return };
    let PointSpreadSpec { sigma_px, defocus_px, f_number, .. } = *spec;
    let has_blur = [sigma_px, defocus_px, f_number].iter().any(Option::is_some) || spec.kernel.is_some();
    check.require(has_blur || spec.glare > 0.0, "camera.point_spread", || {
        "has no effect; give sigma_px (Gaussian), f_number (diffraction), defocus_px (disc), kernel (a file) \
         or glare, or leave it out"
            .into()
    });
    check_diffraction(check, camera, spec);
    check.require(spec.kernel.is_some() || spec.kernel_oversampling == 1, key("kernel_oversampling"), || {
        "belongs to camera.point_spread.kernel; add that, or leave it out".into()
    });
}

fn check_diffraction(check: &mut Check, camera: &CameraSpec, spec: &PointSpreadSpec) {
    if spec.f_number.is_none() {
        check.require(spec.pixel_um.is_none(), key("pixel_um"), || {
            "belongs to camera.point_spread.f_number; add that, or leave it out".into()
        });
        return;
    }
    let known = camera.sensor.as_ref().and_then(|sensor| with_facts(sensor).pixel_um);
    check.require(spec.pixel_um.is_some() || known.is_some(), key("pixel_um"), || {
        "is missing: the pattern of f_number has a size in micrometres; add it, here or in camera.sensor"
            .into()
    });
    if let PerChannel::Each(values) = &spec.wavelength_nm {
        check.require(values.len() == 3, key("wavelength_nm"), || {
            format!("must be one wavelength or [red, green, blue], not {values:?}")
        });
    }
}

/// What concerns other tables of the scenario.
pub(super) fn check_with_preset(check: &mut Check, scenario: &Scenario) {
    let has_spread = scenario.camera.point_spread.is_some();
    check.require(!has_spread || scenario.quality.preset != Preset::Paper, "quality.preset", || {
        "\"paper\" has its own photometric model; leave [camera.point_spread] out, or write \"default\""
            .into()
    });
}

#[cfg(test)]
mod tests {
    use crate::{
        scenario::{ImageSensorSpec, PerChannel, PointSpreadSpec, Preset, Scenario, SensorModel},
        validate::{tests::good, validate},
    };

    fn with(spec: PointSpreadSpec) -> Scenario {
        let mut scenario = good();
        scenario.camera.point_spread = Some(spec);
        scenario
    }

    #[test]
    fn parts_combine_and_a_sensor_states_the_pixel() {
        let blur = PointSpreadSpec {
            sigma_px: Some(0.5),
            f_number: Some(8.0),
            pixel_um: Some(3.45),
            defocus_px: Some(2.0),
            glare: 0.02,
            ..PointSpreadSpec::default()
        };
        assert_eq!(validate(&with(blur.clone())), []);
        let mut by_sensor = with(PointSpreadSpec { pixel_um: None, ..blur });
        by_sensor.camera.photometric.noise_sigma = 0.0;
        let model = Some(SensorModel::Imx250);
        by_sensor.camera.sensor =
            Some(ImageSensorSpec { white_e: Some(1e4), model, ..ImageSensorSpec::default() });
        assert_eq!(validate(&by_sensor), []);
    }

    #[test]
    fn wrong_values_are_named() {
        let airy = || PointSpreadSpec { f_number: Some(8.0), pixel_um: Some(3.0), ..Default::default() };
        let gaussian = || PointSpreadSpec { sigma_px: Some(1.0), ..Default::default() };
        let cases = [
            ("camera.point_spread", PointSpreadSpec::default()),
            ("camera.point_spread.sigma_px", PointSpreadSpec { sigma_px: Some(-1.0), ..Default::default() }),
            (
                "camera.point_spread.sigma_px",
                PointSpreadSpec { sigma_px: Some(f64::NAN), ..Default::default() },
            ),
            (
                "camera.point_spread.defocus_px",
                PointSpreadSpec { defocus_px: Some(1e9), ..Default::default() },
            ),
            ("camera.point_spread.f_number", PointSpreadSpec { f_number: Some(0.0), ..airy() }),
            ("camera.point_spread.pixel_um", PointSpreadSpec { pixel_um: None, ..airy() }),
            ("camera.point_spread.pixel_um", PointSpreadSpec { pixel_um: Some(-3.0), ..airy() }),
            ("camera.point_spread.pixel_um", PointSpreadSpec { pixel_um: Some(3.0), ..gaussian() }),
            (
                "camera.point_spread.wavelength_nm",
                PointSpreadSpec { wavelength_nm: PerChannel::Each(vec![500.0; 2]), ..airy() },
            ),
            (
                "camera.point_spread.wavelength_nm",
                PointSpreadSpec { wavelength_nm: PerChannel::One(0.55), ..airy() },
            ),
            (
                "camera.point_spread.kernel_oversampling",
                PointSpreadSpec { kernel_oversampling: 4, ..gaussian() },
            ),
            ("camera.point_spread.glare", PointSpreadSpec { glare: 1.0, ..gaussian() }),
        ];
        for (key, spec) in cases {
            let problems = validate(&with(spec.clone()));
            let keys: Vec<&str> = problems.iter().map(|problem| problem.key.as_str()).collect();
            assert_eq!(keys, [key], "{spec:?}: {problems:?}");
        }
        let mut paper = with(gaussian());
        paper.quality.preset = Preset::Paper;
        assert!(validate(&paper).iter().any(|problem| problem.key == "quality.preset"));
    }
}
