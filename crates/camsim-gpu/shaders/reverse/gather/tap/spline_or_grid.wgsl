// A spline for pixels up to WIDEST_SPLINE_PX wide, a grid of bilinear taps for wider ones. Reads are taken
// one at a time, whatever their kind: five of them are one tap of the spline. llvmpipe executes both sides of
// a condition, so that a spline beside each tap of the grid would cost six times as many reads.
#import reverse/gather/tap/cells.wgsl

fn footprint(ray: Ray) -> Footprint {
    return tap_grid(ray, side_lengths_px(ray));
}

fn is_narrow(pixel_footprint: Footprint) -> bool {
    return pixel_footprint.taps.x * pixel_footprint.taps.y == 1u;
}

fn read_count(pixel_footprint: Footprint, samples: u32) -> u32 {
    return select(samples, SPLINE_READS * samples, is_narrow(pixel_footprint));
}

fn sample_index(pixel_footprint: Footprint, read: u32) -> u32 {
    return select(read, u32((f32(read) + 0.5) / f32(SPLINE_READS)), is_narrow(pixel_footprint));
}

fn tap_color(pixel_footprint: Footprint, source_px: vec2<f32>, tap: u32, read: u32) -> vec4<f32> {
    let spline_tap = spline_read(
        spline_at(source_px, pixel_footprint.softness),
        read - SPLINE_READS * sample_index(pixel_footprint, read),
    );
    let position_px = select(
        source_px + tap_offset_px(pixel_footprint, tap), spline_tap.position_px, is_narrow(pixel_footprint)
    );
    return select(1.0, spline_tap.weight, is_narrow(pixel_footprint)) * ideal_color_at(position_px);
}
