//! Gravity and atmosphere against published values.

use super::*;

#[test]
fn gravity_has_the_published_values() {
    // NIMA TR8350.2, table 3.4: equator and pole. At 45 degrees: 9.806 199 203 m/s^2 of GRS80 (Moritz 2000),
    // whose gravity at the equator and at the poles is greater by 1.4e-6.
    for (lat_deg, expected, tolerance) in
        [(0.0, 9.780_325_335_9, 1e-10), (90.0, 9.832_184_937_8, 2e-10), (45.0, 9.806_199_203 - 1.4e-6, 1e-7)]
    {
        let got = normal_gravity_m_s2(f64::to_radians(lat_deg), 0.0);
        assert!((got - expected).abs() < tolerance, "{lat_deg}: {got}");
        assert_eq!(got, normal_gravity_m_s2(f64::to_radians(-lat_deg), 0.0));
    }
}

/// Potential of gravity at a distance from the axis and a height above the equator's plane: zonal harmonics of
/// the normal field of WGS-84, and rotation.
fn potential(rho_m: f64, z_m: f64) -> f64 {
    let (gm, a, w) = (3.986_004_418e14, 6_378_137.0_f64, 7.292_115e-5_f64);
    // J2 and its successors of an equipotential ellipsoid: J_2n = (-1)^(n+1) 3 e^2n / ((2n+1)(2n+3))
    // (1 - n + 5 n J2 / e^2) (Heiskanen and Moritz, 2-92).
    let (e2, j2) = (6.694_379_990_14e-3_f64, 1.082_629_821_3e-3);
    let j = |n: i32| {
        let k = f64::from(n);
        f64::from(1 - 2 * (n % 2)) * -3.0 * e2.powi(n) / ((2.0 * k + 1.0) * (2.0 * k + 3.0))
            * (1.0 - k + 5.0 * k * j2 / e2)
    };
    let r = rho_m.hypot(z_m);
    let t = z_m / r;
    let mut legendre = vec![1.0, t];
    for n in 1..12 {
        let k = f64::from(n);
        let [before, last] = [legendre[n as usize - 1], legendre[n as usize]];
        legendre.push(((2.0 * k + 1.0) * t * last - k * before) / (k + 1.0));
    }
    let zonal: f64 = (1..6).map(|n| j(n) * (a / r).powi(2 * n) * legendre[2 * n as usize]).sum();
    gm / r * (1.0 - zonal) + 0.5 * w * w * rho_m * rho_m
}

#[test]
fn gravity_above_the_ellipsoid_is_the_gradient_of_the_normal_potential() {
    for lat_deg in [0.0, 20.0, 45.0, 70.0, 90.0] {
        for height_m in [0.0, 1e3, 5e3, 12e3] {
            let at = Geodetic::from_deg(lat_deg, 0.0, height_m);
            let p = at.to_ecef();
            let h = 30.0;
            let slope = |dx: f64, dz: f64| {
                (potential(p.x + dx, p.z + dz) - potential(p.x - dx, p.z - dz)) / (2.0 * h)
            };
            let expected = slope(h, 0.0).hypot(slope(0.0, h));
            let got = normal_gravity_m_s2(at.lat_rad, height_m);
            // Rounding of the potential: 6e7 * 1e-16 / 60 m = 1e-10, times a few; the series: 1e-6 at 12 km.
            assert!((got - expected).abs() < 1e-6, "{lat_deg} {height_m}: {got} {expected}");
        }
    }
}

#[test]
fn gravity_points_along_the_local_vertical() {
    let frame = local_frame();
    let mut earth = Earth::new(Some(frame), HeightReference::Ellipsoid);
    let here = earth.gravity_ned_m_s2(DVec3::ZERO);
    assert!((here.normalize() - DVec3::Z).length() < 1e-15);
    // 10 km north the vertical leans by the change of latitude.
    let north = earth.gravity_ned_m_s2(DVec3::X * 10e3);
    let lat = |p| frame.geodetic_from_ned(p).lat_rad;
    let lean = lat(DVec3::X * 10e3) - lat(DVec3::ZERO);
    assert!(((-north.x / north.z).atan() - lean).abs() < 1e-12, "{north} {lean}");
    // Heights above mean sea level are ellipsoidal ones and the undulation, with 0.3086 mGal/m of free air.
    let mut msl = Earth::new(Some(frame), HeightReference::Msl);
    let lower = msl.gravity_ned_m_s2(DVec3::ZERO).z - here.z;
    let undulation_m = crate::geodesy::geoid_undulation_m(frame.origin());
    assert!((lower + undulation_m * 3.086e-6).abs() < 1e-6, "{lower} {undulation_m}");
}

#[test]
fn the_standard_atmosphere_has_the_published_pressures() {
    // ISO 2533:1975 by geopotential height, as in the U.S. Standard Atmosphere 1976, table I.
    for (geopotential_m, expected_pa) in [
        (-1000.0, 113_929.0),
        (0.0, 101_325.0),
        (1000.0, 89_874.6),
        (5000.0, 54_019.9),
        (11_000.0, 22_632.06),
        (20_000.0, 5_474.89),
        (32_000.0, 868.019),
        (47_000.0, 110.906),
    ] {
        let height_m = 6_356_766.0 * geopotential_m / (6_356_766.0 - geopotential_m);
        let got = isa_pressure_pa(height_m);
        assert!((got / expected_pa - 1.0).abs() < 6e-6, "{geopotential_m}: {got}");
        assert!((isa_altitude_m(got) - height_m).abs() < 1e-6, "{geopotential_m}");
    }
    assert!(isa_altitude_m(0.0).is_nan() && isa_altitude_m(f64::NAN).is_nan());
}
