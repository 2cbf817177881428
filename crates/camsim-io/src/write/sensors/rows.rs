//! Rows of the sensors' tables.

use std::io::Write as _;

use camsim_core::sensors::{BarometerSample, Fix, GnssSample, ImuSample, MagnetometerSample, SampleTime};
use glam::DVec3;

use super::super::{Number, tables::wxyz};

/// Columns of an inertial unit's table: stamp by its clock, measured rate and specific force, true instant on
/// the clock of frames, true rate and specific force, biases, and the true pose and velocity of the sensor in
/// the local frame (q is ned_from_sensor).
pub const IMU_COLUMNS: &str = "t_ns,gyro_x_rad_s,gyro_y_rad_s,gyro_z_rad_s,accel_x_m_s2,accel_y_m_s2,accel_z_m_s2,\
t_true_ns,true_gyro_x_rad_s,true_gyro_y_rad_s,true_gyro_z_rad_s,true_accel_x_m_s2,true_accel_y_m_s2,true_accel_z_m_s2,\
gyro_bias_x_rad_s,gyro_bias_y_rad_s,gyro_bias_z_rad_s,accel_bias_x_m_s2,accel_bias_y_m_s2,accel_bias_z_m_s2,\
true_n_m,true_e_m,true_d_m,true_vn_m_s,true_ve_m_s,true_vd_m_s,true_qw,true_qx,true_qy,true_qz";

/// Columns of a satellite receiver's table. Within a dropout `fix` is 0 and the measured cells are empty.
pub const GNSS_COLUMNS: &str = "t_ns,fix,lat_deg,lon_deg,height_m,msl_m,n_m,e_m,d_m,vn_m_s,ve_m_s,vd_m_s,\
t_available_ns,t_true_ns,true_lat_deg,true_lon_deg,true_height_m,true_msl_m,true_n_m,true_e_m,true_d_m,\
true_vn_m_s,true_ve_m_s,true_vd_m_s";

/// Columns of a barometer's table.
pub const BAROMETER_COLUMNS: &str =
    "t_ns,pressure_pa,altitude_m,t_true_ns,true_pressure_pa,true_msl_m,bias_pa";

/// Columns of a magnetometer's table.
pub const MAGNETOMETER_COLUMNS: &str = "t_ns,mag_x_ut,mag_y_ut,mag_z_ut,t_true_ns,true_mag_x_ut,true_mag_y_ut,\
true_mag_z_ut,field_n_ut,field_e_ut,field_d_ut";

/// A line of numbers.
#[derive(Default)]
pub(super) struct Line {
    text: Vec<u8>,
}

impl Line {
    pub(super) fn begin(&mut self) {
        self.text.clear();
    }

    /// The whole line.
    pub(super) fn end(&mut self) -> &[u8] {
        // Every cell has a comma behind it.
        if let Some(last) = self.text.last_mut() {
            *last = b'\n';
        }
        &self.text
    }

    fn whole(&mut self, value: i64) {
        // Writing to a vector cannot fail.
        let _ = write!(self.text, "{value},");
    }

    fn number(&mut self, value: f64) {
        self.text.extend_from_slice(Number(value).digits(&mut zmij::Buffer::new()).as_bytes());
        self.text.push(b',');
    }

    fn numbers(&mut self, values: &[f64]) {
        values.iter().for_each(|value| self.number(*value));
    }

    fn vector(&mut self, value: DVec3) {
        self.numbers(&value.to_array());
    }

    fn empty(&mut self, cells: usize) {
        self.text.extend(std::iter::repeat_n(b',', cells));
    }
}

/// A sample as a row of its table.
pub(super) trait SensorRow {
    fn time(&self) -> &SampleTime;
    /// Whether an axis is at the end of its range, or there is no fix.
    fn is_flagged(&self) -> bool;
    fn append(&self, line: &mut Line);
}

impl SensorRow for ImuSample {
    fn time(&self) -> &SampleTime {
        &self.time
    }

    fn is_flagged(&self) -> bool {
        self.is_saturated
    }

    fn append(&self, line: &mut Line) {
        line.whole(self.time.stamp_ns);
        line.vector(self.gyro_rad_s);
        line.vector(self.accel_m_s2);
        line.whole(self.time.true_ns);
        line.vector(self.true_gyro_rad_s);
        line.vector(self.true_accel_m_s2);
        line.vector(self.gyro_bias_rad_s);
        line.vector(self.accel_bias_m_s2);
        line.vector(self.position_ned_m);
        line.vector(self.velocity_ned_m_s);
        line.numbers(&wxyz(self.ned_from_sensor));
    }
}

/// Cells of a fix.
const FIX_CELLS: usize = 10;

fn append_fix(fix: &Fix, line: &mut Line) {
    line.numbers(&[fix.at.lat_deg(), fix.at.lon_deg(), fix.at.height_m, fix.msl_m]);
    line.vector(fix.position_ned_m);
    line.vector(fix.velocity_ned_m_s);
}

impl SensorRow for GnssSample {
    fn time(&self) -> &SampleTime {
        &self.time
    }

    fn is_flagged(&self) -> bool {
        self.fix.is_none()
    }

    fn append(&self, line: &mut Line) {
        line.whole(self.time.stamp_ns);
        line.whole(i64::from(self.fix.is_some()));
        match &self.fix {
            Some(fix) => append_fix(fix, line),
            None => line.empty(FIX_CELLS),
        }
        line.whole(self.available_ns);
        line.whole(self.time.true_ns);
        append_fix(&self.truth, line);
    }
}

impl SensorRow for BarometerSample {
    fn time(&self) -> &SampleTime {
        &self.time
    }

    fn is_flagged(&self) -> bool {
        false
    }

    fn append(&self, line: &mut Line) {
        line.whole(self.time.stamp_ns);
        line.numbers(&[self.pressure_pa, self.altitude_m]);
        line.whole(self.time.true_ns);
        line.numbers(&[self.true_pressure_pa, self.true_msl_m, self.bias_pa]);
    }
}

impl SensorRow for MagnetometerSample {
    fn time(&self) -> &SampleTime {
        &self.time
    }

    fn is_flagged(&self) -> bool {
        false
    }

    fn append(&self, line: &mut Line) {
        line.whole(self.time.stamp_ns);
        line.vector(self.mag_ut);
        line.whole(self.time.true_ns);
        line.vector(self.true_mag_ut);
        line.vector(self.field_ned_ut);
    }
}
