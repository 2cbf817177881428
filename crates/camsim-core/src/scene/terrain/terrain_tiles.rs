//! Tiles of a large terrain texture that a frame may read.
//!
//! A pixel that shows ground in a box at depth z and distance d is at least `z^2 / (d focal)` metres wide
//! along the contours of a slope; across them, its horizontal extent is smaller by at most the cosine of the
//! slope. Times the texels per metre, these are bounds on both axes of the pixel's footprint in the texture,
//! and therefore on the mip level that is read ([`PrefilterTaps`]). The boxes are those of the terrain's
//! hierarchy.

use glam::{DMat2, DVec2};
use rayon::prelude::*;

use super::{CHUNK_CELLS, Terrain, TerrainDetail, lattice::NODE_CELLS};
use crate::scene::{
    PrefilterTaps,
    texture::TexelForm,
    texture_tiles::{TileGrid, tile_bytes},
};

/// Bound on the slope of a triangle over several cells, relative to the steepest cell below it. It follows
/// from the slopes of the cells along two directions, for cells up to 1.4 times as long as wide.
const STEEPER: f64 = 2.0;
/// Ratio of screen derivatives over a whole pixel to those at a point: on a plane, texels per pixel vary with
/// depth.
const MARGIN: f64 = 0.9;
/// A square of cells whose texture spans more tiles than this is subdivided.
const MANY_TILES: u32 = 4;

/// Texture properties of a terrain by chunk: computed once, for textures that are tiled.
#[derive(Clone, Debug)]
pub struct TerrainTiles {
    /// Subdivision of the texture into tiles.
    pub grid: TileGrid,
    chunks: Vec<ChunkTexture>,
    /// Texture bounds of the [`SQUARES`] of each chunk.
    uvs: Vec<UvBox>,
}

/// Smallest and largest texture coordinates.
type UvBox = [[f32; 2]; 2];

/// Number of squares of all [`NODE_CELLS`] in a chunk, and the index of the first of each size.
const SQUARES: usize = 64 + 16 + 4 + 1;
const FIRST: [usize; NODE_CELLS.len()] = [0, 64, 64 + 16, 64 + 16 + 4];

#[derive(Clone, Copy, Debug)]
struct ChunkTexture {
    /// Least number of texels per metre in any direction.
    texels_a_metre: f64,
    /// Largest slope (tangent).
    slope: f64,
}

/// Reach of a filter: it reads a mip level of at least `cell` texels, with taps within `reach` texels of that
/// level from the pixel's centre.
struct TapReach {
    of_longer: f64,
    of_shorter: f64,
    reach: f64,
}

impl TapReach {
    /// As in camsim-gpu/shaders/ideal/prefilter, plus 1.5 texels for the bilinear tap.
    fn of(reads: PrefilterTaps) -> Self {
        match reads {
            // At the pixel's centre.
            PrefilterTaps::One => Self { of_longer: 1.0, of_shorter: 1.0, reach: 1.5 },
            // Offset by 0.29 of the longer axis, at a level of at least 0.18 of it.
            PrefilterTaps::Two => Self { of_longer: 0.5, of_shorter: 1.0, reach: 3.5 },
            // Offset by 0.39 of the longer axis at a level of at least 0.09 of it, or by half of the
            // diagonal.
            PrefilterTaps::Four => Self { of_longer: 0.25, of_shorter: 0.5, reach: 6.0 },
            // Offset by half of the longer axis, at a level of at least 1/64 of it.
            PrefilterTaps::Grid => Self { of_longer: 1.0 / 32.0, of_shorter: 0.5, reach: 34.0 },
        }
    }

    /// Finest mip level for axes of at least the given texels. A level of 2^level texels represents a cell of
    /// at least 1.4 times as many; for the grid, of as many.
    fn finest(&self, reads: PrefilterTaps, longer: f64, shorter: f64) -> usize {
        let cell = MARGIN * (self.of_longer * longer).max(self.of_shorter * shorter);
        let texels2 = if reads == PrefilterTaps::Grid { cell * cell } else { 0.5 * cell * cell + 1.0 };
        // NaN gives the finest level.
        (0.5 * texels2.log2()).floor().max(0.0) as usize
    }
}

impl TerrainTiles {
    /// Computes the properties from every cell.
    #[must_use]
    pub fn new(terrain: &Terrain) -> Self {
        let grid = TileGrid::new(terrain.texture.size_px);
        let all = 0..terrain.chunks.len() as u32;
        let chunks = all.clone().into_par_iter().map(|chunk| chunk_picture(terrain, chunk)).collect();
        let uvs = all.into_par_iter().flat_map_iter(|chunk| chunk_uvs(terrain, chunk)).collect();
        Self { grid, chunks, uvs }
    }

    /// Bounds of the texture coordinates of a square of a chunk's cells, with one of [`NODE_CELLS`].
    fn uvs(&self, chunk: u32, at: [i64; 2], size: usize) -> [[f64; 2]; 2] {
        let along = i64::from(CHUNK_CELLS / NODE_CELLS[size]);
        let [column, row] = at.map(|n| (n % along) as usize);
        self.uvs[chunk as usize * SQUARES + FIRST[size] + row * along as usize + column]
            .map(|uv| uv.map(f64::from))
    }

    /// GPU memory for all tiles of the texture.
    #[must_use]
    pub fn bytes(&self, form: TexelForm) -> u64 {
        u64::from(self.grid.count) * tile_bytes(form)
    }
}

impl TerrainDetail<'_> {
    /// Tiles that may be read for what is in sight, in order.
    #[must_use]
    pub fn tiles(&self, ground: &TerrainTiles, reads: PrefilterTaps) -> Vec<u32> {
        let mut is_read = vec![false; ground.grid.count as usize];
        // The last level of the page table must be resident.
        if let Some(last) = is_read.last_mut() {
            *last = true;
        }
        for &chunk in &self.in_sight {
            let [column, row] = [chunk % self.terrain.chunk_grid[0], chunk / self.terrain.chunk_grid[0]];
            self.mark_tiles(
                ground,
                reads,
                chunk,
                [column, row].map(i64::from),
                NODE_CELLS.len() - 1,
                &mut is_read,
            );
        }
        (0..ground.grid.count).filter(|&tile| is_read[tile as usize]).collect()
    }

    /// Marks the tiles of a square of a chunk's cells, with one of [`NODE_CELLS`].
    fn mark_tiles(
        &self,
        ground: &TerrainTiles,
        reads: PrefilterTaps,
        chunk: u32,
        at: [i64; 2],
        size: usize,
        is_read: &mut [bool],
    ) {
        let cells = NODE_CELLS[size];
        let Some((depth_m, slant)) = self.least_depth(cells, at) else { return };
        let metres = depth_m / (slant * self.viewpoint().1);
        let picture = &ground.chunks[chunk as usize];
        let longer = picture.texels_a_metre * metres;
        let shorter = longer / (1.0 + (STEEPER * picture.slope).powi(2)).sqrt();
        let filter = TapReach::of(reads);
        let grid = &ground.grid;
        let finest = filter.finest(reads, longer, shorter).min(grid.sizes.len() - 1);
        let [low, high] = ground.uvs(chunk, at, size);
        let [columns, rows] = grid.tiles_between(finest, low, high, filter.reach);
        if size > 0
            && finest + 1 < grid.sizes.len()
            && (columns[1] - columns[0] + 1) * (rows[1] - rows[0] + 1) > MANY_TILES
        {
            for [i, j] in [[0, 0], [1, 0], [0, 1], [1, 1]] {
                self.mark_tiles(ground, reads, chunk, [2 * at[0] + i, 2 * at[1] + j], size - 1, is_read);
            }
            return;
        }
        for level in finest..grid.sizes.len() {
            let [columns, rows] = grid.tiles_between(level, low, high, filter.reach);
            let across = grid.tiles(level)[0];
            for row in rows[0]..=rows[1] {
                for column in columns[0]..=columns[1] {
                    is_read[(grid.first[level] + row * across + column) as usize] = true;
                }
            }
        }
    }
}

fn chunk_uvs(terrain: &Terrain, chunk: u32) -> Vec<UvBox> {
    let span = &terrain.chunks[chunk as usize];
    let mut boxes = vec![[[f32::INFINITY; 2], [f32::NEG_INFINITY; 2]]; SQUARES];
    for (size, cells) in NODE_CELLS.into_iter().enumerate() {
        let along = CHUNK_CELLS / cells;
        for square in 0..along * along {
            let [i0, j0] = [square % along * cells, square / along * cells];
            let range = &mut boxes[FIRST[size] + square as usize];
            for j in j0..=(j0 + cells).min(span.cells[1]) {
                for i in i0..=(i0 + cells).min(span.cells[0]) {
                    let uv = terrain.vertices[(span.first_vertex + j * (span.cells[0] + 1) + i) as usize].uv;
                    *range = [
                        [0, 1].map(|k: usize| range[0][k].min(uv[k])),
                        [0, 1].map(|k: usize| range[1][k].max(uv[k])),
                    ];
                }
            }
        }
    }
    boxes
}

fn chunk_picture(terrain: &Terrain, chunk: u32) -> ChunkTexture {
    let cells = terrain.chunks[chunk as usize].cells;
    let first = terrain.chunks[chunk as usize].first_vertex;
    let size = DVec2::from_array(terrain.texture.size_px.map(f64::from));
    let mut picture = ChunkTexture { texels_a_metre: f64::INFINITY, slope: 0.0 };
    for (i, j) in (0..cells[1]).flat_map(|j| (0..cells[0]).map(move |i| (i, j))) {
        let corners = [[0, 0], [1, 0], [1, 1], [0, 1]].map(|[a, b]| {
            let vertex = first + (j + b) * (cells[0] + 1) + i + a;
            let uv = terrain.vertices[vertex as usize].uv;
            (terrain.position_ned_m(chunk, i + a, j + b), DVec2::from_array(uv.map(f64::from)) * size)
        });
        // Both triangulations of the cell.
        for k in 0..4 {
            let [(a, at_a), (b, at_b), (c, at_c)] = [k, k + 1, k + 2].map(|n| corners[n % 4]);
            let normal = (b - a).cross(c - a);
            if !normal.is_finite() {
                continue;
            }
            picture.slope = picture.slope.max(normal.truncate().length() / normal.z.abs());
            let metres = DMat2::from_cols((b - a).truncate(), (c - a).truncate());
            let texels = DMat2::from_cols(at_b - at_a, at_c - at_a);
            let most_metres = larger(metres * texels.inverse());
            // There is no bound for a cell that maps to a line or point of the texture.
            picture.texels_a_metre =
                picture.texels_a_metre.min(if most_metres.is_finite() { most_metres.recip() } else { 0.0 });
        }
    }
    if picture.texels_a_metre.is_finite() {
        picture
    } else {
        ChunkTexture { texels_a_metre: 0.0, slope: f64::INFINITY }
    }
}

/// The larger singular value.
fn larger(m: DMat2) -> f64 {
    let (sum, product) = (m.x_axis.length_squared() + m.y_axis.length_squared(), m.determinant());
    (0.5 * (sum + (sum * sum - 4.0 * product * product).max(0.0).sqrt())).sqrt()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use std::sync::Arc;

    use glam::DVec3;

    use super::{
        super::tests::{Random, forward, hill_heights, nadir},
        *,
    };
    use crate::scene::{Encoding, Prefilter, Texture};

    #[test]
    fn selected_tiles_cover_all_reads() {
        const TANGENTS: [f64; 4] = [-0.7, 0.7, -0.5, 0.5];
        const FOCAL_PX: f64 = 220.0;
        // Five texels per metre, over some slopes of more than 1.
        let size_px = [10_000, 7500];
        let texture = Arc::new(Texture { size_px, rgba8: Vec::new(), encoding: Encoding::Srgb });
        let terrain =
            Terrain::from_heights(200, 150, 10.0, &hill_heights(200, 150, 70.0), Some(texture)).unwrap();
        let ground = TerrainTiles::new(&terrain);
        let mut random = Random(41);
        let (mut looked, mut needed, mut used) = (0, 0, 0);
        for i in 0..16 {
            let over = [random.within(-600.0, 600.0), random.within(-800.0, 800.0)];
            let top = terrain.down_at(over[0], over[1]).unwrap();
            let position = DVec3::new(over[0], over[1], top - random.within(5.0, 1500.0));
            let camera =
                if i % 4 == 0 { nadir(position) } else { forward(position, random.within(0.0, 1.2)) };
            // The full surface, with whose triangles rays are intersected.
            let detail = TerrainDetail::new(&terrain, &camera, TANGENTS, FOCAL_PX, 1e-6);
            for reads in PrefilterTaps::ALL {
                let tiles = detail.tiles(&ground, reads);
                let mut is_used = vec![false; ground.grid.count as usize];
                for _ in 0..900 {
                    let uv = DVec2::new(
                        random.within(TANGENTS[0], TANGENTS[1]),
                        random.within(TANGENTS[2], TANGENTS[3]),
                    );
                    let meet = |uv: DVec2| {
                        terrain.intersect(position, camera.ned_from_camera * uv.extend(1.0), f64::INFINITY)
                    };
                    let step = 1e-4 / FOCAL_PX;
                    let near =
                        [DVec2::ZERO, DVec2::new(step, 0.0), DVec2::new(0.0, step)].map(|off| meet(uv + off));
                    let [Some(hit), Some(right), Some(below)] = near else { continue };
                    let is_one = [&right, &below].iter().all(|other| {
                        (other.chunk, other.cell, other.normal_ned) == (hit.chunk, hit.cell, hit.normal_ned)
                    });
                    if !is_one {
                        continue;
                    }
                    let size = DVec2::from_array(size_px.map(f64::from));
                    let texels = |uv: [f64; 2]| DVec2::from_array(uv) * size;
                    let a_pixel = |uv: [f64; 2]| (texels(uv) - texels(hit.uv)) / (step * FOCAL_PX);
                    let filter =
                        Prefilter::new(DMat2::from_cols(a_pixel(right.uv), a_pixel(below.uv)), reads);
                    let (level, sides) = filter.reads();
                    for corner in [DVec2::ONE, DVec2::NEG_ONE, DVec2::new(1.0, -1.0), DVec2::new(-1.0, 1.0)] {
                        let uv = ((texels(hit.uv) + 0.5 * (corner.x * sides[0] + corner.y * sides[1]))
                            / size)
                            .to_array();
                        for level in [level.floor() as usize, level.ceil() as usize] {
                            let level = level.min(ground.grid.sizes.len() - 1);
                            let [[column, _], [row, _]] = ground.grid.tiles_between(level, uv, uv, 0.0);
                            let tile = ground.grid.first[level] + row * ground.grid.tiles(level)[0] + column;
                            assert!(
                                tiles.binary_search(&tile).is_ok(),
                                "{reads:?}: version {level}, {column}, {row} position {uv:?}"
                            );
                            is_used[tile as usize] = true;
                        }
                    }
                    looked += 1;
                }
                (needed, used) = (needed + tiles.len(), used + is_used.iter().filter(|used| **used).count());
            }
        }
        eprintln!(
            "{looked} pixels; {needed} tiles of {} for 48 frames, of which {used} are read by them",
            48 * ground.grid.count
        );
        assert!(looked > 15_000 && needed < 24 * ground.grid.count as usize, "{looked} {needed}");
    }
}
