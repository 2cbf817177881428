//! Pictures of a sensor against the closed forms of EMVA 1288.

use super::*;
use crate::scenario::{FlickerSpec, FlickerWave, ShutterSpec};

pub(super) fn camera(size_px: [u32; 2], sensor: ImageSensorSpec) -> CameraSpec {
    CameraSpec {
        size_px,
        sensor: Some(sensor),
        shutter: ShutterSpec { exposure_ms: 10.0, ..ShutterSpec::default() },
        ..CameraSpec::default()
    }
}

pub(super) fn mono(white_e: f64) -> ImageSensorSpec {
    ImageSensorSpec { white_e: Some(white_e), mosaic: Mosaic::Mono, ..ImageSensorSpec::default() }
}

fn flat([width, height]: [u32; 2], value: f32) -> Vec<f32> {
    [value, value, value, 1.0].repeat((width * height) as usize)
}

fn mean_and_variance(values: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let n = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / n;
    [mean, values.map(|v| (v - mean).powi(2)).sum::<f64>() / (n - 1.0)]
}

#[test]
fn photon_transfer_has_the_gain_as_its_slope() {
    let size_px = [400, 300];
    let spec = ImageSensorSpec {
        read_noise_e: Some(4.0),
        gain_e_per_dn: Some(2.5),
        black_dn: 100.0,
        full_well_e: Some(1e5),
        ..mono(9000.0)
    };
    let sensor = ImageSensor::new(&camera(size_px, spec), 5).expect("valid");
    for level in [0.0, 0.02, 0.1, 0.4, 0.9] {
        let raw = sensor.raw(3, 0.0, &flat(size_px, level as f32));
        let [mean, variance] = mean_and_variance(raw.values.iter().map(|&v| f64::from(v)));
        let electrons = 9000.0 * level;
        // Quantisation adds 1/12; five standard errors of 120 000 pixels.
        let expected = [100.0 + electrons / 2.5, (electrons + 16.0) / 6.25 + 1.0 / 12.0];
        assert!(
            (mean - expected[0]).abs() < 5.0 * (expected[1] / 120_000.0).sqrt() + 1e-3,
            "{level}: {mean}"
        );
        assert!(
            (variance / expected[1] - 1.0).abs() < 5.0 * (2.0 / 120_000.0_f64).sqrt(),
            "{level}: {variance}"
        );
    }
}

#[test]
fn patterns_are_fixed_and_noise_is_not() {
    let size_px = [200, 160];
    let spec = ImageSensorSpec {
        dsnu_e: Some(6.0),
        prnu: Some(0.02),
        row_offset_e: 3.0,
        column_offset_e: 2.0,
        shot_noise: false,
        gain_e_per_dn: Some(0.1),
        black_dn: 1000.0,
        bits: Some(16),
        full_well_e: Some(1e6),
        ..mono(4000.0)
    };
    let sensor = |spec: &ImageSensorSpec, name: &str| {
        let camera = CameraSpec { name: name.into(), ..camera(size_px, spec.clone()) };
        ImageSensor::new(&camera, 5).expect("valid")
    };
    let fixed = sensor(&spec, "");
    let dark = fixed.raw(0, 0.0, &flat(size_px, 0.0));
    assert_eq!(dark, fixed.raw(9, 0.0, &flat(size_px, 0.0)), "fixed");
    assert_eq!(
        sensor(&spec, "cam").raw(0, 0.0, &flat(size_px, 0.0)),
        sensor(&spec, "cam/burst/3").raw(0, 0.0, &flat(size_px, 0.0))
    );
    assert_ne!(
        sensor(&spec, "cam").raw(0, 0.0, &flat(size_px, 0.0)),
        dark,
        "another camera has another pattern"
    );
    let electrons =
        |raw: &RawPicture| raw.values.iter().map(|&v| 0.1 * (f64::from(v) - 1000.0)).collect::<Vec<_>>();
    let dark_e = electrons(&dark);
    let [_, variance] = mean_and_variance(dark_e.iter().copied());
    // Rows and columns are few, so their variance is known to a tenth.
    assert!((variance / (36.0 + 9.0 + 4.0) - 1.0).abs() < 0.1, "{variance}");
    let bright_e = electrons(&fixed.raw(0, 0.0, &flat(size_px, 0.5)));
    let gains = bright_e.iter().zip(&dark_e).map(|(bright, dark)| (bright - dark) / 2000.0);
    let [mean, variance] = mean_and_variance(gains);
    assert!((mean - 1.0).abs() < 6e-4 && (variance.sqrt() / 0.02 - 1.0).abs() < 0.02, "{mean} {variance}");

    let noisy = ImageSensorSpec { read_noise_e: Some(3.0), row_noise_e: 2.0, column_noise_e: 1.0, ..spec };
    let noisy = sensor(&noisy, "");
    let [a, b] = [0, 1].map(|frame| electrons(&noisy.raw(frame, 0.0, &flat(size_px, 0.0))));
    let [_, variance] = mean_and_variance(a.iter().zip(&b).map(|(a, b)| (a - b) / 2.0_f64.sqrt()));
    assert!((variance / (9.0 + 4.0 + 1.0) - 1.0).abs() < 0.1, "{variance}");
}

#[test]
fn hot_and_dead_pixels_have_their_fractions() {
    let size_px = [500, 400];
    let spec = ImageSensorSpec {
        hot_pixels: 0.01,
        hot_e_s: 20_000.0,
        dead_pixels: 0.005,
        shot_noise: false,
        gain_e_per_dn: Some(1.0),
        black_dn: 20.0,
        bits: Some(16),
        full_well_e: Some(1e5),
        ..mono(4000.0)
    };
    let sensor = ImageSensor::new(&camera(size_px, spec), 5).expect("valid");
    let raw = sensor.raw(0, 0.0, &flat(size_px, 1.0));
    let fraction = |test: &dyn Fn(u16) -> bool| {
        raw.values.iter().filter(|&&v| test(v)).count() as f64 / raw.values.len() as f64
    };
    assert!((fraction(&|v| v == 20) - 0.005).abs() < 8e-4);
    assert!((fraction(&|v| v == 4020) - 0.985).abs() < 2e-3);
    // 200 electrons in the mean; of an exponential distribution 1/e is beyond it.
    let hot: Vec<f64> = raw.values.iter().filter(|&&v| v > 4020).map(|&v| f64::from(v) - 4020.0).collect();
    let [mean, _] = mean_and_variance(hot.iter().copied());
    let beyond = hot.iter().filter(|&&e| e > 200.0).count() as f64 / hot.len() as f64;
    assert!((mean / 200.0 - 1.0).abs() < 0.1 && (beyond - 0.368).abs() < 0.05, "{mean} {beyond}");
}

#[test]
fn light_saturates_at_the_full_well() {
    let spec = ImageSensorSpec { full_well_e: Some(1000.0), bits: Some(8), ..mono(5000.0) };
    let sensor = ImageSensor::new(&camera([20, 10], spec), 5).expect("valid");
    assert!(sensor.raw(0, 0.0, &flat([20, 10], 1.0)).values.iter().all(|&v| v == 255));
    let mut frame = RenderedFrame::picture([20, 10], flat([20, 10], 1.0));
    sensor.expose(&mut frame, 0.0, None);
    assert!(frame.color_rgba().iter().all(|&v| v == 1.0));
}

#[test]
fn threads_and_repetition_change_no_bit() {
    let size_px = [64, 48];
    let spec = ImageSensorSpec {
        read_noise_e: Some(2.0),
        prnu: Some(0.01),
        mosaic: Mosaic::Rggb,
        ..ImageSensorSpec { white_e: Some(300.0), ..ImageSensorSpec::default() }
    };
    let light: Vec<f32> =
        (0..64 * 48 * 4).map(|i| if i % 4 == 3 { 1.0 } else { (i % 97) as f32 / 97.0 }).collect();
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("valid");
        pool.install(|| {
            let sensor = ImageSensor::new(&camera(size_px, spec.clone()), 5).expect("valid");
            let mut frame = RenderedFrame { index: 4, ..RenderedFrame::picture(size_px, light.clone()) };
            sensor.expose(&mut frame, 0.0, None);
            frame
        })
    };
    let (one, many) = (run(1), run(5));
    assert_eq!(one.raw(), many.raw());
    assert_eq!(one.color_rgba(), many.color_rgba());
    // FNV-1a of the numbers: the same on every machine.
    let hash = one.raw().expect("valid").values.iter().fold(0xcbf2_9ce4_8422_2325_u64, |hash, value| {
        (hash ^ u64::from(*value)).wrapping_mul(0x0000_0100_0000_01b3)
    });
    assert_eq!(hash, 0x03a3_f0e4_22fb_601c, "{hash:#x}");
}

#[test]
fn little_more_light_changes_few_numbers_by_one() {
    let size_px = [300, 200];
    let spec =
        ImageSensorSpec { gain_e_per_dn: Some(1.0), full_well_e: Some(1e5), bits: Some(16), ..mono(1000.0) };
    let sensor = ImageSensor::new(&camera(size_px, spec), 5).expect("valid");
    let [a, b] = [0.5, 0.5001].map(|light| sensor.raw(0, 0.0, &flat(size_px, light)));
    let differences: Vec<i32> =
        a.values.iter().zip(&b.values).map(|(a, b)| i32::from(*b) - i32::from(*a)).collect();
    assert!(differences.iter().all(|d| (0..=1).contains(d)));
    // 0.1 electrons more.
    let fraction = differences.iter().sum::<i32>() as f64 / differences.len() as f64;
    assert!((fraction - 0.1).abs() < 0.01, "{fraction}");
}

#[test]
fn a_frame_of_its_own_exposure_is_that_of_a_sensor_with_it() {
    let size_px = [96, 64];
    let spec = ImageSensorSpec {
        read_noise_e: Some(3.0),
        dark_current_e_s: Some(2e4),
        gain_e_per_dn: Some(6.0),
        full_well_e: Some(2e4),
        hot_pixels: 0.05,
        hot_e_s: 1e5,
        prnu: Some(0.02),
        flicker: Some(FlickerSpec {
            hz: 100.0,
            depth: 0.9,
            wave: FlickerWave::Sine,
            ..FlickerSpec::default()
        }),
        ..mono(8000.0)
    };
    let exposure = FrameExposure { time_s: 2.5e-3, gain: 3.0, light: 0.75 };
    // A quarter of the nominal 10 ms, with a third of the electrons a number.
    let own = ImageSensorSpec {
        white_e: Some(2000.0),
        gain_e_per_dn: Some(2.0),
        exposure_ms: Some(2.5),
        ..spec.clone()
    };
    let picture = |spec: ImageSensorSpec, exposure: Option<&FrameExposure>| {
        let light: Vec<f32> = (0..96 * 64).flat_map(|i| [(i % 96) as f32 / 20.0; 4]).collect();
        let mut frame = RenderedFrame { index: 5, ..RenderedFrame::picture(size_px, light) };
        let sensor = ImageSensor::new(&camera(size_px, spec), 3).expect("valid");
        sensor.expose(&mut frame, 0.123, exposure);
        (frame.raw().expect("a raw picture").values.clone(), frame.into_color())
    };
    let (found, expected) = (picture(spec.clone(), Some(&exposure)), picture(own, None));
    assert!(found == expected && found != picture(spec, None));
}
