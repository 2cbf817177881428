// No silhouette can be in view: the plain gather stands.
fn gather_edges(pixel: vec2<u32>, ray: Ray, plain: Gathered) -> Gathered {
    return plain;
}
