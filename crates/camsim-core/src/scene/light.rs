//! Sun and sky on request: how much of the light a surface sends back, besides its colour (Lambert).
//!
//! `I(n) = sun max(0, n.s) + sky (1 + n.up) / 2`, with s towards the sun: a plane that is met at right angles
//! by the sun has `sun` of its albedo, and one that faces upwards all of `sky`. No shadows and no gloss: it
//! depends on the surface's point (and its side) alone, so that a point keeps its brightness wherever it is
//! seen from, and whenever.
//!
//! Models interpolate the normals of their corners and take I of what that gives, *not made a unit vector
//! again*: I is then at most `sun + sky / 2` times as different as two normals are, which is what their
//! levels of detail are bounded by. The ground has it in its picture.

use glam::{DMat3, DVec3};

mod ground;
#[cfg(test)]
mod ground_tests;

/// Where light comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Unit vector towards the sun, NED.
    pub to_sun_ned: DVec3,
    /// What is left of a colour where the sun meets it at right angles; 0..=1.
    pub sun: f64,
    /// What an open sky adds to a face that looks up; 0..=1, with the sun's at most 1.
    pub sky: f64,
}

impl Light {
    /// `azimuth_rad` is east of north, `elevation_rad` above the horizon.
    #[must_use]
    pub fn new(azimuth_rad: f64, elevation_rad: f64, sun: f64, sky: f64) -> Self {
        let (sin, cos) = azimuth_rad.sin_cos();
        let to_sun_ned =
            DVec3::new(elevation_rad.cos() * cos, elevation_rad.cos() * sin, -elevation_rad.sin());
        Self { to_sun_ned, sun, sky }
    }

    /// Factor of a colour where the outward normal is this, 0..=1; shorter than a unit vector where it lies
    /// between corners.
    #[must_use]
    pub fn on(&self, normal_ned: DVec3) -> f64 {
        (self.sun * normal_ned.dot(self.to_sun_ned).max(0.0) + self.sky * 0.5 * (1.0 - normal_ned.z))
            .clamp(0.0, 1.0)
    }
}

/// Where a normal in a shape's axes points once the shape stands: by the cofactors of its matrix, which are
/// its inverse's transpose but for the length. Zero where a matrix leaves nothing of it.
#[must_use]
pub fn turned_normal(ned_from_shape: &DMat3, normal: DVec3) -> DVec3 {
    let [x, y, z] = [0, 1, 2].map(|axis| ned_from_shape.row(axis));
    let cofactors = [y.cross(z), z.cross(x), x.cross(y)];
    // Mirrored triangles are turned back; their normals are not.
    let sign = if x.dot(cofactors[0]) < 0.0 { -1.0 } else { 1.0 };
    (sign * DVec3::from_array(cofactors.map(|row| row.dot(normal)))).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    #[test]
    fn light_has_its_closed_form() {
        // From the south-west, 30 degrees up.
        let light = Light::new(225_f64.to_radians(), 30_f64.to_radians(), 0.7, 0.3);
        let (cos, sin) = (0.75_f64.sqrt(), 0.5);
        assert!(
            (light.to_sun_ned - DVec3::new(-cos * 0.5_f64.sqrt(), -cos * 0.5_f64.sqrt(), -sin)).length()
                < 1e-12
        );
        // Level ground, a ceiling, walls to the sun, away from it and past it.
        let wall = DVec3::new(-0.5_f64.sqrt(), -0.5_f64.sqrt(), 0.0);
        for (normal, expected) in [
            (DVec3::NEG_Z, 0.7 * sin + 0.3),
            (DVec3::Z, 0.0),
            (wall, 0.7 * cos + 0.15),
            (-wall, 0.15),
            (DVec3::NEG_X, 0.7 * cos * 0.5_f64.sqrt() + 0.15),
            (light.to_sun_ned, 0.7 + 0.3 * 0.75),
            (DVec3::ZERO, 0.15),
        ] {
            assert!((light.on(normal) - expected).abs() < 1e-12, "{normal}: {} {expected}", light.on(normal));
        }
    }

    #[test]
    fn light_differs_no_more_than_normals_do() {
        let light = Light::new(1.0, 0.6, 0.8, 0.2);
        let within_ball = |k: u32| {
            let [a, b, c, d] =
                crate::noise::pcg4d([k, 5, 2, 9]).map(|bits| f64::from(bits >> 8) / f64::from(1 << 24));
            DQuat::from_rotation_z(7.0 * a)
                * DQuat::from_rotation_x(7.0 * b)
                * DVec3::new(c.cbrt(), 0.0, 0.0)
                * (0.5 + 0.5 * d)
        };
        for k in 0..2000 {
            let (m, n) = (within_ball(2 * k), within_ball(2 * k + 1));
            assert!((light.on(m) - light.on(n)).abs() <= 0.9 * (m - n).length() + 1e-12, "{m} {n}");
        }
    }

    #[test]
    fn normals_stay_across_their_surfaces() {
        let (along, across) = (DVec3::new(1.0, 2.0, -0.5), DVec3::new(-0.3, 0.7, 1.1));
        let normal = along.cross(across).normalize();
        let turn = DMat3::from_quat(DQuat::from_rotation_z(0.4) * DQuat::from_rotation_x(1.9));
        for (scale, mirrored) in [
            ([2.0, 2.0, 2.0], false),
            ([1.0, 5.0, 0.2], false),
            ([-1.0, 3.0, 1.0], true),
            ([1e-6, -1e-6, -1e-6], false),
        ] {
            let matrix = turn * DMat3::from_diagonal(DVec3::from_array(scale));
            let (a, b) = (matrix * along, matrix * across);
            let found = turned_normal(&matrix, normal);
            assert!(
                (found.length() - 1.0).abs() < 1e-12
                    && found.dot(a.normalize()).abs() < 1e-12
                    && found.dot(b.normalize()).abs() < 1e-12
            );
            // The side that it is on moves along with it.
            assert!(found.dot(matrix * normal) > 0.0, "{scale:?}");
            assert_eq!(found.dot(a.cross(b)) < 0.0, mirrored);
        }
        assert_eq!(turned_normal(&DMat3::ZERO, normal), DVec3::ZERO);
    }
}
