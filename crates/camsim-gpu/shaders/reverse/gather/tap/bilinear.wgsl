// One bilinear tap per sample, where its blur is within the tolerance.
#import reverse/gather/tap/single.wgsl

fn footprint(ray: Ray) -> Footprint {
    return Footprint(vec2<f32>(0.0), vec2<f32>(0.0), vec2<f32>(0.0), vec2<u32>(1u), vec2<u32>(0u));
}

fn tap_color(pixel_footprint: Footprint, source_px: vec2<f32>, tap: u32, read: u32) -> vec4<f32> {
    return ideal_color_at(source_px);
}
