// No silhouette can be in view: the plain gather stands.
#import reverse/edges/seen.wgsl

fn needs_rays(pixel: vec2<u32>, ray: Ray, plain: Gathered) -> bool {
    return false;
}

fn cast_rays(thread: u32, pixel: vec2<u32>, ray: Ray, needed: bool) -> vec3<f32> {
    return vec3<f32>(0.0);
}

fn seen_px_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> vec2<f32> {
    return smooth_px_at_phase(pixel, ray, phase);
}

fn seen_mid(pixel: vec2<u32>, ray: Ray) -> Seen {
    return smooth_mid(pixel, ray);
}
