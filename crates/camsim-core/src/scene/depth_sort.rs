//! Depth sorting of blended triangles, from back to front.
//!
//! Distance alone does not give the order: the centre of a large pane may be nearer than a small pane in
//! front of its end. Of two triangles that overlap in the image and do not intersect, one lies on a single
//! side of the other's plane, and that decides which is behind (Newell, Newell & Sancha 1972). If neither
//! does, the depths at the centre of their overlap decide. The order of all overlapping pairs is then sorted
//! topologically. Where triangles intersect (`blend_split.rs` splits those of a scene) or overlap cyclically,
//! no order of whole triangles is right; in a cycle the distance of their centres decides.

use std::{cmp::Ordering, collections::BinaryHeap};

use glam::{DVec2, DVec3};

/// Most triangles that are sorted by overlapping pairs; larger sets are drawn by distance alone.
pub const MAX_TRIANGLES: usize = 1 << 14;
/// Most overlapping pairs; with more, the set is drawn by distance alone.
const MAX_PAIRS: usize = 1 << 20;

/// Distance from a plane, relative to the triangles' size, within which a corner counts as in it: adjacent
/// panes do not cover each other.
const IN_PLANE: f64 = 1e-9;
/// A triangle counts as on one side of a plane if it reaches beyond it by at most this fraction of its reach on
/// that side: corners of split triangles are rounded.
pub(super) const TOLERANCE: f64 = 1e-4;
/// The same tolerance for borders that touch in the image, in units of the image plane.
const TOUCHING: f64 = 1e-9;

/// A triangle in camera coordinates, with its projection.
struct ProjectedTriangle {
    /// Corners in camera axes, metres.
    corners: [DVec3; 3],
    normal: DVec3,
    /// Distance from the plane within which a corner counts as in it, times the length of the normal.
    slack: f64,
    /// Corners in the image plane, u and v; `None` if one is not in front of the camera.
    uv: Option<[DVec2; 3]>,
    /// Smallest and largest u and v.
    bounds: [DVec2; 2],
    distance_m: f64,
}

/// A triangle with nothing left behind it; the farthest has the highest priority.
struct Ready {
    distance_m: f64,
    triangle: u32,
}

/// A depth order of triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct DepthOrder {
    /// Triangle indices from back to front.
    pub indices: Vec<u32>,
    /// Number of triangles in overlap cycles that are drawn before something behind them.
    pub out_of_order: u32,
}

/// Depth order of the triangles; `None` if there are too many triangles or overlapping pairs. Corners are in
/// camera axes (x right, y down, z forward), metres.
#[must_use]
pub fn back_to_front(triangles: &[[DVec3; 3]]) -> Option<DepthOrder> {
    if triangles.len() > MAX_TRIANGLES {
        return None;
    }
    let projected: Vec<ProjectedTriangle> =
        triangles.iter().map(|corners| ProjectedTriangle::new(*corners)).collect();
    let mut in_front: Vec<Vec<u32>> = vec![Vec::new(); projected.len()];
    let mut behind = vec![0_u32; projected.len()];
    let mut pairs = 0;
    let mut from_left: Vec<u32> = (0..projected.len() as u32).collect();
    from_left
        .sort_by(|&a, &b| projected[a as usize].bounds[0].x.total_cmp(&projected[b as usize].bounds[0].x));
    for (k, &a) in from_left.iter().enumerate() {
        let right = projected[a as usize].bounds[1].x;
        for &b in from_left[k + 1..].iter().take_while(|&&b| projected[b as usize].bounds[0].x < right) {
            let (of_a, of_b) = (&projected[a as usize], &projected[b as usize]);
            if !of_a.overlaps(of_b) {
                continue;
            }
            pairs += 1;
            if pairs > MAX_PAIRS {
                return None;
            }
            let (first, second) = match of_a.depth_order(of_b) {
                Some(Ordering::Less) => (a, b),
                Some(Ordering::Greater) => (b, a),
                _ => continue,
            };
            in_front[first as usize].push(second);
            behind[second as usize] += 1;
        }
    }
    Some(topological_order(&projected, &in_front, behind))
}

/// Topological sort: repeatedly takes the farthest triangle with nothing left behind it, or, in a cycle, the
/// farthest of all.
fn topological_order(
    projected: &[ProjectedTriangle],
    in_front: &[Vec<u32>],
    mut behind: Vec<u32>,
) -> DepthOrder {
    let ready = |triangle: u32| Ready { distance_m: projected[triangle as usize].distance_m, triangle };
    let mut open: BinaryHeap<Ready> =
        (0..projected.len() as u32).filter(|&triangle| behind[triangle as usize] == 0).map(ready).collect();
    let mut from_afar: Vec<u32> = (0..projected.len() as u32).collect();
    from_afar.sort_by_key(|&triangle| std::cmp::Reverse(ready(triangle)));
    let mut from_afar = from_afar.into_iter();
    let mut taken = vec![false; projected.len()];
    let mut order = DepthOrder { indices: Vec::with_capacity(projected.len()), out_of_order: 0 };
    while order.indices.len() < projected.len() {
        let next = open.pop().map(|ready| ready.triangle).or_else(|| {
            order.out_of_order += 1;
            from_afar.find(|&triangle| !taken[triangle as usize])
        });
        let Some(triangle) = next else { break };
        if std::mem::replace(&mut taken[triangle as usize], true) {
            continue;
        }
        order.indices.push(triangle);
        for &other in &in_front[triangle as usize] {
            behind[other as usize] -= 1;
            if behind[other as usize] == 0 {
                open.push(ready(other));
            }
        }
    }
    order
}

impl ProjectedTriangle {
    fn new(corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        let normal = (b - a).cross(c - a);
        let reach = corners.iter().map(|corner| corner.abs().max_element()).fold(0.0, f64::max);
        let is_ahead = corners.iter().all(|corner| corner.z > 0.0);
        let uv = is_ahead.then(|| corners.map(|corner| corner.truncate() / corner.z));
        let bounds =
            uv.map_or([DVec2::NEG_INFINITY, DVec2::INFINITY], |[a, b, c]| [a.min(b).min(c), a.max(b).max(c)]);
        let distance_m = ((a + b + c) / 3.0).length();
        Self { corners, normal, slack: IN_PLANE * reach * normal.length(), uv, bounds, distance_m }
    }

    /// Whether two triangles may overlap in the image: false if a side of either separates them.
    fn overlaps(&self, other: &Self) -> bool {
        if self.bounds[1].cmple(other.bounds[0]).any() || other.bounds[1].cmple(self.bounds[0]).any() {
            return false;
        }
        let (Some(own), Some(others)) = (&self.uv, &other.uv) else { return true };
        !(separates(own, others) || separates(others, own))
    }

    /// `Less` if this triangle is behind the other one and drawn first. `None` if both are in one plane, or
    /// if they intersect and one is not in front of the camera.
    fn depth_order(&self, other: &Self) -> Option<Ordering> {
        // The camera is at the origin, and a corner on its side of the plane is in front.
        let side_of = |plane: &Self, corners: &[DVec3; 3], hair: f64| {
            let from_plane = |point: DVec3| plane.normal.dot(point - plane.corners[0]);
            let eye = from_plane(DVec3::ZERO);
            if eye.abs() <= plane.slack {
                return None;
            }
            let towards_eye = corners.map(|corner| from_plane(corner) * eye.signum());
            let (low, high) = towards_eye
                .iter()
                .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &x| (low.min(x), high.max(x)));
            let slack = plane.slack.max(hair * high.max(-low));
            match (low >= -slack, high <= slack) {
                (true, false) => Some(Ordering::Greater),
                (false, true) => Some(Ordering::Less),
                _ => None,
            }
        };
        let order = |hair: f64| {
            side_of(other, &self.corners, hair)
                .or_else(|| side_of(self, &other.corners, hair).map(Ordering::reverse))
        };
        order(0.0).or_else(|| order(TOLERANCE)).or_else(|| self.order_at_overlap(other))
    }

    /// Order at the centre of the overlap, for triangles neither of which lies on one side of the other's
    /// plane.
    fn order_at_overlap(&self, other: &Self) -> Option<Ordering> {
        let (own, others) = (self.uv.as_ref()?, other.uv.as_ref()?);
        let both = (0..3).fold(own.to_vec(), |left, k| {
            let (from, along) = (others[k], others[(k + 1) % 3] - others[k]);
            let inwards = along.perp_dot(others[(k + 2) % 3] - from).signum();
            let side = |at: DVec2| inwards * along.perp_dot(at - from);
            let to_next = |i: usize| {
                let (a, b) = (left[i], left[(i + 1) % left.len()]);
                let (of_a, of_b) = (side(a), side(b));
                let crossing = ((of_a < 0.0) != (of_b < 0.0)).then(|| a.lerp(b, of_a / (of_a - of_b)));
                (of_a >= 0.0).then_some(a).into_iter().chain(crossing)
            };
            (0..left.len()).flat_map(to_next).collect()
        });
        let middle = both.iter().sum::<DVec2>() / both.len() as f64;
        let nearness = |of: &Self| of.normal.dot(middle.extend(1.0)) / of.normal.dot(of.corners[0]);
        nearness(self).partial_cmp(&nearness(other))
    }
}

/// Whether a side of the one triangle separates it from the other.
fn separates(triangle: &[DVec2; 3], other: &[DVec2; 3]) -> bool {
    (0..3).any(|k| {
        let (from, along) = (triangle[k], triangle[(k + 1) % 3] - triangle[k]);
        let inwards = along.perp_dot(triangle[(k + 2) % 3] - from).signum();
        other.iter().all(|corner| inwards * along.perp_dot(*corner - from) <= TOUCHING * along.length())
    })
}

impl Ord for Ready {
    fn cmp(&self, other: &Self) -> Ordering {
        self.distance_m.total_cmp(&other.distance_m).then(other.triangle.cmp(&self.triangle))
    }
}

impl PartialOrd for Ready {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl PartialEq for Ready {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Ready {}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::noise::pcg4d;

    /// Depth of a triangle along the ray (u, v, 1); `None` if it is missed.
    fn depth([a, b, c]: [DVec3; 3], uv: DVec2) -> Option<f64> {
        let normal = (b - a).cross(c - a);
        let ray = uv.extend(1.0);
        let t = normal.dot(a) / normal.dot(ray);
        let inside = |from: DVec3, to: DVec3| (to - from).cross(t * ray - from).dot(normal) >= 0.0;
        (t > 0.0 && inside(a, b) && inside(b, c) && inside(c, a)).then_some(t)
    }

    /// Number of rays of a grid for which a nearer triangle is drawn before a farther one.
    fn wrong_pixels(triangles: &[[DVec3; 3]], order: &[u32]) -> usize {
        let positions = (0..60 * 60).map(|i| DVec2::new(f64::from(i % 60), f64::from(i / 60)) / 30.0 - 0.99);
        let is_wrong = |uv: &DVec2| {
            let depths: Vec<f64> = order.iter().filter_map(|&k| depth(triangles[k as usize], *uv)).collect();
            depths.windows(2).any(|pair| pair[0] < pair[1] - 1e-9)
        };
        positions.filter(is_wrong).count()
    }

    fn by_distance(triangles: &[[DVec3; 3]]) -> Vec<u32> {
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let far = |k: u32| triangles[k as usize].iter().sum::<DVec3>().length();
        order.sort_by(|&a, &b| far(b).total_cmp(&far(a)));
        order
    }

    fn part(k: u32, n: u32) -> f64 {
        f64::from(pcg4d([k, n, 5, 8])[0] >> 8) / f64::from(1 << 24)
    }

    #[test]
    fn panes_of_all_sizes_are_sorted_back_to_front() {
        // Each triangle lies within its own slab, 0.1 m deep and tilted, so they never intersect.
        let tilt = glam::DMat3::from_rotation_x(0.5) * glam::DMat3::from_rotation_y(0.7);
        let triangles: Vec<[DVec3; 3]> = (0..300)
            .map(|k| {
                let size = 0.5 * 30_f64.powf(part(k, 0));
                let corner = |n: u32| {
                    let coordinate = |m: u32, size: f64| size * (part(k, 10 * n + m) - 0.5);
                    tilt * DVec3::new(
                        coordinate(3, size) + 10.0 * (part(k, 1) - 0.5),
                        coordinate(4, size) + 10.0 * (part(k, 2) - 0.5),
                        coordinate(5, 0.09),
                    )
                };
                let slab =
                    tilt * DVec3::new(0.0, 0.0, 0.1 * (f64::from(k) - 150.0)) + DVec3::new(0.0, 0.0, 40.0);
                [corner(1), corner(2), corner(3)].map(|corner| corner + slab)
            })
            .collect();
        let order = back_to_front(&triangles).unwrap();
        let mut all = order.indices.clone();
        all.sort_unstable();
        assert_eq!(all, (0..300).collect::<Vec<_>>(), "each once");
        assert_eq!((wrong_pixels(&triangles, &order.indices), order.out_of_order), (0, 0));
        let naive = wrong_pixels(&triangles, &by_distance(&triangles));
        assert!(naive > 10, "distance alone would not do: {naive}");
    }

    #[test]
    fn small_pane_in_front_of_a_large_one_is_drawn_last() {
        let pane = |x: f64, size: f64, z: f64| {
            let corner = |i: f64, j: f64| DVec3::new(x + i * size, j * size, z);
            [corner(-1.0, -0.5), corner(1.0, -0.5), corner(0.0, 1.0)]
        };
        // Seen from the centre of the large pane, whose centre is nearer.
        let triangles = [pane(12.0, 1.0, 9.0), pane(0.0, 30.0, 10.0)];
        assert!(triangles[0].iter().sum::<DVec3>().length() > triangles[1].iter().sum::<DVec3>().length());
        assert_eq!(back_to_front(&triangles).unwrap().indices, [1, 0]);
        let behind = [pane(12.0, 1.0, 11.0), pane(0.0, 30.0, 10.0)];
        assert_eq!(back_to_front(&behind).unwrap(), DepthOrder { indices: vec![0, 1], out_of_order: 0 });
    }

    #[test]
    fn intersecting_triangles_are_in_order_after_splitting() {
        use std::sync::Arc;

        use crate::scene::{Encoding, Mesh, Texture, split_intersecting_blended};

        let texture = Arc::new(Texture::uniform([255, 255, 255, 99], Encoding::Linear));
        let panes = (0..40).map(|k| {
            let mut pane = Mesh::level_picture(texture.clone(), DVec3::ZERO, 3.0 + 5.0 * part(k, 1));
            pane.material.blends = true;
            let turn = |n: u32| 6.3 * part(k, n);
            pane.ned_from_shape =
                glam::DMat3::from_rotation_x(turn(2)) * glam::DMat3::from_rotation_y(turn(3));
            pane.origin_ned_m =
                DVec3::new(14.0 * part(k, 4) - 7.0, 14.0 * part(k, 5) - 7.0, 12.0 + 8.0 * part(k, 6));
            pane
        });
        let mut meshes: Vec<Mesh> = panes.collect();
        let corners = |meshes: &[Mesh]| -> Vec<[DVec3; 3]> {
            let mesh_triangles = |mesh: &Mesh| {
                let corners_of = |indices: &[u32]| [0, 1, 2].map(|k: usize| mesh.position_ned_m(indices[k]));
                mesh.shape.indices.chunks_exact(3).map(corners_of).collect::<Vec<_>>()
            };
            meshes.iter().flat_map(mesh_triangles).collect()
        };
        let wrong =
            |triangles: &[[DVec3; 3]]| wrong_pixels(triangles, &back_to_front(triangles).unwrap().indices);
        let area = |triangles: &[[DVec3; 3]]| {
            triangles.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length()).sum::<f64>()
        };
        let before = corners(&meshes);
        let done = split_intersecting_blended(&mut meshes);
        let after = corners(&meshes);
        eprintln!(
            "{} -> {} triangles, {} -> {} positions in the wrong order",
            before.len(),
            after.len(),
            wrong(&before),
            wrong(&after)
        );
        assert_eq!((after.len() - before.len(), 0), (done.added, done.remaining));
        assert!(done.added > 100 && after.len() < 20 * before.len(), "{done:?}");
        assert!((area(&after) / area(&before) - 1.0).abs() < 1e-5, "nothing is lost");
        // A few of all triangles are out of order, and counted.
        let out_of_order = back_to_front(&after).unwrap().out_of_order;
        assert!(
            out_of_order > 0 && (out_of_order as usize) < after.len() / 4,
            "{out_of_order} of {}",
            after.len()
        );
        assert!(
            wrong(&before) > 100 && wrong(&after) < wrong(&before) / 4,
            "{} {}",
            wrong(&before),
            wrong(&after)
        );
        // The rest are cycles: each pair by itself is in order.
        let unlike = |triangles: &[[DVec3; 3]]| {
            let projected: Vec<ProjectedTriangle> =
                triangles.iter().map(|corners| ProjectedTriangle::new(*corners)).collect();
            let is_wrong = |uv: DVec2| {
                let mut met: Vec<(f64, &ProjectedTriangle)> =
                    projected.iter().filter_map(|of| Some((depth(of.corners, uv)?, of))).collect();
                met.sort_by(|a, b| b.0.total_cmp(&a.0));
                let wrong = |pair: &[(f64, &ProjectedTriangle)]| {
                    pair[0].0 > pair[1].0 + 1e-4 && pair[0].1.depth_order(pair[1].1) != Some(Ordering::Less)
                };
                met.windows(2).any(wrong)
            };
            (0..60 * 60)
                .filter(|i| is_wrong(DVec2::new(f64::from(i % 60), f64::from(i / 60)) / 30.0 - 0.99))
                .count()
        };
        assert!(unlike(&before) > 50 && unlike(&after) == 0, "{} {}", unlike(&before), unlike(&after));
        // Splitting once is enough.
        assert!(split_intersecting_blended(&mut meshes).added < done.added / 20);
    }

    #[test]
    fn unsortable_triangles_are_drawn_once() {
        // Three in a cycle, two that intersect, one behind the camera, and some degenerate ones.
        let bar = |k: f64| {
            let turn = glam::DMat3::from_rotation_z(k * std::f64::consts::TAU / 3.0);
            [DVec3::new(-1.0, 0.4, 9.0), DVec3::new(3.0, 0.6, 11.0), DVec3::new(3.0, 0.8, 11.0)]
                .map(|at| turn * at)
        };
        let across = [DVec3::new(-3.0, -1.0, 8.0), DVec3::new(3.0, -1.0, 12.0), DVec3::new(0.0, 2.0, 10.0)];
        let mut triangles = vec![
            bar(0.0),
            bar(1.0),
            bar(2.0),
            across,
            across.map(|at| DVec3::new(-at.x, at.y, at.z)),
            across.map(|at| -at),
        ];
        triangles.extend([[DVec3::ZERO; 3], [DVec3::NAN; 3], [DVec3::INFINITY; 3], [DVec3::Z; 3]]);
        assert_eq!(back_to_front(&triangles[..3]).unwrap().out_of_order, 1);
        assert_eq!(back_to_front(&triangles[..2]).unwrap().out_of_order, 0);
        let mut order = back_to_front(&triangles).unwrap();
        order.indices.sort_unstable();
        assert_eq!(order.indices, (0..10).collect::<Vec<_>>());
        assert_eq!(back_to_front(&vec![across; MAX_TRIANGLES + 1]), None);
        assert_eq!(back_to_front(&[]), Some(DepthOrder::default()));
    }
}
