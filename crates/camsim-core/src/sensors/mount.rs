//! Position and orientation of sensors on the platform.

use glam::{DMat4, DQuat, DVec3};

use crate::{
    flight_log::body_from_euler_deg,
    mount::{MountError, Vibration},
    pose::{BodyState, FLU_FROM_FRD, FRD_FROM_RDF},
    scenario::{MountSpec, SensorAxes, SensorMountSpec},
};

/// Position and axes of a sensor in the body's frame.
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
            SensorAxes::Flu => FLU_FROM_FRD,
            SensorAxes::Rdf => FRD_FROM_RDF,
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
        motion_at(body, self.body_from_sensor, &Arm { lever_m: self.lever_body_m, ..Arm::default() })
    }

    /// Motion of the sensor on a part that shakes against a body in motion. With the part's rotation V about its
    /// centre c, displacement d and the sensor's position r without vibration, the lever arm is `c + d + V (r - c)`.
    pub(super) fn motion_on(&self, part: &ShakingPart, t_s: f64, body: &BodyState) -> SensorMotion {
        let shake = part.vibration.shake(t_s);
        let spin_rad_s = shake.rate_rad_s;
        let from_centre_m = shake.rotation * (self.lever_body_m - part.centre_body_m);
        let swing_m_s = spin_rad_s.cross(from_centre_m);
        let arm = Arm {
            lever_m: part.centre_body_m + shake.shift_m + from_centre_m,
            rate_m_s: shake.shift_rate_m_s + swing_m_s,
            acceleration_m_s2: shake.shift_acceleration_m_s2
                + shake.angular_acceleration_rad_s2.cross(from_centre_m)
                + spin_rad_s.cross(swing_m_s),
            spin_rad_s,
        };
        motion_at(body, shake.rotation * self.body_from_sensor, &arm)
    }
}

/// A part of the platform that shakes against the body.
#[derive(Clone, Debug)]
pub(super) struct ShakingPart {
    vibration: Vibration,
    /// The point about which it turns: the optical centre without vibration.
    centre_body_m: DVec3,
}

impl ShakingPart {
    /// The camera.
    pub(super) fn new(camera: &MountSpec) -> Result<Self, MountError> {
        let centre_body_m = DVec3::from_array(camera.offset_m);
        Ok(Self { vibration: Vibration::new(&camera.vibration)?, centre_body_m })
    }
}

/// Lever arm as seen from the body, with its derivatives, and the rate at which the sensor turns against the body.
#[derive(Clone, Copy, Debug, Default)]
struct Arm {
    lever_m: DVec3,
    rate_m_s: DVec3,
    acceleration_m_s2: DVec3,
    spin_rad_s: DVec3,
}

fn motion_at(body: &BodyState, body_from_sensor: DQuat, arm: &Arm) -> SensorMotion {
    let rate = body.rate_body_rad_s;
    let whirl = rate.cross(arm.lever_m);
    let acceleration = body.angular_acceleration_body_rad_s2.cross(arm.lever_m)
        + rate.cross(whirl)
        + 2.0 * rate.cross(arm.rate_m_s)
        + arm.acceleration_m_s2;
    SensorMotion {
        position_ned_m: body.position_ned_m + body.ned_from_body * arm.lever_m,
        velocity_ned_m_s: body.velocity_ned_m_s + body.ned_from_body * (whirl + arm.rate_m_s),
        acceleration_ned_m_s2: body.acceleration_ned_m_s2 + body.ned_from_body * acceleration,
        ned_from_sensor: body.ned_from_body * body_from_sensor,
        rate_sensor_rad_s: body_from_sensor.inverse() * (rate + arm.spin_rad_s),
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
