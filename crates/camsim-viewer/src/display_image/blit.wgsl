// Draws a part of an image into the viewport without conversion of its codes.

struct UvRect {
    // Texture coordinates of the top left corner and of the bottom right one.
    min: vec2<f32>,
    max: vec2<f32>,
};

@group(0) @binding(0) var<uniform> uv_rect: UvRect;
@group(0) @binding(1) var image: texture_2d<f32>;
@group(0) @binding(2) var image_sampler: sampler;

struct Corner {
    @builtin(position) position: vec4<f32>,
    @location(0) uv: vec2<f32>,
};

@vertex
fn vertex_main(@builtin(vertex_index) index: u32) -> Corner {
    let fraction = vec2<f32>(f32(index & 1u), f32(index >> 1u));
    let position = vec4<f32>(2.0 * fraction.x - 1.0, 1.0 - 2.0 * fraction.y, 0.0, 1.0);
    return Corner(position, mix(uv_rect.min, uv_rect.max, fraction));
}

@fragment
fn fragment_main(corner: Corner) -> @location(0) vec4<f32> {
    return textureSampleLevel(image, image_sampler, corner.uv, 0.0);
}
