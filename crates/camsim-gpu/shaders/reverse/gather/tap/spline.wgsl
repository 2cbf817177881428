// One tap of a cubic spline per sample, whose softness follows from the width of the pixel.
#import reverse/gather/tap/single.wgsl

fn footprint(ray: Ray) -> Footprint {
    return Footprint(
        vec2<f32>(0.0), vec2<f32>(0.0), spline_softness(side_lengths_px(ray)), vec2<u32>(1u), vec2<u32>(0u)
    );
}

fn tap_color(pixel_footprint: Footprint, source_px: vec2<f32>, tap: u32, read: u32) -> vec4<f32> {
    return ideal_color_by_spline(source_px, pixel_footprint.softness);
}
