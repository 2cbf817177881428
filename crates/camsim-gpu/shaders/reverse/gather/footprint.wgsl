// Footprint of an output pixel in the ideal frame, and its taps (the `tap` slot). Twin:
// camsim_core::temporal::Footprint.
#import reverse/gather/interface.wgsl

struct Footprint {
    // Extent of the tap grid along the output pixel's x and y axes, ideal pixels. For area taps `dx` holds
    // the sides of the rectangle.
    dx: vec2<f32>,
    dy: vec2<f32>,
    // Softness of the spline along x and y.
    softness: vec2<f32>,
    taps: vec2<u32>,
    // Order of the taps, if the grid has one of its own.
    order: vec2<u32>,
}

// The slot defines, for a number of samples: how many reads they need (`read_count`), to which sample a read
// belongs (`sample_index`), and the weighted colour of a read (`tap_color`, where `tap` is the sample's
// number in the whole exposure).
#import <slot:tap>

fn side_lengths_px(ray: Ray) -> vec2<f32> {
    return vec2<f32>(length(ray.d_dx * frame.ideal_focal_px), length(ray.d_dy * frame.ideal_focal_px));
}

// A box of side p ideal pixels has the variance p^2 / 12. The ideal pixel contributes 1 / 12 of it, the
// spline softness / 3.
fn spline_softness(sides_px: vec2<f32>) -> vec2<f32> {
    return clamp(0.25 * (sides_px * sides_px - 1.0), vec2<f32>(0.0), vec2<f32>(1.0));
}
