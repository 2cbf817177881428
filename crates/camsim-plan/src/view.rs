//! What the camera sees: rays, probes, surfaces, motion, exposure, and the neighbourhoods of probes.

pub(crate) mod beam;
pub(crate) mod constant_twist;
pub(crate) mod exposure;
pub(crate) mod faces;
pub(crate) mod gain;
pub(crate) mod ideal_extent;
pub(crate) mod lens_reach;
pub(crate) mod light;
pub(crate) mod motion;
pub(crate) mod neighbourhood;
pub(crate) mod plane;
pub(crate) mod probes;
pub(crate) mod scene_outline;
pub(crate) mod source_path;
pub(crate) mod surfaces;
#[cfg(test)]
pub(crate) mod test_flights;
