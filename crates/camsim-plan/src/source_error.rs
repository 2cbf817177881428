//! How far sources are off: exact sources of the probes, dry runs of every temporal inverse, rounding, and
//! disocclusion.
//!
//! The prediction is no formula: the pipeline is run dry at a few hundred probes, in f64, over the scene's
//! own surfaces, against exact rays (`dry_run.rs`), and what single precision adds comes from the sizes of
//! the numbers (`rounding.rs`). The largest error of n probes is above the 99th percentile of all pixels with
//! a probability of `1 - 0.99^n` (98.7 % of 432). Frames that share an ideal frame are alike: each is run dry
//! at a quarter of the probes, and all that are solved in the same way answer for the largest error of any
//! (88.8 % of two, 98.7 % of four). What it misses is what [`SOURCE_ERROR`](crate::ir::margins::SOURCE_ERROR)
//! is for.

pub(crate) mod disocclusion;
pub(crate) mod dry_run;
pub(crate) mod error_map;
pub(crate) mod exact_sources;
pub(crate) mod forecast;
pub(crate) mod path_miss;
pub(crate) mod pixel_truth;
pub(crate) mod rounding;
pub(crate) mod temporal_method;
