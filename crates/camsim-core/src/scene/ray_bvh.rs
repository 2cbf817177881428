//! Bounding volume hierarchy for ray queries.

use glam::{DMat3, DVec3};

use super::{
    Aabb,
    box4::{BeamBox, Box4, BoxRay, down},
    proximity_bvh::{median_split, union_of},
    ray_packet::RayPacket,
};

/// Flag in `holds` of an item; without it the entry is a node.
const ITEM: u32 = 1 << 31;
/// Most boxes on the stack: with up to 2^31 items, halves are split on every second level.
const MAX_WAITING: usize = 3 * 17 + 1;

/// Bounding volume hierarchy with four boxes per node, for the first intersection of a ray.
#[derive(Debug, Default)]
pub struct RayBvh {
    /// Centre, to which all coordinates are relative.
    middle: DVec3,
    /// Largest coordinate of a box, metres.
    extent_m: f64,
    nodes: Vec<RayBvhNode>,
}

#[derive(Debug)]
struct RayBvhNode {
    boxes: Box4,
    /// Contents of each box: the index of a node, or of an item with [`ITEM`] set.
    holds: [u32; 4],
}

impl RayBvh {
    /// Builds the tree over `boxes`, whose indices identify the items. Empty boxes are skipped.
    pub fn new(boxes: &[Aabb]) -> Self {
        let mut items: Vec<u32> =
            (0..boxes.len() as u32).filter(|&i| !boxes[i as usize].is_empty()).collect();
        if items.is_empty() {
            return Self::default();
        }
        let whole = union_of(boxes, &items);
        let is_finite = whole.min.is_finite() && whole.max.is_finite();
        let middle = if is_finite { whole.centre() } else { DVec3::ZERO };
        let extent_m = if is_finite { (whole.max - middle).max_element() } else { f64::INFINITY };
        let mut tree = Self { middle, extent_m, nodes: Vec::new() };
        tree.build(boxes, &mut items);
        tree
    }

    /// Splits into four by halving twice. Returns the index of the node.
    fn build(&mut self, boxes: &[Aabb], items: &mut [u32]) -> u32 {
        let here = self.nodes.len();
        self.nodes.push(RayBvhNode { boxes: Box4::EMPTY, holds: [0; 4] });
        let (left, right) = median_split(boxes, items);
        let ((a, b), (c, d)) = (median_split(boxes, left), median_split(boxes, right));
        for (lane, part) in [a, b, c, d].into_iter().enumerate() {
            let Some(&first) = part.first() else { continue };
            let bounds = union_of(boxes, part);
            let held = if part.len() == 1 { ITEM | first } else { self.build(boxes, part) };
            let node = &mut self.nodes[here];
            node.boxes.set(lane, &Aabb { min: bounds.min - self.middle, max: bounds.max - self.middle });
            node.holds[lane] = held;
        }
        here as u32
    }

    /// First intersection of a ray. `meet(item, limit)` returns the ray parameter and a result for an item
    /// that is hit before `limit`. A ray with numbers that are not finite tests all items.
    pub fn first<T>(
        &self,
        origin: DVec3,
        direction: DVec3,
        t_max: f64,
        meet: impl Fn(u32, f64) -> Option<(f64, T)>,
    ) -> Option<(f64, T)> {
        if self.nodes.is_empty() {
            return None;
        }
        let length = direction.length();
        if !(length.is_normal() && origin.is_finite()) {
            return self.first_of_all(t_max, meet);
        }
        let ray = BoxRay::new(origin - self.middle, direction / length, self.extent_m);
        // Rounded up to the next single-precision number.
        let metres = |t: f64| -down(-t * length);
        let (mut limit, mut limit_m) = (t_max, metres(t_max));
        let mut best: Option<(f64, T)> = None;
        let mut waiting = [(0.0_f32, 0_u32); MAX_WAITING];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (enter_m, held) = waiting[count];
            if enter_m > limit_m {
                continue;
            }
            if held & ITEM != 0 {
                if let Some(met) = meet(held & !ITEM, limit) {
                    (limit, limit_m) = (met.0, metres(met.0));
                    best = Some(met);
                }
                continue;
            }
            let RayBvhNode { boxes, holds } = &self.nodes[held as usize];
            let (enter, mut is_met) = boxes.enter(&ray, limit_m);
            let first = count;
            while is_met != 0 {
                let lane = is_met.trailing_zeros() as usize;
                is_met &= is_met - 1;
                // The nearest box is pushed last, so it is popped first.
                let mut slot = count;
                while slot > first && waiting[slot - 1].0 < enter[lane] {
                    waiting[slot] = waiting[slot - 1];
                    slot -= 1;
                }
                waiting[slot] = (enter[lane], holds[lane]);
                count += 1;
            }
        }
        best
    }

    /// Items in boxes that are accepted, as are those around them, in no particular order.
    pub fn items_in(&self, accept: impl Fn(&Aabb) -> bool) -> Vec<u32> {
        let mut found = Vec::new();
        let mut waiting: Vec<u32> = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(at) = waiting.pop() {
            let RayBvhNode { boxes, holds } = &self.nodes[at as usize];
            for (lane, &held) in holds.iter().enumerate() {
                let Aabb { min, max } = boxes.get(lane);
                let bounds = Aabb { min: min + self.middle, max: max + self.middle };
                // Lanes without a box hold nothing.
                if bounds.is_empty() || !accept(&bounds) {
                    continue;
                }
                if held & ITEM == 0 { waiting.push(held) } else { found.push(held & !ITEM) }
            }
        }
        found
    }

    /// Visits the items that rays of a packet may meet first, approximately front to back. The boxes have axes of
    /// their own: `x = ned_from_own own + origin`.
    pub fn meet_packet(
        &self,
        packet: &mut RayPacket,
        (ned_from_own, origin_ned_m): (DMat3, DVec3),
        meet: &mut dyn FnMut(u32, &mut RayPacket),
    ) {
        if self.nodes.is_empty() {
            return;
        }
        let beam = packet.beam().in_axes(ned_from_own, origin_ned_m);
        let beam = BeamBox::new(&beam, self.middle, self.extent_m);
        let mut limit_m = -down(-packet.farthest_m());
        let mut waiting = [(f32::NEG_INFINITY, 0_u32); MAX_WAITING];
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (near_m, held) = waiting[count];
            if near_m > limit_m {
                continue;
            }
            if held & ITEM != 0 {
                meet(held & !ITEM, packet);
                limit_m = -down(-packet.farthest_m());
                continue;
            }
            let RayBvhNode { boxes, holds } = &self.nodes[held as usize];
            let (near, mut is_met) = boxes.meet(&beam, limit_m);
            let first = count;
            while is_met != 0 {
                let lane = is_met.trailing_zeros() as usize;
                is_met &= is_met - 1;
                // The nearest box is pushed last, so it is popped first.
                let mut slot = count;
                while slot > first && waiting[slot - 1].0 < near[lane] {
                    waiting[slot] = waiting[slot - 1];
                    slot -= 1;
                }
                waiting[slot] = (near[lane], holds[lane]);
                count += 1;
            }
        }
    }

    /// First intersection by testing all items.
    fn first_of_all<T>(&self, t_max: f64, meet: impl Fn(u32, f64) -> Option<(f64, T)>) -> Option<(f64, T)> {
        let is_there =
            |node: &RayBvhNode, lane: usize| node.holds[lane] & ITEM != 0 && !node.boxes.get(lane).is_empty();
        let items = self.nodes.iter().flat_map(|node| {
            (0..4).filter(|&lane| is_there(node, lane)).map(|lane| node.holds[lane] & !ITEM)
        });
        items.fold(None, |best: Option<(f64, T)>, item| {
            let limit = best.as_ref().map_or(t_max, |(t, _)| *t);
            meet(item, limit).or(best)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::terrain::inverse;

    #[test]
    fn first_hit_matches_a_search_of_all_items() {
        let part = |k: u32, step: f64| (f64::from(k) * step).fract();
        // Also far from the origin, and with flat or coincident boxes.
        for (count, away_m) in
            [(0, 0.0), (1, 10.0), (2, 0.0), (4, 0.0), (5, -300.0), (300, 0.0), (1000, 6.4e6)]
        {
            let bounds = |k: u32| {
                let k = k - k % 7 / 6;
                let min =
                    away_m + 40.0 * DVec3::new(part(k, 0.618_034), part(k, 0.754_878), part(k, 0.569_840));
                let size = 2.0
                    * DVec3::new(
                        part(k, 0.31),
                        part(k, 0.47),
                        if k.is_multiple_of(5) { 0.0 } else { part(k, 0.83) },
                    );
                if k % 11 == 3 { Aabb::EMPTY } else { Aabb { min, max: min + size } }
            };
            let boxes: Vec<Aabb> = (0..count).map(bounds).collect();
            let tree = RayBvh::new(&boxes);
            let (mut met, mut asked) = (0, 0);
            for k in 0..400 {
                let angle = 0.1 * f64::from(k);
                let origin = away_m
                    + DVec3::new(20.0 + 30.0 * angle.cos(), 20.0 + 30.0 * angle.sin(), 0.1 * f64::from(k));
                let aslant = DVec3::new(-angle.cos(), -angle.sin(), 0.3 * (0.7 * f64::from(k)).sin());
                let along = DVec3::new(-angle.cos().signum(), 0.0, 0.0);
                let direction = [aslant, along, 1e-6 * aslant, 3e5 * aslant, aslant][k as usize % 5];
                let t_max = if k % 3 == 0 { f64::INFINITY } else { 45.0 / direction.length() };
                let enter = |i: u32, limit: f64| {
                    boxes[i as usize].enter(origin, inverse(direction), limit).map(|t| (t, i))
                };
                let all = (0..count).filter_map(|i| enter(i, t_max)).min_by(|a, b| a.0.total_cmp(&b.0));
                let asked_now = std::cell::Cell::new(0);
                let first = tree.first(origin, direction, t_max, |i, limit| {
                    asked_now.set(asked_now.get() + 1);
                    enter(i, limit)
                });
                assert_eq!(first.map(|hit| hit.0), all.map(|hit| hit.0), "{count} boxes, ray {k}");
                met += u32::from(first.is_some());
                asked += asked_now.get();
            }
            assert!(count < 300 || met > 40, "{met}");
            assert!(asked <= 400 * count.min(20), "{count}: {asked}");
        }
    }

    #[test]
    fn non_finite_rays_test_all_items() {
        let boxes: Vec<Aabb> = (0..23)
            .map(|k| Aabb { min: DVec3::splat(f64::from(k)), max: DVec3::splat(f64::from(k) + 0.5) })
            .collect();
        let tree = RayBvh::new(&boxes);
        for (origin, direction) in [
            (DVec3::NAN, DVec3::NAN),
            (DVec3::ONE, DVec3::NAN),
            (DVec3::INFINITY, DVec3::X),
            (DVec3::ONE, DVec3::ZERO),
        ] {
            let meet =
                |i: u32, limit: f64| Some((f64::from((7 * i + 5) % 23), i)).filter(|(t, _)| *t < limit);
            assert_eq!(
                tree.first(origin, direction, f64::INFINITY, meet),
                Some((0.0, 19)),
                "{origin} {direction}"
            );
            assert_eq!(tree.first(origin, direction, 0.0, meet), None);
        }
    }
}
