// Writes the edge mask into the alpha of an ideal frame's colour: 0 at edge pixels. A filtered read of colour
// then also tells whether it touched one.
#import ideal/edge_tiles.wgsl

struct EdgeTiles {
    arguments: array<u32, 8>,
    tiles: array<EdgeTile>,
}

@group(0) @binding(0) var<storage, read> edge_tiles: EdgeTiles;
// Width and height of the target, pixels; z, w are not used.
@group(0) @binding(1) var<uniform> target_px: vec4<f32>;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) bits: vec2<u32>,
}

// A strip of two triangles per tile.
@vertex
fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) list_index: u32) -> Corner {
    let tile = edge_tiles.tiles[list_index];
    let corner_xy = vec2<f32>(f32(corner & 1u), f32(corner >> 1u));
    let position_px = 8.0 * (vec2<f32>(f32(tile.tile_xy & 0xffffu), f32(tile.tile_xy >> 16u)) + corner_xy);
    let clip = vec2<f32>(2.0, -2.0) * position_px / target_px.xy + vec2<f32>(-1.0, 1.0);
    return Corner(vec4<f32>(clip, 0.5, 1.0), vec2<u32>(tile.bits_low, tile.bits_high));
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    let pixel_in_tile = vec2<u32>(in.clip.xy) & vec2<u32>(7u);
    let bits = select(in.bits.x, in.bits.y, pixel_in_tile.y > 3u);
    if (((bits >> (pixel_in_tile.x + 8u * (pixel_in_tile.y & 3u))) & 1u) == 0u) {
        discard;
    }
    return vec4<f32>(0.0);
}
