//! Sun and sky light with the Lambert model: the factor on the colour of a surface.
//!
//! `I(n) = sun max(0, n.s) + sky (1 + n.up) / 2`, with s towards the sun. A surface facing the sun gets `sun`
//! of its albedo, a surface facing upwards all of `sky`. There is no gloss, so the factor depends on the
//! surface point and its side only; a point has the same brightness from everywhere and, unless the shadow of
//! something that moves passes over it, at all times.
//!
//! With shadows the first term is dropped where anything lies between the point and the sun, and where the
//! triangle faces away from the sun, whatever its vertices' normals.
//!
//! Meshes interpolate the normals of their vertices and evaluate I for the result *without normalising it*: I
//! then differs by at most `sun + sky / 2` times the difference of the normals, which bounds the error of the
//! levels of detail. On the terrain, light is baked into the texture; in its shadows the texture is multiplied by
//! the fraction of the light that is the sky's ([`Terrain::sky_fraction`](super::Terrain::sky_fraction)).

use glam::{DMat3, DVec3};

mod bake;
#[cfg(test)]
mod bake_tests;

/// Directional sun light and ambient sky light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Unit vector towards the sun, NED.
    pub to_sun_ned: DVec3,
    /// Factor on the colour of a surface that faces the sun; 0..=1.
    pub sun: f64,
    /// Factor added by the sky to a surface that faces upwards; 0..=1, together with the sun at most 1.
    pub sky: f64,
    /// Whether surfaces keep the sun from what is behind them.
    pub shadows: bool,
}

impl Light {
    /// `azimuth_rad` is east of north, `elevation_rad` above the horizon.
    #[must_use]
    pub fn new(azimuth_rad: f64, elevation_rad: f64, sun: f64, sky: f64) -> Self {
        let (sin, cos) = azimuth_rad.sin_cos();
        let to_sun_ned =
            DVec3::new(elevation_rad.cos() * cos, elevation_rad.cos() * sin, -elevation_rad.sin());
        Self { to_sun_ned, sun, sky, shadows: false }
    }

    /// The same light with shadows, or without.
    #[must_use]
    pub fn with_shadows(self, shadows: bool) -> Self {
        Self { shadows, ..self }
    }

    /// Factor on the colour of a surface with this outward normal, 0..=1. An interpolated normal is shorter
    /// than a unit vector.
    #[must_use]
    pub fn factor(&self, normal_ned: DVec3) -> f64 {
        let [of_sun, of_sky] = self.parts(normal_ned);
        (of_sun + of_sky).clamp(0.0, 1.0)
    }

    /// The parts of the factor that are the sun's and the sky's.
    #[must_use]
    pub fn parts(&self, normal_ned: DVec3) -> [f64; 2] {
        [self.sun * normal_ned.dot(self.to_sun_ned).max(0.0), self.sky * 0.5 * (1.0 - normal_ned.z)]
    }
}

/// World normal of a normal in a shape's axes, by the cofactor matrix, which is the inverse transpose up to
/// scale. Zero if the matrix is singular in that direction.
#[must_use]
pub fn transformed_normal(ned_from_shape: &DMat3, normal: DVec3) -> DVec3 {
    let [x, y, z] = [0, 1, 2].map(|axis| ned_from_shape.row(axis));
    let cofactors = [y.cross(z), z.cross(x), x.cross(y)];
    // Mirrored triangles are flipped back; their normals are not.
    let sign = if x.dot(cofactors[0]) < 0.0 { -1.0 } else { 1.0 };
    (sign * DVec3::from_array(cofactors.map(|row| row.dot(normal)))).normalize_or_zero()
}

#[cfg(test)]
mod tests {
    use glam::DQuat;

    use super::*;

    #[test]
    fn light_matches_its_closed_form() {
        // From the south-west, 30 degrees up.
        let light = Light::new(225_f64.to_radians(), 30_f64.to_radians(), 0.7, 0.3);
        let (cos, sin) = (0.75_f64.sqrt(), 0.5);
        assert!(
            (light.to_sun_ned - DVec3::new(-cos * 0.5_f64.sqrt(), -cos * 0.5_f64.sqrt(), -sin)).length()
                < 1e-12
        );
        // Level ground, a ceiling, and walls facing the sun, away from it and sideways.
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
            assert!(
                (light.factor(normal) - expected).abs() < 1e-12,
                "{normal}: {} {expected}",
                light.factor(normal)
            );
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
            assert!((light.factor(m) - light.factor(n)).abs() <= 0.9 * (m - n).length() + 1e-12, "{m} {n}");
        }
    }

    #[test]
    fn transformed_normals_stay_perpendicular() {
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
            let turned = transformed_normal(&matrix, normal);
            assert!(
                (turned.length() - 1.0).abs() < 1e-12
                    && turned.dot(a.normalize()).abs() < 1e-12
                    && turned.dot(b.normalize()).abs() < 1e-12
            );
            // The side of the surface moves along with it.
            assert!(turned.dot(matrix * normal) > 0.0, "{scale:?}");
            assert_eq!(turned.dot(a.cross(b)) < 0.0, mirrored);
        }
        assert_eq!(transformed_normal(&DMat3::ZERO, normal), DVec3::ZERO);
    }
}
