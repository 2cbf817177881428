// The terrain's triangles that are to be drawn with several samples a pixel: those near tiles that have
// marks.
#import ideal/camera.wgsl
#import ideal/terrain_vertex.wgsl

// Of a key's triangles: three a triangle.
@group(3) @binding(0) var<storage, read> indices: array<u32>;
// A word for each 8x8 pixels of the target; the lowest bit says whether there are marks.
@group(2) @binding(0) var<storage, read> tiles: array<u32>;

struct KeyLayout {
    ideal_size_px: vec2<u32>,
    // Of the key in the target.
    first_row: u32,
    // Of the target.
    tiles_across: u32,
    index_count: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(3) @binding(1) var<uniform> key_layout: KeyLayout;

struct Kept {
    // Arguments of an indexed draw.
    count: atomic<u32>,
    instances: u32,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}

@group(3) @binding(2) var<storage, read_write> kept: Kept;
@group(3) @binding(3) var<storage, read_write> kept_indices: array<u32>;

// Samples this far from a mark are read for the border's line: LINE_REACH and a neighbour, pixels.
const READ_PX: f32 = 5.0;
// A triangle over more tiles than this is kept unseen.
const MOST_TILES: i32 = 64;

fn ideal_px(index: u32) -> vec3<f32> {
    let p = in_ideal_camera(terrain_vertex(index).from_base_m);
    let clip = ideal_clip(p);
    let size = vec2<f32>(key_layout.ideal_size_px);
    return vec3<f32>((0.5 + 0.5 * vec2<f32>(clip.x, -clip.y) / clip.w) * size, clip.w);
}

fn has_marks(from_px: vec2<f32>, to_px: vec2<f32>) -> bool {
    let size = vec2<f32>(key_layout.ideal_size_px);
    if (any(to_px < vec2<f32>(0.0)) || any(from_px > size)) {
        return false;
    }
    let top = vec2<i32>(0, i32(key_layout.first_row / 8u));
    let from_tile = vec2<i32>(clamp(from_px, vec2<f32>(0.0), size - 1.0)) / 8 + top;
    let to_tile = vec2<i32>(clamp(to_px, vec2<f32>(0.0), size - 1.0)) / 8 + top;
    let across = to_tile.x - from_tile.x + 1;
    let count = across * (to_tile.y - from_tile.y + 1);
    if (count > MOST_TILES) {
        return true;
    }
    var found = 0u;
    for (var i = 0; i < count; i++) {
        let tile = from_tile + vec2<i32>(i % across, i / across);
        found |= tiles[tile.y * i32(key_layout.tiles_across) + tile.x];
    }
    return (found & 1u) != 0u;
}

@compute @workgroup_size(64)
fn keep(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let first = 3u * (id.y * groups.x * 64u + id.x);
    if (first >= key_layout.index_count) {
        return;
    }
    let corners = vec3<u32>(indices[first], indices[first + 1u], indices[first + 2u]);
    let a = ideal_px(corners.x);
    let b = ideal_px(corners.y);
    let c = ideal_px(corners.z);
    // A triangle that reaches behind the camera has no box.
    let behind = !(min(a.z, min(b.z, c.z)) > ideal_camera.near_m);
    if (behind || has_marks(min(a.xy, min(b.xy, c.xy)) - READ_PX, max(a.xy, max(b.xy, c.xy)) + READ_PX)) {
        let place = atomicAdd(&kept.count, 3u);
        kept_indices[place] = corners.x;
        kept_indices[place + 1u] = corners.y;
        kept_indices[place + 2u] = corners.z;
    }
}
