// The picture and its smaller versions in one texture, with its alpha.
@group(1) @binding(0) var surface_texture: texture_2d<f32>;

// What is read of it: colour times alpha, and alpha. Only so may reads be averaged.
alias Texel = vec4<f32>;

// Texels.
fn picture_size() -> vec2<f32> {
    return vec2<f32>(textureDimensions(surface_texture));
}

fn picture_read(uv: vec2<f32>, level: f32) -> vec4<f32> {
    let read = textureSampleLevel(surface_texture, surface_sampler, uv, level);
    return vec4<f32>(read.rgb * read.a, read.a);
}
