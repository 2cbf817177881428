//! Attitudes while a log is cleaned: rotations if angles wrap, angles if they count turns.

use glam::{DQuat, EulerRot};

use super::{RawAttitude, RawRow};
use crate::scenario::AngleKind;

/// Rotation from body (FRD) to north-east-down for ZYX angles (roll, pitch, yaw) in degrees: `Rz(yaw)
/// Ry(pitch) Rx(roll)`.
pub fn body_from_euler_deg([roll, pitch, yaw]: [f64; 3]) -> DQuat {
    DQuat::from_euler(EulerRot::ZYX, yaw.to_radians(), pitch.to_radians(), roll.to_radians())
}

/// Attitude relative to the row's own tangent frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Attitude {
    /// A rotation, interpolated along the shorter arc.
    Rotation(DQuat),
    /// Roll, pitch, yaw in degrees as written, counting turns.
    Turns([f64; 3]),
    /// Unknown.
    Missing,
}

/// Larger angles cannot be told from garbage, and lose their fraction in f64.
const MAX_ANGLE_DEG: f64 = 1e9;

impl Attitude {
    pub(super) fn from_raw(raw: RawAttitude, continuous: bool) -> Self {
        match raw {
            RawAttitude::EulerDeg(angles) if angles.iter().all(|angle| angle.abs() <= MAX_ANGLE_DEG) => {
                if continuous {
                    Self::Turns(angles)
                } else {
                    Self::Rotation(body_from_euler_deg(angles))
                }
            }
            // Also false for NaN.
            RawAttitude::Quaternion(rotation) if (rotation.length() - 1.0).abs() <= 0.1 => {
                Self::Rotation(rotation.normalize())
            }
            RawAttitude::EulerDeg(_) | RawAttitude::Quaternion(_) | RawAttitude::None => Self::Missing,
        }
    }

    pub(super) fn is_missing(self) -> bool {
        self == Self::Missing
    }

    /// Rotation to the tangent frame; identity if missing.
    pub(super) fn rotation(self) -> DQuat {
        match self {
            Self::Rotation(rotation) => rotation,
            Self::Turns(angles) => body_from_euler_deg(angles),
            Self::Missing => DQuat::IDENTITY,
        }
    }

    /// Interpolation between `self` (0) and `other` (1); the known one if the other is missing.
    pub(super) fn interpolate(self, other: Self, fraction: f64) -> Self {
        match (self, other) {
            (Self::Rotation(a), Self::Rotation(b)) => Self::Rotation(a.slerp(b, fraction).normalize()),
            (Self::Turns(a), Self::Turns(b)) => {
                Self::Turns([0, 1, 2].map(|axis| a[axis] + (b[axis] - a[axis]) * fraction))
            }
            (Self::Missing, known) | (known, _) => known,
        }
    }

    /// Angle between two attitudes, radians; the largest of the three changes if they count turns. `None` if
    /// one is missing.
    pub(super) fn distance_rad(self, other: Self) -> Option<f64> {
        match (self, other) {
            (Self::Rotation(a), Self::Rotation(b)) => Some(angle_between_rad(a, b)),
            (Self::Turns(a), Self::Turns(b)) => {
                Some((0..3).map(|axis| (b[axis] - a[axis]).abs()).fold(0.0, f64::max).to_radians())
            }
            _ => None,
        }
    }

    /// Mean of the known ones among attitudes that are close together.
    pub(super) fn mean(attitudes: impl Iterator<Item = Self> + Clone) -> Self {
        let known = attitudes.filter(|attitude| !attitude.is_missing());
        let count = known.clone().count() as f64;
        let mut first = None;
        let mut turns = [0.0; 3];
        let mut sum = DQuat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        for attitude in known {
            match attitude {
                Self::Rotation(rotation) => {
                    let reference = *first.get_or_insert(rotation);
                    sum = if rotation.dot(reference) < 0.0 { sum - rotation } else { sum + rotation };
                }
                Self::Turns(angles) => {
                    for axis in 0..3 {
                        turns[axis] += angles[axis] / count;
                    }
                }
                Self::Missing => {}
            }
        }
        match (first, count > 0.0) {
            // The sum of two rotations is near zero only if they are 180 degrees apart; the first one is used
            // then.
            (Some(first), _) => Self::Rotation(if sum.length() > 1e-3 { sum.normalize() } else { first }),
            (None, true) => Self::Turns(turns),
            (None, false) => Self::Missing,
        }
    }
}

/// Angle of the rotation from `a` to `b` in radians, accurate for small angles (where `acos` of the dot
/// product is not).
pub(super) fn angle_between_rad(a: DQuat, b: DQuat) -> f64 {
    let relative = a.inverse() * b;
    2.0 * relative.xyz().length().atan2(relative.w.abs())
}

/// Decides `Auto`: continuous if a column leaves both [-180, 180] and [0, 360).
///
/// A compass that occasionally writes 360.0 leaves both by one value. Such a column wraps if it also jumps by
/// more than 270 degrees between rows while most of its steps are small. Two rows 0 and 360 are a full turn.
pub(super) fn is_continuous(rows: &[&RawRow], kind: AngleKind) -> bool {
    match kind {
        AngleKind::Wrapped => false,
        AngleKind::Continuous => true,
        AngleKind::Auto => (0..3).any(|axis| {
            let column = || {
                rows.iter().filter_map(move |row| match row.attitude {
                    RawAttitude::EulerDeg(angles) if angles[axis].abs() <= MAX_ANGLE_DEG => {
                        Some(angles[axis])
                    }
                    _ => None,
                })
            };
            let leaves_half_turns = column().any(|angle| angle.abs() > 180.0);
            let leaves_compass = column().any(|angle| !(0.0..360.0).contains(&angle));
            let closed_compass = column().all(|angle| (0.0..=360.0).contains(&angle));
            let steps = || column().zip(column().skip(1)).map(|(a, b)| (b - a).abs());
            let jumps = steps().filter(|&step| step > 270.0).count();
            let compass_with_360 = closed_compass && jumps > 0 && 2 * jumps < steps().count();
            leaves_half_turns && leaves_compass && !compass_with_360
        }),
    }
}
