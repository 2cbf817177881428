// A grid of bilinear taps, up to `frame.max_taps` along each side, where nearly all pixels are wide enough.
// It has no spline, because llvmpipe executes both sides of a condition: that would be six reads per tap of
// the grid.
#import reverse/gather/tap/cells.wgsl
#import reverse/gather/tap/single.wgsl

fn footprint(ray: Ray) -> Footprint {
    return tap_grid(ray, side_lengths_px(ray));
}

fn tap_color(pixel_footprint: Footprint, source_px: vec2<f32>, tap: u32, read: u32) -> vec4<f32> {
    return ideal_color_at(source_px + tap_offset_px(pixel_footprint, tap));
}
