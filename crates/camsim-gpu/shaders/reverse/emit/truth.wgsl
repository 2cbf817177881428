// Output: colour and truth.
const EMITS_RAYS: bool = true;

@group(3) @binding(0) var<storage, read_write> out_color: array<vec4<f32>>;
// `Truth` as two vec4 per pixel: this makes two stores, which llvmpipe executes lane by lane.
@group(3) @binding(1) var<storage, read_write> out_truth: array<array<vec4<f32>, 2>>;

fn emit(pixel: vec2<u32>, color: vec4<f32>) {
    out_color[pixel.y * frame.size_px.x + pixel.x] = color;
}

fn emit_truth(pixel: vec2<u32>, truth: Truth) {
    let i = pixel.y * frame.size_px.x + pixel.x;
    out_truth[i][0] = vec4<f32>(truth.uv, truth.source_px);
    out_truth[i][1] = vec4<f32>(truth.point_ned_m, truth.depth_m);
}
