// No silhouette can be in view: the plain gather stands.
#import reverse/edges/seen.wgsl

fn gather_edges(pixel: vec2<u32>, ray: Ray, plain: Gathered) -> Gathered {
    return plain;
}

fn seen_at_phase(pixel: vec2<u32>, ray: Ray, phase: f32) -> Seen {
    return smooth_at_phase(pixel, ray, phase);
}
