// A grid of bilinear reads, up to `frame.max_taps` along each side: where nearly all pixels are wide enough.
// It knows no spline, because llvmpipe goes through both sides of a condition: six reads for each of the
// grid.
#import reverse/gather/tap/cells.wgsl
#import reverse/gather/tap/single.wgsl

fn footprint(ray: Ray) -> Footprint {
    return grid_of(ray, stretches(ray));
}

fn tap_color(area: Footprint, source_px: vec2<f32>, tap: u32, read: u32) -> vec4<f32> {
    return ideal_color_at(source_px + cell_px(area, tap));
}
