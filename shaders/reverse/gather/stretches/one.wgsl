// One polynomial joins all nodes: no loop, which on llvmpipe costs more than its body.
const STRETCHES: u32 = 1u;

fn gather(pixel: vec2<u32>, ray: Ray) -> Gathered {
    let area = footprint(ray);
    let source = first_node(pixel, ray);
    let curve = curve_from(source, pixel, ray, 0u);
    let color = mean_along(curve, samples_for(curve.length_px, area.taps.x * area.taps.y), area, 0u);
    return Gathered(color, curve.inside, array(source.far_px, curve.end.far_px));
}

// Source at exposure phase in [-0.5, 0.5], on the very path that `gather` samples.
fn source_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Source {
    if (phase == 0.0) {
        return temporal_inverse(ray.uv, pose_of_mid(pixel));
    }
    let curve = curve_from(first_node(pixel, ray), pixel, ray, 0u);
    var source = curve.end;
    source.at_px = along(curve, f32(STEPS) * clamp(phase + 0.5, 0.0, 1.0));
    source.inside = curve.inside;
    return source;
}
