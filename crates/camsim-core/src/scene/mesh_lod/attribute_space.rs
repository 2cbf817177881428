//! The attribute space in which simplified shapes are compared with the full one: position, texture
//! coordinates, colour and, for lit shapes, normal, all in metres.
//!
//! A point in this space describes position and appearance, so one distance bounds both: a surface within a
//! distance of another one has, within that distance, each of its colours and texture coordinates.

use crate::scene::{MeshVertex, Shape};

/// Dimensions for shapes without light: position, texture coordinates, tint.
pub(super) const UNLIT: usize = 9;
/// Dimensions for lit shapes, including the normal.
pub(super) const LIT: usize = 12;

/// A point of a surface with its attributes, metres.
pub(super) type Point<const AXES: usize> = [f64; AXES];

/// Conversion of texture coordinates and colours to metres.
#[derive(Clone, Copy, Debug)]
pub(super) struct AttributeSpace {
    /// Metres of surface per unit of texture coordinates, averaged over the triangles.
    uv_m: f64,
    /// Metres for the full range of a colour: the diagonal of the shape, as if the colour changed evenly over
    /// it.
    tint_m: f64,
}

impl AttributeSpace {
    /// Conversion for a shape.
    pub fn new(shape: &Shape) -> Self {
        let mut areas = [0.0; 2];
        for corners in shape.indices.chunks_exact(3) {
            let [a, b, c] = [0, 1, 2].map(|k| shape.vertices[corners[k] as usize]);
            let position = |vertex: MeshVertex| glam::Vec3::from(vertex.position_m).as_dvec3();
            let uv = |vertex: MeshVertex| glam::Vec2::from(vertex.uv).as_dvec2();
            areas[0] += (position(b) - position(a)).cross(position(c) - position(a)).length();
            areas[1] += (uv(b) - uv(a)).perp_dot(uv(c) - uv(a)).abs();
        }
        let bounds = shape.bounds();
        let diagonal_m = if bounds.is_empty() { 0.0 } else { (bounds.max - bounds.min).length() };
        // Where texture coordinates span no area they are palette entries, so every difference is another
        // colour.
        let uv_m = if areas[1] > 1e-12 * areas[0] { (areas[0] / areas[1]).sqrt() } else { 1e3 * diagonal_m };
        Self { uv_m, tint_m: diagonal_m }
    }

    /// The vertices of a shape as points. A difference of normals counts like a difference of colours: light
    /// changes by less than the normal does (`scene/light.rs`).
    pub fn points<const AXES: usize>(&self, shape: &Shape) -> Vec<Point<AXES>> {
        let point = |(i, vertex): (usize, &MeshVertex)| {
            let [x, y, z] = vertex.position_m.map(f64::from);
            let [u, v] = vertex.uv.map(|part| f64::from(part) * self.uv_m);
            let [r, g, b, a] = vertex.tint.map(|part| f64::from(part) * self.tint_m);
            let [n0, n1, n2] = shape
                .normals
                .get(i)
                .map_or([0.0; 3], |normal| normal.map(|part| f64::from(part) * self.tint_m));
            let all = [x, y, z, u, v, r, g, b, a, n0, n1, n2];
            std::array::from_fn(|axis| all[axis])
        };
        shape.vertices.iter().enumerate().map(point).collect()
    }
}

pub(super) fn minus<const AXES: usize>(a: &Point<AXES>, b: &Point<AXES>) -> Point<AXES> {
    std::array::from_fn(|k| a[k] - b[k])
}

pub(super) fn dot<const AXES: usize>(a: &Point<AXES>, b: &Point<AXES>) -> f64 {
    (0..AXES).map(|k| a[k] * b[k]).sum()
}

pub(super) fn between<const AXES: usize>(a: &Point<AXES>, b: &Point<AXES>) -> Point<AXES> {
    std::array::from_fn(|k| 0.5 * (a[k] + b[k]))
}

pub(super) fn middle<const AXES: usize>([a, b, c]: &[Point<AXES>; 3]) -> Point<AXES> {
    std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0)
}

/// Squared distance of a point from a triangle. A triangle is convex, so the distance of a point between
/// three others is at most that of the farthest one.
pub(super) fn distance2<const AXES: usize>(point: &Point<AXES>, [a, b, c]: [&Point<AXES>; 3]) -> f64 {
    let (e, f, v) = (minus(b, a), minus(c, a), minus(point, a));
    let (ee, ef, ff) = (dot(&e, &e), dot(&e, &f), dot(&f, &f));
    let (ev, fv) = (dot(&e, &v), dot(&f, &v));
    let det = ee * ff - ef * ef;
    if det > 1e-14 * ee * ff {
        let (s, t) = ((ff * ev - ef * fv) / det, (ee * fv - ef * ev) / det);
        if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
            let left: Point<AXES> = std::array::from_fn(|k| v[k] - s * e[k] - t * f[k]);
            return dot(&left, &left);
        }
    }
    [(a, b), (a, c), (b, c)]
        .into_iter()
        .map(|(a, b)| from_segment2(point, a, b))
        .fold(f64::INFINITY, f64::min)
}

/// Squared distance of a point from a line segment.
pub(super) fn from_segment2<const AXES: usize>(point: &Point<AXES>, a: &Point<AXES>, b: &Point<AXES>) -> f64 {
    let (along, v) = (minus(b, a), minus(point, a));
    let length2 = dot(&along, &along);
    let fraction = if length2 > 0.0 { (dot(&along, &v) / length2).clamp(0.0, 1.0) } else { 0.0 };
    let left: Point<AXES> = std::array::from_fn(|k| v[k] - fraction * along[k]);
    dot(&left, &left)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangle_distance_matches_a_search() {
        let part = |k: u32| f64::from(crate::noise::pcg4d([k, 3, 1, 4])[0] >> 8) / f64::from(1 << 24);
        for k in 0..50 {
            let point =
                |n: u32| -> Point<UNLIT> { std::array::from_fn(|axis| part(100 * k + 10 * n + axis as u32)) };
            let (p, corners) = (point(0), [point(1), point(2), point(3)]);
            let [a, b, c] = &corners;
            let distance = distance2(&p, [a, b, c]).sqrt();
            let steps = 200;
            let mut nearest = f64::INFINITY;
            for i in 0..=steps {
                for j in 0..=steps - i {
                    let (s, t) = (f64::from(i) / f64::from(steps), f64::from(j) / f64::from(steps));
                    let left: Point<UNLIT> =
                        std::array::from_fn(|n| p[n] - a[n] - s * (b[n] - a[n]) - t * (c[n] - a[n]));
                    nearest = nearest.min(dot(&left, &left).sqrt());
                }
            }
            // Points of the grid are up to one step apart.
            assert!(distance <= nearest + 1e-12 && distance > nearest - 0.02, "{distance} {nearest}");
        }
    }
}
