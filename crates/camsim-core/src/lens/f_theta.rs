//! F-theta polynomials of NVIDIA's simulators (gsplat's `FThetaCameraDistortionParameters`, DriveWorks, NCore):
//! one of the two, named by `reference_poly`, is the definition. There they are in pixels; here the distorted
//! radius is in units of the focal length.

use std::{f64::consts::PI, sync::Arc};

use glam::{DMat2, DVec2};

use super::facts::{ModelFacts, Shape};
use super::radial::RadialFormula;

pub(super) const FACTS: ModelFacts = ModelFacts {
    coefficients: &["k1", "k2", "k3", "k4", "k5", "c", "d", "e", "max_angle"],
    defaults: &[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0],
    fix: "the polynomial has five terms, then c d e of the linear map and the largest angle in radians",
    shape: |k| shape(k, FTheta { k: polynomial(k), angle_max: angle_max(k) }),
    point: "`[[c, d], [e, 1]] (k1 t + .. + k5 t^5) e`",
    authority: "NVIDIA's `angle_to_pixeldist_poly`, over the focal length",
    field: "360",
    ..ModelFacts::NONE
};

pub(super) const INVERSE_FACTS: ModelFacts = ModelFacts {
    shape: |k| shape(k, FThetaInverse::new(polynomial(k), angle_max(k))),
    point: "as before, with `t = k1 p + .. + k5 p^5` for the length p",
    authority: "NVIDIA's `pixeldist_to_angle_poly`",
    ..FACTS
};

/// The image is `[[c, d], [e, 1]]` times the symmetric lens's.
fn shape(k: &[f64], formula: impl RadialFormula + 'static) -> Shape {
    Shape::Radial(Arc::new(formula), DMat2::from_cols(DVec2::new(k[5], k[7]), DVec2::new(k[6], 1.0)))
}

fn polynomial(k: &[f64]) -> [f64; 5] {
    [k[0], k[1], k[2], k[3], k[4]]
}

/// 0 stands for no limit.
fn angle_max(k: &[f64]) -> f64 {
    if k[8] > 0.0 { k[8] } else { PI }
}

/// `k1 x + ... + k5 x^5` and its derivative.
fn value_and_slope([k1, k2, k3, k4, k5]: [f64; 5], x: f64) -> [f64; 2] {
    [
        x * (k1 + x * (k2 + x * (k3 + x * (k4 + x * k5)))),
        k1 + x * (2.0 * k2 + x * (3.0 * k3 + x * (4.0 * k4 + x * 5.0 * k5))),
    ]
}

/// `r = k1 t + ... + k5 t^5`.
#[derive(Debug)]
struct FTheta {
    k: [f64; 5],
    angle_max: f64,
}

impl RadialFormula for FTheta {
    fn radius(&self, angle: f64) -> f64 {
        value_and_slope(self.k, angle)[0]
    }

    fn slope(&self, angle: f64) -> f64 {
        value_and_slope(self.k, angle)[1]
    }

    fn angle_max(&self) -> f64 {
        self.angle_max
    }
}

/// `t = k1 r + ... + k5 r^5` up to the radius at which the polynomial stops growing.
#[derive(Debug)]
struct FThetaInverse {
    k: [f64; 5],
    radius_max: f64,
    angle_max: f64,
}

impl FThetaInverse {
    fn new(k: [f64; 5], angle_max: f64) -> Self {
        let radius_max = end_of_growth(k);
        let reached = value_and_slope(k, radius_max)[0];
        // Written so that NaN counts as nothing.
        let reached = if reached > 0.0 { reached } else { 0.0 };
        Self { k, radius_max, angle_max: angle_max.min(reached) }
    }
}

/// Radius up to which a polynomial grows, or at which it has passed 180 degrees.
fn end_of_growth(k: [f64; 5]) -> f64 {
    // No step is longer than a hundredth of what the slope on the axis needs for 180 degrees.
    let step = 0.01 * PI / k[0].abs().max(1e-3);
    let mut radius = 0.0;
    for _ in 0..20_000 {
        let [angle, slope] = value_and_slope(k, radius + step);
        if slope.is_nan() || slope <= 0.0 {
            let (mut low, mut high) = (radius, radius + step);
            for _ in 0..60 {
                let middle = 0.5 * (low + high);
                *(if value_and_slope(k, middle)[1] > 0.0 { &mut low } else { &mut high }) = middle;
            }
            return low;
        }
        radius += step;
        if angle > PI {
            break;
        }
    }
    radius
}

impl RadialFormula for FThetaInverse {
    fn radius(&self, angle: f64) -> f64 {
        if angle.is_nan() || angle > value_and_slope(self.k, self.radius_max)[0] {
            return f64::NAN;
        }
        let (mut low, mut high) = (0.0, self.radius_max);
        let mut radius = (angle / self.k[0]).clamp(low, high);
        for _ in 0..60 {
            let [reached, slope] = value_and_slope(self.k, radius);
            let error = reached - angle;
            *(if error > 0.0 { &mut high } else { &mut low }) = radius;
            let newton = radius - error / slope;
            let next = if newton >= low && newton <= high { newton } else { 0.5 * (low + high) };
            let moved = (next - radius).abs();
            radius = next;
            if moved <= 2e-16 * radius {
                break;
            }
        }
        radius
    }

    fn slope(&self, angle: f64) -> f64 {
        value_and_slope(self.k, self.radius(angle))[1].recip()
    }

    fn angle_max(&self) -> f64 {
        self.angle_max
    }
}
