// The mean over a pixel's area, ideal pixels being squares of one colour, in reads of two by two of them; a
// spline where the pixel is narrow. Reads are taken one at a time, whatever they are of, as in
// spline_or_grid.wgsl. Twin: camsim_core::temporal::ColorImage::over_area.

// Sides that are read, squared: areas that are narrower are splines, of wider ones the middle is read.
const NARROWEST_PX2: f32 = 1.0;
const WIDEST_PX2: f32 = 25.0;
// A little more than the narrowest, so that rounding decides nothing.
const NARROW_PX: f32 = 1.00005;

// Sides of the area in place of the grid's.
fn footprint(ray: Ray) -> Footprint {
    let across = ray.d_dx * frame.ideal_focal_px;
    let down = ray.d_dy * frame.ideal_focal_px;
    let square = across * across + down * down - 1.0;
    let sides = sqrt(clamp(square, vec2<f32>(NARROWEST_PX2), vec2<f32>(WIDEST_PX2)));
    return Footprint(sides, vec2<f32>(0.0), softness_of(stretches(ray)), vec2<u32>(1u), vec2<u32>(0u));
}

fn is_narrow(area: Footprint) -> bool {
    return all(area.dx <= vec2<f32>(NARROW_PX));
}

fn pairs_of(area: Footprint) -> vec2<f32> {
    return min(ceil(0.5 * (area.dx + 1.0) - 1e-5), vec2<f32>(3.0));
}

fn reads_of_sample(area: Footprint) -> u32 {
    let pairs = pairs_of(area);
    return select(u32(pairs.x * pairs.y), SPLINE_READS, is_narrow(area));
}

fn reads_of(area: Footprint, samples: u32) -> u32 {
    return reads_of_sample(area) * samples;
}

// In floats: llvmpipe divides integers one lane after the other.
fn sample_of(area: Footprint, read: u32) -> u32 {
    return u32((f32(read) + 0.5) / f32(reads_of_sample(area)));
}

// Where two pixels along each axis are read, and which part of the area they have.
fn area_read(area: Footprint, source_px: vec2<f32>, read: u32) -> WeighedRead {
    let pairs = pairs_of(area);
    let row = floor((f32(read) + 0.5) / pairs.x);
    let reach = 0.5 * (area.dx + 1.0);
    // From the place within its texel on, which is known to the last bit however far from the first one that
    // is.
    let base_px = floor(source_px);
    let within_px = source_px - base_px;
    let begin_px = floor(within_px - reach) + 1.0 + 2.0 * vec2<f32>(f32(read) - pairs.x * row, row);
    let first = saturate(reach - abs(begin_px - within_px));
    let second = saturate(reach - abs(begin_px + 1.0 - within_px));
    let both = first + second;
    // Where neither has any the read counts for nothing.
    return WeighedRead(base_px + begin_px + second / max(both, vec2<f32>(1e-9)), both.x * both.y / (area.dx.x * area.dx.y));
}

fn tap_color(area: Footprint, source_px: vec2<f32>, tap: u32, read: u32) -> vec4<f32> {
    let of_sample = read - reads_of_sample(area) * sample_of(area, read);
    let of_area = area_read(area, source_px, of_sample);
    let of_spline = spline_read(spline_around(source_px, area.softness), of_sample);
    let at_px = select(of_area.at_px, of_spline.at_px, is_narrow(area));
    return select(of_area.weight, of_spline.weight, is_narrow(area)) * ideal_color_at(at_px);
}
