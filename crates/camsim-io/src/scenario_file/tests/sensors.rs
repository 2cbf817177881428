//! `[[imu]]`, `[[gnss]]`, `[[barometer]]`, `[[magnetometer]]`.

use camsim_core::scenario::{PerAxis, SensorAxes};

use super::*;

#[test]
fn sensors_are_read_and_their_problems_named_by_line() {
    let text = format!(
        "{GOOD}[[imu]]\nname = \"imu0\"\ngyro = {{ noise_density = 1.7e-4 }}\naccel = {{ random_walk = 3e-3 }}\n\
        [[gnss]]\nname = \"gnss0\"\ndropouts_s = [[12.0, 15.0]]\n[[barometer]]\nname = \"baro0\"\n\
        [[magnetometer]]\nname = \"mag0\"\ndate = \"2026-11-27\"\n"
    );
    let scenario = parse(&text).unwrap();
    let names: Vec<(&str, &str)> = scenario.sensor_names().collect();
    assert_eq!(names, [("imu", "imu0"), ("gnss", "gnss0"), ("barometer", "baro0"), ("magnetometer", "mag0")]);
    let imu = &scenario.imu[0];
    assert_eq!((imu.gyro.noise_density, imu.accel.random_walk), (PerAxis::all(1.7e-4), PerAxis::all(3e-3)));
    assert_eq!(scenario.gnss[0].dropouts_s, [[12.0, 15.0]]);
    let saved = toml::to_string(&scenario).unwrap();
    assert_eq!(parse_scenario(&saved, Path::new("s.toml"), &[]).unwrap(), scenario);

    let with = |keys: &str| parse(&format!("{GOOD}[[imu]]\nname = \"a\"\n{keys}\n"));
    let spec =
        &with("axes = \"flu\"\ngyro.scale = [1e-3, 0, -1e-3]\naccel = { range = 160 }").unwrap().imu[0];
    assert_eq!((spec.axes, spec.gyro.scale), (SensorAxes::Flu, PerAxis([1e-3, 0.0, -1e-3])));
    assert_eq!(spec.accel.range, PerAxis::all(160.0));
    for (keys, wanted) in [
        ("rate = 200", "s.toml:8: imu.0.rate: unknown key; did you mean `imu.rate_hz`?"),
        (
            "gyro.noise_density = [1, 2]",
            "s.toml:8: imu.0.gyro.noise_density: expected a number or a list of 3",
        ),
        ("gyro.noise_density = -1", "s.toml:8: imu.0.gyro.noise_density: must be a finite number, 0 or more"),
        (
            "clock_offset_ms = -5e12",
            "imu.0.clock_offset_ms: must be -4e12 to 4e12, not -5000000000000; it is",
        ),
        ("axes = \"fru\"", "imu.0.axes: expected one of \"frd\", \"flu\", \"rdf\""),
        ("[[imu]]", "s.toml:8: imu.1.name: is missing"),
        ("[[gnss]]\nname = \"A\"", "s.toml:9: gnss.0.name: \"A\" names two sensors"),
        ("[[magnetometer]]\nname = \"m\"", "s.toml:8: magnetometer.0.field_ned_ut: or date is needed"),
    ] {
        let error = with(keys).unwrap_err().to_string();
        assert!(error.contains(wanted), "{error}");
    }
}

#[test]
fn elements_of_lists_are_changed_by_name() {
    let text = format!("{GOOD}[[imu]]\nname = \"a\"\n[[imu]]\nname = \"b\"\n");
    let set = |key: &str| {
        let sets = [(key.to_owned(), "100".to_owned())];
        parse_scenario(&text, Path::new("dir/s.toml"), &sets)
    };
    for key in ["imu.b.rate_hz", "imu.1.rate_hz"] {
        let rates: Vec<f64> = set(key).unwrap().imu.iter().map(|imu| imu.rate_hz).collect();
        assert_eq!(rates, [200.0, 100.0], "{key}");
    }
    let error = set("imu.c.rate_hz").unwrap_err().to_string();
    assert!(
        error.contains("there is no `c` in [[imu]], which has a, b; name one, or its number from 0"),
        "{error}"
    );
}
