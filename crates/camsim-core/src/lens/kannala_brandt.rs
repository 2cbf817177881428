//! Kannala-Brandt: the equidistant polynomial of OpenCV's fisheye module.

use super::facts::ModelFacts;
use super::radial::{RadialFormula, radial};

pub(super) const FACTS: ModelFacts = ModelFacts {
    coefficients: &["k1", "k2", "k3", "k4"],
    fix: "leave the others out, or set model = \"brown-conrady\"",
    shape: |k| radial(KannalaBrandt { k: [k[0], k[1], k[2], k[3]] }),
    foreign: &["equidistant", "equi", "fisheye", "kannalabrandt", "kannalabrandt4", "kannalabrandt8", "kb4"],
    foreign_counts: &[0, 4],
    point: "`t (1 + k1 t^2 + k2 t^4 + k3 t^6 + k4 t^8) e`",
    authority: "OpenCV `fisheye`; Kalibr `equidistant`; COLMAP `OPENCV_FISHEYE`",
    field: "360",
    ..ModelFacts::NONE
};

/// `theta_d = theta (1 + k1 theta^2 + k2 theta^4 + k3 theta^6 + k4 theta^8)`, theta up to 180 degrees.
#[derive(Debug)]
struct KannalaBrandt {
    k: [f64; 4],
}

impl RadialFormula for KannalaBrandt {
    fn radius(&self, theta: f64) -> f64 {
        let [k1, k2, k3, k4] = self.k;
        let t2 = theta * theta;
        theta * (1.0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * k4))))
    }

    fn slope(&self, theta: f64) -> f64 {
        let [k1, k2, k3, k4] = self.k;
        let t2 = theta * theta;
        1.0 + t2 * (3.0 * k1 + t2 * (5.0 * k2 + t2 * (7.0 * k3 + t2 * 9.0 * k4)))
    }
}
