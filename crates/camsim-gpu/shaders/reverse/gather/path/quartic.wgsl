// A polynomial of time through five nodes, by Newton's forward differences. Twin:
// camsim_core::temporal::path::Curve.
const SEGMENT_STEPS: u32 = 4u;

struct Curve {
    begin_px: vec2<f32>,
    d1: vec2<f32>,
    d2: vec2<f32>,
    d3: vec2<f32>,
    d4: vec2<f32>,
    length_px: f32,
    inside: bool,
    end: Source,
}

// From a node, `step` steps after the first.
fn curve_from(begin: Source, pixel: vec2<u32>, ray: Ray, step: u32) -> Curve {
    let a = node_at_step(pixel, ray, step + 1u);
    let b = node_at_step(pixel, ray, step + 2u);
    let c = node_at_step(pixel, ray, step + 3u);
    let end = node_at_step(pixel, ray, step + 4u);
    // First differences of neighbours, then higher ones.
    let p = a.position_px - begin.position_px;
    let q = b.position_px - a.position_px;
    let r = c.position_px - b.position_px;
    let s = end.position_px - c.position_px;
    let pq = q - p;
    let qr = r - q;
    let rs = s - r;
    let inside = begin.inside && a.inside && b.inside && c.inside && end.inside;
    return Curve(
        begin.position_px,
        p,
        pq,
        qr - pq,
        rs - 2.0 * qr + pq,
        length(p) + length(q) + length(r) + length(s),
        inside,
        end,
    );
}

// Position after a number of steps.
fn position_on_curve(curve: Curve, steps: f32) -> vec2<f32> {
    let third = curve.d3 + 0.25 * (steps - 3.0) * curve.d4;
    let second = curve.d2 + (steps - 2.0) * (1.0 / 3.0) * third;
    return curve.begin_px + steps * (curve.d1 + 0.5 * (steps - 1.0) * second);
}
