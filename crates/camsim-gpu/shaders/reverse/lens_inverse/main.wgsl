// Makes the lens map: each texel holds the ideal (u, v) of its pixel's centre, or INVALID_UV twice.

@group(0) @binding(2) var lens_map: texture_storage_2d<rg32float, write>;

@compute @workgroup_size(8, 8)
fn lens_inverse(@builtin(global_invocation_id) id: vec3u) {
    let pixel = id.xy;
    if any(pixel >= lens.size_px) {
        return;
    }
    let distorted = distorted_from_pixel(pixel);
    let ideal = undistort(distorted, initial_value(pixel, distorted));
    textureStore(lens_map, pixel, vec4f(ideal.xy, 0.0, 0.0));
}
