//! `NAME.toml`: what the sensor of a table is.

use std::path::Path;

use camsim_core::{
    scenario::{BarometerSpec, GnssSpec, ImuSpec, MagnetometerSpec},
    sensors::{Barometer, Gnss, Imu, Magnetometer, SensorInput, SensorMount},
};
use glam::{DMat3, DVec3};
use serde::Serialize;

use super::{Counts, MARK, WriteError, description_path, kalibr::KalibrFigures, write_atomic};

/// The keys of a sensor in the scenario.
#[derive(Serialize)]
#[serde(untagged)]
enum Spec<'a> {
    Imu(&'a ImuSpec),
    Gnss(&'a GnssSpec),
    Barometer(&'a BarometerSpec),
    Magnetometer(&'a MagnetometerSpec),
}

/// What is known of a sensor before its rows.
pub(super) struct Description<'a> {
    pub(super) name: &'a str,
    kind: &'static str,
    rate_hz: f64,
    mount: SensorMount,
    input: &'a SensorInput,
    matrices: Option<[DMat3; 2]>,
    noise: Option<KalibrFigures>,
    spec: Spec<'a>,
}

/// The file, in its order.
#[derive(Serialize)]
struct File<'a> {
    kind: &'static str,
    name: &'a str,
    table: String,
    rate_hz: f64,
    rows: u64,
    /// Rows before the first row of the log or after its last one, where the platform coasts.
    rows_outside_log: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    saturated_rows: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    rows_without_fix: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    first_t_ns: Option<i64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    last_t_ns: Option<i64>,
    /// Latitude, longitude (degrees) and height above the ellipsoid of the local frame's origin.
    #[serde(skip_serializing_if = "Option::is_none")]
    local_origin: Option<[f64; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    gravity_at_origin_m_s2: Option<f64>,
    #[serde(rename = "T_body_sensor")]
    body_from_sensor: [[f64; 4]; 4],
    /// reading = matrix x truth + ...
    #[serde(skip_serializing_if = "Option::is_none")]
    gyro_matrix: Option<[[f64; 3]; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    accel_matrix: Option<[[f64; 3]; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    noise: Option<KalibrFigures>,
    scenario: &'a Spec<'a>,
}

impl<'a> Description<'a> {
    pub(super) fn of_imu(imu: &'a Imu) -> Self {
        Self {
            name: &imu.spec.name,
            kind: "imu",
            rate_hz: imu.clock.rate_hz(),
            mount: imu.mount,
            input: imu.input(),
            matrices: Some(imu.matrices()),
            noise: Some(KalibrFigures::new(&imu.spec)),
            spec: Spec::Imu(&imu.spec),
        }
    }

    pub(super) fn of_gnss(gnss: &'a Gnss) -> Self {
        Self {
            name: &gnss.spec.name,
            kind: "gnss",
            rate_hz: gnss.clock.rate_hz(),
            mount: gnss.mount,
            input: gnss.input(),
            matrices: None,
            noise: None,
            spec: Spec::Gnss(&gnss.spec),
        }
    }

    pub(super) fn of_barometer(barometer: &'a Barometer) -> Self {
        Self {
            name: &barometer.spec.name,
            kind: "barometer",
            rate_hz: barometer.clock.rate_hz(),
            mount: barometer.mount,
            input: barometer.input(),
            matrices: None,
            noise: None,
            spec: Spec::Barometer(&barometer.spec),
        }
    }

    pub(super) fn of_magnetometer(magnetometer: &'a Magnetometer) -> Self {
        Self {
            name: &magnetometer.spec.name,
            kind: "magnetometer",
            rate_hz: magnetometer.clock.rate_hz(),
            mount: magnetometer.mount,
            input: magnetometer.input(),
            matrices: None,
            noise: None,
            spec: Spec::Magnetometer(&magnetometer.spec),
        }
    }

    pub(super) fn write(&self, folder: &Path, counts: &Counts) -> Result<(), WriteError> {
        let path = description_path(folder, self.name);
        let encode =
            |error: toml::ser::Error| WriteError::Encode { path: path.clone(), message: error.to_string() };
        let text = toml::to_string(&self.file(counts)).map_err(encode)?;
        let head = format!(
            "{MARK}the columns of {}.csv are defined in docs/guide/SENSORS.md. The body's axes are forward, \
             right, down;\n# T_body_sensor takes points of the sensor's axes to them. [scenario] has the \
             keys of the scenario.\n",
            self.name
        );
        write_atomic(&path, (head + &text).as_bytes())
    }

    fn file(&self, counts: &Counts) -> File<'_> {
        let [first_t_ns, last_t_ns] = [0, 1].map(|i| counts.stamps_ns.map(|stamps| stamps[i]));
        let mut earth = self.input.earth.clone();
        let origin = earth.origin().map(|at| [at.lat_deg(), at.lon_deg(), at.height_m]);
        let flagged_of = |kind: &str| (self.kind == kind).then_some(counts.flagged);
        let gravity = earth.gravity_ned_m_s2(DVec3::ZERO).length();
        let rows_of = |matrix: DMat3| [0, 1, 2].map(|row| matrix.row(row).to_array());
        let matrix = self.mount.body_from_sensor_matrix();
        File {
            kind: self.kind,
            name: self.name,
            table: format!("{}.csv", self.name),
            rate_hz: self.rate_hz,
            rows: counts.rows,
            rows_outside_log: counts.outside_log,
            saturated_rows: flagged_of("imu"),
            rows_without_fix: flagged_of("gnss"),
            first_t_ns,
            last_t_ns,
            local_origin: origin,
            gravity_at_origin_m_s2: (self.kind == "imu").then_some(gravity),
            body_from_sensor: [0, 1, 2, 3].map(|row| matrix.row(row).to_array()),
            gyro_matrix: self.matrices.map(|[gyro, _]| rows_of(gyro)),
            accel_matrix: self.matrices.map(|[_, accel]| rows_of(accel)),
            noise: self.noise,
            scenario: &self.spec,
        }
    }
}
