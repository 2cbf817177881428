//! Procedural scenes: ground, hills and houses from a hash, the same on every machine.

use std::sync::Arc;

use camsim_core::{
    photometric::GrayImage,
    scene::{Encoding, Mesh, MeshVertex, Scene, Shape, Terrain, TerrainError, Texture, Wrap},
};
use glam::DVec3;
use rayon::prelude::*;

/// Width of one copy of the ground texture, metres.
const GROUND_M: f64 = 768.0;
/// Side of the ground texture, pixels: half a metre each, as a camera with f = 307.6 px resolves from 154 m.
const GROUND_PX: u32 = 1536;
/// Width of one copy of the facade texture, metres.
const FACADE_M: f64 = 64.0;
/// Side of the facade texture, pixels.
const FACADE_PX: u32 = 512;
/// Terrain cells along a side.
const CELLS: u32 = 96;

/// Textures and relief, shared by all scenes.
#[derive(Clone, Debug)]
pub struct World {
    ground: Arc<Texture>,
    facade: Arc<Texture>,
    /// Heights of the grid points, with mean 0 and standard deviation 1.
    relief: Arc<Vec<f64>>,
}

impl World {
    /// Makes textures and relief from one seed.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        // Textures have the amplitude spectrum of natural images, 1/f: equal variance in each octave. The
        // relief falls faster, for smooth hills.
        let relief = fractal(CELLS, 2, CELLS / 4, 0.5, seed ^ 3);
        let points = CELLS + 1;
        let height = |i: u32| f64::from(relief[((i / points % CELLS) * CELLS + i % points % CELLS) as usize]);
        Self {
            ground: Arc::new(texture(GROUND_PX, seed ^ 1)),
            facade: Arc::new(texture(FACADE_PX, seed ^ 2)),
            relief: Arc::new((0..points * points).map(height).collect()),
        }
    }

    /// Level ground at height 0, 6 km wide.
    #[must_use]
    pub fn plane(&self) -> Scene {
        const COPIES: f64 = 8.0;
        let mut ground = Mesh::level_picture(self.ground.clone(), DVec3::ZERO, COPIES * GROUND_M);
        ground.material.wrap = [Wrap::Repeat; 2];
        for vertex in &mut Arc::make_mut(&mut ground.shape).vertices {
            vertex.uv = vertex.uv.map(|t| t * COPIES as f32);
        }
        Scene { meshes: vec![ground], sky_linear: [0.35, 0.55, 0.9], ..Scene::default() }
    }

    /// Hills with mean height 0 and standard deviation `relief_m`, `width_m` wide.
    ///
    /// # Errors
    /// Width or relief make no terrain.
    pub fn hills(&self, width_m: f64, relief_m: f64) -> Result<Scene, TerrainError> {
        let heights: Vec<f64> = self.relief.iter().map(|height| relief_m * height).collect();
        let terrain = Terrain::from_heights(
            CELLS + 1,
            CELLS + 1,
            width_m / f64::from(CELLS),
            &heights,
            Some(self.ground.clone()),
        )?;
        Ok(Scene { terrain: Some(terrain), sky_linear: [0.35, 0.55, 0.9], ..Scene::default() })
    }

    /// Houses on level ground within `half_m` of the origin.
    #[must_use]
    pub fn town(&self, half_m: f64) -> Scene {
        let mut scene = self.plane();
        scene.meshes.push(self.houses(half_m, 0.0, &|_, _| 0.0));
        scene
    }

    /// Houses on hills 768 m wide.
    ///
    /// # Errors
    /// The relief makes no terrain.
    pub fn town_on_hills(&self, half_m: f64, relief_m: f64) -> Result<Scene, TerrainError> {
        let mut scene = self.hills(GROUND_M, relief_m)?;
        let cell_m = GROUND_M / f64::from(CELLS);
        let index =
            |m: f64| ((m / cell_m + 0.5 * f64::from(CELLS)).round().clamp(0.0, f64::from(CELLS))) as u32;
        // Houses reach 5 m into the ground, so that no gap opens on slopes. Row 0 of the relief is in the
        // north.
        let houses = self.houses(half_m, 5.0, &|north_m, east_m| {
            relief_m * self.relief[((CELLS - index(north_m)) * (CELLS + 1) + index(east_m)) as usize]
        });
        scene.meshes.push(houses);
        Ok(scene)
    }

    /// One mesh of boxes, 8 to 16 m wide and 6 to 20 m high, one in each square of 40 m, with random position
    /// and rotation, down to `depth_m` below the ground. `ground_m` is the height of the ground at (north,
    /// east).
    fn houses(&self, half_m: f64, depth_m: f64, ground_m: &dyn Fn(f64, f64) -> f64) -> Mesh {
        const PLOT_M: f64 = 40.0;
        let mut shape = Shape::default();
        let plots = (half_m / PLOT_M).floor() as i32;
        for (i, j) in (-plots..=plots).flat_map(|i| (-plots..=plots).map(move |j| (i, j))) {
            let random = |k: u64| unit(hash((i + 1000) as u64 * 4096 + (j + 1000) as u64, k));
            let centre = [f64::from(i) + 0.4 * (random(0) - 0.5), f64::from(j) + 0.4 * (random(1) - 0.5)]
                .map(|plots| plots * PLOT_M);
            let half = [4.0 + 4.0 * random(2), 4.0 + 4.0 * random(3)];
            let ground_m = ground_m(centre[0], centre[1]);
            let heights_m = [ground_m - depth_m, ground_m + 6.0 + 14.0 * random(4)];
            push_box(&mut shape, centre, half, random(5) * std::f64::consts::PI, heights_m);
        }
        Mesh::new(shape.vertices, shape.indices, self.facade.clone(), DVec3::ZERO, Wrap::Repeat)
    }
}

/// Adds a box without a bottom, from `heights_m[0]` to `heights_m[1]`.
fn push_box(shape: &mut Shape, centre_m: [f64; 2], half_m: [f64; 2], rotation_rad: f64, heights_m: [f64; 2]) {
    let (sin, cos) = rotation_rad.sin_cos();
    let corner = |a: f64, b: f64| {
        let (x, y) = (a * half_m[0], b * half_m[1]);
        [centre_m[0] + x * cos - y * sin, centre_m[1] + x * sin + y * cos]
    };
    let corners = [corner(-1.0, -1.0), corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)];
    let [bottom_m, top_m] = heights_m;
    let mut face = |points: [[f64; 3]; 4], size_m: [f64; 2]| {
        let first = shape.vertices.len() as u32;
        for (point, [a, b]) in points.into_iter().zip([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]]) {
            // Each house has its own part of the texture.
            let uv =
                [a * size_m[0] + centre_m[0], b * size_m[1] + centre_m[1]].map(|m| (m / FACADE_M) as f32);
            shape.vertices.push(MeshVertex::new(point.map(|m| m as f32), uv));
        }
        shape.indices.extend([0, 1, 2, 0, 2, 3].map(|k| first + k));
    };
    let point = |[n, e]: [f64; 2], height_m: f64| [n, e, -height_m];
    face(corners.map(|c| point(c, top_m)), [2.0 * half_m[1], 2.0 * half_m[0]]);
    for k in 0..4 {
        let (a, b) = (corners[k], corners[(k + 1) % 4]);
        face(
            [point(a, top_m), point(b, top_m), point(b, bottom_m), point(a, bottom_m)],
            [2.0 * half_m[(k + 1) % 2], top_m - bottom_m],
        );
    }
}

/// A vignette map: cos^4 of the angle to the axis of a 640x480 camera with f = 400 px.
#[must_use]
pub fn vignette() -> GrayImage {
    let [width, height] = [160_u32, 120];
    let value = |i: u32| {
        let [x, y] = [i % width, i / width].map(|k| 4.0 * f64::from(k) + 1.5);
        let r2 = ((x - 319.5).powi(2) + (y - 239.5).powi(2)) / 400.0_f64.powi(2);
        (1.0 / (1.0 + r2).powi(2)) as f32
    };
    GrayImage { size_px: [width, height], values: (0..width * height).map(value).collect() }
}

/// A periodic texture with a 1/f spectrum of brightness and weaker variations of hue.
fn texture(side: u32, seed: u64) -> Texture {
    let brightness = fractal(side, 3, side / 2, 1.0, seed);
    let hue = fractal(side, 3, side / 8, 1.0, !seed);
    let byte = |value: f32| (118.0 + 42.0 * value).clamp(2.0, 253.0) as u8;
    let pixels = brightness
        .par_iter()
        .zip(&hue)
        .flat_map_iter(|(&b, &h)| [byte(b + 0.3 * h), byte(b), byte(b - 0.3 * h), 255]);
    Texture { size_px: [side, side], rgba8: pixels.collect(), encoding: Encoding::Srgb }
}

/// Periodic fractal noise with mean 0 and standard deviation 1: octaves of value noise with `coarsest` to
/// `finest` periods per side, each `persistence` times as strong as the one before.
fn fractal(side: u32, coarsest: u32, finest: u32, persistence: f64, seed: u64) -> Vec<f32> {
    let mut sum = vec![0.0_f32; (side * side) as usize];
    let (mut periods, mut amplitude) = (coarsest.max(1), 1.0_f64);
    while periods <= finest {
        let lattice: Vec<f32> = (0..periods * periods)
            .map(|i| (2.0 * unit(hash(seed, u64::from(periods) << 32 | u64::from(i))) - 1.0) as f32)
            .collect();
        let lattice_position = |k: u32| {
            let position = f64::from(k) * f64::from(periods) / f64::from(side);
            let t = position.fract();
            (position as u32 % periods, (position as u32 + 1) % periods, (t * t * (3.0 - 2.0 * t)) as f32)
        };
        sum.par_chunks_exact_mut(side as usize).enumerate().for_each(|(row, values)| {
            let (y0, y1, ty) = lattice_position(row as u32);
            for (column, value) in values.iter_mut().enumerate() {
                let (x0, x1, tx) = lattice_position(column as u32);
                let interpolated = |y: u32| {
                    let (a, b) = (lattice[(y * periods + x0) as usize], lattice[(y * periods + x1) as usize]);
                    a + tx * (b - a)
                };
                let (top, bottom) = (interpolated(y0), interpolated(y1));
                *value += amplitude as f32 * (top + ty * (bottom - top));
            }
        });
        periods *= 2;
        amplitude *= persistence;
    }
    let count = f64::from(side * side);
    let mean = sum.iter().map(|v| f64::from(*v)).sum::<f64>() / count;
    let variance = sum.iter().map(|v| (f64::from(*v) - mean).powi(2)).sum::<f64>() / count;
    let scale = 1.0 / variance.sqrt().max(1e-12);
    sum.iter().map(|v| ((f64::from(*v) - mean) * scale) as f32).collect()
}

/// Finaliser of SplitMix64 (Steele, Lea & Flood 2014) over both words.
pub(crate) fn hash(seed: u64, counter: u64) -> u64 {
    let mut z =
        seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(counter.wrapping_mul(0xd1b5_4a32_d192_ed03));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A number in [0, 1) from random bits.
fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_periodic_and_has_the_given_spectrum() {
        let side = 128;
        let noise = fractal(side, 2, 32, 1.0, 7);
        assert_eq!(noise, fractal(side, 2, 32, 1.0, 7));
        let value = |x: u32, y: u32| f64::from(noise[(y % side * side + x % side) as usize]);
        // The mean square difference at a lag grows with the lag, up to about 2 beyond the longest period.
        let structure = |lag: u32| {
            (0..side * side)
                .map(|i| (value(i % side + lag, i / side) - value(i % side, i / side)).powi(2))
                .sum::<f64>()
                / f64::from(side * side)
        };
        let seam =
            (0..side).map(|y| (value(0, y) - value(side - 1, y)).powi(2)).sum::<f64>() / f64::from(side);
        assert!(seam < 2.0 * structure(1), "{seam} {}", structure(1));
        let [one, four, sixteen] = [1, 4, 16].map(structure);
        assert!(
            one < 0.5 * four && four < sixteen && (1.0..3.0).contains(&structure(60)),
            "{one} {four} {sixteen}"
        );
    }

    #[test]
    fn houses_stand_on_the_hills() {
        let world = World::new(5);
        let scene = world.town_on_hills(120.0, 10.0).expect("a terrain");
        let (terrain, houses) = (scene.terrain.expect("hills"), &scene.meshes[0]);
        assert_eq!(houses.shape.indices.len() % 30, 0);
        let mut above = 0;
        for corners in houses.shape.vertices.chunks_exact(20) {
            // The roof is the first face.
            let roof = DVec3::from_array(corners[0].position_m.map(f64::from));
            let origin = DVec3::new(roof.x, roof.y, -500.0);
            let ground =
                terrain.intersect(origin, DVec3::Z, f64::INFINITY).expect("ground under every house").t
                    - 500.0;
            above += u32::from(roof.z < ground);
            assert!(
                corners.iter().any(|c| f64::from(c.position_m[2]) > ground),
                "the walls reach the ground"
            );
        }
        assert_eq!(above as usize, houses.shape.vertices.len() / 20, "every roof is above ground");
    }
}
