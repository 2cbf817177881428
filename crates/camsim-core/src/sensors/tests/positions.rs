//! Receiver, barometer and magnetometer.

use super::*;
use crate::{
    geodesy::geoid_undulation_m,
    scenario::{BarometerSpec, GnssSpec, MagnetometerSpec, SensorAxes, SensorMountSpec},
};

fn gnss(spec: GnssSpec, input: &SensorInput) -> Gnss {
    Gnss::new(&GnssSpec { name: "gnss0".into(), ..spec }, 12, input).unwrap()
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (count, sum) = values.fold((0.0, 0.0), |(count, sum), value| (count + 1.0, sum + value * value));
    f64::sqrt(sum / count)
}

#[test]
fn fixes_are_positions_of_the_antenna() {
    let frame = local_frame();
    let attitude = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let spec = GnssSpec { offset_m: [2.0, 0.0, -1.0], delay_ms: 120.0, ..GnssSpec::default() };
    for heights in [HeightReference::Ellipsoid, HeightReference::Msl] {
        let input = SensorInput {
            earth: Earth::new(Some(frame), heights),
            ..input(still(attitude), Some(frame), [0.0, 1.0])
        };
        let sample = gnss(spec.clone(), &input).samples().next().unwrap();
        // The nose points east.
        let expected_ned_m = DVec3::new(10.0, -18.0, -31.0);
        assert!((sample.truth.position_ned_m - expected_ned_m).length() < 1e-12);
        assert_eq!(sample.fix, Some(sample.truth));
        assert_eq!(sample.available_ns - sample.time.stamp_ns, 120_000_000);
        let at = frame.geodetic_from_ned(expected_ned_m);
        let undulation_m = geoid_undulation_m(at);
        let (ellipsoid_m, msl_m) = match heights {
            HeightReference::Ellipsoid => (at.height_m, at.height_m - undulation_m),
            HeightReference::Msl => (at.height_m + undulation_m, at.height_m),
        };
        // The geoid's cache is true to 2 mm.
        assert!((sample.truth.at.height_m - ellipsoid_m).abs() < 3e-3);
        assert!((sample.truth.msl_m - msl_m).abs() < 3e-3);
        assert_eq!((sample.truth.at.lat_rad, sample.truth.at.lon_rad), (at.lat_rad, at.lon_rad));
    }
}

#[test]
fn errors_of_fixes_have_their_deviations() {
    let spec = GnssSpec {
        sigma_m: [1.5, 3.0],
        drift_m: [0.8, 2.0],
        drift_tau_s: 2.0,
        velocity_sigma_m_s: [0.1, 0.2],
        ..GnssSpec::default()
    };
    let gnss = gnss(spec, &input(still(DQuat::IDENTITY), Some(local_frame()), [0.0, 10_000.0]));
    let errors: Vec<[DVec3; 2]> = gnss
        .samples()
        .map(|sample| {
            let (fix, truth) = (sample.fix.unwrap(), sample.truth);
            // The geodetic and the local position are the same.
            let again = local_frame().ned_from_geodetic(fix.at);
            assert!((again - fix.position_ned_m).length() < 1e-8);
            [fix.position_ned_m - truth.position_ned_m, fix.velocity_ned_m_s - truth.velocity_ned_m_s]
        })
        .collect();
    let deviation = |what: usize, axis: usize| rms(errors.iter().map(|error| error[what][axis]));
    // 100 000 samples, 5000 correlation times: standard errors of 0.3 and 1.4 %; five of the latter.
    for (axis, sigma) in [(0, 1.7), (1, 1.7), (2, 13_f64.sqrt())] {
        assert!((deviation(0, axis) / sigma - 1.0).abs() < 0.07, "{axis}: {}", deviation(0, axis));
    }
    for (axis, sigma) in [(0, 0.1), (1, 0.1), (2, 0.2)] {
        assert!((deviation(1, axis) / sigma - 1.0).abs() < 0.015, "{axis}: {}", deviation(1, axis));
    }
}

#[test]
fn fixes_drop_out_as_often_and_as_long_as_asked_for() {
    let spec = GnssSpec { dropout_every_s: 20.0, dropout_mean_s: 5.0, ..GnssSpec::default() };
    let input = input(still(DQuat::IDENTITY), Some(local_frame()), [0.0, 100_000.0]);
    let has_fix: Vec<bool> = gnss(spec, &input).samples().map(|sample| sample.fix.is_some()).collect();
    let without = has_fix.iter().filter(|has| !**has).count();
    let begins = has_fix.windows(2).filter(|pair| pair[0] && !pair[1]).count();
    // 4000 dropouts: standard errors of 1.6 % of their number and length, five of them. Both times are longer
    // by half a period or less than those of a continuous process.
    let (mean_s, every_s) =
        (0.1 * without as f64 / begins as f64, 0.1 * (has_fix.len() - without) as f64 / begins as f64);
    assert!((mean_s / 5.0 - 1.0).abs() < 0.09 && (every_s / 20.0 - 1.0).abs() < 0.09, "{mean_s} {every_s}");

    let spec = GnssSpec { dropouts_s: vec![[1.0, 2.0], [5.0, 5.05]], ..GnssSpec::default() };
    let input = SensorInput { span_s: [0.0, 9.0], ..input };
    let missing: Vec<i64> = gnss(spec, &input)
        .samples()
        .filter(|sample| sample.fix.is_none())
        .map(|sample| sample.time.sample)
        .collect();
    assert_eq!(missing, [10, 11, 12, 13, 14, 15, 16, 17, 18, 19, 50]);
}

#[test]
fn pressure_is_that_of_the_height() {
    let spec = BarometerSpec { name: "baro0".into(), ..BarometerSpec::default() };
    let input = input(still(DQuat::IDENTITY), Some(local_frame()), [0.0, 100.0]);
    let first = |spec: &BarometerSpec| Barometer::new(spec, 12, &input).unwrap().samples().next().unwrap();
    let sample = first(&spec);
    let at = local_frame().geodetic_from_ned(DVec3::new(10.0, -20.0, -30.0));
    assert!((sample.true_msl_m - (at.height_m - geoid_undulation_m(at))).abs() < 3e-3);
    assert!((sample.altitude_m - sample.true_msl_m).abs() < 1e-6);
    assert_eq!(sample.pressure_pa, sample.true_pressure_pa);
    // A low: 1 % less pressure reads about 85 m too high at 2 km.
    let low = first(&BarometerSpec { sea_level_pa: 100_311.75, ..spec.clone() });
    assert!((low.pressure_pa / sample.pressure_pa - 0.99).abs() < 1e-12);
    assert!((low.altitude_m - sample.altitude_m - 79.0).abs() < 2.0, "{}", low.altitude_m);
    let noisy = BarometerSpec { sigma_pa: 10.0, bias_pa: 50.0, quantisation_pa: 4.0, ..spec };
    let samples: Vec<_> = Barometer::new(&noisy, 12, &input).unwrap().samples().collect();
    assert!(samples.iter().all(|sample| sample.pressure_pa % 4.0 == 0.0 && sample.bias_pa == 50.0));
    let spread = rms(samples.iter().map(|sample| sample.pressure_pa - sample.true_pressure_pa - 50.0));
    // 10 Pa, and 4 / sqrt(12) of the rounding; 5001 samples: 1 %.
    assert!((spread / (100.0_f64 + 16.0 / 12.0).sqrt() - 1.0).abs() < 0.05, "{spread}");
}

#[test]
fn the_field_is_that_of_the_model() {
    // Test values of WMM2025 (NOAA, WMM2025_TestValues.txt), 2025.0 at sea level of the ellipsoid:
    // 80 N 0 E: 6521.6, 145.9, 54791.5 nT. 0 N 120 E: 39677.8, -109.6, -10580.2. 80 S 120 W: 6117.5,
    // 15751.9, -52022.5.
    for (lat_deg, lon_deg, expected_nt) in [
        (80.0, 0.0, DVec3::new(6521.6, 145.9, 54_791.5)),
        (0.0, 120.0, DVec3::new(39_677.8, -109.6, -10_580.2)),
        (-80.0, 240.0, DVec3::new(6117.5, 15_751.9, -52_022.5)),
    ] {
        let frame = LocalFrame::new(Geodetic::from_deg(lat_deg, lon_deg, -30.0));
        let spec = MagnetometerSpec {
            name: "mag0".into(),
            date: Some("2025-01-01".into()),
            mount: SensorMountSpec { offset_m: [-10.0, 20.0, 0.0], ..SensorMountSpec::default() },
            ..MagnetometerSpec::default()
        };
        let input = input(still(DQuat::IDENTITY), Some(frame), [0.0, 0.0]);
        let sample = Magnetometer::new(&spec, 12, &input).unwrap().samples().next().unwrap();
        // Published to 0.1 nT; f32 holds 55 000 nT to 0.004.
        let off_nt = (sample.field_ned_ut * 1e3 - expected_nt).abs().max_element();
        assert!(off_nt < 0.2, "{lat_deg}: {} {off_nt}", sample.field_ned_ut);
    }
}

#[test]
fn iron_and_axes_change_the_field_as_defined() {
    let spec = MagnetometerSpec {
        name: "mag0".into(),
        axes: SensorAxes::Flu,
        field_ned_ut: Some([20.0, 1.0, 43.0]),
        hard_iron_ut: [5.0, 6.0, 7.0],
        soft_iron: [1.1, 0.2, 0.0, 0.0, 0.9, 0.0, 0.3, 0.0, 1.0],
        ..MagnetometerSpec::default()
    };
    // Nose to the east: forward is east, left is north, up is -down.
    let attitude = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
    let input = input(still(attitude), None, [0.0, 0.0]);
    let sample = Magnetometer::new(&spec, 12, &input).unwrap().samples().next().unwrap();
    assert!((sample.true_mag_ut - DVec3::new(1.0, 20.0, -43.0)).length() < 1e-13);
    let expected = DVec3::new(1.1 + 4.0 + 5.0, 18.0 + 6.0, 0.3 - 43.0 + 7.0);
    assert!((sample.mag_ut - expected).length() < 1e-13, "{}", sample.mag_ut);
    for date in ["2035-01-01", "2026-02-30"] {
        let spec = MagnetometerSpec { field_ned_ut: None, date: Some(date.into()), ..spec.clone() };
        let input = SensorInput {
            earth: Earth::new(Some(local_frame()), HeightReference::Ellipsoid),
            ..input.clone()
        };
        let error = Magnetometer::new(&spec, 12, &input).unwrap_err().to_string();
        assert!(error.contains("magnetometer \"mag0\": the World Magnetic Model"), "{error}");
    }
}
