// The reverse pipeline (paper section 2): for each output pixel lens inverse (a map) -> line time and pose ->
// temporal inverse -> gather over the exposure -> photometric -> output. Slots are filled by the pipeline
// key; every filling of a slot defines the same functions.
#import common/frame.wgsl
#import common/noise.wgsl
#import reverse/ideal_frame.wgsl
#import <slot:keys>
#import <slot:ray>
#import <slot:depth>
#import <slot:temporal_inverse>
#import <slot:gather>
#import reverse/edges/seen.wgsl
#import reverse/photometric.wgsl
#import <slot:color>
#import <slot:emit>
#import <slot:edges>
#import <slot:pixels>

// Side of a workgroup, pixels.
const SIDE: u32 = 8u;

@compute @workgroup_size(SIDE, SIDE)
fn reverse(@builtin(workgroup_id) group: vec3<u32>, @builtin(local_invocation_id) local: vec3<u32>) {
    frame = given_frame;
    take_pixels(group.xy, local.xy);
}

fn is_in_picture(pixel: vec2<u32>) -> bool {
    return pixel.x < frame.size_px.x && pixel.y < frame.size_px.y;
}

// What a pixel shows: R G B A, all 0 where nothing is seen, and the truth about it where it is wanted.
struct Shown {
    color: vec4<f32>,
    truth: Truth,
}

// Stored in one place, whatever it is: on llvmpipe stores cost as much where no lane takes part.
fn show(pixel: vec2<u32>) {
    let shown = shown_by(pixel);
    emit(pixel, shown.color);
    emit_truth(pixel, shown.truth);
}

fn shown_by(pixel: vec2<u32>) -> Shown {
    var shown = Shown(vec4<f32>(0.0), no_truth());
    let ray = lens_ray(pixel);
    if (!ray.valid) {
        return shown;
    }
    let weight = vignette_weight(pixel);
    var gathered = Gathered(vec4<f32>(0.0), true, array<vec2<f32>, 2>());
    use_key_of_line(pixel);
    if (weight > 0.0) {
        gathered = gather(pixel, ray);
    }
    if (!gathered.inside) {
        return shown;
    }
    if (weight > 0.0) {
        list_for_rays(pixel, ray, gathered);
    }
    if (EMITS_RAYS) {
        shown.truth = truth_of(ray, smooth_px_at_phase(pixel, ray, coords_phase()), smooth_mid(pixel, ray));
    }
    shown.color = vec4<f32>(output_color(photometric(pixel, after_gather(ray, gathered.color.rgb), weight)), 1.0);
    return shown;
}
