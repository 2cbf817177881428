#![allow(clippy::unwrap_used)]

use std::path::PathBuf;

use super::*;
use crate::{
    camera::CameraModel,
    scenario::{
        Auto, ImageSensorSpec, LensModel, LensSpec, LoadedFile, Mosaic, PhotometricSpec, Primary, Rig,
        SensorModel,
    },
    shutter::Shutter,
    validate::{checked_camera, checked_cameras, checked_rig, tests::good},
    vignetting::model_weight,
};

const SIZE_PX: [u32; 2] = [640, 480];

/// A camera with a lens, off the centre, of which every length is in pixels.
fn camera(lens: LensSpec) -> CameraSpec {
    CameraSpec {
        size_px: SIZE_PX,
        focal_px: [410.0, 412.0],
        principal_point_px: Some([318.3, 241.2]),
        lens,
        ..CameraSpec::default()
    }
}

fn pinhole() -> CameraSpec {
    camera(LensSpec::default())
}

fn crop(part: [u32; 4]) -> ResizedSpec {
    ResizedSpec { crop_px: Some(part), ..ResizedSpec::default() }
}

fn binning(count: f64) -> ResizedSpec {
    ResizedSpec { binning: Some(Binning::Both(count)), ..ResizedSpec::default() }
}

fn scale(factor: f64) -> ResizedSpec {
    ResizedSpec { scale: Some(factor), ..ResizedSpec::default() }
}

fn size(size_px: [u32; 2]) -> ResizedSpec {
    ResizedSpec { size_px: Some(size_px), ..ResizedSpec::default() }
}

/// The camera, and the map of its points.
fn resized(camera: &CameraSpec, spec: ResizedSpec) -> (CameraSpec, Resizing) {
    let change = Resizing::new(&spec, camera.size_px).unwrap();
    (delivered(&CameraSpec { resized: Some(spec), ..camera.clone() }).unwrap(), change)
}

fn refusal(camera: &CameraSpec, spec: ResizedSpec) -> String {
    let camera = CameraSpec { resized: Some(spec), ..camera.clone() };
    checked_camera(camera).unwrap_err().iter().map(ToString::to_string).collect::<Vec<_>>().join("\n")
}

/// Changes of every kind, with the same scale on both axes.
fn changes() -> [ResizedSpec; 6] {
    [
        crop([64, 32, 500, 400]),
        binning(2.0),
        scale(0.3),
        scale(1.75),
        size([320, 240]),
        ResizedSpec { crop_px: Some([101, 51, 402, 302]), ..binning(2.0) },
    ]
}

/// Centres of pixels of the delivered picture.
fn pixels([width, height]: [u32; 2]) -> impl Iterator<Item = [u32; 2]> {
    (0..8).flat_map(move |j| (0..8).map(move |i| [i * (width - 1) / 7, j * (height - 1) / 7]))
}

fn point([x, y]: [u32; 2]) -> DVec2 {
    DVec2::new(f64::from(x), f64::from(y))
}

#[test]
fn without_the_key_a_camera_stays_as_it_is() {
    let camera = pinhole();
    assert_eq!(delivered(&camera), Ok(camera.clone()));
    assert_eq!(resized(&camera, ResizedSpec::default()).0, camera);
    let centred = CameraSpec { principal_point_px: None, ..camera };
    assert_eq!(resized(&centred, binning(2.0)).0.principal_point_px, None);
}

#[test]
fn a_pixel_is_where_its_area_of_the_calibrated_picture_is() {
    // The centre of the first of the 2 x 2 pixels is that of their common corner.
    let binned = Resizing::new(&binning(2.0), SIZE_PX).unwrap();
    assert_eq!(binned.calibrated_point(DVec2::ZERO), DVec2::splat(0.5));
    assert_eq!((binned.size_px, binned.point(DVec2::new(2.5, 4.5))), ([320, 240], DVec2::new(1.0, 2.0)));
    let part = Resizing::new(&crop([64, 32, 500, 400]), SIZE_PX).unwrap();
    assert_eq!((part.size_px, part.point(DVec2::new(64.0, 33.0))), ([500, 400], DVec2::new(0.0, 1.0)));
    // Three do not divide 640: one column on the right is not used.
    let thirds = Resizing::new(&binning(3.0), SIZE_PX).unwrap();
    assert_eq!((thirds.size_px, thirds.part_px), ([213, 160], [0, 0, 639, 480]));
    let each = ResizedSpec { binning: Some(Binning::Each([2.0, 1.0])), ..ResizedSpec::default() };
    assert_eq!(Resizing::new(&each, SIZE_PX).unwrap().size_px, [320, 480]);
}

#[test]
fn points_keep_their_rays_in_every_lens() {
    for (model, coefficients) in [
        (LensModel::Pinhole, &[][..]),
        (LensModel::BrownConrady, &[-0.28, 0.07, 2e-4, 2e-5]),
        (LensModel::KannalaBrandt, &[0.01, -0.002]),
        (LensModel::FTheta, &[1.0, 0.0, -0.03]),
        (LensModel::DoubleSphere, &[-0.2, 0.55]),
        (LensModel::Division, &[-0.1]),
    ] {
        let full = camera(LensSpec { model, coefficients: coefficients.to_vec() });
        let whole = CameraModel::from_spec(&full).unwrap();
        for spec in changes() {
            let (part, change) = resized(&full, spec.clone());
            let part = CameraModel::from_spec(&part).unwrap();
            for at in pixels(change.size_px).map(point) {
                let [own, of_whole] =
                    [part.ray(at), whole.ray(change.calibrated_point(at))].map(Option::unwrap);
                assert!((own - of_whole).length() < 1e-9, "{model:?} {spec:?} {at}");
            }
        }
    }
}

#[test]
fn zoom_and_the_lenses_of_colours_follow() {
    let mut full = pinhole();
    full.zoom = vec![
        ZoomSpec { at: 1.0, focal_px: [410.0, 412.0], principal_point_px: None, coefficients: Vec::new() },
        ZoomSpec {
            at: 2.0,
            focal_px: [820.0, 824.0],
            principal_point_px: Some([319.0, 240.0]),
            coefficients: Vec::new(),
        },
    ];
    let (part, change) = resized(&full, ResizedSpec { crop_px: Some([101, 51, 402, 302]), ..binning(2.0) });
    for at in [1.0, 1.5, 2.0] {
        let [whole, part] = [&full, &part].map(|spec| CameraModel::at_zoom(spec, at).unwrap());
        assert!((change.point(whole.principal_point_px) - part.principal_point_px).length() < 1e-12);
        assert!((0.5 * whole.focal_px - part.focal_px).length() < 1e-12);
    }

    let red = PrimaryLensSpec {
        focal_px: Some([411.0, 413.0]),
        principal_point_px: Some([318.9, 241.5]),
        ..PrimaryLensSpec::default()
    };
    let chromatic =
        ChromaticSpec { red: Some(red), blue_scale: vec![1.001, -4e-4, 3e-4], ..ChromaticSpec::default() };
    let full = CameraSpec { chromatic: Some(chromatic), ..pinhole() };
    for spec in changes() {
        let (part, change) = resized(&full, spec);
        for primary in Primary::ALL {
            let [whole, part] =
                [&full, &part].map(|spec| CameraModel::from_spec(&spec.of_primary(primary)).unwrap());
            for at in pixels(change.size_px).map(point) {
                let [own, of_whole] =
                    [part.ray(at), whole.ray(change.calibrated_point(at))].map(Option::unwrap);
                assert!((own - of_whole).length() < 1e-9, "{primary:?} {at}");
            }
        }
    }
}

#[test]
fn vignetting_and_image_circle_are_those_of_the_same_points() {
    let vignetting = VignettingSpec {
        cos_power: 3.0,
        polynomial: vec![-0.3, 0.1, -0.02],
        polynomial_red: Some(vec![-0.35]),
        ..VignettingSpec::default()
    };
    let photometric = PhotometricSpec { vignetting: Some(vignetting), ..PhotometricSpec::default() };
    let circle = ImageCircleSpec {
        radius_px: Some(220.0),
        centre_px: Some([310.0, 236.0]),
        ..ImageCircleSpec::default()
    };
    let full = CameraSpec { photometric, image_circle: Some(circle), ..pinhole() };
    let weight = |spec: &CameraSpec, at, primary| {
        let bare = CameraSpec { image_circle: None, ..spec.clone() };
        let model = CameraModel::from_spec(&bare).unwrap();
        model_weight(spec.photometric.vignetting.as_ref().unwrap(), &model, at, primary)
    };
    // Twice the size has pixel centres between those of the calibrated picture, a crop has the same.
    let (part, change) = resized(&full, crop([64, 32, 500, 400]));
    for at in pixels(change.size_px) {
        let there = change.calibrated_point(point(at));
        let there = [there.x as u32, there.y as u32];
        for primary in Primary::ALL {
            let [own, of_whole] = [weight(&part, at, primary), weight(&full, there, primary)];
            assert!((own - of_whole).abs() < 1e-12, "{at:?} {primary:?}");
        }
    }
    // Of an odd number of pixels in one, the middle one has the same centre.
    let (part, change) = resized(&full, binning(3.0));
    for at in pixels(change.size_px) {
        let there = change.calibrated_point(point(at));
        let own = weight(&part, at, Primary::Red);
        assert!(
            (own - weight(&full, [there.x as u32, there.y as u32], Primary::Red)).abs() < 1e-12,
            "{at:?}"
        );
    }
    let circle = part.image_circle.unwrap();
    assert!((circle.radius_px.unwrap() - 220.0 / 3.0).abs() < 1e-12);
    assert_eq!(circle.centre_px.map(|at| change.calibrated_point(at.into())), Some(DVec2::new(310.0, 236.0)));
}

#[test]
fn rows_keep_the_time_from_one_to_the_next() {
    for readout in [
        Readout::TopToBottom,
        Readout::BottomToTop,
        Readout::LeftToRight,
        Readout::RightToLeft,
        Readout::MiddleOutward,
        Readout::EdgesInward,
    ] {
        for line_time_us in [None, Some(30.0)] {
            let shutter = ShutterSpec {
                readout,
                readout_ms: 24.0,
                line_time_us,
                delay_ms: 5.0,
                ..ShutterSpec::default()
            };
            let full = CameraSpec { shutter, ..pinhole() };
            let whole = Shutter::from_spec(&full.shutter, 30.0, full.size_px).unwrap();
            // A part about the centre has the times of the same rows.
            let (part, change) = resized(&full, crop([100, 80, 440, 320]));
            let own = Shutter::from_spec(&part.shutter, 30.0, part.size_px).unwrap();
            for at in pixels(change.size_px) {
                let there = change.calibrated_point(point(at));
                let expected_s = whole.dt_pixel_s(there.x as u32, there.y as u32);
                assert!((own.dt_pixel_s(at[0], at[1]) - expected_s).abs() < 1e-12, "{readout:?} {at:?}");
            }
            // A binned row has the mean of its rows.
            let (part, _) = resized(&full, binning(2.0));
            let own = Shutter::from_spec(&part.shutter, 30.0, part.size_px).unwrap();
            for [x, y] in pixels(part.size_px) {
                let mean = 0.5 * (whole.dt_pixel_s(2 * x, 2 * y) + whole.dt_pixel_s(2 * x + 1, 2 * y + 1));
                assert!((own.dt_pixel_s(x, y) - mean).abs() < 1e-12, "{readout:?} {x} {y}");
            }
        }
    }
    // The delay is that of the delivered picture's centre, wherever the part lies.
    let shutter = ShutterSpec { readout_ms: 24.0, delay_ms: 5.0, ..ShutterSpec::default() };
    let (part, _) = resized(&CameraSpec { shutter, ..pinhole() }, crop([0, 0, 640, 120]));
    assert_eq!((part.shutter.readout_ms, part.shutter.delay_ms), (6.0, 5.0));
}

#[test]
fn how_much_later_the_rows_of_a_part_are_is_known() {
    for readout in [Readout::TopToBottom, Readout::BottomToTop, Readout::LeftToRight, Readout::RightToLeft] {
        let shutter = ShutterSpec { readout, readout_ms: 24.0, delay_ms: 20.0, ..ShutterSpec::default() };
        let full = CameraSpec { shutter, ..pinhole() };
        let whole = Shutter::from_spec(&full.shutter, 30.0, full.size_px).unwrap();
        for spec in [crop([0, 0, 320, 121]), crop([101, 300, 500, 80]), binning(3.0)] {
            let (part, change) = resized(&full, spec);
            let own = Shutter::from_spec(&part.shutter, 30.0, part.size_px).unwrap();
            let time_s = |at: [u32; 2]| own.dt_pixel_s(at[0], at[1]);
            for at in pixels(change.size_px) {
                let there = change.calibrated_point(point(at));
                let later_s = time_s(at) - whole.dt_pixel_s(there.x as u32, there.y as u32);
                assert!((1e3 * later_s - part.made_of.rows_later_ms).abs() < 1e-9, "{readout:?} {at:?}");
            }
        }
    }
}

#[test]
fn fields_of_an_interlaced_part_keep_their_rows() {
    let shutter = ShutterSpec { interlace_ms: FieldOr::Field, ..ShutterSpec::default() };
    let full = CameraSpec { shutter, ..pinhole() };
    for (top, first) in [(50, Parity::Even), (51, Parity::Odd)] {
        assert_eq!(resized(&full, crop([0, top, 640, 100])).0.shutter.first_field, first);
    }
    assert!(refusal(&full, scale(0.5)).contains("would mix rows of both fields"));
}

#[test]
fn the_lens_blur_keeps_its_size_on_the_sensor() {
    let kernel = LoadedFile::from(PathBuf::from("kernel.png"));
    let spread = PointSpreadSpec {
        sigma_px: Some(1.5),
        f_number: Some(4.0),
        pixel_um: Some(3.0),
        defocus_px: Some(2.0),
        kernel: Some(kernel),
        kernel_oversampling: 4,
        ..PointSpreadSpec::default()
    };
    let full = CameraSpec { point_spread: Some(spread), ..pinhole() };
    let half = resized(&full, scale(0.5)).0.point_spread.unwrap();
    assert_eq!((half.sigma_px, half.defocus_px, half.pixel_um), (Some(0.75), Some(1.0), Some(6.0)));
    assert_eq!(half.kernel_oversampling, 8);
    assert_eq!(resized(&full, scale(2.0)).0.point_spread.unwrap().kernel_oversampling, 2);
    let problem = refusal(&full, scale(0.3));
    assert!(problem.contains("13.333 values of camera.point_spread.kernel a pixel"), "{problem}");
}

#[test]
fn a_pixel_of_the_sensor_is_the_sum_of_its_own() {
    let sensor = ImageSensorSpec {
        white_e: Some(1000.0),
        full_well_e: Some(4000.0),
        read_noise_e: Some(3.0),
        dsnu_e: Some(2.0),
        prnu: Some(0.01),
        dark_current_e_s: Some(5.0),
        pixel_um: Some(3.0),
        row_noise_e: 1.0,
        column_offset_e: 1.0,
        hot_pixels: 0.01,
        dead_pixels: 0.1,
        ..ImageSensorSpec::default()
    };
    let full = CameraSpec { sensor: Some(sensor.clone()), ..pinhole() };
    let binned = resized(&full, binning(2.0)).0.sensor.unwrap();
    assert_eq!(
        (binned.white_e, binned.full_well_e, binned.dark_current_e_s),
        (Some(4000.0), Some(16000.0), Some(20.0))
    );
    assert_eq!(
        (binned.read_noise_e, binned.dsnu_e, binned.prnu, binned.pixel_um),
        (Some(6.0), Some(4.0), Some(0.005), Some(6.0))
    );
    // Two pixels share the noise of a row, and two rows add theirs as squares.
    assert_eq!((binned.row_noise_e, binned.column_offset_e), (2.0 * 2_f64.sqrt(), 2.0 * 2_f64.sqrt()));
    assert!((binned.hot_pixels - (1.0 - 0.99_f64.powi(4))).abs() < 1e-15);
    assert!((binned.dead_pixels - 1e-4).abs() < 1e-15);
    // A part has the sensor's own pixels.
    assert_eq!(resized(&full, crop([64, 32, 500, 400])).0.sensor.unwrap(), sensor);
    // Facts of a named sensor are summed as well.
    let named = ImageSensorSpec { model: Some(SensorModel::Imx250), ..ImageSensorSpec::default() };
    let well =
        |spec: &CameraSpec| crate::imaging::with_facts(spec.sensor.as_ref().unwrap()).full_well_e.unwrap();
    let full = CameraSpec { sensor: Some(named), ..pinhole() };
    assert_eq!(well(&resized(&full, binning(2.0)).0), 4.0 * well(&full));
}

#[test]
fn a_part_begins_with_the_colour_that_lies_there() {
    let of = |mosaic, left, top| {
        let sensor = ImageSensorSpec { white_e: Some(1e3), mosaic, ..ImageSensorSpec::default() };
        resized(&CameraSpec { sensor: Some(sensor), ..pinhole() }, crop([left, top, 100, 100]))
            .0
            .sensor
            .unwrap()
            .mosaic
    };
    assert_eq!(
        [of(Mosaic::Rggb, 2, 4), of(Mosaic::Rggb, 1, 0), of(Mosaic::Rggb, 0, 1), of(Mosaic::Rggb, 1, 1)],
        [Mosaic::Rggb, Mosaic::Grbg, Mosaic::Gbrg, Mosaic::Bggr]
    );
    let sensor = ImageSensorSpec { white_e: Some(1e3), mosaic: Mosaic::Rgbw, ..ImageSensorSpec::default() };
    let full = CameraSpec { sensor: Some(sensor), ..pinhole() };
    assert_eq!(resized(&full, crop([4, 8, 100, 100])).0.sensor, full.sensor);
    assert!(refusal(&full, crop([2, 0, 100, 100])).contains("multiples of 4"));
}

#[test]
fn changes_one_after_the_other_are_one_change() {
    let full = CameraSpec {
        lens: LensSpec { model: LensModel::Table, coefficients: Vec::new() },
        lens_table: Some(PathBuf::from("lens.csv").into()),
        photometric: PhotometricSpec { noise_sigma: 0.02, ..PhotometricSpec::default() },
        ..pinhole()
    };
    let (first, _) = resized(&full, crop([64, 32, 500, 400]));
    let (twice, _) = resized(&first, ResizedSpec { crop_px: Some([36, 18, 402, 302]), ..binning(2.0) });
    let (once, change) = resized(&full, ResizedSpec { crop_px: Some([100, 50, 402, 302]), ..binning(2.0) });
    assert_eq!(twice, once);
    assert_eq!(once.photometric.noise_sigma, 0.01);
    let files_of = once.files_of.unwrap();
    assert_eq!(
        (files_of.size_px, files_of.focal_px, files_of.part_px),
        (SIZE_PX, full.focal_px, [100.0, 50.0, 402.0, 302.0])
    );
    let at = DVec2::new(17.0, 40.0);
    assert!((files_of.point(at, once.size_px) - change.calibrated_point(at)).length() < 1e-12);
}

#[test]
fn what_cannot_follow_is_refused_with_the_fix() {
    for (spec, wanted) in [
        (crop([64, 32, 600, 400]), "camera.resized.crop_px: is [left, top, width, height]"),
        (crop([0, 0, 0, 10]), "which is not a part of the 640 x 480 pixels"),
        (binning(1.5), "another factor is camera.resized.scale"),
        (binning(0.0), "camera.resized.binning: must be 1 to 32768, not 0; 2 makes one of 2 x 2"),
        (binning(641.0), "whole numbers from 1 to 640 across"),
        (scale(-1.0), "0.5 halves both"),
        (scale(f64::NAN), "0.5 halves both"),
        (scale(1e9), "0.5 halves both"),
        (scale(1e-3), "must leave 1..32768 on each side, not 0.001"),
        (size([0, 240]), "camera.resized.size_px: must be 1 to 32768, not [0, 240]; give [width, height]"),
        (ResizedSpec { scale: Some(0.5), ..binning(2.0) }, "has more than one of binning, scale and size_px"),
    ] {
        let problem = refusal(&pinhole(), spec);
        assert!(problem.contains(wanted), "{problem}");
    }
    // A blur of one radius cannot be squeezed; without it the picture can.
    let squeezed = size([320, 480]);
    assert_eq!(resized(&pinhole(), squeezed.clone()).0.focal_px, [205.0, 412.0]);
    let spread = PointSpreadSpec { sigma_px: Some(1.0), ..PointSpreadSpec::default() };
    let problem = refusal(&CameraSpec { point_spread: Some(spread), ..pinhole() }, squeezed);
    assert!(problem.contains("camera.point_spread is of one scale"), "{problem}");
    let shutter = ShutterSpec { readout: Readout::MiddleOutward, readout_ms: 10.0, ..ShutterSpec::default() };
    let problem = refusal(&CameraSpec { shutter, ..pinhole() }, crop([0, 0, 640, 100]));
    assert!(problem.contains("leaves 0 rows above and 380 below"), "{problem}");
}

#[test]
fn rigs_are_checked_as_stated_and_as_made() {
    let named = |name: &str, resized| CameraSpec { name: name.into(), resized, ..pinhole() };
    let shared = good();
    let rig =
        |right| Rig::of_cameras(&shared, vec![named("left", None), named("right", Some(right))]).unwrap();
    let made = checked_rig(rig(binning(2.0))).unwrap();
    let sizes: Vec<_> = made.scenarios().iter().map(|scenario| scenario.camera.size_px).collect();
    assert_eq!(sizes, [SIZE_PX, [320, 240]]);
    assert!(made.scenarios().iter().all(|scenario| scenario.camera.resized.is_none()));
    let problems = checked_rig(rig(binning(1.5))).unwrap_err();
    assert!(problems.len() == 1 && problems[0].key == "cameras.1.resized.binning", "{problems:?}");
    assert!(problems[0].message.contains("cameras.right.resized.scale"), "{problems:?}");
    let cameras = checked_cameras(vec![named("left", None), named("right", Some(binning(2.0)))]).unwrap();
    assert_eq!(cameras[1].size_px, [320, 240]);
    let mut shared = good();
    shared.quality.blur_samples = Auto::Value(0);
    let rig =
        Rig::of_cameras(&shared, vec![named("left", None), named("right", Some(binning(2.0)))]).unwrap();
    let problems = checked_rig(rig).unwrap_err();
    assert!(problems.len() == 1 && problems[0].key == "quality.blur_samples", "{problems:?}");
    assert!(!problems[0].message.contains("camera.resized"), "{problems:?}");
}
