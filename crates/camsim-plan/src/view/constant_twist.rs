//! Where the solvers of a constant twist look.

use camsim_core::temporal::displacement::{self, RK2_STEP_DEG, Twist};
use glam::DVec2;

use crate::ir::stages::TemporalStage;

/// Ideal ray where a constant-twist solver looks for what the ray `uv` sees `dt_s` after the key instant;
/// `None` for the others, which look where the point really is.
pub(crate) fn displaced(
    stage: TemporalStage,
    uv: DVec2,
    inverse_depth: f64,
    twist: &Twist,
    dt_s: f64,
) -> Option<DVec2> {
    match stage {
        TemporalStage::Linear => Some(displacement::linear(uv, inverse_depth, twist, dt_s)),
        TemporalStage::Rk2 => {
            Some(displacement::rk2(uv, inverse_depth, twist, dt_s, RK2_STEP_DEG.to_radians()))
        }
        TemporalStage::Identity | TemporalStage::Rotation | TemporalStage::Reproject { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_constant_twist_solvers_are_displaced() {
        let twist = Twist { rate_rad_s: glam::DVec3::new(0.0, 0.0, 1.0), ..Twist::default() };
        let uv = DVec2::new(0.5, 0.0);
        let at = |stage: TemporalStage| displaced(stage, uv, 0.0, &twist, 0.1);
        assert_eq!(at(TemporalStage::Rotation), None);
        assert_eq!(at(TemporalStage::Reproject { iterations: 2 }), None);
        // Turning to the right about the optical axis, the point was 0.1 rad further clockwise before: u' =
        // u, v' = v + 0.05.
        let linear = at(TemporalStage::Linear).unwrap_or_default();
        assert!(linear.distance(DVec2::new(0.5, 0.05)) < 1e-12, "{linear}");
        let rk2 = at(TemporalStage::Rk2).unwrap_or_default();
        assert!(rk2.distance(DVec2::new(0.5 * 0.1_f64.cos(), 0.5 * 0.1_f64.sin())) < 1e-4, "{rk2}");
    }
}
