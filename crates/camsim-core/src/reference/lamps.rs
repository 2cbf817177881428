//! Where lamps may be seen that are small in the picture. A pixel's first samples may all miss one, agree on what is
//! beside it, and stop there; such pixels take all their samples.

use glam::{DVec2, DVec3};

use super::FrameView;
use crate::scene::Mesh;

/// Parts of a row's exposure at whose ends lamps are looked up.
const PARTS: u32 = 64;
/// Lamps with a larger radius, pixels, are met by the first samples.
const SMALL_PX: f64 = 12.0;
/// Factor on the distance of a pixel's corners and on a lamp's path between two instants: both are bent.
const ROOM: f64 = 1.2;
/// Pixels that are tested together first.
const BLOCK: u32 = 16;

/// A lamp from the camera at one instant.
struct Seen {
    /// Unit vector to its centre, in the camera's axes.
    direction: DVec3,
    /// Its radius over its distance.
    radius: f64,
    /// How far it goes until the next instant or comes from the one before, in the same unit.
    travel: f64,
}

/// The lamps that a row may see during its exposure.
pub(super) struct RowLamps<'a> {
    view: &'a FrameView<'a>,
    y: u32,
    width: u32,
    seen: Vec<Seen>,
    /// Number of the last block, and what it may see.
    block: (Option<u32>, Vec<usize>),
}

impl<'a> RowLamps<'a> {
    pub(super) fn new(view: &'a FrameView<'a>, y: u32, width: u32) -> Self {
        let reference = view.reference;
        let lamps = reference.scene.lamps.iter().map(|&mesh| &reference.sequence.scene.meshes[mesh]);
        let ends = [[0, y], [width.saturating_sub(1), y]];
        let [first, last] = ends.map(|pixel| [view.mid_s(pixel), 0.5 * view.exposure_s(pixel)]);
        let begin_s = (first[0] - first[1]).min(last[0] - last[1]);
        let span_s = (first[0] + first[1]).max(last[0] + last[1]) - begin_s;
        let parts = if span_s > 0.0 { PARTS } else { 0 };
        let instants_s: Vec<f64> =
            (0..=parts).map(|k| begin_s + span_s * f64::from(k) / f64::from(PARTS)).collect();
        let seen = lamps.flat_map(|mesh| of_lamp(view, mesh, &instants_s)).collect();
        Self { view, y, width, seen, block: (None, Vec::new()) }
    }

    /// Whether a pixel of the row may see a small lamp.
    pub(super) fn may_be_in(&mut self, x: u32) -> bool {
        if self.seen.is_empty() {
            return false;
        }
        let block = x / BLOCK;
        if self.block.0 != Some(block) {
            self.block = (Some(block), self.in_block(block));
        }
        if self.block.1.is_empty() {
            return false;
        }
        let Some((ray, half)) = self.pixel(x) else { return true };
        self.block.1.iter().any(|&i| {
            let seen = &self.seen[i];
            seen.radius < SMALL_PX * half && is_within(seen, ray, half)
        })
    }

    /// What any pixel of a block may see.
    fn in_block(&self, block: u32) -> Vec<usize> {
        let [first, last] = [block * BLOCK, ((block + 1) * BLOCK).min(self.width) - 1];
        let all = || (0..self.seen.len()).collect();
        let (Some(a), Some(b), Some(middle)) =
            (self.pixel(first), self.pixel(last), self.pixel((first + last) / 2))
        else {
            return all();
        };
        let reach = [a, b].map(|(ray, half)| ray.distance(middle.0) + half);
        let reach = ROOM * reach[0].max(reach[1]).max(middle.1);
        (0..self.seen.len()).filter(|&i| is_within(&self.seen[i], middle.0, reach)).collect()
    }

    /// Ray of a pixel, a unit vector, and the distance of its corners' rays from it.
    fn pixel(&self, x: u32) -> Option<(DVec3, f64)> {
        let ray = |offset_px: DVec2| Some(self.view.ray([x, self.y], offset_px)?.extend(1.0).normalize());
        let middle = ray(DVec2::ZERO)?;
        let corner = |offset_px| Some(ray(offset_px)?.distance(middle));
        let half = corner(DVec2::splat(0.5))?.max(corner(DVec2::splat(-0.5))?);
        Some((middle, ROOM * half))
    }
}

fn is_within(seen: &Seen, ray: DVec3, reach: f64) -> bool {
    seen.direction.distance(ray) <= reach + seen.radius + seen.travel
}

/// A lamp at instants of path time, seconds.
fn of_lamp(view: &FrameView<'_>, mesh: &Mesh, instants_s: &[f64]) -> Vec<Seen> {
    let path = &view.reference.sequence.path;
    let mut seen: Vec<Seen> = instants_s
        .iter()
        .map(|&t_s| {
            let bounds = mesh.bounds_between(t_s, t_s);
            let pose = path.pose(t_s);
            let position_m = pose.ned_from_camera.conjugate() * (bounds.centre() - pose.position_ned_m);
            let radius_m = 0.5 * (bounds.max - bounds.min).length();
            Seen {
                direction: position_m.normalize_or_zero(),
                radius: radius_m / position_m.length(),
                travel: 0.0,
            }
        })
        .collect();
    for k in 1..seen.len() {
        let travel = ROOM * 0.5 * seen[k].direction.distance(seen[k - 1].direction);
        seen[k].travel = travel;
        seen[k - 1].travel = seen[k - 1].travel.max(travel);
    }
    seen
}
