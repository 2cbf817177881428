// Area of an output pixel in the ideal frame: a grid of taps where the lens minifies.
#import reverse/gather/interface.wgsl

struct Footprint {
    // Ideal pixels per output pixel along x and y.
    dx: vec2<f32>,
    dy: vec2<f32>,
    taps: vec2<u32>,
}

fn footprint(ray: Ray) -> Footprint {
    let dx = ray.d_dx * frame.ideal_focal_px;
    let dy = ray.d_dy * frame.ideal_focal_px;
    let wanted = vec2<u32>(ceil(vec2<f32>(length(dx), length(dy)) - 0.1));
    return Footprint(dx, dy, clamp(wanted, vec2<u32>(1u), vec2<u32>(frame.max_taps)));
}

// Offset of tap i from the pixel centre, in ideal pixels; and in ideal rays for taps that need their own ray.
fn tap_fraction(area: Footprint, i: u32) -> vec2<f32> {
    let cell = vec2<f32>(f32(i % area.taps.x), f32((i / area.taps.x) % area.taps.y));
    return (cell + 0.5) / vec2<f32>(area.taps) - 0.5;
}

fn tap_offset_px(area: Footprint, i: u32) -> vec2<f32> {
    let f = tap_fraction(area, i);
    return area.dx * f.x + area.dy * f.y;
}

// Colour of tap i around a source. A pixel that takes a single tap needs the better interpolation; several taps are an average anyway.
fn tap_color(area: Footprint, source_px: vec2<f32>, i: u32) -> vec4<f32> {
    if (area.taps.x * area.taps.y == 1u) {
        return ideal_color_by_spline(source_px);
    }
    return ideal_color_at(source_px + tap_offset_px(area, i));
}
