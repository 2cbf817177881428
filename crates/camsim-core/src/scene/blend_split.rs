//! Splits blended triangles where they intersect. No order of two intersecting triangles is right for
//! blending; of their pieces one is always behind the other.
//!
//! Of each two triangles, the smaller one is split along the plane of the other. An edge is split for all
//! triangles of the shape that share it, so no crack opens. The image does not change except for the rounding
//! of positions and the lengths of interpolated normals.

use std::{
    collections::{HashMap, HashSet},
    sync::Arc,
};

use glam::DVec3;

use super::{
    Aabb, Mesh, MeshVertex, Shape,
    depth_sort::{MAX_TRIANGLES, TOLERANCE},
    proximity_bvh::ProximityBvh,
};

/// Result of the splitting.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlendSplit {
    /// Number of triangles added. Those of shapes that several meshes share count once.
    pub added: usize,
    /// Number of triangles that still intersect others, because the limit was reached.
    pub remaining: usize,
}

/// Splits the blended triangles of a scene where they intersect, up to [`MAX_TRIANGLES`] in total: beyond
/// that number no depth order is computed.
pub fn split_intersecting_blended(meshes: &mut [Mesh]) -> BlendSplit {
    let mut done = BlendSplit::default();
    let blended = |meshes: &[Mesh]| -> usize {
        meshes.iter().filter(|mesh| mesh.material.blends).map(|mesh| mesh.shape.indices.len() / 3).sum()
    };
    if blended(meshes) > MAX_TRIANGLES {
        return done;
    }
    // Within each shape, once for all meshes that share it.
    let mut own: HashMap<*const Shape, Arc<Shape>> = HashMap::new();
    let shapes: Vec<Arc<Shape>> =
        meshes.iter().filter(|mesh| mesh.material.blends).map(|mesh| mesh.shape.clone()).collect();
    for shape in &shapes {
        own.entry(Arc::as_ptr(shape)).or_insert_with(|| {
            let triangles = triangles(0, shape, &|at| at);
            split_shape(
                shape,
                &triangles,
                &intersecting_triangles(&triangles, |_, _| true),
                &|at| at,
                (MAX_TRIANGLES, &mut done),
            )
        });
    }
    let with_own =
        |mesh: &Mesh| own.get(&Arc::as_ptr(&mesh.shape)).map_or(0, |shape| shape.indices.len() / 3);
    if meshes.iter().filter(|mesh| mesh.material.blends).map(with_own).sum::<usize>() > MAX_TRIANGLES {
        return BlendSplit { added: 0, remaining: done.added.max(1) };
    }
    for mesh in meshes.iter_mut().filter(|mesh| mesh.material.blends) {
        if let Some(cut) = own.get(&Arc::as_ptr(&mesh.shape)) {
            mesh.shape = cut.clone();
        }
    }
    let most_more = done.added + MAX_TRIANGLES.saturating_sub(blended(meshes));
    // Between meshes.
    let of_mesh = |(i, mesh): (usize, &Mesh)| {
        triangles(i, &mesh.shape, &|at| mesh.origin_ned_m + mesh.ned_from_shape * at)
    };
    let all: Vec<PlacedTriangle> =
        meshes.iter().enumerate().filter(|(_, mesh)| mesh.material.blends).flat_map(of_mesh).collect();
    // Those that move apart are mixed by their distance alone.
    let intersecting_triangles =
        intersecting_triangles(&all, |a, b| a.mesh != b.mesh && meshes[a.mesh].moves_with(&meshes[b.mesh]));
    let concerned: HashSet<usize> = all
        .iter()
        .zip(&intersecting_triangles)
        .filter(|(_, by)| !by.is_empty())
        .map(|(triangle, _)| triangle.mesh)
        .collect();
    for (i, mesh) in meshes.iter_mut().enumerate().filter(|(i, _)| concerned.contains(i)) {
        let (first, end) = (
            all.partition_point(|triangle| triangle.mesh < i),
            all.partition_point(|triangle| triangle.mesh <= i),
        );
        let (origin_ned_m, ned_from_shape) = (mesh.origin_ned_m, mesh.ned_from_shape);
        mesh.shape = split_shape(
            &mesh.shape,
            &all[first..end],
            &intersecting_triangles[first..end],
            &|at| origin_ned_m + ned_from_shape * at,
            (most_more, &mut done),
        );
    }
    done
}

/// A triangle in world coordinates.
#[derive(Clone, Copy)]
struct PlacedTriangle {
    mesh: usize,
    points: [DVec3; 3],
}

fn triangles(mesh: usize, shape: &Shape, stand: &dyn Fn(DVec3) -> DVec3) -> Vec<PlacedTriangle> {
    let vertex_position = |&corner: &u32| {
        shape.vertices.get(corner as usize).map_or(DVec3::NAN, |vertex| stand(position(vertex)))
    };
    shape
        .indices
        .chunks_exact(3)
        .map(|of| PlacedTriangle {
            mesh,
            points: [vertex_position(&of[0]), vertex_position(&of[1]), vertex_position(&of[2])],
        })
        .collect()
}

fn position(vertex: &MeshVertex) -> DVec3 {
    DVec3::from_array(vertex.position_m.map(f64::from))
}

/// For each triangle, the larger triangles that it intersects.
fn intersecting_triangles(
    all: &[PlacedTriangle],
    may: impl Fn(&PlacedTriangle, &PlacedTriangle) -> bool,
) -> Vec<Vec<[DVec3; 3]>> {
    let bounds = |triangle: &PlacedTriangle| {
        let mut bounds = Aabb::EMPTY;
        triangle.points.iter().filter(|point| point.is_finite()).for_each(|point| bounds.include(*point));
        bounds
    };
    let boxes: Vec<Aabb> = all.iter().map(bounds).collect();
    let tree = ProximityBvh::new(&boxes);
    let size = |k: usize| normal(&all[k].points).length();
    let is_larger = |a: usize, b: usize| size(a).total_cmp(&size(b)).then(a.cmp(&b)).is_gt();
    let crossed_by = |a: usize| {
        let mut others = tree.overlapping(&boxes[a]);
        others.sort_unstable();
        let crossed = |&b: &usize| {
            may(&all[a], &all[b]) && is_larger(b, a) && intersect(&all[a].points, &all[b].points)
        };
        others.into_iter().map(|b| b as usize).filter(crossed).map(|b| all[b].points).collect()
    };
    (0..all.len()).map(crossed_by).collect()
}

fn normal([a, b, c]: &[DVec3; 3]) -> DVec3 {
    (*b - *a).cross(*c - *a)
}

/// Signed distances of the corners from a plane, times the length of its normal. `None` if all corners are on
/// one side of the plane, or close to it.
fn sides(of: &[DVec3; 3], plane: &[DVec3; 3]) -> Option<[f64; 3]> {
    let normal = normal(plane);
    let sides = of.map(|point| normal.dot(point - plane[0]));
    let (low, high) =
        sides.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)));
    let hair = TOLERANCE * high.max(-low);
    (low < -hair && high > hair).then_some(sides)
}

/// Whether two triangles intersect along a segment: each has corners on both sides of the other.
fn intersect(a: &[DVec3; 3], b: &[DVec3; 3]) -> bool {
    let (Some(of_a), Some(of_b)) = (sides(a, b), sides(b, a)) else { return false };
    let along = normal(a).cross(normal(b)).normalize_or_zero();
    let span = |points: &[DVec3; 3], sides: [f64; 3]| {
        let mut span = [f64::INFINITY, f64::NEG_INFINITY];
        for (i, j) in
            [(0, 1), (1, 2), (2, 0)].into_iter().filter(|&(i, j)| (sides[i] < 0.0) != (sides[j] < 0.0))
        {
            let position = along.dot(points[i].lerp(points[j], sides[i] / (sides[i] - sides[j])) - a[0]);
            span = [span[0].min(position), span[1].max(position)];
        }
        span
    };
    let (of_a, of_b) = (span(a, of_a), span(b, of_b));
    let shorter = (of_a[1] - of_a[0]).min(of_b[1] - of_b[0]);
    of_a[1].min(of_b[1]) - of_a[0].max(of_b[0]) > TOLERANCE * shorter
}

/// Triangles of a shape, each split by those that it intersects.
fn split_shape(
    shape: &Arc<Shape>,
    triangles: &[PlacedTriangle],
    intersecting_triangles: &[Vec<[DVec3; 3]>],
    stand: &dyn Fn(DVec3) -> DVec3,
    (most_more, done): (usize, &mut BlendSplit),
) -> Arc<Shape> {
    if intersecting_triangles.iter().all(Vec::is_empty) {
        return shape.clone();
    }
    let pieces = shape
        .indices
        .chunks_exact(3)
        .enumerate()
        .map(|(of, corners)| Piece { corners: [corners[0], corners[1], corners[2]], of });
    let mut work =
        SplitShape { shape: Shape::clone(shape), pieces: pieces.collect(), between: HashMap::new() };
    let before = work.pieces.len();
    for (of, by) in intersecting_triangles.iter().enumerate().take(triangles.len()) {
        for plane in by {
            let mine: Vec<[u32; 3]> =
                work.pieces.iter().filter(|piece| piece.of == of).map(|piece| piece.corners).collect();
            for corners in mine {
                let points = corners.map(|corner| stand(position(&work.shape.vertices[corner as usize])));
                let Some(sides) = sides(&points, plane).filter(|_| intersect(&points, plane)) else {
                    continue;
                };
                if done.added + work.pieces.len() - before >= most_more {
                    done.remaining += 1;
                    continue;
                }
                let hair = TOLERANCE * sides.iter().fold(0.0, |most: f64, side| most.max(side.abs()));
                let is_cut = |&(i, j): &(usize, usize)| {
                    sides[i] * sides[j] < 0.0 && sides[i].abs().min(sides[j].abs()) > hair
                };
                for (i, j) in [(0, 1), (1, 2), (2, 0)].into_iter().filter(is_cut) {
                    work.split_edge(corners[i], corners[j], sides[i] / (sides[i] - sides[j]));
                }
            }
        }
    }
    done.added += work.pieces.len() - before;
    work.shape.indices = work.pieces.iter().flat_map(|piece| piece.corners).collect();
    Arc::new(work.shape)
}

struct Piece {
    corners: [u32; 3],
    /// Index of the original triangle.
    of: usize,
}

/// A shape during splitting.
struct SplitShape {
    shape: Shape,
    pieces: Vec<Piece>,
    /// New vertex on the edge between two vertices.
    between: HashMap<[u32; 2], u32>,
}

impl SplitShape {
    /// Splits the edge between two vertices at a fraction of its length, for all triangles that have it.
    fn split_edge(&mut self, from: u32, to: u32, part: f64) {
        let corner_m = |work: &Self, corner: u32| work.shape.vertices[corner as usize].position_m;
        let ends = [corner_m(self, from), corner_m(self, to)];
        self.between.clear();
        for k in 0..self.pieces.len() {
            let corners = self.pieces[k].corners;
            let which = |end: [f32; 3]| corners.iter().position(|&corner| corner_m(self, corner) == end);
            let (Some(i), Some(j)) = (which(ends[0]), which(ends[1])) else { continue };
            let middle = self.corner_between(corners[i], corners[j], part);
            let mut other = Piece { corners, of: self.pieces[k].of };
            other.corners[i] = middle;
            self.pieces[k].corners[j] = middle;
            self.pieces.push(other);
        }
    }

    fn corner_between(&mut self, from: u32, to: u32, part: f64) -> u32 {
        if let Some(&known) = self.between.get(&[from, to]) {
            return known;
        }
        fn mix<const N: usize>(a: [f32; N], b: [f32; N], part: f64) -> [f32; N] {
            std::array::from_fn(|k| (f64::from(a[k]) + part * (f64::from(b[k]) - f64::from(a[k]))) as f32)
        }
        let [a, b] = [from, to].map(|corner| self.shape.vertices[corner as usize]);
        if self.shape.has_normals() {
            let [a, b] = [from, to].map(|corner| self.shape.normals[corner as usize]);
            let normal = glam::Vec3::from(mix(a, b, part)).normalize_or_zero();
            self.shape.normals.push(normal.to_array());
        }
        let corner = self.shape.vertices.len() as u32;
        let vertex = MeshVertex {
            position_m: mix(a.position_m, b.position_m, part),
            uv: mix(a.uv, b.uv, part),
            tint: mix(a.tint, b.tint, part),
        };
        self.shape.vertices.push(vertex);
        self.between.insert([from, to], corner);
        corner
    }
}
