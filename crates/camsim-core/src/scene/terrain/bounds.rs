//! Boxes.

use glam::{DMat3, DVec3};

/// A box along the NED axes, metres. Empty if any `min` is above its `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest coordinates.
    pub min: DVec3,
    /// Largest coordinates.
    pub max: DVec3,
}

impl Aabb {
    /// The box that holds nothing.
    pub const EMPTY: Self = Self { min: DVec3::INFINITY, max: DVec3::NEG_INFINITY };

    /// Whether it holds nothing.
    pub fn is_empty(&self) -> bool {
        !self.min.cmple(self.max).all()
    }

    /// Grows to hold a point.
    pub fn include(&mut self, point: DVec3) {
        self.min = self.min.min(point);
        self.max = self.max.max(point);
    }

    /// The box around both.
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Middle of the box.
    pub fn centre(&self) -> DVec3 {
        0.5 * (self.min + self.max)
    }

    /// Smallest box around this one, turned and scaled about (0, 0, 0) and then moved.
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
    /// The box is taken a nanometre larger, and both ends are widened by some rounding errors: it must never
    /// hide a hit of a triangle within it, nor one that a ray within the plane of a face meets.
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

/// 1 / direction for [`Aabb::enter`]. A component of 0 counts as one too small to matter: its inverse is
/// finite, and times 0 it is 0.
#[cfg(test)]
pub(in crate::scene) fn inverse(direction: DVec3) -> DVec3 {
    const NONE: f64 = 1e-290;
    DVec3::select(direction.abs().cmplt(DVec3::splat(NONE)), DVec3::splat(NONE), direction).recip()
}
