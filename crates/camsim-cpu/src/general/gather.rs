//! The path of a source over the exposure, and the mean of the ideal frame's colour along it. Twin of
//! `camsim-gpu/shaders/reverse/gather`.

use camsim_core::temporal::{self, ColorImage, Footprint, PathStage, path};
use camsim_plan::BlurStage;
use glam::{DVec2, DVec3};

use super::{
    rows::Exposure,
    solver::{DepthLookup, Solver, Source},
};

/// The path of a pixel's source over the exposure.
#[derive(Clone, Copy, Debug)]
pub(super) struct ExposurePath<'a> {
    /// Sources at equidistant times; a single one without blur.
    pub nodes_px: &'a [DVec2],
    /// Whether all sources are within the ideal frame.
    pub inside: bool,
    /// Projections of the ray's point at infinity at begin and end of the exposure, ideal pixels.
    pub far_px: [DVec2; 2],
}

/// Exposure path and its integration.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gather {
    pub solver: Solver,
    pub blur: Option<BlurStage>,
    /// Paper preset: equidistant samples on the straight segment between both ends.
    pub paper: bool,
}

impl Gather {
    /// The path of the source of a ray; `nodes_px` is overwritten.
    pub fn path<'a>(
        &self,
        uv: DVec2,
        exposure: &Exposure<'_>,
        key: &DepthLookup<'_>,
        nodes_px: &'a mut Vec<DVec2>,
    ) -> ExposurePath<'a> {
        nodes_px.clear();
        let mut inside = true;
        let mut far_px = None;
        let mut add = |source: Source| {
            nodes_px.push(source.position_px);
            inside &= source.inside;
            far_px = Some([far_px.map_or(source.far_px, |[first, _]: [DVec2; 2]| first), source.far_px]);
        };
        match (self.blur, self.solver) {
            (None, solver) => add(solver.source(uv, &exposure.mid, key)),
            (Some(blur), Solver::Reproject { iterations }) => {
                self.add_reprojected(uv, exposure, key, (blur, iterations), add);
            }
            (Some(blur), solver) => {
                exposure.nodes.iter().step_by(blur.stride as usize).for_each(|pose| {
                    add(solver.source(uv, pose, key));
                });
            }
        }
        ExposurePath { nodes_px, inside, far_px: far_px.unwrap_or_default() }
    }

    /// As [`temporal::reproject_nodes`], also for sources outside of the ideal frame.
    fn add_reprojected(
        &self,
        uv: DVec2,
        exposure: &Exposure<'_>,
        key: &DepthLookup<'_>,
        (blur, iterations): (BlurStage, u32),
        mut add: impl FnMut(Source),
    ) {
        let node = |k: usize| &exposure.nodes[k * blur.stride as usize];
        let look_up = |k: Option<usize>, guess: Option<f64>| {
            Solver::depth_in_key(uv, k.map_or(&exposure.mid, node), guess, iterations, key)
        };
        let solved = exposure.nodes.iter().step_by(blur.stride as usize).len();
        blur.depths.of_nodes(solved, look_up, |k, in_key| {
            add(self.solver.source_of_surface(uv, node(k), in_key, key.ideal));
        });
    }

    /// Mean of an image of the ideal frame along a path.
    pub fn mean(&self, path: &ExposurePath<'_>, area: &Footprint, image: &ColorImage<'_>) -> DVec3 {
        match (self.blur, path.nodes_px) {
            (Some(blur), &[first, .., last]) if self.paper => {
                // The frame is convex: if both ends are clamped to it, all samples are within it.
                let limit = DVec2::new(image.size_px[0].into(), image.size_px[1].into()) - 1.0;
                let ends = [first, last].map(|end| end.clamp(DVec2::ZERO, limit));
                temporal::paper::gather_straight(ends, blur.max_samples, image)
            }
            (blur, nodes_px) => {
                let (stage, samples_per_px, cap) =
                    blur.map_or((PathStage::Straight, 0.0, 1), |b| (b.path, b.samples_per_px, b.max_samples));
                temporal::gather(nodes_px, stage, area, image, samples_per_px, cap)
            }
        }
    }

    /// Source at an exposure phase in [-0.5, 0.5], on the path that [`Gather::mean`] samples.
    pub fn position_at_phase(
        &self,
        uv: DVec2,
        exposure: &Exposure<'_>,
        key: &DepthLookup<'_>,
        phase: f64,
        nodes_px: &mut Vec<DVec2>,
    ) -> DVec2 {
        let Some(blur) = self.blur.filter(|_| phase != 0.0 || self.paper) else {
            return self.solver.source(uv, &exposure.mid, key).position_px;
        };
        let path = self.path(uv, exposure, key, nodes_px);
        let fraction = (phase + 0.5).clamp(0.0, 1.0);
        match *path.nodes_px {
            [first, .., last] if self.paper => first.lerp(last, fraction),
            _ => {
                let mut curves = path::curves(path.nodes_px, blur.path);
                let elapsed = fraction * curves.len() as f64;
                let number = (elapsed as usize).min(curves.len().saturating_sub(1));
                let steps = f64::from(blur.path.steps()) * (elapsed - number as f64);
                curves.nth(number).map_or(path.nodes_px[0], |curve| curve.at(steps))
            }
        }
    }
}
