//! The ideal render and the reverse pipeline on wgpu.
