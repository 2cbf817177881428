//! Panorama: longitude and latitude of the ray about the vertical of the picture; COLMAP's EQUIRECTANGULAR with
//! `focal_px = W / (2 pi)`.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use super::direction::{ClosedInverse, DirectionFormula, direction};
use super::facts::ModelFacts;

pub(super) const FACTS: ModelFacts = ModelFacts {
    fix: "leave them out: W / (2 pi) as camera.focal_px shows all around",
    shape: |_| direction(Equirectangular),
    foreign: &["equirectangular", "spherical"],
    foreign_counts: &[0],
    point: "longitude and latitude, `(atan2(x, z), atan2(y, hypot(x, z)))`; `focal_px = W / (2 pi)` shows all around",
    authority: "COLMAP `EQUIRECTANGULAR`",
    field: "all",
    ..ModelFacts::NONE
};

/// `(atan2(x, z), atan2(y, hypot(x, z)))`.
#[derive(Debug)]
struct Equirectangular;

impl DirectionFormula for Equirectangular {
    fn image(&self, ray: DVec3) -> DVec2 {
        DVec2::new(ray.x.atan2(ray.z), ray.y.atan2(ray.x.hypot(ray.z)))
    }

    fn gradient(&self, ray: DVec3) -> [DVec2; 3] {
        let (level2, n2) = (ray.x * ray.x + ray.z * ray.z, ray.length_squared());
        let level = level2.sqrt();
        let climb = -ray.y / (level * n2);
        [
            DVec2::new(ray.z / level2, climb * ray.x),
            DVec2::new(0.0, level / n2),
            DVec2::new(-ray.x / level2, climb * ray.z),
        ]
    }

    fn closed_inverse(&self) -> Option<&dyn ClosedInverse> {
        Some(self)
    }
}

impl ClosedInverse for Equirectangular {
    fn ray(&self, distorted: DVec2) -> Option<DVec3> {
        let (sin, cos) = distorted.y.sin_cos();
        let (east, north) = distorted.x.sin_cos();
        let is_there = distorted.x.abs() <= PI && distorted.y.abs() <= 0.5 * PI;
        is_there.then(|| DVec3::new(cos * east, sin, cos * north))
    }

    fn ideal_radius(&self, _phi_rad: f64) -> Option<f64> {
        None
    }
}
