//! Light on the terrain, baked into its texture: each texel is multiplied by the light at its ground point.
//!
//! Distant terrain is drawn with fewer triangles, and light by triangle would change with the level of
//! detail. Baked light is the same from everywhere, for the renderers and the reference alike. Normals are those
//! of smooth ground (central differences between neighbouring heights), because the facets of a DEM do not
//! exist on the ground, and their edges would show. Light is linear within the triangles of the DEM.

use std::{ops::Range, sync::Arc};

use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;

use super::Light;
use crate::scene::{CHUNK_CELLS, Encoding, Terrain, TerrainChunk, Texture, Wrap, linear_from_srgb};

/// Texture rows per task.
const BAND_ROWS: usize = 64;
/// Distance outside of a triangle, relative to its height, within which a texel centre counts as inside: no
/// texel on an edge may be missed.
const TOLERANCE: f64 = 1e-6;
/// Largest side of an upsampled texture.
const MAX_TEXELS: u32 = 1 << 14;

impl Terrain {
    /// Multiplies the texture by the light on the terrain. The texture is first upsampled if it has less than
    /// a texel per height, so that the light has the full detail of the DEM. Returns the factor of the
    /// upsampling per side.
    pub fn bake_light(&mut self, light: &Light) -> u32 {
        let ground = HeightShading::new(self, light);
        let times = ground.times(self.texture.size_px);
        let mut texture = if times > 1 { finer(&self.texture, times) } else { Texture::clone(&self.texture) };
        ground.paint(&mut texture);
        if light.shadows {
            self.light_parts = light_parts(self, light);
        }
        // Ground beyond the texture is lit as level ground.
        if let Some(beyond) = &mut self.beyond {
            let bytes = ByteScaling::new(texture.encoding);
            beyond[..3].iter_mut().for_each(|byte| *byte = bytes.times(*byte, ground.level));
            texture.fill_border(*beyond);
        }
        self.texture = Arc::new(texture);
        times
    }
}

/// Light of the sun and of the sky at each vertex of a terrain; 0 in voids.
fn light_parts(terrain: &Terrain, light: &Light) -> Vec<[f32; 2]> {
    let columns = terrain.chunk_grid[0] as usize;
    let of_chunk = |(number, chunk): (usize, &TerrainChunk)| {
        let first = [number % columns, number / columns].map(|at| at * CHUNK_CELLS as usize);
        let [across, down] = chunk.cells.map(|cells| cells as usize + 1);
        let of_vertex = |k: usize| {
            let normal = normal(terrain, [first[0] + k % across, first[1] + k / across]);
            normal.map_or([0.0; 2], |normal| light.parts(normal).map(|part| part as f32))
        };
        (0..across * down).map(of_vertex).collect::<Vec<_>>()
    };
    terrain.chunks.par_iter().enumerate().map(of_chunk).collect::<Vec<_>>().concat()
}

/// Light at each height, and in a ring around the DEM that extrapolates its border: the texels of the texture
/// reach half a cell beyond.
struct HeightShading {
    /// Columns and rows, including the ring.
    size: [usize; 2],
    /// Texture coordinates.
    uv: Vec<[f32; 2]>,
    light: Vec<f32>,
    /// Light on level ground, used where there is none.
    level: f32,
}

impl HeightShading {
    fn new(terrain: &Terrain, light: &Light) -> Self {
        let [cols, rows] = terrain.cells.map(|n| n as usize + 1);
        let level = light.factor(DVec3::NEG_Z) as f32;
        let here: Vec<f32> = (0..rows * cols)
            .into_par_iter()
            .map(|k| {
                normal(terrain, [k % cols, k / cols]).map_or(f32::NAN, |normal| light.factor(normal) as f32)
            })
            .collect();
        // Beside a void, the mean of the heights around it.
        let known = |i: usize, j: usize| {
            let own = here[j * cols + i];
            if !own.is_nan() {
                return own;
            }
            let neighbours = (j.saturating_sub(1)..(j + 2).min(rows))
                .flat_map(|j| (i.saturating_sub(1)..(i + 2).min(cols)).map(move |i| (i, j)));
            let (sum, count) = neighbours
                .map(|(i, j)| here[j * cols + i])
                .filter(|l| !l.is_nan())
                .fold((0.0, 0.0), |(sum, n), l| (sum + l, n + 1.0));
            if count > 0.0 { sum / count } else { level }
        };
        let size = [cols + 2, rows + 2];
        let inside = |x: usize, of: usize| x.clamp(1, of) - 1;
        let lit = |k: usize| known(inside(k % size[0], cols), inside(k / size[0], rows));
        let uv = |k: usize| {
            let (x, y) = (k % size[0], k / size[0]);
            let (i, j) = (inside(x, cols), inside(y, rows));
            // The ring is as far from the border as the border from the row inside.
            let mirrored = [(x, i, cols), (y, j, rows)].map(|(at, near, of)| {
                if at == near + 1 { near } else { (2 * near + 1).saturating_sub(at).min(of - 1) }
            });
            let (edge, within) = (vertex(terrain, [i, j]).1, vertex(terrain, mirrored).1);
            if mirrored == [i, j] { edge } else { [0, 1].map(|axis: usize| 2.0 * edge[axis] - within[axis]) }
        };
        let all = 0..size[0] * size[1];
        Self {
            size,
            uv: all.clone().into_par_iter().map(uv).collect(),
            light: all.into_par_iter().map(lit).collect(),
            level,
        }
    }

    /// Factor per side by which a texture must be upsampled to have a texel per cell.
    fn times(&self, size_px: [u32; 2]) -> u32 {
        let [cols, rows] = self.size;
        let texel = |x: usize, y: usize| {
            glam::Vec2::from(self.uv[y * cols + x]).as_dvec2() * DVec2::from(size_px.map(f64::from))
        };
        let across = texel(1, 1).distance(texel(cols - 2, 1)) / (cols - 3) as f64;
        let down = texel(1, 1).distance(texel(1, rows - 2)) / (rows - 3) as f64;
        let most = f64::from((MAX_TEXELS / size_px[0].max(size_px[1]).max(1)).max(1));
        // A slightly lower resolution suffices.
        let wanted = (1.0 / across.min(down) - 1e-3).ceil();
        if wanted.is_finite() { wanted.clamp(1.0, most) as u32 } else { 1 }
    }

    fn paint(&self, texture: &mut Texture) {
        let size_px = texture.size_px.map(|side| side as usize);
        let bytes = ByteScaling::new(texture.encoding);
        let rows_of: Vec<[f64; 2]> =
            (0..self.size[1] - 1).into_par_iter().map(|j| self.texel_rows(j, size_px[1])).collect();
        texture.rgba8.par_chunks_mut(4 * size_px[0] * BAND_ROWS).enumerate().for_each(|(band, pixels)| {
            let first = band * BAND_ROWS;
            let rows = first..first + pixels.len() / (4 * size_px[0]);
            let mut factors = vec![self.level; size_px[0] * rows.len()];
            for (j, [top, bottom]) in rows_of.iter().enumerate() {
                if *bottom >= rows.start as f64 && *top <= rows.end as f64 {
                    (0..self.size[0] - 1).for_each(|i| self.fill_cell([i, j], size_px, &rows, &mut factors));
                }
            }
            for (pixel, factor) in pixels.chunks_exact_mut(4).zip(factors) {
                pixel[..3].iter_mut().for_each(|byte| *byte = bytes.times(*byte, factor));
            }
        });
    }

    /// First and last texel row that a row of cells may reach.
    fn texel_rows(&self, j: usize, height: usize) -> [f64; 2] {
        let both = &self.uv[j * self.size[0]..(j + 2) * self.size[0]];
        let rows = both.iter().map(|uv| f64::from(uv[1]) * height as f64 - 0.5);
        rows.fold([f64::INFINITY, f64::NEG_INFINITY], |[top, bottom], row| {
            [top.min(row.floor()), bottom.max(row.ceil())]
        })
    }

    /// Light of the texels whose centres are in a cell, linear in each of its two triangles.
    fn fill_cell(&self, [i, j]: [usize; 2], size_px: [usize; 2], rows: &Range<usize>, factors: &mut [f32]) {
        let corner = |a: usize, b: usize| {
            let k = (j + b) * self.size[0] + i + a;
            let [u, v] = self.uv[k].map(f64::from);
            (DVec2::new(u * size_px[0] as f64 - 0.5, v * size_px[1] as f64 - 0.5), f64::from(self.light[k]))
        };
        let [nw, ne, sw, se] = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
        for corners in [[nw, se, ne], [nw, sw, se]] {
            fill_triangle(corners, size_px[0], rows, factors);
        }
    }
}

fn fill_triangle(corners: [(DVec2, f64); 3], width: usize, rows: &Range<usize>, factors: &mut [f32]) {
    let [(a, of_a), (b, of_b), (c, of_c)] = corners;
    let area = (b - a).perp_dot(c - a);
    let (low, high) = (a.min(b).min(c) - TOLERANCE, a.max(b).max(c) + TOLERANCE);
    if area == 0.0
        || !area.is_finite()
        || high.x < 0.0
        || low.x > width as f64
        || high.y < rows.start as f64
        || low.y > rows.end as f64
    {
        return;
    }
    let columns = low.x.ceil().max(0.0) as usize..(high.x.floor() as usize + 1).min(width);
    for y in
        (low.y.ceil().max(rows.start as f64) as usize)..(high.y.floor().max(0.0) as usize + 1).min(rows.end)
    {
        for x in columns.clone() {
            let texel = DVec2::new(x as f64, y as f64);
            let (s, t) = ((texel - a).perp_dot(c - a) / area, (b - a).perp_dot(texel - a) / area);
            if s >= -TOLERANCE && t >= -TOLERANCE && s + t <= 1.0 + TOLERANCE {
                factors[(y - rows.start) * width + x] = (of_a + s * (of_b - of_a) + t * (of_c - of_a)) as f32;
            }
        }
    }
}

/// Position and texture coordinates of a height by its column and row.
fn vertex(terrain: &Terrain, [i, j]: [usize; 2]) -> (DVec3, [f32; 2]) {
    let chunk_of = |at: usize, cells: u32| (at as u32).min(cells - 1) / CHUNK_CELLS;
    let [column, row] = [chunk_of(i, terrain.cells[0]), chunk_of(j, terrain.cells[1])];
    let chunk = &terrain.chunks[(row * terrain.chunk_grid[0] + column) as usize];
    let [a, b] = [i as u32 - column * CHUNK_CELLS, j as u32 - row * CHUNK_CELLS];
    let vertex = &terrain.vertices[(chunk.first_vertex + b * (chunk.cells[0] + 1) + a) as usize];
    (chunk.centre_ned_m + Vec3::from(vertex.offset_m).as_dvec3(), vertex.uv)
}

/// Upward normal by central differences, one-sided beside a void; `None` in a void.
fn normal(terrain: &Terrain, [i, j]: [usize; 2]) -> Option<DVec3> {
    let [cols, rows] = terrain.cells.map(|n| n as usize + 1);
    let here = vertex(terrain, [i, j]).0;
    let near = |i: usize, j: usize| {
        Some(vertex(terrain, [i, j]).0).filter(|point| point.is_finite()).unwrap_or(here)
    };
    if !here.is_finite() {
        return None;
    }
    let eastwards = near((i + 1).min(cols - 1), j) - near(i.saturating_sub(1), j);
    let southwards = near(i, (j + 1).min(rows - 1)) - near(i, j.saturating_sub(1));
    let normal = southwards.cross(eastwards).try_normalize().unwrap_or(DVec3::NEG_Z);
    Some(if normal.z > 0.0 { -normal } else { normal })
}

/// Multiplication of encoded bytes by a factor of light, rounded to nearest.
struct ByteScaling {
    linear: [f32; 256],
    /// Linear light from which each byte but the first is the nearest one.
    from: [f32; 255],
}

impl ByteScaling {
    fn new(encoding: Encoding) -> Self {
        let decode = |stored: f32| if encoding == Encoding::Srgb { linear_from_srgb(stored) } else { stored };
        Self {
            linear: std::array::from_fn(|byte| decode(byte as f32 / 255.0)),
            from: std::array::from_fn(|byte| decode((byte as f32 + 0.5) / 255.0)),
        }
    }

    fn of(&self, linear: f32) -> u8 {
        self.from.partition_point(|from| *from <= linear) as u8
    }

    fn times(&self, byte: u8, factor: f32) -> u8 {
        self.of(self.linear[usize::from(byte)] * factor)
    }
}

/// The texture upsampled bilinearly by `times` per side.
fn finer(texture: &Texture, times: u32) -> Texture {
    let bytes = ByteScaling::new(texture.encoding);
    let size_px = texture.size_px.map(|side| side * times);
    let row_bytes = 4 * size_px[0] as usize;
    let mut rgba8 = vec![0; row_bytes * size_px[1] as usize];
    let between = |finer: usize, side: u32| {
        let texel = (finer as f64 + 0.5) / f64::from(times) - 0.5;
        let below = texel.floor();
        ([below, below + 1.0].map(|texel| Wrap::Clamp.texel(texel, side)), (texel - below) as f32)
    };
    rgba8.par_chunks_exact_mut(row_bytes).enumerate().for_each(|(y, row)| {
        let (ys, down) = between(y, texture.size_px[1]);
        for (x, pixel) in row.chunks_exact_mut(4).enumerate() {
            let (xs, across) = between(x, texture.size_px[0]);
            for (channel, byte) in pixel.iter_mut().enumerate() {
                let stored = |k: usize, l: usize| {
                    usize::from(texture.rgba8[4 * (ys[l] * texture.size_px[0] as usize + xs[k]) + channel])
                };
                let mix = |of: &dyn Fn(usize) -> f32| {
                    let row = |l: usize| of(stored(0, l)) * (1.0 - across) + of(stored(1, l)) * across;
                    row(0) * (1.0 - down) + row(1) * down
                };
                *byte = if channel < 3 {
                    bytes.of(mix(&|byte| bytes.linear[byte]))
                } else {
                    (mix(&|byte| byte as f32) + 0.5) as u8
                };
            }
        }
    });
    Texture { size_px, rgba8, encoding: texture.encoding }
}
