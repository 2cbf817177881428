// Selects the terrain triangles that are drawn with several samples per pixel: those near tiles with edge
// pixels.
#import ideal/camera.wgsl
#import ideal/terrain_vertex.wgsl

// Index buffer of the key frame: three indices per triangle.
@group(3) @binding(0) var<storage, read> indices: array<u32>;
// One word per 8x8 pixels of the target, whose lowest bit says whether there are edge pixels.
@group(2) @binding(0) var<storage, read> tiles: array<u32>;

struct KeyLayout {
    ideal_size_px: vec2<u32>,
    // First row of the key frame in the target.
    first_row: u32,
    // Tiles of the target along x.
    tiles_across: u32,
    index_count: u32,
    pad0: u32,
    pad1: u32,
    pad2: u32,
}

@group(3) @binding(1) var<uniform> key_layout: KeyLayout;

struct Selection {
    // Arguments of an indirect indexed draw.
    count: atomic<u32>,
    instances: u32,
    first_index: u32,
    base_vertex: i32,
    first_instance: u32,
}

@group(3) @binding(2) var<storage, read_write> selection: Selection;
@group(3) @binding(3) var<storage, read_write> selected_indices: array<u32>;

// Distance at which samples are read for an edge line: LINE_REACH and one neighbour, pixels.
const READ_PX: f32 = 5.0;
// Triangles over more tiles than this are selected without looking at the tiles.
const MAX_TILES: i32 = 64;

fn project_vertex(index: u32) -> vec3<f32> {
    let point_m = key_camera_from_base(terrain_vertex(index).from_base_m);
    let clip = ideal_clip(point_m);
    let size_px = vec2<f32>(key_layout.ideal_size_px);
    return vec3<f32>((0.5 + 0.5 * vec2<f32>(clip.x, -clip.y) / clip.w) * size_px, clip.w);
}

fn has_edge_pixels(from_px: vec2<f32>, to_px: vec2<f32>) -> bool {
    let size_px = vec2<f32>(key_layout.ideal_size_px);
    if (any(to_px < vec2<f32>(0.0)) || any(from_px > size_px)) {
        return false;
    }
    let top = vec2<i32>(0, i32(key_layout.first_row / 8u));
    let from_tile = vec2<i32>(clamp(from_px, vec2<f32>(0.0), size_px - 1.0)) / 8 + top;
    let to_tile = vec2<i32>(clamp(to_px, vec2<f32>(0.0), size_px - 1.0)) / 8 + top;
    let tiles_across_box = to_tile.x - from_tile.x + 1;
    let count = tiles_across_box * (to_tile.y - from_tile.y + 1);
    if (count > MAX_TILES) {
        return true;
    }
    var joined = 0u;
    for (var i = 0; i < count; i++) {
        let tile = from_tile + vec2<i32>(i % tiles_across_box, i / tiles_across_box);
        joined |= tiles[tile.y * i32(key_layout.tiles_across) + tile.x];
    }
    return (joined & 1u) != 0u;
}

@compute @workgroup_size(64)
fn select_triangles(
    @builtin(global_invocation_id) id: vec3<u32>,
    @builtin(num_workgroups) groups: vec3<u32>,
) {
    let first = 3u * (id.y * groups.x * 64u + id.x);
    if (first >= key_layout.index_count) {
        return;
    }
    let corners = vec3<u32>(indices[first], indices[first + 1u], indices[first + 2u]);
    let a = project_vertex(corners.x);
    let b = project_vertex(corners.y);
    let c = project_vertex(corners.z);
    // Triangles that reach behind the camera have no bounding box.
    let reaches_behind = !(min(a.z, min(b.z, c.z)) > ideal_camera.near_m);
    if (
        reaches_behind
        || has_edge_pixels(min(a.xy, min(b.xy, c.xy)) - READ_PX, max(a.xy, max(b.xy, c.xy)) + READ_PX)
    ) {
        let list_index = atomicAdd(&selection.count, 3u);
        selected_indices[list_index] = corners.x;
        selected_indices[list_index + 1u] = corners.y;
        selected_indices[list_index + 2u] = corners.z;
    }
}
