// One read of a spline a sample, as soft as the pixel is wide.
#import reverse/gather/tap/single.wgsl

fn footprint(ray: Ray) -> Footprint {
    return Footprint(vec2<f32>(0.0), vec2<f32>(0.0), softness_of(stretches(ray)), vec2<u32>(1u), vec2<u32>(0u));
}

fn tap_color(area: Footprint, source_px: vec2<f32>, tap: u32, read: u32) -> vec4<f32> {
    return ideal_color_by_spline(source_px, area.softness);
}
