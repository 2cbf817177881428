// A spline where a pixel is up to WIDEST_SPLINE_PX wide, a grid of bilinear reads where it is wider. Reads
// are taken one at a time, whatever they are of: five of them are a sample of the spline. llvmpipe goes
// through both sides of a condition, so that a spline beside each read of the grid would cost six times as
// many.
#import reverse/gather/tap/cells.wgsl

fn footprint(ray: Ray) -> Footprint {
    return grid_of(ray, stretches(ray));
}

fn is_narrow(area: Footprint) -> bool {
    return area.taps.x * area.taps.y == 1u;
}

fn reads_of(area: Footprint, samples: u32) -> u32 {
    return select(samples, SPLINE_READS * samples, is_narrow(area));
}

fn sample_of(area: Footprint, read: u32) -> u32 {
    return select(read, u32((f32(read) + 0.5) / f32(SPLINE_READS)), is_narrow(area));
}

fn tap_color(area: Footprint, source_px: vec2<f32>, tap: u32, read: u32) -> vec4<f32> {
    let of_spline = spline_read(spline_around(source_px, area.softness), read - SPLINE_READS * sample_of(area, read));
    let at_px = select(source_px + cell_px(area, tap), of_spline.at_px, is_narrow(area));
    return select(1.0, of_spline.weight, is_narrow(area)) * ideal_color_at(at_px);
}
