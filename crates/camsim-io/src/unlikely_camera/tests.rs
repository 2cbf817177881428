use camsim_core::scenario::{Binning, ImageCircleSpec, LensSpec, ResizedSpec, ShutterSpec};

use super::*;
use camsim_core::resized::delivered;

fn lens(model: LensModel, focal_px: f64, coefficients: &[f64]) -> CameraSpec {
    let lens = LensSpec { model, coefficients: coefficients.to_vec() };
    CameraSpec { lens, focal_px: [focal_px; 2], ..CameraSpec::default() }
}

fn told(camera: &CameraSpec) -> String {
    let all: Vec<String> = doubts_of_calibration(camera).iter().map(Doubt::to_string).collect();
    all.join("\n")
}

#[test]
fn a_focal_length_of_another_unit_is_named_with_its_field() {
    let field = |model, focal_px| field_doubt(&lens(model, focal_px, &[]));
    let text = |model, focal_px| field(model, focal_px).map(|doubt| doubt.to_string()).unwrap_or_default();
    // 2 atan(320 / 3.6) and 2 atan(320 / 1e6).
    let wide = text(LensModel::Pinhole, 3.6);
    assert!(wide.contains("focal_px = [3.6, 3.6]") && wide.contains("179 degrees across 640"), "{wide}");
    assert!(wide.contains("focal_px is in pixels"), "{wide}");
    let narrow = text(LensModel::BrownConrady, 1e6);
    assert!(narrow.contains("3.67e-2 degrees") && narrow.contains("1562 times the longer side"), "{narrow}");
    assert!(text(LensModel::Pinhole, 0.0028).contains("180 degrees"));
    // 640 / 5 radians.
    let turned = text(LensModel::Equirectangular, 5.0);
    assert!(turned.contains("7334 degrees") && turned.contains("2 pi"), "{turned}");
    for (model, focal_px) in [
        (LensModel::Pinhole, 500.0),
        (LensModel::Pinhole, 90.0),
        (LensModel::BrownConrady, 1e5),
        (LensModel::KannalaBrandt, 100.0),
        (LensModel::Equirectangular, 640.0 / TAU),
    ] {
        assert_eq!(field(model, focal_px), None, "{model:?} {focal_px}");
    }
}

#[test]
fn focal_lengths_that_no_lens_has_are_refused() {
    let is_refused = |focal_px| {
        field_doubt(&lens(LensModel::BrownConrady, focal_px, &[]))
            .is_some_and(|doubt| doubt.refusal().is_some())
    };
    assert!(is_refused(0.85) && is_refused(1e6));
    // 155 degrees are only told, and a lens of 85 mm is usual.
    assert!(!is_refused(71.0) && field_doubt(&lens(LensModel::BrownConrady, 71.0, &[])).is_some());
    assert!(!is_refused(1500.0));
}

#[test]
fn principal_points_of_other_pictures_are_told() {
    let at = |size_px, point| {
        told(&CameraSpec { size_px, principal_point_px: Some(point), ..lens(LensModel::Pinhole, 600.0, &[]) })
    };
    for (point, text) in [
        ([-0.5, -0.5], "is in the corner of the picture of 640 x 480"),
        ([0.0, 480.0], "is in the corner"),
        ([3.2, -1.7], "is in the corner"),
        ([161.2, 118.9], "would be the centre of a picture of about 323 x 239, not of 640 x 480"),
        ([960.0, 540.0], "would be the centre of a picture of about 1921 x 1081, not of 640 x 480"),
        ([240.0, 320.0], "check whether it is rotated"),
        ([320.0, 700.0], "is outside of the picture"),
        ([320.0, 60.0], "is far from the centre"),
    ] {
        let told = at([640, 480], point);
        assert!(told.contains(text) && told.contains("principal_point_px"), "{point:?}: {told}");
    }
    assert!(at([1920, 1080], [367.215, 248.375]).contains("735 x 498, not of 1920 x 1080"));
    // The farthest of published calibrations, and a cropped picture.
    for (size_px, point) in
        [([240, 180], [133.75, 113.99]), ([800, 600], [469.79, 180.36]), ([640, 400], [311.0, 175.7])]
    {
        assert_eq!(at(size_px, point), "");
    }
}

#[test]
fn lenses_that_no_glass_makes_are_told() {
    for (model, coefficients, text) in [
        (LensModel::BrownConrady, &[1204.5, -310.2, 95.1, 1210.0, -305.1][..], "of the pixels have a ray"),
        (LensModel::BrownConrady, &[1204.5, -310.2, 95.1, 1210.0, -305.1], "check the order and the scale"),
        (
            LensModel::BrownConrady,
            &[-0.28, 0.07, -0.05, 0.0002, 0.0],
            "tangential terms p1 and p2 are [-0.05, 0.0002]",
        ),
        (LensModel::BrownConrady, &[8.0, 4.0, 0.0, 0.0], "the focal length alone says"),
        (LensModel::KannalaBrandt, &[40.0, 0.0, 0.0, 0.0], "the focal length alone says"),
    ] {
        let told = told(&lens(model, 500.0, coefficients));
        assert!(told.contains(text), "{coefficients:?}: {told}");
    }
    for (model, coefficients) in [
        (LensModel::BrownConrady, &[-0.28, 0.07, 0.0002, 0.00002][..]),
        (LensModel::BrownConrady, &[0.09, -0.18, 0.0128, -0.0005, 0.3]),
        (LensModel::KannalaBrandt, &[0.25, -0.2, 0.1, -0.05]),
        (LensModel::Mei, &[1.4, -0.1, 0.2, 0.001, 0.002]),
        (LensModel::FTheta, &[0.3]),
    ] {
        assert_eq!(told(&lens(model, 500.0, coefficients)), "", "{coefficients:?}");
    }
}

#[test]
fn a_wrong_size_or_focal_length_is_told_once() {
    let lens = |size_px, focal_px| CameraSpec {
        size_px,
        principal_point_px: Some([367.215, 248.375]),
        ..lens(LensModel::BrownConrady, focal_px, &[-0.283, 0.0739, 0.0002, 0.00002])
    };
    for (camera, key) in
        [(lens([1920, 1080], 458.0), "principal_point_px"), (lens([752, 480], 4.2), "focal_px")]
    {
        let told = doubts_of_calibration(&camera);
        assert!(told.len() == 1 && told[0].key() == key, "{told:?}");
    }
}

#[test]
fn pixels_beyond_the_image_circle_are_meant() {
    let circle = ImageCircleSpec { radius_px: Some(40.0), ..ImageCircleSpec::default() };
    for coefficients in [&[][..], &[-0.28, 0.07, 0.0002, 0.00002]] {
        let lens = lens(LensModel::BrownConrady, 500.0, coefficients);
        assert_eq!(told(&CameraSpec { image_circle: Some(circle.clone()), ..lens }), "");
    }
}

#[test]
fn pixels_of_unequal_numbers_are_not_square() {
    let binned = |focal_px| {
        let binning = Some(Binning::Each([2.0, 1.0]));
        let resized = Some(ResizedSpec { binning, ..ResizedSpec::default() });
        let camera = CameraSpec { focal_px, resized, ..CameraSpec::default() };
        told(&delivered(&camera).expect("640 is even"))
    };
    assert_eq!(binned([500.0, 505.0]), "");
    assert!(binned([1000.0, 500.0]).contains("differs by 100 %"));
}

#[test]
fn arms_clocks_and_readouts_of_another_unit_are_told() {
    let camera = |change: fn(&mut CameraSpec)| {
        let mut camera = lens(LensModel::Pinhole, 500.0, &[]);
        change(&mut camera);
        told(&camera)
    };
    let arm = camera(|camera| camera.mount.offset_m = [-21.6, -64.7, 9.8]);
    assert!(arm.contains("69 m from the body's origin") && arm.contains("millimetres"), "{arm}");
    let clock = camera(|camera| camera.clock_offset_ms = 43_300.0);
    assert!(clock.contains("clock_offset_ms = 43300.0") && clock.contains("43.3 s"), "{clock}");
    let delay = camera(|camera| camera.shutter.delay_ms = -5000.0);
    assert!(delay.contains("shutter.delay_ms"), "{delay}");
    let turned = camera(|camera| camera.mount.angles_deg = [0.0, -1.571, 0.1]);
    assert!(
        turned.contains("mount.angles_deg = [0.0, -1.571, 0.1]") && turned.contains("[0, -90.01, 5.73]"),
        "{turned}"
    );
    let tilted = camera(|camera| camera.mount.angles_deg = [0.785, 0.0, 0.0]);
    assert!(tilted.contains("[44.98, 0, 0]"), "{tilted}");
    assert_eq!(camera(|camera| camera.mount.angles_deg = [0.8, -1.5, 0.3]), "");
    let fast = camera(|camera| camera.fps = 33_333_333.0);
    assert!(fast.contains("fps = 33333333.0 is more than any usual camera"), "{fast}");
    let short = camera(|camera| camera.shutter.readout_ms = 0.033);
    assert!(short.contains("shutter.readout_ms = 0.033 ms is shorter"), "{short}");
    let long = camera(|camera| camera.shutter.readout_ms = 330.0);
    assert!(long.contains("shutter.readout_ms = 330.0 ms is longer"), "{long}");
    let ratio = camera(|camera| camera.focal_px = [1600.09, 948.289]);
    assert!(ratio.contains("differs by 69 %"), "{ratio}");
    let usual = camera(|camera| {
        camera.mount.offset_m = [1.5, -4.0, 0.3];
        camera.clock_offset_ms = -120.0;
        camera.shutter = ShutterSpec { readout_ms: 33.0, ..ShutterSpec::default() };
        camera.focal_px = [500.0, 545.0];
    });
    assert_eq!(usual, "");
}

/// A scenario may shift a clock on purpose, or give another of its instants.
#[test]
fn clocks_of_scenarios_are_not_judged() {
    let camera = CameraSpec { clock_offset_ms: 43_300.0, ..lens(LensModel::Pinhole, 500.0, &[]) };
    assert_eq!(doubts(&camera), []);
}
