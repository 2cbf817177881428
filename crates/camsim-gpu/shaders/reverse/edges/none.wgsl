// No silhouette can be in view: the plain gather is final.
fn list_for_rays(pixel: vec2<u32>, ray: Ray, gathered: Gathered) {}
