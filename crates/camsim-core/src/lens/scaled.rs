//! A lens whose image is scaled by a polynomial of the radius: one primary of a lens with lateral chromatic
//! aberration.

use glam::{DMat2, DVec2, DVec3};

use super::{Lens, class::LensClass};

/// Steps of the inverse; Newton's method needs some five.
const MOST_STEPS: u32 = 100;

/// `scaled = distorted (v + c r + b r^2)`, `r = |distorted unit|`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct RadialScale {
    terms: [f64; 3],
    /// r of the distorted points (1, 0) and (0, 1).
    unit: DVec2,
    /// Where the scaled radius stops growing with r.
    r_max: f64,
}

impl RadialScale {
    pub fn new(terms: [f64; 3], unit: DVec2) -> Self {
        Self { terms, unit, r_max: largest_radius(terms) }
    }

    fn r(&self, distorted: DVec2) -> f64 {
        (distorted * self.unit).length()
    }

    fn factor(&self, r: f64) -> f64 {
        let [v, c, b] = self.terms;
        v + r * (c + r * b)
    }

    fn of(&self, distorted: DVec2) -> DVec2 {
        distorted * self.factor(self.r(distorted))
    }

    fn jacobian(&self, distorted: DVec2) -> DMat2 {
        let [_, c, b] = self.terms;
        let r = self.r(distorted);
        let along =
            if r > 0.0 { distorted * self.unit * self.unit * ((c + 2.0 * b * r) / r) } else { DVec2::ZERO };
        DMat2::from_diagonal(DVec2::splat(self.factor(r)))
            + DMat2::from_cols(distorted * along.x, distorted * along.y)
    }

    fn contains(&self, distorted: DVec2) -> bool {
        self.r(distorted) < self.r_max
    }

    /// The distorted point of a scaled one; `None` beyond what any is scaled to.
    fn undo(&self, scaled: DVec2) -> Option<DVec2> {
        let [v, c, b] = self.terms;
        let wanted = self.r(scaled);
        if wanted == 0.0 {
            return Some(scaled);
        }
        if !wanted.is_finite() {
            return None;
        }
        let miss = |r: f64| r * self.factor(r) - wanted;
        // The scaled radius grows from 0 to the end of the bracket.
        let (mut low, mut high) = (0.0, self.r_max.min(wanted / v));
        while high < self.r_max && miss(high) < 0.0 {
            high = (2.0 * high).min(self.r_max);
        }
        if miss(high) < 0.0 || high == self.r_max && miss(high) == 0.0 {
            return None;
        }
        let mut r = high;
        for _ in 0..MOST_STEPS {
            let error = miss(r);
            if error > 0.0 {
                high = r
            } else {
                low = r
            }
            let newton = r - error / (v + r * (2.0 * c + 3.0 * b * r));
            let next = if newton > low && newton < high { newton } else { 0.5 * (low + high) };
            let is_done = (next - r).abs() <= 1e-15 * r;
            r = next;
            if is_done {
                break;
            }
        }
        Some(scaled * (r / wanted))
    }
}

/// Smallest r at which the slope `v + 2 c r + 3 b r^2` of the scaled radius is 0; infinite without.
pub(crate) fn largest_radius([v, c, b]: [f64; 3]) -> f64 {
    let discriminant = c * c - 3.0 * b * v;
    if discriminant < 0.0 {
        return f64::INFINITY;
    }
    // Both roots without cancellation: v / q and q / (3 b).
    let q = -(c + discriminant.sqrt().copysign(c));
    [v / q, q / (3.0 * b)].into_iter().filter(|r| *r > 0.0 && r.is_finite()).fold(f64::INFINITY, f64::min)
}

/// A lens with a scaled image.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaledLens {
    whole: Lens,
    scale: RadialScale,
}

impl ScaledLens {
    pub(super) fn new(whole: Lens, scale: RadialScale) -> Self {
        Self { whole, scale }
    }

    /// The lens before its image is scaled.
    #[must_use]
    pub fn whole(&self) -> &Lens {
        &self.whole
    }

    /// A distorted point before its image is scaled; `None` for one that nothing is scaled to.
    pub(super) fn unscaled(&self, distorted: DVec2) -> Option<DVec2> {
        self.scale.undo(distorted)
    }
}

impl LensClass for ScaledLens {
    fn altered(&self) -> Option<&Lens> {
        Some(&self.whole)
    }

    fn distort(&self, ideal: DVec2) -> DVec2 {
        self.scale.of(self.whole.distort(ideal))
    }

    fn jacobian(&self, ideal: DVec2) -> DMat2 {
        self.scale.jacobian(self.whole.distort(ideal)) * self.whole.jacobian(ideal)
    }

    fn undistort(&self, distorted: DVec2) -> Option<DVec2> {
        self.whole.undistort(self.unscaled(distorted)?)
    }

    fn image(&self, ray: DVec3) -> DVec2 {
        self.scale.of(self.whole.image(ray))
    }

    fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        let scale = self.scale.jacobian(self.whole.image(ray));
        self.whole.gradient(ray).map(|column| scale * column)
    }

    fn ray(&self, distorted: DVec2) -> Option<DVec3> {
        self.whole.ray(self.unscaled(distorted)?)
    }

    fn contains_ray(&self, ray: DVec3) -> bool {
        self.whole.contains_ray(ray) && self.scale.contains(self.whole.image(ray))
    }

    fn axial_magnification(&self) -> f64 {
        self.scale.terms[0] * self.whole.axial_magnification()
    }

    fn distorted_max(&self) -> f64 {
        // Both terms of the factor that grow are bounded where the branch ends.
        let end = self.whole.distorted_max();
        let r = (end * self.scale.unit.max_element()).min(self.scale.r_max);
        if r.is_finite() { end * self.scale.terms[0].max(self.scale.factor(r)) } else { f64::INFINITY }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use super::*;
    use crate::lens::LensModel;

    const TERMS: [[f64; 3]; 5] = [
        [1.002, 0.0, 0.0],
        [1.0003, -0.0004, 0.0007],
        [0.9991, 0.0, -0.002],
        [1.0, 0.3, -0.2],
        [1.1, -0.4, 0.1],
    ];

    #[test]
    fn the_inverse_undoes_the_scale() {
        for terms in TERMS {
            let scale = RadialScale::new(terms, DVec2::new(1.25, 1.31));
            for i in 0..400 {
                let distorted = DVec2::from_angle(f64::from(i)) * (f64::from(i) * 0.004);
                match scale.undo(scale.of(distorted)) {
                    Some(back) if scale.contains(distorted) => {
                        assert!(back.distance(distorted) < 1e-12, "{terms:?}: {distorted}");
                    }
                    found => assert!(!scale.contains(distorted) || found.is_some(), "{terms:?}: {distorted}"),
                }
            }
        }
        let folding = RadialScale::new([1.0, 0.0, -1.0 / 3.0], DVec2::ONE);
        assert!((folding.r_max - 1.0).abs() < 1e-15 && folding.undo(DVec2::new(0.67, 0.0)).is_none());
    }

    #[test]
    fn gradients_are_those_of_differences() {
        let lens = |terms| {
            let whole = Lens::new(LensModel::BrownConrady, &[-0.2, 0.05, 0.001, -0.002]).unwrap();
            ScaledLens::new(whole, RadialScale::new(terms, DVec2::new(1.2, 1.1)))
        };
        for terms in TERMS {
            let lens = lens(terms);
            for ray in [DVec3::new(0.0, 0.0, 1.0), DVec3::new(0.3, -0.2, 0.9), DVec3::new(-0.5, 0.4, 1.1)] {
                let columns = lens.gradient(ray);
                for (axis, column) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().zip(columns) {
                    let step = 1e-6;
                    // On the axis the slope changes with |r| where c is not 0.
                    let allowed = 1e-8 + if ray.z == 1.0 { 2.0 * step * terms[1].abs() } else { 0.0 };
                    let by_difference =
                        (lens.image(ray + step * axis) - lens.image(ray - step * axis)) / (2.0 * step);
                    assert!(
                        column.distance(by_difference) < allowed,
                        "{terms:?} {ray}: {column} {by_difference}"
                    );
                }
                let uv = ray.truncate() / ray.z;
                let jacobian = lens.jacobian(uv);
                let at_one = lens.gradient(uv.extend(1.0));
                assert!((jacobian.x_axis - at_one[0]).length() < 1e-14, "{terms:?}");
                assert!(lens.ray(lens.image(ray)).unwrap().distance(ray.normalize()) < 1e-12, "{terms:?}");
            }
        }
    }
}
