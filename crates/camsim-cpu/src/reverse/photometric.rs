//! Vignette, brightness, noise and saturation: twin of camsim-gpu/shaders/reverse/photometric.wgsl and
//! camsim-gpu/shaders/common/noise.wgsl.

use camsim_core::{
    noise::{NOISE_STREAM, SEGMENTS, pcg4d},
    scene::LUMINANCE,
};

use super::sideways::is_sideways;
use crate::simd::lanes::{LANES, Lanes, ZERO, clamp_to, per_lane};
use camsim_plan::uniforms::FrameUniforms;

/// Photometric stage of pixels of a line, from `x` on.
#[inline(always)]
pub(super) fn photometric(
    frame: &FrameUniforms,
    segments: &[[f32; 2]],
    [x, y]: [u32; 2],
    colors: &[[f32; 4]; LANES],
    weight: &Lanes,
) -> [Lanes; 3] {
    // No `map` here and below: its closure may be compiled without the enabled vector instructions.
    let mut values = [per_lane(|i| colors[i][0]), per_lane(|i| colors[i][1]), per_lane(|i| colors[i][2])];
    let is_mono = frame.mono == 1;
    if is_mono {
        let [r, g, b] = &values;
        values = [per_lane(|i| r[i] * LUMINANCE[0] + g[i] * LUMINANCE[1] + b[i] * LUMINANCE[2]); 3];
    }
    let mut noise = [ZERO; 3];
    if frame.noise_sigma > 0.0 {
        let normals = normals(frame, segments, x, y, if is_mono { 1 } else { 3 });
        noise = if is_mono { [normals[0]; 3] } else { normals };
    }
    for (value, noise) in values.iter_mut().zip(&noise) {
        *value = per_lane(|i| {
            clamp_to(value[i] * (weight[i] * frame.light) + frame.noise_sigma * noise[i], frame.most)
        });
    }
    values
}

/// Independent standard normals for pixels of a line from `x` on, for the first `channels` of three channels.
#[inline(always)]
fn normals(frame: &FrameUniforms, segments: &[[f32; 2]], x: u32, y: u32, channels: usize) -> [Lanes; 3] {
    let mut bits = [[0_u32; LANES]; 3];
    let (first, step) = if is_sideways(frame) { (y | (x << 16), 1 << 16) } else { (x | (y << 16), 1) };
    for i in 0..LANES {
        let pixel = first + step * i as u32;
        let words = pcg4d([
            pixel,
            frame.frame_number,
            frame.seed[0],
            frame.seed[1] ^ NOISE_STREAM.wrapping_mul(0x9e37_79b9),
        ]);
        for channel in 0..3 {
            bits[channel][i] = words[channel];
        }
    }
    let mut normals = [ZERO; 3];
    for (normals, bits) in normals.iter_mut().zip(&bits).take(channels) {
        *normals = normals_from_bits(bits, segments);
    }
    normals
}

/// As `camsim_core::noise::normal_from_bits`. With the tail probability as a float, the octave is its
/// exponent and the segment part of its mantissa.
#[inline(always)]
fn normals_from_bits(bits: &[u32; LANES], segments: &[[f32; 2]]) -> Lanes {
    let mut segment = [0_u32; LANES];
    let mut t = ZERO;
    for i in 0..LANES {
        // Odd and below 2^24, so exact.
        let tail = (((bits[i] >> 7) & 0x00ff_fffe) + 1) as i32 as f32;
        let number = tail.to_bits();
        let octave = 23 + 127 - (number >> 23);
        segment[i] = octave * SEGMENTS as u32 + ((number >> 19) & 15);
        t[i] = (number & 0x0007_ffff) as i32 as f32 * (1.0 / 524_288.0);
    }
    let (mut begin, mut adds) = (ZERO, ZERO);
    for i in 0..LANES {
        [begin[i], adds[i]] = segments[segment[i] as usize];
    }
    per_lane(|i| {
        let value = begin[i] + t[i] * adds[i];
        f32::from_bits(value.to_bits() ^ (bits[i] & 0x8000_0000))
    })
}
