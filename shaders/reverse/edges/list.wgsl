// A list of pixels for a pass after this one: they are few and lie in strips, and side by side in a list they
// keep a processor's lanes busy.
#import common/dispatch.wgsl

struct List {
    // Arguments of the next pass's dispatch, in workgroups of 64: along x, then rows of MOST_GROUPS, and 1.
    groups_x: atomic<u32>,
    groups_y: atomic<u32>,
    groups_z: u32,
    count: atomic<u32>,
    // x | y << 15 | whether the plain gather met a mark << 31.
    pixels: array<u32>,
}

@group(3) @binding(2) var<storage, read_write> list: List;

fn add_to_list(pixel: vec2<u32>, marked: bool) {
    let place = atomicAdd(&list.count, 1u);
    list.pixels[place] = pixel.x | (pixel.y << 15u) | (u32(marked) << 31u);
    let group = place / 64u;
    atomicMax(&list.groups_x, min(group, MOST_GROUPS - 1u) + 1u);
    atomicMax(&list.groups_y, group / MOST_GROUPS + 1u);
}
