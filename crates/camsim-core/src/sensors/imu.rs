//! Inertial measurement unit.
//!
//! At the sensor's position p, in its own axes S, with the motion of the platform in the local frame N:
//!
//! ```text
//! true rate            w + R_SN e                       e: the Earth's rotation, with `earth_rate`
//! true specific force  R_SN (a_p - g(p) + 2 e x v_p)    g: normal gravity, centrifugal acceleration included
//! a_p = a + R (alpha x r + w x (w x r))                 r: lever arm, which shakes with the camera if the
//!                                                       unit is on it (`mount`)
//! gyro  = (I + scale + misalignment) true rate + sensitivity true specific force + bias + noise
//! accel = (I + scale + misalignment) true specific force + bias + noise
//! ```
//!
//! then rounded to the quantisation's steps and cut at the range. Samples are values at their instant, not
//! means over a period.

use glam::{DMat3, DQuat, DVec3};

use super::{
    SampleClock, SampleTime, SensorError, SensorInput, SensorMount,
    errors::{AxisErrors, ErrorFigures, Normals, Series, read_out},
    mount::ShakingPart,
};
use crate::scenario::{ImuSpec, PerAxis, SensorCarrier, TriadSpec};

/// First stream of the gyroscope's and of the accelerometer's errors.
const GYRO_STREAM: u32 = 20;
const ACCEL_STREAM: u32 = 24;

/// An inertial measurement unit on a flight.
#[derive(Clone, Debug)]
pub struct Imu {
    /// Its keys.
    pub spec: ImuSpec,
    /// Its position and axes, without vibration.
    pub mount: SensorMount,
    /// The camera, if it shakes and the unit is on it.
    shaking: Option<ShakingPart>,
    /// Its clock.
    pub clock: SampleClock,
    /// What the samples are made from.
    pub input: SensorInput,
    earth_rate_ned_rad_s: DVec3,
    gyro: Triad,
    accel: Triad,
}

/// A sample of an inertial measurement unit, in its own axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImuSample {
    /// Instant and stamp.
    pub time: SampleTime,
    /// Measured angular rate, rad/s.
    pub gyro_rad_s: DVec3,
    /// Measured specific force, m/s^2.
    pub accel_m_s2: DVec3,
    /// True angular rate.
    pub true_gyro_rad_s: DVec3,
    /// True specific force.
    pub true_accel_m_s2: DVec3,
    /// Bias of the gyroscope.
    pub gyro_bias_rad_s: DVec3,
    /// Bias of the accelerometer.
    pub accel_bias_m_s2: DVec3,
    /// True position in NED, metres.
    pub position_ned_m: DVec3,
    /// True velocity in NED, m/s.
    pub velocity_ned_m_s: DVec3,
    /// Takes sensor coordinates to NED.
    pub ned_from_sensor: DQuat,
    /// Whether an axis is at the end of its range.
    pub is_saturated: bool,
}

/// Three sensors with their errors.
#[derive(Clone, Copy, Debug)]
struct Triad {
    /// Scale and misalignment.
    matrix: DMat3,
    errors: AxisErrors,
    quantisation: DVec3,
    range: DVec3,
}

fn vector(values: PerAxis) -> DVec3 {
    DVec3::from_array(values.0)
}

impl Triad {
    fn new(spec: &TriadSpec, rate_hz: f64, normals: Normals, stream: u32) -> Self {
        let figures = ErrorFigures {
            white: vector(spec.noise_density) * rate_hz.sqrt(),
            bias: vector(spec.bias),
            bias_sigma: vector(spec.bias_sigma),
            walk_step: vector(spec.random_walk) / rate_hz.sqrt(),
            drift_sigma: vector(spec.drift_sigma),
            drift_samples: spec.drift_tau_s * rate_hz,
        };
        Self {
            matrix: scale_and_misalignment(spec),
            errors: AxisErrors::new(normals, stream, &figures),
            quantisation: vector(spec.quantisation),
            range: vector(spec.range),
        }
    }

    /// The reading of `value`, and whether an axis is at the end of its range.
    fn read(&self, value: DVec3) -> (DVec3, bool) {
        let axis = |i: usize| read_out(value[i], self.quantisation[i], self.range[i]);
        let reading = DVec3::new(axis(0), axis(1), axis(2));
        (reading, (0..3).any(|i| self.range[i] > 0.0 && reading[i].abs() >= self.range[i]))
    }
}

/// `I + scale + misalignment`: axis i reads `(1 + scale_i) u_i + sum of angle_ij u_j`, angles in radians.
pub(super) fn scale_and_misalignment(spec: &TriadSpec) -> DMat3 {
    let [xy, xz, yx, yz, zx, zy] = spec.misalignment_deg.map(f64::to_radians);
    let [x, y, z] = spec.scale.0.map(|scale| 1.0 + scale);
    DMat3::from_cols_array(&[x, yx, zx, xy, y, zy, xz, yz, z])
}

impl Imu {
    pub(super) fn new(spec: &ImuSpec, seed: u64, input: &SensorInput) -> Result<Self, SensorError> {
        let keys = [spec.rate_hz, spec.clock_offset_ms, spec.jitter_ms];
        let clock = SampleClock::new(("imu", &spec.name), keys, seed, input)?;
        let earth_rate_ned_rad_s = match spec.earth_rate {
            false => DVec3::ZERO,
            true => input.earth.rate_ned_rad_s().ok_or_else(|| SensorError::NoPosition {
                kind: "imu",
                name: spec.name.clone(),
                reason: "earth_rate",
            })?,
        };
        let normals = Normals::new(seed, &spec.name);
        let is_on_camera = spec.attached_to == SensorCarrier::Camera;
        let shaking = is_on_camera && !input.camera_mount.vibration.is_empty();
        Ok(Self {
            shaking: shaking.then(|| ShakingPart::new(&input.camera_mount)).transpose()?,
            mount: SensorMount::new(&spec.mount, spec.axes),
            gyro: Triad::new(&spec.gyro, spec.rate_hz, normals, GYRO_STREAM),
            accel: Triad::new(&spec.accel, spec.rate_hz, normals, ACCEL_STREAM),
            spec: spec.clone(),
            clock,
            input: input.clone(),
            earth_rate_ned_rad_s,
        })
    }

    /// All samples in order.
    pub fn samples(&self) -> impl Iterator<Item = ImuSample> + '_ {
        let mut earth = self.input.earth.clone();
        let mut gyro_bias = Series::new(&self.gyro.errors, self.clock.first());
        let mut accel_bias = Series::new(&self.accel.errors, self.clock.first());
        self.clock.times().map(move |time| {
            let body = self.input.trajectory.felt_state(time.t_s);
            let motion = match &self.shaking {
                Some(part) => self.mount.motion_on(part, time.t_s, &body),
                None => self.mount.motion(&body),
            };
            let gravity = earth.gravity_ned_m_s2(motion.position_ned_m);
            let coriolis = 2.0 * self.earth_rate_ned_rad_s.cross(motion.velocity_ned_m_s);
            let sensor_from_ned = motion.ned_from_sensor.inverse();
            let rate = motion.rate_sensor_rad_s + sensor_from_ned * self.earth_rate_ned_rad_s;
            let force = sensor_from_ned * (motion.acceleration_ned_m_s2 - gravity + coriolis);
            let sensitivity = vector(self.spec.g_sensitivity) * force;
            let (gyro, accel) = (&self.gyro, &self.accel);
            let gyro_bias_rad_s = gyro.errors.bias(&gyro_bias.next());
            let accel_bias_m_s2 = accel.errors.bias(&accel_bias.next());
            let (gyro_rad_s, gyro_cut) = gyro
                .read(gyro.matrix * rate + sensitivity + gyro_bias_rad_s + gyro.errors.white(time.sample));
            let (accel_m_s2, accel_cut) =
                accel.read(accel.matrix * force + accel_bias_m_s2 + accel.errors.white(time.sample));
            ImuSample {
                time,
                gyro_rad_s,
                accel_m_s2,
                true_gyro_rad_s: rate,
                true_accel_m_s2: force,
                gyro_bias_rad_s,
                accel_bias_m_s2,
                position_ned_m: motion.position_ned_m,
                velocity_ned_m_s: motion.velocity_ned_m_s,
                ned_from_sensor: motion.ned_from_sensor,
                is_saturated: gyro_cut || accel_cut,
            }
        })
    }

    /// Scale and misalignment of the gyroscope and of the accelerometer: reading = matrix x truth.
    #[must_use]
    pub fn matrices(&self) -> [DMat3; 2] {
        [self.gyro.matrix, self.accel.matrix]
    }
}
