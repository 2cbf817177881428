//! WGS-84 geodesy: geodetic <-> earth-centred (ECEF) <-> local north-east-down, exact in f64.
//!
//! The local frame is the plane tangent to the ellipsoid at the origin's latitude and longitude, through the
//! origin's height. A flat-earth approximation would be off by 0.07 m over a 1 km flight, and by metres over
//! a long one.
//!
//! The accuracy of all conversions is the spacing of ECEF coordinates near the surface in f64, 9.3e-10 m.

use glam::{DMat3, DQuat, DVec3};

mod geoid;

pub use geoid::{GeoidCache, geoid_undulation_m};

/// Semi-major axis of WGS-84, metres (NIMA TR8350.2).
pub(crate) const WGS84_A_M: f64 = 6_378_137.0;
/// Flattening of WGS-84 (NIMA TR8350.2).
pub(crate) const WGS84_F: f64 = 1.0 / 298.257_223_563;
/// First eccentricity squared of WGS-84, f (2 - f).
pub(crate) const WGS84_E2: f64 = WGS84_F * (2.0 - WGS84_F);

/// A point on WGS-84.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Geodetic {
    /// Geodetic latitude, radians, north positive, [-pi/2, pi/2].
    pub lat_rad: f64,
    /// Longitude, radians, east positive.
    pub lon_rad: f64,
    /// Height above the ellipsoid, metres (or above the datum that the caller declared).
    pub height_m: f64,
}

impl Geodetic {
    /// From degrees and metres.
    pub fn from_deg(lat_deg: f64, lon_deg: f64, height_m: f64) -> Self {
        Self { lat_rad: lat_deg.to_radians(), lon_rad: lon_deg.to_radians(), height_m }
    }

    /// Latitude in degrees.
    pub fn lat_deg(self) -> f64 {
        self.lat_rad.to_degrees()
    }

    /// Longitude in degrees.
    pub fn lon_deg(self) -> f64 {
        self.lon_rad.to_degrees()
    }

    /// Whether all three are finite, latitude is within +-90 degrees, longitude within +-360 degrees and
    /// height within 1e8 m.
    pub fn is_valid(self) -> bool {
        // Written so that NaN fails.
        self.lat_rad.abs() <= std::f64::consts::FRAC_PI_2 + 1e-12
            && self.lon_rad.abs() <= std::f64::consts::TAU + 1e-12
            && self.height_m.abs() <= 1e8
    }

    /// Earth-centred, earth-fixed coordinates in metres: x towards (0, 0), y towards 90 E, z towards the
    /// north pole.
    ///
    /// `N = a / sqrt(1 - e2 sin^2 lat)`, `x = (N + h) cos lat cos lon`, `z = (N (1 - e2) + h) sin lat`.
    pub(crate) fn to_ecef(self) -> DVec3 {
        let (sin_lat, cos_lat) = self.lat_rad.sin_cos();
        let (sin_lon, cos_lon) = self.lon_rad.sin_cos();
        let normal_m = WGS84_A_M / (1.0 - WGS84_E2 * sin_lat * sin_lat).sqrt();
        let from_axis_m = (normal_m + self.height_m) * cos_lat;
        DVec3::new(
            from_axis_m * cos_lon,
            from_axis_m * sin_lon,
            (normal_m * (1.0 - WGS84_E2) + self.height_m) * sin_lat,
        )
    }

    /// The geodetic position of a point in metres from the Earth's centre: x towards latitude and longitude 0, z north.
    ///
    /// Bowring's iteration on the reduced latitude beta (Bowring 1976, Survey Review 23:323-327), run to
    /// convergence: `tan lat = (z + e'^2 b sin^3 beta) / (p - e2 a cos^3 beta)`, `tan beta = (1 - f) tan
    /// lat`. The height is `p cos lat + z sin lat - a sqrt(1 - e2 sin^2 lat)`, which is well conditioned at
    /// the poles and on the equator alike. Valid farther than 43 km from the earth's centre (inside the
    /// evolute the solution is not unique); finite everywhere.
    pub fn from_ecef(ecef_m: DVec3) -> Self {
        let semi_minor_m = WGS84_A_M * (1.0 - WGS84_F);
        let second_e2 = WGS84_E2 / (1.0 - WGS84_E2);
        let from_axis_m = ecef_m.x.hypot(ecef_m.y);
        let mut reduced = ecef_m.z.atan2((1.0 - WGS84_F) * from_axis_m);
        let mut lat_rad = 0.0;
        // Two iterations reach 1e-12 rad from -10 km to 1000 km; then the loop ends.
        for _ in 0..10 {
            let (sin_r, cos_r) = reduced.sin_cos();
            let next_lat = (ecef_m.z + second_e2 * semi_minor_m * sin_r.powi(3))
                .atan2(from_axis_m - WGS84_E2 * WGS84_A_M * cos_r.powi(3));
            let done = (next_lat - lat_rad).abs() < 1e-16;
            lat_rad = next_lat;
            reduced = ((1.0 - WGS84_F) * lat_rad.sin()).atan2(lat_rad.cos());
            if done {
                break;
            }
        }
        let (sin_lat, cos_lat) = lat_rad.sin_cos();
        let height_m = from_axis_m * cos_lat + ecef_m.z * sin_lat
            - WGS84_A_M * (1.0 - WGS84_E2 * sin_lat * sin_lat).sqrt();
        Self { lat_rad, lon_rad: ecef_m.y.atan2(ecef_m.x), height_m }
    }

    /// Rotation that takes north-east-down coordinates of the tangent frame here to ECEF axes: Rz(lon)
    /// Ry(-pi/2 - lat).
    pub(crate) fn ecef_from_ned_rotation(self) -> DQuat {
        DQuat::from_rotation_z(self.lon_rad)
            * DQuat::from_rotation_y(-std::f64::consts::FRAC_PI_2 - self.lat_rad)
    }
}

/// A local north-east-down frame tangent to WGS-84, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LocalFrame {
    origin: Geodetic,
    origin_ecef_m: DVec3,
    ned_from_ecef_axes: DMat3,
}

impl LocalFrame {
    /// The frame with its origin at `origin`.
    pub fn new(origin: Geodetic) -> Self {
        let (sin_lat, cos_lat) = origin.lat_rad.sin_cos();
        let (sin_lon, cos_lon) = origin.lon_rad.sin_cos();
        let north = DVec3::new(-sin_lat * cos_lon, -sin_lat * sin_lon, cos_lat);
        let east = DVec3::new(-sin_lon, cos_lon, 0.0);
        let down = DVec3::new(-cos_lat * cos_lon, -cos_lat * sin_lon, -sin_lat);
        Self {
            origin,
            origin_ecef_m: origin.to_ecef(),
            ned_from_ecef_axes: DMat3::from_cols(north, east, down).transpose(),
        }
    }

    /// Geodetic position of (0, 0, 0).
    pub fn origin(&self) -> Geodetic {
        self.origin
    }

    /// Local coordinates of an earth-centred point.
    pub(crate) fn ned_from_ecef(&self, ecef_m: DVec3) -> DVec3 {
        self.ned_from_ecef_axes * (ecef_m - self.origin_ecef_m)
    }

    /// Earth-centred coordinates of a local point.
    pub(crate) fn ecef_from_ned(&self, ned_m: DVec3) -> DVec3 {
        self.origin_ecef_m + self.ned_from_ecef_axes.transpose() * ned_m
    }

    /// Local coordinates of a geodetic point.
    pub fn ned_from_geodetic(&self, at: Geodetic) -> DVec3 {
        self.ned_from_ecef(at.to_ecef())
    }

    /// Geodetic coordinates of a local point.
    pub fn geodetic_from_ned(&self, ned_m: DVec3) -> Geodetic {
        Geodetic::from_ecef(self.ecef_from_ned(ned_m))
    }

    /// A vector of earth-centred axes in the axes of this frame.
    pub(crate) fn ned_from_ecef_vector(&self, ecef: DVec3) -> DVec3 {
        self.ned_from_ecef_axes * ecef
    }

    /// Direction of down at `at`, along the normal of the ellipsoid, in the axes of this frame.
    pub(crate) fn down_ned(&self, at: Geodetic) -> DVec3 {
        let (sin_lat, cos_lat) = at.lat_rad.sin_cos();
        let (sin_lon, cos_lon) = at.lon_rad.sin_cos();
        self.ned_from_ecef_vector(-DVec3::new(cos_lat * cos_lon, cos_lat * sin_lon, sin_lat))
    }

    /// Rotation from the tangent NED frame at `at` to the axes of this frame.
    ///
    /// Attitudes in a log are relative to the tangent frame at the aircraft; this converts them to that of
    /// the origin. The rotation is about 0.9 degrees per 100 km, plus the meridian convergence about the
    /// vertical.
    pub(crate) fn ned_from_local(&self, at: Geodetic) -> DQuat {
        (self.origin.ecef_from_ned_rotation().inverse() * at.ecef_from_ned_rotation()).normalize()
    }
}

#[cfg(test)]
mod tests;
