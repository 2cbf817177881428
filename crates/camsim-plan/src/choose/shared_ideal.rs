//! One ideal frame for several output frames, and the request for their sampling plans.

use std::ops::Range;

use crate::{ir::sampling_plan::SamplingPlan, view::ideal_extent::TangentBounds};

/// The ideal frame of several output frames.
#[derive(Debug)]
pub(crate) struct SharedIdeal {
    pub frames: Range<u64>,
    pub key_s: f64,
    pub extent: TangentBounds,
}

impl SharedIdeal {
    /// Output frames made from it.
    pub fn count(&self) -> u64 {
        self.frames.end - self.frames.start
    }
}

/// A request for a frame's sampling plan.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SamplingRequest {
    /// Part of `quality.max_error_dn` that it is to keep.
    pub fraction_of_dn: f64,
    /// The plan itself; `None` as long as that is to be found.
    pub given: Option<SamplingPlan>,
}

impl Default for SamplingRequest {
    fn default() -> Self {
        Self { fraction_of_dn: 1.0, given: None }
    }
}
