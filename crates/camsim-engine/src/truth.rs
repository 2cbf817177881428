//! Truth about each pixel of an output frame, by rays in f64: whatever renderer made the picture, the truth is
//! the same.

mod coverage;
mod flow;
pub(crate) mod hits;
mod planes;

pub(crate) use coverage::{RAYS, ray};
pub(crate) use planes::{FramePixels, planes};
