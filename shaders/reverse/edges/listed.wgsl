// Pixels that may see a silhouette are listed for the pass after this one, which gives them rays of their own: they are few and lie in strips,
// and side by side in a list they keep a processor's lanes busy.
#import common/dispatch.wgsl
#import reverse/edges/near.wgsl

struct Listed {
    // Arguments of the next pass's dispatch, in workgroups of 64: along x, then rows of MOST_GROUPS, and 1.
    groups_x: atomic<u32>,
    groups_y: atomic<u32>,
    groups_z: u32,
    count: atomic<u32>,
    // x | y << 15 | whether the plain gather met a mark << 31.
    pixels: array<u32>,
}

@group(3) @binding(2) var<storage, read_write> listed: Listed;

// Whether rays of this pixel may meet another surface than the plain gather did.
fn may_meet_others(pixel: vec2<u32>, ray: Ray) -> bool {
    for (var node = 0u; node < frame.nodes; node += max(frame.nodes - 1u, 1u)) {
        if (near_edge(ray.uv, pose_at_node(pixel, node))) {
            return true;
        }
    }
    return EMITS_RAYS && near_edge(ray.uv, pose_mid(pixel));
}

fn list_for_rays(pixel: vec2<u32>, ray: Ray, plain: Gathered) {
    // Above 1 where a mark lies under a negative weight of the spline.
    let marked = abs(plain.color.a - 1.0) > 1e-4;
    if (marked || ((HAS_PARALLAX || EMITS_RAYS) && may_meet_others(pixel, ray))) {
        let place = atomicAdd(&listed.count, 1u);
        listed.pixels[place] = pixel.x | (pixel.y << 15u) | (u32(marked) << 31u);
        let group = place / 64u;
        atomicMax(&listed.groups_x, min(group, MOST_GROUPS - 1u) + 1u);
        atomicMax(&listed.groups_y, group / MOST_GROUPS + 1u);
    }
}
