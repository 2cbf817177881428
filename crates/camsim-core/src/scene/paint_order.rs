//! In which order triangles that are mixed with what is behind them are drawn: what is behind before what is
//! in front of it.
//!
//! Distance alone does not tell: the middle of a large pane may be nearer than a small one in front of its
//! end. Of two triangles that cover each other in the picture one lies on a single side of the other's plane,
//! unless they cross, and that tells which is behind (Newell, Newell & Sancha 1972). Of two that neither lie
//! so nor meet, the middle of what both cover tells. All such pairs together are an order from behind to the
//! front. Where triangles cross (`crossings.rs` cuts those of a scene), or cover each other in a ring, no
//! order of whole triangles is right: in a ring the distance of their middles decides.

use std::{cmp::Ordering, collections::BinaryHeap};

use glam::{DVec2, DVec3};

/// Triangles, and pairs of them that cover each other in the picture, for which an order is looked for; of
/// more there is none but by distance.
pub const MOST_TRIANGLES: usize = 1 << 14;
/// See above.
pub const MOST_PAIRS: usize = 1 << 20;

/// A corner this much of the triangles' size beside a plane lies in it: panes side by side cover nothing of
/// each other.
const IN_PLANE: f64 = 1e-9;
/// Of how far a triangle reaches to one side of a plane, as much to the other counts as nothing: corners
/// where triangles were cut are rounded.
pub(super) const HAIR: f64 = 1e-4;
/// Likewise, of the picture's unit, for borders that touch in it.
const TOUCHING: f64 = 1e-9;

/// A triangle as a camera sees it.
struct Seen {
    /// In the camera's axes, metres.
    corners: [DVec3; 3],
    normal: DVec3,
    /// How far from its plane a corner counts as in it, times the normal's length.
    slack: f64,
    /// In the picture, u and v; `None` where a corner is not in front of the camera.
    uv: Option<[DVec2; 3]>,
    /// Least and largest u and v.
    bounds: [DVec2; 2],
    distance_m: f64,
}

/// A triangle that nothing is left behind, the farthest first.
struct Ready {
    distance_m: f64,
    place: u32,
}

/// An order of triangles.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PaintOrder {
    /// Their places, from behind to the front.
    pub places: Vec<u32>,
    /// Of triangles that cover each other in a ring, those that are drawn before something behind them.
    pub out_of_order: u32,
}

/// The order of triangles; `None` where there are too many of them, or of pairs. Corners are in the camera's
/// axes (x right, y down, z ahead), metres.
#[must_use]
pub fn back_to_front(triangles: &[[DVec3; 3]]) -> Option<PaintOrder> {
    if triangles.len() > MOST_TRIANGLES {
        return None;
    }
    let seen: Vec<Seen> = triangles.iter().map(|corners| Seen::new(*corners)).collect();
    let mut in_front: Vec<Vec<u32>> = vec![Vec::new(); seen.len()];
    let mut behind = vec![0_u32; seen.len()];
    let mut pairs = 0;
    let mut from_left: Vec<u32> = (0..seen.len() as u32).collect();
    from_left.sort_by(|&a, &b| seen[a as usize].bounds[0].x.total_cmp(&seen[b as usize].bounds[0].x));
    for (k, &a) in from_left.iter().enumerate() {
        let right = seen[a as usize].bounds[1].x;
        for &b in from_left[k + 1..].iter().take_while(|&&b| seen[b as usize].bounds[0].x < right) {
            let (of_a, of_b) = (&seen[a as usize], &seen[b as usize]);
            if !of_a.covers(of_b) {
                continue;
            }
            pairs += 1;
            if pairs > MOST_PAIRS {
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
    Some(resolved(&seen, &in_front, behind))
}

/// Takes what nothing is left behind, the farthest first, and where there is no such triangle the farthest of
/// all.
fn resolved(seen: &[Seen], in_front: &[Vec<u32>], mut behind: Vec<u32>) -> PaintOrder {
    let ready = |place: u32| Ready { distance_m: seen[place as usize].distance_m, place };
    let mut open: BinaryHeap<Ready> =
        (0..seen.len() as u32).filter(|&place| behind[place as usize] == 0).map(ready).collect();
    let mut from_afar: Vec<u32> = (0..seen.len() as u32).collect();
    from_afar.sort_by_key(|&place| std::cmp::Reverse(ready(place)));
    let mut from_afar = from_afar.into_iter();
    let mut taken = vec![false; seen.len()];
    let mut order = PaintOrder { places: Vec::with_capacity(seen.len()), out_of_order: 0 };
    while order.places.len() < seen.len() {
        let next = open.pop().map(|ready| ready.place).or_else(|| {
            order.out_of_order += 1;
            from_afar.find(|&place| !taken[place as usize])
        });
        let Some(place) = next else { break };
        if std::mem::replace(&mut taken[place as usize], true) {
            continue;
        }
        order.places.push(place);
        for &other in &in_front[place as usize] {
            behind[other as usize] -= 1;
            if behind[other as usize] == 0 {
                open.push(ready(other));
            }
        }
    }
    order
}

impl Seen {
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

    /// Whether the two may cover a place of the picture together: false where a line of it has them on two
    /// sides.
    fn covers(&self, other: &Self) -> bool {
        if self.bounds[1].cmple(other.bounds[0]).any() || other.bounds[1].cmple(self.bounds[0]).any() {
            return false;
        }
        let (Some(own), Some(others)) = (&self.uv, &other.uv) else { return true };
        !(parts(own, others) || parts(others, own))
    }

    /// `Less` if it is behind the other one and drawn first; `None` where both are in one plane, or they
    /// cross where one is not before the camera.
    fn depth_order(&self, other: &Self) -> Option<Ordering> {
        // Towards the camera, which is at 0, a corner is in front.
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
        order(0.0).or_else(|| order(HAIR)).or_else(|| self.order_where_both_are(other))
    }

    /// Which is behind in the middle of what both cover: neither lies on one side of the other's plane,
    /// though they need not meet.
    fn order_where_both_are(&self, other: &Self) -> Option<Ordering> {
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

/// Whether a side of the one triangle has the other beyond it.
fn parts(triangle: &[DVec2; 3], other: &[DVec2; 3]) -> bool {
    (0..3).any(|k| {
        let (from, along) = (triangle[k], triangle[(k + 1) % 3] - triangle[k]);
        let inwards = along.perp_dot(triangle[(k + 2) % 3] - from).signum();
        other.iter().all(|corner| inwards * along.perp_dot(*corner - from) <= TOUCHING * along.length())
    })
}

impl Ord for Ready {
    fn cmp(&self, other: &Self) -> Ordering {
        self.distance_m.total_cmp(&other.distance_m).then(other.place.cmp(&self.place))
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

    /// Depth of a triangle along the ray (u, v, 1): `None` where it is missed.
    fn depth([a, b, c]: [DVec3; 3], uv: DVec2) -> Option<f64> {
        let normal = (b - a).cross(c - a);
        let way = uv.extend(1.0);
        let t = normal.dot(a) / normal.dot(way);
        let inside = |from: DVec3, to: DVec3| (to - from).cross(t * way - from).dot(normal) >= 0.0;
        (t > 0.0 && inside(a, b) && inside(b, c) && inside(c, a)).then_some(t)
    }

    /// Places of a grid of rays where a nearer triangle is drawn before a farther one.
    fn wrong_places(triangles: &[[DVec3; 3]], order: &[u32]) -> usize {
        let places = (0..60 * 60).map(|i| DVec2::new(f64::from(i % 60), f64::from(i / 60)) / 30.0 - 0.99);
        let is_wrong = |uv: &DVec2| {
            let depths: Vec<f64> = order.iter().filter_map(|&k| depth(triangles[k as usize], *uv)).collect();
            depths.windows(2).any(|pair| pair[0] < pair[1] - 1e-9)
        };
        places.filter(is_wrong).count()
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
    fn panes_of_all_sizes_are_drawn_from_behind() {
        // Each within a slab of its own, 0.1 m deep and tilted, so that they never cross.
        let tilt = glam::DMat3::from_rotation_x(0.5) * glam::DMat3::from_rotation_y(0.7);
        let triangles: Vec<[DVec3; 3]> = (0..300)
            .map(|k| {
                let size = 0.5 * 30_f64.powf(part(k, 0));
                let corner = |n: u32| {
                    let at = |m: u32, size: f64| size * (part(k, 10 * n + m) - 0.5);
                    tilt * DVec3::new(
                        at(3, size) + 10.0 * (part(k, 1) - 0.5),
                        at(4, size) + 10.0 * (part(k, 2) - 0.5),
                        at(5, 0.09),
                    )
                };
                let slab =
                    tilt * DVec3::new(0.0, 0.0, 0.1 * (f64::from(k) - 150.0)) + DVec3::new(0.0, 0.0, 40.0);
                [corner(1), corner(2), corner(3)].map(|corner| corner + slab)
            })
            .collect();
        let order = back_to_front(&triangles).unwrap();
        let mut all = order.places.clone();
        all.sort_unstable();
        assert_eq!(all, (0..300).collect::<Vec<_>>(), "each once");
        assert_eq!((wrong_places(&triangles, &order.places), order.out_of_order), (0, 0));
        let naive = wrong_places(&triangles, &by_distance(&triangles));
        assert!(naive > 10, "distance alone would not do: {naive}");
    }

    #[test]
    fn a_small_pane_before_the_end_of_a_large_one_comes_last() {
        let pane = |x: f64, size: f64, z: f64| {
            let corner = |i: f64, j: f64| DVec3::new(x + i * size, j * size, z);
            [corner(-1.0, -0.5), corner(1.0, -0.5), corner(0.0, 1.0)]
        };
        // Seen from the middle of the large one, whose middle is nearer.
        let triangles = [pane(12.0, 1.0, 9.0), pane(0.0, 30.0, 10.0)];
        assert!(triangles[0].iter().sum::<DVec3>().length() > triangles[1].iter().sum::<DVec3>().length());
        assert_eq!(back_to_front(&triangles).unwrap().places, [1, 0]);
        let behind = [pane(12.0, 1.0, 11.0), pane(0.0, 30.0, 10.0)];
        assert_eq!(back_to_front(&behind).unwrap(), PaintOrder { places: vec![0, 1], out_of_order: 0 });
    }

    #[test]
    fn triangles_that_cross_are_in_order_once_they_are_cut() {
        use std::sync::Arc;

        use crate::scene::{Encoding, Mesh, Texture, cut_where_blended_cross};

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
            let of = |mesh: &Mesh| {
                let at = |of: &[u32]| [0, 1, 2].map(|k: usize| mesh.position_ned_m(of[k]));
                mesh.shape.indices.chunks_exact(3).map(at).collect::<Vec<_>>()
            };
            meshes.iter().flat_map(of).collect()
        };
        let wrong =
            |triangles: &[[DVec3; 3]]| wrong_places(triangles, &back_to_front(triangles).unwrap().places);
        let area = |triangles: &[[DVec3; 3]]| {
            triangles.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length()).sum::<f64>()
        };
        let before = corners(&meshes);
        let done = cut_where_blended_cross(&mut meshes);
        let after = corners(&meshes);
        eprintln!(
            "{} -> {} triangles, {} -> {} places in the wrong order",
            before.len(),
            after.len(),
            wrong(&before),
            wrong(&after)
        );
        assert_eq!((after.len() - before.len(), 0), (done.more, done.left));
        assert!(done.more > 100 && after.len() < 20 * before.len(), "{done:?}");
        assert!((area(&after) / area(&before) - 1.0).abs() < 1e-5, "nothing is lost");
        // They are counted: a few of all.
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
        // What is left are rings: of each two by themselves the order is right.
        let unlike = |triangles: &[[DVec3; 3]]| {
            let seen: Vec<Seen> = triangles.iter().map(|corners| Seen::new(*corners)).collect();
            let is_wrong = |uv: DVec2| {
                let mut met: Vec<(f64, &Seen)> =
                    seen.iter().filter_map(|of| Some((depth(of.corners, uv)?, of))).collect();
                met.sort_by(|a, b| b.0.total_cmp(&a.0));
                let wrong = |pair: &[(f64, &Seen)]| {
                    pair[0].0 > pair[1].0 + 1e-4 && pair[0].1.depth_order(pair[1].1) != Some(Ordering::Less)
                };
                met.windows(2).any(wrong)
            };
            (0..60 * 60)
                .filter(|i| is_wrong(DVec2::new(f64::from(i % 60), f64::from(i / 60)) / 30.0 - 0.99))
                .count()
        };
        assert!(unlike(&before) > 50 && unlike(&after) == 0, "{} {}", unlike(&before), unlike(&after));
        // Once is enough.
        assert!(cut_where_blended_cross(&mut meshes).more < done.more / 20);
    }

    #[test]
    fn what_has_no_order_is_there_once_each() {
        // Three in a ring, two that cross, one behind the camera, some that are no triangles.
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
        order.places.sort_unstable();
        assert_eq!(order.places, (0..10).collect::<Vec<_>>());
        assert_eq!(back_to_front(&vec![across; MOST_TRIANGLES + 1]), None);
        assert_eq!(back_to_front(&[]), Some(PaintOrder::default()));
    }
}
