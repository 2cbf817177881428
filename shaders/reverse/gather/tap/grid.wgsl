// A spline where a pixel is up to WIDEST_SPLINE_PX wide, a grid of bilinear reads where it is wider: up to `frame.max_taps` along each side.

// A bilinear read has itself the variance of a pixel this wide (squared: 1 of the ideal pixel, 2 of the tent).
const WIDEST_SPLINE_PX: f32 = 1.7320508;

fn taps_of(stretch: vec2<f32>) -> vec2<u32> {
    let wide = stretch > vec2<f32>(WIDEST_SPLINE_PX);
    return select(vec2<u32>(1u), clamp(vec2<u32>(ceil(stretch - 0.1)), vec2<u32>(1u), vec2<u32>(frame.max_taps)), wide);
}

// What the reads have themselves the grid need not have.
fn spread_of(side: vec2<f32>, stretch: f32, taps: u32) -> vec2<f32> {
    if (taps == 1u) {
        return vec2<f32>(0.0);
    }
    let n = f32(taps);
    return side * sqrt(max(stretch * stretch - 3.0, 0.0) / (1.0 - 1.0 / (n * n))) / stretch;
}

fn footprint(ray: Ray) -> Footprint {
    let stretch = stretches(ray);
    let taps = taps_of(stretch);
    let dx = spread_of(ray.d_dx * frame.ideal_focal_px, stretch.x, taps.x);
    let dy = spread_of(ray.d_dy * frame.ideal_focal_px, stretch.y, taps.y);
    return Footprint(dx, dy, softness_of(stretch), taps);
}

// Colour of tap i around a source. Taps are taken in turns, each followed by the one opposite, so that any even number of them has the
// pixel's centre as its mean.
fn tap_color(area: Footprint, source_px: vec2<f32>, i: u32) -> vec4<f32> {
    if (area.taps.x * area.taps.y == 1u) {
        return ideal_color_by_spline(source_px, area.softness);
    }
    let count = area.taps.x * area.taps.y;
    let turn = i % count;
    let place = select(turn / 2u, count - 1u - turn / 2u, turn % 2u == 1u);
    let cell = vec2<f32>(f32(place % area.taps.x), f32(place / area.taps.x));
    let share = (cell + 0.5) / vec2<f32>(area.taps) - 0.5;
    return ideal_color_at(source_px + area.dx * share.x + area.dy * share.y);
}
