//! Disocclusion: the fraction of a frame that its ideal frames do not show.

use glam::DVec2;
use rayon::prelude::*;

use super::ReferenceRenderer;
use crate::pose::CameraPose;

/// Number of rays of a frame, and of those whose points are occluded in every ideal frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Disocclusion {
    /// Rays of pixel centres.
    pub rays: u64,
    /// Rays that hit a surface point which no key camera sees.
    pub hidden: u64,
}

impl Disocclusion {
    /// Fraction of the disoccluded rays; 0 without any rays.
    #[must_use]
    pub fn fraction(&self) -> f64 {
        self.hidden as f64 / self.rays.max(1) as f64
    }
}

/// Counts disoccluded rays over the centres of all pixels at the given exposure phases (-0.5 to 0.5), for
/// ideal frames at the poses `keys`.
#[must_use]
pub fn disocclusion(
    reference: &ReferenceRenderer,
    frame: u64,
    keys: &[CameraPose],
    phases: &[f64],
) -> Disocclusion {
    let [width, height] = reference.sequence.scenario.camera.size_px;
    let view = reference.view(frame);
    let of_row = |y: u32| {
        let samples = (0..width).flat_map(|x| phases.iter().map(move |&phase| (x, phase)));
        let mut row = Disocclusion::default();
        for sample in samples.filter_map(|(x, phase)| view.sample([x, y], DVec2::ZERO, phase)) {
            let hidden = |point| {
                keys.iter().all(|key| reference.is_occluded_at(sample.t_s, key.position_ned_m, point))
            };
            row.rays += 1;
            row.hidden += u64::from(sample.hit.is_some_and(|hit| hidden(hit.point_ned_m)));
        }
        row
    };
    (0..height).into_par_iter().map(of_row).reduce(Disocclusion::default, |a, b| Disocclusion {
        rays: a.rays + b.rays,
        hidden: a.hidden + b.hidden,
    })
}
