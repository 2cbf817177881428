// Counter-based noise: a pure function of (seed, frame, pixel, stream), so frames may be rendered in any
// order. Twin: camsim_core::noise.

// Piecewise linear inverse normal CDF over octaves of the tail probability
// (camsim_core::noise::tail_segments): value at the start of each segment and increment over it, one row per
// octave. It is a texture, read by the nearest-texel sampler (reverse/ideal_frame.wgsl), because llvmpipe
// reads storage buffers lane by lane.
@group(0) @binding(1) var noise_table: texture_2d<f32>;

// Jarzynski & Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020.
fn pcg4d(key: vec4<u32>) -> vec4<u32> {
    var v = key * 1664525u + 1013904223u;
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    v ^= v >> vec4<u32>(16u);
    v.x += v.y * v.w;
    v.y += v.z * v.x;
    v.z += v.x * v.y;
    v.w += v.y * v.z;
    return v;
}

// Standard normal from 32 random bits: bit 31 is the sign, bits 30..8 are the tail probability p = (m + 0.5)
// / 2^24. The low 8 bits of pcg4d have patterns and are not used. It uses multiply-add only, so it is equal
// on all machines up to rounding.
fn normal_from_bits(bits: u32) -> f32 {
    let m = (bits >> 8u) & 0x7fffffu;
    // Octave k holds p in [2^-(k+2), 2^-(k+1)); its 16 segments are linear.
    let odd = 2u * m + 1u;                    // odd, 1 .. 2^24 - 1: p = x / 2^25
    let lead = countLeadingZeros(odd) - 8u;   // 0 .. 23
    let mantissa = (odd << lead) & 0x7fffffu; // fraction of the octave, 23 bits
    let segment = mantissa >> 19u;
    let fraction = f32(mantissa & 0x7ffffu) * (1.0 / 524288.0);
    let uv = (vec2<f32>(f32(segment), f32(lead)) + 0.5) * (1.0 / vec2<f32>(textureDimensions(noise_table)));
    let segment_values = textureSampleLevel(noise_table, texel_sampler, uv, 0.0).xy;
    let value = segment_values.x + fraction * segment_values.y;
    return select(value, -value, (bits >> 31u) == 1u);
}

// Four independent standard normals of a pixel.
fn normal4(pixel: vec2<u32>, stream: u32) -> vec4<f32> {
    let bits = pcg4d(
        vec4<u32>(
            pixel.x | (pixel.y << 16u),
            frame.frame_number,
            frame.seed.x,
            frame.seed.y ^ (stream * 0x9e3779b9u),
        )
    );
    return vec4<f32>(
        normal_from_bits(bits.x), normal_from_bits(bits.y), normal_from_bits(bits.z), normal_from_bits(bits.w)
    );
}
