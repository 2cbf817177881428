//! Place and orientation of sensors on the platform.

use glam::{DMat4, DQuat, DVec3};

use crate::{
    flight_log::body_from_euler_deg,
    pose::BodyState,
    scenario::{SensorAxes, SensorMountSpec},
};

/// A sensor that is fixed to the body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SensorMount {
    /// Takes coordinates of the sensor's axes to those of the body (FRD).
    pub body_from_sensor: DQuat,
    /// Lever arm in body axes, metres.
    pub lever_body_m: DVec3,
}

impl SensorMount {
    /// The mount of a scenario.
    #[must_use]
    pub fn new(spec: &SensorMountSpec, axes: SensorAxes) -> Self {
        // Sensor axes at the angles 0, exactly.
        let body_from_axes = match axes {
            SensorAxes::Frd => DQuat::IDENTITY,
            SensorAxes::Flu => DQuat::from_xyzw(1.0, 0.0, 0.0, 0.0),
            SensorAxes::Rdf => DQuat::from_xyzw(0.5, 0.5, 0.5, 0.5),
        };
        Self {
            body_from_sensor: body_from_euler_deg(spec.angles_deg) * body_from_axes,
            lever_body_m: DVec3::from_array(spec.offset_m),
        }
    }

    /// A sensor without axes of its own.
    #[must_use]
    pub fn at(offset_m: [f64; 3]) -> Self {
        Self { body_from_sensor: DQuat::IDENTITY, lever_body_m: DVec3::from_array(offset_m) }
    }

    /// `T_body_sensor`: takes points of the sensor's frame to the body's.
    #[must_use]
    pub fn body_from_sensor_matrix(&self) -> DMat4 {
        DMat4::from_rotation_translation(self.body_from_sensor, self.lever_body_m)
    }

    /// Motion of the sensor on a body in motion.
    pub(super) fn motion(&self, body: &BodyState) -> SensorMotion {
        let (rate, lever) = (body.rate_body_rad_s, self.lever_body_m);
        let whirl = rate.cross(lever);
        let acceleration = body.angular_acceleration_body_rad_s2.cross(lever) + rate.cross(whirl);
        SensorMotion {
            position_ned_m: body.position_ned_m + body.ned_from_body * lever,
            velocity_ned_m_s: body.velocity_ned_m_s + body.ned_from_body * whirl,
            acceleration_ned_m_s2: body.acceleration_ned_m_s2 + body.ned_from_body * acceleration,
            ned_from_sensor: body.ned_from_body * self.body_from_sensor,
            rate_sensor_rad_s: self.body_from_sensor.inverse() * rate,
        }
    }
}

/// Motion of a sensor in the local frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct SensorMotion {
    pub(super) position_ned_m: DVec3,
    pub(super) velocity_ned_m_s: DVec3,
    pub(super) acceleration_ned_m_s2: DVec3,
    pub(super) ned_from_sensor: DQuat,
    pub(super) rate_sensor_rad_s: DVec3,
}
