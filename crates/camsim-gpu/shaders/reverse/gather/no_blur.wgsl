// No motion blur: taps around one source.
#import reverse/gather/footprint.wgsl
#import <slot:line_poses>

// Steps of the path over the exposure.
const SEGMENT_STEPS: u32 = 0u;
const SEGMENTS: u32 = 1u;

fn gather(pixel: vec2<u32>, ray: Ray) -> Gathered {
    let source = temporal_inverse(ray.uv, mid_pose(pixel));
    let pixel_footprint = footprint(ray);
    let taps = pixel_footprint.taps.x * pixel_footprint.taps.y;
    var sum = vec4<f32>(0.0);
    let reads_total = read_count(pixel_footprint, taps);
    for (var i = 0u; i < reads_total; i++) {
        sum += tap_color(pixel_footprint, source.position_px, sample_index(pixel_footprint, i), i);
    }
    return Gathered(sum / f32(taps), source.inside, array(source.far_px, source.far_px));
}

// Source at exposure phase in [-0.5, 0.5]: without exposure it does not depend on the phase.
fn source_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Source {
    return temporal_inverse(ray.uv, mid_pose(pixel));
}
