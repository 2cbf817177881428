//! Work on the host's own processors, for software adapters, whose device they are anyway: pixels side by
//! side, by the widest vectors that there are.

#![expect(clippy::needless_range_loop, reason = "numbers of one pixel have one place in all arrays")]

pub(crate) mod lanes;
pub(crate) mod large;
pub(crate) mod vectors;
