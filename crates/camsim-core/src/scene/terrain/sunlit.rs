//! Parts of the terrain on which the sun shines everywhere, so that no ray has to find out.
//!
//! Let u be the horizontal distance from the sun's side to the other, and g = cos(e) up + sin(e) u at the sun's
//! elevation e. g is constant along the sun's rays, so a point is in the shadow of those before it (with
//! smaller u) in its vertical plane towards the sun that have a greater g. Along that plane g rises over
//! triangles that face the sun. A block of cells is therefore lit as a whole if all its triangles face the
//! sun and, of the strip of blocks before it, all that reach its lowest g are joined to it by blocks that face
//! the sun only. That is a sufficient condition; blocks that fail are left to rays.

use std::sync::{
    OnceLock,
    atomic::{AtomicU8, Ordering},
};

use glam::DVec3;

use super::{
    Aabb, CHUNK_CELLS, Terrain, cell_triangles,
    tree::{BLOCK_CELLS, BlockNode},
};

/// Blocks along a side of a chunk.
const BLOCKS: u32 = CHUNK_CELLS / BLOCK_CELLS;
/// Rounding of g, metres.
const HAIR_M: f64 = 1e-6;

const UNKNOWN: u8 = 0;
const LIT: u8 = 1;
const LEFT_TO_RAYS: u8 = 2;

/// Which blocks of a terrain the sun shines on everywhere. Blocks are looked at when they are first asked for.
#[derive(Debug)]
pub struct SunlitBlocks {
    to_sun_ned: DVec3,
    /// Horizontal, away from the sun, and across that.
    away: DVec3,
    across: DVec3,
    /// Gradient of g.
    rise: DVec3,
    /// Blocks by chunk.
    facts: Vec<OnceLock<Box<[BlockFacts]>>>,
    /// By chunk, then by block.
    states: Vec<AtomicU8>,
}

/// What the shadow on and of a block depends on.
#[derive(Clone, Copy, Debug)]
struct BlockFacts {
    /// Least and greatest g, metres.
    least_m: f64,
    most_m: f64,
    /// Whether all of its triangles face the sun, and none is missing.
    faces_sun: bool,
}

/// A box by its extent away from the sun and across.
struct Strip {
    away_m: [f64; 2],
    across_m: [f64; 2],
}

impl SunlitBlocks {
    /// Prepares for the sun in a direction (unit, NED, above the horizon).
    #[must_use]
    pub fn new(terrain: &Terrain, to_sun_ned: DVec3) -> Self {
        let away = DVec3::new(-to_sun_ned.x, -to_sun_ned.y, 0.0).try_normalize().unwrap_or(DVec3::X);
        let elevation_cos = to_sun_ned.truncate().length();
        let count = terrain.chunks.len();
        Self {
            to_sun_ned,
            away,
            across: DVec3::new(-away.y, away.x, 0.0),
            rise: DVec3::NEG_Z * elevation_cos - to_sun_ned.z * away,
            facts: (0..count).map(|_| OnceLock::new()).collect(),
            states: (0..count * (BLOCKS * BLOCKS) as usize).map(|_| AtomicU8::new(UNKNOWN)).collect(),
        }
    }

    /// Whether the terrain leaves the sun on all of the block of a cell of a chunk. False says nothing.
    #[must_use]
    pub fn is_lit(&self, terrain: &Terrain, chunk: u32, cell: [u32; 2]) -> bool {
        let block = cell.map(|at| at / BLOCK_CELLS);
        let state = &self.states[(chunk * BLOCKS * BLOCKS + block[1] * BLOCKS + block[0]) as usize];
        let known = state.load(Ordering::Relaxed);
        if known != UNKNOWN {
            return known == LIT;
        }
        let columns = terrain.chunk_grid[0];
        let at = [chunk % columns * BLOCKS + block[0], chunk / columns * BLOCKS + block[1]];
        let is_lit = self.finds_lit(terrain, at);
        state.store(if is_lit { LIT } else { LEFT_TO_RAYS }, Ordering::Relaxed);
        is_lit
    }

    fn finds_lit(&self, terrain: &Terrain, at: [u32; 2]) -> bool {
        let own = self.facts_of(terrain, at);
        if !own.faces_sun {
            return false;
        }
        let strip = self.strip(&terrain.tree.bounds(BlockNode { level: 0, at }));
        // Blocks that reach the lowest g must face the sun, and so must all from there to here.
        let mut from_m = strip.away_m[0];
        let has_hidden_sun = self.any_before(terrain, &strip, |node, bounds| {
            if bounds.support(self.rise) < own.least_m - HAIR_M {
                return Look::Past;
            }
            if node.level > 0 {
                return Look::Into;
            }
            let facts = self.facts_of(terrain, node.at);
            if facts.most_m < own.least_m - HAIR_M {
                return Look::Past;
            }
            from_m = from_m.min(self.strip(bounds).away_m[0]);
            if facts.faces_sun { Look::Past } else { Look::Found }
        });
        !has_hidden_sun
            && !self.any_before(terrain, &strip, |node, bounds| {
                if self.strip(bounds).away_m[1] < from_m {
                    return Look::Past;
                }
                match node.level {
                    0 if self.facts_of(terrain, node.at).faces_sun => Look::Past,
                    0 => Look::Found,
                    _ => Look::Into,
                }
            })
    }

    /// Whether a block in or before a strip, towards the sun, is found.
    fn any_before(
        &self,
        terrain: &Terrain,
        strip: &Strip,
        mut look: impl FnMut(BlockNode, &Aabb) -> Look,
    ) -> bool {
        let mut stack = vec![terrain.tree.root()];
        while let Some(node) = stack.pop() {
            let bounds = terrain.tree.bounds(node);
            if bounds.is_empty() || !self.strip(&bounds).may_shade(strip) {
                continue;
            }
            match look(node, &bounds) {
                Look::Past => {}
                Look::Into => stack.extend(terrain.tree.children(node)),
                Look::Found => return true,
            }
        }
        false
    }

    fn strip(&self, bounds: &Aabb) -> Strip {
        let extent = |axis: DVec3| [-bounds.support(-axis), bounds.support(axis)];
        Strip { away_m: extent(self.away), across_m: extent(self.across) }
    }

    /// Facts of a block of the grid.
    fn facts_of(&self, terrain: &Terrain, at: [u32; 2]) -> BlockFacts {
        let [column, row] = at.map(|n| n / BLOCKS);
        let chunk = row * terrain.chunk_grid[0] + column;
        let facts = self.facts[chunk as usize].get_or_init(|| {
            let block = |k: u32| self.find_facts(terrain, chunk, [k % BLOCKS, k / BLOCKS]);
            (0..BLOCKS * BLOCKS).map(block).collect()
        });
        facts[(at[1] % BLOCKS * BLOCKS + at[0] % BLOCKS) as usize]
    }

    fn find_facts(&self, terrain: &Terrain, chunk: u32, block: [u32; 2]) -> BlockFacts {
        let cells = terrain.chunks[chunk as usize].cells;
        let mut facts = BlockFacts { least_m: f64::INFINITY, most_m: f64::NEG_INFINITY, faces_sun: true };
        let [columns, rows] = [0, 1].map(|k: usize| {
            let first = block[k] * BLOCK_CELLS;
            first..(first + BLOCK_CELLS).min(cells[k])
        });
        for cell in rows.flat_map(|j| columns.clone().map(move |i| [i, j])) {
            for corners in cell_triangles(cell) {
                let [a, b, c] = corners.map(|[i, j]| terrain.position_ned_m(chunk, i, j));
                for corner in [a, b, c].into_iter().filter(|corner| corner.is_finite()) {
                    let g_m = self.rise.dot(corner);
                    facts.least_m = facts.least_m.min(g_m);
                    facts.most_m = facts.most_m.max(g_m);
                }
                // False for a void.
                facts.faces_sun &= (b - a).cross(c - a).dot(self.to_sun_ned) > HAIR_M;
            }
        }
        facts
    }
}

/// What to do with a node of the tree.
enum Look {
    Past,
    Into,
    Found,
}

impl Strip {
    /// Whether it is beside or before another one, towards the sun.
    fn may_shade(&self, other: &Self) -> bool {
        self.away_m[0] <= other.away_m[1]
            && self.across_m[0] <= other.across_m[1]
            && other.across_m[0] <= self.across_m[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Light;

    #[test]
    fn no_ray_from_a_lit_block_meets_the_terrain() {
        let heights = |rough_m: f64| {
            let height = |k: u32| {
                let (i, j) = (f64::from(k % 150), f64::from(k / 150));
                let bumps = (f64::from(k) * 0.618_034).fract();
                30.0 * (0.05 * i + 0.5).sin() * (0.07 * j).cos() + rough_m * bumps
            };
            let mut heights: Vec<f64> = (0..150 * 150).map(height).collect();
            // A hole, and a wall that throws a long shadow.
            heights[60 * 150 + 40] = f64::NAN;
            (30..60).for_each(|i| heights[90 * 150 + i] += 60.0);
            heights
        };
        for (rough_m, azimuth_deg, elevation_deg, least_fraction) in [
            (0.0, 250.0, 25.0, 0.3),
            (0.0, 20.0, 12.0, 0.1),
            (0.5, 135.0, 40.0, 0.5),
            (2.0, 300.0, 60.0, 0.3),
            (0.0, 77.0, 0.0, 0.0),
            (1.0, 0.0, 90.0, 0.8),
        ] {
            let terrain = Terrain::from_heights(150, 150, 4.0, &heights(rough_m), None).expect("terrain");
            let light = Light::new(f64::to_radians(azimuth_deg), f64::to_radians(elevation_deg), 0.8, 0.2);
            let blocks = SunlitBlocks::new(&terrain, light.to_sun_ned);
            let (mut lit, mut open, mut all) = (0, 0, 0);
            for k in 0..40_000_u32 {
                let part = |step: f64| (f64::from(k) * step).fract();
                let top = DVec3::new(596.0 * (part(0.754_878) - 0.5), 596.0 * (part(0.569_84) - 0.5), -500.0);
                let Some(hit) = terrain.intersect(top, DVec3::Z, f64::INFINITY) else { continue };
                let from = top + hit.t * DVec3::Z + 1e-6 * hit.normal_ned;
                let is_open =
                    hit.normal_ned.dot(light.to_sun_ned) > 0.0 && !terrain.blocks(from, light.to_sun_ned);
                let is_lit = blocks.is_lit(&terrain, hit.chunk, hit.cell);
                assert!(is_open || !is_lit, "{from} with the sun at {azimuth_deg}, {elevation_deg}");
                (lit, open, all) = (lit + u32::from(is_lit), open + u32::from(is_open), all + 1);
            }
            let fraction = f64::from(lit) / f64::from(all);
            eprintln!(
                "{elevation_deg} deg, {rough_m} m: {fraction:.2} known, {:.2} lit",
                f64::from(open) / f64::from(all)
            );
            assert!(fraction >= least_fraction, "{fraction}");
        }
    }
}
