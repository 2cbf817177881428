//! The paper's displacement models: constant twist and constant depth (eqs. 10 to 18). f64 twins of
//! `linear.wgsl` and `rk2.wgsl` in `camsim-gpu/shaders/reverse/temporal_inverse`.

use glam::{DVec2, DVec3};

/// The paper's step of rotation, degrees (section 8.4).
pub const RK2_STEP_DEG: f64 = 2.5;

/// Largest number of steps of one time shift, 28 turns, so that extreme times and rates terminate.
const RK2_MAX_STEPS: u32 = 4096;

/// Motion of the camera, constant over the frame, in the axes of the camera (x right, y down, z forward).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Twist {
    /// Velocity of the optical centre, m/s.
    pub velocity_m_s: DVec3,
    /// Angular rate, rad/s.
    pub rate_rad_s: DVec3,
}

/// `d(u, v)/dt` of a static world point seen at `uv` with inverse planar depth `inverse_depth` (1/m): eqs. 11
/// and 12. In camera axes a static point moves by `-V - w x r`.
#[must_use]
pub fn image_rate(uv: DVec2, inverse_depth: f64, twist: &Twist) -> DVec2 {
    let point_rate = -twist.velocity_m_s * inverse_depth - twist.rate_rad_s.cross(uv.extend(1.0));
    point_rate.truncate() - uv * point_rate.z
}

/// Image position, `dt_s` earlier, of the point now seen at `uv`, by one straight step (eq. 16).
#[must_use]
pub fn linear(uv: DVec2, inverse_depth: f64, twist: &Twist, dt_s: f64) -> DVec2 {
    uv - image_rate(uv, inverse_depth, twist) * dt_s
}

/// Number of steps of a time shift with at most `max_step_rad` of rotation each: `floor(|dt| |w| / step) +
/// 1`, as in the paper's program, at most `RK2_MAX_STEPS`.
#[must_use]
pub fn rk2_steps(twist: &Twist, dt_s: f64, max_step_rad: f64) -> u32 {
    let whole = (dt_s.abs() * twist.rate_rad_s.length() / max_step_rad).floor();
    whole.min(f64::from(RK2_MAX_STEPS - 1)) as u32 + 1
}

/// As [`linear`], by steps of the two-point Runge-Kutta scheme of Heun (eq. 18), with constant depth.
#[must_use]
pub fn rk2(uv: DVec2, inverse_depth: f64, twist: &Twist, dt_s: f64, max_step_rad: f64) -> DVec2 {
    let steps = rk2_steps(twist, dt_s, max_step_rad);
    let step_s = dt_s / f64::from(steps);
    (0..steps).fold(uv, |at, _| {
        let here = image_rate(at, inverse_depth, twist);
        let there = image_rate(at - here * step_s, inverse_depth, twist);
        at - 0.5 * (here + there) * step_s
    })
}

#[cfg(test)]
mod tests {
    use glam::DMat3;

    use super::*;

    #[test]
    fn heun_error_of_roll_follows_its_step() {
        let twist = Twist { rate_rad_s: DVec3::new(0.0, 0.0, 36_f64.to_radians()), ..Twist::default() };
        let uv = DVec2::new(0.4, -0.2);
        // One second ago the camera was rotated back, so the point was at R uv.
        let exact = (DMat3::from_axis_angle(DVec3::Z, 36_f64.to_radians()) * uv.extend(1.0)).truncate();
        let mut before = f64::INFINITY;
        for (step_deg, steps) in [(36.1, 1), (12.1, 3), (6.05, 6), (2.5, 15), (1.01, 36)] {
            let source = rk2(uv, 0.0, &twist, 1.0, f64::to_radians(step_deg));
            assert_eq!(rk2_steps(&twist, 1.0, f64::to_radians(step_deg)), steps);
            let error = source.distance(exact);
            // e = r theta step^2 / 6 to first order: the third-order term of the series of the rotation, once
            // per step.
            let law =
                uv.length() * 36_f64.to_radians() * (36_f64.to_radians() / f64::from(steps)).powi(2) / 6.0;
            assert!(error < 1.3 * law && error < before, "{step_deg}: {error} {law}");
            before = error;
        }
        assert!(linear(uv, 0.0, &twist, 1.0).distance(exact) > 10.0 * before);
    }

    #[test]
    fn translation_at_constant_depth_is_exact_sideways() {
        let twist = Twist { velocity_m_s: DVec3::new(30.0, -4.0, 0.0), ..Twist::default() };
        let uv = DVec2::new(0.1, 0.3);
        let exact = uv + DVec2::new(30.0, -4.0) * 0.5 / 80.0;
        for found in [linear(uv, 1.0 / 80.0, &twist, 0.5), rk2(uv, 1.0 / 80.0, &twist, 0.5, 0.04)] {
            assert!(found.distance(exact) < 1e-15, "{found} {exact}");
        }
    }
}
