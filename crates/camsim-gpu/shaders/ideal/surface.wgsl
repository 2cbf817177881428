// Shared by all surfaces of the ideal frame: camera, texture filter, fog.
#import ideal/camera.wgsl

struct Surface {
    @builtin(position) clip: vec4<f32>,
    // At the pixel centre.
    @location(0) uv: vec2<f32>,
    @location(1) in_camera_m: vec3<f32>,
}

// `from_base_m`: as in ideal/camera.wgsl.
fn project_surface(from_base_m: vec3<f32>, uv: vec2<f32>) -> Surface {
    let in_camera_m = key_camera_from_base(from_base_m);
    return Surface(ideal_clip(in_camera_m), uv, in_camera_m);
}

// Texture coordinates within the triangle, which may not cover the pixel centre: the `centroid` slot.
#import <slot:centroid>

// Texture access: the `texture` slot, one GPU texture or tiles. The filter itself is the `prefilter` slot,
// with as many taps as the tolerance of the picture asks for. It is not the adapter's anisotropic filter,
// because those are approximations that differ. Twin: camsim_core::scene::Prefilter.
#import <slot:texture>
@group(1) @binding(1) var surface_sampler: sampler;

// Footprint of a pixel on the texture, as an ellipse in texels.
struct Footprint {
    size_texels: vec2<f32>,
    // Lengths of its axes.
    longer: f32,
    shorter: f32,
    // Direction of the longer axis.
    direction: vec2<f32>,
}

fn pixel_footprint(uv: vec2<f32>) -> Footprint {
    let size_texels = texture_size();
    let dx = dpdx(uv) * size_texels;
    let dy = dpdy(uv) * size_texels;
    // The axes are the singular values of [dx dy]: square roots of the eigenvalues of the symmetric [[a, b],
    // [b, c]].
    let a = dx.x * dx.x + dy.x * dy.x;
    let b = dx.x * dx.y + dy.x * dy.y;
    let c = dx.y * dx.y + dy.y * dy.y;
    let mean = 0.5 * (a + c);
    let spread = sqrt(0.25 * (a - c) * (a - c) + b * b);
    // Of the two expressions of the eigenvector, the one without cancellation.
    let from_x = vec2<f32>(0.5 * (a - c) + spread, b);
    let from_y = vec2<f32>(b, 0.5 * (c - a) + spread);
    let unnormalised = select(from_y, from_x, a >= c);
    // A circle has no longer axis: any direction serves.
    let direction = select(
        vec2<f32>(1.0, 0.0), unnormalised / max(length(unnormalised), 1e-20), spread > 1e-6 * mean
    );
    return Footprint(size_texels, sqrt(mean + spread), sqrt(max(mean - spread, 0.0)), direction);
}

// A mip level, or a blend of two.
struct MipLevel {
    // Variance (times 12) beyond that of bilinear texels, texels^2.
    variance: f32,
    level: f32,
}

// Taps up to this distance apart, texels, need no coarser mip level.
const CLOSE_TEXELS: f32 = 0.8;
// Variance (times 12) of the mip level for taps a texel apart. It is more than the 1 of their cell, because
// frequencies that a tap passes between the cells alias.
const CELL_VARIANCE: f32 = 1.5;

// Mip level for taps `cell` texels apart. Level n has the variance 3 (4^n - 1), blended between whole levels.
fn mip_level_for(cell: f32) -> MipLevel {
    let is_close = cell <= CLOSE_TEXELS;
    let variance = select(CELL_VARIANCE * cell * cell, 0.0, is_close);
    let texels2 = variance / 3.0 + 1.0;
    // Half of the binary exponent, rounded down, and 4 to its negative, from the bits: on llvmpipe a
    // logarithm costs as much as a tap. texels2 is at least 1.
    let level_below = ((bitcast<u32>(texels2) >> 23u) - 127u) >> 1u;
    let level = f32(level_below) + (texels2 * bitcast<f32>((127u - 2u * level_below) << 23u) - 1.0) / 3.0;
    // Exactly 0 reads one level instead of two.
    return MipLevel(variance, select(level, 0.0, is_close));
}

#import <slot:prefilter>

// Fog is a slot, since a condition would cost as much as what it skips.
#import <slot:fog>
