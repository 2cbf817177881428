//! Four boxes that are tested against a ray together, in single precision. They are relative to the centre of
//! all boxes of a tree, and rounded outwards, so that a ray never misses their contents.

use glam::{DVec3, Vec3, Vec4};

use super::{Aabb, ray_packet::Beam};

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

/// A beam prepared for box tests.
pub(super) struct BeamBox {
    /// Normals and bounds of its half-spaces.
    sides: [([f32; 3], f32); 5],
    forward: [f32; 3],
    start: f32,
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

    /// Least distance of each box along a beam, and a bit mask of the boxes that it may meet up to `limit_m`.
    pub fn meet(&self, beam: &BeamBox, limit_m: f32) -> (Vec4, u32) {
        let mut is_met = self.min[0].cmple(self.max[0]);
        for (normal, least) in &beam.sides {
            let part = |k: usize| (self.min[k] * normal[k]).max(self.max[k] * normal[k]);
            is_met &= (part(0) + part(1) + part(2)).cmpge(Vec4::splat(*least));
        }
        let part = |k: usize| (self.min[k] * beam.forward[k]).min(self.max[k] * beam.forward[k]);
        let near = part(0) + part(1) + part(2) - beam.start;
        (near, (is_met & near.cmple(Vec4::splat(limit_m))).bitmask())
    }
}

impl BeamBox {
    /// For boxes relative to `middle` with coordinates up to `extent_m`.
    pub fn new(beam: &Beam, middle: DVec3, extent_m: f64) -> Self {
        // Normals are about as long as axes.
        let slack = |normal: DVec3| 2.0 * ROUNDING * extent_m * normal.abs().element_sum();
        let side = |(normal, least): (DVec3, f64)| {
            (normal.as_vec3().to_array(), down(least - normal.dot(middle) - slack(normal)))
        };
        let start = beam.start - beam.forward.dot(middle);
        let start = start + slack(beam.forward) + ROUNDING * start.abs();
        Self { sides: beam.sides.map(side), forward: beam.forward.as_vec3().to_array(), start: -down(-start) }
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
