//! Inertial sensors of a run, as exports need them.

use std::path::PathBuf;

use camsim_core::{pose::FLU_FROM_FRD, scenario::SensorCarrier, sensors::ImuSample};
use glam::{DMat3, DQuat, DVec3};
use serde::Deserialize;

use super::csv_rows::CsvRows;
use super::run_folder::PlatformRows;
use super::{DatasetError, RunCamera, RunFolder};
use crate::columns::{T_NS, T_TRUE_NS};
use crate::formats::axes::Rigid;
use crate::formats::writing::ImuReference;
use crate::write::SensorFile;
use crate::write::{KalibrFigures, SENSORS_FOLDER};

/// An inertial sensor, with a table of its measurements.
#[derive(Clone, Debug)]
pub(crate) struct ImuSensor {
    /// Its table.
    pub(crate) path: PathBuf,
    /// Rows per second.
    pub(crate) rate_hz: f64,
    /// Its axes in the body (forward, right, down), without vibration.
    pub(crate) body_from_imu: Rigid,
    /// Whether it is on a camera that shakes against the body.
    pub(crate) shakes: bool,
    /// How much its clock is ahead of the platform's.
    pub(crate) clock_offset_s: f64,
    /// Noise densities and bias random walks.
    pub(crate) noise: KalibrFigures,
    /// Gravity at the run's origin, m/s^2.
    pub(crate) gravity_m_s2: f64,
    /// What is added to its stamps.
    shift_ns: i64,
}

/// Gravity where a run does not say it (ISO 80000-3), m/s^2.
const STANDARD_GRAVITY: f64 = 9.806_65;

/// What estimators get for a figure that is 0: those of the ADIS16448 in the EuRoC data, as a filter cannot work with
/// none.
const USUAL_NOISE: KalibrFigures = KalibrFigures {
    gyroscope_noise_density: 1.6968e-4,
    gyroscope_random_walk: 1.9393e-5,
    accelerometer_noise_density: 2e-3,
    accelerometer_random_walk: 3e-3,
};

/// One measurement, with the true biases.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ImuRow {
    pub(crate) t_ns: i64,
    /// True time on the run's clock.
    pub(crate) true_ns: i64,
    pub(crate) gyro_rad_s: DVec3,
    pub(crate) acc_m_s2: DVec3,
    pub(crate) gyro_bias_rad_s: DVec3,
    pub(crate) acc_bias_m_s2: DVec3,
}

/// A sensor's description, with the path of its table.
pub(crate) type SensorDescription = SensorFile<SensorKeys>;

/// Keys of the scenario.
#[derive(Clone, Copy, Debug, Default, Deserialize)]
#[serde(default)]
pub(crate) struct SensorKeys {
    clock_offset_ms: f64,
    attached_to: SensorCarrier,
}

impl SensorDescription {
    /// Its axes in the body (forward, right, down).
    pub(crate) fn body_from_sensor(&self) -> Rigid {
        let m = self.body_from_sensor;
        let column = |k: usize| DVec3::new(m[0][k], m[1][k], m[2][k]);
        let axes = DMat3::from_cols(column(0), column(1), column(2));
        Rigid { rotation: DQuat::from_mat3(&axes).normalize(), translation_m: column(3) }
    }
}

/// The sensors of a run in the order of its scenario.
pub(crate) fn descriptions(run: &RunFolder) -> Result<Vec<SensorDescription>, DatasetError> {
    let folder = run.shared_folder().join(SENSORS_FOLDER);
    let Ok(entries) = std::fs::read_dir(&folder) else { return Ok(Vec::new()) };
    let mut paths: Vec<PathBuf> = entries.flatten().map(|entry| entry.path()).collect();
    paths.retain(|path| path.extension().is_some_and(|ending| ending == "toml"));
    let scenario = &run.manifest().scenario;
    let names: Vec<&str> = (scenario.imu.iter().map(|imu| imu.name.as_str()))
        .chain(scenario.gnss.iter().map(|gnss| gnss.name.as_str()))
        .collect();
    let rank = |path: &PathBuf| {
        let stem = path.file_stem().map(|stem| stem.to_string_lossy().into_owned()).unwrap_or_default();
        (names.iter().position(|name| *name == stem).unwrap_or(names.len()), stem)
    };
    paths.sort_by_cached_key(rank);
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
pub(crate) fn imus(run: &RunFolder) -> Result<Vec<ImuSensor>, DatasetError> {
    let inertial = descriptions(run)?.into_iter().filter(|sensor| sensor.kind == "imu");
    Ok(inertial
        .map(|sensor| ImuSensor {
            body_from_imu: sensor.body_from_sensor(),
            rate_hz: sensor.rate_hz,
            shakes: sensor.scenario.attached_to == SensorCarrier::Camera && run.cameras[0].vibrates(),
            clock_offset_s: 1e-3 * sensor.scenario.clock_offset_ms,
            noise: sensor.noise.unwrap_or_default(),
            gravity_m_s2: sensor.gravity_at_origin_m_s2.unwrap_or(STANDARD_GRAVITY),
            shift_ns: run.shift_ns(),
            path: sensor.table,
        })
        .collect())
}

/// Axes of the body B of EuRoC and others: those of the first inertial sensor, else the platform's, x forward, y
/// left, z up.
pub(crate) fn body_from_b(imu: Option<&ImuSensor>) -> Rigid {
    imu.map_or_else(|| Rigid::turn(FLU_FROM_FRD), |imu| imu.body_from_imu)
}

/// Columns of its table that are read, as fields of a row.
const COLUMNS: [&str; 6] =
    [T_NS, T_TRUE_NS, "gyro_rad_s", "accel_m_s2", "gyro_bias_rad_s", "accel_bias_m_s2"];

impl ImuSensor {
    /// Its measurements, row by row.
    pub(crate) fn rows(&self) -> Result<ImuRows, DatasetError> {
        Ok(ImuRows { rows: CsvRows::open::<ImuSample>(&self.path, &COLUMNS)?, shift_ns: self.shift_ns })
    }

    /// Its noise for estimators, none of it 0, and the names of the figures that are 0 in truth.
    pub(crate) fn noise_for_filters(&self) -> (KalibrFigures, Vec<&'static str>) {
        let (mut noise, mut lifted) = (self.noise, Vec::new());
        let KalibrFigures {
            gyroscope_noise_density,
            gyroscope_random_walk,
            accelerometer_noise_density,
            accelerometer_random_walk,
        } = &mut noise;
        for (value, usual, name) in [
            (gyroscope_noise_density, USUAL_NOISE.gyroscope_noise_density, "gyroscope noise"),
            (gyroscope_random_walk, USUAL_NOISE.gyroscope_random_walk, "gyroscope walk"),
            (accelerometer_noise_density, USUAL_NOISE.accelerometer_noise_density, "accelerometer noise"),
            (accelerometer_random_walk, USUAL_NOISE.accelerometer_random_walk, "accelerometer walk"),
        ] {
            if *value <= 0.0 {
                *value = usual;
                lifted.push(name);
            }
        }
        (noise, lifted)
    }

    /// How much its clock is ahead of the run's, nanoseconds.
    pub(crate) fn clock_offset_ns(&self) -> i64 {
        (1e9 * self.clock_offset_s).round() as i64
    }

    /// Its axes and clock.
    pub(crate) fn reference(&self) -> ImuReference {
        ImuReference { body_from_imu: self.body_from_imu, clock_offset_s: self.clock_offset_s }
    }

    /// Its own motion, in its own axes.
    pub(crate) fn states(&self) -> Result<PlatformRows, DatasetError> {
        PlatformRows::of_sensor(&self.path, self.shift_ns)
    }

    /// What is added to stamps of a camera to get the sensor's time of the image's centre, seconds.
    pub(crate) fn shift_s(&self, camera: &RunCamera) -> f64 {
        camera.stamp_to_centre_s() + self.clock_offset_s
    }

    /// Its true biases.
    pub(crate) fn biases(&self) -> Result<Biases, DatasetError> {
        let mut rows = self.rows()?;
        let first = rows.next_row()?.unwrap_or_default();
        Ok(Biases { next: rows.next_row()?, rows, last: first })
    }

    /// A note if it begins after the first picture.
    pub(crate) fn begins_late(&self, run: &RunFolder) -> Option<String> {
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
pub(crate) struct ImuRows {
    rows: CsvRows,
    shift_ns: i64,
}

impl ImuRows {
    /// The next one; `None` at the end.
    pub(crate) fn next_row(&mut self) -> Result<Option<ImuRow>, DatasetError> {
        let rows = &mut self.rows;
        if !rows.advance()? {
            return Ok(None);
        }
        let [t_ns, true_ns]: [i64; 2] = [rows.whole(0)?, rows.whole(1)?];
        Ok(Some(ImuRow {
            t_ns: t_ns.saturating_add(self.shift_ns),
            true_ns: true_ns.saturating_add(self.shift_ns),
            gyro_rad_s: rows.vector(2)?,
            acc_m_s2: rows.vector(3)?,
            gyro_bias_rad_s: rows.vector(4)?,
            acc_bias_m_s2: rows.vector(5)?,
        }))
    }
}

/// Biases of an inertial sensor over time, read once.
pub(crate) struct Biases {
    rows: ImuRows,
    last: ImuRow,
    next: Option<ImuRow>,
}

impl Biases {
    /// Biases of gyroscope, rad/s, and accelerometer, m/s^2, at an instant of the run's clock, linear between the true
    /// times of rows; instants must ascend.
    pub(crate) fn at(&mut self, t_ns: i64) -> Result<[DVec3; 2], DatasetError> {
        while let Some(next) = self.next.filter(|next| next.true_ns <= t_ns) {
            self.last = next;
            self.next = self.rows.next_row()?;
        }
        let fraction = match &self.next {
            Some(next) if t_ns > self.last.true_ns => {
                (t_ns - self.last.true_ns) as f64 / (next.true_ns - self.last.true_ns) as f64
            }
            _ => 0.0,
        };
        let next = self.next.as_ref().unwrap_or(&self.last);
        Ok([
            self.last.gyro_bias_rad_s.lerp(next.gyro_bias_rad_s, fraction),
            self.last.acc_bias_m_s2.lerp(next.acc_bias_m_s2, fraction),
        ])
    }
}
