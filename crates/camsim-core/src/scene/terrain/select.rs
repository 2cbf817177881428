//! Which triangles to draw.

use glam::DVec3;
use rayon::prelude::*;

use super::{
    TerrainDetail, TerrainHit,
    detail::Tolerances,
    facing::Facing,
    lattice::{self, BLOCK_DEPTH, DEPTHS, LATTICE, Lattice, NODE_CELLS, ROOTS, SIDE, VERTICES},
};

/// Bits of an index that are a vertex's number in its chunk; those above are the place of the chunk in
/// [`TerrainMesh::chunks`].
pub const VERTEX_BITS: u32 = 13;

/// What was drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LodSelection {
    /// Chunks in sight.
    pub chunks: usize,
    /// Triangles in sight that are drawn.
    pub triangles: u64,
    /// Triangles in sight that are not, because they face away.
    pub away: u64,
    /// Bound on the displacement of any visible surface point in the ideal frame, pixels.
    pub max_error_px: f64,
}

/// Triangles in sight.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TerrainMesh {
    /// Chunks in sight, by number.
    pub chunks: Vec<u32>,
    /// Three corners a triangle: `place in chunks << VERTEX_BITS | vertex`, vertices counted from the chunk's
    /// first.
    pub indices: Vec<u32>,
    /// What that comes to.
    pub lod: LodSelection,
}

impl TerrainDetail<'_> {
    /// All triangles in sight, those of the nearest chunks first.
    pub fn mesh(&self) -> TerrainMesh {
        self.mesh_of(false)
    }

    /// The triangles to draw: all in sight, but those that face away where none of these can be seen.
    pub fn mesh_to_draw(&self) -> TerrainMesh {
        self.mesh_of(self.terrain.is_seen_from_above(self.seen_from().0))
    }

    fn mesh_of(&self, from_above: bool) -> TerrainMesh {
        let parts: Vec<ChunkPart> = self
            .in_sight
            .par_iter()
            .enumerate()
            .map_init(
                || Tolerances::new(0),
                |known, (place, &chunk)| {
                    known.reset(chunk);
                    self.chunk_part(known, place as u32, chunk, from_above)
                },
            )
            .collect();
        let nearest = parts.iter().filter_map(|part| part.nearest).max();
        let mut indices = Vec::with_capacity(parts.iter().map(|part| part.indices.len()).sum());
        // Pixels are then coloured once, nearly: what is drawn later is hidden.
        nearest_first(&parts).into_iter().for_each(|part| indices.extend_from_slice(&part.indices));
        let lod = LodSelection {
            chunks: self.in_sight.len(),
            triangles: indices.len() as u64 / 3,
            away: parts.iter().map(|part| part.away).sum(),
            max_error_px: nearest.map_or(0.0, |steps| self.error_px(steps)),
        };
        TerrainMesh { chunks: self.in_sight.clone(), indices, lod }
    }

    /// Bound on the displacement by errors that are `steps` below their tolerances. A step is 1/128 of an
    /// octave along each octave's chord, which is off by a factor of 1.0615 at most; and displacement grows
    /// at least in proportion to the error.
    fn error_px(&self, steps: i32) -> f64 {
        let share = 1.0615 * (f64::from(steps) / 128.0).exp2();
        (share * self.max_error_px() + self.horizontal_px()).min(self.max_error_px())
    }

    fn chunk_part(&self, known: &Tolerances, place: u32, chunk: u32, from_above: bool) -> ChunkPart {
        let mut walk = Walk {
            judged: Judged::new(self, known, chunk),
            emit: Emit::new(self, place, chunk, from_above),
            nearest: None,
        };
        ROOTS.into_iter().for_each(|root| walk.triangle(root, 0));
        let distance_m = self.terrain.chunks[chunk as usize].bounds.distance_m(self.seen_from().0);
        ChunkPart { indices: walk.emit.indices, away: walk.emit.away, nearest: walk.nearest, distance_m }
    }

    /// Ray parameter at which a ray that meets the full surface at `hit` meets the triangle that is drawn
    /// there instead: see [`DrawnCell::t`].
    pub fn drawn_t(&self, hit: &TerrainHit, origin_ned_m: DVec3, direction_ned: DVec3) -> f64 {
        self.drawn_at(hit).t(hit, origin_ned_m, direction_ned)
    }

    /// What is drawn over or under the cell that a ray meets.
    pub fn drawn_at(&self, hit: &TerrainHit) -> DrawnCell {
        let (chunk, cell) = (&self.terrain.chunks[hit.chunk as usize], hit.cell);
        let mut drawn = DrawnCell { chunk: hit.chunk, cell, triangles: Vec::with_capacity(4) };
        let Some(known) = self.tolerances(hit.chunk) else { return drawn };
        let judged = Judged::new(self, known, hit.chunk);
        let mut waiting = Vec::with_capacity(2 + DEPTHS as usize);
        waiting.extend(ROOTS.map(|root| (root, 0)));
        let places = |triangle: [u32; 3]| {
            triangle.map(|vertex| {
                let [i, j] = lattice::place(vertex);
                [i.min(chunk.cells[0]), j.min(chunk.cells[1])]
            })
        };
        // One half of a cell may be part of a larger triangle while the other is as it is.
        let mut is_full = true;
        while let Some((triangle, depth)) = waiting.pop() {
            let mut corners = places(triangle);
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
                corners = if is_turned { places(lattice::turned(triangle, cell)) } else { corners };
            }
            drawn.triangles.push(corners.map(|[i, j]| self.terrain.position_ned_m(hit.chunk, i, j)));
        }
        if is_full {
            drawn.triangles.clear();
        }
        drawn
    }
}

/// What is drawn over or under one cell of the terrain.
#[derive(Clone, Debug)]
pub struct DrawnCell {
    chunk: u32,
    cell: [u32; 2],
    /// Corners, NED, metres; none for the full surface itself.
    triangles: Vec<[DVec3; 3]>,
}

impl DrawnCell {
    /// Whether it is the cell that a ray meets.
    pub fn is_of(&self, hit: &TerrainHit) -> bool {
        (self.chunk, self.cell) == (hit.chunk, hit.cell)
    }

    /// Ray parameter at which a ray that meets the full surface at `hit`, in this cell, meets the triangle
    /// that is drawn there instead: the plane of that which the ray passes deepest inside. Where the ray
    /// leaves the triangles before it meets them, their planes are continued.
    pub fn t(&self, hit: &TerrainHit, origin_ned_m: DVec3, direction_ned: DVec3) -> f64 {
        let mut best = (f64::NEG_INFINITY, hit.t);
        for points in &self.triangles {
            let [a, b, c] = points.map(|point| point - origin_ned_m);
            let [wa, wb, wc] = [c.cross(b), a.cross(c), b.cross(a)].map(|n| direction_ned.dot(n));
            let normal = (b - a).cross(c - a);
            // How far inside the triangle the ray passes, of its area; NaN for a triangle without area, which
            // never is the best.
            let inside = wa.min(wb).min(wc).max(-wa.max(wb).max(wc)) / (wa + wb + wc).abs();
            let t = a.dot(normal) / direction_ned.dot(normal);
            if inside > best.0 && t > 0.0 {
                best = (inside, t);
            }
        }
        best.1
    }
}

/// What one chunk adds.
struct ChunkPart {
    indices: Vec<u32>,
    /// Triangles that face away and were left out.
    away: u64,
    /// As [`Walk::nearest`].
    nearest: Option<i32>,
    /// From the camera to the chunk's box.
    distance_m: f64,
}

fn nearest_first(parts: &[ChunkPart]) -> Vec<&ChunkPart> {
    let mut ordered: Vec<_> = parts.iter().collect();
    ordered.sort_by(|a, b| a.distance_m.total_cmp(&b.distance_m));
    ordered
}

/// Errors of one chunk's vertices and cells, and what they may be.
struct Judged<'a> {
    detail: &'a TerrainDetail<'a>,
    known: &'a Tolerances,
    errors: &'a [u16],
    /// None of the tolerances is below this: what keeps it need not be looked at any closer.
    strictest: u16,
    lattice: &'static Lattice,
}

struct Judgement {
    error: u16,
    tolerance: u16,
}

impl Judgement {
    fn is_needed(&self) -> bool {
        self.error > self.tolerance
    }
}

impl<'a> Judged<'a> {
    fn new(detail: &'a TerrainDetail<'_>, known: &'a Tolerances, chunk: u32) -> Self {
        Self {
            detail,
            known,
            errors: detail.errors(chunk),
            strictest: detail.of_root(known),
            lattice: &LATTICE,
        }
    }

    #[inline]
    fn vertex(&self, vertex: u32) -> Judgement {
        self.judge(self.errors[vertex as usize], self.lattice.set_of_vertex[vertex as usize])
    }

    #[inline]
    fn cell(&self, cell: u32) -> Judgement {
        self.judge(self.errors[VERTICES + cell as usize / 2], self.lattice.set_of_cell[cell as usize / 2])
    }

    #[inline]
    fn judge(&self, error: u16, set: u16) -> Judgement {
        let tolerance =
            if error <= self.strictest { self.strictest } else { self.detail.of_set(self.known, set) };
        Judgement { error, tolerance }
    }
}

/// Down the hierarchy of one chunk.
struct Walk<'a> {
    judged: Judged<'a>,
    emit: Emit<'a>,
    /// Steps that the error nearest to its tolerance is below it; `None` while all is exact.
    nearest: Option<i32>,
}

impl Walk<'_> {
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

    fn note(&mut self, Judgement { error, tolerance }: Judgement) {
        // 1 is exact.
        if error > 1 {
            self.nearest = self.nearest.max(Some(i32::from(error) - i32::from(tolerance)));
        }
    }
}

/// The corner of the square of 8x8 cells of which a triangle is half.
fn north_west([a, b, _]: [u32; 3]) -> u32 {
    let size = NODE_CELLS[0];
    // The longest side runs from north-west to south-east or from north-east to south-west.
    if a.abs_diff(b) == size * (SIDE + 1) { a.min(b) } else { a.min(b) - size }
}

/// Writes triangles of one chunk.
struct Emit<'a> {
    indices: Vec<u32>,
    base: u32,
    /// Tells what faces away, if that is left out.
    facing: Option<Facing<'a>>,
    away: u64,
    /// For a chunk that is smaller than the lattice or has voids: what its vertices are.
    odd: Option<OddChunk<'a>>,
}

struct OddChunk<'a> {
    cells: [u32; 2],
    vertices: &'a [super::TerrainVertex],
}

impl<'a> Emit<'a> {
    fn new(detail: &'a TerrainDetail<'_>, place: u32, chunk: u32, from_above: bool) -> Self {
        let terrain = detail.terrain;
        let of = &terrain.chunks[chunk as usize];
        let is_odd = of.cells != [SIDE - 1; 2] || of.has_voids;
        let odd = is_odd
            .then(|| OddChunk { cells: of.cells, vertices: &terrain.vertices[of.first_vertex as usize..] });
        let facing = from_above.then(|| Facing::new(detail, chunk));
        Self { indices: Vec::new(), base: place << VERTEX_BITS, facing, away: 0, odd }
    }

    fn triangle(&mut self, triangle: [u32; 3]) {
        let Some(odd) = &self.odd else { return self.vertices(triangle) };
        let places = triangle.map(|vertex| {
            let [i, j] = lattice::place(vertex);
            [i.min(odd.cells[0]), j.min(odd.cells[1])]
        });
        let vertices = places.map(|[i, j]| j * (odd.cells[0] + 1) + i);
        let [a, b, c] = places.map(|place| place.map(i64::from));
        let has_area = (b[0] - a[0]) * (c[1] - a[1]) != (b[1] - a[1]) * (c[0] - a[0]);
        if has_area && vertices.iter().all(|&vertex| !odd.vertices[vertex as usize].offset_m[0].is_nan()) {
            self.vertices(vertices);
        }
    }

    /// A triangle by its vertices' places in the chunk.
    fn vertices(&mut self, triangle: [u32; 3]) {
        if self.facing.as_ref().is_some_and(|facing| facing.is_away(triangle)) {
            self.away += 1;
        } else {
            self.indices.extend_from_slice(&triangle.map(|vertex| self.base | vertex));
        }
    }
}
