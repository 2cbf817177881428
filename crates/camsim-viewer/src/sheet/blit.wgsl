// A picture's codes, as they are, into a part of the window.

struct Part {
    // Share of the picture at the part's top left, and at its bottom right.
    first: vec2<f32>,
    last: vec2<f32>,
};

@group(0) @binding(0) var<uniform> part: Part;
@group(0) @binding(1) var picture: texture_2d<f32>;
@group(0) @binding(2) var way: sampler;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
};

@vertex
fn corner(@builtin(vertex_index) index: u32) -> Corner {
    let share = vec2<f32>(f32(index & 1u), f32(index >> 1u));
    return Corner(vec4<f32>(2.0 * share.x - 1.0, 1.0 - 2.0 * share.y, 0.0, 1.0), mix(part.first, part.last, share));
}

@fragment
fn codes(at: Corner) -> @location(0) vec4<f32> {
    return textureSampleLevel(picture, way, at.uv, 0.0);
}
