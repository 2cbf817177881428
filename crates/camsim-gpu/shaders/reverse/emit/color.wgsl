// Output: colour only.
const EMITS_RAYS: bool = false;

@group(3) @binding(0) var<storage, read_write> out_color: array<vec4<f32>>;

fn emit(pixel: vec2<u32>, color: vec4<f32>) {
    out_color[pixel.y * frame.size_px.x + pixel.x] = color;
}

fn emit_truth(pixel: vec2<u32>, truth: Truth) {}
