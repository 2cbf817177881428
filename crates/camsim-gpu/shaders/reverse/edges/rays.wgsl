// Silhouette rays of the pixels listed by the reverse pass. Pixels that see several surfaces get the mean
// colour of their rays instead of the plain gather. Depth and coordinates are those of the surface that the
// central ray hits; with exact solvers they are left to an f64 ray on the CPU. Slots as in reverse.wgsl.
#import common/frame.wgsl
#import common/noise.wgsl
#import reverse/ideal_frame.wgsl
#import <slot:keys>
#import <slot:ray>
#import <slot:depth>
#import <slot:temporal_inverse>
#import <slot:gather>
#import reverse/edges/truth.wgsl
#import reverse/edges/silhouette_rays.wgsl
#import reverse/photometric.wgsl
#import <slot:color>
#import <slot:emit>

// Layout as in edges/pixel_list.wgsl.
struct Listed {
    groups: vec3<u32>,
    count: u32,
    pixels: array<u32>,
}

@group(3) @binding(2) var<storage, read> listed: Listed;

@compute @workgroup_size(64)
fn trace_silhouette_rays(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    frame = frame_uniforms;
    let list_index = id.y * groups.x * 64u + id.x;
    if (list_index >= listed.count) {
        return;
    }
    let word = listed.pixels[list_index];
    let pixel = vec2<u32>(word & 0x7fffu, (word >> 15u) & 0x7fffu);
    let touched_edge = (word >> 31u) != 0u;
    let ray = lens_ray(pixel);
    select_key_of_line(pixel);
    cache_line_poses(pixel);
    if (touched_edge || (HAS_PARALLAX && !sees_one_surface(pixel, ray))) {
        let color = rays_color(pixel, ray);
        emit(
            pixel,
            vec4<f32>(
                output_color(photometric(pixel, after_gather(ray, color), vignette_weight(pixel))), 1.0
            ),
        );
    }
    if (EMITS_RAYS) {
        emit_centre_truth(pixel, ray);
    }
}
