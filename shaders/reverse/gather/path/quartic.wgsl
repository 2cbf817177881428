// A polynomial of time through five nodes, by Newton's forward differences. Twin:
// camsim_core::temporal::path::Curve.
const STEPS: u32 = 4u;

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

// From a node on, so many steps after the first.
fn curve_from(begin: Source, pixel: vec2<u32>, ray: Ray, step: u32) -> Curve {
    let a = node_at(pixel, ray, step + 1u);
    let b = node_at(pixel, ray, step + 2u);
    let c = node_at(pixel, ray, step + 3u);
    let end = node_at(pixel, ray, step + 4u);
    // First differences of neighbours, then those of them, and so on.
    let p = a.at_px - begin.at_px;
    let q = b.at_px - a.at_px;
    let r = c.at_px - b.at_px;
    let s = end.at_px - c.at_px;
    let pq = q - p;
    let qr = r - q;
    let rs = s - r;
    let inside = begin.inside && a.inside && b.inside && c.inside && end.inside;
    return Curve(begin.at_px, p, pq, qr - pq, rs - 2.0 * qr + pq, length(p) + length(q) + length(r) + length(s), inside, end);
}

// Place after so many steps.
fn along(curve: Curve, steps: f32) -> vec2<f32> {
    let third = curve.d3 + 0.25 * (steps - 3.0) * curve.d4;
    let second = curve.d2 + (steps - 2.0) * (1.0 / 3.0) * third;
    return curve.begin_px + steps * (curve.d1 + 0.5 * (steps - 1.0) * second);
}
