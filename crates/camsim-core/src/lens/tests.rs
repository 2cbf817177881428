#![allow(clippy::unwrap_used)]

use glam::{DMat2, DVec2, DVec3};
use proptest::prelude::*;

use super::*;

/// Name, model, coefficients: real lenses, and lenses that defeat simple inverses.
pub(super) fn gallery() -> Vec<(&'static str, Lens)> {
    use LensModel::{
        BrownConrady, BrownConradyPrism, Division, DoubleSphere, Equirectangular, Eucm, FTheta,
        FThetaInverse, Fisheye624, Fov, KannalaBrandt, Mei, Pinhole, Ucm,
    };
    let sets: [(&'static str, LensModel, &[f64]); 38] = [
        ("pinhole", Pinhole, &[]),
        ("no distortion", BrownConrady, &[]),
        ("EuRoC", BrownConrady, &[-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05]),
        ("S3 by Agisoft", BrownConrady, &[-0.390024, 0.111124, -0.0012744, -0.0081517, -0.00842763]),
        ("S3 by OpenCV", BrownConrady, &[-0.428129, 0.158059, 0.000245, -0.002286, -0.029194]),
        ("pincushion", BrownConrady, &[0.5]),
        ("nearly singular ring", BrownConrady, &[-1.0, 0.455]),
        ("division fixed point has a 2-cycle", BrownConrady, &[-0.45, 0.25]),
        ("rational with a pole", BrownConrady, &[0.1, 0.02, 0.0, 0.0, 0.0, -0.4]),
        ("rational, Kinect-like", BrownConrady, &[0.5, -2.6, 0.0008, -0.0003, 1.5, 0.38, -2.4, 1.4]),
        ("strong tangential", BrownConrady, &[-0.1, 0.01, 0.1, -0.1]),
        ("TUM-VI", KannalaBrandt, &[0.0034823894, 0.000715034845, -0.00205323614, 0.000202936736]),
        ("fisheye folds at 60 degrees", KannalaBrandt, &[-0.3]),
        ("fisheye grows fast", KannalaBrandt, &[9.0]),
        ("fisheye of 220 degrees", KannalaBrandt, &[-0.02, 0.001, -2e-4, 1e-5]),
        ("prism", BrownConradyPrism, &[-0.28, 0.07, 2e-4, 2e-5, 0.0, 0.0, 0.0, 0.0, 1e-3, -4e-4, 2e-3, 3e-4]),
        (
            "tilted by 3 degrees",
            BrownConradyPrism,
            &[-0.3, 0.1, 1e-3, -2e-3, 0.01, 0.02, 0.0, 0.0, 0.01, 0.0, -0.01, 0.0, 0.05, -0.05],
        ),
        (
            "strong prism and tilt",
            BrownConradyPrism,
            &[-0.1, 0.02, 0.02, -0.03, 0.0, 0.0, 0.0, 0.0, 0.1, -0.05, -0.2, 0.03, 0.5, 0.4],
        ),
        (
            "Aria SLAM camera",
            Fisheye624,
            &[-0.0232, 0.0924, -0.0591, 0.003, 0.0048, -0.0009, 2e-4, 5e-4, -9e-4, -1e-4, 7e-5, -1.7e-4],
        ),
        (
            "strong prism on a fisheye",
            Fisheye624,
            &[-0.05, 0.02, -0.005, 0.001, 5e-4, 2e-4, -0.05, 0.04, 0.08, -0.02, 0.05, -0.03],
        ),
        ("f-theta", FTheta, &[1.0, -0.02, 0.01, -0.03, 0.002]),
        ("f-theta, skewed and limited", FTheta, &[1.0, 0.0, -0.05, 0.0, 0.002, 1.02, 0.01, -0.02, 1.2]),
        ("f-theta inverse", FThetaInverse, &[1.0, 0.02, -0.01, 0.03, -0.002]),
        ("f-theta inverse that stops", FThetaInverse, &[1.0, 0.0, -0.2, 0.0, 0.0, 0.99, 0.0, 0.01]),
        ("TUM-VI double sphere", DoubleSphere, &[-0.2396, 0.5589]),
        ("wide double sphere", DoubleSphere, &[-0.18, 0.59]),
        ("double sphere without second", DoubleSphere, &[0.5, 0.0]),
        ("EUCM", Eucm, &[0.571, 1.18]),
        ("EUCM that folds", Eucm, &[0.9, 0.5]),
        ("UCM", Ucm, &[0.6]),
        ("UCM, pole", Ucm, &[0.2]),
        ("UCM, stereographic", Ucm, &[0.5]),
        ("MEI, RICOH", Mei, &[1.2, -0.2, 0.05, 1e-3, -5e-4]),
        ("MEI, small mirror", Mei, &[0.6, 0.1, -0.05, -2e-3, 1e-3]),
        ("MEI, strong", Mei, &[2.2, 0.3, 3.5, 0.01, -0.02]),
        ("division, barrel", Division, &[-0.3]),
        ("FOV", Fov, &[0.93]),
        ("panorama", Equirectangular, &[]),
    ];
    sets.into_iter().map(|(name, model, k)| (name, Lens::new(model, k).unwrap())).collect()
}

/// Largest radius to test: inside the fold, and no farther than a flat image reaches.
fn usable_radius(lens: &Lens, phi: f64) -> f64 {
    (0.999 * lens.fold_radius(phi)).min(4.0)
}

#[test]
fn jacobians_agree_with_finite_differences() {
    let h = 1e-5;
    for (name, lens) in gallery() {
        for (phi, fraction) in [(0.0, 0.0), (0.3, 0.2), (1.9, 0.5), (3.7, 0.8), (5.5, 0.99)] {
            let ideal = DVec2::from_angle(phi) * (fraction * usable_radius(&lens, phi));
            let column = |step: DVec2| (lens.distort(ideal + step) - lens.distort(ideal - step)) / (2.0 * h);
            let numeric = DMat2::from_cols(column(DVec2::new(h, 0.0)), column(DVec2::new(0.0, h)));
            let analytic = lens.jacobian(ideal);
            let scale = 1.0 + analytic.x_axis.abs().max_element() + analytic.y_axis.abs().max_element();
            // Central differences: h^2 times a third derivative that reaches some 1e3 near the folds of the
            // more extreme lenses.
            assert!(
                (numeric - analytic).abs_diff_eq(DMat2::ZERO, 1e-6 * scale),
                "{name} ideal {ideal}: {numeric} vs {analytic}"
            );
        }
    }
}

#[test]
fn undistort_inverts_distort_inside_the_fold() {
    for (name, lens) in gallery() {
        for ray in 0..90 {
            let phi = f64::from(ray) * 0.0698;
            for step in 0..=100 {
                let ideal = DVec2::from_angle(phi) * (f64::from(step) * 0.01 * usable_radius(&lens, phi));
                let undistorted = lens.undistort(lens.distort(ideal));
                let undistorted = undistorted
                    .unwrap_or_else(|| panic!("{name}: {ideal} is inside the fold but not undistorted"));
                // At 1e-3 from a fold the inverse magnifies rounding (1e-16) some 1e3 times; the residual
                // test (1e-9) bounds the rest.
                assert!((undistorted - ideal).length() < 1e-6, "{name}: {ideal} became {undistorted}");
            }
        }
    }
}

#[test]
fn fold_radii_match_closed_forms() {
    let radius = |model, k: &[f64]| Lens::new(model, k).unwrap().fold_radius(1.0);
    // r (1 + k r^2) peaks at 1/sqrt(-3 k).
    assert!((radius(LensModel::BrownConrady, &[-0.3]) - (1.0 / 0.9_f64).sqrt()).abs() < 1e-12);
    // The pole of 1/(1 - 0.4 r^2).
    assert!(
        (radius(LensModel::BrownConrady, &[0.0, 0.0, 0.0, 0.0, 0.0, -0.4]) - 2.5_f64.sqrt()).abs() < 1e-9
    );
    // theta (1 - 0.3 theta^2) peaks at 1/sqrt(0.9).
    assert!((radius(LensModel::KannalaBrandt, &[-0.3]) - (1.0 / 0.9_f64.sqrt()).tan()).abs() < 1e-12);
    // 1 + 3 k1 r^2 + 5 k2 r^4 = 0 has no real root: the ring is nearly singular.
    let ring = Lens::new(LensModel::BrownConrady, &[-1.0, 0.455]).unwrap();
    assert!(!ring.fold_curve().unwrap().folds());
    // With 0.449 it folds in a band 0.06 wide, narrower than the scan is sure to hit.
    let band = Lens::new(LensModel::BrownConrady, &[-1.0, 0.449_999]).unwrap();
    assert!((band.fold_radius(0.0) - 0.816_5).abs() < 1e-3, "{}", band.fold_radius(0.0));
    let monotone = Lens::new(LensModel::BrownConrady, &[-0.45, 0.25]).unwrap();
    let undistorted = monotone.undistort(monotone.distort(DVec2::new(1.2498, 0.0))).unwrap();
    assert!((undistorted.x - 1.2498).abs() < 1e-9);
}

#[test]
fn no_inverse_beyond_the_fold() {
    // The maximum of r (1 - 0.3 r^2) is 0.70273 at 1.0541; the formula passes through zero at 1.826 and gives
    // mirrored points beyond.
    let lens = Lens::new(LensModel::BrownConrady, &[-0.3]).unwrap();
    assert!(lens.undistort(DVec2::new(0.7027, 0.0)).is_some());
    assert_eq!(lens.undistort(DVec2::new(0.7028, 0.0)), None);
    assert_eq!(lens.undistort(DVec2::new(0.0, -5.0)), None);
    let mirrored = lens.distort(DVec2::new(2.0, 0.0));
    assert!(mirrored.x < 0.0 && !lens.contains(DVec2::new(2.0, 0.0)));
    let undistorted = lens.undistort(mirrored).unwrap();
    assert!(undistorted.x < 0.0 && undistorted.length() < 1.0541);
}

#[test]
fn non_finite_input_gives_none() {
    for (name, lens) in gallery() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert_eq!(lens.undistort(DVec2::new(bad, 0.1)), None, "{name}");
            assert_eq!(lens.undistort(DVec2::new(0.1, bad)), None, "{name}");
            assert!(!lens.contains(DVec2::new(bad, 0.0)));
        }
        assert!(lens.undistort(DVec2::ZERO).unwrap().length() < 1e-15, "{name}");
        assert!(lens.undistort(DVec2::splat(5e-324)).unwrap().length() < 1e-300, "{name}");
        if !matches!(lens, Lens::Pinhole(_)) {
            // Too far out for any of these lenses; the test is that nothing hangs or panics.
            let _ = lens.undistort(DVec2::splat(1e200));
        }
    }
}

#[test]
fn invalid_coefficients_are_refused() {
    let error = |model, k: &[f64]| Lens::new(model, k).unwrap_err().to_string();
    assert!(error(LensModel::Pinhole, &[0.1]).contains("pinhole"));
    assert!(error(LensModel::BrownConrady, &[0.0; 9]).contains("k1 k2 p1 p2 k3 k4 k5 k6"));
    assert!(error(LensModel::KannalaBrandt, &[0.0; 5]).contains("at most 4"));
    assert!(error(LensModel::BrownConrady, &[0.1, f64::NAN]).contains("coefficients[1] is NaN"));
    assert!(Lens::with_reach(LensModel::Pinhole, &[], f64::NAN).is_err());
    // Absurd but finite coefficients give a lens with hardly any field, not a panic.
    for huge in [1e30, -1e30, 1e300, -1e300] {
        for position in 0..8 {
            let mut k = [0.0; 8];
            k[position] = huge;
            let lens = Lens::new(LensModel::BrownConrady, &k).unwrap();
            let _ = lens.undistort(DVec2::new(0.3, -0.2));
        }
    }
}

/// Rays all over the principal branch: directions, and angles up to a fraction of the border's.
fn rays(lens: &Lens) -> Vec<DVec3> {
    let at = |phi: f64, theta: f64| (DVec2::from_angle(phi) * theta.sin()).extend(theta.cos());
    let mut rays = Vec::new();
    for k in 0..36 {
        let phi = 0.013 + f64::from(k) * 0.1745;
        // The last angle inside, by bisection: the branch is star-shaped.
        let (mut low, mut high) = (0.0, std::f64::consts::PI);
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            *(if lens.contains_ray(at(phi, middle)) { &mut low } else { &mut high }) = middle;
        }
        rays.extend((0..=40).map(|i| at(phi, (f64::from(i) / 40.0) * (0.999 * low).min(3.1))));
    }
    rays
}

#[test]
fn gradients_agree_with_finite_differences() {
    let h = 1e-6;
    for (name, lens) in gallery() {
        for ray in rays(&lens).into_iter().step_by(7) {
            for (axis, column) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().zip(lens.gradient(ray)) {
                let numeric = (lens.image(ray + h * axis) - lens.image(ray - h * axis)) / (2.0 * h);
                let scale = 1.0 + column.length().powi(2) + lens.image(ray).length();
                // The panorama jumps behind.
                let is_smooth =
                    !(lens.model() == LensModel::Equirectangular && ray.z < 0.0 && ray.x.abs() < 1e-3);
                assert!(
                    !is_smooth || (numeric - column).length() < 1e-5 * scale,
                    "{name} {ray}: {numeric} {column}"
                );
            }
        }
    }
}

#[test]
fn rays_invert_images_on_the_branch() {
    for (name, lens) in gallery() {
        for ray in rays(&lens) {
            let image = lens.image(ray);
            let found =
                lens.ray(image).unwrap_or_else(|| panic!("{name}: {ray} is inside, but has no inverse"));
            assert!(found.distance(ray) < 1e-6, "{name}: {ray} became {found}");
            assert!((found.length() - 1.0).abs() < 1e-12, "{name}: {found} is no unit ray");
            // Points of the ideal plane are the same.
            if ray.z > 0.05 {
                let ideal = ray.truncate() / ray.z;
                assert!(
                    (lens.distort(ideal) - image).length() < 1e-12 * (1.0 + image.length()),
                    "{name} {ray}"
                );
                assert_eq!(lens.contains(ideal), lens.contains_ray(ray), "{name} {ray}");
            }
        }
    }
}

#[test]
fn branches_end_where_their_formulas_do() {
    let angle_max = |model, k: &[f64]| Lens::new(model, k).unwrap().angle_max_rad();
    let close =
        |angle: f64, wanted: f64| assert!((angle - wanted).abs() < 1e-9, "{angle} instead of {wanted}");
    // alpha > 1/2 folds at cos t = -(1 - alpha)/alpha, alpha < 1/2 has a pole at cos t = -alpha/(1 - alpha).
    close(angle_max(LensModel::Ucm, &[0.6]), (-0.4_f64 / 0.6).acos());
    close(angle_max(LensModel::Ucm, &[0.2]), (-0.2_f64 / 0.8).acos());
    // The mirror of MEI folds at cos t = -1/xi, or has its pole at cos t = -xi.
    close(angle_max(LensModel::Mei, &[1.5]), (-1.0_f64 / 1.5).acos());
    close(angle_max(LensModel::Mei, &[0.6]), (-0.6_f64).acos());
    // MEI with xi is UCM with alpha = xi/(1 + xi), scaled.
    let (mei, ucm) = (Lens::new(LensModel::Mei, &[1.5]).unwrap(), Lens::new(LensModel::Ucm, &[0.6]).unwrap());
    let ray = DVec3::new(0.4, -0.9, -0.2);
    assert!((mei.image(ray) * 2.5 - ucm.image(ray)).length() < 1e-14);
    // 4 k tan^2 = 1 ends the division model.
    close(angle_max(LensModel::Division, &[0.25]), 1.0_f64.atan());
    close(angle_max(LensModel::KannalaBrandt, &[]), std::f64::consts::PI);
    close(angle_max(LensModel::FTheta, &[1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.2]), 1.2);
    // r = 1/sqrt(0.6) at the end of growth of r - 0.2 r^3.
    close(angle_max(LensModel::FThetaInverse, &[1.0, 0.0, -0.2]), (1.0 / 0.6_f64).sqrt() * (1.0 - 0.2 / 0.6));
    // Double sphere folds where its second sphere does, at cos p = -w of the unified model; the triangle of both
    // centres gives the angle of the ray. (The paper's eq. 43 ends a little earlier.)
    let (xi, alpha): (f64, f64) = (-0.2396, 0.5589);
    let cos = -(1.0 - alpha) / alpha;
    let d = xi * cos + (1.0 - xi * xi * (1.0 - cos * cos)).sqrt();
    close(angle_max(LensModel::DoubleSphere, &[xi, alpha]), (d * cos - xi).acos());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// For every lens: a result is inside the fold and reproduces the distorted point, and a point inside the
    /// fold is found.
    #[test]
    fn random_lenses_round_trip(
        k in prop::array::uniform3(-0.6..0.6_f64),
        p in prop::array::uniform2(-0.02..0.02_f64),
        rational in prop::option::of(prop::array::uniform3(-0.4..0.4_f64)),
        points in prop::collection::vec((0.0..std::f64::consts::TAU, 0.0..0.98_f64), 20),
    ) {
        let [k4, k5, k6] = rational.unwrap_or_default();
        let lens = Lens::new(LensModel::BrownConrady, &[k[0], k[1], p[0], p[1], k[2], k4, k5, k6]).unwrap();
        for (phi, fraction) in points {
            let direction = DVec2::from_angle(phi);
            let ideal = direction * (fraction * lens.fold_radius(phi).min(1.5));
            let distorted = lens.distort(ideal);
            let undistorted = lens.undistort(distorted);
            prop_assert!(undistorted.is_some(), "{ideal} inside the fold was not undistorted");
            let undistorted = undistorted.unwrap();
            prop_assert!(lens.contains(undistorted));
            prop_assert!((lens.distort(undistorted) - distorted).length() < 2e-9 * (1.0 + distorted.length()));
        }
    }
}

/// The points of a lens on a grid, and the lens that the table makes.
fn tabled(lens: &Lens, chart: RayChart, of: GridOf, reach: f64, nodes: usize) -> Lens {
    let step = 2.0 * reach / (nodes - 1) as f64;
    let values: Vec<DVec2> = (0..nodes * nodes)
        .map(|k| {
            let at = DVec2::new((k % nodes) as f64, (k / nodes) as f64) * step - reach;
            match (of, chart) {
                (GridOf::Rays, RayChart::Ideal) => lens.distort(at),
                (GridOf::Rays, RayChart::Angles) => lens.image(direction::ray_of(at)),
                (GridOf::Points, RayChart::Ideal) => lens.undistort(at).unwrap(),
                (GridOf::Points, RayChart::Angles) => direction::angles_of(lens.ray(at).unwrap()),
            }
        })
        .collect();
    let placement = [DVec2::splat(-reach), DVec2::splat(step)];
    Lens::from_grid(&Arc::new(LensGrid::new(chart, of, placement, [nodes; 2], &values).unwrap()))
}

#[test]
fn tables_stand_for_their_lenses() {
    let euroc = Lens::new(LensModel::BrownConrady, &[-0.283, 0.074, 2e-4, 2e-5]).unwrap();
    let wide = Lens::new(LensModel::KannalaBrandt, &[-0.02, 0.001, -2e-4, 1e-5]).unwrap();
    for (name, lens, chart, of, reach) in [
        ("ideal to points", &euroc, RayChart::Ideal, GridOf::Rays, 0.9),
        ("points to ideal", &euroc, RayChart::Ideal, GridOf::Points, 0.6),
        ("angles to points", &wide, RayChart::Angles, GridOf::Rays, 1.9),
        ("points to angles", &wide, RayChart::Angles, GridOf::Points, 1.2),
    ] {
        let table = tabled(lens, chart, of, reach, 49);
        assert_eq!(table.model(), LensModel::Table);
        let mut seen = 0;
        for k in 0..400 {
            let at = DVec2::from_angle(f64::from(k) * 2.4) * (reach * 0.98 * f64::from(k) / 400.0);
            let ray = match of {
                GridOf::Rays if chart == RayChart::Ideal => at.extend(1.0).normalize(),
                GridOf::Rays => direction::ray_of(at),
                GridOf::Points => lens.ray(at).unwrap(),
            };
            // Third-order ends of the spline with 49 nodes.
            let image = table.image(ray);
            assert!((image - lens.image(ray)).length() < 2e-6, "{name} {at}: {image} {}", lens.image(ray));
            assert!(table.contains_ray(ray), "{name} {at}");
            let found = table.ray(image).unwrap_or_else(|| panic!("{name}: {at} has no inverse"));
            assert!(found.distance(ray) < 1e-8, "{name} {at}: {ray} became {found}");
            if ray.z > 0.1 {
                let ideal = ray.truncate() / ray.z;
                assert!(table.contains(ideal), "{name} {at}");
                assert!(
                    (table.jacobian(ideal) - lens.jacobian(ideal)).abs_diff_eq(DMat2::ZERO, 1e-3),
                    "{name} {at}"
                );
            }
            seen += 1;
        }
        assert_eq!(seen, 400);
        // Beyond the grid there is nothing.
        assert_eq!(table.ray(DVec2::splat(3.0)), None, "{name}");
        assert!(!table.contains_ray(DVec3::new(0.1, 0.0, -1.0)), "{name}");
        assert_eq!(table.undistort(DVec2::new(f64::NAN, 0.0)), None);
    }
}

#[test]
fn tables_that_are_no_lenses_are_refused() {
    let grid = |first: f64, values: &dyn Fn(DVec2) -> DVec2| {
        let nodes: Vec<DVec2> =
            (0..25).map(|k| values(DVec2::new(f64::from(k % 5), f64::from(k / 5)) * 0.25 + first)).collect();
        let placement = [DVec2::splat(first), DVec2::splat(0.25)];
        LensGrid::new(RayChart::Ideal, GridOf::Rays, placement, [5; 2], &nodes).unwrap_err().to_string()
    };
    assert!(grid(0.5, &|at| at).contains("does not hold (0, 0)"));
    assert!(grid(-0.5, &|at| DVec2::new(-at.x, at.y)).contains("mirrored"));
    assert!(grid(-0.5, &|at| at / (at.x - 0.5)).contains("not finite"));
    assert!(Lens::new(LensModel::Table, &[]).unwrap_err().to_string().contains("camera.lens_table"));
}
