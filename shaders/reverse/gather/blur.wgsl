// Exposure: mean over the true path of the source, in linear light (paper eq. 20 without its straight line).
// Nodes are solved one after the other (the `nodes` slot says with what depth) and joined by polynomials of time (the `path` slot says of what
// degree), each of which is sampled at uniform midpoints, as many as its length asks for.
// Twin: camsim_core::temporal::gather.
#import reverse/gather/footprint.wgsl
#import <slot:nodes>
#import <slot:path>

fn samples_for(length_px: f32, at_least: u32) -> u32 {
    let wanted = u32(ceil(min(frame.samples_per_px * length_px, length_px + 16.0)));
    return clamp(wanted, at_least, max(frame.max_samples, at_least));
}

// Steps of the pose table along one polynomial, and how many polynomials there are.
fn nodes_of_stretch() -> u32 {
    return STEPS * frame.node_stride;
}

fn stretch_count() -> u32 {
    return told((frame.nodes - 1u) / nodes_of_stretch());
}

fn gather(pixel: vec2<u32>, ray: Ray) -> Gathered {
    let area = footprint(ray);
    let taps = area.taps.x * area.taps.y;
    let stretches = stretch_count();
    let at_least = (taps + stretches - 1u) / stretches;
    var sum = vec4<f32>(0.0);
    var inside = true;
    var tap = 0u;
    var source = first_node(pixel, ray);
    let first_far_px = source.far_px;
    for (var k = 0u; k < stretches; k++) {
        let curve = curve_from(source, pixel, ray, k * nodes_of_stretch());
        inside = inside && curve.inside;
        let count = samples_for(curve.length_px, at_least);
        var part = vec4<f32>(0.0);
        for (var i = 0u; i < count; i++) {
            part += tap_color(area, along(curve, f32(STEPS) * (f32(i) + 0.5) / f32(count)), tap);
            tap++;
        }
        sum += part / f32(count);
        source = curve.end;
    }
    return Gathered(sum / f32(stretches), inside, array(first_far_px, source.far_px));
}

// Source at exposure phase in [-0.5, 0.5], on the very path that `gather` samples.
fn source_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Source {
    if (phase == 0.0) {
        return temporal_inverse(ray.uv, pose_mid(pixel));
    }
    let gone = clamp(phase + 0.5, 0.0, 1.0) * f32(stretch_count());
    let k = min(u32(gone), stretch_count() - 1u);
    var curve = curve_from(first_node(pixel, ray), pixel, ray, 0u);
    for (var i = 1u; i <= k; i++) {
        curve = curve_from(curve.end, pixel, ray, i * nodes_of_stretch());
    }
    var source = curve.end;
    source.at_px = along(curve, f32(STEPS) * (gone - f32(k)));
    source.inside = curve.inside;
    return source;
}
