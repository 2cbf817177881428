// Two polynomials join all nodes: written out, so that a thread can hold their poses.
const STRETCHES: u32 = 2u;

fn gather(pixel: vec2<u32>, ray: Ray) -> Gathered {
    let area = footprint(ray);
    let at_least = (area.taps.x * area.taps.y + 1u) / 2u;
    let source = first_node(pixel, ray);
    let former = curve_from(source, pixel, ray, 0u);
    let latter = curve_from(former.end, pixel, ray, STEPS);
    let count = samples_for(former.length_px, at_least);
    let color = mean_along(former, count, area, 0u) + mean_along(latter, samples_for(latter.length_px, at_least), area, count);
    return Gathered(0.5 * color, former.inside && latter.inside, array(source.far_px, latter.end.far_px));
}

// Source at exposure phase in [-0.5, 0.5], on the very path that `gather` samples.
fn source_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Source {
    if (phase == 0.0) {
        return temporal_inverse(ray.uv, pose_of_mid(pixel));
    }
    let former = curve_from(first_node(pixel, ray), pixel, ray, 0u);
    let latter = curve_from(former.end, pixel, ray, STEPS);
    let gone = 2.0 * clamp(phase + 0.5, 0.0, 1.0);
    var source = former.end;
    source.at_px = along(former, f32(STEPS) * gone);
    source.inside = former.inside;
    if (gone >= 1.0) {
        source = latter.end;
        source.at_px = along(latter, f32(STEPS) * (gone - 1.0));
        source.inside = latter.inside;
    }
    return source;
}
