// No silhouette can be in view: the plain gather stands.
fn list_for_rays(pixel: vec2<u32>, ray: Ray, plain: Gathered) {}
