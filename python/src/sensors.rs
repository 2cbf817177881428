//! Samples of the sensors beside the camera, as columns.

use camsim::core::sensors::Sensors;
use pyo3::{prelude::*, types::PyDict};

use crate::{arrays::columns, error::input_error};

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
            columns(py, &py.detach(|| imu.samples().collect::<Vec<_>>()))
        }
        "gnss" => {
            let gnss = choose(&sensors.gnss, kind, name, |gnss| &gnss.spec.name)?;
            columns(py, &py.detach(|| gnss.samples().collect::<Vec<_>>()))
        }
        "barometer" => {
            let barometer = choose(&sensors.barometers, kind, name, |barometer| &barometer.spec.name)?;
            columns(py, &py.detach(|| barometer.samples().collect::<Vec<_>>()))
        }
        _ => {
            let magnetometer = choose(&sensors.magnetometers, kind, name, |sensor| &sensor.spec.name)?;
            columns(py, &py.detach(|| magnetometer.samples().collect::<Vec<_>>()))
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
