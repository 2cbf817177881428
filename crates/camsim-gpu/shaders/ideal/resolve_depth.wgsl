// Resolves the depth of an ideal frame with four samples per pixel. Twin:
// camsim-core/src/temporal/multisample.rs.

@group(0) @binding(0) var sample_depths: texture_depth_multisampled_2d;

// Sample positions from the pixel centre, pixels.
const SAMPLE_OFFSETS_X = vec4f(-0.125, 0.375, -0.375, 0.125);
const SAMPLE_OFFSETS_Y = vec4f(-0.375, -0.125, 0.125, 0.375);
// Inverse depths that differ by no more than this fraction of the nearest one belong to one surface.
const ONE_SURFACE: f32 = 0.02;

// One triangle that covers the target.
@vertex
fn vertex(@builtin(vertex_index) index: u32) -> @builtin(position) vec4f {
    let corner = vec2f(f32(index & 1u), f32(index >> 1u));
    return vec4f(4.0 * corner - 1.0, 0.0, 1.0);
}

fn largest(depths: vec4f) -> f32 {
    return max(max(depths.x, depths.y), max(depths.z, depths.w));
}

fn is_one_surface(depths: vec4f, nearest: f32) -> bool {
    return largest(depths) + largest(-depths) <= ONE_SURFACE * nearest;
}

// Mean and number of the samples that belong to the surface of `first`, the nearest of them.
fn mean_from(depths: vec4f, first: f32) -> vec2f {
    let is_alike = (depths >= vec4f((1.0 - ONE_SURFACE) * first)) & (depths <= vec4f(first));
    let weights = select(vec4f(0.0), vec4f(1.0), is_alike);
    let count = dot(weights, vec4f(1.0));
    return vec2f(dot(weights, depths) / count, count);
}

fn resolve_depth(depths: vec4f, slopes: vec2f) -> f32 {
    let nearest = largest(depths);
    if is_one_surface(
        depths
        - slopes.x * SAMPLE_OFFSETS_X
        - slopes.y * SAMPLE_OFFSETS_Y, nearest
    ) || is_one_surface(depths, nearest) {
        return 0.25 * ((depths.x + depths.w) + (depths.y + depths.z));
    }
    let front = mean_from(depths, nearest);
    if front.y > 1.0 {
        return front.x;
    }
    let behind = select(vec4f(0.0), depths, depths < vec4f((1.0 - ONE_SURFACE) * nearest));
    return mean_from(depths, largest(behind)).x;
}

// Slope: the smaller of the differences to both neighbours, since the other may cross a border.
fn slope(before: f32, here: f32, after: f32) -> f32 {
    let changes = vec2f(here - before, after - here);
    return select(changes.y, changes.x, abs(changes.x) < abs(changes.y));
}

@fragment
fn fragment(@builtin(position) position: vec4f) -> @builtin(frag_depth) f32 {
    let pixel_px = vec2i(position.xy);
    let last = vec2i(textureDimensions(sample_depths)) - 1;
    let depths = vec4f(
        textureLoad(sample_depths, pixel_px, 0),
        textureLoad(sample_depths, pixel_px, 1),
        textureLoad(sample_depths, pixel_px, 2),
        textureLoad(sample_depths, pixel_px, 3),
    );
    let left = textureLoad(sample_depths, vec2i(max(pixel_px.x - 1, 0), pixel_px.y), 0);
    let right = textureLoad(sample_depths, vec2i(min(pixel_px.x + 1, last.x), pixel_px.y), 0);
    let above = textureLoad(sample_depths, vec2i(pixel_px.x, max(pixel_px.y - 1, 0)), 0);
    let below = textureLoad(sample_depths, vec2i(pixel_px.x, min(pixel_px.y + 1, last.y)), 0);
    return resolve_depth(depths, vec2f(slope(left, depths.x, right), slope(above, depths.x, below)));
}
