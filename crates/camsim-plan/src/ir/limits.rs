//! Sizes and distances that plans and renderers agree on.

pub use camsim_core::temporal::MAX_KEYS;

/// Nearest distance that the ideal frame can show, metres.
pub const NEAR_M: f64 = 0.05;
/// Allocated heights are multiples of this.
pub const SIZE_QUANTUM_PX: u32 = 64;
/// Most pixels of the ideal frames of one output frame: at 12 bytes a pixel, for colour and depth, 0.8 GB.
/// What silhouettes take besides has a bound of its own.
pub const MAX_IDEAL_PX: u64 = 1 << 26;
