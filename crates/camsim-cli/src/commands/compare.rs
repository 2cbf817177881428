//! `camsim compare`.
