// No exposure: footprint taps around one source.
#import reverse/gather/footprint.wgsl
#import <slot:line>

// Steps of the path over the exposure.
const STEPS: u32 = 0u;
const STRETCHES: u32 = 1u;

fn gather(pixel: vec2<u32>, ray: Ray) -> Gathered {
    let source = temporal_inverse(ray.uv, pose_of_mid(pixel));
    let area = footprint(ray);
    let taps = area.taps.x * area.taps.y;
    var sum = vec4<f32>(0.0);
    let reads = reads_of(area, taps);
    for (var i = 0u; i < reads; i++) {
        sum += tap_color(area, source.at_px, sample_of(area, i), i);
    }
    return Gathered(sum / f32(taps), source.inside, array(source.far_px, source.far_px));
}

// Source at exposure phase in [-0.5, 0.5]: without exposure all phases are one.
fn source_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Source {
    return temporal_inverse(ray.uv, pose_of_mid(pixel));
}
