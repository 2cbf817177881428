// Several polynomials, one after the other.
fn segment_count() -> u32 {
    return unspecialised((frame.nodes - 1u) / (SEGMENT_STEPS * frame.node_stride));
}

fn gather(pixel: vec2<u32>, ray: Ray) -> Gathered {
    let pixel_footprint = footprint(ray);
    let segments = segment_count();
    let min_samples = (pixel_footprint.taps.x * pixel_footprint.taps.y + segments - 1u) / segments;
    var sum = vec4<f32>(0.0);
    var inside = true;
    var tap = 0u;
    var source = first_node(pixel, ray);
    let first_far_px = source.far_px;
    for (var k = 0u; k < segments; k++) {
        let curve = curve_from(source, pixel, ray, k * SEGMENT_STEPS);
        inside = inside && curve.inside;
        let count = samples_for(curve.length_px, min_samples);
        sum += mean_color_along(curve, count, pixel_footprint, tap);
        tap += count;
        source = curve.end;
    }
    return Gathered(sum / f32(segments), inside, array(first_far_px, source.far_px));
}

// Source at exposure phase in [-0.5, 0.5], on the same path that `gather` samples.
fn source_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Source {
    if (phase == 0.0) {
        return temporal_inverse(ray.uv, mid_pose(pixel));
    }
    let segment_position = clamp(phase + 0.5, 0.0, 1.0) * f32(segment_count());
    let k = min(u32(segment_position), segment_count() - 1u);
    var curve = curve_from(first_node(pixel, ray), pixel, ray, 0u);
    for (var i = 1u; i <= k; i++) {
        curve = curve_from(curve.end, pixel, ray, i * SEGMENT_STEPS);
    }
    var source = curve.end;
    source.position_px = position_on_curve(curve, f32(SEGMENT_STEPS) * (segment_position - f32(k)));
    source.inside = curve.inside;
    return source;
}
