// Two polynomials join all nodes. Unrolled, so that a thread can cache their poses.
const SEGMENTS: u32 = 2u;

fn gather(pixel: vec2<u32>, ray: Ray) -> Gathered {
    let pixel_footprint = footprint(ray);
    let min_samples = (pixel_footprint.taps.x * pixel_footprint.taps.y + 1u) / 2u;
    let source = first_node(pixel, ray);
    let first = curve_from(source, pixel, ray, 0u);
    let second = curve_from(first.end, pixel, ray, SEGMENT_STEPS);
    let count = samples_for(first.length_px, min_samples);
    let color = mean_color_along(first, count, pixel_footprint, 0u)
        + mean_color_along(second, samples_for(second.length_px, min_samples), pixel_footprint, count);
    return Gathered(0.5 * color, first.inside && second.inside, array(source.far_px, second.end.far_px));
}

// Source at exposure phase in [-0.5, 0.5], on the same path that `gather` samples.
fn source_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Source {
    if (phase == 0.0) {
        return temporal_inverse(ray.uv, mid_pose(pixel));
    }
    let first = curve_from(first_node(pixel, ray), pixel, ray, 0u);
    let second = curve_from(first.end, pixel, ray, SEGMENT_STEPS);
    let segment_position = 2.0 * clamp(phase + 0.5, 0.0, 1.0);
    var source = first.end;
    source.position_px = position_on_curve(first, f32(SEGMENT_STEPS) * segment_position);
    source.inside = first.inside;
    if (segment_position >= 1.0) {
        source = second.end;
        source.position_px = position_on_curve(second, f32(SEGMENT_STEPS) * (segment_position - 1.0));
        source.inside = second.inside;
    }
    return source;
}
