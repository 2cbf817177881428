// The reverse pipeline (paper section 2): for each output pixel
//   lens inverse (a map) -> line time and pose -> temporal inverse -> gather over the exposure -> photometric -> output.
// Slots are filled by the pipeline key; every filling of a slot defines the same functions.
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

@compute @workgroup_size(8, 8)
fn reverse(@builtin(global_invocation_id) id: vec3<u32>) {
    let pixel = id.xy;
    if (pixel.x >= frame.size_px.x || pixel.y >= frame.size_px.y) {
        return;
    }
    let ray = lens_ray(pixel);
    if (!ray.valid) {
        emit_invalid(pixel);
        return;
    }
    let weight = vignette_weight(pixel);
    var gathered = Gathered(vec4<f32>(0.0), true, array<vec2<f32>, 2>());
    use_key_of_line(pixel);
    if (weight > 0.0) {
        gathered = gather(pixel, ray);
    }
    if (!gathered.inside) {
        emit_invalid(pixel);
        return;
    }
    if (weight > 0.0) {
        list_for_rays(pixel, ray, gathered);
    }
    emit(pixel, output_color(photometric(pixel, after_gather(ray, gathered.color.rgb), weight)));
    if (EMITS_RAYS) {
        emit_truth(pixel, ray, smooth_px_at_phase(pixel, ray, coords_phase()), smooth_mid(pixel, ray));
    }
}
