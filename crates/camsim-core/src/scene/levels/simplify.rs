//! Fewer triangles for the same surface: corners are drawn into neighbours, the cheapest first.
//!
//! What a collapse costs is how far all corners that have gone by then are from the triangles that take their
//! place, those of the surface's border from the border: a corner of a window's opening that were drawn
//! across it would be covered, and cost nothing. That steers the order alone: how far a level is from the
//! full shape is measured afterwards (`measure.rs`).

use std::{
    cmp::Ordering,
    collections::{BinaryHeap, HashMap},
};

use glam::DVec3;

use super::space::{Point, Space, between, distance2, from_segment2, middle};
use crate::scene::{MeshVertex, Shape};

/// Corners that have gone and are remembered by a triangle, at most: those that are farthest from it.
const MOST_GONE: usize = 12;
/// A triangle may turn by a collapse so far that this is left of the cosine.
const LEAST_COSINE: f64 = 0.2;

/// A shape whose triangles become fewer.
pub(super) struct Simplifier<const AXES: usize> {
    /// By vertex of the shape.
    pub points: Vec<Point<AXES>>,
    /// Three vertices each; of vertices that are equal the first stands for all.
    pub triangles: Vec<[u32; 3]>,
    alive: Vec<bool>,
    count: usize,
    /// Vertices at one place belong together: where attributes jump there are several.
    place_of: Vec<u32>,
    /// Whether a place is at the full surface's border: where an edge is of one triangle alone.
    at_border: Vec<bool>,
    /// Triangles around each place, some of them gone.
    around: Vec<Vec<u32>>,
    /// Corners that have gone, by the triangle that took their place.
    gone: Vec<Vec<u32>>,
    /// Counts the changes around a place.
    changes: Vec<u32>,
    queue: BinaryHeap<Candidate>,
    /// After how many changes each place was last looked at, and the cost that it is in the queue for;
    /// infinite if it is not.
    offered: Vec<(u32, f64)>,
}

/// A place to be drawn into another one.
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
    /// The cheapest is the greatest; of equals the first.
    fn cmp(&self, other: &Self) -> Ordering {
        other.cost2.total_cmp(&self.cost2).then_with(|| (other.from, other.to).cmp(&(self.from, self.to)))
    }
}

/// What a collapse would do.
struct Collapse {
    /// Triangles that stay, as they would be.
    kept: Vec<(u32, [u32; 3])>,
    cost2: f64,
}

impl<const AXES: usize> Simplifier<AXES> {
    pub fn new(shape: &Shape) -> Self {
        let points = Space::of(shape).points(shape);
        let first = shape.first_equals();
        let mut places = HashMap::new();
        let place = |vertex: &MeshVertex| vertex.position_m.map(|part| (part + 0.0).to_bits());
        let place_of: Vec<u32> =
            (0..).zip(&shape.vertices).map(|(i, vertex)| *places.entry(place(vertex)).or_insert(i)).collect();
        let triangles: Vec<[u32; 3]> = shape
            .indices
            .chunks_exact(3)
            .map(|of| [0, 1, 2].map(|k| first[of[k] as usize]))
            .filter(|of| distinct(of.map(|v| place_of[v as usize])))
            .collect();
        let mut around = vec![Vec::new(); points.len()];
        for (i, of) in (0..).zip(&triangles) {
            of.iter().for_each(|&vertex| around[place_of[vertex as usize] as usize].push(i));
        }
        let count = triangles.len();
        let mut simplifier = Self {
            alive: vec![true; count],
            gone: vec![Vec::new(); count],
            changes: vec![0; points.len()],
            queue: BinaryHeap::new(),
            offered: vec![(u32::MAX, f64::INFINITY); points.len()],
            points,
            triangles,
            count,
            at_border: Vec::new(),
            place_of,
            around,
        };
        simplifier.at_border = (0..simplifier.around.len() as u32)
            .map(|place| !simplifier.along_border(place).is_empty())
            .collect();
        (0..simplifier.around.len() as u32).for_each(|place| simplifier.offer(place));
        simplifier
    }

    /// The triangles that are left.
    pub fn left(&self) -> Vec<[u32; 3]> {
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

    /// Collapses all that costs up to `most_m`.
    pub fn collapse_within(&mut self, most_m: f64) {
        while let Some(&next) = self.queue.peek() {
            if next.cost2 > most_m * most_m {
                return;
            }
            self.queue.pop();
            if self.changes[next.from as usize] != next.changes {
                self.offer(next.from);
            } else if let Some(collapse) = self.collapse(next.from, next.to, f64::INFINITY) {
                self.apply(next.from, next.to, collapse, most_m * most_m);
            } else {
                self.offered[next.from as usize].1 = f64::INFINITY;
            }
        }
    }

    fn place(&self, vertex: u32) -> u32 {
        self.place_of[vertex as usize]
    }

    fn star(&self, place: u32) -> impl Iterator<Item = u32> {
        self.around[place as usize].iter().copied().filter(|&triangle| self.alive[triangle as usize])
    }

    fn neighbours(&self, place: u32) -> Vec<u32> {
        let corners = self.star(place).flat_map(|triangle| self.triangles[triangle as usize]);
        let mut found: Vec<u32> =
            corners.map(|vertex| self.place(vertex)).filter(|&other| other != place).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Whether an edge is of one triangle alone.
    fn is_border(&self, a: u32, b: u32) -> bool {
        let has_b =
            |triangle: u32| self.triangles[triangle as usize].iter().any(|&vertex| self.place(vertex) == b);
        self.star(a).filter(|&triangle| has_b(triangle)).count() == 1
    }

    /// The neighbours of a place along the border; none within the surface.
    fn along_border(&self, place: u32) -> Vec<u32> {
        self.neighbours(place).into_iter().filter(|&other| self.is_border(place, other)).collect()
    }

    /// Puts the cheapest collapse of a place into the queue.
    fn offer(&mut self, from: u32) {
        let changes = self.changes[from as usize];
        if self.offered[from as usize].0 == changes {
            return;
        }
        let mut best: Option<Candidate> = None;
        for to in self.neighbours(from) {
            let less2 = best.map_or(f64::INFINITY, |best| best.cost2);
            let found = self.collapse(from, to, less2).map(|Collapse { cost2, .. }| Candidate {
                cost2,
                from,
                to,
                changes,
            });
            best = best.max(found);
        }
        self.offered[from as usize] = (changes, best.map_or(f64::INFINITY, |best| best.cost2));
        self.queue.extend(best);
    }

    /// `None` where the surface would tear, vanish or fold, or where it costs more than `most2`.
    fn collapse(&self, from: u32, to: u32, most2: f64) -> Option<Collapse> {
        let along_border = self.along_border(from);
        if !(along_border.is_empty() || along_border.len() == 2 && along_border.contains(&to)) {
            return None;
        }
        let becomes = self.partners(from, to)?;
        let (mut kept, mut border) = (Vec::new(), Vec::new());
        let mut points: Vec<u32> = becomes.iter().map(|pair| pair.0).collect();
        for triangle in self.star(from) {
            points.extend(&self.gone[triangle as usize]);
            let before = self.triangles[triangle as usize];
            if before.iter().any(|&vertex| self.place(vertex) == to) {
                continue;
            }
            let after = before
                .map(|vertex| becomes.iter().find(|pair| pair.0 == vertex).map_or(vertex, |pair| pair.1));
            if self.folds(before, after) {
                return None;
            }
            kept.push((triangle, after));
            let edges = [(0, 1), (1, 2), (2, 0)].into_iter();
            border.extend(
                edges
                    .filter(|&(i, k)| self.is_border(self.place(before[i]), self.place(before[k])))
                    .map(|(i, k)| [after[i], after[k]]),
            );
        }
        if kept.is_empty() {
            return None;
        }
        let from_kept2 = |&point: &u32| {
            let of = |(_, corners): &(u32, [u32; 3])| {
                distance2(&self.points[point as usize], corners.each_ref().map(|&v| &self.points[v as usize]))
            };
            kept.iter().map(of).fold(f64::INFINITY, f64::min)
        };
        let from_border2 = |&point: &u32| {
            let of = |edge: &[u32; 2]| {
                from_segment2(
                    &self.points[point as usize],
                    &self.points[edge[0] as usize],
                    &self.points[edge[1] as usize],
                )
            };
            border.iter().map(of).fold(f64::INFINITY, f64::min)
        };
        let mut cost2 = self.beside2(from, &kept);
        for point in &points {
            if !(cost2 <= most2 && cost2.is_finite()) {
                return None;
            }
            let is_at_border = self.at_border[self.place(*point) as usize];
            cost2 = cost2.max(if is_at_border { from_border2(point) } else { from_kept2(point) });
        }
        if !(cost2 <= most2 && cost2.is_finite()) {
            return None;
        }
        Some(Collapse { kept, cost2 })
    }

    /// How far what takes the place of a corner's triangles is from them, by a look at its middles: what is
    /// hollow would else be filled for nothing.
    fn beside2(&self, from: u32, kept: &[(u32, [u32; 3])]) -> f64 {
        let points = |corners: [u32; 3]| corners.map(|vertex| &self.points[vertex as usize]);
        let from_star2 = |point: &Point<AXES>| {
            self.star(from)
                .map(|t| distance2(point, points(self.triangles[t as usize])))
                .fold(f64::INFINITY, f64::min)
        };
        let of = |(before, after): &(u32, [u32; 3])| {
            let [a, b, c] = points(*after);
            let turned =
                (0..3).find(|&k| self.place(self.triangles[*before as usize][k]) == from).unwrap_or(0);
            let [first, next] =
                [after[turned], after[(turned + 1) % 3]].map(|vertex| &self.points[vertex as usize]);
            from_star2(&middle(&[*a, *b, *c])).max(from_star2(&between(first, next)))
        };
        kept.iter().map(of).fold(0.0, f64::max)
    }

    /// What each vertex of a place becomes: the vertex at the other place that shares a triangle with it.
    /// `None` where that is none, or several.
    fn partners(&self, from: u32, to: u32) -> Option<Vec<(u32, u32)>> {
        let mut becomes: Vec<(u32, Option<u32>)> = Vec::new();
        for triangle in self.star(from) {
            let corners = self.triangles[triangle as usize];
            let at = |place: u32| corners.into_iter().find(|&vertex| self.place(vertex) == place);
            let (Some(own), partner) = (at(from), at(to)) else { continue };
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
        was.dot(is) <= LEAST_COSINE * was.length() * is.length()
    }

    fn apply(&mut self, from: u32, to: u32, collapse: Collapse, most2: f64) {
        let star: Vec<u32> = self.star(from).collect();
        let mut points: Vec<u32> =
            star.iter().flat_map(|&triangle| std::mem::take(&mut self.gone[triangle as usize])).collect();
        points.extend(
            star.iter()
                .flat_map(|&t| self.triangles[t as usize])
                .filter(|&vertex| self.place(vertex) == from),
        );
        points.sort_unstable();
        points.dedup();
        let changed = self.neighbours(from);
        for &triangle in &star {
            self.alive[triangle as usize] = false;
        }
        for &(triangle, corners) in &collapse.kept {
            self.alive[triangle as usize] = true;
            self.triangles[triangle as usize] = corners;
            self.around[to as usize].push(triangle);
        }
        self.count -= star.len() - collapse.kept.len();
        self.around[from as usize].clear();
        self.changes[from as usize] += 1;
        self.remember(&points, &collapse.kept);
        for place in changed {
            self.changes[place as usize] += 1;
            // What is in the queue and cheap enough will be looked at again anyway, when it is its turn.
            if self.offered[place as usize].1 > most2 {
                self.offer(place);
            }
        }
    }

    /// Gives each corner that has gone to the triangle that it is nearest to.
    fn remember(&mut self, points: &[u32], kept: &[(u32, [u32; 3])]) {
        let mut of: HashMap<u32, Vec<(f64, u32)>> = HashMap::new();
        for &point in points {
            let away2 = |corners: &[u32; 3]| {
                distance2(&self.points[point as usize], corners.each_ref().map(|&v| &self.points[v as usize]))
            };
            let nearest = kept
                .iter()
                .map(|(triangle, corners)| (away2(corners), *triangle))
                .min_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((away2, triangle)) = nearest {
                of.entry(triangle).or_default().push((away2, point));
            }
        }
        for (triangle, mut gone) in of {
            gone.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
            gone.truncate(MOST_GONE);
            self.gone[triangle as usize] = gone.into_iter().map(|(_, point)| point).collect();
        }
    }
}

fn distinct([a, b, c]: [u32; 3]) -> bool {
    a != b && b != c && a != c
}
