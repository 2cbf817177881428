// The picture and its smaller versions in one texture.
@group(1) @binding(0) var surface_texture: texture_2d<f32>;

// What is read of it.
alias Texel = vec3<f32>;

// Texels.
fn picture_size() -> vec2<f32> {
    return vec2<f32>(textureDimensions(surface_texture));
}

fn picture_read(uv: vec2<f32>, level: f32) -> vec3<f32> {
    return textureSampleLevel(surface_texture, surface_sampler, uv, level).rgb;
}
