//! Upper bound of the Hausdorff distance between two triangle meshes.
//!
//! If all three corners of a triangle are within a distance of *one* other triangle, the whole triangle is,
//! because the other one is convex. Where no single triangle suffices, it is cut along the borders of the
//! nearest one, or into four, and each part is tested again.

use std::cell::Cell;

use glam::DVec3;
use rayon::prelude::*;

use super::attribute_space::{Point, between, distance2, dot, middle, minus};
use crate::scene::{Aabb, proximity_bvh::ProximityBvh};

/// Limits on the depth of the cuts and on the number of parts per triangle. Parts beyond them contribute
/// their current bound.
const MAX_CUTS: u32 = 16;
const MAX_PARTS: u32 = 6000;
/// Triangles per task, and the stride of those that are measured first.
const TRIANGLES_A_TASK: usize = 1024;
const SAMPLE_STRIDE: usize = 64;
/// Ratio of the sizes of a part and its nearest triangle above which the part is cut into four.
const QUARTER_RATIO: f64 = 4.0;
/// Fraction of a triangle's height that is not worth a cut.
const SLIVER: f64 = 1e-9;
/// Difference of two bounds by rounding, and more, relative to the tolerance.
const ROUNDING: f64 = 1e5;
/// A part is cut only if its bound exceeds the known distance by this factor.
const CUT_RATIO: f64 = 1.1;

/// Upper bound of the Hausdorff distance between two sets of triangles; infinite if one of them is empty.
pub(super) fn hausdorff_bound_m<const AXES: usize>(
    points: &[Point<AXES>],
    one: &[[u32; 3]],
    other: &[[u32; 3]],
    tolerance_m: f64,
) -> f64 {
    if one.is_empty() || other.is_empty() {
        return f64::INFINITY;
    }
    let one_sided = HausdorffSearch::new(points, other, tolerance_m).farthest_m(one, tolerance_m);
    HausdorffSearch::new(points, one, tolerance_m).farthest_m(other, one_sided)
}

/// Lower bound of [`hausdorff_bound_m`]: how far the corners of some triangles are from the others.
pub(super) fn hausdorff_least_m<const AXES: usize>(
    points: &[Point<AXES>],
    one: &[[u32; 3]],
    other: &[[u32; 3]],
    tolerance_m: f64,
) -> f64 {
    let search = HausdorffSearch::new(points, other, tolerance_m);
    let corners = |&triangle: &[u32; 3]| triangle.map(|corner| points[corner as usize]);
    let some = one.iter().step_by(SAMPLE_STRIDE).map(|triangle| search.lower_bound_m(&corners(triangle)));
    tolerance_m.max(some.fold(0.0, f64::max) - ROUNDING * tolerance_m)
}

/// Corners of a part of a triangle.
type SubTriangle<const AXES: usize> = [Point<AXES>; 3];

struct HausdorffSearch<'a, const AXES: usize> {
    points: &'a [Point<AXES>],
    triangles: &'a [[u32; 3]],
    tree: ProximityBvh,
}

fn position<const AXES: usize>(point: &Point<AXES>) -> DVec3 {
    DVec3::new(point[0], point[1], point[2])
}

impl<'a, const AXES: usize> HausdorffSearch<'a, AXES> {
    fn new(points: &'a [Point<AXES>], triangles: &'a [[u32; 3]], tolerance_m: f64) -> Self {
        let boxed = |triangle: &[u32; 3]| {
            let mut bounds = Aabb::EMPTY;
            triangle.iter().for_each(|&corner| bounds.include(position(&points[corner as usize])));
            Aabb { min: bounds.min - tolerance_m, max: bounds.max + tolerance_m }
        };
        Self { points, triangles, tree: ProximityBvh::new(&triangles.iter().map(boxed).collect::<Vec<_>>()) }
    }

    fn corners(&self, triangle: [u32; 3]) -> [&Point<AXES>; 3] {
        triangle.map(|corner| &self.points[corner as usize])
    }

    /// Upper bound of the largest distance of the triangles `of` from the others, at least `known_m`. A
    /// sample of the triangles is measured first to obtain a good lower bound. The partition into tasks does
    /// not depend on the number of threads.
    fn farthest_m(&self, of: &[[u32; 3]], known_m: f64) -> f64 {
        let some: Vec<[u32; 3]> = of.iter().step_by(SAMPLE_STRIDE).copied().collect();
        let known = self.farthest_of(&some, [known_m; 2]);
        of.par_chunks(TRIANGLES_A_TASK).map(|of| self.farthest_of(of, known)[1]).reduce(|| known[1], f64::max)
    }

    /// Lower and upper bound of the largest distance. The two are kept apart: with a single value, the
    /// accepted excess of each part would raise that of the next.
    fn farthest_of(&self, of: &[[u32; 3]], [mut least_m, mut most_m]: [f64; 2]) -> [f64; 2] {
        let mut waiting: Vec<(SubTriangle<AXES>, u32)> = Vec::new();
        for &triangle in of {
            waiting.push((self.corners(triangle).map(|corner| *corner), 0));
            let mut parts = 0;
            while let Some((corners, cuts)) = waiting.pop() {
                let upper_bound_m = self.upper_bound_m(&corners, most_m.max(CUT_RATIO * least_m));
                parts += 1;
                let is_cut_up = cuts == MAX_CUTS || parts >= MAX_PARTS;
                let is_settled = |least_m: f64| upper_bound_m <= most_m.max(CUT_RATIO * least_m) || is_cut_up;
                if !is_settled(least_m) {
                    least_m = least_m.max(self.lower_bound_m(&corners));
                }
                if is_settled(least_m) {
                    most_m = most_m.max(upper_bound_m);
                } else {
                    waiting.extend(self.cut(&corners).into_iter().map(|part| (part, cuts + 1)));
                }
            }
        }
        [least_m, most_m]
    }

    /// Cuts a part along the planes through the borders of the nearest triangle, or into quarters if these do
    /// not cut it or it is much larger.
    fn cut(&self, corners: &SubTriangle<AXES>) -> Vec<SubTriangle<AXES>> {
        let nearest = self.corners(self.triangles[self.nearest_to(&middle(corners)) as usize]);
        let quarters = quarters(corners).to_vec();
        let size2 = |[a, b, c]: [&Point<AXES>; 3]| {
            [(a, b), (b, c), (c, a)].into_iter().map(|(a, b)| point_distance2(a, b)).fold(0.0, f64::max)
        };
        if size2(corners.each_ref()) > QUARTER_RATIO * QUARTER_RATIO * size2(nearest) {
            return quarters;
        }
        let cut = cut_by_prism(corners, nearest);
        if cut.len() > 1 { cut } else { quarters }
    }

    fn nearest_to(&self, point: &Point<AXES>) -> u32 {
        let nearest = Cell::new((f64::INFINITY, 0));
        self.tree.nearest_item_m(
            |bounds| Some(bounds.distance_m(position(point))),
            |k| {
                let away_m = distance2(point, self.corners(self.triangles[k as usize])).sqrt();
                if away_m < nearest.get().0 {
                    nearest.set((away_m, k));
                }
                away_m
            },
        );
        nearest.get().1
    }

    /// Lower bound of the distance of a triangle's farthest point: that of its farthest corner.
    fn lower_bound_m(&self, corners: &SubTriangle<AXES>) -> f64 {
        let each = corners.each_ref().map(|corner| {
            let of_triangle = |k: u32| distance2(corner, self.corners(self.triangles[k as usize])).sqrt();
            self.tree.nearest_item_m(|bounds| Some(bounds.distance_m(position(corner))), of_triangle)
        });
        each.into_iter().fold(0.0, f64::max)
    }

    /// Upper bound of the distance of a triangle's farthest point: from the single triangle that is best for
    /// all its corners, or the first one within `enough_m`.
    fn upper_bound_m(&self, corners: &SubTriangle<AXES>, enough_m: f64) -> f64 {
        let middle = middle(corners);
        let least_m = Cell::new(f64::INFINITY);
        let all = |k: u32| {
            let other = self.corners(self.triangles[k as usize]);
            let away_m = corners.iter().map(|corner| distance2(corner, other)).fold(0.0, f64::max).sqrt();
            least_m.set(least_m.get().min(away_m));
            // A distance of 0 ends the search.
            if away_m <= enough_m { 0.0 } else { away_m }
        };
        // No triangle is nearer to the farthest corner than to the centre.
        self.tree.nearest_item_m(|bounds| Some(bounds.distance_m(position(&middle))), all);
        least_m.get()
    }
}

/// Cuts a triangle by the three planes through the sides of another one, perpendicular to it: the part above
/// or below it, and the rest, as triangles.
fn cut_by_prism<const AXES: usize>(
    corners: &SubTriangle<AXES>,
    [a, b, c]: [&Point<AXES>; 3],
) -> Vec<SubTriangle<AXES>> {
    let (e, f) = (minus(b, a), minus(c, a));
    let (ee, ef, ff) = (dot(&e, &e), dot(&e, &f), dot(&f, &f));
    let det = ee * ff - ef * ef;
    if det <= 1e-14 * ee * ff {
        return vec![*corners];
    }
    // Barycentric weights of the projection of a point. All three are positive above or below the triangle.
    let weights = |point: &Point<AXES>| {
        let v = minus(point, a);
        let (ev, fv) = (dot(&e, &v), dot(&f, &v));
        let (s, t) = ((ff * ev - ef * fv) / det, (ee * fv - ef * ev) / det);
        [1.0 - s - t, s, t]
    };
    let (mut across, mut outside) = (vec![*corners], Vec::new());
    for side in 0..3 {
        let mut next = Vec::new();
        for part in across {
            split(&part, part.each_ref().map(|corner| weights(corner)[side]), &mut next, &mut outside);
        }
        across = next;
    }
    outside.extend(across);
    outside
}

/// Cuts a triangle into the parts where a linear function is positive and where it is not. Slivers stay with
/// the larger part.
fn split<const AXES: usize>(
    part: &SubTriangle<AXES>,
    values: [f64; 3],
    above: &mut Vec<SubTriangle<AXES>>,
    below: &mut Vec<SubTriangle<AXES>>,
) {
    let [least, most] = [
        values.iter().copied().fold(f64::INFINITY, f64::min),
        values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    ];
    if least >= -SLIVER || most <= SLIVER || !(most - least).is_finite() {
        (if least >= -SLIVER { above } else { below }).push(*part);
        return;
    }
    // The corner that is alone on its side comes first.
    let first = (0..3)
        .find(|&k| {
            (values[k] > 0.0) != (values[(k + 1) % 3] > 0.0)
                && (values[k] > 0.0) != (values[(k + 2) % 3] > 0.0)
        })
        .unwrap_or(0);
    let [(a, p), (b, q), (c, r)] = [0, 1, 2].map(|k| (first + k) % 3).map(|k| (part[k], values[k]));
    let on = |end: &Point<AXES>, value: f64| -> Point<AXES> {
        std::array::from_fn(|k| a[k] + (end[k] - a[k]) * (p / (p - value)))
    };
    let (ab, ac) = (on(&b, q), on(&c, r));
    let (alone, others) = if p > 0.0 { (above, below) } else { (below, above) };
    alone.push([a, ab, ac]);
    others.extend([[ab, b, c], [ab, c, ac]]);
}

fn point_distance2<const AXES: usize>(a: &Point<AXES>, b: &Point<AXES>) -> f64 {
    let apart = minus(a, b);
    dot(&apart, &apart)
}

fn quarters<const AXES: usize>([a, b, c]: &SubTriangle<AXES>) -> [SubTriangle<AXES>; 4] {
    let (ab, bc, ca) = (between(a, b), between(b, c), between(c, a));
    [[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::mesh_lod::attribute_space::UNLIT;

    fn point(x: f64, y: f64, z: f64) -> Point<UNLIT> {
        [x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    #[test]
    fn distance_of_different_sheets() {
        // A square of two triangles, and the same square of four with its centre raised.
        for height in [0.0, 0.3] {
            let points = [
                point(0.0, 0.0, 0.0),
                point(4.0, 0.0, 0.0),
                point(4.0, 4.0, 0.0),
                point(0.0, 4.0, 0.0),
                point(2.0, 2.0, height),
            ];
            let flat = [[0, 1, 2], [0, 2, 3]];
            let tent = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
            let bound_m = hausdorff_bound_m(&points, &flat, &tent, 1e-6);
            // The centre is below the apex by its height, and nearest to a slope.
            assert!((height..=1.11 * height + 0.1).contains(&bound_m), "{height}: {bound_m}");
            assert_eq!(bound_m, hausdorff_bound_m(&points, &flat, &tent, 1e-6));
        }
        let (near, far) = (point(0.0, 0.0, 0.0), point(9.0, 0.0, 0.0));
        let points = [near, point(1.0, 0.0, 0.0), point(0.0, 1.0, 0.0), far];
        // A spike that only one of the two has, in either order.
        for (a, b) in [([[0, 1, 2]], [[0, 3, 2]]), ([[0, 3, 2]], [[0, 1, 2]])] {
            let bound_m = hausdorff_bound_m(&points, &a, &b, 1e-6);
            assert!((8.0..=8.0 * CUT_RATIO).contains(&bound_m), "{bound_m}");
        }
        assert_eq!(hausdorff_bound_m(&points, &[], &[[0, 1, 2]], 1e-6), f64::INFINITY);
    }

    #[test]
    fn retriangulated_sheets_have_distance_zero() {
        // A square with a fold, triangulated on a grid and by one diagonal per half.
        let points: Vec<Point<UNLIT>> = (0..49)
            .map(|k| (f64::from(k % 7), f64::from(k / 7)))
            .map(|(x, y)| point(x, y, (x - 3.0).abs()))
            .collect();
        let cell = |k: u32| [[k, k + 1, k + 8], [k, k + 8, k + 7]];
        let fine: Vec<[u32; 3]> = (0..42).filter(|k| k % 7 < 6).flat_map(cell).collect();
        let coarse = [[0, 3, 45], [0, 45, 42], [3, 6, 48], [3, 48, 45]];
        let bound_m = hausdorff_bound_m(&points, &fine, &coarse, 1e-6);
        assert!(bound_m <= 1e-6, "{bound_m}");
        let bent = hausdorff_bound_m(&points, &fine, &[[0, 6, 48], [0, 48, 42]], 1e-6);
        assert!((2.9..3.3).contains(&bent), "{bent}");
    }

    #[test]
    fn different_colours_are_distant() {
        let points: Vec<Point<UNLIT>> = [0.0, 5.0]
            .into_iter()
            .flat_map(|tint| {
                [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| [x, y, 0.0, 0.0, 0.0, tint, 0.0, 0.0, 0.0])
            })
            .collect();
        let bound_m = hausdorff_bound_m(&points, &[[0, 1, 2]], &[[3, 4, 5]], 1e-6);
        assert!((bound_m - 5.0).abs() < 1e-9, "{bound_m}");
    }
}
