//! The picture error by each cause.

pub(crate) mod aliasing;
pub(crate) mod blended_layers;
pub(crate) mod misregistration;
pub(crate) mod resampling;
pub(crate) mod resampling_cache;
pub(crate) mod silhouettes;
pub(crate) mod skyline;
pub(crate) mod terrain;
pub(crate) mod texture_probes;
pub(crate) mod texture_spectra;
pub(crate) mod transfer;
