// Filters the pixels listed by the reverse pass: keeps those whose rays may hit another surface than the
// plain gather did. Slots as in reverse.wgsl.
#import common/frame.wgsl
#import reverse/ideal_frame.wgsl
#import <slot:keys>
#import <slot:ray>
#import <slot:depth>
#import <slot:temporal_inverse>
#import <slot:gather>
#import reverse/edges/truth.wgsl
#import <slot:emit>
#import reverse/edges/pixel_list.wgsl
#import reverse/edges/near_silhouette.wgsl

// Layout as in edges/pixel_list.wgsl.
struct Candidates {
    groups: vec3<u32>,
    count: u32,
    pixels: array<u32>,
}

@group(3) @binding(3) var<storage, read> candidates: Candidates;

// Whether rays of this pixel may hit another surface than the plain gather did: at the ends and in the middle
// of the exposure, since the corner of a surface may pass by in between.
fn may_hit_others(pixel: vec2<u32>, ray: Ray) -> bool {
    let nodes = unspecialised(frame.nodes);
    for (var node = 0u; node < nodes; node += max(nodes - 1u, 1u)) {
        if (is_near_silhouette(ray.uv, table_pose(pixel, node))) {
            return true;
        }
    }
    return (EMITS_RAYS || nodes > 1u) && is_near_silhouette(ray.uv, table_mid_pose(pixel));
}

@compute @workgroup_size(64)
fn filter_candidates(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    frame = frame_uniforms;
    let list_index = id.y * groups.x * 64u + id.x;
    if (list_index >= candidates.count) {
        return;
    }
    let word = candidates.pixels[list_index];
    let pixel = vec2<u32>(word & 0x7fffu, (word >> 15u) & 0x7fffu);
    let touched_edge = (word >> 31u) != 0u;
    select_key_of_line(pixel);
    if (touched_edge || may_hit_others(pixel, lens_ray(pixel))) {
        add_to_list(pixel, touched_edge);
    }
}
