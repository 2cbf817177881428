//! Points of the scene that are tracked through all frames (`[output.tracks]`).

use glam::DVec3;

use crate::{
    row_time::{ImagePoint, WorldPoint},
    scene::Scene,
};

/// A point that is tracked.
#[derive(Clone, Debug, PartialEq)]
pub struct TrackPoint {
    /// Where it comes from: `terrain`, `vertices`, `board`, or the name of a table.
    pub source: String,
    /// Its name there, such as the number of a board's corner.
    pub name: String,
    /// North, east, down, metres; of what moves, at path time 0.
    pub position_ned_m: DVec3,
    /// Mesh of the scene that it moves with.
    pub moves_with: Option<usize>,
}

impl TrackPoint {
    /// The point at all times.
    #[must_use]
    pub fn world_point<'a>(&self, scene: &'a Scene) -> WorldPoint<'a> {
        let mesh = self.moves_with.and_then(|mesh| scene.meshes.get(mesh));
        WorldPoint::on(mesh.and_then(|mesh| mesh.motion.as_deref()), self.position_ned_m, 0.0)
    }
}

/// A point in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sighting {
    /// Index of the point.
    pub point: usize,
    /// Where and when the frame shows it; within the picture.
    pub seen: ImagePoint,
    /// Whether nothing is in front of it, by a ray from the camera at that instant.
    pub is_visible: bool,
}

/// At most `count` of `items`, evenly spaced in their order; the seed decides with which it begins.
#[must_use]
pub fn thinned<T>(items: Vec<T>, count: usize, seed: u64) -> Vec<T> {
    let all = items.len();
    if all <= count || count == 0 {
        return items;
    }
    // Item k of the result is item floor((k + shift) all / count), with shift in 0..1.
    let shift = unit(seed);
    let mut chosen = (0..count).map(|k| ((k as f64 + shift) * all as f64 / count as f64) as usize).peekable();
    let keep = |(i, item): (usize, T)| (chosen.next_if_eq(&i).is_some()).then_some(item);
    items.into_iter().enumerate().filter_map(keep).collect()
}

/// A number in 0..`below` that depends on the seed alone; 0 for `below` = 0.
#[must_use]
pub fn seeded_offset(seed: u64, below: u32) -> u32 {
    (unit(seed) * f64::from(below)) as u32
}

/// A number in 0..1 from a seed (splitmix64).
fn unit(seed: u64) -> f64 {
    let mut z = seed.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_is_even_and_follows_the_seed() {
        assert_eq!(thinned(vec![1, 2, 3], 3, 7), [1, 2, 3]);
        let all: Vec<usize> = (0..1000).collect();
        let of = |seed: u64| thinned(all.clone(), 30, seed);
        for seed in 0..50 {
            let some = of(seed);
            assert_eq!(some.len(), 30);
            let steps: Vec<usize> = some.windows(2).map(|pair| pair[1] - pair[0]).collect();
            assert!(steps.iter().all(|step| [33, 34].contains(step)), "{steps:?}");
            assert!(some[0] < 34 && some[29] >= 966, "{some:?}");
            assert_eq!(some, of(seed));
        }
        assert_ne!(of(1), of(2));
        assert!((0..100).all(|seed| seeded_offset(seed, 7) < 7) && seeded_offset(3, 0) == 0);
    }
}
