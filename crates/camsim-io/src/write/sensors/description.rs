//! `NAME.toml`: what the sensor of a table is.

use std::path::{Path, PathBuf};

use camsim_core::{
    scenario::{BarometerSpec, GnssSpec, ImuSpec, MagnetometerSpec},
    sensors::{GnssSample, ImuSample, SensorInput, SensorMount, Sensors},
};
use glam::{DMat3, DVec3};
use serde::{Deserialize, Serialize};

use super::{
    Counts, MARK, WriteError, description_path,
    kalibr::{KalibrFigures, kalibr_yaml},
    write_atomic, write_table,
};

/// The keys of a sensor in the scenario.
#[derive(Clone, Copy, Serialize)]
#[serde(untagged)]
enum Spec<'a> {
    Imu(&'a ImuSpec),
    Gnss(&'a GnssSpec),
    Barometer(&'a BarometerSpec),
    Magnetometer(&'a MagnetometerSpec),
}

/// Writes the table of a sensor to a path.
type WriteTable<'a> = Box<dyn Fn(&Path) -> Result<Counts, WriteError> + 'a>;

/// What is known of a sensor before its rows, and its rows.
pub(super) struct Description<'a> {
    pub(super) name: &'a str,
    kind: &'static str,
    rate_hz: f64,
    mount: SensorMount,
    input: &'a SensorInput,
    matrices: Option<[DMat3; 2]>,
    noise: Option<KalibrFigures>,
    spec: Spec<'a>,
    pub(super) write_table: WriteTable<'a>,
}

/// The file, in its order; exports read it, with those of its keys in the scenario that they need.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(crate) struct SensorFile<S> {
    pub(crate) kind: String,
    name: String,
    /// Its table, relative to the folder.
    pub(crate) table: PathBuf,
    pub(crate) rate_hz: f64,
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
    pub(crate) gravity_at_origin_m_s2: Option<f64>,
    #[serde(rename = "T_body_sensor")]
    pub(crate) body_from_sensor: [[f64; 4]; 4],
    /// reading = matrix x truth + ...
    #[serde(skip_serializing_if = "Option::is_none")]
    gyro_matrix: Option<[[f64; 3]; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    accel_matrix: Option<[[f64; 3]; 3]>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(crate) noise: Option<KalibrFigures>,
    pub(crate) scenario: S,
}

impl<'a> Description<'a> {
    /// The descriptions of all sensors.
    pub(super) fn of_all(sensors: &'a Sensors) -> Vec<Self> {
        macro_rules! described {
            ($list:ident, $kind:literal, $spec:ident, $is_flagged:expr) => {
                sensors.$list.iter().map(|one| Self {
                    name: &one.spec.name,
                    kind: $kind,
                    rate_hz: one.clock.rate_hz(),
                    mount: one.mount,
                    input: &one.input,
                    matrices: None,
                    noise: None,
                    spec: Spec::$spec(&one.spec),
                    write_table: Box::new(move |path| {
                        write_table(path, &one.input, one.samples(), |row| (row.time, $is_flagged(row)))
                    }),
                })
            };
        }
        let imus = described!(imus, "imu", Imu, |row: &ImuSample| row.is_saturated);
        let imus = sensors.imus.iter().zip(imus).map(|(imu, description)| Self {
            matrices: Some(imu.matrices()),
            noise: Some(KalibrFigures::new(&imu.spec)),
            ..description
        });
        let gnss = described!(gnss, "gnss", Gnss, |row: &GnssSample| row.fix.is_none());
        let barometers = described!(barometers, "barometer", Barometer, |_| false);
        let magnetometers = described!(magnetometers, "magnetometer", Magnetometer, |_| false);
        imus.chain(gnss).chain(barometers).chain(magnetometers).collect()
    }

    /// Writes the description, and of an inertial unit Kalibr's.
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
        if let Spec::Imu(spec) = self.spec {
            let path = folder.join(format!("{}_kalibr.yaml", self.name));
            write_atomic(&path, kalibr_yaml(spec).as_bytes())?;
        }
        write_atomic(&path, (head + &text).as_bytes())
    }

    fn file(&self, counts: &Counts) -> SensorFile<Spec<'_>> {
        let [first_t_ns, last_t_ns] = [0, 1].map(|i| counts.stamps_ns.map(|stamps| stamps[i]));
        let mut earth = self.input.earth.clone();
        let origin = earth.origin().map(|at| [at.lat_deg(), at.lon_deg(), at.height_m]);
        let flagged_of = |kind: &str| (self.kind == kind).then_some(counts.flagged);
        let gravity = earth.gravity_ned_m_s2(DVec3::ZERO).length();
        let rows_of = |matrix: DMat3| [0, 1, 2].map(|row| matrix.row(row).to_array());
        let matrix = self.mount.body_from_sensor_matrix();
        SensorFile {
            kind: self.kind.to_owned(),
            name: self.name.to_owned(),
            table: format!("{}.csv", self.name).into(),
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
            scenario: self.spec,
        }
    }
}
