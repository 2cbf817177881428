//! How much pictures change from one place to the next: what resampling and too few blur samples cost, in grey levels, depends on it.

use std::sync::Arc;

use glam::{DVec2, DVec3};

use crate::scene::{Encoding, Mesh, Scene, Terrain, Texture};

/// Side of the pieces of a texture that are looked at, and how many of them along each side.
const PIECE_PX: u32 = 256;
const PIECES: u32 = 2;

/// Grain of every surface of a scene, found once.
#[derive(Debug, Default)]
pub(super) struct SceneGrain {
    terrain: Option<Grain>,
    meshes: Vec<Grain>,
}

/// Grain of one surface.
#[derive(Clone, Debug)]
pub(super) struct Grain {
    texels_per_m: f64,
    /// RMS difference of neighbours in linear light, 0 to 1, when 2^level x 2^level texels are one.
    steps: Vec<f64>,
}

impl SceneGrain {
    pub fn new(scene: &Scene) -> Self {
        let mut known: Vec<(Arc<Texture>, Vec<f64>)> = Vec::new();
        let mut steps_of = |texture: &Arc<Texture>| {
            if let Some((_, steps)) = known.iter().find(|(seen, _)| Arc::ptr_eq(seen, texture)) {
                return steps.clone();
            }
            let steps = steps(texture);
            known.push((texture.clone(), steps.clone()));
            steps
        };
        let terrain =
            scene.terrain.as_ref().map(|terrain| Grain { texels_per_m: terrain_texels_per_m(terrain), steps: steps_of(&terrain.texture) });
        let meshes =
            scene.meshes.iter().map(|mesh| Grain { texels_per_m: mesh_texels_per_m(mesh), steps: steps_of(&mesh.texture) }).collect();
        Self { terrain, meshes }
    }

    /// RMS difference of two neighbouring pixels of `px_m` metres on surface 0 (terrain) or 1 + i (mesh i).
    pub fn step(&self, surface: usize, px_m: f64) -> f64 {
        let grain = match surface.checked_sub(1) {
            None => self.terrain.as_ref(),
            Some(i) => self.meshes.get(i),
        };
        grain.map_or(0.0, |grain| grain.step(px_m))
    }
}

impl Grain {
    fn step(&self, px_m: f64) -> f64 {
        let (Some(&first), Some(&last)) = (self.steps.first(), self.steps.last()) else { return 0.0 };
        let level = (px_m * self.texels_per_m).log2();
        if !level.is_finite() {
            return 0.0;
        }
        // Between two texels the picture is a ramp; beyond the coarsest level it has no more to show.
        if level <= 0.0 {
            return first * level.exp2();
        }
        let below = level as usize;
        match (self.steps.get(below), self.steps.get(below + 1)) {
            (Some(a), Some(b)) => a + (b - a) * (level - below as f64),
            _ => last,
        }
    }
}

/// RMS differences of neighbours at each level, over a few pieces of the texture.
fn steps(texture: &Texture) -> Vec<f64> {
    let [width, height] = texture.size_px;
    let side = [width.min(PIECE_PX), height.min(PIECE_PX)];
    let mut sums: Vec<[f64; 2]> = Vec::new();
    for piece in 0..PIECES * PIECES {
        let first = |of: u32, side: u32, k: u32| (of - side) * k / (PIECES - 1).max(1);
        let [x0, y0] = [first(width, side[0], piece % PIECES), first(height, side[1], piece / PIECES)];
        let rows = (y0..y0 + side[1]).map(|y| 4 * (y as usize * width as usize + x0 as usize));
        let rgba8 = rows.flat_map(|at| texture.rgba8[at..at + 4 * side[0] as usize].iter().copied()).collect();
        let cut = Texture { size_px: side, rgba8, encoding: texture.encoding };
        let levels = cut.mips().into_iter().map(|level| (level.size_px, level.rgba8));
        for (level, (size_px, rgba8)) in std::iter::once((side, cut.rgba8.clone())).chain(levels).enumerate() {
            if sums.len() <= level {
                sums.push([0.0; 2]);
            }
            let [sum, count] = squares(size_px, &rgba8, texture.encoding);
            sums[level][0] += sum;
            sums[level][1] += count;
        }
    }
    sums.into_iter().filter(|[_, count]| *count > 0.0).map(|[sum, count]| (sum / count).sqrt()).collect()
}

/// Sum of the squared differences between neighbours in x and in y, and their number.
fn squares([width, height]: [u32; 2], rgba8: &[u8], encoding: Encoding) -> [f64; 2] {
    let decode = encoding.decode_table();
    let linear = |x: u32, y: u32, c: usize| f64::from(decode[rgba8[4 * (y * width + x) as usize + c] as usize]);
    let (mut sum, mut count) = (0.0, 0.0);
    for y in 0..height.saturating_sub(1) {
        for x in 0..width.saturating_sub(1) {
            for c in 0..3 {
                let here = linear(x, y, c);
                sum += (linear(x + 1, y, c) - here).powi(2) + (linear(x, y + 1, c) - here).powi(2);
                count += 2.0;
            }
        }
    }
    [sum, count]
}

/// From the areas of the first triangle with both, on the ground and in the picture.
fn texels_per_m(corners: [(DVec3, [f32; 2]); 3], texture: &Texture) -> Option<f64> {
    let [a, b, c] = corners;
    let size = DVec2::new(f64::from(texture.size_px[0]), f64::from(texture.size_px[1]));
    let texels = |p: [f32; 2]| DVec2::new(f64::from(p[0]), f64::from(p[1])) * size;
    let ground_m2 = (b.0 - a.0).cross(c.0 - a.0).length();
    let picture = (texels(b.1) - texels(a.1)).perp_dot(texels(c.1) - texels(a.1)).abs();
    let ratio = (picture / ground_m2).sqrt();
    (ratio.is_finite() && ratio > 0.0).then_some(ratio)
}

fn mesh_texels_per_m(mesh: &Mesh) -> f64 {
    let corner = |v: u32| (mesh.position_ned_m(v), mesh.vertices[v as usize].uv);
    let mut found = mesh.indices.chunks_exact(3).filter_map(|t| texels_per_m([corner(t[0]), corner(t[1]), corner(t[2])], &mesh.texture));
    found.next().unwrap_or(0.0)
}

fn terrain_texels_per_m(terrain: &Terrain) -> f64 {
    let cells = terrain.chunks.iter().enumerate().filter_map(|(i, chunk)| {
        let corner = |i_: u32, j: u32| {
            let uv = terrain.vertices[(chunk.first_vertex + j * (chunk.cells[0] + 1) + i_) as usize].uv;
            (terrain.position_ned_m(i as u32, i_, j), uv)
        };
        texels_per_m([corner(0, 0), corner(1, 0), corner(0, 1)], &terrain.texture)
    });
    let (sum, count) = cells.fold((0.0, 0.0), |(sum, count), found| (sum + found, count + 1.0));
    if count > 0.0 { sum / count } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chequer_vanishes_at_the_next_level_and_a_ramp_doubles() {
        let picture = |value: &dyn Fn(u32, u32) -> u8| {
            let rgba8 = (0..64 * 64).flat_map(|i| [value(i % 64, i / 64); 3].into_iter().chain([255])).collect();
            Arc::new(Texture { size_px: [64, 64], rgba8, encoding: Encoding::Linear })
        };
        let grain = |texture| {
            // One texel a metre.
            SceneGrain::new(&Scene { meshes: vec![Mesh::level_picture(texture, DVec3::ZERO, 64.0)], ..Scene::default() })
        };
        let chequer = grain(picture(&|x, y| if (x + y) % 2 == 0 { 255 } else { 0 }));
        assert!((chequer.step(1, 1.0) - 1.0).abs() < 1e-9 && chequer.step(1, 2.0) < 1e-2 && (chequer.step(1, 0.25) - 0.25).abs() < 1e-9);
        let ramp = grain(picture(&|x, _| (2 * x) as u8));
        // Half of the differences are along the ramp.
        for (px_m, step) in [(0.5, 1.0), (1.0, 2.0), (2.0, 4.0), (4.0, 8.0)] {
            let expected = step / 255.0 * 0.5_f64.sqrt();
            assert!((ramp.step(1, px_m) / expected - 1.0).abs() < 0.02, "{px_m}: {} {expected}", ramp.step(1, px_m));
        }
        assert_eq!(ramp.step(0, 1.0), 0.0);
    }
}
