//! Axis-aligned bounding boxes.

use glam::{DMat3, DVec3};

/// An axis-aligned box in NED, metres. It is empty if any `min` is above its `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
}

impl Aabb {
    /// The empty box.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Whether the box is empty.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Extends the box to contain a point.
    pub fn include(&mut self, point: DVec3) {
        self.min = self.min.min(point);
        self.max = self.max.max(point);
    }

    /// Smallest box that contains both.
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether both have a point in common.
    pub fn meets(&self, other: &Self) -> bool {
        self.min.cmple(other.max).all() && other.min.cmple(self.max).all()
    }

    /// Centre of the box.
    pub fn centre(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Bounding box of this box transformed by `turn` (rotation and scale about the origin) and `shift`.
    pub fn turned(&self, turn: DMat3, shift: DVec3) -> Self {
        if self.is_empty() {
            return *self;
        }
        let half = 0.5 * (self.max - self.min);
        let reach = turn.x_axis.abs() * half.x + turn.y_axis.abs() * half.y + turn.z_axis.abs() * half.z;
        let centre = turn * self.centre() + shift;
        Self { min: centre - reach, max: centre + reach }
    }

    /// Distance from a point to the nearest point of the box, 0 inside; infinite for an empty box.
    pub fn distance_m(&self, point: DVec3) -> f64 {
        if self.is_empty() {
            return f64::INFINITY;
        }
        (self.min - point).max(point - self.max).max(DVec3::ZERO).length()
    }

    /// Distance from a point to the farthest point of the box; 0 for an empty box.
    pub fn farthest_m(&self, point: DVec3) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        (self.max - point).abs().max((self.min - point).abs()).length()
    }

    /// The largest value of `normal . x` over the box.
    pub(super) fn support(&self, normal: DVec3) -> f64 {
        (normal * self.min).max(normal * self.max).element_sum()
    }

    /// First ray parameter in `0..=t_max` inside the box, for a ray given by its origin and [`inverse`]
    /// direction.
    ///
    /// The box is enlarged by a nanometre, and both ends are widened by a few rounding errors, so that it
    /// never hides a triangle inside it nor a ray within the plane of one of its faces.
    #[cfg(test)]
    pub(in crate::scene) fn enter(&self, origin: DVec3, inverse_direction: DVec3, t_max: f64) -> Option<f64> {
        const WIDER: f64 = 1e-14;
        const LARGER_M: f64 = 1e-9;
        let near = (self.min - origin - LARGER_M) * inverse_direction;
        let far = (self.max - origin + LARGER_M) * inverse_direction;
        let t_enter = near.min(far).max_element().max(0.0) * (1.0 - WIDER);
        let t_exit = near.max(far).min_element().min(t_max) * (1.0 + WIDER);
        (t_enter <= t_exit && !self.is_empty()).then_some(t_enter)
    }
}

/// 1 / direction for [`Aabb::enter`]. A component of 0 is replaced by a tiny one, whose inverse is finite and
/// gives 0 when multiplied by 0.
#[cfg(test)]
pub(in crate::scene) fn inverse(direction: DVec3) -> DVec3 {
    const NONE: f64 = 1e-290;
    DVec3::select(direction.abs().cmplt(DVec3::splat(NONE)), DVec3::splat(NONE), direction).recip()
}
