// Alpha mask (glTF alphaMode MASK): no surface where the texture's alpha is below the cut-off. It is
// evaluated per sample, so that the border of a hole is antialiased like that of a triangle. Twin:
// camsim_core::scene::Mesh::shows.
#import ideal/mesh_surface.wgsl

// Reads the full-size texture at the position of the sample.
fn is_masked_out(sample_uv: vec2<f32>, sample_alpha: f32) -> bool {
    return textureSampleLevel(surface_texture, surface_sampler, sample_uv, 0.0).a
        * sample_alpha < material.emissive_cutoff.w;
}
