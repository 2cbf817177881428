//! Inertial sensors of a run, as exports need them.

use std::path::PathBuf;

use camsim_core::scenario::SensorCarrier;
use glam::{DMat3, DQuat, DVec3};
use serde::Deserialize;

use super::{
    DatasetError, RunCamera, RunFolder,
    axes::{Rigid, flu_from_frd},
    csv_rows::CsvRows,
    run_folder::PlatformRows,
};
use crate::calibration::ImuReference;

/// An inertial sensor, with a table of its measurements.
#[derive(Clone, Debug)]
pub(super) struct ImuSensor {
    /// Its table.
    pub(super) path: PathBuf,
    /// Rows per second.
    pub(super) rate_hz: f64,
    /// Its axes in the body (forward, right, down), without vibration.
    pub(super) body_from_imu: Rigid,
    /// Whether it is on a camera that shakes against the body.
    pub(super) shakes: bool,
    /// How much its clock is ahead of the platform's.
    pub(super) clock_offset_s: f64,
    /// Noise densities and bias random walks, as Kalibr defines them: rad/s/sqrt(Hz), rad/s^2/sqrt(Hz),
    /// m/s^2/sqrt(Hz), m/s^3/sqrt(Hz).
    pub(super) gyro_noise: f64,
    pub(super) gyro_walk: f64,
    pub(super) acc_noise: f64,
    pub(super) acc_walk: f64,
}

/// One measurement, with the true biases.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ImuRow {
    pub(super) t_ns: i64,
    pub(super) gyro_rad_s: DVec3,
    pub(super) acc_m_s2: DVec3,
    pub(super) gyro_bias_rad_s: DVec3,
    pub(super) acc_bias_m_s2: DVec3,
}

/// A sensor's description, `sensors/NAME.toml`.
#[derive(Clone, Debug, Deserialize)]
pub(super) struct SensorDescription {
    pub(super) kind: String,
    /// Its table; as read, relative to the folder.
    pub(super) table: PathBuf,
    rate_hz: f64,
    #[serde(rename = "T_body_sensor")]
    body_from_sensor: [[f64; 4]; 4],
    #[serde(default)]
    noise: Noise,
    #[serde(default)]
    scenario: SensorKeys,
}

/// Continuous-time densities of the worst axis.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
struct Noise {
    gyroscope_noise_density: f64,
    gyroscope_random_walk: f64,
    accelerometer_noise_density: f64,
    accelerometer_random_walk: f64,
}

/// Keys of the scenario.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
struct SensorKeys {
    #[serde(default)]
    clock_offset_ms: f64,
    #[serde(default)]
    attached_to: SensorCarrier,
}

/// The sensors of a run by their names.
pub(super) fn descriptions(run: &RunFolder) -> Result<Vec<SensorDescription>, DatasetError> {
    let folder = run.path.join("sensors");
    let Ok(entries) = std::fs::read_dir(&folder) else { return Ok(Vec::new()) };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    paths.sort();
    let read = |path: &PathBuf| {
        let fail = |message: String| DatasetError::Input { path: path.clone(), message };
        let text = std::fs::read_to_string(path).map_err(|error| fail(format!("cannot be read: {error}")))?;
        let mut sensor: SensorDescription = toml::from_str(&text).map_err(|error| fail(error.to_string()))?;
        sensor.table = folder.join(&sensor.table);
        Ok(sensor)
    };
    paths.iter().map(read).collect()
}

/// The inertial sensors of a run.
pub(super) fn imus(run: &RunFolder) -> Result<Vec<ImuSensor>, DatasetError> {
    let inertial = descriptions(run)?.into_iter().filter(|sensor| sensor.kind == "imu");
    Ok(inertial
        .map(|sensor| {
            let m = sensor.body_from_sensor;
            let column = |k: usize| DVec3::new(m[0][k], m[1][k], m[2][k]);
            let axes = DMat3::from_cols(column(0), column(1), column(2));
            let noise = sensor.noise;
            ImuSensor {
                path: sensor.table,
                rate_hz: sensor.rate_hz,
                body_from_imu: Rigid {
                    rotation: DQuat::from_mat3(&axes).normalize(),
                    translation_m: column(3),
                },
                shakes: sensor.scenario.attached_to == SensorCarrier::Camera && run.cameras[0].vibrates(),
                clock_offset_s: 1e-3 * sensor.scenario.clock_offset_ms,
                gyro_noise: noise.gyroscope_noise_density,
                gyro_walk: noise.gyroscope_random_walk,
                acc_noise: noise.accelerometer_noise_density,
                acc_walk: noise.accelerometer_random_walk,
            }
        })
        .collect())
}

/// Axes of the body B of EuRoC and others: those of the first inertial sensor, else the platform's, x forward, y
/// left, z up.
pub(super) fn body_from_b(imu: Option<&ImuSensor>) -> Rigid {
    imu.map_or_else(|| Rigid::turn(flu_from_frd()), |imu| imu.body_from_imu)
}

/// Columns of its table: time, gyroscope, accelerometer, their biases.
const COLUMNS: [&str; 13] = [
    "t_ns",
    "gyro_x_rad_s",
    "gyro_y_rad_s",
    "gyro_z_rad_s",
    "accel_x_m_s2",
    "accel_y_m_s2",
    "accel_z_m_s2",
    "gyro_bias_x_rad_s",
    "gyro_bias_y_rad_s",
    "gyro_bias_z_rad_s",
    "accel_bias_x_m_s2",
    "accel_bias_y_m_s2",
    "accel_bias_z_m_s2",
];

impl ImuSensor {
    /// Its measurements, row by row.
    pub(super) fn rows(&self) -> Result<ImuRows, DatasetError> {
        Ok(ImuRows(CsvRows::open(&self.path, &COLUMNS)?))
    }

    /// Its axes and clock.
    pub(super) fn reference(&self) -> ImuReference {
        ImuReference { body_from_imu: self.body_from_imu, clock_offset_s: self.clock_offset_s }
    }

    /// Its own motion, in its own axes.
    pub(super) fn states(&self) -> Result<PlatformRows, DatasetError> {
        PlatformRows::of_sensor(&self.path)
    }

    /// What is added to stamps of a camera to get the sensor's time of the image's centre, seconds.
    pub(super) fn shift_s(&self, camera: &RunCamera) -> f64 {
        camera.stamp_to_centre_s() + self.clock_offset_s
    }

    /// Its true biases.
    pub(super) fn biases(&self) -> Result<Biases, DatasetError> {
        let mut rows = self.rows()?;
        let first = rows.next_row()?.unwrap_or_default();
        Ok(Biases { next: rows.next_row()?, rows, last: first })
    }

    /// A note if it begins after the first picture.
    pub(super) fn begins_late(&self, run: &RunFolder) -> Option<String> {
        let first_ns = self.rows().ok()?.next_row().ok()??.t_ns;
        let pictures = run.cameras.iter().filter_map(|camera| camera.frames.first());
        let picture_ns = pictures.map(|frame| frame.stamp_ns).min()?;
        (first_ns > picture_ns).then(|| {
            format!(
                "the IMU begins {} ms after the first picture, and ORB-SLAM3 and others want it before",
                (first_ns - picture_ns) as f64 * 1e-6
            )
        })
    }
}

/// Rows of a sensor's table.
pub(super) struct ImuRows(CsvRows);

impl ImuRows {
    /// The next one; `None` at the end.
    pub(super) fn next_row(&mut self) -> Result<Option<ImuRow>, DatasetError> {
        let rows = &mut self.0;
        if !rows.advance()? {
            return Ok(None);
        }
        Ok(Some(ImuRow {
            t_ns: rows.whole(0)?,
            gyro_rad_s: rows.vector(1)?,
            acc_m_s2: rows.vector(4)?,
            gyro_bias_rad_s: rows.vector(7)?,
            acc_bias_m_s2: rows.vector(10)?,
        }))
    }
}

/// Biases of an inertial sensor over time, read once.
pub(super) struct Biases {
    rows: ImuRows,
    last: ImuRow,
    next: Option<ImuRow>,
}

impl Biases {
    /// Biases of gyroscope, rad/s, and accelerometer, m/s^2, linear between rows; instants must ascend.
    pub(super) fn at(&mut self, t_ns: i64) -> Result<[DVec3; 2], DatasetError> {
        while let Some(next) = self.next.filter(|next| next.t_ns <= t_ns) {
            self.last = next;
            self.next = self.rows.next_row()?;
        }
        let share = match &self.next {
            Some(next) if t_ns > self.last.t_ns => {
                (t_ns - self.last.t_ns) as f64 / (next.t_ns - self.last.t_ns) as f64
            }
            _ => 0.0,
        };
        let next = self.next.as_ref().unwrap_or(&self.last);
        Ok([
            self.last.gyro_bias_rad_s.lerp(next.gyro_bias_rad_s, share),
            self.last.acc_bias_m_s2.lerp(next.acc_bias_m_s2, share),
        ])
    }
}
