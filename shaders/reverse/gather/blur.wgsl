// Exposure: mean over the true path of the source, in linear light (paper eq. 20 without its straight line).
// Nodes are solved one after the other (the `nodes` slot says with what depth); between two nodes the path is straight and sampled at uniform
// midpoints, as many as its length asks for.
// Twin: camsim_core::temporal::gather.
#import reverse/gather/footprint.wgsl
#import <slot:nodes>

fn samples_for(length_px: f32, at_least: u32) -> u32 {
    let wanted = u32(ceil(min(frame.samples_per_px * length_px, length_px + 16.0)));
    return clamp(wanted, at_least, max(frame.max_samples, at_least));
}

fn gather(pixel: vec2<u32>, ray: Ray) -> Gathered {
    let area = footprint(ray);
    let taps = area.taps.x * area.taps.y;
    let segments = frame.nodes - 1u;
    let at_least = (taps + segments - 1u) / segments;
    var sum = vec4<f32>(0.0);
    var inside = true;
    var tap = 0u;
    var source = first_node(pixel, ray);
    for (var k = 0u; k < segments; k++) {
        let next = next_node(pixel, ray, k + 1u);
        inside = inside && source.inside && next.inside;
        let count = samples_for(distance(source.at_px, next.at_px), at_least);
        var part = vec4<f32>(0.0);
        for (var i = 0u; i < count; i++) {
            let t = (f32(i) + 0.5) / f32(count);
            part += tap_color(area, mix(source.at_px, next.at_px, t), tap);
            tap++;
        }
        sum += part / f32(count);
        source = next;
    }
    return Gathered(sum / f32(segments), inside);
}

// Source at exposure phase in [-0.5, 0.5], on the very path that `gather` samples.
fn source_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Source {
    if (phase == 0.0) {
        return temporal_inverse(ray.uv, pose_mid(pixel));
    }
    let along = clamp(phase + 0.5, 0.0, 1.0) * f32(frame.nodes - 1u);
    let k = min(u32(along), frame.nodes - 2u);
    var a = first_node(pixel, ray);
    var b = a;
    for (var node = 1u; node <= k + 1u; node++) {
        a = b;
        b = next_node(pixel, ray, node);
    }
    var source = a;
    source.at_px = mix(a.at_px, b.at_px, along - f32(k));
    source.inside = a.inside && b.inside;
    return source;
}
