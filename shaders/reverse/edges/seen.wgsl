// What the centre of a pixel sees at one instant, for depth and coordinates.
struct Seen {
    // Source in the mid-window ideal frame, pixels.
    reference_px: vec2<f32>,
    // Inverse planar depth in the line's own camera, 1/m; 0 = sky.
    inverse_depth: f32,
    // The point in the mid-window camera times w, and w (1/m; 0 = at infinity).
    point: vec4<f32>,
}

fn seen_from(at_px: vec2<f32>, in_line: f32, in_key: f32) -> Seen {
    return Seen(reference_px(at_px, in_key), in_line, reference_point(at_px, in_key));
}

// Where one surface is around, the solution of the temporal inverse stands, on the very path that `gather`
// samples; but the sky is where it is, whatever is beside it.
fn smooth_px_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> vec2<f32> {
    let reach_px = frame.sky_reach_px;
    frame.sky_reach_px = 0.0;
    let at_px = source_at_phase(pixel, ray, phase).at_px;
    frame.sky_reach_px = reach_px;
    return reference_px(at_px, inverse_depth(at_px));
}

fn smooth_mid(pixel: vec2<u32>, ray: Ray) -> Seen {
    let reach_px = frame.sky_reach_px;
    frame.sky_reach_px = 0.0;
    let mid = temporal_inverse_with_depth(ray.uv, pose_of_mid(pixel));
    frame.sky_reach_px = reach_px;
    return seen_from(mid.at_px, mid.inverse_depth, inverse_depth(mid.at_px));
}

// Of a pixel, beside its colour: `camsim_gpu::layout::Truth`.
struct Truth {
    // Ideal ray.
    uv: vec2<f32>,
    // Source in the mid-window ideal frame, pixels, at `frame.coords_phase`.
    source_px: vec2<f32>,
    // The ray's point in NED at mid-exposure, metres; NaN-free: 0 where nothing is.
    point_ned_m: vec3<f32>,
    // Planar depth in the line's own camera at mid-exposure, metres; 0 = nothing there; below 0: not known,
    // the host casts a ray.
    depth_m: f32,
}

// Of a pixel that sees nothing.
fn no_truth() -> Truth {
    return Truth(vec2<f32>(0.0), vec2<f32>(0.0), vec3<f32>(0.0), 0.0);
}

// Of what a ray in f64 is to tell.
fn unknown_truth(ray: Ray) -> Truth {
    return Truth(ray.uv, vec2<f32>(0.0), vec3<f32>(0.0), -1.0);
}

// `source_px` at `frame.coords_phase`, `mid` at mid-exposure.
fn truth_of(ray: Ray, source_px: vec2<f32>, mid: Seen) -> Truth {
    var truth = Truth(ray.uv, source_px, vec3<f32>(0.0), 0.0);
    if (mid.inverse_depth > 0.0 && mid.point.w > 0.0) {
        truth.depth_m = 1.0 / mid.inverse_depth;
        // On the key ray of the source, at the depth found there: no absolute pose is differenced in f32.
        let p = mid.point.xyz / mid.point.w;
        truth.point_ned_m = frame.key_position_ned_m.xyz
            + p.x * frame.ned_from_key_x.xyz + p.y * frame.ned_from_key_y.xyz + p.z * frame.ned_from_key_z.xyz;
    }
    return truth;
}
