//! Samples of the sensors beside the camera, as columns.

use camsim::core::sensors::{
    BarometerSample, Fix, GnssSample, ImuSample, MagnetometerSample, SampleTime, Sensors,
};
use pyo3::{prelude::*, types::PyDict};

use crate::{
    arrays::{column, quaternions, vectors},
    error::input_error,
};

/// Columns of the samples of a sensor: `kind` is its table in a scenario, `name` one of several.
pub fn samples<'py>(
    py: Python<'py>,
    sensors: &Sensors,
    kind: &str,
    name: Option<&str>,
) -> PyResult<Bound<'py, PyDict>> {
    match kind {
        "imu" => {
            let imu = choose(&sensors.imus, kind, name, |imu| &imu.spec.name)?;
            imu_columns(py, &py.detach(|| imu.samples().collect::<Vec<_>>()))
        }
        "gnss" => {
            let gnss = choose(&sensors.gnss, kind, name, |gnss| &gnss.spec.name)?;
            gnss_columns(py, &py.detach(|| gnss.samples().collect::<Vec<_>>()))
        }
        "barometer" => {
            let barometer = choose(&sensors.barometers, kind, name, |barometer| &barometer.spec.name)?;
            barometer_columns(py, &py.detach(|| barometer.samples().collect::<Vec<_>>()))
        }
        _ => {
            let magnetometer = choose(&sensors.magnetometers, kind, name, |sensor| &sensor.spec.name)?;
            magnetometer_columns(py, &py.detach(|| magnetometer.samples().collect::<Vec<_>>()))
        }
    }
}

/// The sensor of a name, or the only one.
fn choose<'a, T>(
    sensors: &'a [T],
    kind: &str,
    name: Option<&str>,
    name_of: impl Fn(&T) -> &String,
) -> PyResult<&'a T> {
    let names = || sensors.iter().map(|sensor| name_of(sensor).as_str()).collect::<Vec<_>>().join(", ");
    let found = match (name, sensors) {
        (None, [only]) => Some(only),
        (None, _) => None,
        (Some(name), _) => sensors.iter().find(|sensor| name_of(sensor) == name),
    };
    found.ok_or_else(|| {
        input_error(match (name, sensors) {
            (_, []) => format!("the scenario has no [[{kind}]]"),
            (None, _) => format!("the scenario has several [[{kind}]]: name one of {}", names()),
            (Some(name), _) => format!("[[{kind}]] {name:?}: there is no such sensor; there are {}", names()),
        })
    })
}

fn times<'py, T>(
    py: Python<'py>,
    samples: &[T],
    time: impl Fn(&T) -> &SampleTime,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    dict.set_item("t_ns", column(py, samples, |sample| time(sample).stamp_ns))?;
    dict.set_item("t_true_ns", column(py, samples, |sample| time(sample).true_ns))?;
    Ok(dict)
}

fn imu_columns<'py>(py: Python<'py>, samples: &[ImuSample]) -> PyResult<Bound<'py, PyDict>> {
    let dict = times(py, samples, |sample| &sample.time)?;
    dict.set_item("gyro_rad_s", vectors(py, samples, |sample| sample.gyro_rad_s)?)?;
    dict.set_item("accel_m_s2", vectors(py, samples, |sample| sample.accel_m_s2)?)?;
    dict.set_item("true_gyro_rad_s", vectors(py, samples, |sample| sample.true_gyro_rad_s)?)?;
    dict.set_item("true_accel_m_s2", vectors(py, samples, |sample| sample.true_accel_m_s2)?)?;
    dict.set_item("gyro_bias_rad_s", vectors(py, samples, |sample| sample.gyro_bias_rad_s)?)?;
    dict.set_item("accel_bias_m_s2", vectors(py, samples, |sample| sample.accel_bias_m_s2)?)?;
    dict.set_item("position_ned_m", vectors(py, samples, |sample| sample.position_ned_m)?)?;
    dict.set_item("velocity_ned_m_s", vectors(py, samples, |sample| sample.velocity_ned_m_s)?)?;
    dict.set_item("ned_from_sensor_wxyz", quaternions(py, samples, |sample| sample.ned_from_sensor)?)?;
    dict.set_item("is_saturated", column(py, samples, |sample| sample.is_saturated))?;
    Ok(dict)
}

/// Columns of a fix, with `prefix` before their names.
fn add_fix<'py>(
    dict: &Bound<'py, PyDict>,
    samples: &[GnssSample],
    prefix: &str,
    fix: impl Fn(&GnssSample) -> Option<&Fix>,
) -> PyResult<()> {
    let py = dict.py();
    let number =
        |part: &dyn Fn(&Fix) -> f64| column(py, samples, |sample| fix(sample).map_or(f64::NAN, part));
    dict.set_item(format!("{prefix}lat_deg"), number(&|fix| fix.at.lat_deg()))?;
    dict.set_item(format!("{prefix}lon_deg"), number(&|fix| fix.at.lon_deg()))?;
    dict.set_item(format!("{prefix}height_m"), number(&|fix| fix.at.height_m))?;
    dict.set_item(format!("{prefix}msl_m"), number(&|fix| fix.msl_m))?;
    let nan = glam::DVec3::NAN;
    let position = vectors(py, samples, |sample| fix(sample).map_or(nan, |fix| fix.position_ned_m))?;
    dict.set_item(format!("{prefix}position_ned_m"), position)?;
    let velocity = vectors(py, samples, |sample| fix(sample).map_or(nan, |fix| fix.velocity_ned_m_s))?;
    dict.set_item(format!("{prefix}velocity_ned_m_s"), velocity)
}

fn gnss_columns<'py>(py: Python<'py>, samples: &[GnssSample]) -> PyResult<Bound<'py, PyDict>> {
    let dict = times(py, samples, |sample| &sample.time)?;
    dict.set_item("t_available_ns", column(py, samples, |sample| sample.available_ns))?;
    dict.set_item("has_fix", column(py, samples, |sample| sample.fix.is_some()))?;
    add_fix(&dict, samples, "", |sample| sample.fix.as_ref())?;
    add_fix(&dict, samples, "true_", |sample| Some(&sample.truth))?;
    Ok(dict)
}

fn barometer_columns<'py>(py: Python<'py>, samples: &[BarometerSample]) -> PyResult<Bound<'py, PyDict>> {
    let dict = times(py, samples, |sample| &sample.time)?;
    dict.set_item("pressure_pa", column(py, samples, |sample| sample.pressure_pa))?;
    dict.set_item("altitude_m", column(py, samples, |sample| sample.altitude_m))?;
    dict.set_item("true_pressure_pa", column(py, samples, |sample| sample.true_pressure_pa))?;
    dict.set_item("true_msl_m", column(py, samples, |sample| sample.true_msl_m))?;
    dict.set_item("bias_pa", column(py, samples, |sample| sample.bias_pa))?;
    Ok(dict)
}

fn magnetometer_columns<'py>(
    py: Python<'py>,
    samples: &[MagnetometerSample],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = times(py, samples, |sample| &sample.time)?;
    dict.set_item("mag_ut", vectors(py, samples, |sample| sample.mag_ut)?)?;
    dict.set_item("true_mag_ut", vectors(py, samples, |sample| sample.true_mag_ut)?)?;
    dict.set_item("field_ned_ut", vectors(py, samples, |sample| sample.field_ned_ut)?)?;
    Ok(dict)
}
