// Of the pixels that the reverse pass has listed, those whose rays may meet another surface than the plain
// gather did. Slots as in reverse.wgsl.
#import common/frame.wgsl
#import reverse/ideal_frame.wgsl
#import <slot:keys>
#import <slot:ray>
#import <slot:depth>
#import <slot:temporal_inverse>
#import <slot:gather>
#import reverse/edges/seen.wgsl
#import <slot:emit>
#import reverse/edges/list.wgsl
#import reverse/edges/near.wgsl

// As in edges/list.wgsl.
struct Candidates {
    groups: vec3<u32>,
    count: u32,
    pixels: array<u32>,
}

@group(3) @binding(3) var<storage, read> candidates: Candidates;

// Whether rays of this pixel may meet another surface than the plain gather did: at the ends and in the
// middle of the exposure, since the corner of a surface may pass by in between.
fn may_meet_others(pixel: vec2<u32>, ray: Ray) -> bool {
    let nodes = told(frame.nodes);
    for (var node = 0u; node < nodes; node += max(nodes - 1u, 1u)) {
        if (near_edge(ray.uv, pose_at_node(pixel, node))) {
            return true;
        }
    }
    return (EMITS_RAYS || nodes > 1u) && near_edge(ray.uv, pose_mid(pixel));
}

@compute @workgroup_size(64)
fn ask(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    frame = given_frame;
    let place = id.y * groups.x * 64u + id.x;
    if (place >= candidates.count) {
        return;
    }
    let word = candidates.pixels[place];
    let pixel = vec2<u32>(word & 0x7fffu, (word >> 15u) & 0x7fffu);
    let marked = (word >> 31u) != 0u;
    use_key_of_line(pixel);
    if (marked || may_meet_others(pixel, lens_ray(pixel))) {
        add_to_list(pixel, marked);
    }
}
