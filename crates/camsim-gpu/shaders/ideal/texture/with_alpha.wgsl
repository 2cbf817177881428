// Texture with alpha, and its mip levels, in one GPU texture.
@group(1) @binding(0) var surface_texture: texture_2d<f32>;

// Premultiplied colour and alpha: only these may be averaged.
alias Texel = vec4<f32>;

// Size, texels.
fn texture_size() -> vec2<f32> {
    return vec2<f32>(textureDimensions(surface_texture));
}

fn sample_texture(uv: vec2<f32>, level: f32) -> vec4<f32> {
    let texel = textureSampleLevel(surface_texture, surface_sampler, uv, level);
    return vec4<f32>(texel.rgb * texel.a, texel.a);
}
