// What every surface of the ideal frame shares: camera, fog, colour.
#import ideal/camera.wgsl

struct Surface {
    @builtin(position) clip: vec4<f32>,
    // At the pixel's middle.
    @location(0) uv: vec2<f32>,
    @location(1) in_camera_m: vec3<f32>,
}

// `from_base_m`: as in ideal/camera.wgsl.
fn project_surface(from_base_m: vec3<f32>, uv: vec2<f32>) -> Surface {
    let p = in_ideal_camera(from_base_m);
    return Surface(ideal_clip(p), uv, p);
}

// Where a pixel's triangle is, of which its middle may be outside: the `covered` slot.
#import <slot:covered>

// What reads the picture about a place, of which the middle's neighbours tell how large a pixel is: the
// `reads` slot, with as many reads as the picture's error asks for. Own code, because adapters' anisotropic
// filters are each their own approximation. Twin: camsim_core::scene::Prefilter. Where the
// picture is: the `picture` slot, in one texture or in tiles.
#import <slot:picture>
@group(1) @binding(1) var surface_sampler: sampler;

// The ellipse that stands for a pixel on the picture, texels.
struct Pixel {
    size: vec2<f32>,
    // Its axes.
    longer: f32,
    shorter: f32,
    // Direction of the longer one.
    along: vec2<f32>,
}

fn pixel_at(uv: vec2<f32>) -> Pixel {
    let size = picture_size();
    let dx = dpdx(uv) * size;
    let dy = dpdy(uv) * size;
    // The axes are the singular values of [dx dy]: roots of the eigenvalues of the symmetric [[a, b], [b,
    // c]].
    let a = dx.x * dx.x + dy.x * dy.x;
    let b = dx.x * dx.y + dy.x * dy.y;
    let c = dx.y * dx.y + dy.y * dy.y;
    let mean = 0.5 * (a + c);
    let spread = sqrt(0.25 * (a - c) * (a - c) + b * b);
    // Of the two expressions of the eigenvector, the one without cancellation.
    let along_x = vec2<f32>(0.5 * (a - c) + spread, b);
    let along_y = vec2<f32>(b, 0.5 * (c - a) + spread);
    let both = select(along_y, along_x, a >= c);
    // A circle has no longer axis: any will do.
    let along = select(vec2<f32>(1.0, 0.0), both / max(length(both), 1e-20), spread > 1e-6 * mean);
    return Pixel(size, sqrt(mean + spread), sqrt(max(mean - spread, 0.0)), along);
}

// What a read is of.
struct Version {
    // Its variance (times 12) beyond what the picture has between its texels, texels^2.
    variance: f32,
    level: f32,
}

// Reads this far apart, texels, or less need no smaller version of the picture.
const CLOSE_TEXELS: f32 = 0.8;
// Variance (times 12) of the version for reads a texel apart: more than the 1 of their cell, because what a
// read lets through between the cells comes back as another wave.
const CELL_VARIANCE: f32 = 1.5;

// For reads `cell` texels apart. A version of 2^level texels has the variance 3 (4^level - 1), one between
// two whole levels a mixture.
fn version_for(cell: f32) -> Version {
    let close = cell <= CLOSE_TEXELS;
    let variance = select(CELL_VARIANCE * cell * cell, 0.0, close);
    let texels2 = variance / 3.0 + 1.0;
    // Half of its exponent, rounded down, and 4 to the minus that: by bits, since logarithms cost as much as
    // a read on llvmpipe. Not below 1.
    let below = ((bitcast<u32>(texels2) >> 23u) - 127u) >> 1u;
    let level = f32(below) + (texels2 * bitcast<f32>((127u - 2u * below) << 23u) - 1.0) / 3.0;
    // Exactly 0 needs one version instead of two.
    return Version(variance, select(level, 0.0, close));
}

#import <slot:reads>

// What arrives from a place of a colour: a slot, since a condition would cost what it leaves out.
#import <slot:fog>
