//! What a silhouette is. One definition for errors that are measured and for errors that are predicted; no
//! picture depends on it.
//!
//! A silhouette is a step of depth at one instant: inverse depth that still changes by more than [`STEP`] of
//! the nearer one when the two rays are brought to 1/256 of their distance. A slope, however oblique, changes
//! by 1/256 then; a step stays. The border of the sky is a step of all of it. Where depth bends by more than
//! [`FOLD`] from one pixel to the next, as at the foot of a wall, it counts too: the renderer cannot tell
//! such a fold from a step and casts rays of its own there.

/// Second difference of inverse depth from pixel to pixel, relative to the nearest, beyond which a bend
/// counts: that of the renderer's marks.
pub use crate::temporal::marks::EDGE_STEP as FOLD;
/// Relative change of inverse depth.
pub const STEP: f64 = 0.005;
/// Distance from a silhouette within which a pixel counts as "at" it, output pixels.
pub const NEAR_PX: u32 = 3;
/// Times that the two rays' distance is halved.
const HALVINGS: u32 = 8;

/// Whether inverse depths at three even places may have a step between them: over a plane they lie on a
/// straight line. Saves most looks.
pub fn may_step(inverse_depths: [f64; 3]) -> bool {
    bends(inverse_depths, STEP)
}

/// Whether inverse depths at three even places bend by more than a share of the nearest one.
pub fn bends([a, b, c]: [f64; 3], share: f64) -> bool {
    (a - 2.0 * b + c).abs() > share * a.max(b).max(c)
}

/// Whether there is a step between two rays with the given inverse depths, 0 for the sky. `between` is that
/// of the ray at a share of the way.
pub fn steps(from: f64, to: f64, between: impl Fn(f64) -> f64) -> bool {
    let differ = |a: f64, b: f64| (a - b).abs() > STEP * a.max(b);
    let (mut before, mut after) = ((0.0, from), (1.0, to));
    for _ in 0..HALVINGS {
        if !differ(before.1, after.1) {
            return false;
        }
        let share = 0.5 * (before.0 + after.0);
        let middle = (share, between(share));
        // The step is in the half that changes more.
        if (before.1 - middle.1).abs() >= (middle.1 - after.1).abs() {
            after = middle
        } else {
            before = middle
        }
    }
    differ(before.1, after.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(inverse_depth: impl Fn(f64) -> f64) -> bool {
        steps(inverse_depth(0.0), inverse_depth(1.0), &inverse_depth)
    }

    #[test]
    fn slopes_and_creases_are_no_steps() {
        // Twice as far away within one pixel, straight, bent sharply, and on one side of a crease.
        assert!(!found(|s| 0.01 * (1.0 + s)));
        assert!(!found(|s| 0.01 / (1.0 + s)));
        assert!(!found(|s| 0.01 * (1.0 + (s - 0.7).max(0.0))));
        assert!(!may_step([0.01, 0.02, 0.03]) && may_step([0.01, 0.01, 0.02]));
    }

    #[test]
    fn steps_are_found_wherever_they_are_and_on_slopes_too() {
        for at in [0.001, 0.1, 0.3, 0.5, 0.77, 0.999] {
            for slope in [0.0, 0.02, -0.02, 0.1] {
                let step =
                    |height: f64| move |s: f64| 0.01 * (1.0 + slope * s + if s > at { height } else { 0.0 });
                assert!(found(step(0.2)) && found(step(-0.2)), "{at} {slope}");
                assert!(!found(step(0.004)), "{at} {slope}");
            }
            // Ground before the sky, and the sky before a roof.
            assert!(found(|s| if s > at { 0.01 } else { 0.0 }) && found(|s| if s > at { 0.0 } else { 1e-6 }));
        }
        assert!(!found(|_| 0.0) && may_step([0.0, 0.0, 1e-6]) && !may_step([0.0; 3]));
    }
}
