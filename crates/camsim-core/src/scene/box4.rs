//! Four boxes that are tested against a ray together, in single precision. They are relative to the centre of
//! all boxes of a tree, and rounded outwards, so that a ray never misses their contents.

use glam::{DVec3, Vec3, Vec4};

use super::Aabb;

/// Bounds on single-precision rounding: of a sum of coordinates relative to the largest one, and of a ray
/// parameter.
const ROUNDING: f64 = 4e-7;
const WIDER: f32 = 1e-6;

/// Four boxes by axis. Absent or empty ones have every `min` above its `max`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Box4 {
    min: [Vec4; 3],
    max: [Vec4; 3],
}

/// A ray prepared for box tests. Its parameter is in metres.
pub(super) struct BoxRay {
    origin: [f32; 3],
    inverse: [f32; 3],
    /// Amount by which boxes are enlarged.
    slack_m: f32,
}

impl Box4 {
    pub const EMPTY: Self = Self { min: [Vec4::INFINITY; 3], max: [Vec4::NEG_INFINITY; 3] };

    /// Box number `lane`, relative to the centre of the tree.
    pub fn get(&self, lane: usize) -> Aabb {
        let corner = |of: &[Vec4; 3]| Vec3::new(of[0][lane], of[1][lane], of[2][lane]).as_dvec3();
        Aabb { min: corner(&self.min), max: corner(&self.max) }
    }

    /// Sets a box to one that contains `bounds`.
    pub fn set(&mut self, lane: usize, bounds: &Aabb) {
        for k in 0..3 {
            self.min[k][lane] = down(bounds.min[k]);
            self.max[k][lane] = -down(-bounds.max[k]);
        }
    }

    /// Ray parameter at which each box is entered, and a bit mask of the boxes that the ray hits.
    pub fn enter(&self, ray: &BoxRay, limit_m: f32) -> (Vec4, u32) {
        let (mut enter, mut exit) = (Vec4::ZERO, Vec4::splat(limit_m));
        for k in 0..3 {
            let near = (self.min[k] - (ray.origin[k] + ray.slack_m)) * ray.inverse[k];
            let far = (self.max[k] - (ray.origin[k] - ray.slack_m)) * ray.inverse[k];
            enter = enter.max(near.min(far));
            exit = exit.min(near.max(far));
        }
        let is_met = (enter * (1.0 - WIDER)).cmple(exit * (1.0 + WIDER)) & self.min[0].cmple(self.max[0]);
        (enter * (1.0 - WIDER), is_met.bitmask())
    }
}

impl BoxRay {
    /// A ray of unit length whose origin is relative to the centre of boxes with coordinates up to
    /// `extent_m`.
    pub fn new(origin: DVec3, direction: DVec3, extent_m: f64) -> Self {
        /// Smaller components do not matter at any distance, in metres.
        const LEAST: f64 = 1e-30;
        let inverse = |d: f64| (1.0 / if d.abs() < LEAST { LEAST.copysign(d) } else { d }) as f32;
        let slack_m = 1e-9 + ROUNDING * (origin.abs().max_element() + extent_m);
        Self {
            origin: origin.as_vec3().to_array(),
            inverse: direction.to_array().map(inverse),
            slack_m: -down(-slack_m),
        }
    }
}

/// The largest single-precision number that is not above a value.
pub(super) fn down(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) > value { nearest.next_down() } else { nearest }
}
