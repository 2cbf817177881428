// Opaque texture and its mip levels in one GPU texture.
@group(1) @binding(0) var surface_texture: texture_2d<f32>;

// Linear colour.
alias Texel = vec3<f32>;

// Size, texels.
fn texture_size() -> vec2<f32> {
    return vec2<f32>(textureDimensions(surface_texture));
}

fn sample_texture(uv: vec2<f32>, level: f32) -> vec3<f32> {
    return textureSampleLevel(surface_texture, surface_sampler, uv, level).rgb;
}
