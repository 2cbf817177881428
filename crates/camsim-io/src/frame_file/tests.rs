#![allow(clippy::unwrap_used)]

use std::fs;

use camsim_core::{
    frame::{Plane, RenderedFrame},
    scenario::OutputEncoding,
    scene::linear_from_srgb,
    temporal::displacement::Twist,
};

use super::*;
use crate::write::write_picture;

/// A folder with a 3x2 picture `c.png`, 16-bit `d.png`, and FRAME.toml of `text`.
fn folder(text: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    image::RgbImage::from_fn(3, 2, |x, y| image::Rgb([10 * x as u8, 100 * y as u8, 255]))
        .save(folder.path().join("c.png"))
        .unwrap();
    let depth = vec![1000_u16, 2000, 0, 4000, 500, 65535];
    image::ImageBuffer::<image::Luma<u16>, _>::from_raw(3, 2, depth.clone())
        .unwrap()
        .save(folder.path().join("d.png"))
        .unwrap();
    let pgm: Vec<u8> =
        b"P5\n3 2\n65535\n".iter().copied().chain(depth.iter().flat_map(|v| v.to_be_bytes())).collect();
    fs::write(folder.path().join("d.pgm"), pgm).unwrap();
    fs::write(
        folder.path().join("p.csv"),
        "t_s,x,y,z,qx,qy,qz,qw\n10,1,2,3,0,0,0,1\n# a comment\n11,2,2,3,0,0,0,-1\n",
    )
    .unwrap();
    let path = folder.path().join("FRAME.toml");
    fs::write(&path, text).unwrap();
    (folder, path)
}

const GOOD: &str = "color = \"c.png\"\ndepth = \"d.png\"\ndepth_per_metre = 1000\nfocal_px = [2, 2]\n";

fn read(text: &str) -> Result<FrameFile, FrameFileError> {
    let (_folder, path) = folder(text);
    read_frame(&path)
}

#[test]
fn frames_are_read_with_default_keys() {
    let file = read(GOOD).unwrap();
    assert_eq!(file.frame.geometry.principal_px, DVec2::new(1.0, 0.5));
    assert_eq!(file.frame.inverse_depth, [1.0, 0.5, 0.0, 0.25, 2.0, (1.0_f64 / 65.535) as f32]);
    assert_eq!(file.frame.color_rgba[4..8], [linear_from_srgb(10.0 / 255.0), 0.0, 1.0, 1.0]);
    assert_eq!((file.motion, file.fog, file.frame.instant_s), (Motion::Twist(Twist::default()), None, 0.0));
    assert!((file.without_depth - 1.0 / 6.0).abs() < 1e-12);
    // The same depth as PGM.
    assert_eq!(read(&GOOD.replace("d.png", "d.pgm")).unwrap().frame, file.frame);
}

#[test]
fn all_keys_are_applied() {
    let text = "color_space = \"linear\"\ndepth_kind = \"range\"\nprincipal_point_px = [0, 0]\ninstant_ms = \
        -20\n\
                [motion]\nvelocity_m_s = [1, 2, 3]\nangular_rate_rad_s = [0.1, 0.2, 0.3]\n[fog]\nend_m = \
                9\ncolor = [0.5, 0.6, 0.7]\n";
    let file = read(&format!("{GOOD}{text}")).unwrap();
    assert_eq!(file.frame.color_rgba[4], 10.0 / 255.0);
    // Pixel (1, 1) lies at (0.5, 0.5): its range is longer than its depth by sqrt(1.5).
    assert!((f64::from(file.frame.inverse_depth[4]) - 2.0 * 1.5_f64.sqrt()).abs() < 1e-6);
    assert_eq!(file.frame.instant_s, -0.02);
    let twist = Twist { velocity_m_s: DVec3::new(1.0, 2.0, 3.0), rate_rad_s: DVec3::new(0.1, 0.2, 0.3) };
    assert_eq!(file.motion, Motion::Twist(twist));
    assert_eq!(file.fog, Some(LinearFog { end_m: 9.0, color: DVec3::new(0.5, 0.6, 0.7) }));
    let Motion::Poses(_) =
        read(&format!("{GOOD}[motion]\ntrajectory = \"p.csv\"\nstamp_s = 10.5\n")).unwrap().motion
    else {
        panic!("poses are poses")
    };
    let twist = read(&format!("{GOOD}[motion]\ntrajectory = \"p.csv\"\nstamp_s = 10.5\n"))
        .unwrap()
        .motion
        .twist_at(0.0);
    assert_eq!(twist, Twist { velocity_m_s: DVec3::X, rate_rad_s: DVec3::ZERO });
    // Rotation alone needs no depth.
    assert_eq!(read("color = \"c.png\"\nfocal_px = [2, 2]\n").unwrap().frame.inverse_depth, [0.0; 6]);
    let by_table = "color = \"c.png\"\nfocal_px = [2, 2]\n[motion]\ntrajectory = \"p.csv\"\nstamp_s = 10.5\n";
    let (folder, path) = folder(by_table);
    let error = read_frame(&path).unwrap_err().to_string();
    assert!(error.contains("depth: is missing, and the camera moves"), "{error}");
    fs::write(folder.path().join("p.csv"), "t_s,x,y,z,qx,qy,qz,qw\n10,1,2,3,0,0,0,1\n11,1,2,3,0,0,1,0\n")
        .unwrap();
    assert_eq!(read_frame(&path).unwrap().frame.inverse_depth, [0.0; 6]);
}

#[test]
fn depth_is_read_from_exr_and_packed_bytes() {
    let (folder, path) = folder("color = \"out.exr\"\ndepth = \"out.exr\"\nfocal_px = [2, 2]\n");
    let depth_m = vec![1.0, f32::INFINITY, 4.0, 1e10, f32::NAN, -1.0];
    let color_rgba: Vec<f32> = (0..24).map(|i| i as f32 / 8.0).collect();
    let frame = RenderedFrame {
        size_px: [3, 2],
        planes: vec![Plane::color(color_rgba.clone()), Plane::depth(depth_m)],
        ..RenderedFrame::default()
    };
    // The output of `apply` can be read again, with linear values above 1.
    write_picture(&folder.path().join("out.exr"), &frame, OutputEncoding::Srgb8).unwrap();
    let file = read_frame(&path).unwrap();
    assert_eq!(file.frame.inverse_depth, [1.0, 0.0, 0.25, 0.0, 0.0, 0.0]);
    assert_eq!(file.frame.color_rgba[..3], color_rgba[..3]);
    let error =
        write_picture(&folder.path().join("out.tga"), &frame, OutputEncoding::Srgb8).unwrap_err().to_string();
    assert!(error.contains(".exr or .png"), "{error}");

    // 12 * 255 + 34 + 51/255 m, and sky.
    let packed =
        image::RgbImage::from_fn(3, 2, |x, _| image::Rgb(if x == 1 { [12, 34, 51] } else { [255; 3] }));
    packed.save(folder.path().join("p.png")).unwrap();
    fs::write(
        &path,
        "color = \"c.png\"\ndepth = \"p.png\"\ndepth_encoding = \"packed24\"\nfocal_px = [2, 2]\n",
    )
    .unwrap();
    let file = read_frame(&path).unwrap();
    assert!(
        (f64::from(file.frame.inverse_depth[1]) * 3094.2 - 1.0).abs() < 1e-6
            && file.frame.inverse_depth[0] == 0.0
    );
}

#[test]
fn impossible_depth_is_refused_and_sky_is_not() {
    let (folder, path) = folder("color = \"c.png\"\ndepth = \"z.exr\"\nfocal_px = [2, 2]\n");
    let read_depth = |depth_m: [f32; 6]| {
        let frame = RenderedFrame {
            size_px: [3, 2],
            planes: vec![Plane::color(vec![0.5; 24]), Plane::depth(depth_m.to_vec())],
            ..RenderedFrame::default()
        };
        write_picture(&folder.path().join("z.exr"), &frame, OutputEncoding::Srgb8).unwrap();
        read_frame(&path)
    };
    for (depth_m, expected) in [
        ([-5.0; 6], "z.exr: has no depth: of 6 pixels 6 are negative"),
        ([f32::NAN; 6], "6 not a number"),
        ([1e-9; 6], "6 nearer than a micrometre"),
        (
            [-5.0, -4.0, f32::NEG_INFINITY, 0.0, 0.0, f32::INFINITY],
            "3 are negative, 0 not a number, 0 nearer",
        ),
    ] {
        let error = read_depth(depth_m).unwrap_err().to_string();
        assert!(error.contains(expected) && error.contains("OpenGL"), "{error}");
    }
    for sky in [[0.0; 6], [f32::INFINITY; 6]] {
        assert_eq!(read_depth(sky).unwrap().without_depth, 1.0);
    }
    assert_eq!(
        read_depth([-1.0, -1.0, -1.0, f32::NAN, 0.0, 4.0]).unwrap().frame.inverse_depth,
        [0.0, 0.0, 0.0, 0.0, 0.0, 0.25]
    );

    let of_exr = "color = \"c.png\"\ndepth = \"z.exr\"\nfocal_px = [2, 2]\n";
    for (text, expected) in [
        (
            format!("{of_exr}depth_encoding = \"packed24\"\n"),
            "FRAME.toml: depth_encoding: \"packed24\" is of 8-bit RGB pictures",
        ),
        (format!("{of_exr}depth_per_metre = 1e-4\n"), "depth_per_metre: must be 0.001 to 1e6"),
        (GOOD.replace("1000", "1e-300"), "depth_per_metre: must be 0.001 to 1e6"),
        (GOOD.replace("1000", "1e300"), "depth_per_metre: must be 0.001 to 1e6"),
        (GOOD.replace("1000", "nan"), "depth_per_metre: must be 0.001 to 1e6"),
        (
            GOOD.replace("depth_per_metre = 1000", "depth_encoding = \"packed24\""),
            "d.png: is no 8-bit RGB picture",
        ),
        (
            format!("{GOOD}depth_encoding = \"packed24\"\n").replace("d.png", "c.png"),
            "depth_per_metre: is for numbers; bytes of depth_encoding have their own formula",
        ),
    ] {
        fs::write(&path, &text).unwrap();
        let error = read_frame(&path).unwrap_err().to_string();
        assert!(error.contains(expected), "{text}\n  gives {error}\n  not   {expected}");
    }
}

#[test]
fn errors_name_key_and_file() {
    for (text, expected) in [
        ("color = \"c.png\"\n", "focal_px: is missing"),
        (
            "colour = \"c.png\"\nfocal_px = [2, 2]\n",
            "FRAME.toml:1: colour: unknown key; did you mean `color`?",
        ),
        (&format!("{GOOD}depth_per_meter = 5\n"), "did you mean `depth_per_metre`?"),
        (&format!("{GOOD}[motion]\nvelocity = [1, 2, 3]\n"), "did you mean `motion.velocity_m_s`?"),
        (&format!("{GOOD}depth_kind = \"ranged\"\n"), "did you mean \"range\"?"),
        (&GOOD.replace("[2, 2]", "[2, -2]"), "focal_px: must be"),
        (&GOOD.replace("depth_per_metre = 1000\n", ""), "depth_per_metre: is missing"),
        (
            &GOOD.replace("d.png", "c.png"),
            "c.png: is an 8-bit RGB picture, whose bytes do not tell how depth was packed",
        ),
        (&GOOD.replace("d.png", "no.png"), "no.png: cannot be read"),
        (&GOOD.replace("c.png", "d.csv"), "d.csv: cannot be read"),
        (
            "color = \"c.png\"\nfocal_px = [2, 2]\n[motion]\nvelocity_m_s = [0, 0, 1]\n",
            "depth: is missing, and the camera moves",
        ),
        (&format!("{GOOD}[motion]\ntrajectory = \"p.csv\"\n"), "motion.stamp_s: is missing"),
        (&format!("{GOOD}[motion]\nstamp_s = 3\n"), "motion.trajectory, which is missing"),
        (
            &format!("{GOOD}[motion]\nvelocity_m_s = [0, 0, 1]\ntrajectory = \"p.csv\"\nstamp_s = 3\n"),
            "give one of them",
        ),
        (&format!("{GOOD}[motion]\ntrajectory = \"c.png\"\nstamp_s = 3\n"), "c.png:1"),
        (
            &format!("{GOOD}[motion]\nvelocity_m_s = [0, 0, nan]\n"),
            "motion.velocity_m_s: must be three finite",
        ),
        (&format!("{GOOD}[fog]\nend_m = 0\ncolor = [0, 0, 0]\n"), "fog: needs end_m above 0"),
        ("color = ", "FRAME.toml:1: not valid TOML"),
    ] {
        let error = read(text).unwrap_err().to_string();
        assert!(error.contains(expected), "{text}\n  gives {error}\n  not   {expected}");
    }
    let (folder, path) = folder(&GOOD.replace("c.png", "big.png"));
    image::RgbImage::new(4, 2).save(folder.path().join("big.png")).unwrap();
    assert!(read_frame(&path).unwrap_err().to_string().contains("d.png: is 3x2, but the colour is 4x2"));
}

#[test]
fn marked_holes_are_the_pixels_without_depth() {
    let file = read(&format!("{GOOD}holes = \"mark\"\n")).unwrap();
    assert_eq!(file.frame.holes, [false, false, true, false, false, false]);
    assert!(read(GOOD).unwrap().frame.holes.is_empty() && (file.without_depth - 1.0 / 6.0).abs() < 1e-12);
    let nearest = read(&format!("{GOOD}holes = \"nearest\"\n")).unwrap();
    assert_eq!(
        nearest.frame.inverse_depth[2],
        (1.0_f64 / 65.535) as f32,
        "of 0.5 m and 65.535 m the farther"
    );
    // Without depth at all the camera only turns, and nothing is missing.
    assert!(read("color = \"c.png\"\nfocal_px = [2, 2]\nholes = \"mark\"\n").unwrap().frame.holes.is_empty());
}

#[test]
fn packed_depth_must_be_lossless() {
    let (folder, path) =
        folder("color = \"c.png\"\ndepth = \"p.jpg\"\ndepth_encoding = \"packed24\"\nfocal_px = [2, 2]\n");
    let packed = image::RgbImage::from_pixel(3, 2, image::Rgb([0, 2, 51]));
    packed.save(folder.path().join("p.jpg")).unwrap();
    let error = read_frame(&path).unwrap_err().to_string();
    assert!(error.contains("p.jpg: is not lossless"), "{error}");
    // The format is detected by content: a JPEG with the extension .png is refused too.
    fs::rename(folder.path().join("p.jpg"), folder.path().join("p.png")).unwrap();
    fs::write(&path, fs::read_to_string(&path).unwrap().replace("p.jpg", "p.png")).unwrap();
    assert!(read_frame(&path).unwrap_err().to_string().contains("is not lossless"));
    packed.save(folder.path().join("p.bmp")).unwrap();
    fs::write(&path, fs::read_to_string(&path).unwrap().replace("p.png", "p.bmp")).unwrap();
    assert!((f64::from(read_frame(&path).unwrap().frame.inverse_depth[0]) * 2.2 - 1.0).abs() < 1e-6);
}

/// A .flo file of 3x2 pixels: flow 1 right, and down by the number of the pixel; unknown for the last.
fn flo() -> Vec<u8> {
    let numbers = (0..6).flat_map(|k| if k == 5 { [1.6e9_f32, 1.6e9] } else { [1.0, k as f32] });
    let head = [202_021.25_f32.to_le_bytes(), 3_u32.to_le_bytes(), 2_u32.to_le_bytes()].concat();
    head.into_iter().chain(numbers.flat_map(f32::to_le_bytes)).collect()
}

fn small_flo() -> Vec<u8> {
    [202_021.25_f32.to_le_bytes(), 1_u32.to_le_bytes(), 2_u32.to_le_bytes(), [0; 4], [0; 4], [0; 4], [0; 4]]
        .concat()
}

fn read_with_flow(text: &str, flow: &[u8]) -> Result<FrameFile, FrameFileError> {
    let (folder, path) = folder(&format!("{GOOD}[motion]\n{text}\n"));
    fs::write(folder.path().join("f.flo"), flow).unwrap();
    let planes = |names: &[&str]| {
        use exr::prelude::*;
        let list = names.iter().enumerate().map(|(n, name)| {
            AnyChannel::new(*name, FlatSamples::F32((0..6).map(|k| (10 * n + k) as f32).collect()))
        });
        AnyChannels::sort(list.collect())
    };
    for (name, channels) in [
        ("two.exr", planes(&["X", "Y"])),
        ("four.exr", planes(&["Vector.X", "Vector.Y", "Vector.Z", "Vector.W"])),
    ] {
        exr::prelude::WritableImage::write(&exr::prelude::Image::from_channels((3, 2), channels))
            .to_file(folder.path().join(name))
            .unwrap();
    }
    read_frame(&path)
}

#[test]
fn flow_is_read_from_flo_and_exr() {
    let flow = |text: &str| match read_with_flow(text, &flo()).unwrap().motion {
        Motion::Flow(flow) => flow,
        other => panic!("{other:?}"),
    };
    let field = flow("flow = \"f.flo\"\nflow_interval_ms = 40");
    assert_eq!((field.size_px, field.interval_s), ([3, 2], 0.04));
    assert_eq!(field.px[..5], [[1.0, 0.0], [1.0, 1.0], [1.0, 2.0], [1.0, 3.0], [1.0, 4.0]]);
    assert!(field.px[5][0].is_nan() && field.px[5][1].is_nan());
    let field = flow("flow = \"two.exr\"\nflow_interval_ms = -40\nflow_scale = [2, -1]");
    assert_eq!((field.px[1], field.px[5], field.interval_s), ([2.0, -11.0], [10.0, -15.0], -0.04));
    let field = flow("flow = \"four.exr\"\nflow_channels = [\"Z\", \"Vector.W\"]\nflow_interval_ms = 40");
    assert_eq!(field.px[2], [22.0, 32.0]);
}

#[test]
fn unusable_flow_is_refused() {
    for (text, bytes, wanted) in [
        ("flow = \"f.flo\"", flo(), "motion.flow_interval_ms: is missing"),
        ("flow = \"f.flo\"\nflow_interval_ms = 0", flo(), "not 0"),
        ("flow = \"f.flo\"\nflow_interval_ms = nan", flo(), "must be a finite number"),
        (
            "flow = \"f.flo\"\nflow_interval_ms = 3\nflow_scale = [1e300, 1]",
            flo(),
            "f.flo: times motion.flow_scale",
        ),
        ("flow = \"f.flo\"\nflow_interval_ms = 3\nflow_channels = [\"X\", \"Y\"]", flo(), "is for EXR"),
        (
            "flow = \"f.flo\"\nflow_interval_ms = 3",
            small_flo(),
            "f.flo: is of 1x2 pixels, and the colour of 3x2",
        ),
        (
            "flow = \"two.exr\"\nflow_interval_ms = 3\nflow_channels = [\"X\", \"X\"]",
            flo(),
            "one channel X for both",
        ),
        (
            "flow = \"four.exr\"\nflow_interval_ms = 3\nflow_channels = [\"Vector.Z\", \"Z\"]",
            flo(),
            "one channel Vector.Z for both",
        ),
        ("flow_interval_ms = 3", flo(), "is for motion.flow, which is missing"),
        (
            "flow = \"f.flo\"\nflow_interval_ms = 3\nvelocity_m_s = [1, 0, 0]",
            flo(),
            "leave twist, trajectory and stamp_s out",
        ),
        ("flow = \"f.flo\"\nflow_interval_ms = 3\nflow_scale = [1, 0]", flo(), "motion.flow_scale"),
        ("flow = \"two.exr\"\nflow_interval_ms = 3\nflow_channels = [\"X\"]", flo(), "two names"),
        ("flow = \"no.flo\"\nflow_interval_ms = 3", flo(), "no.flo: cannot be read"),
        ("flow = \"c.png\"\nflow_interval_ms = 3", flo(), "c.png: is no Middlebury .flo file"),
        (
            "flow = \"f.flo\"\nflow_interval_ms = 3",
            flo()[..40].to_vec(),
            "f.flo: says 3x2 pixels and holds 7 numbers",
        ),
        (
            "flow = \"f.flo\"\nflow_interval_ms = 3",
            [&flo()[..12], &[0xff; 48]].concat(),
            "no pixel whose flow is known",
        ),
        (
            "flow = \"f.flo\"\nflow_interval_ms = 3",
            [&flo()[..4], &[0xff; 8]].concat(),
            "says 4294967295x4294967295 pixels and holds 0",
        ),
        ("flow = \"four.exr\"\nflow_interval_ms = 3", flo(), "motion.flow_channels which two"),
        (
            "flow = \"four.exr\"\nflow_interval_ms = 3\nflow_channels = [\"X\", \"Q\"]",
            flo(),
            "has no channel Q",
        ),
    ] {
        let error = read_with_flow(text, &bytes).unwrap_err().to_string();
        assert!(error.contains(wanted), "{text}: {error}");
    }
}
