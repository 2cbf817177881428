// Grid of bilinear taps, for pixels wider than one tap. Twin: camsim_core::temporal::Footprint.

// Width of a box with the variance of one bilinear tap (squared: 1 of the ideal pixel, 2 of the tent).
const WIDEST_SPLINE_PX: f32 = 1.7320508;

fn tap_counts(sides_px: vec2<f32>) -> vec2<u32> {
    let is_wide = sides_px > vec2<f32>(WIDEST_SPLINE_PX);
    return select(
        vec2<u32>(1u),
        clamp(vec2<u32>(ceil(sides_px - 0.1)), vec2<u32>(1u), vec2<u32>(frame.max_taps)),
        is_wide,
    );
}

// Extent of a grid whose taps together with their own blur have the variance of the pixel.
fn grid_extent(side: vec2<f32>, sides_px: f32, taps: u32) -> vec2<f32> {
    let count = f32(max(taps, 2u));
    return select(
        side * sqrt(max(sides_px * sides_px - 3.0, 0.0) / (1.0 - 1.0 / (count * count))) / sides_px,
        vec2<f32>(0.0),
        taps == 1u,
    );
}

fn tap_grid(ray: Ray, sides_px: vec2<f32>) -> Footprint {
    let taps = tap_counts(sides_px);
    let dx = grid_extent(ray.d_dx * frame.ideal_focal_px, sides_px.x, taps.x);
    let dy = grid_extent(ray.d_dy * frame.ideal_focal_px, sides_px.y, taps.y);
    return Footprint(dx, dy, spline_softness(sides_px), taps, tap_order(taps));
}

// Order in which the cells of a grid are read during the exposure, four bits each, the first one lowest, for
// columns >= rows; 0 for grids without an order of their own. Twin: camsim_core::temporal::footprint, which
// says how they were found.
fn tap_order(taps: vec2<u32>) -> vec2<u32> {
    let grid = 8u * max(taps.x, taps.y) + min(taps.x, taps.y);
    var order = vec2<u32>(0u);
    order = select(order, vec2<u32>(0x1302u, 0u), grid == 33u);
    order = select(order, vec2<u32>(0x420531u, 0u), grid == 26u);
    order = select(order, vec2<u32>(0x24716035u, 0u), grid == 34u);
    order = select(order, vec2<u32>(0x15604823u, 0x7u), grid == 27u);
    order = select(order, vec2<u32>(0x5b831a46u, 0x7902u), grid == 35u);
    return select(order, vec2<u32>(0xc5be318au, 0x64df2790u), grid == 36u);
}

// Offset of tap `tap` (cyclic) from the source, ideal pixels. In floats, exact up to 2^20 taps: llvmpipe
// divides integers lane by lane.
fn tap_offset_px(pixel_footprint: Footprint, tap: u32) -> vec2<f32> {
    let side = vec2<f32>(pixel_footprint.taps);
    let count = side.x * side.y;
    let turn = f32(tap) - count * floor((f32(tap) + 0.5) / count);
    // Without an order of its own the grid alternates: first, last, second, last but one, and so on.
    let pair = floor(0.5 * turn);
    let alternating_cell = select(pair, count - 1.0 - pair, turn > 2.0 * pair);
    let turn_index = u32(turn);
    let ordered_cell = f32(
        (
            select(
                pixel_footprint.order.x, pixel_footprint.order.y, turn_index > 7u
            ) >> (4u * (turn_index & 7u))
        ) & 15u
    );
    let is_ordered = pixel_footprint.order.x != 0u;
    let cell_index = select(alternating_cell, ordered_cell, is_ordered);
    // Cells of an order are numbered along the longer side.
    let is_transposed = is_ordered && side.y > side.x;
    let columns = select(side.x, side.y, is_transposed);
    let side_x_px = floor((cell_index + 0.5) / columns);
    let cell = vec2<f32>(cell_index - columns * side_x_px, side_x_px);
    let fraction = (select(cell, cell.yx, is_transposed) + 0.5) / side - 0.5;
    return pixel_footprint.dx * fraction.x + pixel_footprint.dy * fraction.y;
}
