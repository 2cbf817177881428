//! The Earth beneath the flight: gravity, rotation and geodetic position.

use glam::DVec3;

use crate::{
    geodesy::{Geodetic, GeoidCache, LocalFrame, WGS84_A_M, WGS84_E2, WGS84_F},
    scenario::HeightReference,
};

/// Gravity where the position of the flight is not known, m/s^2 (3rd CGPM, 1901).
pub const STANDARD_GRAVITY_M_S2: f64 = 9.806_65;

/// Normal gravity at the equator, m/s^2 (NIMA TR8350.2, table 3.4).
const EQUATOR_GRAVITY_M_S2: f64 = 9.780_325_335_9;
/// Somigliana's constant (NIMA TR8350.2, table 3.4).
const SOMIGLIANA: f64 = 0.001_931_852_652_41;
/// `omega^2 a^2 b / GM` (NIMA TR8350.2, table 3.4).
const CENTRIFUGAL_RATIO: f64 = 0.003_449_786_506_84;
/// Rotation of the Earth, rad/s (NIMA TR8350.2, table 3.1).
const EARTH_RATE_RAD_S: f64 = 7.292_115e-5;

/// Normal gravity of WGS-84, the centrifugal acceleration included, m/s^2.
///
/// Somigliana's formula on the ellipsoid, and its second-order continuation to the height above it (NIMA
/// TR8350.2, equations 4-1 and 4-3): below 20 km of height it is exact to 1e-6 m/s^2.
#[must_use]
pub fn normal_gravity_m_s2(lat_rad: f64, height_m: f64) -> f64 {
    let sin2 = lat_rad.sin().powi(2);
    let on_ellipsoid = EQUATOR_GRAVITY_M_S2 * (1.0 + SOMIGLIANA * sin2) / (1.0 - WGS84_E2 * sin2).sqrt();
    let h = height_m / WGS84_A_M;
    on_ellipsoid * (1.0 - 2.0 * h * (1.0 + WGS84_F + CENTRIFUGAL_RATIO - 2.0 * WGS84_F * sin2) + 3.0 * h * h)
}

/// The Earth in the local frame of a flight.
#[derive(Clone, Debug)]
pub struct Earth {
    frame: Option<LocalFrame>,
    /// Vertical datum of the local frame.
    heights: HeightReference,
    geoid: GeoidCache,
}

impl Earth {
    /// `frame` is `None` where the position of the flight is not known.
    #[must_use]
    pub fn new(frame: Option<LocalFrame>, heights: HeightReference) -> Self {
        Self { frame, heights, geoid: GeoidCache::new() }
    }

    /// The local frame; its heights may be above mean sea level.
    #[must_use]
    pub fn frame(&self) -> Option<&LocalFrame> {
        self.frame.as_ref()
    }

    /// Position of the local frame's origin on the ellipsoid.
    #[must_use]
    pub fn origin(&mut self) -> Option<Geodetic> {
        self.geodetic(DVec3::ZERO)
    }

    /// Geodetic position of a point, with its height above the ellipsoid.
    pub(super) fn geodetic(&mut self, point_ned_m: DVec3) -> Option<Geodetic> {
        let at = self.frame?.geodetic_from_ned(point_ned_m);
        Some(match self.heights {
            HeightReference::Ellipsoid => at,
            HeightReference::Msl => Geodetic { height_m: at.height_m + self.geoid.undulation_m(at), ..at },
        })
    }

    /// Height above mean sea level (EGM96) of a position with a height above the ellipsoid.
    pub(super) fn msl_m(&mut self, at: Geodetic) -> f64 {
        at.height_m - self.geoid.undulation_m(at)
    }

    /// Gravity at a point: along the normal of the ellipsoid, or straight down and [`STANDARD_GRAVITY_M_S2`]
    /// where the position is not known.
    pub fn gravity_ned_m_s2(&mut self, point_ned_m: DVec3) -> DVec3 {
        match (self.geodetic(point_ned_m), self.frame) {
            (Some(at), Some(frame)) => frame.down_ned(at) * normal_gravity_m_s2(at.lat_rad, at.height_m),
            _ => DVec3::Z * STANDARD_GRAVITY_M_S2,
        }
    }

    /// Rotation of the Earth in the axes of the local frame, rad/s.
    pub(super) fn rate_ned_rad_s(&self) -> Option<DVec3> {
        Some(self.frame?.ned_from_ecef_vector(DVec3::Z * EARTH_RATE_RAD_S))
    }
}
