//! How far two sets of triangles are from each other at most, both ways (Hausdorff distance), as an upper
//! bound.
//!
//! A triangle all three corners of which are within a distance of *one* other triangle is so everywhere, as
//! that one is convex. Where no one triangle will do it is cut along the borders of the nearest one, or in
//! four, and each part asks again.

use std::cell::Cell;

use glam::DVec3;
use rayon::prelude::*;

use super::space::{Point, between, distance2, dot, middle, minus};
use crate::scene::{Aabb, box_tree::BoxTree};

/// Times that a triangle is cut, and parts of it that are looked at, at most: what is left then counts by
/// what is known of it.
const MOST_CUTS: u32 = 16;
const MOST_PARTS: u32 = 6000;
/// Triangles that are looked at together, and of how many one is looked at before.
const TRIANGLES_A_TASK: usize = 1024;
const ONE_OF: usize = 64;
/// What is as many times as long as the nearest triangle is cut in four.
const LARGER: f64 = 4.0;
/// Part of a triangle's height that is not worth a cut.
const HAIR: f64 = 1e-9;
/// Nothing is cut for less than this part of what is known to be the distance.
const WORTH: f64 = 1.1;

/// Upper bound of the distance of either from the other; infinite if one of them is empty.
pub(super) fn apart_m<const AXES: usize>(
    points: &[Point<AXES>],
    one: &[[u32; 3]],
    other: &[[u32; 3]],
    hair_m: f64,
) -> f64 {
    if one.is_empty() || other.is_empty() {
        return f64::INFINITY;
    }
    let one_way = Search::new(points, other, hair_m).farthest_m(one, hair_m);
    Search::new(points, one, hair_m).farthest_m(other, one_way)
}

/// A triangle of its own.
type Part<const AXES: usize> = [Point<AXES>; 3];

struct Search<'a, const AXES: usize> {
    points: &'a [Point<AXES>],
    triangles: &'a [[u32; 3]],
    tree: BoxTree,
}

fn place<const AXES: usize>(point: &Point<AXES>) -> DVec3 {
    DVec3::new(point[0], point[1], point[2])
}

impl<'a, const AXES: usize> Search<'a, AXES> {
    fn new(points: &'a [Point<AXES>], triangles: &'a [[u32; 3]], hair_m: f64) -> Self {
        let boxed = |triangle: &[u32; 3]| {
            let mut bounds = Aabb::EMPTY;
            triangle.iter().for_each(|&corner| bounds.include(place(&points[corner as usize])));
            Aabb { min: bounds.min - hair_m, max: bounds.max + hair_m }
        };
        Self { points, triangles, tree: BoxTree::new(&triangles.iter().map(boxed).collect::<Vec<_>>()) }
    }

    fn corners(&self, triangle: [u32; 3]) -> [&Point<AXES>; 3] {
        triangle.map(|corner| &self.points[corner as usize])
    }

    /// Bound of the distance of the farthest point of `of`, and not less than `known_m`. Some of the
    /// triangles tell about how far that is before all are looked at, in parts that do not depend on how many
    /// threads there are.
    fn farthest_m(&self, of: &[[u32; 3]], known_m: f64) -> f64 {
        let some: Vec<[u32; 3]> = of.iter().step_by(ONE_OF).copied().collect();
        let known = self.farthest_of(&some, [known_m; 2]);
        of.par_chunks(TRIANGLES_A_TASK).map(|of| self.farthest_of(of, known)[1]).reduce(|| known[1], f64::max)
    }

    /// What is known to be there, and what nothing exceeds: were the two one number, each part would raise
    /// what the next one is allowed.
    fn farthest_of(&self, of: &[[u32; 3]], [mut least_m, mut most_m]: [f64; 2]) -> [f64; 2] {
        let mut waiting: Vec<(Part<AXES>, u32)> = Vec::new();
        for &triangle in of {
            waiting.push((self.corners(triangle).map(|corner| *corner), 0));
            let mut parts = 0;
            while let Some((corners, cuts)) = waiting.pop() {
                let at_most_m = self.at_most_m(&corners, most_m.max(WORTH * least_m));
                parts += 1;
                let is_cut_up = cuts == MOST_CUTS || parts >= MOST_PARTS;
                let is_settled = |least_m: f64| at_most_m <= most_m.max(WORTH * least_m) || is_cut_up;
                if !is_settled(least_m) {
                    least_m = least_m.max(self.at_least_m(&corners));
                }
                if is_settled(least_m) {
                    most_m = most_m.max(at_most_m);
                } else {
                    waiting.extend(self.cut(&corners).into_iter().map(|part| (part, cuts + 1)));
                }
            }
        }
        [least_m, most_m]
    }

    /// Along the borders of what is above or below the nearest triangle, or, where these do not cut it or it
    /// is much larger, into quarters.
    fn cut(&self, corners: &Part<AXES>) -> Vec<Part<AXES>> {
        let nearest = self.corners(self.triangles[self.nearest_to(&middle(corners)) as usize]);
        let quarters = quarters(corners).to_vec();
        let size2 = |[a, b, c]: [&Point<AXES>; 3]| {
            [(a, b), (b, c), (c, a)].into_iter().map(|(a, b)| apart2(a, b)).fold(0.0, f64::max)
        };
        if size2(corners.each_ref()) > LARGER * LARGER * size2(nearest) {
            return quarters;
        }
        let cut = along(corners, nearest);
        if cut.len() > 1 { cut } else { quarters }
    }

    fn nearest_to(&self, point: &Point<AXES>) -> u32 {
        let nearest = Cell::new((f64::INFINITY, 0));
        self.tree.nearest_thing_m(
            |bounds| Some(bounds.distance_m(place(point))),
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

    /// What the farthest point of a triangle is away, at least: its farthest corner.
    fn at_least_m(&self, corners: &Part<AXES>) -> f64 {
        let each = corners.each_ref().map(|corner| {
            let of_triangle = |k: u32| distance2(corner, self.corners(self.triangles[k as usize])).sqrt();
            self.tree.nearest_thing_m(|bounds| Some(bounds.distance_m(place(corner))), of_triangle)
        });
        each.into_iter().fold(0.0, f64::max)
    }

    /// The same at most: by the one triangle that suits all its corners best, or by the first one that does
    /// well enough.
    fn at_most_m(&self, corners: &Part<AXES>, enough_m: f64) -> f64 {
        let middle = middle(corners);
        let found = Cell::new(f64::INFINITY);
        let all = |k: u32| {
            let other = self.corners(self.triangles[k as usize]);
            let away_m = corners.iter().map(|corner| distance2(corner, other)).fold(0.0, f64::max).sqrt();
            found.set(found.get().min(away_m));
            // Nothing is nearer than nothing: the search ends.
            if away_m <= enough_m { 0.0 } else { away_m }
        };
        // No triangle is nearer to the farthest corner than to the middle.
        self.tree.nearest_thing_m(|bounds| Some(bounds.distance_m(place(&middle))), all);
        found.get()
    }
}

/// A triangle cut by the three planes that stand on another one's sides: what lies across it, and what does
/// not, in triangles.
fn along<const AXES: usize>(corners: &Part<AXES>, [a, b, c]: [&Point<AXES>; 3]) -> Vec<Part<AXES>> {
    let (e, f) = (minus(b, a), minus(c, a));
    let (ee, ef, ff) = (dot(&e, &e), dot(&e, &f), dot(&f, &f));
    let det = ee * ff - ef * ef;
    if det <= 1e-14 * ee * ff {
        return vec![*corners];
    }
    // How much of each of its corners what is nearest to a point is made of: all three are positive across
    // it.
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
            halve(&part, part.each_ref().map(|corner| weights(corner)[side]), &mut next, &mut outside);
        }
        across = next;
    }
    outside.extend(across);
    outside
}

/// A triangle to where a value, linear on it, is positive, and to where it is not. Hairs stay with the rest.
fn halve<const AXES: usize>(
    part: &Part<AXES>,
    values: [f64; 3],
    above: &mut Vec<Part<AXES>>,
    below: &mut Vec<Part<AXES>>,
) {
    let [least, most] = [
        values.iter().copied().fold(f64::INFINITY, f64::min),
        values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
    ];
    if least >= -HAIR || most <= HAIR || !(most - least).is_finite() {
        (if least >= -HAIR { above } else { below }).push(*part);
        return;
    }
    // The corner that is alone on its side, first.
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

fn apart2<const AXES: usize>(a: &Point<AXES>, b: &Point<AXES>) -> f64 {
    let apart = minus(a, b);
    dot(&apart, &apart)
}

fn quarters<const AXES: usize>([a, b, c]: &Part<AXES>) -> [Part<AXES>; 4] {
    let (ab, bc, ca) = (between(a, b), between(b, c), between(c, a));
    [[*a, ab, ca], [ab, *b, bc], [ca, bc, *c], [ab, bc, ca]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::levels::space::UNLIT;

    fn point(x: f64, y: f64, z: f64) -> Point<UNLIT> {
        [x, y, z, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    }

    #[test]
    fn sheets_of_other_triangles_are_as_far_as_they_stand() {
        // A square in two triangles, and the same in four with its middle raised.
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
            let found = apart_m(&points, &flat, &tent, 1e-6);
            // The middle is below the tent's top by its height, and nearest to a slope.
            assert!((height..=1.11 * height + 0.1).contains(&found), "{height}: {found}");
            assert_eq!(found, apart_m(&points, &flat, &tent, 1e-6));
        }
        let (near, far) = (point(0.0, 0.0, 0.0), point(9.0, 0.0, 0.0));
        let points = [near, point(1.0, 0.0, 0.0), point(0.0, 1.0, 0.0), far];
        // A spike that the other has not, whichever comes first.
        for (a, b) in [([[0, 1, 2]], [[0, 3, 2]]), ([[0, 3, 2]], [[0, 1, 2]])] {
            let found = apart_m(&points, &a, &b, 1e-6);
            assert!((8.0..=8.0 * WORTH).contains(&found), "{found}");
        }
        assert_eq!(apart_m(&points, &[], &[[0, 1, 2]], 1e-6), f64::INFINITY);
    }

    #[test]
    fn the_same_sheet_in_other_triangles_is_nowhere_else() {
        // A square with a bend, along a grid and by one diagonal in each half.
        let points: Vec<Point<UNLIT>> = (0..49)
            .map(|k| (f64::from(k % 7), f64::from(k / 7)))
            .map(|(x, y)| point(x, y, (x - 3.0).abs()))
            .collect();
        let cell = |k: u32| [[k, k + 1, k + 8], [k, k + 8, k + 7]];
        let fine: Vec<[u32; 3]> = (0..42).filter(|k| k % 7 < 6).flat_map(cell).collect();
        let coarse = [[0, 3, 45], [0, 45, 42], [3, 6, 48], [3, 48, 45]];
        let found = apart_m(&points, &fine, &coarse, 1e-6);
        assert!(found <= 1e-6, "{found}");
        let bent = apart_m(&points, &fine, &[[0, 6, 48], [0, 48, 42]], 1e-6);
        assert!((2.9..3.3).contains(&bent), "{bent}");
    }

    #[test]
    fn other_colours_are_far() {
        let points: Vec<Point<UNLIT>> = [0.0, 5.0]
            .into_iter()
            .flat_map(|tint| {
                [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| [x, y, 0.0, 0.0, 0.0, tint, 0.0, 0.0, 0.0])
            })
            .collect();
        let found = apart_m(&points, &[[0, 1, 2]], &[[3, 4, 5]], 1e-6);
        assert!((found - 5.0).abs() < 1e-9, "{found}");
    }
}
