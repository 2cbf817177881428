//! Mesh simplification by half-edge collapses, the cheapest first.
//!
//! The cost of a collapse is the largest distance of all vertices removed so far from the triangles that
//! replace them, and of those on the border from the border. (Otherwise a corner of a window's opening could
//! be moved across it at no cost, because the wall would cover it.) The cost only determines the order: the
//! error of a level is measured afterwards (`hausdorff.rs`).

use std::{
    cmp::Ordering,
    collections::{BinaryHeap, HashMap},
};

use glam::DVec3;

use super::attribute_space::{AttributeSpace, Point, between, distance2, from_segment2, middle};
use crate::scene::{MeshVertex, Shape};

/// Most removed vertices that a triangle keeps for the cost: those farthest from it.
const MAX_REMOVED: usize = 12;
/// Least cosine between a triangle's normals before and after a collapse.
const MIN_COSINE: f64 = 0.2;

/// A shape during simplification.
pub(super) struct Simplifier<const AXES: usize> {
    /// Points by vertex of the shape.
    pub points: Vec<Point<AXES>>,
    /// Three vertices per triangle; the first of several equal vertices represents them all.
    pub triangles: Vec<[u32; 3]>,
    alive: Vec<bool>,
    count: usize,
    /// Position index of each vertex. Vertices at one position belong together; there are several where
    /// attributes jump.
    position_of: Vec<u32>,
    /// Whether a position is on the border of the full surface, where an edge belongs to a single triangle.
    at_border: Vec<bool>,
    /// Triangles around each position, including removed ones.
    triangles_of: Vec<Vec<u32>>,
    /// Removed vertices, by the triangle that replaces them.
    removed: Vec<Vec<u32>>,
    /// Number of changes around a position.
    changes: Vec<u32>,
    queue: BinaryHeap<Candidate>,
    /// For each position the change count at its last evaluation, and its cost in the queue, infinite if it
    /// is not queued.
    queued: Vec<(u32, f64)>,
}

/// Collapse of one position into another.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Candidate {
    cost2: f64,
    from: u32,
    to: u32,
    changes: u32,
}

impl Eq for Candidate {}

impl PartialOrd for Candidate {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Candidate {
    /// The cheapest collapse is the greatest; of equal ones the first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost2.total_cmp(&self.cost2).then_with(|| (other.from, other.to).cmp(&(self.from, self.to)))
    }
}

/// Effect of a collapse.
struct Collapse {
    /// The triangles that remain, with their new vertices.
    remaining_triangles: Vec<(u32, [u32; 3])>,
    cost2: f64,
}

impl<const AXES: usize> Simplifier<AXES> {
    pub fn new(shape: &Shape) -> Self {
        let points = AttributeSpace::new(shape).points(shape);
        let first = shape.canonical_vertices();
        let mut first_at = HashMap::new();
        let position = |vertex: &MeshVertex| vertex.position_m.map(|part| (part + 0.0).to_bits());
        let position_of: Vec<u32> = (0..)
            .zip(&shape.vertices)
            .map(|(i, vertex)| *first_at.entry(position(vertex)).or_insert(i))
            .collect();
        let triangles: Vec<[u32; 3]> = shape
            .indices
            .chunks_exact(3)
            .map(|of| [0, 1, 2].map(|k| first[of[k] as usize]))
            .filter(|of| distinct(of.map(|v| position_of[v as usize])))
            .collect();
        let mut triangles_of = vec![Vec::new(); points.len()];
        for (i, of) in (0..).zip(&triangles) {
            of.iter().for_each(|&vertex| triangles_of[position_of[vertex as usize] as usize].push(i));
        }
        let count = triangles.len();
        Self {
            alive: vec![true; count],
            removed: vec![Vec::new(); count],
            changes: vec![0; points.len()],
            queue: BinaryHeap::new(),
            queued: vec![(u32::MAX, f64::INFINITY); points.len()],
            points,
            triangles,
            count,
            at_border: Vec::new(),
            position_of,
            triangles_of,
        }
    }

    /// Queues the first collapses.
    pub fn begin(&mut self) {
        let positions = 0..self.points.len() as u32;
        self.at_border = positions.clone().map(|position| !self.along_border(position).is_empty()).collect();
        positions.for_each(|position| self.enqueue(position));
    }

    /// The remaining triangles.
    pub fn remaining(&self) -> Vec<[u32; 3]> {
        self.triangles
            .iter()
            .zip(&self.alive)
            .filter(|(_, alive)| **alive)
            .map(|(triangle, _)| *triangle)
            .collect()
    }

    pub fn count(&self) -> usize {
        self.count
    }

    /// Performs all collapses with a cost of up to `most_m`.
    pub fn collapse_within(&mut self, most_m: f64) {
        while let Some(&next) = self.queue.peek() {
            if next.cost2 > most_m * most_m {
                return;
            }
            self.queue.pop();
            if self.changes[next.from as usize] != next.changes {
                self.enqueue(next.from);
            } else if let Some(collapse) = self.collapse(next.from, next.to, f64::INFINITY) {
                self.apply(next.from, next.to, collapse, most_m * most_m);
            } else {
                self.queued[next.from as usize].1 = f64::INFINITY;
            }
        }
    }

    fn position(&self, vertex: u32) -> u32 {
        self.position_of[vertex as usize]
    }

    fn star(&self, position: u32) -> impl Iterator<Item = u32> {
        self.triangles_of[position as usize].iter().copied().filter(|&triangle| self.alive[triangle as usize])
    }

    fn neighbours(&self, position: u32) -> Vec<u32> {
        let corners = self.star(position).flat_map(|triangle| self.triangles[triangle as usize]);
        let mut neighbours: Vec<u32> =
            corners.map(|vertex| self.position(vertex)).filter(|&other| other != position).collect();
        neighbours.sort_unstable();
        neighbours.dedup();
        neighbours
    }

    /// Whether an edge belongs to a single triangle.
    fn is_border(&self, a: u32, b: u32) -> bool {
        let has_b = |triangle: u32| {
            self.triangles[triangle as usize].iter().any(|&vertex| self.position(vertex) == b)
        };
        self.star(a).filter(|&triangle| has_b(triangle)).count() == 1
    }

    /// Neighbours of a position along the border; none inside the surface.
    fn along_border(&self, position: u32) -> Vec<u32> {
        self.neighbours(position).into_iter().filter(|&other| self.is_border(position, other)).collect()
    }

    /// Queues the cheapest collapse of a position.
    fn enqueue(&mut self, from: u32) {
        let changes = self.changes[from as usize];
        if self.queued[from as usize].0 == changes {
            return;
        }
        let mut best: Option<Candidate> = None;
        for to in self.neighbours(from) {
            let less2 = best.map_or(f64::INFINITY, |best| best.cost2);
            let candidate = self.collapse(from, to, less2).map(|Collapse { cost2, .. }| Candidate {
                cost2,
                from,
                to,
                changes,
            });
            best = best.max(candidate);
        }
        self.queued[from as usize] = (changes, best.map_or(f64::INFINITY, |best| best.cost2));
        self.queue.extend(best);
    }

    /// `None` if the collapse would tear, remove or fold the surface, or costs more than `most2`.
    fn collapse(&self, from: u32, to: u32, most2: f64) -> Option<Collapse> {
        let along_border = self.along_border(from);
        if !(along_border.is_empty() || along_border.len() == 2 && along_border.contains(&to)) {
            return None;
        }
        let becomes = self.partners(from, to)?;
        let (mut remaining_triangles, mut border) = (Vec::new(), Vec::new());
        let mut points: Vec<u32> = becomes.iter().map(|pair| pair.0).collect();
        for triangle in self.star(from) {
            points.extend(&self.removed[triangle as usize]);
            let before = self.triangles[triangle as usize];
            if before.iter().any(|&vertex| self.position(vertex) == to) {
                continue;
            }
            let after = before
                .map(|vertex| becomes.iter().find(|pair| pair.0 == vertex).map_or(vertex, |pair| pair.1));
            if self.folds(before, after) {
                return None;
            }
            remaining_triangles.push((triangle, after));
            let edges = [(0, 1), (1, 2), (2, 0)].into_iter();
            border.extend(
                edges
                    .filter(|&(i, k)| self.is_border(self.position(before[i]), self.position(before[k])))
                    .map(|(i, k)| [after[i], after[k]]),
            );
        }
        if remaining_triangles.is_empty() {
            return None;
        }
        let from_kept2 = |&point: &u32| {
            let to_triangle2 = |(_, corners): &(u32, [u32; 3])| {
                distance2(&self.points[point as usize], corners.each_ref().map(|&v| &self.points[v as usize]))
            };
            remaining_triangles.iter().map(to_triangle2).fold(f64::INFINITY, f64::min)
        };
        let from_border2 = |&point: &u32| {
            let to_edge2 = |edge: &[u32; 2]| {
                from_segment2(
                    &self.points[point as usize],
                    &self.points[edge[0] as usize],
                    &self.points[edge[1] as usize],
                )
            };
            border.iter().map(to_edge2).fold(f64::INFINITY, f64::min)
        };
        let mut cost2 = self.hollow_cost2(from, &remaining_triangles);
        for point in &points {
            if !(cost2 <= most2 && cost2.is_finite()) {
                return None;
            }
            let is_at_border = self.at_border[self.position(*point) as usize];
            cost2 = cost2.max(if is_at_border { from_border2(point) } else { from_kept2(point) });
        }
        if !(cost2 <= most2 && cost2.is_finite()) {
            return None;
        }
        Some(Collapse { remaining_triangles, cost2 })
    }

    /// Squared distance of the removed triangles' centres from the triangles that replace them. Without it,
    /// filling a hollow would cost nothing.
    fn hollow_cost2(&self, from: u32, remaining_triangles: &[(u32, [u32; 3])]) -> f64 {
        let points = |corners: [u32; 3]| corners.map(|vertex| &self.points[vertex as usize]);
        let from_star2 = |point: &Point<AXES>| {
            self.star(from)
                .map(|t| distance2(point, points(self.triangles[t as usize])))
                .fold(f64::INFINITY, f64::min)
        };
        let to_kept2 = |(before, after): &(u32, [u32; 3])| {
            let [a, b, c] = points(*after);
            let turned =
                (0..3).find(|&k| self.position(self.triangles[*before as usize][k]) == from).unwrap_or(0);
            let [first, next] =
                [after[turned], after[(turned + 1) % 3]].map(|vertex| &self.points[vertex as usize]);
            from_star2(&middle(&[*a, *b, *c])).max(from_star2(&between(first, next)))
        };
        remaining_triangles.iter().map(to_kept2).fold(0.0, f64::max)
    }

    /// New vertex of each vertex at a position: the one at the other position in a common triangle. `None` if
    /// there is none, or more than one.
    fn partners(&self, from: u32, to: u32) -> Option<Vec<(u32, u32)>> {
        let mut becomes: Vec<(u32, Option<u32>)> = Vec::new();
        for triangle in self.star(from) {
            let corners = self.triangles[triangle as usize];
            let corner_at =
                |position: u32| corners.into_iter().find(|&vertex| self.position(vertex) == position);
            let (Some(own), partner) = (corner_at(from), corner_at(to)) else { continue };
            match becomes.iter_mut().find(|pair| pair.0 == own) {
                None => becomes.push((own, partner)),
                Some(pair) => match (pair.1, partner) {
                    (Some(a), Some(b)) if a != b => return None,
                    (None, Some(_)) => pair.1 = partner,
                    _ => {}
                },
            }
        }
        becomes.into_iter().map(|(own, partner)| partner.map(|partner| (own, partner))).collect()
    }

    fn folds(&self, before: [u32; 3], after: [u32; 3]) -> bool {
        let normal = |of: [u32; 3]| {
            let [a, b, c] = of.map(|vertex| {
                let point = &self.points[vertex as usize];
                DVec3::new(point[0], point[1], point[2])
            });
            (b - a).cross(c - a)
        };
        let (was, is) = (normal(before), normal(after));
        was.dot(is) <= MIN_COSINE * was.length() * is.length()
    }

    fn apply(&mut self, from: u32, to: u32, collapse: Collapse, most2: f64) {
        let star: Vec<u32> = self.star(from).collect();
        let mut points: Vec<u32> =
            star.iter().flat_map(|&triangle| std::mem::take(&mut self.removed[triangle as usize])).collect();
        points.extend(
            star.iter()
                .flat_map(|&t| self.triangles[t as usize])
                .filter(|&vertex| self.position(vertex) == from),
        );
        points.sort_unstable();
        points.dedup();
        let changed = self.neighbours(from);
        for &triangle in &star {
            self.alive[triangle as usize] = false;
        }
        for &(triangle, corners) in &collapse.remaining_triangles {
            self.alive[triangle as usize] = true;
            self.triangles[triangle as usize] = corners;
            self.triangles_of[to as usize].push(triangle);
        }
        self.count -= star.len() - collapse.remaining_triangles.len();
        self.triangles_of[from as usize].clear();
        self.changes[from as usize] += 1;
        self.assign_removed(&points, &collapse.remaining_triangles);
        for position in changed {
            self.changes[position as usize] += 1;
            // Queued collapses that are cheap enough are evaluated again when they are popped.
            if self.queued[position as usize].1 > most2 {
                self.enqueue(position);
            }
        }
    }

    /// Assigns each removed vertex to its nearest triangle.
    fn assign_removed(&mut self, points: &[u32], remaining_triangles: &[(u32, [u32; 3])]) {
        let mut points_of: HashMap<u32, Vec<(f64, u32)>> = HashMap::new();
        for &point in points {
            let away2 = |corners: &[u32; 3]| {
                distance2(&self.points[point as usize], corners.each_ref().map(|&v| &self.points[v as usize]))
            };
            let nearest = remaining_triangles
                .iter()
                .map(|(triangle, corners)| (away2(corners), *triangle))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((away2, triangle)) = nearest {
                points_of.entry(triangle).or_default().push((away2, point));
            }
        }
        for (triangle, mut removed) in points_of {
            removed.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            removed.truncate(MAX_REMOVED);
            self.removed[triangle as usize] = removed.into_iter().map(|(_, point)| point).collect();
        }
    }
}

fn distinct([a, b, c]: [u32; 3]) -> bool {
    a != b && b != c && a != c
}
