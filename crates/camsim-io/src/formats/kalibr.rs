//! Kalibr, and OpenVINS, which has its chains.

pub(crate) mod export;
pub(crate) mod read;
pub(crate) mod write;
