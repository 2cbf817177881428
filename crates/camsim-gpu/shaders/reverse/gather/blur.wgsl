// Exposure: mean over the true path of the source, in linear light (paper eq. 20 without its straight line).
// The nodes are solved in order of time (the `nodes` slot: with what depth) and joined by polynomials of time
// (the `path` slot: their degree; the `segments` slot: their number). Each is sampled at uniform midpoints,
// with a number that follows from its length. Twin: camsim_core::temporal::gather.
#import reverse/gather/footprint.wgsl
#import <slot:nodes>
#import <slot:path>
#import <slot:segments>
#import <slot:line_poses>

// Node `step` steps of the path after the first.
fn node_at_step(pixel: vec2<u32>, ray: Ray, step: u32) -> Source {
    return next_node(ray, step * frame.node_stride, pose_at_step(pixel, step));
}

fn samples_for(length_px: f32, min_samples: u32) -> u32 {
    let sample_count = u32(ceil(min(frame.samples_per_px * length_px, length_px + 16.0)));
    return clamp(sample_count, min_samples, max(frame.max_samples, min_samples));
}

// Mean of `count` samples along a polynomial; `first_tap` taps precede them.
fn mean_color_along(curve: Curve, count: u32, pixel_footprint: Footprint, first_tap: u32) -> vec4<f32> {
    var sum = vec4<f32>(0.0);
    let reads_total = read_count(pixel_footprint, count);
    let step = f32(SEGMENT_STEPS) / f32(count);
    for (var i = 0u; i < reads_total; i++) {
        let sample = sample_index(pixel_footprint, i);
        sum += tap_color(
            pixel_footprint, position_on_curve(curve, step * (f32(sample) + 0.5)), first_tap + sample, i
        );
    }
    return sum / f32(count);
}
