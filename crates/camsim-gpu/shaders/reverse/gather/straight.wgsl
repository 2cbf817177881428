// The paper's exposure: samples on the straight segment between its two ends, both included. Twin:
// camsim_core::temporal::paper.
#import reverse/gather/interface.wgsl
#import <slot:line_poses>

struct Ends {
    first_px: vec2<f32>,
    last_px: vec2<f32>,
    inside: bool,
}

fn exposure_ends(pixel: vec2<u32>, ray: Ray) -> Ends {
    let first = temporal_inverse(ray.uv, table_pose(pixel, 0u));
    let last = temporal_inverse(ray.uv, table_pose(pixel, 1u));
    return Ends(first.position_px, last.position_px, first.inside && last.inside);
}

// Position of sample i along the segment, 0 to 1.
fn sample_fraction(i: u32) -> f32 {
    return select(f32(i) / f32(max(frame.max_samples, 2u) - 1u), 0.5, frame.max_samples < 2u);
}

fn gather(pixel: vec2<u32>, ray: Ray) -> Gathered {
    let ends = exposure_ends(pixel, ray);
    // A segment between two positions in the frame lies in the frame: clamping the ends is enough.
    let size = vec2<f32>(textureDimensions(ideal_color));
    let last = vec2<f32>(frame.ideal_size_px) - 1.0;
    let first_uv = (clamp(ends.first_px, vec2<f32>(0.0), last) + 0.5) / size;
    let last_uv = (clamp(ends.last_px, vec2<f32>(0.0), last) + 0.5) / size;
    var sum = vec3<f32>(0.0);
    let samples = unspecialised(frame.max_samples);
    for (var i = 0u; i < samples; i++) {
        sum += textureSampleLevel(
            ideal_color, ideal_sampler, mix(first_uv, last_uv, sample_fraction(i)), 0.0
        ).rgb;
    }
    return Gathered(
        vec4<f32>(sum / f32(frame.max_samples), 1.0), ends.inside, array(ends.first_px, ends.last_px)
    );
}

// Source at exposure phase in [-0.5, 0.5], on the same path that `gather` samples.
fn source_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Source {
    let ends = exposure_ends(pixel, ray);
    let position_px = mix(ends.first_px, ends.last_px, clamp(phase + 0.5, 0.0, 1.0));
    return Source(position_px, 0.0, ends.inside, position_px);
}
