// The pixels that the reverse pass has listed: those that see several surfaces get the mean of rays of their
// own instead of what was gathered plainly; depth and coordinates are those of the surface that the pixel's
// own ray meets, which the host tells for solvers that look where it is. Slots as in reverse.wgsl.
#import common/frame.wgsl
#import common/noise.wgsl
#import reverse/ideal_frame.wgsl
#import <slot:keys>
#import <slot:ray>
#import <slot:depth>
#import <slot:temporal_inverse>
#import <slot:gather>
#import reverse/edges/seen.wgsl
#import reverse/edges/supersampled.wgsl
#import reverse/photometric.wgsl
#import <slot:color>
#import <slot:emit>

// As in edges/list.wgsl.
struct Listed {
    groups: vec3<u32>,
    count: u32,
    pixels: array<u32>,
}

@group(3) @binding(2) var<storage, read> listed: Listed;

@compute @workgroup_size(64)
fn rays(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    frame = given_frame;
    let place = id.y * groups.x * 64u + id.x;
    if (place >= listed.count) {
        return;
    }
    let word = listed.pixels[place];
    let pixel = vec2<u32>(word & 0x7fffu, (word >> 15u) & 0x7fffu);
    let marked = (word >> 31u) != 0u;
    let ray = lens_ray(pixel);
    use_key_of_line(pixel);
    hold_line(pixel);
    // Without samples the list is for depth and coordinates alone.
    if (told(frame.edge_samples) > 0u && (marked || (HAS_PARALLAX && !sees_one_surface(pixel, ray)))) {
        let color = rays_color(pixel, ray);
        emit(pixel, vec4<f32>(output_color(photometric(pixel, after_gather(ray, color), vignette_weight(pixel))), 1.0));
    }
    if (EMITS_RAYS) {
        emit_centre(pixel, ray);
    }
}
