// The grid's reads of a pixel that is wide enough for more than one. Twin: camsim_core::temporal::Footprint.

// A bilinear read has itself the variance of a pixel this wide (squared: 1 of the ideal pixel, 2 of the
// tent).
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
    return Footprint(dx, dy, softness_of(stretch), taps, turns_of(taps));
}

// The order in which cells are read while the exposure goes by, four bits each and the first one lowest, by
// columns and rows, of which there are no fewer columns; 0 of grids that have none of their own. Twin:
// camsim_core::temporal::footprint, which says where they come from.
fn turns_of(taps: vec2<u32>) -> vec2<u32> {
    let grid = 8u * max(taps.x, taps.y) + min(taps.x, taps.y);
    var turns = vec2<u32>(0u);
    turns = select(turns, vec2<u32>(0x1302u, 0u), grid == 33u);
    turns = select(turns, vec2<u32>(0x420531u, 0u), grid == 26u);
    turns = select(turns, vec2<u32>(0x24716035u, 0u), grid == 34u);
    turns = select(turns, vec2<u32>(0x15604823u, 0x7u), grid == 27u);
    turns = select(turns, vec2<u32>(0x5b831a46u, 0x7902u), grid == 35u);
    return select(turns, vec2<u32>(0xc5be318au, 0x64df2790u), grid == 36u);
}

// Where read number `tap` (cyclic) lies around the source. In floats, exact up to 2^20 reads: llvmpipe
// divides integers one lane after the other.
fn cell_px(area: Footprint, tap: u32) -> vec2<f32> {
    let side = vec2<f32>(area.taps);
    let count = side.x * side.y;
    let turn = f32(tap) - count * floor((f32(tap) + 0.5) / count);
    // Without an order of its own: the first and the last, the second and the one before the last, and so on.
    let pair = floor(0.5 * turn);
    let in_pairs = select(pair, count - 1.0 - pair, turn > 2.0 * pair);
    let number = u32(turn);
    let of_order = f32((select(area.turns.x, area.turns.y, number > 7u) >> (4u * (number & 7u))) & 15u);
    let is_ordered = area.turns.x != 0u;
    let place = select(in_pairs, of_order, is_ordered);
    // Cells of an order count along the longer side.
    let is_turned = is_ordered && side.y > side.x;
    let along = select(side.x, side.y, is_turned);
    let across = floor((place + 0.5) / along);
    let cell = vec2<f32>(place - along * across, across);
    let share = (select(cell, cell.yx, is_turned) + 0.5) / side - 0.5;
    return area.dx * share.x + area.dy * share.y;
}
