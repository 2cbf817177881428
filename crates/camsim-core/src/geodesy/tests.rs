#![allow(clippy::unwrap_used)]

use proptest::prelude::*;

use super::*;

/// Two spacings of an ECEF coordinate in f64.
const ECEF_ROUNDING_M: f64 = 2.0e-9;

#[test]
fn ecef_of_known_points() {
    let a = WGS84_A_M;
    let b = 6_356_752.314_245_18;
    assert!((Geodetic::from_deg(0.0, 0.0, 0.0).to_ecef() - DVec3::new(a, 0.0, 0.0)).length() < 1e-8);
    assert!((Geodetic::from_deg(0.0, 90.0, 10.0).to_ecef() - DVec3::new(0.0, a + 10.0, 0.0)).length() < 1e-8);
    assert!((Geodetic::from_deg(90.0, 33.0, 0.0).to_ecef() - DVec3::new(0.0, 0.0, b)).length() < 1e-8);
    assert!((Geodetic::from_deg(-90.0, 0.0, -5.0).to_ecef() - DVec3::new(0.0, 0.0, 5.0 - b)).length() < 1e-8);
}

#[test]
fn round_trip_at_poles_and_antimeridian() {
    for lat in [-90.0, -89.999_999_9, -45.0, -1e-9, 0.0, 1e-12, 30.0, 47.116, 89.9, 90.0] {
        for lon in [-180.0, -91.99, 0.0, 8.67, 179.999_999] {
            for height in [-10_000.0, -1.0, 0.0, 1078.0, 12_000.0, 1.0e6] {
                let ecef = Geodetic::from_deg(lat, lon, height).to_ecef();
                let back = Geodetic::from_ecef(ecef);
                assert!(
                    (back.to_ecef() - ecef).length() < 2.0 * ECEF_ROUNDING_M,
                    "{lat} {lon} {height}: {:e}",
                    (back.to_ecef() - ecef).length()
                );
                assert!(
                    (back.height_m - height).abs() < ECEF_ROUNDING_M,
                    "{lat} {lon} {height} -> {}",
                    back.height_m
                );
                assert!((back.lat_deg() - lat).abs() < 1e-13, "{lat} {lon} {height} -> {}", back.lat_deg());
            }
        }
    }
}

#[test]
fn origin_is_zero_and_axes_point_the_right_way() {
    let origin = Geodetic::from_deg(47.0, 8.0, 500.0);
    let frame = LocalFrame::new(origin);
    assert!(frame.ned_from_geodetic(origin).length() < ECEF_ROUNDING_M);
    let north = frame.ned_from_geodetic(Geodetic::from_deg(47.001, 8.0, 500.0));
    let east = frame.ned_from_geodetic(Geodetic::from_deg(47.0, 8.001, 500.0));
    let up = frame.ned_from_geodetic(Geodetic::from_deg(47.0, 8.0, 600.0));
    assert!(north.x > 111.0 && north.y.abs() < 1e-3 && north.z.abs() < 0.01);
    assert!(east.y > 75.0 && east.x.abs() < 1e-3 && east.z.abs() < 0.01);
    assert!((up - DVec3::new(0.0, 0.0, -100.0)).length() < ECEF_ROUNDING_M * 2.0);
    // 1 m away the sphere of curvature falls off by d^2 / 2R.
    assert!((north.z - north.x * north.x / 2.0 / 6.37e6).abs() < 1e-5);
}

#[test]
fn local_attitude_agrees_with_finite_differences() {
    let frame = LocalFrame::new(Geodetic::from_deg(46.0, 7.0, 400.0));
    let point = Geodetic::from_deg(47.3, 9.1, 3000.0);
    let ned_from_local = frame.ned_from_local(point);
    let base = frame.ned_from_geodetic(point);
    let up = frame.ned_from_geodetic(Geodetic { height_m: point.height_m + 100.0, ..point }) - base;
    let north = frame.ned_from_geodetic(Geodetic { lat_rad: point.lat_rad + 1e-6, ..point }) - base;
    let east = frame.ned_from_geodetic(Geodetic { lon_rad: point.lon_rad + 1e-6, ..point }) - base;
    // 6 m steps against 1e-9 m rounding and 1e-6 rad of curvature.
    assert!((ned_from_local * DVec3::NEG_Z - up.normalize()).length() < 1e-10);
    assert!((ned_from_local * DVec3::X - north.normalize()).length() < 1e-6);
    assert!((ned_from_local * DVec3::Y - east.normalize()).length() < 2e-6);
    assert!(frame.ned_from_local(frame.origin()).angle_between(DQuat::IDENTITY) < 1e-7);
}

#[test]
fn invalid_coordinates_stay_finite_or_are_refused() {
    assert!(!Geodetic::from_deg(f64::NAN, 0.0, 0.0).is_valid());
    assert!(!Geodetic::from_deg(0.0, f64::INFINITY, 0.0).is_valid());
    assert!(!Geodetic::from_deg(90.1, 0.0, 0.0).is_valid());
    assert!(Geodetic::from_deg(-90.0, 360.0, 0.0).is_valid());
    let centre = Geodetic::from_ecef(DVec3::ZERO);
    assert!(centre.lat_rad.is_finite() && centre.height_m.is_finite());
    assert!(geoid_undulation_m(Geodetic::from_deg(f64::NAN, 0.0, 0.0)).is_nan());
    assert!(GeoidCache::new().undulation_m(Geodetic::from_deg(0.0, f64::NAN, 0.0)).is_nan());
}

#[test]
fn undulations_of_known_points() {
    // NGA's EGM96 calculator: 17.16 m at (0, 0); 47.65 m over Rothenthurm, bilinear (4 cm RMS) between the
    // nodes of GeographicLib's egm96-15 grid.
    assert!((geoid_undulation_m(Geodetic::from_deg(0.0, 0.0, 0.0)) - 17.16).abs() < 0.02);
    let point = Geodetic::from_deg(47.116, 8.672, 1060.0);
    assert!((geoid_undulation_m(point) - 47.65).abs() < 0.1, "{}", geoid_undulation_m(point));
    let mut cache = GeoidCache::new();
    for point in [
        point,
        Geodetic::from_deg(90.0, 10.0, 0.0),
        Geodetic::from_deg(-90.0, -10.0, 0.0),
        Geodetic::from_deg(27.988, 86.925, 0.0),
    ] {
        assert!((cache.undulation_m(point) - geoid_undulation_m(point)).abs() < 0.01, "{point:?}");
    }
}

/// The whole model against GeographicLib's 15' grid, at its nodes: only the grid's quantum (3 mm) and its
/// makers' rounding differ.
#[test]
fn undulations_agree_with_the_published_grid() {
    let Some(data) = std::env::var_os("CAMSIM_DATA") else {
        eprintln!("CAMSIM_DATA is not set: skipped");
        return;
    };
    let bytes = std::fs::read(std::path::Path::new(&data).join("camsim/egm96-15min.pgm")).unwrap();
    let samples = &bytes[bytes.len() - 1440 * 721 * 2..];
    let mut worst = 0.0_f64;
    for row in (0..=720).step_by(48) {
        for column in (0..1440).step_by(96) {
            let index = 2 * (row * 1440 + column);
            let grid_m = f64::from(u16::from_be_bytes([samples[index], samples[index + 1]])) * 0.003 - 108.0;
            let point = Geodetic::from_deg(90.0 - row as f64 * 0.25, column as f64 * 0.25, 0.0);
            worst = worst.max((geoid_undulation_m(point) - grid_m).abs());
        }
    }
    eprintln!("worst difference from the 15' grid: {worst:.4} m");
    assert!(worst < 0.02, "{worst}");
}

proptest! {
    #[test]
    fn ned_round_trip(lat in -89.9..89.9_f64, lon in -180.0..180.0_f64, north in -1e5..1e5_f64, east in -1e5..1e5_f64, down in -1e4..1e4_f64) {
        let frame = LocalFrame::new(Geodetic::from_deg(lat, lon, 100.0));
        let ned = DVec3::new(north, east, down);
        prop_assert!((frame.ned_from_geodetic(frame.geodetic_from_ned(ned)) - ned).length() < 4.0 * ECEF_ROUNDING_M);
    }
}
