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
#import <slot:edges>
#import reverse/photometric.wgsl
#import <slot:color>
#import <slot:emit>

@compute @workgroup_size(8, 8)
fn reverse(@builtin(global_invocation_id) id: vec3<u32>, @builtin(local_invocation_index) thread: u32) {
    let pixel = id.xy;
    let in_picture = all(pixel < frame.size_px);
    var ray = Ray();
    var gathered = Gathered(vec4<f32>(0.0), true);
    var weight = 0.0;
    var needed = false;
    if (in_picture) {
        ray = lens_ray(pixel);
        if (ray.valid) {
            weight = vignette_weight(pixel);
        }
        if (weight > 0.0) {
            use_key_of_line(pixel);
            gathered = gather(pixel, ray);
            needed = needs_rays(pixel, ray, gathered);
        }
    }
    // By all threads together.
    let seen = cast_rays(thread, pixel, ray, needed);
    if (!in_picture) {
        return;
    }
    if (needed) {
        gathered.color = vec4<f32>(seen, 1.0);
    }
    if (!ray.valid || !gathered.inside) {
        emit_invalid(pixel);
        return;
    }
    emit(pixel, ray, output_color(photometric(pixel, after_gather(ray, gathered.color.rgb), weight)));
}
