//! Calibrations written for other programs and read back: the same cameras, to the last bit or to its rounding.

#![allow(clippy::unwrap_used, reason = "tests")]

use camsim_core::scenario::{CameraSpec, ChromaticSpec, ImageCircleSpec, LensModel, LensSpec, Readout};
use camsim_io::{
    formats::reading::{CameraFormat, ImportOptions, ImportedRig, import_rig},
    formats::writing::{CalibrationFormat, export},
};

/// The name under which each format is read back.
fn read_as(format: CalibrationFormat) -> CameraFormat {
    match format {
        CalibrationFormat::OpenCv => CameraFormat::OpenCv,
        CalibrationFormat::Ros => CameraFormat::RosCameraInfo,
        CalibrationFormat::Kalibr | CalibrationFormat::OpenVins => CameraFormat::Kalibr,
        CalibrationFormat::Euroc => CameraFormat::Euroc,
        CalibrationFormat::Colmap => CameraFormat::Colmap,
        CalibrationFormat::Basalt => CameraFormat::Basalt,
        CalibrationFormat::OrbSlam3 => CameraFormat::OrbSlam,
        CalibrationFormat::Vins => CameraFormat::Camodocal,
        CalibrationFormat::Nerfstudio => CameraFormat::Nerfstudio,
        CalibrationFormat::Stmap => panic!("STmaps are pictures"),
    }
}

/// Numbers with all their bits, the same at every run.
struct Numbers(u64);

impl Numbers {
    fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1u64 << 53) as f64)
    }
}

fn lens(model: LensModel, numbers: &mut Numbers, count: usize) -> LensSpec {
    LensSpec { model, coefficients: (0..count).map(|_| numbers.between(-0.02, 0.02)).collect() }
}

fn camera(lens: LensSpec, numbers: &mut Numbers) -> CameraSpec {
    CameraSpec {
        name: "cam0".into(),
        size_px: [752, 480],
        focal_px: [numbers.between(300.0, 600.0), numbers.between(300.0, 600.0)],
        principal_point_px: Some([numbers.between(300.0, 450.0), numbers.between(180.0, 300.0)]),
        lens,
        ..CameraSpec::default()
    }
}

/// The lenses that at least one format has.
fn lenses(numbers: &mut Numbers) -> Vec<LensSpec> {
    let mut of = |model, count| lens(model, numbers, count);
    vec![
        LensSpec::default(),
        of(LensModel::BrownConrady, 4),
        of(LensModel::BrownConrady, 5),
        of(LensModel::BrownConrady, 8),
        of(LensModel::KannalaBrandt, 4),
        of(LensModel::BrownConradyPrism, 12),
        of(LensModel::BrownConradyPrism, 14),
        of(LensModel::Fisheye624, 12),
        of(LensModel::Mei, 5),
        of(LensModel::Division, 1),
        LensSpec {
            model: LensModel::DoubleSphere,
            coefficients: vec![-0.24 + numbers.between(0.0, 0.1), 0.6],
        },
        LensSpec { model: LensModel::Eucm, coefficients: vec![0.6 + numbers.between(0.0, 0.1), 1.1] },
        LensSpec { model: LensModel::Ucm, coefficients: vec![0.6 + numbers.between(0.0, 0.1)] },
        LensSpec { model: LensModel::Fov, coefficients: vec![0.9 + numbers.between(0.0, 0.1)] },
    ]
}

fn read_back(cameras: &[CameraSpec], format: CalibrationFormat) -> Option<ImportedRig> {
    let exported = export(cameras, format).ok()?;
    let [file] = &exported.files[..] else { panic!("{}: one file is expected", format.name()) };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(file.name);
    std::fs::write(&path, &file.bytes).unwrap();
    // Detected by content, as a user's file.
    let rig = import_rig(&path, &ImportOptions::default()).unwrap_or_else(|error| {
        panic!("{}: {error}\n{}", format.name(), String::from_utf8_lossy(&file.bytes))
    });
    assert_eq!(rig.format, read_as(format), "{}", format.name());
    Some(rig)
}

/// Half a pixel added and subtracted rounds where the binary exponent changes.
fn same_px(a: [f64; 2], b: [f64; 2]) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 2.5e-16 * b.abs())
}

#[test]
fn intrinsics_come_back_to_the_last_bit() {
    let mut numbers = Numbers(1);
    let mut models = std::collections::HashSet::new();
    for format in CalibrationFormat::ALL.into_iter().filter(|format| *format != CalibrationFormat::Stmap) {
        let mut written = 0;
        for lens in (0..10).flat_map(|_| lenses(&mut numbers)).collect::<Vec<_>>() {
            let spec = camera(lens, &mut numbers);
            let Some(rig) = read_back(std::slice::from_ref(&spec), format) else { continue };
            let [back] = &rig.cameras[..] else { panic!("{}: {} cameras", format.name(), rig.cameras.len()) };
            written += 1;
            models.insert(spec.lens.model);
            assert_eq!((back.size_px, back.focal_px), (spec.size_px, spec.focal_px), "{}", format.name());
            let (point, wanted) = (back.principal_point_px.unwrap(), spec.principal_point_px.unwrap());
            let is_shifted = [CalibrationFormat::Colmap, CalibrationFormat::Nerfstudio].contains(&format);
            assert!(
                point == wanted || is_shifted && same_px(point, wanted),
                "{}: {point:?} for {wanted:?}",
                format.name()
            );
            assert_eq!(back.lens, spec.lens, "{}", format.name());
        }
        assert!(written >= 30, "{}: {written} lenses", format.name());
    }
    // Every model but f-theta's two, panoramas and tables is in some format.
    assert_eq!(models.len(), LensModel::ALL.len() - 4, "{models:?}");
}

/// A rig with everything that a chain holds.
fn rig() -> Vec<CameraSpec> {
    let mut numbers = Numbers(7);
    let cameras = [
        ([0.0, -90.0, 0.0], [0.0, -0.055, 0.0], 0.0, 14.88, Readout::TopToBottom),
        ([1.25, -88.5, 3.0], [0.1, 0.055, -0.02], -5.618_603_727_452_336, 9.6, Readout::BottomToTop),
        ([0.0, 0.0, 180.0], [-0.3, 1e-3, 0.4], 2.5, 0.0, Readout::TopToBottom),
        ([-17.123_456_789, 42.0, -135.0], [0.7, -0.8, 0.9], 1e-3, 33.0, Readout::TopToBottom),
    ];
    let of = |(i, (angles_deg, offset_m, clock_offset_ms, readout_ms, readout))| {
        let lens = lens(LensModel::BrownConrady, &mut numbers, 4);
        let mut spec = camera(lens, &mut numbers);
        spec.name = format!("cam{i}");
        spec.mount.angles_deg = angles_deg;
        spec.mount.offset_m = offset_m;
        spec.clock_offset_ms = clock_offset_ms;
        spec.shutter.readout_ms = readout_ms;
        spec.shutter.readout = readout;
        spec
    };
    cameras.into_iter().enumerate().map(of).collect()
}

#[test]
fn chains_keep_poses_clocks_and_readouts() {
    let cameras = rig();
    for format in [CalibrationFormat::Kalibr, CalibrationFormat::OpenVins] {
        assert_eq!(read_back(&cameras, format).unwrap().cameras, cameras, "{}", format.name());
    }
    // Formats of one camera, or with one clock.
    for format in [CalibrationFormat::Vins, CalibrationFormat::Basalt, CalibrationFormat::Euroc] {
        for camera in &cameras {
            let back = &read_back(std::slice::from_ref(camera), format).unwrap().cameras[0];
            assert_eq!(back.mount, camera.mount, "{}", format.name());
            if format != CalibrationFormat::Euroc {
                // Basalt has whole nanoseconds.
                let rounding = if format == CalibrationFormat::Basalt { 0.5e-6 } else { 0.0 };
                let error = (back.clock_offset_ms - camera.clock_offset_ms).abs();
                assert!(error <= rounding, "{}: {error:e}", format.name());
            }
            if format == CalibrationFormat::Vins && camera.shutter.readout == Readout::TopToBottom {
                assert_eq!(back.shutter, camera.shutter);
            }
        }
    }
    let pair = &cameras[..2];
    let back = read_back(pair, CalibrationFormat::OrbSlam3).unwrap();
    assert_eq!([&back.cameras[0].mount, &back.cameras[1].mount], [&pair[0].mount, &pair[1].mount]);
    assert!(export(&cameras[..3], CalibrationFormat::OrbSlam3).is_err());
}

#[test]
fn what_a_format_cannot_hold_is_named() {
    let mut spec = rig().remove(0);
    spec.fps = 20.5;
    spec.phase = 0.25;
    spec.shutter.exposure_ms = 4.0;
    spec.shutter.delay_ms = 7.0;
    spec.clock_offset_ms = 1.5;
    spec.photometric.noise_sigma = 0.01;
    spec.chromatic = Some(ChromaticSpec { red_scale: vec![1.001], ..ChromaticSpec::default() });
    spec.image_circle = Some(ImageCircleSpec { radius_px: Some(300.0), ..ImageCircleSpec::default() });
    let set = [
        "fps",
        "phase",
        "shutter.exposure_ms",
        "shutter.delay_ms",
        "shutter.readout_ms",
        "clock_offset_ms",
        "photometric.noise_sigma",
        "chromatic.red_scale",
        "image_circle.radius_px",
        "mount.angles_deg",
        "mount.offset_m",
    ];
    for format in CalibrationFormat::ALL {
        let exported = export(std::slice::from_ref(&spec), format).unwrap();
        let named = |key: &str| exported.notes.iter().any(|note| note.contains(&format!("{key} = ")));
        let back = match format {
            CalibrationFormat::Stmap => CameraSpec::default(),
            format => read_back(std::slice::from_ref(&spec), format).unwrap().cameras.remove(0),
        };
        // The file has it as `cam0`.
        let is_numbered = matches!(format, CalibrationFormat::Kalibr | CalibrationFormat::OpenVins);
        assert!(!(is_numbered && named("name")), "{}: {:?}", format.name(), exported.notes);
        let values = |spec: &CameraSpec| toml::Table::try_from(spec).unwrap();
        let value = |table: &toml::Table, key: &str| match key.split_once('.') {
            Some((first, second)) => table.get(first).and_then(|below| below.get(second)).cloned(),
            None => table.get(key).cloned(),
        };
        for key in set {
            let is_kept = value(&values(&back), key) == value(&values(&spec), key);
            // One shift of stamps stands for both.
            let is_shift = ["shutter.delay_ms", "clock_offset_ms"].contains(&key)
                && exported.notes.iter().any(|note| note.contains("clock_offset_ms of 8.5"))
                && (back.clock_offset_ms - 8.5).abs() < 1e-12;
            assert!(
                is_kept || named(key) || is_shift,
                "{}: {key} is lost: {:?}",
                format.name(),
                exported.notes
            );
            assert!(!(is_kept && named(key)), "{}: {key} is kept, and named as lost", format.name());
        }
    }
}

#[test]
fn lenses_that_a_format_does_not_have_are_errors() {
    let mut numbers = Numbers(3);
    let eight = camera(lens(LensModel::BrownConrady, &mut numbers, 8), &mut numbers);
    for format in [CalibrationFormat::Kalibr, CalibrationFormat::OrbSlam3, CalibrationFormat::Nerfstudio] {
        let error = export(std::slice::from_ref(&eight), format).unwrap_err().to_string();
        assert!(
            error.contains("has no lens with this many coefficients") && error.contains("cam0"),
            "{error}"
        );
    }
    let pair = [eight.clone(), CameraSpec { name: "other".into(), ..eight }];
    let error = export(&pair, CalibrationFormat::OpenCv).unwrap_err().to_string();
    assert!(error.contains("holds one camera, and there are 2 (cam0, other)"), "{error}");
    let mut zooming = pair[0].clone();
    zooming.zoom = vec![camsim_core::scenario::ZoomSpec {
        at: 1.0,
        focal_px: [400.0; 2],
        principal_point_px: None,
        coefficients: Vec::new(),
    }];
    assert!(export(&[zooming], CalibrationFormat::Ros).unwrap_err().to_string().contains("zooms"));
}

/// Those that calibrations in the data folder have, written again: the pose of the file to its own rounding.
#[test]
fn published_chains_come_back() {
    let Some(data) = std::env::var_os("CAMSIM_DATA").map(std::path::PathBuf::from) else { return };
    let mut cameras = 0;
    for entry in std::fs::read_dir(data.join("calib/cameras/open_vins")).unwrap() {
        let path = entry.unwrap().path();
        let rig = import_rig(&path, &ImportOptions::default()).unwrap();
        let back = read_back(&rig.cameras, CalibrationFormat::Kalibr).unwrap();
        for (camera, back) in rig.cameras.iter().zip(&back.cameras) {
            cameras += 1;
            assert_eq!(
                (&camera.lens, camera.focal_px, camera.principal_point_px),
                (&back.lens, back.focal_px, back.principal_point_px)
            );
            assert!(
                (camera.clock_offset_ms - back.clock_offset_ms).abs() <= 1e-15 * camera.clock_offset_ms.abs()
            );
            let turn = |spec: &CameraSpec| {
                glam::DMat3::from_quat(camsim_core::mount::body_from_camera(spec.mount.angles_deg))
            };
            assert!(
                turn(camera).abs_diff_eq(turn(back), 5e-15),
                "{}: {:?} {:?}",
                path.display(),
                camera.mount,
                back.mount
            );
            let offsets = camera.mount.offset_m.iter().zip(back.mount.offset_m);
            offsets.for_each(|(a, b)| assert!((a - b).abs() < 4e-15, "{}: {a} {b}", path.display()));
        }
    }
    assert!(cameras >= 20, "{cameras}");
}

#[test]
fn half_pixels_are_those_of_each_program() {
    let spec = CameraSpec { principal_point_px: Some([320.0, 240.0]), ..CameraSpec::default() };
    let text = |format| {
        String::from_utf8(export(std::slice::from_ref(&spec), format).unwrap().files[0].bytes.clone())
            .unwrap()
    };
    assert!(text(CalibrationFormat::Colmap).ends_with("1 SIMPLE_PINHOLE 640 480 500 320.5 240.5\n"));
    assert!(text(CalibrationFormat::Nerfstudio).contains("\"cx\": 320.5, \"cy\": 240.5"));
    assert!(
        text(CalibrationFormat::OpenCv).contains("[500.0, 0.0, 320.0, 0.0, 500.0, 240.0, 0.0, 0.0, 1.0]")
    );
}
