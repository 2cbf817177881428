// Compacted list of pixels for a later pass: they are few and lie in strips, and side by side in a list they
// keep all lanes of a processor busy.
#import common/dispatch.wgsl

struct List {
    // Arguments of the later pass's indirect dispatch, in workgroups of 64: along x, then rows of
    // MAX_GROUPS_X, and 1.
    groups_x: atomic<u32>,
    groups_y: atomic<u32>,
    groups_z: u32,
    count: atomic<u32>,
    // x | y << 15 | (whether the plain gather touched an edge pixel) << 31.
    pixels: array<u32>,
}

@group(3) @binding(2) var<storage, read_write> list: List;

fn add_to_list(pixel: vec2<u32>, touched_edge: bool) {
    let list_index = atomicAdd(&list.count, 1u);
    list.pixels[list_index] = pixel.x | (pixel.y << 15u) | (u32(touched_edge) << 31u);
    let group = list_index / 64u;
    atomicMax(&list.groups_x, min(group, MAX_GROUPS_X - 1u) + 1u);
    atomicMax(&list.groups_y, group / MAX_GROUPS_X + 1u);
}
