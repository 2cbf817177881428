//! A shadow map of the terrain that holds triangles instead of depths: exact at every point.
//!
//! A plane across the sun's rays is divided into texels. A ray to the sun can only meet triangles whose projections
//! meet its own texel. If it begins on the ground, the first one that it meets is entered from above, and so faces
//! away from the sun: only such triangles are listed. Where heights are missing a ray may enter the ground
//! through the hole; of terrains with voids all triangles are listed.
//!
//! Tiles of texels are made when they have been asked for a few times. Until then the ray is cast.

use std::sync::{
    OnceLock,
    atomic::{AtomicU32, Ordering},
};

use glam::{DVec2, DVec3, Vec2};

use super::{Aabb, Terrain, TerrainTriangle, intersect_triangle};

/// Texels along a side of a tile.
const TILE: u32 = 16;
/// Rays that are cast before a tile is made. Far, fine terrain is asked for few rays a tile: without them the first
/// frame over ten million heights has an ideal frame that takes 18 % longer.
const RAYS_A_TILE: u32 = 32;
/// Most texels that are looked at for a box.
const MOST_TEXELS: u64 = 2048;
/// Most rounding of positions within a tile in single precision, texels.
const ROUNDING: f64 = 1e-5;
/// Margin around projections, metres: more than rounding.
const HAIR_M: f64 = 1e-3;

/// Triangles of a terrain by where the sun sees them.
#[derive(Debug)]
pub struct SunMap {
    to_sun_ned: DVec3,
    /// Axes of the plane: a level one, and one upwards.
    axes_ned: [DVec3; 2],
    /// Corner of the plane, metres.
    first_m: DVec2,
    texel_m: DVec2,
    /// Along both axes.
    tiles: [u32; 2],
    /// Row by row.
    lists: Vec<TileLists>,
}

/// The lists of a tile, once they are made.
#[derive(Debug, Default)]
struct TileLists {
    asked: AtomicU32,
    made: OnceLock<Box<Lists>>,
}

/// Triangles by texel, the nearest to the sun first.
#[derive(Debug, Default)]
struct Lists {
    /// Where each texel's list begins, and the end; nothing if all lists are empty.
    starts: Vec<u32>,
    listed: Vec<Listed>,
}

/// A triangle in a list, and the rectangle around it, in texels from the tile's corner.
#[derive(Clone, Copy, Debug)]
struct Listed {
    low: Vec2,
    high: Vec2,
    triangle: TerrainTriangle,
}

/// A triangle as the sun sees it.
struct Seen {
    triangle: TerrainTriangle,
    corners_m: [DVec2; 3],
    /// Position towards the sun, of the nearest corner, metres.
    near_m: f64,
    faces_away: bool,
}

/// A rectangle of the plane, metres.
#[derive(Clone, Copy, Debug)]
struct Extent {
    low_m: DVec2,
    high_m: DVec2,
}

impl SunMap {
    /// Prepares for the sun in a direction (unit, NED, above the horizon).
    #[must_use]
    pub fn new(terrain: &Terrain, to_sun_ned: DVec3) -> Self {
        let away = DVec3::new(-to_sun_ned.x, -to_sun_ned.y, 0.0).try_normalize().unwrap_or(DVec3::X);
        let elevation_cos = to_sun_ned.truncate().length();
        let axes_ned = [DVec3::new(-away.y, away.x, 0.0), DVec3::NEG_Z * elevation_cos - to_sun_ned.z * away];
        let mut map = Self {
            to_sun_ned,
            axes_ned,
            first_m: DVec2::ZERO,
            texel_m: DVec2::ONE,
            tiles: [1, 1],
            lists: Vec::new(),
        };
        let size_m = terrain.bounds.max - terrain.bounds.min;
        let cell_m = [size_m.x / f64::from(terrain.cells[1]), size_m.y / f64::from(terrain.cells[0])];
        let cell_m = (cell_m[0] * cell_m[1]).sqrt();
        // The sun sees level cells foreshortened by the sine of its elevation, and slopes less so.
        map.texel_m = cell_m * DVec2::new(1.0, 0.25 * elevation_cos - to_sun_ned.z);
        let all = map.extent(&terrain.bounds);
        map.first_m = all.low_m;
        let count = (all.high_m - all.low_m) / (f64::from(TILE) * map.texel_m);
        map.tiles = count.to_array().map(|count| count.ceil().max(1.0) as u32);
        map.lists.resize_with(map.tiles[0] as usize * map.tiles[1] as usize, TileLists::default);
        map
    }

    /// Whether the terrain hides the sun from a point just above a triangle that faces it.
    #[must_use]
    pub fn hides(&self, terrain: &Terrain, point_ned_m: DVec3) -> bool {
        let at = (self.project(point_ned_m) - self.first_m) / self.texel_m;
        let [texel, tile] = self.texel_and_tile(at.max(DVec2::ZERO).as_uvec2().to_array());
        let within = (at - self.corner(tile)).as_vec2();
        let lists = &self.lists[tile];
        if lists.made.get().is_none() && lists.asked.fetch_add(1, Ordering::Relaxed) < RAYS_A_TILE {
            return terrain.blocks(point_ned_m, self.to_sun_ned);
        }
        let is_met = |listed: &Listed| {
            if !(listed.low.cmple(within) & within.cmple(listed.high)).all() {
                return false;
            }
            let corners_ned_m = terrain.corners_ned_m(listed.triangle);
            intersect_triangle(corners_ned_m, point_ned_m, self.to_sun_ned, f64::INFINITY).is_some()
        };
        self.lists_of(terrain, tile).of(texel).iter().any(is_met)
    }

    /// Whether the terrain leaves the sun on all triangles in a box that face it. False says nothing.
    #[must_use]
    pub fn is_lit_within(&self, terrain: &Terrain, bounds: &Aabb) -> bool {
        let [low, high] = self.texels(&self.extent(bounds));
        let count = |k: usize| u64::from(high[k] - low[k]) + 1;
        if count(0) * count(1) > MOST_TEXELS {
            return false;
        }
        let mut texels = (low[1]..=high[1]).flat_map(|y| (low[0]..=high[0]).map(move |x| [x, y]));
        texels.all(|at| {
            let [texel, tile] = self.texel_and_tile(at);
            self.lists_of(terrain, tile).of(texel).is_empty()
        })
    }

    /// Whether a thing in one box may keep the sun from a thing in another.
    #[must_use]
    pub fn may_shade(&self, thing: &Aabb, other: &Aabb) -> bool {
        let (thing_m, other_m) = (self.extent(thing), self.extent(other));
        thing_m.meets(&other_m) && thing.support(self.to_sun_ned) >= -other.support(-self.to_sun_ned)
    }

    fn project(&self, point_ned_m: DVec3) -> DVec2 {
        DVec2::from_array(self.axes_ned.map(|axis| axis.dot(point_ned_m)))
    }

    fn extent(&self, bounds: &Aabb) -> Extent {
        let low_m = DVec2::from_array(self.axes_ned.map(|axis| -bounds.support(-axis)));
        let high_m = DVec2::from_array(self.axes_ned.map(|axis| bounds.support(axis)));
        Extent { low_m: low_m - HAIR_M, high_m: high_m + HAIR_M }
    }

    /// First and last texel of a rectangle.
    fn texels(&self, extent: &Extent) -> [[u32; 2]; 2] {
        [extent.low_m, extent.high_m].map(|at_m| {
            let at = ((at_m - self.first_m) / self.texel_m).max(DVec2::ZERO).as_uvec2().to_array();
            [0, 1].map(|k| at[k].min(TILE * self.tiles[k] - 1))
        })
    }

    /// Number of a texel in its tile, and of the tile.
    fn texel_and_tile(&self, at: [u32; 2]) -> [usize; 2] {
        let at = [0, 1].map(|k| at[k].min(TILE * self.tiles[k] - 1));
        let [x, y] = at.map(|at| at / TILE);
        let texel = at[1] % TILE * TILE + at[0] % TILE;
        [texel as usize, y as usize * self.tiles[0] as usize + x as usize]
    }

    fn lists_of(&self, terrain: &Terrain, tile: usize) -> &Lists {
        self.lists[tile].made.get_or_init(|| Box::new(self.make_lists(terrain, tile)))
    }

    /// First texel of a tile.
    fn corner(&self, tile: usize) -> DVec2 {
        let across = self.tiles[0] as usize;
        f64::from(TILE) * DVec2::new((tile % across) as f64, (tile / across) as f64)
    }

    fn make_lists(&self, terrain: &Terrain, tile: usize) -> Lists {
        let low_m = self.first_m + self.corner(tile) * self.texel_m;
        let extent = Extent { low_m, high_m: low_m + f64::from(TILE) * self.texel_m };
        let has_voids = terrain.void_cells > 0;
        let mut seen: Vec<Seen> = terrain
            .triangles_within(|bounds| self.extent(bounds).meets(&extent))
            .map(|(triangle, corners_ned_m)| self.see(triangle, corners_ned_m))
            .filter(|seen| (has_voids || seen.faces_away) && seen.extent().meets(&extent))
            .collect();
        if seen.is_empty() {
            return Lists::default();
        }
        seen.sort_by(|a, b| b.near_m.total_cmp(&a.near_m));
        let mut pairs = Vec::new();
        for seen in &seen {
            let own = seen.extent();
            let [low, high] = [own.low_m, own.high_m].map(|at_m| (at_m - low_m) / self.texel_m);
            let [from, to] =
                [low, high].map(|at| at.clamp(DVec2::ZERO, DVec2::splat(f64::from(TILE - 1))).as_uvec2());
            let [low, high] = [(low - ROUNDING).as_vec2(), (high + ROUNDING).as_vec2()];
            let listed = Listed { low, high, triangle: seen.triangle };
            for y in from.y..=to.y {
                for x in from.x..=to.x {
                    let low_m = low_m + DVec2::new(x.into(), y.into()) * self.texel_m;
                    if seen.meets(&Extent { low_m, high_m: low_m + self.texel_m }) {
                        pairs.push((y * TILE + x, listed));
                    }
                }
            }
        }
        pairs.sort_by_key(|&(texel, _)| texel);
        let start = |texel| pairs.partition_point(|pair| pair.0 < texel) as u32;
        Lists {
            starts: (0..=TILE * TILE).map(start).collect(),
            listed: pairs.iter().map(|&(_, listed)| listed).collect(),
        }
    }

    fn see(&self, triangle: TerrainTriangle, corners_ned_m: [DVec3; 3]) -> Seen {
        let [a, b, c] = corners_ned_m;
        Seen {
            triangle,
            corners_m: corners_ned_m.map(|corner| self.project(corner)),
            near_m: [a, b, c].map(|corner| corner.dot(self.to_sun_ned)).into_iter().fold(f64::MIN, f64::max),
            // Edge-on counts as away.
            faces_away: (b - a).cross(c - a).normalize_or_zero().dot(self.to_sun_ned) < 1e-9,
        }
    }
}

impl Lists {
    fn of(&self, texel: usize) -> &[Listed] {
        match self.starts.get(texel..texel + 2) {
            Some(ends) => &self.listed[ends[0] as usize..ends[1] as usize],
            None => &[],
        }
    }
}

impl Seen {
    fn extent(&self) -> Extent {
        let [a, b, c] = self.corners_m;
        Extent { low_m: a.min(b).min(c) - HAIR_M, high_m: a.max(b).max(c) + HAIR_M }
    }

    /// False only if an edge has all of a rectangle on its outer side.
    fn meets(&self, texel: &Extent) -> bool {
        let [a, b, c] = self.corners_m;
        let turn = (b - a).perp_dot(c - a).signum();
        let half_m = 0.5 * (texel.high_m - texel.low_m);
        let middle_m = texel.low_m + half_m;
        [(a, b), (b, c), (c, a)].into_iter().all(|(from, to)| {
            let inwards = turn * (to - from).perp();
            let hair = HAIR_M * inwards.abs().element_sum();
            inwards.dot(middle_m - from) + inwards.abs().dot(half_m) >= -hair
        })
    }
}

impl Extent {
    fn meets(&self, other: &Self) -> bool {
        self.low_m.cmple(other.high_m).all() && other.low_m.cmple(self.high_m).all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Light;

    #[test]
    fn map_hides_what_rays_to_the_sun_do_not_reach() {
        let heights = |rough_m: f64, has_hole: bool| {
            let height = |k: u32| {
                let (i, j) = (f64::from(k % 150), f64::from(k / 150));
                let bumps = (f64::from(k) * 0.618_034).fract();
                30.0 * (0.05 * i + 0.5).sin() * (0.07 * j).cos() + rough_m * bumps
            };
            let mut heights: Vec<f64> = (0..150 * 150).map(height).collect();
            if has_hole {
                heights[60 * 150 + 40] = f64::NAN;
            }
            // A wall that throws a long shadow.
            (30..60).for_each(|i| heights[90 * 150 + i] += 60.0);
            heights
        };
        for (rough_m, azimuth_deg, elevation_deg, has_hole, least_known) in [
            (0.0, 250.0, 25.0, false, 0.3),
            (0.0, 20.0, 12.0, false, 0.1),
            (0.5, 135.0, 40.0, true, 0.0),
            (0.5, 135.0, 40.0, false, 0.5),
            (2.0, 300.0, 60.0, false, 0.3),
            (0.0, 77.0, 0.0, false, 0.0),
            (1.0, 0.0, 90.0, false, 0.8),
        ] {
            let terrain = Terrain::from_heights(150, 150, 4.0, &heights(rough_m, has_hole), None);
            let terrain = terrain.expect("terrain");
            let light = Light::new(f64::to_radians(azimuth_deg), f64::to_radians(elevation_deg), 0.8, 0.2);
            let map = SunMap::new(&terrain, light.to_sun_ned);
            let (mut hidden, mut known, mut all) = (0, 0, 0);
            for k in 0..40_000_u32 {
                let part = |step: f64| (f64::from(k) * step).fract();
                let top = DVec3::new(596.0 * (part(0.754_878) - 0.5), 596.0 * (part(0.569_84) - 0.5), -500.0);
                let Some(hit) = terrain.intersect(top, DVec3::Z, f64::INFINITY) else { continue };
                if hit.normal_ned.dot(light.to_sun_ned) <= 0.0 {
                    continue;
                }
                let point = top + hit.t * DVec3::Z;
                let from = point + 1e-6 * hit.normal_ned;
                let is_hidden = terrain.blocks(from, light.to_sun_ned);
                assert_eq!(
                    map.hides(&terrain, from),
                    is_hidden,
                    "{from}, sun at {azimuth_deg}, {elevation_deg}"
                );
                let around = Aabb { min: point - 2.0, max: point + 2.0 };
                let is_known = map.is_lit_within(&terrain, &around);
                assert!(!(is_known && is_hidden), "{from}, sun at {azimuth_deg}, {elevation_deg}");
                (hidden, known, all) = (hidden + u32::from(is_hidden), known + u32::from(is_known), all + 1);
            }
            let fraction = |count: u32| f64::from(count) / f64::from(all);
            eprintln!(
                "{elevation_deg} deg, {rough_m} m: {:.2} hidden, {:.2} known to be lit",
                fraction(hidden),
                fraction(known)
            );
            assert!(fraction(known) >= least_known, "{}", fraction(known));
        }
    }
}
