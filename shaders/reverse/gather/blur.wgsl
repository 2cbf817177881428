// Exposure: mean over the true path of the source, in linear light (paper eq. 20 without its straight line).
// Nodes are solved one after the other (the `nodes` slot says with what depth) and joined by polynomials of
// time (the `path` slot says of what degree, `stretches` whether there are several), each of which is sampled
// at uniform midpoints, as many as its length asks for. Twin: camsim_core::temporal::gather.
#import reverse/gather/footprint.wgsl
#import <slot:nodes>
#import <slot:path>
#import <slot:stretches>
#import <slot:line>

// The node so many steps of the path after the first.
fn node_at(pixel: vec2<u32>, ray: Ray, step: u32) -> Source {
    return next_node(ray, step * frame.node_stride, pose_of_step(pixel, step));
}

fn samples_for(length_px: f32, at_least: u32) -> u32 {
    let wanted = u32(ceil(min(frame.samples_per_px * length_px, length_px + 16.0)));
    return clamp(wanted, at_least, max(frame.max_samples, at_least));
}

// Mean of so many samples along a polynomial; `first_tap` were taken before.
fn mean_along(curve: Curve, count: u32, area: Footprint, first_tap: u32) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
    let reads = reads_of(area, count);
    let step = f32(STEPS) / f32(count);
    for (var i = 0u; i < reads; i++) {
        let sample = sample_of(area, i);
        sum += tap_color(area, along(curve, step * (f32(sample) + 0.5)), first_tap + sample, i);
    }
    return sum / f32(count);
}
