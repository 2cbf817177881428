// Point that the centre of a pixel sees at one instant, for depth and coordinates.
struct CentrePoint {
    // Source in the mid-window ideal frame, pixels.
    reference_px: vec2<f32>,
    // Inverse planar depth in the line's own camera, 1/m; 0 = sky.
    inverse_depth: f32,
    // The point in the mid-window camera times w, and w (1/m; 0 = at infinity).
    point: vec4<f32>,
}

fn centre_point(position_px: vec2<f32>, line_inverse_depth: f32, key_inverse_depth: f32) -> CentrePoint {
    return CentrePoint(
        reference_px(position_px, key_inverse_depth),
        line_inverse_depth,
        reference_point(position_px, key_inverse_depth),
    );
}

// Truth away from silhouettes: the solution of the temporal inverse, on the same path that `gather` samples.
// The sky-reach rule is off: the sky is at its own position, whatever surface is beside it.
fn smooth_source_px(pixel: vec2<u32>, ray: Ray, phase: f32) -> vec2<f32> {
    let reach_px = frame.sky_reach_px;
    frame.sky_reach_px = 0.0;
    let position_px = source_at_phase(pixel, ray, phase).position_px;
    frame.sky_reach_px = reach_px;
    return reference_px(position_px, inverse_depth(position_px));
}

fn smooth_centre_point(pixel: vec2<u32>, ray: Ray) -> CentrePoint {
    let reach_px = frame.sky_reach_px;
    frame.sky_reach_px = 0.0;
    let mid = temporal_inverse_with_depth(ray.uv, mid_pose(pixel));
    frame.sky_reach_px = reach_px;
    return centre_point(mid.position_px, mid.inverse_depth, inverse_depth(mid.position_px));
}

// Truth of a pixel. Mirror: `camsim_plan::uniforms::Truth`.
struct Truth {
    // Ideal ray.
    uv: vec2<f32>,
    // Source in the mid-window ideal frame, pixels, at `frame.coords_phase`.
    source_px: vec2<f32>,
    // Point that the ray sees at mid-exposure, NED metres; 0 if there is none (never NaN).
    point_ned_m: vec3<f32>,
    // Planar depth in the line's own camera at mid-exposure, metres; 0 = sky; below 0 = unknown, a ray cast
    // on the CPU determines it.
    depth_m: f32,
}

// Truth of a pixel that sees nothing.
fn no_truth() -> Truth {
    return Truth(vec2<f32>(0.0), vec2<f32>(0.0), vec3<f32>(0.0), 0.0);
}

// Truth to be determined by an f64 ray.
fn unknown_truth(ray: Ray) -> Truth {
    return Truth(ray.uv, vec2<f32>(0.0), vec3<f32>(0.0), -1.0);
}

// `source_px` is at `frame.coords_phase`, `mid` at mid-exposure.
fn pixel_truth(ray: Ray, source_px: vec2<f32>, mid: CentrePoint) -> Truth {
    var truth = Truth(ray.uv, source_px, vec3<f32>(0.0), 0.0);
    if (mid.inverse_depth > 0.0 && mid.point.w > 0.0) {
        truth.depth_m = 1.0 / mid.inverse_depth;
        // Along the key ray of the source, at the depth found there: no absolute poses are subtracted in f32.
        let point_m = mid.point.xyz / mid.point.w;
        truth.point_ned_m = frame.key_position_ned_m.xyz
            + point_m.x * frame.ned_from_key_x.xyz + point_m.y * frame.ned_from_key_y.xyz
            + point_m.z * frame.ned_from_key_z.xyz;
    }
    return truth;
}
