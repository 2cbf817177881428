//! Newton's steps for blocks of points.

use glam::{DMat2, DVec2, DVec3};

use super::{BLOCK, Block, grid::Grid};
use crate::{lens::MAX_FIELD_RAD, simd::with_widest};

/// Largest residual of a solution, in units of the focal length: the rounding of a formula. Points about which it is
/// larger are solved singly.
const MAX_RESIDUAL: f64 = 2e-15;
/// Steps before the first test, and steps in all.
const STEPS: [usize; 2] = [2, 4];

/// A lens as a smooth map of a plane of its own, to which rays belong in closed form.
///
/// The functions of blocks are compiled for each formula: no implementation replaces them. A formula's own functions
/// are `#[inline(always)]`, so that the loops become vector instructions.
pub(in crate::lens) trait PlaneFormula: Sync {
    /// Distorted point and Jacobian of a point of the plane.
    fn value_and_jacobian(&self, at: DVec2) -> (DVec2, DMat2);

    /// The point of a ray of any length.
    fn position(&self, ray: DVec3) -> DVec2;

    /// A ray of a point, of any length.
    fn ray(&self, at: DVec2) -> DVec3;

    /// Ideal points of a block.
    fn ideal(&self, grid: &Grid, block: &mut Block) {
        with_widest(
            #[inline(always)]
            || {
                solve(self, grid, block);
                finish_ideal(self, block);
            },
        );
    }

    /// Unit rays of a block.
    fn rays(&self, grid: &Grid, block: &mut Block) {
        with_widest(
            #[inline(always)]
            || {
                solve(self, grid, block);
                finish_rays(self, block);
            },
        );
    }
}

/// Solutions in the formula's plane.
#[inline(always)]
fn solve(formula: &(impl PlaneFormula + ?Sized), grid: &Grid, block: &mut Block) {
    grid.start(block);
    let mut is_solved = false;
    for step in 0..STEPS[1] {
        if step < STEPS[0] || !is_solved {
            newton(formula, block);
        }
        if step + 1 >= STEPS[0] && !is_solved {
            is_solved = certify(formula, block, grid.inside);
        }
    }
}

/// A Newton step of every point.
#[inline(always)]
fn newton(formula: &(impl PlaneFormula + ?Sized), block: &mut Block) {
    let [x, y] = &block.image;
    let [u, v] = &mut block.at;
    for i in 0..BLOCK {
        let (value, jacobian) = formula.value_and_jacobian(DVec2::new(u[i], v[i]));
        let (off_x, off_y) = (value.x - x[i], value.y - y[i]);
        let (a, c, b, d) = (jacobian.x_axis.x, jacobian.x_axis.y, jacobian.y_axis.x, jacobian.y_axis.y);
        let inverse = 1.0 / (a * d - b * c);
        u[i] -= (d * off_x - b * off_y) * inverse;
        v[i] -= (a * off_y - c * off_x) * inverse;
    }
}

/// Sets points to NaN that do not reproduce their image or are not within a radius; returns whether all remain.
#[inline(always)]
fn certify(formula: &(impl PlaneFormula + ?Sized), block: &mut Block, inside: f64) -> bool {
    let ([x, y], [u, v]) = (&block.image, &block.at);
    let mut missing = 0;
    for i in 0..BLOCK {
        let (value, _) = formula.value_and_jacobian(DVec2::new(u[i], v[i]));
        let (off_x, off_y) = (value.x - x[i], value.y - y[i]);
        let most = MAX_RESIDUAL * MAX_RESIDUAL * (1.0 + x[i] * x[i] + y[i] * y[i]);
        // False for NaN.
        let is_solved = off_x * off_x + off_y * off_y <= most;
        let is_inside = u[i] * u[i] + v[i] * v[i] < inside * inside;
        block.solved[0][i] = if is_solved & is_inside { u[i] } else { f64::NAN };
        missing += u64::from(!(is_solved & is_inside));
    }
    missing == 0
}

/// Ideal points of certified points.
#[inline(always)]
fn finish_ideal(formula: &(impl PlaneFormula + ?Sized), block: &mut Block) {
    let least2 = MAX_FIELD_RAD.cos() * MAX_FIELD_RAD.cos();
    let at_v = &block.at[1];
    let [u, v, _] = &mut block.solved;
    for i in 0..BLOCK {
        let ray = formula.ray(DVec2::new(u[i], at_v[i]));
        let is_there = (ray.z > 0.0) & (ray.z * ray.z > least2 * ray.length_squared());
        u[i] = if is_there { ray.x / ray.z } else { f64::NAN };
        v[i] = ray.y / ray.z;
    }
}

/// Rays of certified points.
#[inline(always)]
fn finish_rays(formula: &(impl PlaneFormula + ?Sized), block: &mut Block) {
    let v = &block.at[1];
    let [x, y, z] = &mut block.solved;
    for i in 0..BLOCK {
        let ray = formula.ray(DVec2::new(x[i], v[i]));
        (x[i], y[i], z[i]) = (ray.x, ray.y, ray.z);
    }
    to_unit_length(block);
}

/// Makes rays unit rays.
#[inline(always)]
pub(super) fn to_unit_length(block: &mut Block) {
    let [x, y, z] = &mut block.solved;
    for i in 0..BLOCK {
        let inverse = 1.0 / (x[i] * x[i] + y[i] * y[i] + z[i] * z[i]).sqrt();
        x[i] *= inverse;
        y[i] *= inverse;
        z[i] *= inverse;
    }
}
