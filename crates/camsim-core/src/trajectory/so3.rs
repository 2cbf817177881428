//! Rotations as rotation vectors: exponential, logarithm and the Jacobian between them.

use glam::{DQuat, DVec3};

/// Below this squared angle (rad^2) the series are used; their first omitted term is then under 1e-17.
const SERIES_BELOW_RAD2: f64 = 1e-4;

/// Rotation by `|v|` radians about `v`: `(cos(|v|/2), sin(|v|/2) v/|v|)`. Any finite vector.
pub fn exp(rotation_vector: DVec3) -> DQuat {
    let angle2 = rotation_vector.length_squared();
    let (sin_half_over_angle, cos_half) = if angle2 < SERIES_BELOW_RAD2 {
        let half2 = 0.25 * angle2;
        (
            0.5 * (1.0 - half2 / 6.0 * (1.0 - half2 / 20.0 * (1.0 - half2 / 42.0))),
            1.0 - half2 / 2.0 * (1.0 - half2 / 12.0 * (1.0 - half2 / 30.0)),
        )
    } else {
        let angle = angle2.sqrt();
        let (sin, cos) = (0.5 * angle).sin_cos();
        (sin / angle, cos)
    };
    let v = rotation_vector * sin_half_over_angle;
    DQuat::from_xyzw(v.x, v.y, v.z, cos_half)
}

/// Rotation vector of a unit quaternion, along the shorter arc: length in [0, pi]. Inverse of [`exp`] there.
pub fn log(rotation: DQuat) -> DVec3 {
    let sign = if rotation.w < 0.0 { -1.0 } else { 1.0 };
    let v = DVec3::new(rotation.x, rotation.y, rotation.z) * sign;
    let w = rotation.w * sign;
    let sin2 = v.length_squared();
    if sin2 < 1e-6 {
        // 2 atan(s/w)/s by its series in s/w; the first omitted term is under 1e-19.
        let x = sin2 / (w * w);
        v * (2.0 / w * (1.0 - x * (1.0 / 3.0 - x * (1.0 / 5.0 - x / 7.0))))
    } else {
        let sin = sin2.sqrt();
        v * (2.0 * sin.atan2(w) / sin)
    }
}

/// Left Jacobian times a vector: the angular rate, in the outer frame, of `exp(v(t))` whose rotation vector
/// changes at `v_rate`.
///
/// `J v' = v' + (1 - cos a)/a^2 v x v' + (a - sin a)/a^3 v x (v x v')`, a = |v| (e.g. Barfoot, State
/// Estimation for Robotics, 7.77).
pub(crate) fn left_jacobian_times(rotation_vector: DVec3, vector_rate: DVec3) -> DVec3 {
    let angle2 = rotation_vector.length_squared();
    let (first, second) = if angle2 < SERIES_BELOW_RAD2 {
        (
            0.5 - angle2 / 24.0 * (1.0 - angle2 / 30.0 * (1.0 - angle2 / 56.0)),
            1.0 / 6.0 - angle2 / 120.0 * (1.0 - angle2 / 42.0 * (1.0 - angle2 / 72.0)),
        )
    } else {
        let angle = angle2.sqrt();
        let (sin, cos) = angle.sin_cos();
        ((1.0 - cos) / angle2, (angle - sin) / (angle2 * angle))
    };
    let across = rotation_vector.cross(vector_rate);
    vector_rate + first * across + second * rotation_vector.cross(across)
}

/// Time derivative of [`left_jacobian_times`]: the angular acceleration, in the outer frame, of `exp(v(t))`.
///
/// `v'' + a (v x v'') + a' (v x v') + b (v' x (v x v') + v x (v x v'')) + b' v x (v x v')`, where a and b are the
/// coefficients of the Jacobian and `a' = (da/dx)/x (v . v')` for x = |v|.
pub(crate) fn left_jacobian_rate(vector: DVec3, rate: DVec3, acceleration: DVec3) -> DVec3 {
    let angle2 = vector.length_squared();
    // The derivatives cancel to the fourth and fifth power of the angle, so that the series reach further.
    let (first, second, first_slope, second_slope) = if angle2 < 0.04 {
        let x = angle2;
        (
            0.5 - x / 24.0 * (1.0 - x / 30.0 * (1.0 - x / 56.0 * (1.0 - x / 90.0))),
            1.0 / 6.0 - x / 120.0 * (1.0 - x / 42.0 * (1.0 - x / 72.0 * (1.0 - x / 110.0))),
            -1.0 / 12.0 + x / 180.0 - x * x / 6720.0 + x * x * x / 453_600.0,
            -1.0 / 60.0 + x / 1260.0 - x * x / 60_480.0 + x * x * x / 4_989_600.0,
        )
    } else {
        let angle = angle2.sqrt();
        let (sin, cos) = angle.sin_cos();
        (
            (1.0 - cos) / angle2,
            (angle - sin) / (angle2 * angle),
            (angle * sin - 2.0 * (1.0 - cos)) / (angle2 * angle2),
            (angle * (1.0 - cos) - 3.0 * (angle - sin)) / (angle2 * angle2 * angle),
        )
    };
    let stretch = vector.dot(rate);
    let (across, across_rate) = (vector.cross(rate), vector.cross(acceleration));
    acceleration
        + first * across_rate
        + first_slope * stretch * across
        + second * (rate.cross(across) + vector.cross(across_rate))
        + second_slope * stretch * vector.cross(across)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exp_and_log_are_inverse_over_all_angles() {
        let axis = DVec3::new(0.3, -0.5, 0.8).normalize();
        for angle in [0.0, 1e-300, 1e-9, 1e-4, 9.9e-3, 1.01e-2, 0.5, 2.0, 3.1] {
            let v = axis * angle;
            assert!((log(exp(v)) - v).length() < 2e-15, "{angle}");
            assert!((log(-exp(v)) - v).length() < 2e-15, "{angle}");
            assert!((exp(v).length() - 1.0).abs() < 1e-15);
        }
    }

    #[test]
    fn exp_agrees_with_glam() {
        for angle in [1e-3, 9.99e-3, 1.01e-2, 1.0, 3.0, 7.0] {
            let axis = DVec3::new(-0.1, 0.7, 0.4).normalize();
            let theirs = DQuat::from_axis_angle(axis, angle);
            assert!((exp(axis * angle) - theirs).length() < 1e-15, "{angle}");
        }
    }

    #[test]
    fn left_jacobian_is_the_rate_of_exp() {
        let vector_rate = DVec3::new(0.4, 1.0, -0.7);
        for length in [0.0, 1e-3, 9e-3, 1.1e-2, 0.3, 2.5] {
            let v = DVec3::new(1.0, -2.0, 0.5).normalize() * length;
            let step = 1e-4;
            let change = exp(v + vector_rate * step) * exp(v - vector_rate * step).inverse();
            let numeric = log(change) / (2.0 * step);
            // Central difference: error step^2 times a third derivative of order one.
            assert!((numeric - left_jacobian_times(v, vector_rate)).length() < 1e-7, "{length}");
        }
    }

    #[test]
    fn the_rate_of_the_left_jacobian_is_its_derivative() {
        let (rate, acceleration) = (DVec3::new(0.4, 1.0, -0.7), DVec3::new(-0.3, 0.2, 1.1));
        for length in [0.0, 1e-3, 0.0999, 0.199, 0.201, 0.5, 2.5] {
            let vector = DVec3::new(1.0, -2.0, 0.5).normalize() * length;
            let at = |t: f64| {
                left_jacobian_times(vector + rate * t + acceleration * (0.5 * t * t), rate + acceleration * t)
            };
            let step = 1e-4;
            let numeric = (at(step) - at(-step)) / (2.0 * step);
            // Central difference: error step^2 times a third derivative of order one, and rounding 1e-12.
            let exact = left_jacobian_rate(vector, rate, acceleration);
            assert!((numeric - exact).length() < 2e-8, "{length}: {}", (numeric - exact).length());
        }
    }
}
