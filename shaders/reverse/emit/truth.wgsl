// Picture, depth and coordinates.
const EMITS_RAYS: bool = true;

@group(3) @binding(0) var<storage, read_write> out_color: array<vec4<f32>>;

struct Truth {
    // Ideal ray.
    uv: vec2<f32>,
    // Source in the mid-window ideal frame, pixels, at `frame.coords_phase`.
    source_px: vec2<f32>,
    // The ray's point in NED at mid-exposure, metres; NaN-free: 0 where nothing is.
    point_ned_m: vec3<f32>,
    // Planar depth in the line's own camera at mid-exposure, metres; 0 = nothing there; below 0: not known, the host casts a ray.
    depth_m: f32,
}

@group(3) @binding(1) var<storage, read_write> out_truth: array<Truth>;

fn emit(pixel: vec2<u32>, color: vec4<f32>) {
    out_color[pixel.y * frame.size_px.x + pixel.x] = color;
}

// `source_px` at `frame.coords_phase`, `mid` at mid-exposure.
fn emit_truth(pixel: vec2<u32>, ray: Ray, source_px: vec2<f32>, mid: Seen) {
    var truth = Truth(ray.uv, source_px, vec3<f32>(0.0), 0.0);
    if (mid.inverse_depth > 0.0 && mid.point.w > 0.0) {
        truth.depth_m = 1.0 / mid.inverse_depth;
        // On the key ray of the source, at the depth found there: no absolute pose is differenced in f32.
        let p = mid.point.xyz / mid.point.w;
        truth.point_ned_m = frame.key_position_ned_m.xyz
            + p.x * frame.ned_from_key_x.xyz + p.y * frame.ned_from_key_y.xyz + p.z * frame.ned_from_key_z.xyz;
    }
    out_truth[pixel.y * frame.size_px.x + pixel.x] = truth;
}

// Of what a ray in f64 is to tell.
fn emit_unknown(pixel: vec2<u32>, ray: Ray) {
    out_truth[pixel.y * frame.size_px.x + pixel.x] = Truth(ray.uv, vec2<f32>(0.0), vec3<f32>(0.0), -1.0);
}

fn emit_no_truth(pixel: vec2<u32>) {
    out_truth[pixel.y * frame.size_px.x + pixel.x] = Truth(vec2<f32>(0.0), vec2<f32>(0.0), vec3<f32>(0.0), 0.0);
}
