// The grid's reads of a pixel that is wide enough for more than one. Twin: camsim_core::temporal::Footprint.

// A bilinear read has itself the variance of a pixel this wide (squared: 1 of the ideal pixel, 2 of the tent).
const WIDEST_SPLINE_PX: f32 = 1.7320508;

fn taps_of(stretch: vec2<f32>) -> vec2<u32> {
    let wide = stretch > vec2<f32>(WIDEST_SPLINE_PX);
    return select(vec2<u32>(1u), clamp(vec2<u32>(ceil(stretch - 0.1)), vec2<u32>(1u), vec2<u32>(frame.max_taps)), wide);
}

// What the reads have themselves the grid need not have.
fn spread_of(side: vec2<f32>, stretch: f32, taps: u32) -> vec2<f32> {
    let n = f32(max(taps, 2u));
    return select(side * sqrt(max(stretch * stretch - 3.0, 0.0) / (1.0 - 1.0 / (n * n))) / stretch, vec2<f32>(0.0), taps == 1u);
}

fn grid_of(ray: Ray, stretch: vec2<f32>) -> Footprint {
    let taps = taps_of(stretch);
    let dx = spread_of(ray.d_dx * frame.ideal_focal_px, stretch.x, taps.x);
    let dy = spread_of(ray.d_dy * frame.ideal_focal_px, stretch.y, taps.y);
    return Footprint(dx, dy, softness_of(stretch), taps);
}

// Where read number `tap` (cyclic) lies around the source. Each is followed by the one opposite, so that any even number of them has the
// pixel's centre as its mean. In floats, exact up to 2^20 reads: llvmpipe divides integers one lane after the other.
fn cell_px(area: Footprint, tap: u32) -> vec2<f32> {
    let side = vec2<f32>(area.taps);
    let count = side.x * side.y;
    let turn = f32(tap) - count * floor((f32(tap) + 0.5) / count);
    let pair = floor(0.5 * turn);
    let place = select(pair, count - 1.0 - pair, turn > 2.0 * pair);
    let row = floor((place + 0.5) / side.x);
    let share = (vec2<f32>(place - side.x * row, row) + 0.5) / side - 0.5;
    return area.dx * share.x + area.dy * share.y;
}
