//! Inverses of rotation-symmetric lenses, as functions of the distorted radius.

use glam::DVec2;

use super::{BLOCK, Block, polynomials::Polynomials};
use crate::lens::RadialLens;
use crate::lens::class::LensClass;

/// Largest residual of a tabulated angle, relative to the distorted radius.
const MAX_RESIDUAL: f64 = 1.5e-15;
/// Largest difference from the inverse of single points, relative: it is larger beside a fold, where the radius
/// hardly depends on the angle.
const MAX_DIFFERENCE: f64 = 1e-12;

/// Functions of the distorted radius r.
#[derive(Clone, Debug)]
pub(crate) struct RotationSymmetric {
    /// Ideal radius over r.
    ideal: Polynomials,
    /// Sine of the angle off axis over r.
    sin: Polynomials,
    /// Its cosine.
    cos: Polynomials,
}

impl RotationSymmetric {
    pub(super) fn new(lens: &RadialLens, [low, high]: [DVec2; 2]) -> Self {
        let corners = [low, high, DVec2::new(low.x, high.y), DVec2::new(high.x, low.y)];
        let reach = corners.into_iter().map(|at| lens.without_linear(at).length()).fold(0.0, f64::max);
        let [of_plane, of_rays] = [lens.theta_max_rad(), lens.angle_max_rad()];
        // A pole has no radius.
        let end = |angle: f64| reach.min(Some(lens.radius(angle)).filter(|r| *r > 0.0).unwrap_or(reach));
        let ideal_of = |r: f64| lens.angle_of(r, of_plane).tan() / r;
        let mut ideal = Polynomials::new(end(of_plane), ideal_of);
        ideal.keep(|table, r| {
            let found = table.at(r);
            is_root(lens, (found * r).atan(), r) && is_near(found, ideal_of(r))
        });
        let angle = |r: f64| lens.angle_of(r, of_rays);
        let mut sin = Polynomials::new(end(of_rays), |r| angle(r).sin() / r);
        let cos = Polynomials::new(end(of_rays), |r| angle(r).cos());
        sin.keep(|table, r| {
            let (sin, cos, wanted) = (table.at(r) * r, cos.at(r), angle(r));
            is_root(lens, sin.atan2(cos), r)
                && is_near(sin.atan2(cos), wanted)
                && (sin * sin + cos * cos - 1.0).abs() < 1e-15
        });
        Self { ideal, sin, cos }
    }

    pub(super) fn ideal(&self, lens: &RadialLens, block: &mut Block) {
        straighten(lens, block);
        let [x, y] = &block.at;
        for i in 0..BLOCK {
            let ratio = self.ideal.at((x[i] * x[i] + y[i] * y[i]).sqrt());
            block.solved[0][i] = x[i] * ratio;
            block.solved[1][i] = y[i] * ratio;
        }
    }

    pub(super) fn rays(&self, lens: &RadialLens, block: &mut Block) {
        straighten(lens, block);
        let [x, y] = &block.at;
        for i in 0..BLOCK {
            let r = (x[i] * x[i] + y[i] * y[i]).sqrt();
            let ratio = self.sin.at(r);
            block.solved[0][i] = x[i] * ratio;
            block.solved[1][i] = y[i] * ratio;
            block.solved[2][i] = self.cos.at(r);
        }
    }
}

/// Undoes the linear map of the image.
fn straighten(lens: &RadialLens, block: &mut Block) {
    if lens.is_linear_identity() {
        block.at = block.image;
        return;
    }
    for i in 0..BLOCK {
        let at = lens.without_linear(DVec2::new(block.image[0][i], block.image[1][i]));
        (block.at[0][i], block.at[1][i]) = (at.x, at.y);
    }
}

/// False for NaN, as the next.
fn is_root(lens: &RadialLens, angle: f64, r: f64) -> bool {
    (lens.radius(angle) - r).abs() <= MAX_RESIDUAL * r
}

fn is_near(found: f64, wanted: f64) -> bool {
    (found - wanted).abs() <= MAX_DIFFERENCE * wanted.abs()
}
