//! Limits of keys that other modules use too.

/// Largest width and height of a picture. GPUs of the last decade support 16384; twice that is a typing error.
pub const MAX_SIDE_PX: u32 = 32_768;
/// Largest number of depth look-ups of `reproject`. The planner uses at most 8; a pixel that has not
/// converged after this many never does.
pub const MAX_ITERATIONS: u32 = 64;
/// Largest number of samples per pixel of path, or per exposure in the paper's preset. Two per pixel keep the
/// error below 1/255 on white texture (docs/accuracy/stress.md).
pub const MAX_BLUR_SAMPLES: u32 = 4096;
/// Largest number of footprint taps per side of a pixel; the planner uses at most 4.
pub const MAX_FOOTPRINT_TAPS: u32 = 64;
/// Largest number of output frames per ideal frame.
pub const MAX_FRAMES_PER_IDEAL: u32 = 64;
/// Largest number of ideal frames per output frame.
pub const MAX_KEY_FRAMES: u32 = 4;
/// Samples of a pixel of an ideal frame that has several.
pub const IDEAL_SAMPLES: u32 = 4;
