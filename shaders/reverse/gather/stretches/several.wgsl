// Several polynomials, one after the other.
fn stretch_count() -> u32 {
    return told((frame.nodes - 1u) / (STEPS * frame.node_stride));
}

fn gather(pixel: vec2<u32>, ray: Ray) -> Gathered {
    let area = footprint(ray);
    let stretches = stretch_count();
    let at_least = (area.taps.x * area.taps.y + stretches - 1u) / stretches;
    var sum = vec4<f32>(0.0);
    var inside = true;
    var tap = 0u;
    var source = first_node(pixel, ray);
    let first_far_px = source.far_px;
    for (var k = 0u; k < stretches; k++) {
        let curve = curve_from(source, pixel, ray, k * STEPS);
        inside = inside && curve.inside;
        let count = samples_for(curve.length_px, at_least);
        sum += mean_along(curve, count, area, tap);
        tap += count;
        source = curve.end;
    }
    return Gathered(sum / f32(stretches), inside, array(first_far_px, source.far_px));
}

// Source at exposure phase in [-0.5, 0.5], on the very path that `gather` samples.
fn source_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Source {
    if (phase == 0.0) {
        return temporal_inverse(ray.uv, pose_of_mid(pixel));
    }
    let gone = clamp(phase + 0.5, 0.0, 1.0) * f32(stretch_count());
    let k = min(u32(gone), stretch_count() - 1u);
    var curve = curve_from(first_node(pixel, ray), pixel, ray, 0u);
    for (var i = 1u; i <= k; i++) {
        curve = curve_from(curve.end, pixel, ray, i * STEPS);
    }
    var source = curve.end;
    source.at_px = along(curve, f32(STEPS) * (gone - f32(k)));
    source.inside = curve.inside;
    return source;
}
