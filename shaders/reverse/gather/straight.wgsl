// The paper's exposure: samples on the straight segment between its two ends, both included. Twin:
// camsim_core::temporal::paper.
#import reverse/gather/interface.wgsl
#import <slot:line>

struct Ends {
    first_px: vec2<f32>,
    last_px: vec2<f32>,
    inside: bool,
}

fn exposure_ends(pixel: vec2<u32>, ray: Ray) -> Ends {
    let first = temporal_inverse(ray.uv, pose_at_node(pixel, 0u));
    let last = temporal_inverse(ray.uv, pose_at_node(pixel, 1u));
    return Ends(first.at_px, last.at_px, first.inside && last.inside);
}

// Place of sample i along the segment.
fn sample_share(i: u32) -> f32 {
    return select(f32(i) / f32(max(frame.max_samples, 2u) - 1u), 0.5, frame.max_samples < 2u);
}

fn gather(pixel: vec2<u32>, ray: Ray) -> Gathered {
    let ends = exposure_ends(pixel, ray);
    // What lies between two places of the frame lies in the frame: clamping the ends serves all samples.
    let size = vec2<f32>(textureDimensions(ideal_color));
    let last = vec2<f32>(frame.ideal_size_px) - 1.0;
    let first_at = (clamp(ends.first_px, vec2<f32>(0.0), last) + 0.5) / size;
    let last_at = (clamp(ends.last_px, vec2<f32>(0.0), last) + 0.5) / size;
    var sum = vec3<f32>(0.0);
    let samples = told(frame.max_samples);
    for (var i = 0u; i < samples; i++) {
        sum += textureSampleLevel(ideal_color, ideal_sampler, mix(first_at, last_at, sample_share(i)), 0.0).rgb;
    }
    return Gathered(vec4<f32>(sum / f32(frame.max_samples), 1.0), ends.inside, array(ends.first_px, ends.last_px));
}

// Source at exposure phase in [-0.5, 0.5], on the very path that `gather` samples.
fn source_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Source {
    let ends = exposure_ends(pixel, ray);
    let at_px = mix(ends.first_px, ends.last_px, clamp(phase + 0.5, 0.0, 1.0));
    return Source(at_px, 0.0, ends.inside, at_px);
}
