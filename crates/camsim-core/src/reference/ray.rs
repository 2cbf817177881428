//! Intersections of rays with triangles and boxes.

use glam::{DQuat, DVec3};

/// A ray with the precomputed values of its intersection tests.
#[derive(Clone, Copy, Debug)]
pub(super) struct Ray {
    pub(super) origin: DVec3,
    pub(super) direction: DVec3,
    inverse: DVec3,
    /// The axis along which the ray is longest, and the two others.
    axes: [usize; 3],
    /// Shear that aligns the direction with that axis, and its scale.
    shear: [f64; 3],
    /// Rotation from the axes of the ray to NED; `None` for a ray in NED.
    pub(super) ned_from_ray: Option<DQuat>,
}

/// A point in the sheared space of a ray: offset across it, and scaled ray parameter.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShearedPoint {
    x: f64,
    y: f64,
    t: f64,
}

impl Ray {
    /// `None` for a ray without a direction or with numbers that are not finite.
    pub(super) fn new(origin: DVec3, direction: DVec3) -> Option<Self> {
        let size = direction.abs();
        if !(origin.is_finite() && direction.is_finite() && size.max_element() > 0.0) {
            return None;
        }
        let long = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let axes = [(long + 1) % 3, (long + 2) % 3, long];
        let scale = 1.0 / direction[long];
        let shear = [direction[axes[0]] * scale, direction[axes[1]] * scale, scale];
        // A zero component would give 0/0 for a box whose face contains the ray; a tiny one does not.
        let tiny = 1e-200 * size.max_element();
        let inverse = direction.map(|d| 1.0 / if d.abs() < tiny { tiny.copysign(d) } else { d });
        Some(Self { origin, direction, inverse, axes, shear, ned_from_ray: None })
    }

    /// The same ray, whose axes such a rotation takes to NED.
    pub(super) fn turned_by(self, ned_from_ray: DQuat) -> Self {
        Self { ned_from_ray: Some(ned_from_ray), ..self }
    }

    /// A point in the sheared space of the ray (Woop, Benthin & Wald 2013). Equal points give equal results,
    /// so triangles that share an edge agree on which side of it the ray passes.
    pub(super) fn shear(&self, point: DVec3) -> ShearedPoint {
        let from_origin = point - self.origin;
        let along = from_origin[self.axes[2]];
        ShearedPoint {
            x: from_origin[self.axes[0]] - self.shear[0] * along,
            y: from_origin[self.axes[1]] - self.shear[1] * along,
            t: self.shear[2] * along,
        }
    }

    /// Ray parameter at which a box is entered, 0 from inside; `None` if it is missed before `limit`.
    pub(super) fn enter_box(&self, low: DVec3, high: DVec3, limit: f64) -> Option<f64> {
        let a = (low - self.origin) * self.inverse;
        let b = (high - self.origin) * self.inverse;
        let enter = a.min(b).max_element().max(0.0);
        let leave = a.max(b).min_element().min(limit);
        (enter <= leave).then_some(enter)
    }
}

/// Ray parameter in `0 < t < limit` and barycentric weights of the intersection with a triangle, from either
/// side.
pub(super) fn intersect_triangle([a, b, c]: [ShearedPoint; 3], limit: f64) -> Option<(f64, [f64; 3])> {
    let wa = c.x * b.y - c.y * b.x;
    let wb = a.x * c.y - a.y * c.x;
    let wc = b.x * a.y - b.y * a.x;
    if (wa < 0.0 || wb < 0.0 || wc < 0.0) && (wa > 0.0 || wb > 0.0 || wc > 0.0) {
        return None;
    }
    let sum = wa + wb + wc;
    let weights = [wa / sum, wb / sum, wc / sum];
    let t = weights[0] * a.t + weights[1] * b.t + weights[2] * c.t;
    // False for NaN, which results from a triangle seen edge-on or with a void corner.
    (t > 0.0 && t < limit).then_some((t, weights))
}

/// Smallest box around points, slightly enlarged so that rounding in [`Ray::enter_box`] never misses points
/// on its faces.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    pub(super) low: DVec3,
    pub(super) high: DVec3,
}

impl Bounds {
    pub(super) const NONE: Self = Self { low: DVec3::INFINITY, high: DVec3::NEG_INFINITY };

    pub(super) fn include(&mut self, point: DVec3) {
        if point.is_finite() {
            self.low = self.low.min(point);
            self.high = self.high.max(point);
        }
    }

    pub(super) fn join(&self, other: &Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.low.x > self.high.x
    }

    pub(super) fn grown(&self) -> Self {
        if self.is_empty() {
            return *self;
        }
        let hair = 1e-12 * self.low.abs().max(self.high.abs()).max_element() + 1e-12;
        Self { low: self.low - hair, high: self.high + hair }
    }
}
