//! The march of a ray along its epipolar line in an ideal frame: twin of
//! [`camsim_core::temporal::silhouette_rays::march`].

use camsim_core::temporal::silhouette_rays::{self, HALVINGS};

use super::SilhouetteImage;

const STEP_PX: f32 = silhouette_rays::STEP_PX as f32;
const MAX_STEPS: f32 = silhouette_rays::MAX_STEPS as f32;
const GAP_PX: f32 = silhouette_rays::GAP_PX as f32;
/// The march starts at this multiple of the inverse depth of the nearest surface.
const NEARER: f32 = 1.02;
/// Largest ratio of that surface's inverse depth in the row's camera to that in the key camera. Without a
/// bound the march would not end for cameras that almost touch the surface.
const MAX_STRETCH: f32 = 4.0;
/// Lower bound of the ratio of a point's depths in the row's and in the key camera.
const MIN_DEPTH_RATIO: f32 = 1e-3;
/// Part of the start's inverse depth below which surfaces along the line make the march start later.
const MUCH_LATER: f32 = 0.8;

/// The points of a ray.
pub(crate) trait RayPath {
    /// The point at inverse depth `w` (1/m) of the row's camera, in the key camera, times any factor.
    fn point(&self, w: f32) -> [f32; 3];

    /// Inverse depth in the row's camera of a point with inverse depth `in_key` in the key camera, 1/m.
    fn row_inverse_depth(&self, in_key: f32) -> f32;

    /// Inverse depth in the row's camera before which nothing is, 1/m, if nothing is nearer than `nearest` in the key
    /// camera.
    #[inline]
    fn start(&self, nearest: f32) -> f32 {
        self.row_inverse_depth(NEARER * nearest).min(MAX_STRETCH * NEARER * nearest)
    }
}

/// A ray whose points are `direction` (at infinity) plus their inverse depths times `shift`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StraightRay {
    pub direction: [f32; 3],
    pub shift_m: [f32; 3],
}

impl RayPath for StraightRay {
    #[inline]
    fn point(&self, w: f32) -> [f32; 3] {
        let ([x, y, z], [sx, sy, sz]) = (self.direction, self.shift_m);
        [x + w * sx, y + w * sy, z + w * sz]
    }

    #[inline]
    fn row_inverse_depth(&self, in_key: f32) -> f32 {
        in_key * self.direction[2] / (1.0 - self.shift_m[2] * in_key).max(MIN_DEPTH_RATIO)
    }
}

/// Intersection of a ray with a surface of an ideal frame.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfaceHit {
    /// Position of its colour, ideal pixels.
    pub position_px: [f32; 2],
    /// Inverse planar depth in the camera of the output row, 1/m.
    pub row_inverse_depth: f32,
    /// False if the key camera did not see it, and the surface seen beside it replaces it.
    pub is_visible: bool,
}

/// The surface shown where a point of a ray projects to.
#[derive(Clone, Copy)]
struct Shown {
    position_px: [f32; 2],
    /// Inverse depth in the row's camera, 1/m.
    inverse_depth: f32,
}

fn distance([ax, ay]: [f32; 2], [bx, by]: [f32; 2]) -> f32 {
    ((ax - bx) * (ax - bx) + (ay - by) * (ay - by)).sqrt()
}

impl SilhouetteImage<'_> {
    #[inline]
    fn position_px(&self, [x, y, z]: [f32; 3]) -> [f32; 2] {
        let per_z = 1.0 / z;
        [
            x * per_z * self.focal_px[0] + self.principal_px[0],
            y * per_z * self.focal_px[1] + self.principal_px[1],
        ]
    }

    /// Whether the parallax of a ray passes a silhouette.
    pub fn is_near_silhouette(&self, ray: &impl RayPath) -> bool {
        let far = ray.point(0.0);
        let far_px = self.position_px(far);
        let reach = self.reach(far_px);
        if far[2] <= 0.0 || !reach.has_edge {
            return false;
        }
        let near = ray.point(ray.start(reach.nearest));
        if near[2] <= 0.0 {
            return false;
        }
        let near_px = self.position_px(near);
        let along = self.reach_along(near_px, far_px);
        along.has_edge && {
            let near_px = self.position_px(ray.point(ray.start(along.nearest)));
            let look_ups = distance(near_px, far_px).ceil().clamp(1.0, MAX_STEPS);
            let at = |t: f32| [0, 1].map(|k: usize| near_px[k] + t * (far_px[k] - near_px[k]));
            (0..=look_ups as u32).any(|i| self.touches_edge(at(i as f32 / look_ups)))
        }
    }

    /// First intersection of a ray with the surfaces of the frame.
    // Long because: one loop, as in its twin.
    pub fn first_surface(&self, ray: &impl RayPath) -> SurfaceHit {
        let shown = |w: f32| {
            let position_px = self.position_px(ray.point(w));
            Shown { position_px, inverse_depth: ray.row_inverse_depth(self.inverse_depth(position_px)) }
        };
        let hit = |of: Shown, is_visible: bool| SurfaceHit {
            position_px: of.position_px,
            row_inverse_depth: of.inverse_depth,
            is_visible,
        };
        let far_px = self.position_px(ray.point(0.0));
        let mut w_near = ray.start(self.reach(far_px).nearest);
        let mut near_px = self.position_px(ray.point(w_near));
        // Surfaces along the line alone are those that the ray may meet.
        for _ in 0..2 {
            let later = ray.start(self.reach_along(near_px, far_px).nearest);
            if later < MUCH_LATER * w_near {
                w_near = later;
                near_px = self.position_px(ray.point(w_near));
            }
        }
        let length_px = distance(near_px, far_px);
        let px_per_w = length_px / w_near.max(1e-12);
        if length_px < GAP_PX {
            // No occlusion is possible: one iteration from infinity is enough.
            return hit(shown(shown(0.0).inverse_depth), true);
        }
        // A ray that is free at two steps, the second behind the first's surface, may have crossed that surface
        // in between. It has if the surface continues to where the ray reaches its depth.
        let earlier_hit = |free: Shown| {
            let there = shown(free.inverse_depth);
            let goes_on = (free.inverse_depth - there.inverse_depth).abs() * px_per_w < GAP_PX;
            (goes_on && self.contains(there.position_px)).then(|| hit(there, true))
        };
        let steps = (length_px / STEP_PX).ceil().clamp(1.0, MAX_STEPS) as u32;
        let (mut free, mut free_w, mut hidden) = (shown(w_near), w_near, false);
        for i in 1..=steps {
            let w = w_near * (1.0 - i as f32 / steps as f32);
            let here = shown(w);
            if w > here.inverse_depth {
                if w <= free.inverse_depth {
                    if hidden {
                        break;
                    }
                    if let Some(hit) = earlier_hit(free) {
                        return hit;
                    }
                }
                (free, free_w, hidden) = (here, w, false);
                continue;
            }
            if !hidden {
                let (mut behind, mut behind_w) = (here, w);
                for _ in 0..HALVINGS {
                    let between_w = 0.5 * (free_w + behind_w);
                    let between = shown(between_w);
                    if between_w > between.inverse_depth {
                        if between_w <= free.inverse_depth
                            && let Some(hit) = earlier_hit(free)
                        {
                            return hit;
                        }
                        (free, free_w) = (between, between_w);
                    } else {
                        (behind, behind_w) = (between, between_w);
                    }
                }
                if (behind.inverse_depth - free.inverse_depth) * px_per_w < GAP_PX {
                    return hit(free, self.contains(free.position_px));
                }
                hidden = true;
            }
            if w <= free.inverse_depth {
                break;
            }
        }
        hit(free, false)
    }
}
