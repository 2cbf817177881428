//! A lens by a table of points.

use super::facts::{ModelFacts, Shape};

pub(super) const FACTS: ModelFacts = ModelFacts {
    name: "table",
    coefficients: &[],
    defaults: &[],
    fix: "leave them out: the points are those of camera.lens_table",
    shape: |_| Shape::Table,
};
