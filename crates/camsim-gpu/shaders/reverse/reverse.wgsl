// The reverse pipeline (paper section 2): per output pixel lens inverse (a map) -> line time and pose ->
// temporal inverse -> gather over the exposure -> photometric stage -> output. The pipeline key fills the
// slots; all files of a slot define the same functions.
#import common/frame.wgsl
#import common/noise.wgsl
#import reverse/ideal_frame.wgsl
#import <slot:keys>
#import <slot:ray>
#import <slot:depth>
#import <slot:temporal_inverse>
#import <slot:gather>
#import reverse/edges/truth.wgsl
#import reverse/photometric.wgsl
#import <slot:color>
#import <slot:emit>
#import <slot:edges>
#import <slot:pixels>

// Side of a workgroup, pixels.
const SIDE: u32 = 8u;

@compute @workgroup_size(SIDE, SIDE)
fn reverse(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    frame = frame_uniforms;
    process_pixels(group.xy, local.xy);
}

fn is_in_image(pixel: vec2<u32>) -> bool {
    return pixel.x < frame.size_px.x && pixel.y < frame.size_px.y;
}

// Output of a pixel: R G B A, all 0 if it is invalid; and its truth.
struct PixelOutput {
    color: vec4<f32>,
    truth: Truth,
}

// One store for all cases: on llvmpipe a store costs as much if no lane is active.
fn render_pixel(pixel: vec2<u32>) {
    let output = pixel_output(pixel);
    emit(pixel, output.color);
    emit_truth(pixel, output.truth);
}

fn pixel_output(pixel: vec2<u32>) -> PixelOutput {
    var output = PixelOutput(vec4<f32>(0.0), no_truth());
    let ray = lens_ray(pixel);
    if (!ray.valid) {
        return output;
    }
    let weight = vignette_weight(pixel);
    var gathered = Gathered(vec4<f32>(0.0), true, array<vec2<f32>, 2>());
    select_key_of_line(pixel);
    if (weight > 0.0) {
        gathered = gather(pixel, ray);
    }
    if (!gathered.inside) {
        return output;
    }
    if (weight > 0.0) {
        list_for_rays(pixel, ray, gathered);
    }
    if (EMITS_RAYS) {
        output.truth = pixel_truth(
            ray, smooth_source_px(pixel, ray, coords_phase()), smooth_centre_point(pixel, ray)
        );
    }
    output.color = vec4<f32>(
        output_color(photometric(pixel, after_gather(ray, gathered.color.rgb), weight)), 1.0
    );
    return output;
}
