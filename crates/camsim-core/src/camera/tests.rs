#![allow(clippy::unwrap_used)]

use glam::{DVec2, DVec3};

use super::*;
use crate::scenario::{ChromaticSpec, Face, ImageCircleSpec, LensSpec, Primary, ZoomSpec};

fn s3_opencv() -> CameraModel {
    let k = [-0.428129, 0.158059, 0.000245, -0.002286, -0.029194];
    CameraModel::new([640, 480], [307.960654; 2], Some([298.485405, 226.525456]), LensModel::BrownConrady, &k)
        .unwrap()
}

#[test]
fn image_centre_is_between_the_central_pixels() {
    let camera = CameraModel::from_spec(&CameraSpec::default()).unwrap();
    assert_eq!(camera.principal_point_px, DVec2::new(319.5, 239.5));
    assert_eq!(camera.unproject(DVec2::new(319.5, 239.5)).unwrap(), DVec2::ZERO);
    assert_eq!(camera.project(DVec2::new(1.0, 0.0)), DVec2::new(819.5, 239.5));
}

#[test]
fn polynomial_fisheye_covers_57_percent_of_its_image() {
    let report = s3_opencv().check();
    // 43 % of the frame lies beyond the fold: 236 px from the principal point.
    assert!((report.valid_fraction - 0.57).abs() < 0.005, "{report:?}");
    let (min, max) = (report.fold_radius_min.unwrap(), report.fold_radius_max.unwrap());
    assert!(min > 1.3 && min < 1.386 && max > 1.386 && max < 1.5, "{report:?}");
    assert!(report.worst_roundtrip_px < 1e-6, "{report:?}");
    assert!(report.bijective);
}

#[test]
fn checks_of_regular_cameras_are_clean() {
    let pinhole = CameraModel::from_spec(&CameraSpec::default()).unwrap().check();
    assert_eq!((pinhole.valid_fraction, pinhole.fold_radius_min, pinhole.bijective), (1.0, None, true));
    let k = [-0.28340811, 0.07395907, 0.00019359, 1.76187114e-05];
    let euroc = CameraModel::new(
        [752, 480],
        [458.654, 457.296],
        Some([367.215, 248.375]),
        LensModel::BrownConrady,
        &k,
    )
    .unwrap()
    .check();
    assert_eq!(euroc.valid_fraction, 1.0);
    assert!(euroc.worst_roundtrip_px < 1e-6 && euroc.bijective);
    // One pixel, and a strip.
    for size in [[1, 1], [1, 300], [9000, 1]] {
        let report = CameraModel::new(size, [300.0; 2], None, LensModel::Pinhole, &[]).unwrap().check();
        assert_eq!(report.valid_fraction, 1.0);
    }
}

#[test]
fn invalid_cameras_are_refused() {
    let base = CameraSpec::default();
    let error = |spec: CameraSpec| CameraModel::from_spec(&spec).unwrap_err().to_string();
    assert!(error(CameraSpec { size_px: [0, 480], ..base.clone() }).contains("size_px"));
    for bad in [0.0, -500.0, f64::NAN, f64::INFINITY, 1e-310] {
        assert!(error(CameraSpec { focal_px: [500.0, bad], ..base.clone() }).contains("focal_px"));
    }
    assert!(
        error(CameraSpec { principal_point_px: Some([f64::NAN, 0.0]), ..base.clone() })
            .contains("principal_point_px")
    );
    let lens = LensSpec { model: LensModel::KannalaBrandt, coefficients: vec![f64::NAN] };
    assert!(error(CameraSpec { lens, ..base.clone() }).contains("coefficients[0]"));
    let huge = CameraSpec { focal_px: [1e-300, 1e-300], ..base };
    assert!(CameraModel::from_spec(&huge).is_err());
}

fn zoom_camera() -> CameraSpec {
    let entry = |at: f64, focal: f64, k1: f64| ZoomSpec {
        at,
        focal_px: [focal; 2],
        principal_point_px: None,
        coefficients: vec![k1],
    };
    CameraSpec {
        lens: LensSpec { model: LensModel::BrownConrady, coefficients: vec![] },
        zoom: vec![entry(1.0, 400.0, -0.3), entry(2.0, 800.0, -0.1), entry(4.0, 1600.0, 0.0)],
        ..CameraSpec::default()
    }
}

#[test]
fn zoom_interpolates_its_table_and_is_constant_beyond() {
    let spec = zoom_camera();
    let focal_and_k1 = |zoom: f64| {
        let camera = CameraModel::at_zoom(&spec, zoom).unwrap();
        (camera.focal_px.x, camera.lens.coefficients()[0])
    };
    let close = |(f, k): (f64, f64), (f2, k2): (f64, f64)| (f - f2).abs() < 1e-9 && (k - k2).abs() < 1e-12;
    assert!(
        close(focal_and_k1(1.0), (400.0, -0.3))
            && close(focal_and_k1(2.0), (800.0, -0.1))
            && close(focal_and_k1(4.0), (1600.0, 0.0))
    );
    assert!(close(focal_and_k1(1.5), (600.0, -0.2)) && close(focal_and_k1(3.0), (1200.0, -0.05)));
    assert!(close(focal_and_k1(-7.0), (400.0, -0.3)) && close(focal_and_k1(f64::INFINITY), (1600.0, 0.0)));
    assert!(matches!(CameraModel::at_zoom(&spec, f64::NAN), Err(CameraError::ZoomValue(_))));
    let table = ZoomTable::from_spec(&spec).unwrap().unwrap();
    assert_eq!([0.0, 1.4, 1.5, 1.6, 2.9, 3.1, 9.0].map(|zoom| table.nearest(zoom)), [0, 0, 0, 1, 1, 2, 2]);
}

#[test]
fn a_zoom_table_must_ascend() {
    let mut spec = zoom_camera();
    spec.zoom[1].at = 1.0;
    assert!(matches!(ZoomTable::from_spec(&spec), Err(CameraError::ZoomOrder { index: 1, .. })));
    spec.zoom[1].at = f64::NAN;
    assert!(ZoomTable::from_spec(&spec).is_err());
    let mut spec = zoom_camera();
    spec.zoom[2].focal_px = [0.0; 2];
    assert!(ZoomTable::from_spec(&spec).unwrap_err().to_string().contains("camera.zoom[2].focal_px"));
    assert_eq!(ZoomTable::from_spec(&CameraSpec::default()).unwrap(), None);
}

#[test]
fn bulk_inverse_is_the_inverse() {
    let camera = s3_opencv();
    // Over and beside the picture.
    let at = |k: usize| [(k % 101) as f64 * 8.0 - 80.0, (k / 101) as f64 * 6.0 - 60.0];
    let pixels: Vec<[f64; 2]> = (0..101 * 101).map(at).collect();
    let bulk = BulkInverse::new(camera.clone());
    let (mut ideal, mut rays) = (vec![[0.0; 2]; pixels.len()], vec![[0.0; 3]; pixels.len()]);
    bulk.unproject(&pixels, &mut ideal);
    bulk.rays(&pixels, &mut rays);
    let mut seen = 0;
    for ((pixel, ideal), ray) in pixels.iter().zip(ideal).zip(rays) {
        let (ideal, ray) = (DVec2::from_array(ideal), DVec3::from_array(ray));
        let single = camera.unproject(DVec2::from_array(*pixel));
        assert_eq!((ideal.is_finite(), ray.is_finite()), (single.is_some(), single.is_some()), "{pixel:?}");
        let Some(single) = single else { continue };
        assert!((camera.project(ideal) - DVec2::from_array(*pixel)).length() < 1e-6, "{pixel:?}");
        // Beside the fold the inverse magnifies roundings a thousandfold and more.
        let off = camera.lens.jacobian(single) * (ideal - single);
        assert!(
            off.length() < 1e-13 && ideal.distance(single) < 1e-6,
            "{pixel:?}: {ideal} instead of {single}"
        );
        assert!(ray.distance(ideal.extend(1.0).normalize()) < 1e-7, "{pixel:?}");
        seen += 1;
    }
    assert!(seen > 3000 && seen < 5000, "{seen}");
}

/// Cameras with many pixels: every kind of lens that is solved in bulk, or holds one that is.
fn large_cameras() -> Vec<(&'static str, CameraModel)> {
    let brown = || LensSpec { model: LensModel::BrownConrady, coefficients: vec![-0.3, 0.1, 0.001, -0.002] };
    let fisheye = || LensSpec { model: LensModel::KannalaBrandt, coefficients: vec![-0.02, 0.001] };
    let chromatic = ChromaticSpec { red_scale: vec![1.01, 0.0, -0.004], ..Default::default() };
    let circle = |radius_px| ImageCircleSpec { radius_px: Some(radius_px), ..Default::default() };
    let flat = || CameraSpec { size_px: [320, 240], focal_px: [230.0, 232.0], ..Default::default() };
    let wide = || CameraSpec { size_px: [320, 240], focal_px: [82.0, 81.0], ..Default::default() };
    let mut specs = vec![
        ("plane", CameraSpec { lens: brown(), ..flat() }),
        ("rotation-symmetric", CameraSpec { lens: fisheye(), ..flat() }),
        (
            "scaled",
            CameraSpec {
                lens: brown(),
                chromatic: Some(chromatic.clone()),
                primary: Some(Primary::Red),
                ..flat()
            },
        ),
        ("circle", CameraSpec { lens: brown(), image_circle: Some(circle(130.0)), ..flat() }),
        (
            "circle of scaled",
            CameraSpec {
                lens: fisheye(),
                image_circle: Some(circle(110.0)),
                chromatic: Some(chromatic),
                primary: Some(Primary::Red),
                ..flat()
            },
        ),
    ];
    for face in Face::ALL {
        let image_circle = Some(circle(140.0));
        specs.push(("face", CameraSpec { lens: fisheye(), image_circle, face: Some(face), ..wide() }));
    }
    specs.into_iter().map(|(name, spec)| (name, CameraModel::from_spec(&spec).unwrap())).collect()
}

#[test]
fn lens_maps_are_the_inverses_of_pixels() {
    let mut faces = vec![0; 320 * 240];
    for (name, camera) in large_cameras() {
        let map = camera.lens_inverse();
        let mut seen = 0;
        for (i, uv) in map.iter().enumerate() {
            let pixel = [i as u32 % 320, i as u32 / 320];
            let wanted = camera.unproject_pixel(pixel);
            assert_eq!(uv[0] < INVALID_UV, wanted.is_some(), "{name}, {pixel:?}: {uv:?} for {wanted:?}");
            let Some(wanted) = wanted else { continue };
            let off = DVec2::new(f64::from(uv[0]), f64::from(uv[1])).distance(wanted);
            assert!(off < 1e-7 * (1.0 + wanted.length()), "{name}, {pixel:?}: {uv:?} for {wanted}");
            seen += 1;
            faces[i] += usize::from(name == "face");
        }
        assert!(seen > 1000 || name == "face", "{name}: {seen}");
    }
    // Each pixel of the circle is on one face.
    assert!(faces.iter().all(|count| *count <= 1));
    assert!(faces.iter().sum::<usize>() > 50_000);
}
