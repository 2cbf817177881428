//! COLMAP's RAD_TAN_THIN_PRISM_FISHEYE (model 11), Project Aria's Fisheye624: "Camera Intrinsic Models", section
//! FisheyeRadTanThinPrism of the documentation of projectaria_tools.

use glam::{DMat2, DVec2, DVec3};

use super::direction::{DirectionFormula, angles_gradient, angles_of, direction};
use super::facts::ModelFacts;

pub(super) const FACTS: ModelFacts = ModelFacts {
    coefficients: &["k0", "k1", "k2", "k3", "k4", "k5", "p0", "p1", "s0", "s1", "s2", "s3"],
    fix: "six radial, two tangential and four thin-prism terms; the focal length is camera.focal_px",
    shape: |k| {
        direction(Fisheye624 {
            k: [k[0], k[1], k[2], k[3], k[4], k[5]],
            p: DVec2::new(k[6], k[7]),
            s: [k[8], k[9], k[10], k[11]],
        })
    },
    foreign: &["radtanthinprismfisheye", "fisheye624", "fisheyeradtanthinprism"],
    foreign_counts: &[12],
    point: "`w = (1 + k0 t^2 + .. + k5 t^12) t e`, q = \\|w\\|^2: `w + 2 (w.p) w + q p + (s0 q + s1 q^2, s2 q + s3 q^2)`",
    authority: "COLMAP `RAD_TAN_THIN_PRISM_FISHEYE` (id 11); Project Aria Fisheye624",
    field: "360",
    ..ModelFacts::NONE
};

/// With `w = (1 + k0 t^2 + ... + k5 t^12) t e` and `q = |w|^2`:
/// `image = w + 2 (w . p) w + q p + (s0 q + s1 q^2, s2 q + s3 q^2)`.
#[derive(Debug)]
struct Fisheye624 {
    k: [f64; 6],
    p: DVec2,
    s: [f64; 4],
}

impl Fisheye624 {
    /// Radial factor and its derivative by `t^2`.
    fn radial(&self, t2: f64) -> [f64; 2] {
        let [k0, k1, k2, k3, k4, k5] = self.k;
        [
            1.0 + t2 * (k0 + t2 * (k1 + t2 * (k2 + t2 * (k3 + t2 * (k4 + t2 * k5))))),
            k0 + t2 * (2.0 * k1 + t2 * (3.0 * k2 + t2 * (4.0 * k3 + t2 * (5.0 * k4 + t2 * 6.0 * k5)))),
        ]
    }

    /// Image of `w` and its Jacobian.
    fn decentred(&self, w: DVec2) -> (DVec2, DMat2) {
        let ([s0, s1, s2, s3], q) = (self.s, w.length_squared());
        let along = w.dot(self.p);
        let image = w + w * (2.0 * along) + self.p * q + DVec2::new(s0 + s1 * q, s2 + s3 * q) * q;
        let rate = 2.0 * (self.p + DVec2::new(s0 + 2.0 * s1 * q, s2 + 2.0 * s3 * q));
        let outer = |a: DVec2, b: DVec2| DMat2::from_cols(a * b.x, a * b.y);
        (image, DMat2::IDENTITY * (1.0 + 2.0 * along) + outer(2.0 * w, self.p) + outer(rate, w))
    }
}

impl DirectionFormula for Fisheye624 {
    fn image(&self, ray: DVec3) -> DVec2 {
        let angles = angles_of(ray);
        self.decentred(angles * self.radial(angles.length_squared())[0]).0
    }

    fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        let angles = angles_of(ray);
        let [factor, rate] = self.radial(angles.length_squared());
        let (_, of_w) = self.decentred(angles * factor);
        angles_gradient(ray)
            .map(|column| of_w * (column * factor + angles * (2.0 * rate * angles.dot(column))))
    }
}
