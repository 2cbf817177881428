//! How far two sets of triangles are from each other at most, both ways (Hausdorff distance), as an upper bound.
//!
//! A triangle all three corners of which are within a distance of *one* other triangle is so everywhere, as that one is convex. Where no one
//! triangle will do it is cut in four, and each part asks again.

use glam::DVec3;

use super::space::{Point, between, distance2};
use crate::scene::{Aabb, box_tree::BoxTree};

/// Times that a triangle is cut, at most: what is left then counts by what is known of it.
const MOST_CUTS: u32 = 6;
/// Nothing is cut for less than this part of what is known to be the distance.
const WORTH: f64 = 1.1;

/// Upper bound of the distance of either from the other; infinite if one of them is empty.
pub(super) fn apart_m<const AXES: usize>(points: &[Point<AXES>], one: &[[u32; 3]], other: &[[u32; 3]], hair_m: f64) -> f64 {
    if one.is_empty() || other.is_empty() {
        return f64::INFINITY;
    }
    let one_way = Search::new(points, other, hair_m).farthest_m(one, hair_m);
    Search::new(points, one, hair_m).farthest_m(other, one_way)
}

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

    /// Bound of the distance of the farthest point of `of`, and not less than `known_m`.
    fn farthest_m(&self, of: &[[u32; 3]], known_m: f64) -> f64 {
        // What is known to be there, and what nothing exceeds: were the two one number, each part would raise what the next one is allowed.
        let (mut least_m, mut most_m) = (known_m, known_m);
        let mut waiting: Vec<([Point<AXES>; 3], u32)> = Vec::new();
        for &triangle in of {
            waiting.push((self.corners(triangle).map(|corner| *corner), 0));
            while let Some((corners, cuts)) = waiting.pop() {
                let at_most_m = self.at_most_m(&corners);
                let is_settled = |least_m: f64| at_most_m <= most_m.max(WORTH * least_m) || cuts == MOST_CUTS;
                if !is_settled(least_m) {
                    least_m = least_m.max(self.at_least_m(&corners));
                }
                if is_settled(least_m) {
                    most_m = most_m.max(at_most_m);
                } else {
                    waiting.extend(quarters(&corners).map(|part| (part, cuts + 1)));
                }
            }
        }
        most_m
    }

    /// What the farthest point of a triangle is away, at least: its farthest corner.
    fn at_least_m(&self, corners: &[Point<AXES>; 3]) -> f64 {
        let each = corners.each_ref().map(|corner| {
            let of_triangle = |k: u32| distance2(corner, self.corners(self.triangles[k as usize])).sqrt();
            self.tree.nearest_thing_m(|bounds| Some(bounds.distance_m(place(corner))), of_triangle)
        });
        each.into_iter().fold(0.0, f64::max)
    }

    /// The same at most: by the one triangle that suits all its corners best.
    fn at_most_m(&self, corners: &[Point<AXES>; 3]) -> f64 {
        let middle: Point<AXES> = std::array::from_fn(|k| (corners[0][k] + corners[1][k] + corners[2][k]) / 3.0);
        let all = |k: u32| {
            let other = self.corners(self.triangles[k as usize]);
            corners.iter().map(|corner| distance2(corner, other)).fold(0.0, f64::max).sqrt()
        };
        // No triangle is nearer to the farthest corner than to the middle.
        self.tree.nearest_thing_m(|bounds| Some(bounds.distance_m(place(&middle))), all)
    }
}

fn quarters<const AXES: usize>([a, b, c]: &[Point<AXES>; 3]) -> [[Point<AXES>; 3]; 4] {
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
            let points = [point(0.0, 0.0, 0.0), point(4.0, 0.0, 0.0), point(4.0, 4.0, 0.0), point(0.0, 4.0, 0.0), point(2.0, 2.0, height)];
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
    fn other_colours_are_far() {
        let points: Vec<Point<UNLIT>> = [0.0, 5.0]
            .into_iter()
            .flat_map(|tint| [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| [x, y, 0.0, 0.0, 0.0, tint, 0.0, 0.0, 0.0]))
            .collect();
        let found = apart_m(&points, &[[0, 1, 2]], &[[3, 4, 5]], 1e-6);
        assert!((found - 5.0).abs() < 1e-9, "{found}");
    }
}
