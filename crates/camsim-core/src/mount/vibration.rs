//! Vibration of the camera's mount against the body.

use std::f64::consts::TAU;

use glam::{DQuat, DVec3};

use super::MountError;
use crate::{
    scenario::{Axis, VibrationSpec},
    trajectory::so3,
};

/// A sinusoid in one component of a vector.
#[derive(Clone, Copy, Debug)]
struct Sinusoid {
    component: DVec3,
    rate_rad_s: f64,
    phase_rad: f64,
}

/// Rotation about the optical centre, and displacement of it, in body axes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Vibration {
    /// Components in radians.
    rotations: Vec<Sinusoid>,
    /// Components in metres.
    translations: Vec<Sinusoid>,
}

/// A vibration at one instant, with two derivatives; all in body axes, which count as at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shake {
    pub(crate) rotation: DQuat,
    pub(crate) rate_rad_s: DVec3,
    pub(crate) angular_acceleration_rad_s2: DVec3,
    pub(crate) shift_m: DVec3,
    pub(crate) shift_rate_m_s: DVec3,
    pub(crate) shift_acceleration_m_s2: DVec3,
}

impl Vibration {
    /// The vibration of `camera.mount.vibration`.
    pub(crate) fn new(entries: &[VibrationSpec]) -> Result<Self, MountError> {
        let mut vibration = Self::default();
        for (i, entry) in entries.iter().enumerate() {
            let (axis, turns) = body_axis(entry.axis);
            let amplitude = amplitude(entry, i + 1, turns)?;
            let sinusoid = Sinusoid {
                component: axis * amplitude,
                rate_rad_s: TAU * entry.hz,
                phase_rad: entry.phase_deg.to_radians(),
            };
            if turns { &mut vibration.rotations } else { &mut vibration.translations }.push(sinusoid);
        }
        Ok(vibration)
    }

    /// Rotation vector and its rate; `None` if nothing turns.
    #[inline(always)]
    pub(super) fn turn(&self, t_s: f64) -> Option<(DVec3, DVec3)> {
        (!self.rotations.is_empty()).then(|| sum(&self.rotations, t_s))
    }

    /// Displacement and its rate; `None` if nothing moves.
    #[inline(always)]
    pub(super) fn shift(&self, t_s: f64) -> Option<(DVec3, DVec3)> {
        (!self.translations.is_empty()).then(|| sum(&self.translations, t_s))
    }

    /// The vibration at an instant; at rest where that is infinite.
    pub(crate) fn shake(&self, t_s: f64) -> Shake {
        let t_s = if t_s.is_finite() { t_s } else { 0.0 };
        let (angle, angle_rate) = sum(&self.rotations, t_s);
        let angle_acceleration = acceleration(&self.rotations, t_s);
        let (shift_m, shift_rate_m_s) = sum(&self.translations, t_s);
        Shake {
            rotation: so3::exp(angle),
            rate_rad_s: so3::left_jacobian_times(angle, angle_rate),
            angular_acceleration_rad_s2: so3::left_jacobian_rate(angle, angle_rate, angle_acceleration),
            shift_m,
            shift_rate_m_s,
            shift_acceleration_m_s2: acceleration(&self.translations, t_s),
        }
    }

    /// Highest frequency with an amplitude, hertz; 0 if there is none.
    pub(super) fn highest_hz(&self) -> f64 {
        let all = self.rotations.iter().chain(&self.translations);
        all.filter(|s| s.component != DVec3::ZERO).fold(0.0, |hz, s| hz.max(s.rate_rad_s / TAU))
    }

    /// Bound on the angle, radians: each component with the sum of its amplitudes.
    pub(super) fn peak_rad(&self) -> f64 {
        self.rotations.iter().map(|s| s.component.abs()).sum::<DVec3>().length()
    }
}

/// Body axis of a degree of freedom, and whether it is a rotation.
fn body_axis(axis: Axis) -> (DVec3, bool) {
    match axis {
        Axis::Roll => (DVec3::X, true),
        Axis::Pitch => (DVec3::Y, true),
        Axis::Yaw => (DVec3::Z, true),
        Axis::X => (DVec3::X, false),
        Axis::Y => (DVec3::Y, false),
        Axis::Z => (DVec3::Z, false),
    }
}

/// Amplitude of an entry in radians or metres.
fn amplitude(spec: &VibrationSpec, entry: usize, turns: bool) -> Result<f64, MountError> {
    let (own, other, wanted, given) = if turns {
        (spec.amplitude_deg.to_radians(), spec.amplitude_m, "amplitude_deg", "amplitude_m")
    } else {
        (spec.amplitude_m, spec.amplitude_deg, "amplitude_m", "amplitude_deg")
    };
    if other != 0.0 {
        return Err(MountError::WrongAmplitude { entry, axis: spec.axis, wanted, given });
    }
    if !(own.is_finite() && spec.phase_deg.is_finite() && spec.hz.is_finite() && spec.hz >= 0.0) {
        return Err(MountError::BadVibration { entry });
    }
    Ok(own)
}

/// Value and time derivative.
fn sum(sinusoids: &[Sinusoid], t_s: f64) -> (DVec3, DVec3) {
    let (mut value, mut derivative) = (DVec3::ZERO, DVec3::ZERO);
    for s in sinusoids {
        let (sin, cos) = (s.rate_rad_s * t_s + s.phase_rad).sin_cos();
        value += s.component * sin;
        derivative += s.component * (cos * s.rate_rad_s);
    }
    (value, derivative)
}

/// Second derivative.
fn acceleration(sinusoids: &[Sinusoid], t_s: f64) -> DVec3 {
    let of = |s: &Sinusoid| {
        s.component * (-s.rate_rad_s * s.rate_rad_s * (s.rate_rad_s * t_s + s.phase_rad).sin())
    };
    sinusoids.iter().map(of).sum()
}
