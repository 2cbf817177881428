//! The sensors beside the camera.

use camsim_core::{
    scenario::SensorCarrier,
    sensors::{SampleClock, Sensors},
};
use serde::Serialize;

use crate::{console::Console, failure::Failure};

/// A sensor in the report.
#[derive(Serialize)]
pub(super) struct SensorFacts<'a> {
    kind: &'static str,
    name: &'a str,
    rate_hz: f64,
    samples: u64,
    /// In body axes; an imu on the camera shakes about this position.
    offset_m: [f64; 3],
    /// Whether it is part of the camera, with its vibration.
    is_on_camera: bool,
}

/// Every sensor, in the order of the file's tables.
pub(super) fn facts(sensors: &Sensors) -> Vec<SensorFacts<'_>> {
    let fact = |kind, name, clock: &SampleClock, offset_m| SensorFacts {
        kind,
        name,
        rate_hz: clock.rate_hz(),
        samples: clock.count(),
        offset_m,
        is_on_camera: false,
    };
    let Sensors { imus, gnss, barometers, magnetometers } = sensors;
    let imus = imus.iter().map(|imu| SensorFacts {
        is_on_camera: imu.spec.attached_to == SensorCarrier::Camera,
        ..fact("imu", &imu.spec.name, &imu.clock, imu.spec.mount.offset_m)
    });
    let gnss = gnss.iter().map(|gnss| fact("gnss", &gnss.spec.name, &gnss.clock, gnss.spec.offset_m));
    let barometers =
        barometers.iter().map(|it| fact("barometer", &it.spec.name, &it.clock, it.spec.offset_m));
    let magnetometers =
        magnetometers.iter().map(|it| fact("magnetometer", &it.spec.name, &it.clock, it.spec.mount.offset_m));
    imus.chain(gnss).chain(barometers).chain(magnetometers).collect()
}

/// Prints them.
pub(super) fn print(sensors: &[SensorFacts<'_>], console: &mut Console<'_>) -> Result<(), Failure> {
    if !sensors.is_empty() {
        console.line("sensors")?;
    }
    for SensorFacts { kind, name, rate_hz, samples, offset_m: [x, y, z], is_on_camera } in sensors {
        let on = if *is_on_camera { "camera" } else { "body" };
        console.line(format_args!(
            "  {kind} {name}: {rate_hz} Hz, {samples} samples, on the {on} at {x}, {y}, {z} m"
        ))?;
    }
    Ok(())
}
