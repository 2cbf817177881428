// A parabola of time through three nodes, by Newton's forward differences. Twin:
// camsim_core::temporal::path::Curve.
const SEGMENT_STEPS: u32 = 2u;

struct Curve {
    begin_px: vec2<f32>,
    d1: vec2<f32>,
    d2: vec2<f32>,
    length_px: f32,
    inside: bool,
    end: Source,
}

// From a node, `step` steps after the first.
fn curve_from(begin: Source, pixel: vec2<u32>, ray: Ray, step: u32) -> Curve {
    let middle = node_at_step(pixel, ray, step + 1u);
    let end = node_at_step(pixel, ray, step + 2u);
    let d1 = middle.position_px - begin.position_px;
    let last = end.position_px - middle.position_px;
    return Curve(
        begin.position_px,
        d1,
        last - d1,
        length(d1) + length(last),
        begin.inside && middle.inside && end.inside,
        end,
    );
}

// Position after a number of steps.
fn position_on_curve(curve: Curve, steps: f32) -> vec2<f32> {
    return curve.begin_px + steps * (curve.d1 + 0.5 * (steps - 1.0) * curve.d2);
}
