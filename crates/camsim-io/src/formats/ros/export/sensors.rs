//! Inertial units, satellite receivers, the true pose.

use std::path::PathBuf;

use camsim_core::sensors::GnssSample;

use super::messages::{Header, Imu, NavSatFix, Pose, PoseStamped, StampedTransform, TransformMessage};
use super::{Bag, Source};
use crate::columns::T_NS;
use crate::formats::axes::enu_from_flu;
use crate::formats::axes::{Rigid, enu};
use crate::formats::exporting::csv_rows::CsvRows;
use crate::formats::exporting::imu::{ImuRow, ImuRows, ImuSensor, descriptions};
use crate::formats::exporting::run_folder::{PlatformRows, PlatformState};
use crate::formats::exporting::{DatasetError, ExportJob, RunFolder};

/// Motion of `base_link`.
pub(super) struct TruePoses {
    rows: PlatformRows,
    next: Option<PlatformState>,
}

impl TruePoses {
    pub(super) fn new(job: &ExportJob<'_>) -> Result<Self, DatasetError> {
        let mut rows = job.run.platform()?;
        let next = rows.next_state()?;
        Ok(Self { rows, next })
    }
}

impl Source for TruePoses {
    fn next_ns(&self) -> Option<i64> {
        self.next.map(|state| state.t_ns)
    }

    fn send(&mut self, bag: &mut Bag<'_>) -> Result<(), DatasetError> {
        let Some(state) = self.next else { return Ok(()) };
        let pose = Rigid {
            rotation: enu_from_flu(state.ned_from_body).normalize(),
            translation_m: enu(state.position_ned_m),
        };
        let moved = StampedTransform::new(state.t_ns, "map", "base_link", &pose);
        bag.send("/tf", "tf2_msgs/msg/TFMessage", state.t_ns, &TransformMessage { transforms: vec![moved] })?;
        let stamped = PoseStamped { header: Header::new(state.t_ns, "map"), pose: Pose::new(&pose) };
        bag.send("/ground_truth/pose", "geometry_msgs/msg/PoseStamped", state.t_ns, &stamped)?;
        self.next = self.rows.next_state()?;
        Ok(())
    }
}

/// Measurements of an inertial unit.
pub(super) struct ImuMessages {
    name: String,
    rows: ImuRows,
    next: Option<ImuRow>,
    gyro_covariance: [f64; 9],
    acc_covariance: [f64; 9],
}

/// Of white noise of a density, at a rate, on each axis.
fn covariance(density: f64, rate_hz: f64) -> [f64; 9] {
    let variance = density * density * rate_hz;
    [variance, 0.0, 0.0, 0.0, variance, 0.0, 0.0, 0.0, variance]
}

impl ImuMessages {
    pub(super) fn new(i: usize, imu: &ImuSensor) -> Result<Self, DatasetError> {
        let mut rows = imu.rows()?;
        let next = rows.next_row()?;
        Ok(Self {
            name: format!("imu{i}"),
            rows,
            next,
            gyro_covariance: covariance(imu.noise.gyroscope_noise_density, imu.rate_hz),
            acc_covariance: covariance(imu.noise.accelerometer_noise_density, imu.rate_hz),
        })
    }
}

impl Source for ImuMessages {
    fn next_ns(&self) -> Option<i64> {
        self.next.map(|row| row.t_ns)
    }

    fn send(&mut self, bag: &mut Bag<'_>) -> Result<(), DatasetError> {
        let Some(row) = self.next else { return Ok(()) };
        // -1 says that there is no orientation.
        let mut unknown = [0.0; 9];
        unknown[0] = -1.0;
        let message = Imu {
            header: Header::new(row.t_ns, self.name.as_str()),
            orientation: [0.0, 0.0, 0.0, 1.0],
            orientation_covariance: unknown,
            angular_velocity: row.gyro_rad_s.to_array(),
            angular_velocity_covariance: self.gyro_covariance,
            linear_acceleration: row.acc_m_s2.to_array(),
            linear_acceleration_covariance: self.acc_covariance,
        };
        bag.send(&format!("/{}", self.name), "sensor_msgs/msg/Imu", row.t_ns, &message)?;
        self.next = self.rows.next_row()?;
        Ok(())
    }
}

/// Tables of satellite receivers.
pub(super) fn receivers(run: &RunFolder) -> Result<Vec<PathBuf>, DatasetError> {
    let all = descriptions(run)?;
    Ok(all.into_iter().filter(|sensor| sensor.kind == "gnss").map(|sensor| sensor.table).collect())
}

/// Fixes of a satellite receiver.
pub(super) struct Fixes {
    name: String,
    rows: CsvRows,
    /// What is added to its stamps.
    shift_ns: i64,
    next_ns: Option<i64>,
}

impl Fixes {
    pub(super) fn new(i: usize, table: &std::path::Path, shift_ns: i64) -> Result<Self, DatasetError> {
        let columns = [T_NS, "has_fix", "lat_deg", "lon_deg", "height_m"];
        let rows = CsvRows::open::<GnssSample>(table, &columns)?;
        let mut fixes = Self { name: format!("gnss{i}"), rows, shift_ns, next_ns: None };
        fixes.advance()?;
        Ok(fixes)
    }

    fn advance(&mut self) -> Result<(), DatasetError> {
        self.next_ns = match self.rows.advance()? {
            true => Some(self.rows.whole::<i64>(0)?.saturating_add(self.shift_ns)),
            false => None,
        };
        Ok(())
    }
}

impl Source for Fixes {
    fn next_ns(&self) -> Option<i64> {
        self.next_ns
    }

    fn send(&mut self, bag: &mut Bag<'_>) -> Result<(), DatasetError> {
        let Some(t_ns) = self.next_ns else { return Ok(()) };
        let has_fix = self.rows.text(1) == "1";
        // Cells are empty without a fix.
        let value = |i: usize| if has_fix { self.rows.number(i) } else { Ok(f64::NAN) };
        let message = NavSatFix {
            header: Header::new(t_ns, self.name.as_str()),
            status: if has_fix { 0 } else { -1 },
            service: 1,
            latitude: value(2)?,
            longitude: value(3)?,
            altitude: value(4)?,
            position_covariance: [0.0; 9],
            position_covariance_type: 0,
        };
        bag.send(&format!("/{}/fix", self.name), "sensor_msgs/msg/NavSatFix", t_ns, &message)?;
        self.advance()
    }
}
