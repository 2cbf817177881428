// Border of two surfaces within a fine pixel, as a straight line. Four samples locate a border to a tenth of
// a pixel; all samples along four pixels of a straight border locate it to one to three hundredths. Twin:
// camsim_core::temporal::edge_lines.

// Half lengths along which the samples must agree on a line, fine pixels, in the order in which they are
// tried.
const LINE_REACH: array<f32, 2> = array<f32, 2>(4.0, 2.0);
// Samples within this distance of the line take part in the fit, fine pixels.
const LINE_BAND: f32 = 0.7;
// Largest distance of a sample on the wrong side of the line.
const LINE_SLACK: f32 = 0.05;
// Lines farther from the centre of the fine pixel than this do not cross it.
const LINE_MAX_OFFSET: f32 = 0.72;
// Ridge term, which bounds the slope of the logistic curve: a separable set has no steepest one.
const LINE_RIDGE: f32 = 0.03;
const MAX_MEMBERS: u32 = 64u;
// Samples that differ by less than this, relative to the nearest, belong to one surface.
const ONE_SURFACE: f32 = 0.02;

// Samples of the fit, one word each: see `packed_member`.
var<private> members: array<u32, 64>;
var<private> member_count: u32;

// Position of a sample from the centre of its fine pixel.
fn sample_offset(i: i32) -> vec2<f32> {
    let offsets = array<vec2<f32>, 4>(
        vec2<f32>(-0.125, -0.375), vec2<f32>(0.375, -0.125), vec2<f32>(-0.375, 0.125), vec2<f32>(0.125, 0.375)
    );
    return offsets[i];
}

// Packs a sample of the fit into one word: its position from the centre of the fine pixel in eighths, of
// which all are whole and less than 64 in magnitude, and above it 1 for the nearer surface. One word is
// faster to read and write than three floats, and exact.
fn packed_member(position: vec2<f32>, nearer: bool) -> u32 {
    let eighths = vec2<u32>(vec2<i32>(8.0 * position) + 64);
    return eighths.x | (eighths.y << 8u) | (u32(nearer) << 16u);
}

// Position of a sample of the fit, and 1 for the nearer surface or 0 for the farther.
fn member(i: u32) -> vec3<f32> {
    let word = members[i];
    let eighths = vec2<i32>(vec2<u32>(word & 0xffu, (word >> 8u) & 0xffu)) - 64;
    return vec3<f32>(0.125 * vec2<f32>(eighths), f32(word >> 16u));
}

fn is_in_key_frame(fine_pixel: vec2<i32>, from_px: vec2<i32>, to_px: vec2<i32>) -> bool {
    return all(fine_pixel >= from_px) && all(fine_pixel < to_px);
}

// One Newton step of the logistic regression with the line n x = c as decision boundary; the unknowns are (n,
// c).
fn line_step(line: vec3<f32>) -> vec3<f32> {
    var gradient = vec3<f32>(LINE_RIDGE * line.xy, 0.0);
    var xx = LINE_RIDGE;
    var yy = LINE_RIDGE;
    var cc = 1e-4;
    var xy = 0.0;
    var xc = 0.0;
    var yc = 0.0;
    for (var i = 0u; i < member_count; i++) {
        let sample = member(i);
        let point = vec3<f32>(sample.xy, -1.0);
        let probability = 1.0 / (1.0 + exp(-dot(line, point)));
        gradient += (probability - sample.z) * point;
        let weight = probability * (1.0 - probability);
        xx += weight * point.x * point.x;
        yy += weight * point.y * point.y;
        cc += weight;
        xy += weight * point.x * point.y;
        xc -= weight * point.x;
        yc -= weight * point.y;
    }
    // Inverse of the symmetric Hessian by cofactors; the ridge term keeps it regular.
    let a = yy * cc - yc * yc;
    let b = xc * yc - xy * cc;
    let c = xy * yc - xc * yy;
    let inverse = mat3x3<f32>(
        vec3<f32>(a, b, c),
        vec3<f32>(b, xx * cc - xc * xc, xy * xc - xx * yc),
        vec3<f32>(c, xy * xc - xx * yc, xx * yy - xy * xy),
    );
    return line - (inverse * gradient) / (xx * a + xy * b + xc * c);
}

fn fitted_line(steps: u32) -> vec3<f32> {
    var line = vec3<f32>(0.0);
    for (var i = 0u; i < steps; i++) {
        line = line_step(line);
    }
    return line / max(length(line.xy), 1e-20);
}

// Border through a fine pixel, packed as in `packed_line`, or 0 if there is none: one surface, more than two,
// or a corner. The fine pixels of the key frame are `from_px` to before `to_px`.
fn edge_line(fine_pixel: vec2<i32>, from_px: vec2<i32>, to_px: vec2<i32>) -> vec2<u32> {
    var low = 1e30;
    var high = 0.0;
    for (var i = 0; i < 36; i++) {
        let neighbour = clamp(fine_pixel + vec2<i32>(i % 3 - 1, (i / 3) % 3 - 1), from_px, to_px - 1);
        let depth = textureLoad(fine_depth, neighbour, i / 9);
        low = min(low, depth);
        high = max(high, depth);
    }
    if (low >= (1.0 - ONE_SURFACE) * high) {
        return vec2<u32>(0u);
    }
    let threshold = 0.5 * (low + high);
    member_count = 0u;
    for (var i = 0; i < 36; i++) {
        let offset = vec2<i32>(i % 3 - 1, (i / 3) % 3 - 1);
        if (is_in_key_frame(fine_pixel + offset, from_px, to_px)) {
            let nearer = textureLoad(fine_depth, fine_pixel + offset, i / 9) > threshold;
            members[member_count] = packed_member(vec2<f32>(offset) + sample_offset(i / 9), nearer);
            member_count++;
        }
    }
    let rough = fitted_line(3u);
    if (abs(dot(rough.xy, rough.xy) - 1.0) > 0.1 || abs(rough.z) > 1.0) {
        return vec2<u32>(0u);
    }
    for (var k = 0; k < 2; k++) {
        var reaches = LINE_REACH;
        collect_along(fine_pixel, rough, reaches[k], threshold, from_px, to_px);
        let line = fitted_line(4u);
        if (separates(line)) {
            return select(vec2<u32>(0u), packed_line(line, threshold), abs(line.z) < LINE_MAX_OFFSET);
        }
    }
    return vec2<u32>(0u);
}

// Collects the samples within a band along the line up to `reach` from the centre, and all samples of the
// fine pixel itself.
fn collect_along(
    fine_pixel: vec2<i32>,
    line: vec3<f32>,
    reach: f32,
    threshold: f32,
    from_px: vec2<i32>,
    to_px: vec2<i32>,
) {
    member_count = 0u;
    let is_flat = abs(line.y) >= abs(line.x);
    let major = select(line.yx, line.xy, is_flat);
    let last = i32(reach);
    for (var along = -last; along <= last; along++) {
        let centre = i32(round((line.z - major.x * f32(along)) / major.y));
        for (var across = centre - 1; across <= centre + 1; across++) {
            let offset = select(vec2<i32>(across, along), vec2<i32>(along, across), is_flat);
            if (!is_in_key_frame(fine_pixel + offset, from_px, to_px)) {
                continue;
            }
            let is_own_pixel = all(offset == vec2<i32>(0));
            for (var i = 0; i < 4; i++) {
                let position = vec2<f32>(offset) + sample_offset(i);
                let is_in_band = abs(dot(line.xy, position) - line.z) < LINE_BAND
                    && abs(line.x * position.y - line.y * position.x) < reach;
                if ((is_own_pixel || is_in_band) && member_count < MAX_MEMBERS) {
                    let nearer = textureLoad(fine_depth, fine_pixel + offset, i) > threshold;
                    members[member_count] = packed_member(position, nearer);
                    member_count++;
                }
            }
        }
    }
}

// Whether every sample of the fit lies on its own side and both sides have samples.
fn separates(line: vec3<f32>) -> bool {
    var sides = vec2<u32>(0u);
    for (var i = 0u; i < member_count; i++) {
        let sample = member(i);
        let side = 2.0 * sample.z - 1.0;
        if (!(side * (dot(line.xy, sample.xy) - line.z) > -LINE_SLACK)) {
            return false;
        }
        sides += select(vec2<u32>(1u, 0u), vec2<u32>(0u, 1u), side > 0.0);
    }
    return all(sides > vec2<u32>(0u));
}

// Unit normal towards the nearer surface, scaled by (c + 2) / 4; and the depth value that separates the
// surfaces.
fn packed_line(line: vec3<f32>, threshold: f32) -> vec2<u32> {
    return vec2<u32>(pack2x16snorm(line.xy * (0.25 * line.z + 0.5)), bitcast<u32>(threshold));
}
