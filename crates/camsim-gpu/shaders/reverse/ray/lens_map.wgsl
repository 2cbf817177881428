// Ray of a distorting lens, from the lens map.
#import reverse/ray/interface.wgsl

@group(2) @binding(0) var lens_map: texture_2d<f32>;

// Larger values mean that the pixel has no ideal ray; see reverse/lens_inverse/lens.wgsl.
const INVALID_ABOVE: f32 = 1e29;

// By the nearest-texel sampler: on llvmpipe textureLoad computes a level of detail per lane.
fn lens_map_uv(pixel: vec2<i32>) -> vec2<f32> {
    let pixel_i = (vec2<f32>(pixel) + 0.5) * (1.0 / vec2<f32>(textureDimensions(lens_map)));
    return textureSampleLevel(lens_map, texel_sampler, pixel_i, 0.0).xy;
}

// One-sided or central difference of the map along `step`, over valid texels only.
fn lens_map_difference(pixel: vec2<i32>, step: vec2<i32>, centre: vec2<f32>) -> vec2<f32> {
    let last = vec2<i32>(frame.size_px) - 1;
    let after_at = min(pixel + step, last);
    let before_at = max(pixel - step, vec2<i32>(0));
    let after = lens_map_uv(after_at);
    let before = lens_map_uv(before_at);
    let has_after = after.x < INVALID_ABOVE && any(after_at != pixel);
    let has_before = before.x < INVALID_ABOVE && any(before_at != pixel);
    if (has_after && has_before) {
        return 0.5 * (after - before);
    }
    if (has_after) {
        return after - centre;
    }
    if (has_before) {
        return centre - before;
    }
    return vec2<f32>(0.0);
}

fn lens_ray(pixel: vec2<u32>) -> Ray {
    let pixel_i = vec2<i32>(pixel);
    let uv = lens_map_uv(pixel_i);
    if (uv.x >= INVALID_ABOVE) {
        return Ray(vec2<f32>(0.0), vec2<f32>(0.0), vec2<f32>(0.0), false);
    }
    return Ray(
        uv,
        lens_map_difference(pixel_i, vec2<i32>(1, 0), uv),
        lens_map_difference(pixel_i, vec2<i32>(0, 1), uv),
        true,
    );
}
