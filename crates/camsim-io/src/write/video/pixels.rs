//! Code values of videos: sRGB of 8 bits, or of 16 bits for what has more.

use camsim_core::{frame::RenderedFrame, scene::srgb_from_linear_f64};

use crate::write::encode::{code16, srgb8};

/// Red, green and blue of each pixel in 8 bits.
pub(super) fn rgb8(frame: &RenderedFrame) -> Vec<u8> {
    frame.color_rgba().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]].map(srgb8)).collect()
}

/// Red, green and blue of each pixel in 16 bits, little-endian.
pub(super) fn rgb16(frame: &RenderedFrame) -> Vec<u8> {
    let code = |linear: f32| code16(srgb(linear)).to_le_bytes();
    frame.color_rgba().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]].map(code)).flatten().collect()
}

/// sRGB value, 0..=1, of a linear one; 0 for NaN.
pub(super) fn srgb(linear: f32) -> f32 {
    if linear.is_nan() { 0.0 } else { srgb_from_linear_f64(f64::from(linear.clamp(0.0, 1.0))) as f32 }
}
