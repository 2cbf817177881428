// One polynomial joins all nodes. No loop, which on llvmpipe costs more than its body.
const SEGMENTS: u32 = 1u;

fn gather(pixel: vec2<u32>, ray: Ray) -> Gathered {
    let pixel_footprint = footprint(ray);
    let source = first_node(pixel, ray);
    let curve = curve_from(source, pixel, ray, 0u);
    let color = mean_color_along(
        curve,
        samples_for(curve.length_px, pixel_footprint.taps.x * pixel_footprint.taps.y),
        pixel_footprint,
        0u,
    );
    return Gathered(color, curve.inside, array(source.far_px, curve.end.far_px));
}

// Source at exposure phase in [-0.5, 0.5], on the same path that `gather` samples.
fn source_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Source {
    if (phase == 0.0) {
        return temporal_inverse(ray.uv, mid_pose(pixel));
    }
    let curve = curve_from(first_node(pixel, ray), pixel, ray, 0u);
    var source = curve.end;
    source.position_px = position_on_curve(curve, f32(SEGMENT_STEPS) * clamp(phase + 0.5, 0.0, 1.0));
    source.inside = curve.inside;
    return source;
}
