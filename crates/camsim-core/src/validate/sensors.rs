//! Checks of `[[imu]]`, `[[gnss]]`, `[[barometer]]` and `[[magnetometer]]`.

use super::{Check, names};
use crate::scenario::{GnssSpec, MagnetometerSpec, Scenario};

pub(super) fn check_sensors(check: &mut Check, scenario: &Scenario) {
    check_names(check, scenario);
    for (i, spec) in scenario.gnss.iter().enumerate() {
        check_gnss(check, &|leaf| format!("gnss.{i}.{leaf}"), spec);
    }
    for (i, spec) in scenario.magnetometer.iter().enumerate() {
        check_magnetometer(check, &|leaf| format!("magnetometer.{i}.{leaf}"), spec);
    }
}

/// Names are those of files, in one folder.
fn check_names(check: &mut Check, scenario: &Scenario) {
    let all: Vec<(&str, &str)> = scenario.sensor_names().collect();
    for (i, (kind, name)) in all.iter().enumerate() {
        let index = all[..i].iter().filter(|(other, _)| other == kind).count();
        let key = format!("{kind}.{index}.name");
        check.require(names::is_portable(name), key.as_str(), || {
            format!("is the name of files: {}, such as \"{kind}0\", not \"{name}\"", names::ADVICE)
        });
        let is_repeated = all[..i].iter().any(|(_, other)| other.eq_ignore_ascii_case(name));
        check.require(!is_repeated, key, || {
            format!("\"{name}\" names two sensors; give each a name of its own, as it names their files")
        });
    }
}

/// Full key of a leaf.
type Key<'a> = &'a dyn Fn(&str) -> String;

fn check_gnss(check: &mut Check, key: Key<'_>, spec: &GnssSpec) {
    for [from, to] in &spec.dropouts_s {
        check.require(from.is_finite() && to.is_finite() && from < to, key("dropouts_s"), || {
            format!("holds intervals [begin, end] with begin < end, in seconds from the first row of the log, not [{from}, {to}]")
        });
    }
    let both = (spec.dropout_every_s > 0.0) == (spec.dropout_mean_s > 0.0);
    check.require(both, key("dropout_every_s"), || {
        "and dropout_mean_s belong together: give the mean time between dropouts and their mean length, or \
         neither"
            .into()
    });
}

fn check_magnetometer(check: &mut Check, key: Key<'_>, spec: &MagnetometerSpec) {
    check.require(spec.field_ned_ut.is_some() != spec.date.is_some(), key("field_ned_ut"), || {
        "or date is needed, and not both: the field [north, east, down] in microtesla, or date = \
         \"YYYY-MM-DD\" for that of the World Magnetic Model"
            .into()
    });
    check.require(spec.date.is_none() || spec.year_month_day().is_some(), key("date"), || {
        format!("must be a date YYYY-MM-DD, not \"{}\"", spec.date.as_deref().unwrap_or_default())
    });
}

#[cfg(test)]
mod tests {
    use super::super::{tests::good, validate};
    use super::*;
    use crate::scenario::{BarometerSpec, ImuSpec, PerAxis};

    fn said(change: impl FnOnce(&mut Scenario)) -> Vec<String> {
        let mut scenario = good();
        let name = |name: &str| name.to_owned();
        scenario.imu = vec![ImuSpec { name: name("imu0"), ..ImuSpec::default() }];
        scenario.gnss = vec![GnssSpec { name: name("gnss0"), ..GnssSpec::default() }];
        scenario.barometer = vec![BarometerSpec { name: name("baro0"), ..BarometerSpec::default() }];
        scenario.magnetometer = vec![MagnetometerSpec {
            name: name("mag0"),
            field_ned_ut: Some([20.0, 1.0, 43.0]),
            ..MagnetometerSpec::default()
        }];
        change(&mut scenario);
        validate(&scenario).iter().map(ToString::to_string).collect()
    }

    #[test]
    fn sensors_are_checked_and_their_problems_named_by_key() {
        assert_eq!(said(|_| ()), Vec::<String>::new());
        type Change = fn(&mut Scenario);
        let cases: &[(Change, &str)] = &[
            (|s| s.imu[0].name = "a/b".into(), "imu.0.name: is the name of files"),
            (|s| s.imu[0].name.clear(), "imu.0.name: is the name of files"),
            (|s| s.magnetometer[0].name = "IMU0".into(), "magnetometer.0.name: \"IMU0\" names two"),
            (|s| s.imu[0].rate_hz = 0.0, "imu.0.rate_hz"),
            (|s| s.imu[0].rate_hz = f64::NAN, "imu.0.rate_hz"),
            (|s| s.imu[0].mount.offset_m[1] = f64::INFINITY, "imu.0.mount.offset_m"),
            (|s| s.imu[0].gyro.noise_density.0[2] = -1.0, "imu.0.gyro.noise_density"),
            (|s| s.imu[0].accel.scale = PerAxis::all(1.0), "imu.0.accel.scale"),
            (|s| s.imu[0].accel.drift_tau_s = 0.0, "imu.0.accel.drift_tau_s"),
            (|s| s.imu[0].gyro.misalignment_deg[3] = 90.0, "imu.0.gyro.misalignment_deg"),
            (|s| s.imu[0].jitter_ms = -0.1, "imu.0.jitter_ms"),
            (|s| s.gnss[0].dropouts_s = vec![[2.0, 1.0]], "gnss.0.dropouts_s"),
            (|s| s.gnss[0].dropout_mean_s = 1.0, "gnss.0.dropout_every_s: and dropout_mean_s"),
            (|s| s.gnss[0].delay_ms = -1.0, "gnss.0.delay_ms"),
            (|s| s.gnss[0].sigma_m[0] = -1.0, "gnss.0.sigma_m"),
            (|s| s.barometer[0].sea_level_pa = 1013.25 / 10.0, "barometer.0.sea_level_pa"),
            (|s| s.magnetometer[0].date = Some("2026-11-27".into()), "magnetometer.0.field_ned_ut: or date"),
            (|s| s.magnetometer[0].soft_iron[8] = f64::NAN, "magnetometer.0.soft_iron"),
        ];
        for (change, wanted) in cases {
            let said = said(change);
            assert!(said.len() == 1 && said[0].starts_with(wanted), "{wanted}: {said:?}");
        }
        for date in ["2026-13-01", "2026-1-01", "26-01-01", "2026-01-01-01", "+026-01-01", ""] {
            let said = said(|s| {
                (s.magnetometer[0].field_ned_ut, s.magnetometer[0].date) = (None, Some(date.into()));
            });
            assert!(said.len() == 1 && said[0].starts_with("magnetometer.0.date"), "{date}: {said:?}");
        }
    }
}
