//! The inverse of a lens for many points at once, to the last bits as the inverse of single points.
//!
//! A lens that is a formula of a plane starts all points from a grid of solutions and gives them the same Newton
//! steps, which the compiler turns into vector instructions. The inverse of a rotation-symmetric lens is a table of
//! polynomials. A point that these do not solve, or that is not surely on the principal branch, is NaN here, and the
//! caller asks the inverse of single points: both answer the same points.

use glam::{DVec2, DVec3};

use super::{
    BrownConrady, DirectionLens, Lens, brown_conrady::Formula, circle::CircleLens, scaled::ScaledLens,
};

mod grid;
mod plane;
mod polynomials;
mod rotation_symmetric;

pub(super) use plane::PlaneFormula;

use grid::Grid;
use rotation_symmetric::RotationSymmetric;

/// Points of a block.
pub(crate) const BLOCK: usize = 64;

/// Fraction of the smallest border within which every point is surely on the principal branch: the border is known in
/// some directions only.
const SURELY_INSIDE: f64 = 0.99;

/// Points and their solutions, by coordinate.
#[derive(Clone, Debug)]
pub(crate) struct Block {
    /// Distorted points.
    pub image: [[f64; BLOCK]; 2],
    /// Points of the formula's plane.
    at: [[f64; BLOCK]; 2],
    /// Ideal points or rays; in the first coordinate NaN for what is not solved, infinity for what has none.
    pub solved: [[f64; BLOCK]; 3],
}

impl Default for Block {
    fn default() -> Self {
        Self { image: [[0.0; BLOCK]; 2], at: [[0.0; BLOCK]; 2], solved: [[f64::NAN; BLOCK]; 3] }
    }
}

/// What a lens prepares for many points.
#[derive(Clone, Debug)]
pub(crate) enum Bulk {
    /// No distortion.
    Pinhole,
    /// A formula of a plane.
    Plane(Grid),
    /// A function of the radius.
    RotationSymmetric(Box<RotationSymmetric>),
    /// A lens with a scaled image: of what it is before.
    Scaled(Box<Bulk>),
    /// A lens with an image circle: of what it is without.
    Circle(Box<Bulk>),
    /// Every point by itself.
    Singly,
}

impl Bulk {
    /// For distorted points in a rectangle; others are solved singly.
    pub(crate) fn new(lens: &Lens, low: DVec2, high: DVec2) -> Self {
        match lens {
            Lens::Pinhole(_) => Self::Pinhole,
            Lens::BrownConrady(one) => {
                Self::Plane(Grid::new(lens, &formula_of(one), [low, high], inside_of(one)))
            }
            Lens::Radial(one) => Self::RotationSymmetric(Box::new(RotationSymmetric::new(one, [low, high]))),
            Lens::Direction(one) => match one.plane() {
                Some(formula) => Self::Plane(Grid::new(lens, formula, [low, high], inside(one, formula))),
                None => Self::Singly,
            },
            Lens::Scaled(one) => {
                let corners = [low, high, DVec2::new(low.x, high.y), DVec2::new(high.x, low.y)]
                    .map(|corner| one.unscaled(corner).unwrap_or(corner));
                let [low, high] =
                    [DVec2::min, DVec2::max].map(|end| corners.into_iter().reduce(end).unwrap_or(low));
                Self::Scaled(Box::new(Self::new(one.whole(), low, high)))
            }
            Lens::Circle(one) => Self::Circle(Box::new(Self::new(one.whole(), low, high))),
            Lens::Face(_) => Self::Singly,
        }
    }

    /// Ideal points of a block.
    pub(crate) fn ideal(&self, lens: &Lens, block: &mut Block) {
        self.solve::<false>(lens, block);
    }

    /// Unit rays of a block.
    pub(crate) fn rays(&self, lens: &Lens, block: &mut Block) {
        self.solve::<true>(lens, block);
    }

    fn solve<const RAYS: bool>(&self, lens: &Lens, block: &mut Block) {
        match (self, lens) {
            (Self::Pinhole, _) => {
                pinhole(block);
                if RAYS {
                    plane::to_unit_length(block);
                }
            }
            (Self::Plane(grid), Lens::BrownConrady(lens)) => of_plane::<RAYS>(&formula_of(lens), grid, block),
            (Self::Plane(grid), Lens::Direction(lens)) => {
                if let Some(formula) = lens.plane() {
                    of_plane::<RAYS>(formula, grid, block);
                }
            }
            (Self::RotationSymmetric(tables), Lens::Radial(lens)) if RAYS => tables.rays(lens, block),
            (Self::RotationSymmetric(tables), Lens::Radial(lens)) => tables.ideal(lens, block),
            (Self::Scaled(whole), Lens::Scaled(lens)) => {
                scaled(lens, block, |block| whole.solve::<RAYS>(lens.whole(), block));
            }
            (Self::Circle(whole), Lens::Circle(lens)) => {
                whole.solve::<RAYS>(lens.whole(), block);
                within(lens, block, |[x, y, z]| DVec3::new(x, y, if RAYS { z } else { 1.0 }));
            }
            _ => block.solved[0].fill(f64::NAN),
        }
    }
}

fn of_plane<const RAYS: bool>(formula: &(impl PlaneFormula + ?Sized), grid: &Grid, block: &mut Block) {
    if RAYS { formula.rays(grid, block) } else { formula.ideal(grid, block) }
}

fn formula_of(lens: &BrownConrady) -> Formula {
    Formula::new(&lens.coefficients)
}

fn inside_of(lens: &BrownConrady) -> f64 {
    SURELY_INSIDE * lens.fold.smallest()
}

/// Radius of the formula's plane within which every point is on the principal branch.
fn inside(lens: &DirectionLens, formula: &dyn PlaneFormula) -> f64 {
    let (sin, cos) = (SURELY_INSIDE * lens.smallest_angle()).sin_cos();
    formula.position(DVec2::new(sin, 0.0).extend(cos)).length()
}

/// Solves points as they are before the image is scaled.
fn scaled(lens: &ScaledLens, block: &mut Block, solve: impl FnOnce(&mut Block)) {
    let image = block.image;
    let [x, y] = &mut block.image;
    for (x, y) in x.iter_mut().zip(y) {
        let before = lens.unscaled(DVec2::new(*x, *y)).unwrap_or(DVec2::NAN);
        (*x, *y) = (before.x, before.y);
    }
    solve(block);
    block.image = image;
}

/// Leaves what a lens shows.
fn within(lens: &CircleLens, block: &mut Block, ray: impl Fn([f64; 3]) -> DVec3) {
    for i in 0..BLOCK {
        let solved = [0, 1, 2].map(|k: usize| block.solved[k][i]);
        let image = DVec2::new(block.image[0][i], block.image[1][i]);
        if !solved[0].is_nan() && !lens.shows(ray(solved), image) {
            block.solved[0][i] = f64::INFINITY;
        }
    }
}

/// What is not finite has no inverse.
fn pinhole(block: &mut Block) {
    let [x, y] = &block.image;
    for i in 0..BLOCK {
        // NaN for infinities too.
        let zero = 0.0 * (x[i] + y[i]);
        block.solved[0][i] = x[i] + zero;
        block.solved[1][i] = y[i];
        block.solved[2][i] = 1.0;
    }
}

#[cfg(test)]
mod tests;
