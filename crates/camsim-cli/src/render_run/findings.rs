//! What a run warns of after its pictures: errors beyond the tolerances, frames that see nothing.

use camsim_core::{frame::RenderedFrame, scenario::QualitySpec};
use camsim_engine::Finished;

use crate::tolerances::{OverlapCycles, Tolerances};

/// What was found about rendered pictures.
#[derive(Default)]
pub struct Findings {
    pictures: usize,
    sky_only: u64,
    empty: u64,
    cycles: OverlapCycles,
    tolerances: Option<Tolerances>,
}

impl Findings {
    /// Nothing is found yet.
    pub fn new(quality: &QualitySpec) -> Self {
        Self { tolerances: Tolerances::new(quality), ..Self::default() }
    }

    /// Adds a picture.
    pub fn add(&mut self, finished: &Finished) {
        self.pictures += 1;
        self.sky_only += u64::from(finished.plans().all(|plan| plan.motion.nearest_m.is_infinite()));
        self.empty += u64::from(is_empty(&finished.frame));
        self.cycles.add(finished.plan.frame, finished.out_of_order);
        if let Some(tolerances) = &mut self.tolerances {
            tolerances.add(finished.plans());
        }
    }

    /// What to warn of.
    pub fn warnings(&self) -> impl Iterator<Item = String> {
        validity_warnings(self.sky_only, self.empty, self.pictures)
            .chain(self.cycles.warning(self.pictures))
            .chain(self.tolerances.iter().flat_map(Tolerances::warnings))
    }
}

/// Warns of frames that see only sky, and of frames without a valid pixel.
fn validity_warnings(sky_only: u64, empty: u64, frames: usize) -> impl Iterator<Item = String> {
    let sky_only = (sky_only > 0).then(|| {
        format!(
            "{sky_only} of {frames} frames see only sky: check camera.mount, flight.height and the position \
                 of the scene"
        )
    });
    let empty = (empty > 0).then(|| {
        format!(
            "{empty} of {frames} frames have no valid pixel: no ray of the camera is within the ideal frame, \
             or the lens has none; check camera.principal_point_px and camera.focal_px against \
             camera.size_px, and see `camsim explain SCENARIO.toml`"
        )
    });
    sky_only.into_iter().chain(empty)
}

/// Whether no pixel of a frame's colour is valid; false for a frame without colour.
fn is_empty(frame: &RenderedFrame) -> bool {
    let color_rgba = frame.color_rgba();
    !color_rgba.is_empty() && color_rgba.chunks_exact(4).all(|pixel| pixel[3] <= 0.0)
}
