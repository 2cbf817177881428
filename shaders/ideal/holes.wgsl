// Holes where a picture's alpha is below the cut-off. Each sample of a pixel looks for itself, so that a
// hole's border is one as a triangle's is. Twin: camsim_core::scene::Mesh::shows.
#import ideal/mesh_surface.wgsl

// The picture at its full size, at a sample's place.
fn is_hole(sample_uv: vec2<f32>, sample_alpha: f32) -> bool {
    return textureSampleLevel(surface_texture, surface_sampler, sample_uv, 0.0).a * sample_alpha < material.emissive_cutoff.w;
}
