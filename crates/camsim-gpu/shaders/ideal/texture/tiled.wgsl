// Virtual texture, larger than a GPU texture: tiles of its mip levels, as many as this frame may read. Twin:
// camsim_core::scene::TileGrid.

// camsim_core::scene::TILE_TEXELS, and TILE_SIDE with a border of one texel.
const TILE_TEXELS: f32 = 254.0;
const TILE_SIDE: f32 = 256.0;
// Tiles along a side of an array layer, as in camsim_gpu's tiles.rs.
const TILES_PER_SIDE: u32 = 8u;

@group(1) @binding(0) var tile_layers: texture_2d_array<f32>;

struct TileLayout {
    level_size: vec2<u32>,
    levels: u32,
    pad: u32,
    // Index of the first tile of each mip level.
    first_tile: array<u32, 32>,
    // Page table: slot of each tile << 8; or the number of mip levels up to one that shows the same and is
    // resident.
    page_table: array<u32>,
}

@group(1) @binding(3) var<storage, read> tile_layout: TileLayout;

// Linear colour.
alias Texel = vec3<f32>;

// Size of level 0, texels.
fn texture_size() -> vec2<f32> {
    return vec2<f32>(tile_layout.level_size);
}

struct TileEntry {
    entry: u32,
    // Position from the first texel of the tile.
    texel: vec2<f32>,
}

fn tile_at(uv: vec2<f32>, level: u32) -> TileEntry {
    let level_px = max(tile_layout.level_size >> vec2<u32>(level), vec2<u32>(1u));
    let level_size = vec2<f32>(level_px);
    // Clamped to the centres of the outermost texels.
    let texel = clamp(uv * level_size, vec2<f32>(0.5), level_size - 0.5);
    let tile = floor(texel / TILE_TEXELS);
    let tiles_across = (level_px.x + 253u) / 254u;
    let tile_index = tile_layout.first_tile[level] + u32(tile.y) * tiles_across + u32(tile.x);
    return TileEntry(tile_layout.page_table[tile_index], texel - TILE_TEXELS * tile);
}

fn sample_level(uv: vec2<f32>, level: u32) -> vec3<f32> {
    let last = tile_layout.levels - 1u;
    let wanted_level = min(level, last);
    let resident = tile_at(uv, min(wanted_level + (tile_at(uv, wanted_level).entry & 255u), last));
    let slot = resident.entry >> 8u;
    let tiles_per_layer = TILES_PER_SIDE * TILES_PER_SIDE;
    let slot_origin = TILE_SIDE
        * vec2<f32>(f32(slot % TILES_PER_SIDE), f32((slot % tiles_per_layer) / TILES_PER_SIDE));
    let layer_uv = (slot_origin + resident.texel + 1.0) / (TILE_SIDE * f32(TILES_PER_SIDE));
    return textureSampleLevel(tile_layers, surface_sampler, layer_uv, i32(slot / tiles_per_layer), 0.0).rgb;
}

fn sample_texture(uv: vec2<f32>, level: f32) -> vec3<f32> {
    let level_below = floor(level);
    let blend = level - level_below;
    let color = sample_level(uv, u32(level_below));
    if (blend == 0.0) {
        return color;
    }
    return mix(color, sample_level(uv, u32(level_below) + 1u), blend);
}
