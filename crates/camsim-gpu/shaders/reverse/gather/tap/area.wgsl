// Area taps: mean over a rectangle, with ideal pixels as squares of constant colour, in bilinear reads of two
// by two pixels; the spline for narrow pixels. Reads are taken one at a time, whatever their kind, as in
// spline_or_grid.wgsl. Twin: camsim_core::temporal::ColorImage::over_area.

// Squares of the least and largest side that is read: pixels with shorter sides use the spline, of longer
// ones the middle is read.
const MIN_SIDE_PX2: f32 = 1.0;
const MAX_SIDE_PX2: f32 = 25.0;
// Slightly above the least side, so that rounding does not decide.
const NARROW_AREA_PX: f32 = 1.00005;

// `dx` holds the sides of the rectangle.
fn footprint(ray: Ray) -> Footprint {
    let side_x_px = ray.d_dx * frame.ideal_focal_px;
    let side_y_px = ray.d_dy * frame.ideal_focal_px;
    let squared = side_x_px * side_x_px + side_y_px * side_y_px - 1.0;
    let sides = sqrt(clamp(squared, vec2<f32>(MIN_SIDE_PX2), vec2<f32>(MAX_SIDE_PX2)));
    return Footprint(
        sides, vec2<f32>(0.0), spline_softness(side_lengths_px(ray)), vec2<u32>(1u), vec2<u32>(0u)
    );
}

fn is_narrow(pixel_footprint: Footprint) -> bool {
    return all(pixel_footprint.dx <= vec2<f32>(NARROW_AREA_PX));
}

fn texel_pairs(pixel_footprint: Footprint) -> vec2<f32> {
    return min(ceil(0.5 * (pixel_footprint.dx + 1.0) - 1e-5), vec2<f32>(3.0));
}

fn reads_per_sample(pixel_footprint: Footprint) -> u32 {
    let pairs_xy = texel_pairs(pixel_footprint);
    return select(u32(pairs_xy.x * pairs_xy.y), SPLINE_READS, is_narrow(pixel_footprint));
}

fn read_count(pixel_footprint: Footprint, samples: u32) -> u32 {
    return reads_per_sample(pixel_footprint) * samples;
}

// In floats: llvmpipe divides integers lane by lane.
fn sample_index(pixel_footprint: Footprint, read: u32) -> u32 {
    return u32((f32(read) + 0.5) / f32(reads_per_sample(pixel_footprint)));
}

// Position of a read of two pixels along each axis, and its fraction of the area.
fn area_read(pixel_footprint: Footprint, source_px: vec2<f32>, read: u32) -> WeightedRead {
    let pairs_xy = texel_pairs(pixel_footprint);
    let row = floor((f32(read) + 0.5) / pairs_xy.x);
    let reach = 0.5 * (pixel_footprint.dx + 1.0);
    // Relative to the texel of the source, where the position is exact to the last bit, however far the texel
    // is from the origin.
    let base_px = floor(source_px);
    let within_px = source_px - base_px;
    let begin_px = floor(within_px - reach) + 1.0 + 2.0 * vec2<f32>(f32(read) - pairs_xy.x * row, row);
    let first = saturate(reach - abs(begin_px - within_px));
    let second = saturate(reach - abs(begin_px + 1.0 - within_px));
    let covered = first + second;
    // If neither pixel is covered, the weight is 0.
    return WeightedRead(
        base_px + begin_px + second / max(covered, vec2<f32>(1e-9)),
        covered.x * covered.y / (pixel_footprint.dx.x * pixel_footprint.dx.y),
    );
}

fn tap_color(pixel_footprint: Footprint, source_px: vec2<f32>, tap: u32, read: u32) -> vec4<f32> {
    let read_in_sample = read - reads_per_sample(pixel_footprint) * sample_index(pixel_footprint, read);
    let area_tap = area_read(pixel_footprint, source_px, read_in_sample);
    let spline_tap = spline_read(spline_at(source_px, pixel_footprint.softness), read_in_sample);
    let position_px = select(area_tap.position_px, spline_tap.position_px, is_narrow(pixel_footprint));
    return select(area_tap.weight, spline_tap.weight, is_narrow(pixel_footprint))
        * ideal_color_at(position_px);
}
