//! EuRoC/ASL.

pub(crate) mod export;
pub(crate) mod read;
pub(crate) mod settings;
pub(crate) mod write;
