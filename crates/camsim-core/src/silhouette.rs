//! Definition of a silhouette, shared by measured and predicted errors. No rendered image depends on it.
//!
//! A silhouette is a step of depth at one instant: an inverse depth that still changes by more than [`STEP`],
//! relative to the nearer one, when the two rays are brought to 1/256 of their distance. A slope, however
//! oblique, then changes by 1/256 of its difference; a step remains. The border of the sky is always a step.
//! Creases, where inverse depth bends by more than [`CREASE`] from one pixel to the next, count as well, for
//! instance the foot of a wall: the renderer cannot tell them from steps and casts silhouette rays there.

/// Second difference of inverse depth between pixels, relative to the nearest, above which there is a crease:
/// the threshold of the renderer's edge mask.
pub use crate::temporal::edge_mask::EDGE_STEP as CREASE;
/// Relative change of inverse depth above which there is a step.
pub const STEP: f64 = 0.005;
/// Distance from a silhouette within which a pixel counts as at it, output pixels.
pub const NEAR_PX: u32 = 3;
/// Number of times that the distance between the two rays is halved.
const HALVINGS: u32 = 8;

/// Whether three equally spaced inverse depths may have a step between them. On a plane they lie on a
/// straight line. This test avoids most of the rays that [`steps`] needs.
pub fn may_step(inverse_depths: [f64; 3]) -> bool {
    bends(inverse_depths, STEP)
}

/// Whether three equally spaced inverse depths bend by more than `fraction` of the nearest one.
pub fn bends([a, b, c]: [f64; 3], fraction: f64) -> bool {
    (a - 2.0 * b + c).abs() > fraction * a.max(b).max(c)
}

/// Whether there is a step between two rays with the given inverse depths (0 for the sky). `between(fraction)`
/// returns the inverse depth of the ray so far from the first (0) to the second (1).
pub fn steps(from: f64, to: f64, between: impl Fn(f64) -> f64) -> bool {
    let differ = |a: f64, b: f64| (a - b).abs() > STEP * a.max(b);
    let (mut before, mut after) = ((0.0, from), (1.0, to));
    for _ in 0..HALVINGS {
        if !differ(before.1, after.1) {
            return false;
        }
        let fraction = 0.5 * (before.0 + after.0);
        let middle = (fraction, between(fraction));
        // The step is in the half with the larger change.
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
            // Ground in front of the sky, and the sky in front of a roof.
            assert!(found(|s| if s > at { 0.01 } else { 0.0 }) && found(|s| if s > at { 0.0 } else { 1e-6 }));
        }
        assert!(!found(|_| 0.0) && may_step([0.0, 0.0, 1e-6]) && !may_step([0.0; 3]));
    }
}
