// Exposure: mean over the true path of the source, in linear light (paper eq. 20 without its straight line).
// Nodes are solved exactly; between two nodes the path is straight and sampled at uniform midpoints, as many as its length asks for.
// Where surfaces of different depth meet, each sample is solved on its own.
// Twin: camsim_core::temporal::gather.
#import reverse/gather/footprint.wgsl

// Parallax between the surfaces around a source, over the exposure, beyond which samples are solved one by one.
const EDGE_PARALLAX_PX: f32 = 0.25;

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
    var pose = pose_at_node(pixel, 0u);
    var source = temporal_inverse(ray.uv, pose);
    for (var k = 0u; k < segments; k++) {
        let next_pose = pose_at_node(pixel, k + 1u);
        let next = temporal_inverse(ray.uv, next_pose);
        inside = inside && source.inside && next.inside;
        let count = samples_for(distance(source.at_px, next.at_px), at_least);
        let edge = max(source.spread, next.spread) * frame.exposure_travel_px_m > EDGE_PARALLAX_PX;
        var part = vec4<f32>(0.0);
        for (var i = 0u; i < count; i++) {
            let t = (f32(i) + 0.5) / f32(count);
            var at_px = mix(source.at_px, next.at_px, t);
            if (edge) {
                at_px = temporal_inverse(ray.uv, mix_pose(pose, next_pose, t)).at_px;
            }
            part += tap_color(area, at_px, tap);
            tap++;
        }
        sum += part / f32(count);
        pose = next_pose;
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
    let a = temporal_inverse(ray.uv, pose_at_node(pixel, k));
    let b = temporal_inverse(ray.uv, pose_at_node(pixel, k + 1u));
    var source = a;
    source.at_px = mix(a.at_px, b.at_px, along - f32(k));
    source.inside = a.inside && b.inside;
    return source;
}
