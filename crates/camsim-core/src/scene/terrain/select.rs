//! Selection of the triangles to draw.

use glam::DVec3;
use rayon::prelude::*;

use super::{
    TerrainDetail, TerrainHit,
    back_faces::BackFaceTest,
    detail::Tolerances,
    lattice::{self, BLOCK_DEPTH, DEPTHS, LATTICE, Lattice, NODE_CELLS, ROOTS, SIDE, VERTICES},
};

/// Bits of an index that hold the vertex number in its chunk; those above hold the position of the chunk in
/// [`TerrainMesh::chunks`].
pub(crate) const VERTEX_BITS: u32 = 13;

/// Statistics of the selected level of detail.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LodSelection {
    /// Number of chunks in sight.
    pub chunks: usize,
    /// Number of drawn triangles in sight.
    pub triangles: u64,
    /// Number of triangles in sight that are not drawn because they face away.
    pub back_facing: u64,
    /// Bound on the displacement of any visible surface point in the ideal frame, pixels.
    pub max_error_px: f64,
}

/// The selected triangles in sight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TerrainMesh {
    /// Indices of the chunks in sight.
    pub chunks: Vec<u32>,
    /// Three corners per triangle: `position in chunks << VERTEX_BITS | vertex`, with vertices counted from
    /// the chunk's first.
    pub indices: Vec<u32>,
    /// Statistics of the level of detail.
    pub lod: LodSelection,
}

impl TerrainDetail<'_> {
    /// All triangles in sight, with those of the nearest chunks first.
    pub fn mesh(&self) -> TerrainMesh {
        self.mesh_of(false)
    }

    /// The triangles to draw: all in sight, without back faces if no back face can be visible.
    pub fn visible_mesh(&self) -> TerrainMesh {
        self.mesh_of(self.terrain.is_seen_from_above(self.viewpoint().0))
    }

    fn mesh_of(&self, from_above: bool) -> TerrainMesh {
        let parts: Vec<ChunkMesh> = self
            .in_sight
            .par_iter()
            .enumerate()
            .map_init(
                || Tolerances::new(0),
                |known, (index, &chunk)| {
                    known.reset(chunk);
                    self.chunk_part(known, index as u32, chunk, from_above)
                },
            )
            .collect();
        let nearest = parts.iter().filter_map(|part| part.nearest).max();
        let mut indices = Vec::with_capacity(parts.iter().map(|part| part.indices.len()).sum());
        // Nearest first, so that few pixels are shaded more than once.
        nearest_first(&parts).into_iter().for_each(|part| indices.extend_from_slice(&part.indices));
        let lod = LodSelection {
            chunks: self.in_sight.len(),
            triangles: indices.len() as u64 / 3,
            back_facing: parts.iter().map(|part| part.back_facing).sum(),
            max_error_px: nearest.map_or(0.0, |steps| self.error_px(steps)),
        };
        TerrainMesh { chunks: self.in_sight.clone(), indices, lod }
    }

    /// Displacement for errors that are `steps` below their tolerances. A step is 1/128 of an octave along
    /// the octave's chord, which is off by a factor of at most 1.0615; displacement grows at least in
    /// proportion to the error.
    fn error_px(&self, steps: i32) -> f64 {
        let fraction = 1.0615 * (f64::from(steps) / 128.0).exp2();
        (fraction * self.max_error_px() + self.horizontal_px()).min(self.max_error_px())
    }

    fn chunk_part(&self, known: &Tolerances, index: u32, chunk: u32, from_above: bool) -> ChunkMesh {
        let mut walk = HierarchyWalk {
            judged: ChunkErrors::new(self, known, chunk),
            emit: TriangleEmitter::new(self, index, chunk, from_above),
            nearest: None,
        };
        ROOTS.into_iter().for_each(|root| walk.triangle(root, 0));
        let distance_m = self.terrain.chunks[chunk as usize].bounds.distance_m(self.viewpoint().0);
        ChunkMesh {
            indices: walk.emit.indices,
            back_facing: walk.emit.back_facing,
            nearest: walk.nearest,
            distance_m,
        }
    }

    /// Ray parameter at which a ray that hits the full surface at `hit` hits the drawn triangle there: see
    /// [`DrawnCell::t`].
    pub fn drawn_t(&self, hit: &TerrainHit, origin_ned_m: DVec3, direction_ned: DVec3) -> f64 {
        self.drawn_cell(hit).t(hit, origin_ned_m, direction_ned)
    }

    /// The drawn triangles over or under the cell that a ray hits.
    pub fn drawn_cell(&self, hit: &TerrainHit) -> DrawnCell {
        let (chunk, cell) = (&self.terrain.chunks[hit.chunk as usize], hit.cell);
        let mut drawn = DrawnCell { chunk: hit.chunk, cell, triangles: Vec::with_capacity(4) };
        let Some(known) = self.tolerances(hit.chunk) else { return drawn };
        let judged = ChunkErrors::new(self, known, hit.chunk);
        let mut waiting = Vec::with_capacity(2 + DEPTHS as usize);
        waiting.extend(ROOTS.map(|root| (root, 0)));
        let positions = |triangle: [u32; 3]| {
            triangle.map(|vertex| {
                let [i, j] = lattice::position(vertex);
                [i.min(chunk.cells[0]), j.min(chunk.cells[1])]
            })
        };
        // One half of a cell may be part of a larger triangle while the other is at full detail.
        let mut is_full = true;
        while let Some((triangle, depth)) = waiting.pop() {
            let mut corners = positions(triangle);
            let beside = |axis: usize| {
                let along = corners.map(|corner| corner[axis]);
                cell[axis] >= along.into_iter().fold(0, u32::max)
                    || cell[axis] < along.into_iter().fold(u32::MAX, u32::min)
            };
            if beside(0) || beside(1) {
                continue;
            }
            if depth < DEPTHS {
                let (middle, halves) = lattice::halves(triangle);
                if judged.vertex(middle).is_needed() {
                    waiting.extend(halves.map(|half| (half, depth + 1)));
                    continue;
                }
                is_full = false;
            } else if let Some(cell) = lattice::cell_to_turn(triangle) {
                let is_turned = judged.cell(cell).is_needed();
                is_full &= is_turned;
                corners = if is_turned { positions(lattice::turned(triangle, cell)) } else { corners };
            }
            drawn.triangles.push(corners.map(|[i, j]| self.terrain.position_ned_m(hit.chunk, i, j)));
        }
        if is_full {
            drawn.triangles.clear();
        }
        drawn
    }
}

/// The drawn triangles over or under one cell of the terrain.
#[derive(Clone, Debug)]
pub struct DrawnCell {
    chunk: u32,
    cell: [u32; 2],
    /// Corners in NED, metres; empty for the full surface itself.
    triangles: Vec<[DVec3; 3]>,
}

impl DrawnCell {
    /// Whether a hit is in this cell.
    pub fn contains(&self, hit: &TerrainHit) -> bool {
        (self.chunk, self.cell) == (hit.chunk, hit.cell)
    }

    /// Ray parameter at which a ray that hits the full surface at `hit`, in this cell, hits the drawn
    /// triangle there. Of several triangles it is the plane of the one that the ray passes deepest inside.
    /// Where the ray leaves the triangles first, their planes are extended.
    pub fn t(&self, hit: &TerrainHit, origin_ned_m: DVec3, direction_ned: DVec3) -> f64 {
        let mut best = (f64::NEG_INFINITY, hit.t);
        for points in &self.triangles {
            let [a, b, c] = points.map(|point| point - origin_ned_m);
            let [wa, wb, wc] = [c.cross(b), a.cross(c), b.cross(a)].map(|n| direction_ned.dot(n));
            let normal = (b - a).cross(c - a);
            // Distance of the ray inside the triangle, relative to its area; NaN for a triangle without area,
            // which is never the best.
            let inside = wa.min(wb).min(wc).max(-wa.max(wb).max(wc)) / (wa + wb + wc).abs();
            let t = a.dot(normal) / direction_ned.dot(normal);
            if inside > best.0 && t > 0.0 {
                best = (inside, t);
            }
        }
        best.1
    }
}

/// Triangles of one chunk.
struct ChunkMesh {
    indices: Vec<u32>,
    /// Number of back faces skipped.
    back_facing: u64,
    /// Smallest distance of an error below its tolerance, as in [`HierarchyWalk::nearest`].
    nearest: Option<i32>,
    /// Distance from the camera to the chunk's box.
    distance_m: f64,
}

fn nearest_first(parts: &[ChunkMesh]) -> Vec<&ChunkMesh> {
    let mut ordered: Vec<_> = parts.iter().collect();
    ordered.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
    ordered
}

/// Errors of one chunk's vertices and cells, with their tolerances.
struct ChunkErrors<'a> {
    detail: &'a TerrainDetail<'a>,
    known: &'a Tolerances,
    errors: &'a [u16],
    /// Lower bound of the tolerances: an error within it needs no exact test.
    strictest: u16,
    lattice: &'static Lattice,
}

struct ErrorTest {
    error: u16,
    tolerance: u16,
}

impl ErrorTest {
    fn is_needed(&self) -> bool {
        self.error > self.tolerance
    }
}

impl<'a> ChunkErrors<'a> {
    fn new(detail: &'a TerrainDetail<'_>, known: &'a Tolerances, chunk: u32) -> Self {
        Self {
            detail,
            known,
            errors: detail.errors(chunk),
            strictest: detail.root_tolerance(known),
            lattice: &LATTICE,
        }
    }

    #[inline]
    fn vertex(&self, vertex: u32) -> ErrorTest {
        self.judge(self.errors[vertex as usize], self.lattice.set_of_vertex[vertex as usize])
    }

    #[inline]
    fn cell(&self, cell: u32) -> ErrorTest {
        self.judge(self.errors[VERTICES + cell as usize / 2], self.lattice.set_of_cell[cell as usize / 2])
    }

    #[inline]
    fn judge(&self, error: u16, set: u16) -> ErrorTest {
        let tolerance =
            if error <= self.strictest { self.strictest } else { self.detail.set_tolerance(self.known, set) };
        ErrorTest { error, tolerance }
    }
}

/// Descent through the hierarchy of one chunk.
struct HierarchyWalk<'a> {
    judged: ChunkErrors<'a>,
    emit: TriangleEmitter<'a>,
    /// Steps by which the error nearest to its tolerance is below it; `None` while all is exact.
    nearest: Option<i32>,
}

impl HierarchyWalk<'_> {
    fn triangle(&mut self, triangle: [u32; 3], depth: u32) {
        if depth == BLOCK_DEPTH && !self.judged.detail.block_in_sight(self.judged.known, north_west(triangle))
        {
            return;
        }
        if depth == DEPTHS {
            return self.half_cell(triangle);
        }
        let (middle, [first, second]) = lattice::halves(triangle);
        let judgement = self.judged.vertex(middle);
        if judgement.is_needed() {
            self.triangle(first, depth + 1);
            self.triangle(second, depth + 1);
        } else {
            self.note(judgement);
            self.emit.triangle(triangle);
        }
    }

    fn half_cell(&mut self, triangle: [u32; 3]) {
        let Some(cell) = lattice::cell_to_turn(triangle) else { return self.emit.triangle(triangle) };
        let judgement = self.judged.cell(cell);
        if judgement.is_needed() {
            self.emit.triangle(lattice::turned(triangle, cell));
        } else {
            self.note(judgement);
            self.emit.triangle(triangle);
        }
    }

    fn note(&mut self, ErrorTest { error, tolerance }: ErrorTest) {
        // 1 is exact.
        if error > 1 {
            self.nearest = self.nearest.max(Some(i32::from(error) - i32::from(tolerance)));
        }
    }
}

/// North-west corner of the square of 8x8 cells of which a triangle is half.
fn north_west([a, b, _]: [u32; 3]) -> u32 {
    let size = NODE_CELLS[0];
    // The longest side runs from north-west to south-east or from north-east to south-west.
    if a.abs_diff(b) == size * (SIDE + 1) { a.min(b) } else { a.min(b) - size }
}

/// Output of the triangles of one chunk.
struct TriangleEmitter<'a> {
    indices: Vec<u32>,
    base: u32,
    /// Back-face test, if back faces are skipped.
    facing: Option<BackFaceTest<'a>>,
    back_facing: u64,
    /// Vertex table of a chunk that is smaller than the lattice or has voids.
    odd: Option<IrregularChunk<'a>>,
}

struct IrregularChunk<'a> {
    cells: [u32; 2],
    vertices: &'a [super::TerrainVertex],
}

impl<'a> TriangleEmitter<'a> {
    fn new(detail: &'a TerrainDetail<'_>, index: u32, chunk: u32, from_above: bool) -> Self {
        let terrain = detail.terrain;
        let span = &terrain.chunks[chunk as usize];
        let is_odd = span.cells != [SIDE - 1; 2] || span.has_voids;
        let odd = is_odd.then(|| IrregularChunk {
            cells: span.cells,
            vertices: &terrain.vertices[span.first_vertex as usize..],
        });
        let facing = from_above.then(|| BackFaceTest::new(detail, chunk));
        Self { indices: Vec::new(), base: index << VERTEX_BITS, facing, back_facing: 0, odd }
    }

    fn triangle(&mut self, triangle: [u32; 3]) {
        let Some(odd) = &self.odd else { return self.vertices(triangle) };
        let positions = triangle.map(|vertex| {
            let [i, j] = lattice::position(vertex);
            [i.min(odd.cells[0]), j.min(odd.cells[1])]
        });
        let vertices = positions.map(|[i, j]| j * (odd.cells[0] + 1) + i);
        let [a, b, c] = positions.map(|position| position.map(i64::from));
        let has_area = (b[0] - a[0]) * (c[1] - a[1]) != (b[1] - a[1]) * (c[0] - a[0]);
        if has_area && vertices.iter().all(|&vertex| !odd.vertices[vertex as usize].offset_m[0].is_nan()) {
            self.vertices(vertices);
        }
    }

    /// Writes a triangle by its vertex numbers in the chunk.
    fn vertices(&mut self, triangle: [u32; 3]) {
        if self.facing.as_ref().is_some_and(|facing| facing.is_back_facing(triangle)) {
            self.back_facing += 1;
        } else {
            self.indices.extend_from_slice(&triangle.map(|vertex| self.base | vertex));
        }
    }
}
