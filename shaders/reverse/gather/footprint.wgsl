// Area of an output pixel in the ideal frame, and what reads it (the `tap` slot). Twin:
// camsim_core::temporal::Footprint.
#import reverse/gather/interface.wgsl

struct Footprint {
    // Ideal pixels per output pixel along x and y, less what reads have themselves; of areas `dx` has the
    // sides.
    dx: vec2<f32>,
    dy: vec2<f32>,
    // Softness of the spline along x and y.
    softness: vec2<f32>,
    taps: vec2<u32>,
    // The order of the taps, if the tap slot has one.
    turns: vec2<u32>,
}

// Of `samples` samples, which the reads of each add up to: how many reads they take (`reads_of`), to which of
// them a read belongs (`sample_of`), and the read's share of it (`tap_color`, where `tap` is the sample's
// number in the whole exposure).
#import <slot:tap>

fn stretches(ray: Ray) -> vec2<f32> {
    return vec2<f32>(length(ray.d_dx * frame.ideal_focal_px), length(ray.d_dy * frame.ideal_focal_px));
}

// The variance of an area `p` ideal pixels wide is p^2 / 12 along that side; the ideal pixel itself has 1 /
// 12 of it, the spline adds softness / 3.
fn softness_of(stretch: vec2<f32>) -> vec2<f32> {
    return clamp(0.25 * (stretch * stretch - 1.0), vec2<f32>(0.0), vec2<f32>(1.0));
}
