// A straight line from node to node. Twin: camsim_core::temporal::path::Curve.
const STEPS: u32 = 1u;

struct Curve {
    begin_px: vec2<f32>,
    d1: vec2<f32>,
    length_px: f32,
    inside: bool,
    end: Source,
}

// From a node on, so many steps after the first.
fn curve_from(begin: Source, pixel: vec2<u32>, ray: Ray, step: u32) -> Curve {
    let end = node_at(pixel, ray, step + 1u);
    let d1 = end.at_px - begin.at_px;
    return Curve(begin.at_px, d1, length(d1), begin.inside && end.inside, end);
}

// Place after so many steps.
fn along(curve: Curve, steps: f32) -> vec2<f32> {
    return curve.begin_px + steps * curve.d1;
}
