//! Whether a probe is at a silhouette.

use camsim_core::silhouette::{CREASE, NEAR_PX, bends, may_step, steps};
use glam::DVec2;

use super::{DryRun, ExactSource};
use crate::view::{neighbourhood::search::LINES, probes::Probe};

impl DryRun<'_> {
    /// Whether a probe is to be counted apart: its point is hidden from the key camera, or its own camera
    /// sees a step of depth beside it; with `folds` also a fold.
    pub fn at_silhouette(&self, probe: &Probe, source: &ExactSource, folds: bool) -> bool {
        source.is_hidden() || self.near_a_step(probe, source, folds)
    }

    /// At its own instant, along rows, columns and diagonals of three by three positions: what crosses the
    /// square crosses its border.
    fn near_a_step(&self, probe: &Probe, source: &ExactSource, folds: bool) -> bool {
        let pose = self.path.pose(source.t_s);
        let inverse_depth = |position: DVec2| {
            let uv = probe.uv + probe.uv_from_px * (f64::from(NEAR_PX) * position);
            self.surfaces
                .first_hit(pose.position_ned_m, pose.ned_from_camera * uv.extend(1.0))
                .map_or(0.0, |hit| 1.0 / hit.depth_m)
        };
        let positions: [DVec2; 9] =
            std::array::from_fn(|i| DVec2::new((i % 3) as f64 - 1.0, (i / 3) as f64 - 1.0));
        let inverse_depths = positions.map(inverse_depth);
        let steps_between = |a: usize, b: usize| {
            steps(inverse_depths[a], inverse_depths[b], |fraction| {
                inverse_depth(positions[a].lerp(positions[b], fraction))
            })
        };
        LINES.iter().any(|&[a, b, c]| {
            let of_line = [inverse_depths[a], inverse_depths[b], inverse_depths[c]];
            // Between positions 3 px apart a crease bends threefold.
            let fold = folds && bends(of_line, f64::from(NEAR_PX) * CREASE);
            fold || (may_step(of_line) && (steps_between(a, b) || steps_between(b, c)))
        })
    }
}
