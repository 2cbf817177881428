// Writes the marks into the alpha of an ideal frame's colour, 0 where a pixel is marked: a filtered read then
// tells of a mark for nothing.
#import ideal/marked_tiles.wgsl

struct MarkedTiles {
    arguments: array<u32, 8>,
    tiles: array<MarkedTile>,
}

@group(0) @binding(0) var<storage, read> marked: MarkedTiles;
// Width and height of the target in pixels; z, w are not used.
@group(0) @binding(1) var<uniform> target_px: vec4<f32>;

struct Corner {
    @builtin(position) clip: vec4<f32>,
    @location(0) @interpolate(flat) bits: vec2<u32>,
}

// A strip of two triangles for each tile.
@vertex
fn vertex(@builtin(vertex_index) corner: u32, @builtin(instance_index) number: u32) -> Corner {
    let tile = marked.tiles[number];
    let square = vec2<f32>(f32(corner & 1u), f32(corner >> 1u));
    let at_px = 8.0 * (vec2<f32>(f32(tile.place & 0xffffu), f32(tile.place >> 16u)) + square);
    let clip = vec2<f32>(2.0, -2.0) * at_px / target_px.xy + vec2<f32>(-1.0, 1.0);
    return Corner(vec4<f32>(clip, 0.5, 1.0), vec2<u32>(tile.bits_low, tile.bits_high));
}

@fragment
fn fragment(in: Corner) -> @location(0) vec4<f32> {
    let at = vec2<u32>(in.clip.xy) & vec2<u32>(7u);
    let bits = select(in.bits.x, in.bits.y, at.y > 3u);
    if (((bits >> (at.x + 8u * (at.y & 3u))) & 1u) == 0u) {
        discard;
    }
    return vec4<f32>(0.0);
}
