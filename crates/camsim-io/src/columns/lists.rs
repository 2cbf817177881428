//! The lists. Readers of the files go by the names: they stay.

use camsim_core::{
    frame::RowRecord,
    pose::BodyState,
    sensors::{BarometerSample, GnssSample, ImuSample, MagnetometerSample},
};

use super::{
    CameraState, Column,
    Get::{Flag, Index, MaybeNed, MaybeNumber, Ned, Number, Whole, Wxyz, Xyz},
    Part::Exposures,
    TableRow, column, of, plain,
};

/// The column before those of trajectories, in seconds; in Python the argument.
pub(crate) const T_S: &str = "t_s";
/// Stamps of all sensors.
pub(crate) const T_NS: &str = "t_ns";
/// True instants of all sensors; true values stand behind it.
pub(crate) const T_TRUE_NS: &str = "t_true_ns";

const STAMP: &str = "stamp by the sensor's clock";
const INSTANT: &str = "instant on the clock of frames";

impl TableRow for RowRecord {
    const COLUMNS: &'static [Column<Self>] = &[
        plain("row", "number of the row, from 0", Index(|row| row.row)),
        plain(
            "t_mid_ns",
            "mid-exposure on the clock of stamps; of an interlaced sideways readout that of the later field (`dt` of \
             `coords` has each pixel's own)",
            Whole(|row| row.t_mid_ns),
        ),
        column("position_ned_m", "*", "the optical centre then", Ned(|row| row.position_ned_m)),
        column("ned_from_camera_wxyz", "q*", "attitude of the camera", Wxyz(|row| row.ned_from_camera)),
        column("velocity_ned_m_s", "v*", "of the optical centre", Ned(|row| row.velocity_ned_m_s)),
        of(
            Exposures,
            plain(
                "exposure_ns",
                "exposure time; in files where rows differ in it",
                Whole(|row| row.exposure_ns),
            ),
        ),
    ];
}

impl TableRow for BodyState {
    const COLUMNS: &'static [Column<Self>] = &[
        column("position_ned_m", "*_m", "of the body", Ned(|body| body.position_ned_m)),
        column("velocity_ned_m_s", "v*", "of the body", Ned(|body| body.velocity_ned_m_s)),
        column("acceleration_ned_m_s2", "a*", "of the body", Ned(|body| body.acceleration_ned_m_s2)),
        column("ned_from_body_wxyz", "q*", "attitude", Wxyz(|body| body.ned_from_body)),
        column("rate_body_rad_s", "w*", "rate in body axes", Xyz(|body| body.rate_body_rad_s)),
        column(
            "angular_acceleration_body_rad_s2",
            "alpha*",
            "derivative of the rate",
            Xyz(|body| body.angular_acceleration_body_rad_s2),
        ),
    ];
}

impl TableRow for CameraState {
    const COLUMNS: &'static [Column<Self>] = &[
        column("position_ned_m", "*_m", "of the optical centre", Ned(|camera| camera.pose.position_ned_m)),
        column("velocity_ned_m_s", "v*", "of the optical centre", Ned(|camera| camera.velocity_ned_m_s)),
        column("ned_from_camera_wxyz", "q*", "attitude", Wxyz(|camera| camera.pose.ned_from_camera)),
        column("rate_camera_rad_s", "w*", "rate in camera axes", Xyz(|camera| camera.rate_camera_rad_s)),
    ];
}

impl TableRow for ImuSample {
    const COLUMNS: &'static [Column<Self>] = &[
        plain(T_NS, STAMP, Whole(|imu| imu.time.stamp_ns)),
        column("gyro_rad_s", "gyro_*_rad_s", "measured rate", Xyz(|imu| imu.gyro_rad_s)),
        column("accel_m_s2", "accel_*_m_s2", "measured specific force", Xyz(|imu| imu.accel_m_s2)),
        plain(T_TRUE_NS, INSTANT, Whole(|imu| imu.time.true_ns)),
        column("true_gyro_rad_s", "true_gyro_*_rad_s", "true rate", Xyz(|imu| imu.true_gyro_rad_s)),
        column("true_accel_m_s2", "true_accel_*_m_s2", "true specific force", Xyz(|imu| imu.true_accel_m_s2)),
        column("gyro_bias_rad_s", "gyro_bias_*_rad_s", "its bias", Xyz(|imu| imu.gyro_bias_rad_s)),
        column("accel_bias_m_s2", "accel_bias_*_m_s2", "its bias", Xyz(|imu| imu.accel_bias_m_s2)),
        column("position_ned_m", "true_*_m", "true, of the sensor", Ned(|imu| imu.position_ned_m)),
        column("velocity_ned_m_s", "true_v*_m_s", "true, of the sensor", Ned(|imu| imu.velocity_ned_m_s)),
        column(
            "ned_from_sensor_wxyz",
            "true_q*",
            "true attitude of the sensor",
            Wxyz(|imu| imu.ned_from_sensor),
        ),
        plain("is_saturated", "whether an axis is at the end of its range", Flag(|imu| imu.is_saturated)),
    ];
}

impl TableRow for GnssSample {
    const COLUMNS: &'static [Column<Self>] = &[
        plain(T_NS, STAMP, Whole(|gnss| gnss.time.stamp_ns)),
        column("has_fix", "fix", "0 within a dropout", Flag(|gnss| gnss.fix.is_some())),
        plain("lat_deg", "measured", MaybeNumber(|gnss| Some(gnss.fix?.at.lat_deg()))),
        plain("lon_deg", "measured", MaybeNumber(|gnss| Some(gnss.fix?.at.lon_deg()))),
        plain("height_m", "measured, above the ellipsoid", MaybeNumber(|gnss| Some(gnss.fix?.at.height_m))),
        plain("msl_m", "measured, above mean sea level", MaybeNumber(|gnss| Some(gnss.fix?.msl_m))),
        column("position_ned_m", "*_m", "measured", MaybeNed(|gnss| Some(gnss.fix?.position_ned_m))),
        column("velocity_ned_m_s", "v*_m_s", "measured", MaybeNed(|gnss| Some(gnss.fix?.velocity_ned_m_s))),
        plain(
            "t_available_ns",
            "when the fix is there, by the sensor's clock",
            Whole(|gnss| gnss.available_ns),
        ),
        plain(T_TRUE_NS, INSTANT, Whole(|gnss| gnss.time.true_ns)),
        plain("true_lat_deg", "true", Number(|gnss| gnss.truth.at.lat_deg())),
        plain("true_lon_deg", "true", Number(|gnss| gnss.truth.at.lon_deg())),
        plain("true_height_m", "true", Number(|gnss| gnss.truth.at.height_m)),
        plain("true_msl_m", "true", Number(|gnss| gnss.truth.msl_m)),
        column("true_position_ned_m", "true_*_m", "true", Ned(|gnss| gnss.truth.position_ned_m)),
        column("true_velocity_ned_m_s", "true_v*_m_s", "true", Ned(|gnss| gnss.truth.velocity_ned_m_s)),
    ];
}

impl TableRow for BarometerSample {
    const COLUMNS: &'static [Column<Self>] = &[
        plain(T_NS, STAMP, Whole(|air| air.time.stamp_ns)),
        plain("pressure_pa", "measured", Number(|air| air.pressure_pa)),
        plain(
            "altitude_m",
            "height where the standard atmosphere has the measured pressure",
            Number(|air| air.altitude_m),
        ),
        plain(T_TRUE_NS, INSTANT, Whole(|air| air.time.true_ns)),
        plain("true_pressure_pa", "true", Number(|air| air.true_pressure_pa)),
        plain("true_msl_m", "true height above sea level", Number(|air| air.true_msl_m)),
        plain("bias_pa", "error without the white noise", Number(|air| air.bias_pa)),
    ];
}

impl TableRow for MagnetometerSample {
    const COLUMNS: &'static [Column<Self>] = &[
        plain(T_NS, STAMP, Whole(|field| field.time.stamp_ns)),
        column("mag_ut", "mag_*_ut", "measured", Xyz(|field| field.mag_ut)),
        plain(T_TRUE_NS, INSTANT, Whole(|field| field.time.true_ns)),
        column("true_mag_ut", "true_mag_*_ut", "true, in sensor axes", Xyz(|field| field.true_mag_ut)),
        column("field_ned_ut", "field_*_ut", "true", Ned(|field| field.field_ned_ut)),
    ];
}
