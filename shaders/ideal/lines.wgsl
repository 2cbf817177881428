// The border of two surfaces within a fine pixel, as a straight line. Four samples know where a border is to
// a tenth of a pixel; all samples along four pixels of a straight one know it to a hundredth or three. Twin:
// camsim_core::temporal::edge_lines.

// Half of the length along which samples must agree on a line, fine pixels: tried in this order.
const LINE_REACH: array<f32, 2> = array<f32, 2>(4.0, 2.0);
// Samples this near to the line take part, fine pixels.
const LINE_BAND: f32 = 0.7;
// A sample may lie this far on the wrong side.
const LINE_SLACK: f32 = 0.05;
// A line farther from the middle of its pixel misses it.
const LINE_FARTHEST: f32 = 0.72;
// Holds the slope of the logistic curve down; a separable set has no steepest one.
const LINE_RIDGE: f32 = 0.03;
const MOST_MEMBERS: u32 = 64u;
// Samples that differ by less than this, relative to the nearest, are of one surface.
const ONE_SURFACE: f32 = 0.02;

// Samples that take part, each in a word: see `packed_member`.
var<private> members: array<u32, 64>;
var<private> member_count: u32;

// Place of a sample about the middle of its fine pixel.
fn sample_offset(i: i32) -> vec2<f32> {
    let places = array<vec2<f32>, 4>(vec2<f32>(-0.125, -0.375), vec2<f32>(0.375, -0.125), vec2<f32>(-0.375, 0.125), vec2<f32>(0.125, 0.375));
    return places[i];
}

// A place about the middle of the pixel, in eighths, of which all samples' are whole and less than 64; above
// it whether the surface is the nearer one. One word is read and written faster than three floats, and says
// the same exactly.
fn packed_member(place: vec2<f32>, nearer: bool) -> u32 {
    let eighths = vec2<u32>(vec2<i32>(8.0 * place) + 64);
    return eighths.x | (eighths.y << 8u) | (u32(nearer) << 16u);
}

// Place, and 1 for the nearer surface or 0 for the farther.
fn member(i: u32) -> vec3<f32> {
    let word = members[i];
    let eighths = vec2<i32>(vec2<u32>(word & 0xffu, (word >> 8u) & 0xffu)) - 64;
    return vec3<f32>(0.125 * vec2<f32>(eighths), f32(word >> 16u));
}

fn within_key(fine_pixel: vec2<i32>, from_px: vec2<i32>, to_px: vec2<i32>) -> bool {
    return all(fine_pixel >= from_px) && all(fine_pixel < to_px);
}

// One step of Newton's method for logistic regression of a line n x = c, unknowns (n, c).
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
        let at = vec3<f32>(sample.xy, -1.0);
        let share = 1.0 / (1.0 + exp(-dot(line, at)));
        gradient += (share - sample.z) * at;
        let weight = share * (1.0 - share);
        xx += weight * at.x * at.x;
        yy += weight * at.y * at.y;
        cc += weight;
        xy += weight * at.x * at.y;
        xc -= weight * at.x;
        yc -= weight * at.y;
    }
    // The symmetric matrix's inverse by cofactors; the ridge keeps it regular.
    let a = yy * cc - yc * yc;
    let b = xc * yc - xy * cc;
    let c = xy * yc - xc * yy;
    let inverse = mat3x3<f32>(vec3<f32>(a, b, c), vec3<f32>(b, xx * cc - xc * xc, xy * xc - xx * yc), vec3<f32>(c, xy * xc - xx * yc, xx * yy - xy * xy));
    return line - (inverse * gradient) / (xx * a + xy * b + xc * c);
}

fn fitted_line(steps: u32) -> vec3<f32> {
    var line = vec3<f32>(0.0);
    for (var i = 0u; i < steps; i++) {
        line = line_step(line);
    }
    return line / max(length(line.xy), 1e-20);
}

// The line through a fine pixel, as [`packed_line`] has it, or 0 where there is none: one surface, more than
// two, or a corner. Keys have their rows from `from_px` to before `to_px`.
fn edge_line(fine_pixel: vec2<i32>, from_px: vec2<i32>, to_px: vec2<i32>) -> vec2<u32> {
    var low = 1e30;
    var high = 0.0;
    for (var i = 0; i < 36; i++) {
        let at = clamp(fine_pixel + vec2<i32>(i % 3 - 1, (i / 3) % 3 - 1), from_px, to_px - 1);
        let d = textureLoad(fine_depth, at, i / 9);
        low = min(low, d);
        high = max(high, d);
    }
    if (low >= (1.0 - ONE_SURFACE) * high) {
        return vec2<u32>(0u);
    }
    let between = 0.5 * (low + high);
    member_count = 0u;
    for (var i = 0; i < 36; i++) {
        let step = vec2<i32>(i % 3 - 1, (i / 3) % 3 - 1);
        if (within_key(fine_pixel + step, from_px, to_px)) {
            let nearer = textureLoad(fine_depth, fine_pixel + step, i / 9) > between;
            members[member_count] = packed_member(vec2<f32>(step) + sample_offset(i / 9), nearer);
            member_count++;
        }
    }
    let rough = fitted_line(3u);
    if (abs(dot(rough.xy, rough.xy) - 1.0) > 0.1 || abs(rough.z) > 1.0) {
        return vec2<u32>(0u);
    }
    for (var k = 0; k < 2; k++) {
        var reaches = LINE_REACH;
        collect_along(fine_pixel, rough, reaches[k], between, from_px, to_px);
        let line = fitted_line(4u);
        if (separates(line)) {
            return select(vec2<u32>(0u), packed_line(line, between), abs(line.z) < LINE_FARTHEST);
        }
    }
    return vec2<u32>(0u);
}

// Samples within a band about the line, as far along it as `reach`, and all of the pixel itself.
fn collect_along(fine_pixel: vec2<i32>, line: vec3<f32>, reach: f32, between: f32, from_px: vec2<i32>, to_px: vec2<i32>) {
    member_count = 0u;
    let flat = abs(line.y) >= abs(line.x);
    let major = select(line.yx, line.xy, flat);
    let last = i32(reach);
    for (var along = -last; along <= last; along++) {
        let middle = i32(round((line.z - major.x * f32(along)) / major.y));
        for (var across = middle - 1; across <= middle + 1; across++) {
            let step = select(vec2<i32>(across, along), vec2<i32>(along, across), flat);
            if (!within_key(fine_pixel + step, from_px, to_px)) {
                continue;
            }
            let own = all(step == vec2<i32>(0));
            for (var i = 0; i < 4; i++) {
                let place = vec2<f32>(step) + sample_offset(i);
                let inside = abs(dot(line.xy, place) - line.z) < LINE_BAND && abs(line.x * place.y - line.y * place.x) < reach;
                if ((own || inside) && member_count < MOST_MEMBERS) {
                    let nearer = textureLoad(fine_depth, fine_pixel + step, i) > between;
                    members[member_count] = packed_member(place, nearer);
                    member_count++;
                }
            }
        }
    }
}

// Whether all members lie on their side, and there are some on both.
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

// Unit normal towards the nearer surface, times (c + 2) / 4; and the depth value between the two surfaces.
fn packed_line(line: vec3<f32>, between: f32) -> vec2<u32> {
    return vec2<u32>(pack2x16snorm(line.xy * (0.25 * line.z + 0.5)), bitcast<u32>(between));
}
