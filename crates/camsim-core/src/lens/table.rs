//! A lens by a table of points: the spline through it, and its certified inverse.

use std::{f64::consts::PI, sync::Arc};

use glam::{DMat2, DVec2, DVec3};

use super::branch::{Branch, ChartMap};
use super::direction::{
    ClosedInverse, DirectionFormula, angles_gradient, angles_of, gradient_of_plane, ray_of,
};
use super::facts::{ModelFacts, Shape};
use super::fold::MAX_FIELD_RAD;
use super::spline::{LEAST_NODES, Spline};

pub(super) const FACTS: ModelFacts = ModelFacts {
    fix: "leave them out: the points are those of camera.lens_table",
    shape: |_| Shape::Table,
    point: "the spline through the points of `camera.lens_table`",
    field: "360",
    ..ModelFacts::NONE
};

/// How far outside of its grid a point still belongs to it, in nodes: rounding.
const ON_BORDER: f64 = 1e-6;

/// How a table states rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RayChart {
    /// Ideal `(u, v) = (x/z, y/z)`: less than 90 degrees off axis.
    Ideal,
    /// `theta (cos phi, sin phi)`: the angle off axis, radians, in the direction of the picture's axes.
    Angles,
}

/// What a table is a function of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GridOf {
    /// A grid of rays, with the distorted point of each.
    Rays,
    /// A grid of distorted points, with the ray of each.
    Points,
}

/// A regular grid of rays and distorted points, both in units of the focal length.
#[derive(Clone, Debug, PartialEq)]
pub struct LensGrid {
    chart: RayChart,
    of: GridOf,
    spline: Spline,
}

/// A table that is no lens.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LensGridError {
    /// Too few rows or columns.
    #[error("has {0} x {1} nodes; a spline needs {LEAST_NODES} along each axis")]
    TooFew(usize, usize),
    /// A value that is not a number.
    #[error("node {0} of the grid is not finite; fill the grid, or make it smaller")]
    NotFinite(usize),
    /// The grid does not hold the axis.
    #[error("does not hold (0, 0), the axis of the lens")]
    NoAxis,
    /// The lens is mirrored or singular on its axis.
    #[error(
        "is mirrored or singular on the axis: its determinant there is {0}; check the signs of its columns"
    )]
    Mirrored(f64),
}

impl LensGrid {
    /// A table from its values in rows, the first coordinate fastest, at `first + (i, j) * step`.
    ///
    /// # Errors
    /// The grid is no lens.
    pub fn new(
        chart: RayChart,
        of: GridOf,
        [first, step]: [DVec2; 2],
        count: [usize; 2],
        values: &[DVec2],
    ) -> Result<Self, LensGridError> {
        if let Some(node) = values.iter().position(|value| !value.is_finite()) {
            return Err(LensGridError::NotFinite(node));
        }
        let spline =
            Spline::new(first, step, count, values).ok_or(LensGridError::TooFew(count[0], count[1]))?;
        // Written so that NaN counts as outside.
        if spline.inside(DVec2::ZERO) > 0.0 {
            let determinant = spline.at(DVec2::ZERO).1.determinant();
            let is_lens = determinant > 0.0;
            is_lens.then_some(Self { chart, of, spline }).ok_or(LensGridError::Mirrored(determinant))
        } else {
            Err(LensGridError::NoAxis)
        }
    }

    /// Whether a point belongs to the grid.
    fn holds(&self, at: DVec2) -> bool {
        self.spline.inside(at) >= -ON_BORDER
    }

    fn ray(&self, at: DVec2) -> DVec3 {
        match self.chart {
            RayChart::Ideal => at.extend(1.0).normalize(),
            RayChart::Angles => ray_of(at),
        }
    }

    /// The ray in the table's chart; `None` for one that the chart lacks.
    fn position(&self, ray: DVec3) -> Option<DVec2> {
        match self.chart {
            RayChart::Ideal => (ray.z > 0.0).then(|| ray.truncate() / ray.z),
            RayChart::Angles => Some(angles_of(ray)),
        }
    }

    /// `d position / d (x, y, z)`, then a linear map.
    fn gradient(&self, ray: DVec3, then: DMat2) -> [DVec2; 3] {
        match self.chart {
            RayChart::Ideal => gradient_of_plane(then, ray),
            RayChart::Angles => angles_gradient(ray).map(|column| then * column),
        }
    }
}

/// The formula of a table.
pub(super) fn formula(grid: &Arc<LensGrid>) -> Arc<dyn DirectionFormula> {
    match grid.of {
        GridOf::Rays => Arc::new(OfRays(grid.clone())),
        GridOf::Points => {
            let reach = grid.spline.reach();
            let branch = Branch::new(&Points(grid), reach, reach);
            Arc::new(OfPoints { grid: grid.clone(), branch })
        }
    }
}

/// The distorted point is the spline.
#[derive(Debug)]
struct OfRays(Arc<LensGrid>);

impl DirectionFormula for OfRays {
    fn image(&self, ray: DVec3) -> DVec2 {
        match self.0.position(ray) {
            Some(at) if self.0.holds(at) => self.0.spline.at(at).0,
            _ => DVec2::NAN,
        }
    }

    fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        match self.0.position(ray) {
            Some(at) if self.0.holds(at) => self.0.gradient(ray, self.0.spline.at(at).1),
            _ => [DVec2::NAN; 3],
        }
    }

    fn margin(&self, ray: DVec3) -> f64 {
        self.0.position(ray).map_or(-1.0, |at| self.0.spline.inside(at) + ON_BORDER)
    }

    fn angle_max(&self) -> f64 {
        match self.0.chart {
            RayChart::Ideal => MAX_FIELD_RAD,
            RayChart::Angles => PI,
        }
    }
}

/// The ray is the spline; the distorted point is its certified inverse.
#[derive(Debug)]
struct OfPoints {
    grid: Arc<LensGrid>,
    branch: Branch,
}

/// The spline as a map of the distorted plane.
struct Points<'a>(&'a LensGrid);

impl ChartMap for Points<'_> {
    fn value(&self, at: DVec2) -> DVec2 {
        self.0.spline.at(at).0
    }

    fn jacobian(&self, at: DVec2) -> DMat2 {
        self.0.spline.at(at).1
    }

    fn margin(&self, at: DVec2) -> f64 {
        self.0.spline.inside(at) + ON_BORDER
    }
}

impl OfPoints {
    fn solve(&self, ray: DVec3) -> Option<DVec2> {
        self.branch.solve(&Points(&self.grid), self.grid.position(ray)?)
    }
}

impl DirectionFormula for OfPoints {
    fn image(&self, ray: DVec3) -> DVec2 {
        self.solve(ray).unwrap_or(DVec2::NAN)
    }

    fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        match self.solve(ray) {
            Some(at) => self.grid.gradient(ray, self.grid.spline.at(at).1.inverse()),
            None => [DVec2::NAN; 3],
        }
    }

    fn closed_inverse(&self) -> Option<&dyn ClosedInverse> {
        Some(self)
    }
}

impl ClosedInverse for OfPoints {
    fn ray(&self, distorted: DVec2) -> Option<DVec3> {
        let is_inside = self.branch.contains(&Points(&self.grid), distorted);
        is_inside.then(|| self.grid.ray(self.grid.spline.at(distorted).0))
    }

    /// Where the line from the axis first crosses the rim.
    fn ideal_radius(&self, phi_rad: f64) -> Option<f64> {
        let axis = DVec2::from_angle(phi_rad);
        let rim = self.branch.rim();
        let sides = rim.iter().zip(rim.iter().cycle().skip(1));
        let crossing = sides.filter_map(|(a, b)| {
            let (from, to) = (axis.perp_dot(*a), axis.perp_dot(*b));
            let position = a.lerp(*b, from / (from - to)).dot(axis);
            (from * to <= 0.0 && from != to && position > 0.0).then_some(position)
        });
        let radius = crossing.fold(f64::INFINITY, f64::min);
        let is_plane = self.grid.chart == RayChart::Ideal;
        let angle = if is_plane { radius.atan() } else { radius };
        (angle < MAX_FIELD_RAD).then(|| angle.tan())
    }
}
