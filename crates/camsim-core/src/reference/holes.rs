//! What ideal frames do not see.

use glam::DVec2;
use rayon::prelude::*;

use super::Oracle;
use crate::pose::CameraPose;

/// Rays of a frame, and those of them whose points something hides from every camera of an ideal frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Holes {
    /// Rays of pixel centres.
    pub rays: u64,
    /// Those that meet a surface where no ideal frame sees it.
    pub unseen: u64,
}

impl Holes {
    /// Share of the rays; 0 without any.
    #[must_use]
    pub fn share(&self) -> f64 {
        self.unseen as f64 / self.rays.max(1) as f64
    }
}

/// Counts them for ideal frames at the poses `keys`, over the centres of all pixels at the exposure phases
/// given (-0.5 to 0.5).
#[must_use]
pub fn holes(oracle: &Oracle, frame: u64, keys: &[CameraPose], phases: &[f64]) -> Holes {
    let [width, height] = oracle.sequence.scenario.camera.size_px;
    let view = oracle.view(frame);
    let of_row = |y: u32| {
        let looks = (0..width).flat_map(|x| phases.iter().map(move |&phase| (x, phase)));
        let mut row = Holes::default();
        for look in looks.filter_map(|(x, phase)| view.look([x, y], DVec2::ZERO, phase)) {
            let unseen = |point| keys.iter().all(|key| oracle.hides(key.position_ned_m, point));
            row.rays += 1;
            row.unseen += u64::from(look.hit.is_some_and(|hit| unseen(hit.point_ned_m)));
        }
        row
    };
    (0..height)
        .into_par_iter()
        .map(of_row)
        .reduce(Holes::default, |a, b| Holes { rays: a.rays + b.rays, unseen: a.unseen + b.unseen })
}
