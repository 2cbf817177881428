// A picture that is larger than a texture: tiles of its versions, as many as this frame may read. Twin:
// camsim_core::scene::TileGrid.

// camsim_core::scene::TILE_TEXELS, and TILE_SIDE with one more at each end.
const TILE_TEXELS: f32 = 254.0;
const TILE_SIDE: f32 = 256.0;
// camsim_gpu::tiles: tiles along a side of a layer.
const TILES_A_SIDE: u32 = 8u;

@group(1) @binding(0) var tile_layers: texture_2d_array<f32>;

struct TileTable {
    size: vec2<u32>,
    levels: u32,
    pad: u32,
    // Number of the first tile of each version.
    first: array<u32, 32>,
    // Where each tile is: its place << 8; or how many versions further all that it shows is.
    tiles: array<u32>,
}

@group(1) @binding(3) var<storage, read> tile_table: TileTable;

// What is read of it.
alias Texel = vec3<f32>;

// Texels.
fn picture_size() -> vec2<f32> {
    return vec2<f32>(tile_table.size);
}

struct TileEntry {
    entry: u32,
    // From the tile's first texel.
    texel: vec2<f32>,
}

fn tile_at(uv: vec2<f32>, level: u32) -> TileEntry {
    let side = max(tile_table.size >> vec2<u32>(level), vec2<u32>(1u));
    let size = vec2<f32>(side);
    // Beyond the outermost texels' middles the picture goes on as they are.
    let texel = clamp(uv * size, vec2<f32>(0.5), size - 0.5);
    let tile = floor(texel / TILE_TEXELS);
    let across = (side.x + 253u) / 254u;
    let number = tile_table.first[level] + u32(tile.y) * across + u32(tile.x);
    return TileEntry(tile_table.tiles[number], texel - TILE_TEXELS * tile);
}

fn version_read(uv: vec2<f32>, level: u32) -> vec3<f32> {
    let last = tile_table.levels - 1u;
    let wanted = min(level, last);
    let there = tile_at(uv, min(wanted + (tile_at(uv, wanted).entry & 255u), last));
    let place = there.entry >> 8u;
    let of_layer = TILES_A_SIDE * TILES_A_SIDE;
    let corner = TILE_SIDE * vec2<f32>(f32(place % TILES_A_SIDE), f32((place % of_layer) / TILES_A_SIDE));
    let at = (corner + there.texel + 1.0) / (TILE_SIDE * f32(TILES_A_SIDE));
    return textureSampleLevel(tile_layers, surface_sampler, at, i32(place / of_layer), 0.0).rgb;
}

fn picture_read(uv: vec2<f32>, level: f32) -> vec3<f32> {
    let below = floor(level);
    let share = level - below;
    let color = version_read(uv, u32(below));
    if (share == 0.0) {
        return color;
    }
    return mix(color, version_read(uv, u32(below) + 1u), share);
}
