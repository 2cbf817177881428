//! SIMD: pixels side by side, by the widest vectors of the processor.

#![expect(clippy::needless_range_loop, reason = "numbers of one pixel have one index in all arrays")]

pub(crate) mod lanes;
pub(crate) mod vectors;
