//! A frame in which neighbourhoods of probes are searched.

use camsim_core::{mount::CameraPath, shutter::Shutter};

use crate::view::{lens_reach::LensReach, surfaces::Surfaces};

/// Lines of three through three by three positions, the border's first.
pub(crate) const LINES: [[usize; 3]; 8] =
    [[0, 1, 2], [6, 7, 8], [0, 3, 6], [2, 5, 8], [3, 4, 5], [1, 4, 7], [0, 4, 8], [2, 4, 6]];

/// A frame in which neighbourhoods are searched.
pub(crate) struct NeighbourhoodSearch<'a> {
    pub reach: &'a LensReach,
    pub surfaces: &'a Surfaces,
    pub path: &'a CameraPath,
    pub shutter: &'a Shutter,
    pub stamp_s: f64,
    /// Value of a pixel, of the linear range, for each unit of light that arrives.
    pub gain: &'a (dyn Fn([u32; 2]) -> f64 + Sync),
}
