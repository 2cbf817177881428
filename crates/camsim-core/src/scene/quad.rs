//! Four boxes that a ray is tested against at once, in single precision: relative to the middle of all boxes
//! of a tree, and rounded outwards, so that a ray never misses what is inside of them.

use glam::{DVec3, Vec3, Vec4};

use super::Aabb;

/// Rounding errors of single precision: of a sum of coordinates, as a part of the largest, and of a ray
/// parameter.
const ROUNDING: f64 = 4e-7;
const WIDER: f32 = 1e-6;

/// Four boxes, by axis. Those that are not there or are empty have every `min` above its `max`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Quad {
    min: [Vec4; 3],
    max: [Vec4; 3],
}

/// A ray as boxes are tested against it. Its parameter is in metres.
pub(super) struct BoxRay {
    origin: [f32; 3],
    inverse: [f32; 3],
    /// Boxes are larger by this much.
    slack_m: f32,
}

impl Quad {
    pub const EMPTY: Self = Self { min: [Vec4::INFINITY; 3], max: [Vec4::NEG_INFINITY; 3] };

    /// Box number `lane`, relative to the middle.
    pub fn get(&self, lane: usize) -> Aabb {
        let corner = |of: &[Vec4; 3]| Vec3::new(of[0][lane], of[1][lane], of[2][lane]).as_dvec3();
        Aabb { min: corner(&self.min), max: corner(&self.max) }
    }

    /// Sets it to one that holds `bounds`.
    pub fn set(&mut self, lane: usize, bounds: &Aabb) {
        for k in 0..3 {
            self.min[k][lane] = down(bounds.min[k]);
            self.max[k][lane] = -down(-bounds.max[k]);
        }
    }

    /// Ray parameters from which on a ray may be in each box, and which of the boxes it may be in at all, as
    /// bits.
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
    /// Of unit length, from a place relative to the middle of boxes whose coordinates are up to `extent_m`.
    pub fn new(origin: DVec3, direction: DVec3, extent_m: f64) -> Self {
        /// Components below it never matter: in metres, over any distance that there is.
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

/// The next single-precision number at or below one.
pub(super) fn down(value: f64) -> f32 {
    let nearest = value as f32;
    if f64::from(nearest) > value { nearest.next_down() } else { nearest }
}
