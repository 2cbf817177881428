//! Checks of `[camera.sensor]`.

use super::Check;
use crate::{
    imaging::with_facts,
    scenario::{
        CameraSpec, Channel, Companding, ImageSensorSpec, Mosaic, OutputEncoding, PerChannel, Preset,
        ResponseCurve, Scenario,
    },
};

/// Full key of a leaf.
fn key(leaf: &str) -> String {
    format!("camera.sensor.{leaf}")
}

pub(super) fn check_image_sensor(check: &mut Check, camera: &CameraSpec) {
    let Some(spec) = &camera.sensor else { return };
    check_light(check, camera, spec);
    check_temperature(check, spec);
    check_digits(check, spec);
    check_colors(check, spec);
    let photometric = &camera.photometric;
    check.require(photometric.noise_sigma == 0.0, "camera.photometric.noise_sigma", || {
        "belongs to the simple model; with [camera.sensor] set camera.sensor.read_noise_e, and leave it out".into()
    });
    check.require(photometric.light == 1.0, "camera.photometric.light", || {
        "belongs to the simple model; with [camera.sensor] scale the light by white_e, white_lux or white_w_m2, and \
         leave it out"
            .into()
    });
    let is_grey = matches!(photometric.output, OutputEncoding::Luma8 | OutputEncoding::Luma16);
    check.require(!is_grey || spec.mosaic == Mosaic::Mono, "camera.photometric.output", || {
        "is grey, which needs camera.sensor.mosaic = \"mono\"; choose a colour encoding, or that mosaic"
            .into()
    });
    check.require(
        spec.response == ResponseCurve::Linear || photometric.output != OutputEncoding::Srgb8,
        "camera.photometric.output",
        || {
            "is srgb8, a second curve after camera.sensor.response; write \"linear8\" (8 bit) or \"linear-f16\" \
             (16 bit PNG), which hold the response as it is"
                .into()
        },
    );
}

/// What concerns other tables of the scenario.
pub(super) fn check_with_output(check: &mut Check, scenario: &Scenario) {
    let sensor = scenario.camera.sensor.as_ref();
    let curved = sensor.is_some_and(|spec| spec.response != ResponseCurve::Linear);
    let video = scenario.output.format.iter().any(|format| format.is_video());
    check.require(!curved || !video, key("response"), || {
        "must be \"linear\" for videos, whose code values are those of sRGB; leave it out, or write png"
            .into()
    });
    check.require(
        sensor.is_some() || !scenario.output.all_channels().any(|channel| channel == Channel::Raw),
        "output.channels",
        || "has \"raw\", the digital numbers of an image sensor; add [camera.sensor], or leave it out".into(),
    );
    check.require(sensor.is_none() || scenario.quality.preset != Preset::Paper, "quality.preset", || {
        "\"paper\" has its own photometric model; leave [camera.sensor] out, or write \"default\"".into()
    });
}

fn check_light(check: &mut Check, camera: &CameraSpec, spec: &ImageSensorSpec) {
    let scales = [spec.white_e, spec.white_lux, spec.white_w_m2];
    let given = scales.iter().flatten().count();
    check.require(given == 1, key("white_e"), || {
        format!(
            "{}; give one of white_e (electrons of the scene's white), white_lux (illuminance of the scene) and \
             white_w_m2 (irradiance on the sensor)",
            if given == 0 { "is missing, and so is any other scale of the light" } else { "is one of several scales" }
        )
    });
    let known = with_facts(spec);
    // What a second scale would need is no remedy.
    let is_one_scale = given == 1;
    let exposure_ms = spec.exposure_ms.unwrap_or(camera.shutter.exposure_ms);
    let mut needs = |leaf: &str, is_given: bool, what: &str| {
        check.require(is_given, key(leaf), || format!("is missing: {what}; add it, or give white_e"));
    };
    if is_one_scale && (spec.white_lux.is_some() || spec.white_w_m2.is_some()) {
        needs("pixel_um", known.pixel_um.is_some(), "photons are counted over the area of a pixel");
        let efficiency = known.quantum_efficiency.is_some();
        needs("quantum_efficiency", efficiency, "it takes photons to electrons, and no source states it");
        needs(
            "exposure_ms",
            exposure_ms > 0.0,
            "light is collected for that time, as camera.shutter.exposure_ms is 0",
        );
    }
    if is_one_scale && spec.white_lux.is_some() {
        needs("f_number", spec.f_number.is_some(), "it says how much of the scene's light the lens collects");
    }
    check_efficiency(check, spec);
}

fn check_efficiency(check: &mut Check, spec: &ImageSensorSpec) {
    let Some(efficiency) = &spec.quantum_efficiency else { return };
    let fits = match efficiency {
        PerChannel::One(_) => true,
        PerChannel::Each(values) => {
            let most = if spec.mosaic == Mosaic::Rgbw { 4 } else { 3 };
            spec.mosaic != Mosaic::Mono && (3..=most).contains(&values.len())
        }
    };
    check.require(fits, key("quantum_efficiency"), || {
        "must be one number, or of a sensor with colours [red, green, blue], with rgbw also [red, green, blue, white]".into()
    });
}

fn check_temperature(check: &mut Check, spec: &ImageSensorSpec) {
    let doublings = (spec.temperature_c - spec.dark_reference_c) / spec.dark_doubling_c;
    check.require(doublings.abs() <= 64.0, key("temperature_c"), || {
        format!("makes {doublings} doublings of the dark current; at most 64 are possible")
    });
}

fn check_digits(check: &mut Check, spec: &ImageSensorSpec) {
    let bits = spec.adc_bits.or(with_facts(spec).bits).unwrap_or(crate::imaging::BITS);
    let most = f64::from((1_u32 << bits.min(16)) - 1);
    check.require(spec.black_dn < most || spec.black_dn.is_nan(), key("black_dn"), || {
        format!("must be below {most}, the largest number of {bits} bits, not {}", spec.black_dn)
    });
    let is_piecewise = spec.companding == Companding::Piecewise;
    check_curve(
        check,
        "companding_points",
        is_piecewise,
        "companding = \"piecewise\"",
        &spec.companding_points,
    );
}

/// Corners of a curve from (0, 0) to (1, 1).
fn check_curve(check: &mut Check, leaf: &str, is_wanted: bool, wanted_by: &str, points: &[[f64; 2]]) {
    check.require(is_wanted || points.is_empty(), key(leaf), || format!("has no effect without {wanted_by}"));
    let rises = points.windows(2).all(|pair| pair[0][0] < pair[1][0] && pair[0][1] < pair[1][1]);
    let spans = points.first() == Some(&[0.0, 0.0]) && points.last() == Some(&[1.0, 1.0]);
    check.require(!is_wanted || (rises && spans), key(leaf), || {
        "must be a list of rising corners from [0, 0] to [1, 1], such as [[0, 0], [0.2, 0.5], [1, 1]]".into()
    });
}

fn check_colors(check: &mut Check, spec: &ImageSensorSpec) {
    let m = &spec.spectral_matrix;
    let row_sums = m.chunks(3).map(|row| row.iter().sum::<f64>());
    let determinant = m[0] * (m[4] * m[8] - m[5] * m[7]) - m[1] * (m[3] * m[8] - m[5] * m[6])
        + m[2] * (m[3] * m[7] - m[4] * m[6]);
    check.require(row_sums.into_iter().all(|sum| sum > 0.0) && determinant.abs() > 1e-6, key("spectral_matrix"), || {
        "must have rows with a sum above 0 that are no mixtures of each other: what red, green and blue pixels see of \
         the scene's R, G and B"
            .into()
    });
    let is_grey =
        spec.mosaic == Mosaic::Mono && (spec.white_balance.is_some() || spec.color_matrix.is_some());
    check.require(!is_grey, key("mosaic"), || {
        "is \"mono\", which has neither white_balance nor color_matrix; leave these out".into()
    });
    let is_table = spec.response == ResponseCurve::Table;
    check_curve(check, "response_points", is_table, "response = \"table\"", &spec.response_points);
}

#[cfg(test)]
mod tests {
    use crate::{
        scenario::{
            Channel, Companding, FlickerSpec, ImageFormat, ImageSensorSpec, Mosaic, OutputEncoding,
            PerChannel, ResponseCurve, Scenario, SensorModel,
        },
        validate::{tests, validate},
    };

    fn good() -> Scenario {
        let mut scenario = tests::good();
        scenario.camera.photometric.noise_sigma = 0.0;
        scenario.camera.sensor =
            Some(ImageSensorSpec { white_e: Some(5000.0), ..ImageSensorSpec::default() });
        scenario
    }

    #[test]
    fn a_scale_is_all_that_is_needed() {
        assert_eq!(validate(&good()), []);
        let mut by_lux = good();
        let sensor = by_lux.camera.sensor.as_mut().expect("valid");
        (sensor.white_e, sensor.white_lux, sensor.f_number) = (None, Some(1e4), Some(4.0));
        (sensor.model, sensor.quantum_efficiency) = (Some(SensorModel::Imx250), Some(PerChannel::One(0.6)));
        sensor.exposure_ms = Some(2.0);
        assert_eq!(validate(&by_lux), []);
    }

    #[test]
    fn wrong_values_are_named_with_a_remedy() {
        type Change = fn(&mut Scenario, &mut ImageSensorSpec);
        let cases: [(&str, Change); 27] = [
            ("camera.sensor.white_e", |_, s| s.white_e = None),
            ("camera.sensor.white_e", |_, s| s.white_e = Some(0.0)),
            ("camera.sensor.white_e", |_, s| s.white_lux = Some(1e4)),
            ("camera.sensor.white_e", |_, s| (s.white_lux, s.white_w_m2) = (Some(1e4), Some(1.0))),
            // No source states its quantum efficiency.
            ("camera.sensor.quantum_efficiency", |_, s| {
                (s.white_e, s.white_w_m2, s.model, s.exposure_ms) =
                    (None, Some(1.0), Some(SensorModel::Imx250), Some(1.0));
            }),
            ("camera.sensor.quantum_efficiency", |_, s| s.quantum_efficiency = Some(PerChannel::One(60.0))),
            ("camera.sensor.quantum_efficiency", |_, s| {
                s.quantum_efficiency = Some(PerChannel::Each(vec![0.5, 0.5]));
            }),
            ("camera.sensor.read_noise_e", |_, s| s.read_noise_e = Some(f64::NAN)),
            ("camera.sensor.prnu", |_, s| s.prnu = Some(-0.1)),
            ("camera.sensor.temperature_c", |_, s| s.temperature_c = 1e9),
            ("camera.sensor.hot_pixels", |_, s| s.hot_pixels = 2.0),
            ("camera.sensor.full_well_e", |_, s| s.full_well_e = Some(-1.0)),
            ("camera.sensor.bits", |_, s| s.bits = Some(20)),
            ("camera.sensor.adc_bits", |_, s| s.adc_bits = Some(7)),
            ("camera.sensor.black_dn", |_, s| s.black_dn = 5000.0),
            ("camera.sensor.companding_points", |_, s| s.companding = Companding::Piecewise),
            ("camera.sensor.companding_points", |_, s| s.companding_points = vec![[0.0, 0.0], [1.0, 1.0]]),
            ("camera.sensor.spectral_matrix", |_, s| s.spectral_matrix = [1.0; 9]),
            ("camera.sensor.mosaic", |_, s| {
                (s.mosaic, s.white_balance) = (Mosaic::Mono, Some([1.0; 3]));
            }),
            ("camera.sensor.flicker.hz", |_, s| {
                s.flicker = Some(FlickerSpec { hz: 0.0, ..FlickerSpec::default() })
            }),
            ("camera.sensor.flicker.duty", |_, s| {
                s.flicker = Some(FlickerSpec { duty: 0.0, ..FlickerSpec::default() });
            }),
            ("camera.sensor.gamma", |_, s| s.gamma = 0.0),
            ("camera.photometric.output", |_, s| s.response = ResponseCurve::Gamma),
            ("camera.photometric.output", |scenario, _| {
                scenario.camera.photometric.output = OutputEncoding::Luma8;
            }),
            ("camera.photometric.noise_sigma", |scenario, _| scenario.camera.photometric.noise_sigma = 0.1),
            ("camera.photometric.light", |scenario, _| scenario.camera.photometric.light = 2.0),
            ("camera.sensor.response", |scenario, s| {
                s.response = ResponseCurve::Srgb;
                scenario.camera.photometric.output = OutputEncoding::Linear8;
                scenario.output.format = vec![ImageFormat::Y4m];
            }),
        ];
        for (key, change) in cases {
            let mut scenario = good();
            let mut sensor = scenario.camera.sensor.take().expect("valid");
            change(&mut scenario, &mut sensor);
            scenario.camera.sensor = Some(sensor);
            let problems = validate(&scenario);
            let keys: Vec<&str> = problems.iter().map(|problem| problem.key.as_str()).collect();
            assert_eq!(keys, [key], "{problems:?}");
        }
        let mut raw_without = good();
        raw_without.camera.sensor = None;
        raw_without.output.channels.push(Channel::Raw);
        assert_eq!(validate(&raw_without)[0].key, "output.channels");
    }
}
