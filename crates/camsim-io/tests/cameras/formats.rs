//! Formats without published files in the data folder: small files by their public definitions.

use camsim_core::scenario::LensModel::{BrownConrady, KannalaBrandt, Pinhole};
use camsim_core::scenario::Readout;
use camsim_io::formats::reading::CameraFormat;

use super::Expected::{Fps, Intrinsics, Lens, Note, Readout as Ms, Size, Without};
use super::{check, import, read, refused};

/// COLMAP has pixel centres at half-integers.
#[test]
fn colmap_models_are_imported_with_a_shift_of_half_a_pixel() {
    for (params, expected, lens) in [
        ("SIMPLE_PINHOLE 640 480 500 320 240", [500.0, 500.0, 319.5, 239.5], Lens(Pinhole, &[])),
        ("PINHOLE 640 480 500 510 320 240", [500.0, 510.0, 319.5, 239.5], Lens(Pinhole, &[])),
        ("SIMPLE_RADIAL 640 480 500 320 240 -0.1", [500.0, 500.0, 319.5, 239.5], Lens(BrownConrady, &[-0.1])),
        (
            "RADIAL 640 480 500 320 240 -0.1 0.02",
            [500.0, 500.0, 319.5, 239.5],
            Lens(BrownConrady, &[-0.1, 0.02]),
        ),
        (
            "OPENCV 640 480 500 510 321 241 -0.1 0.02 1e-3 -2e-3",
            [500.0, 510.0, 320.5, 240.5],
            Lens(BrownConrady, &[-0.1, 0.02, 1e-3, -2e-3]),
        ),
        (
            "FULL_OPENCV 640 480 500 510 321 241 0.1 0.2 0.001 0.002 0.3 0.4 0.5 0.6",
            [500.0, 510.0, 320.5, 240.5],
            Lens(BrownConrady, &[0.1, 0.2, 0.001, 0.002, 0.3, 0.4, 0.5, 0.6]),
        ),
        (
            "OPENCV_FISHEYE 640 480 300 310 321 241 0.1 0.02 0.003 0.004",
            [300.0, 310.0, 320.5, 240.5],
            Lens(KannalaBrandt, &[0.1, 0.02, 0.003, 0.004]),
        ),
        (
            "SIMPLE_RADIAL_FISHEYE 640 480 300 321 241 0.1",
            [300.0, 300.0, 320.5, 240.5],
            Lens(KannalaBrandt, &[0.1]),
        ),
        (
            "RADIAL_FISHEYE 640 480 300 321 241 0.1 0.2",
            [300.0, 300.0, 320.5, 240.5],
            Lens(KannalaBrandt, &[0.1, 0.2]),
        ),
    ] {
        let imported = read(
            "cameras.txt",
            &format!("# Camera list with one line of data per camera:\n# Number of cameras: 1\n1 {params}\n"),
        );
        assert_eq!(imported.format, CameraFormat::Colmap);
        check(params, &imported, &[Size([640, 480]), Intrinsics(expected), lens, Note("half a pixel")]);
    }
    for (params, words) in [
        ("FOV 640 480 500 500 320 240", ["PARAMS", "has 4 parameters where FOV has 5"]),
        ("THIN_PRISM_FISHEYE 640 480 500 500 320 240 0 0 0 0 0 0 0 0", ["MODEL", "OPENCV_FISHEYE"]),
        ("OPENCV 640 480 500 500 320 240 -0.1 0.02 1e-3", ["PARAMS", "has 7 parameters where OPENCV has 8"]),
        ("PINHOLE 640.5 480 500 500 320 240", ["WIDTH", "positive integers"]),
    ] {
        refused(params, "cameras.txt", &format!("1 {params}\n"), &words);
    }
    refused("binary", "cameras.bin", "\u{1}\u{0}", &["colmap model_converter --output_type TXT"]);
    refused(
        "a broken line",
        "cameras.txt",
        "1 PINHOLE 640 480 500 500 320 240\n2 PINHOLE 640\n",
        &["cameras.txt:2", "is not a camera"],
    );
}

const ORB3: &str = "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"KannalaBrandt8\"\nCamera1.fx: \
                    190.978477\nCamera1.fy: 190.973307\nCamera1.cx: 254.931706\nCamera1.cy: \
                    256.897442\nCamera1.k1: 0.00348238\nCamera1.k2: 0.00071503\nCamera1.k3: \
                    -0.0020532\nCamera1.k4: 0.00020293\nCamera.width: 512\nCamera.height: \
                    512\nCamera.newWidth: 256\nCamera.fps: 20\nCamera.RGB: 1\nIMU.NoiseGyro: \
                    0.00016\nViewer.PointSize:2\n";

#[test]
fn orb_slam_settings_are_imported() {
    let imported = read("tum_vi.yaml", ORB3);
    assert_eq!(imported.format, CameraFormat::OrbSlam);
    let lens = Lens(KannalaBrandt, &[0.00348238, 0.00071503, -0.0020532, 0.00020293]);
    let expectations = [
        Size([512, 512]),
        Intrinsics([190.978477, 190.973307, 254.931706, 256.897442]),
        lens,
        Fps(20.0),
        Note("Camera.newWidth = 256"),
        Without("IMU"),
    ];
    check("ORB-SLAM3", &imported, &expectations);
    let two = "%YAML:1.0\n---\nCamera.fx: 500\nCamera.fy: 501\nCamera.cx: 320\nCamera.cy: 240\nCamera.k1: \
               0.1\nCamera.k2: 0.2\nCamera.p1: 0.001\nCamera.p2: 0.002\nCamera.k3: 0.3\nCamera.width: \
               640\nCamera.height: 480\nCamera.bf: 40.0\nDepthMapFactor: 5000.0\n";
    check(
        "ORB-SLAM2",
        &read("tum1.yaml", two),
        &[
            Lens(BrownConrady, &[0.1, 0.2, 0.001, 0.002, 0.3]),
            Note("Camera.bf = 40"),
            Without("DepthMapFactor"),
        ],
    );
    refused("another model", "orb.yaml", &ORB3.replace("KannalaBrandt8", "Omni"), &["Camera.type", "`Omni`"]);
    refused("no size", "orb.yaml", &ORB3.replace("Camera.width: 512\n", ""), &["add `Camera.width`"]);
    refused(
        "a fisheye's k4 in a pinhole",
        "orb.yaml",
        &ORB3.replace("KannalaBrandt8", "PinHole"),
        &["Camera1.k4"],
    );
    refused(
        "missing k3",
        "orb.yaml",
        &ORB3.replace("Camera1.k3: -0.0020532\n", ""),
        &["Camera1.k3: is missing"],
    );
    refused(
        "tangential fisheye",
        "orb.yaml",
        &ORB3.replace("Camera.RGB: 1", "Camera1.p1: 0.1"),
        &["Camera1.p1"],
    );
}

fn basalt(kind: &str, numbers: &str) -> String {
    format!(
        r#"{{"value0": {{"T_imu_cam": [{{"px": 0.1, "py": 0, "pz": 0, "qx": 0, "qy": 0, "qz": 0, "qw": 1}}],
        "intrinsics": [{{"camera_type": "{kind}", "intrinsics": {{"fx": 300, "fy": 301, "cx": 255, "cy": 256,
            {numbers}}}}}],
        "resolution": [[512, 514]], "imu_update_rate": 200.0, "cam_time_offset_ns": 5000000,
            "vignette": [{{"value0": 0, "value1": 10}}]}}}}"#
    )
}

#[test]
fn basalt_models_are_imported_or_refused() {
    let notes = || {
        [
            Note("value0.vignette"),
            Note("cam_time_offset_ns"),
            Note("value0.T_imu_cam"),
            Without("imu_update_rate"),
        ]
    };
    let kb4 = read("calibration.json", &basalt("kb4", r#""k1": 0.1, "k2": 0.2, "k3": 0.3, "k4": 0.4"#));
    assert_eq!(kb4.format, CameraFormat::Basalt);
    check(
        "kb4",
        &kb4,
        &[
            Size([512, 514]),
            Intrinsics([300.0, 301.0, 255.0, 256.0]),
            Lens(KannalaBrandt, &[0.1, 0.2, 0.3, 0.4]),
        ],
    );
    check("kb4", &kb4, &notes());
    let radtan = r#""k1": 0.1, "k2": 0.2, "p1": 0.01, "p2": 0.02, "k3": 0.3, "k4": 0.4, "k5": 0.5, "k6": 0.6,
        "rpmax": 2.7"#;
    let expectations = [Lens(BrownConrady, &[0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6]), Note("rpmax = 2.7")];
    check("radtan8", &read("calibration.json", &basalt("pinhole-radtan8", radtan)), &expectations);
    for (kind, numbers, words) in [
        ("ds", r#""xi": -0.2, "alpha": 0.5, "beta": 1.1"#, ["beta", "no such parameter"]),
        ("eucm", r#""alpha": 0.5"#, ["beta", "is missing"]),
        ("ds", r#""xi": -0.2, "alpha": 0.5, "k1": 0.1"#, ["k1", "no such parameter"]),
        ("fov", r#""w": 0.5"#, ["camera_type", "is `fov`"]),
        ("kb4", r#""k1": 0.1, "k2": 0.2, "k3": 0.3"#, ["k4", "is missing"]),
        ("pinhole", r#""k1": 0.1"#, ["k1", "no such parameter"]),
        ("kb4", r#""k1": 0.1, "k2": 0.2, "k3": 0.3, "k4": 0.4, "p1": 0.01"#, ["p1", "no such parameter"]),
        ("kb4", r#""k1": 0.1, "k2": 0.2, "k3": 0.3, "k4": 0.4, "fx": 150"#, ["fx", "duplicate"]),
    ] {
        refused(kind, "calibration.json", &basalt(kind, numbers), &words);
    }
}

#[test]
fn okvis_models_are_imported_or_refused() {
    let text = |kind: &str, list: &str| {
        format!(
            "%YAML:1.0\ncameras:\n    - {{T_SC: [1, 0, 0, 0.1, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], \
             image_dimension: [640, 480], distortion_coefficients: [{list}],\n       distortion_type: \
             {kind}, focal_length: [400, 401], principal_point: [320, 240]}}\ncamera_params:\n    \
             camera_rate: 20\nimageDelay: 0.01\n"
        )
    };
    let expectations = [
        Intrinsics([400.0, 401.0, 320.0, 240.0]),
        Fps(20.0),
        Note("imageDelay = 0.01"),
        Note("T_SC"),
        Note("no shutter times"),
        Without("no frame rate"),
    ];
    check(
        "radialtangential",
        &read("config.yaml", &text("radialtangential", "0.1, 0.2, 0.003, 0.004")),
        &expectations,
    );
    check(
        "equidistant",
        &read("config.yaml", &text("equidistant", "0.1, 0.2, 0.3, 0.4")),
        &[Lens(KannalaBrandt, &[0.1, 0.2, 0.3, 0.4])],
    );
    check(
        "8",
        &read("config.yaml", &text("radialtangential8", "1, 2, 3, 4, 5, 6, 7, 8")),
        &[Lens(BrownConrady, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0])],
    );
    refused("unknown", "config.yaml", &text("ocam", "0.9"), &["distortion_type", "OCamCalib"]);
    refused("short", "config.yaml", &text("radialtangential", "0.1, 0.2, 0.003"), &["has 3 numbers"]);
    refused(
        "none with numbers",
        "config.yaml",
        &text("none", "0.1, 0.2, 0.003, 0.004"),
        &["distortion_coefficients", "states no distortion"],
    );
}

#[test]
fn maplab_rigs_are_imported() {
    let text = |delay: &str, kind: &str, distortion: &str| {
        format!(
            "label: rig\ncameras:\n- camera:\n    label: left\n    line-delay-nanoseconds: {delay}\n    \
             image_height: 480\n    image_width: 640\n    type: {kind}\n    intrinsics: {{cols: 1, rows: 4, \
             data: [300, 301, 320, 240]}}\n    distortion: {{type: {distortion}, parameters: {{cols: 1, \
             rows: 4, data: [0.1, 0.2, 0.3, 0.4]}}}}\n  T_B_C: {{cols: 2, rows: 2, data: [1, 0, 0, 1]}}\n"
        )
    };
    let expectations = [
        Ms(24.0),
        Lens(KannalaBrandt, &[0.1, 0.2, 0.3, 0.4]),
        Note("x 480 rows is a readout of 24"),
        Without("T_B_C"),
    ];
    check("rolling", &read("rig.yaml", &text("50000", "pinhole", "equidistant")), &expectations);
    check(
        "by label",
        &import("rig.yaml", &text("0", "pinhole", "radial-tangential"), None, Some("left")).unwrap(),
        &[Ms(0.0), Without("no shutter times")],
    );
    refused(
        "fov",
        "rig.yaml",
        &text("0", "pinhole", "fisheye"),
        &["camera.distortion.parameters", "has 4 parameters where `fov` has 1"],
    );
    refused("omni", "rig.yaml", &text("0", "omni", "none"), &["camera.type", "OCamCalib"]);
}

#[test]
fn vikit_files_are_imported() {
    let text = "cam_model: Pinhole\ncam_width: 640\ncam_height: 480\nscale: 0.5\ncam_fx: 400\ncam_fy: \
                401\ncam_cx: 320\ncam_cy: 240\ncam_d0: 0.1\ncam_d1: 0.2\ncam_d2: 0.001\ncam_d3: 0.002\n";
    check(
        "pinhole",
        &read("cam.yaml", text),
        &[
            Size([640, 480]),
            Intrinsics([400.0, 401.0, 320.0, 240.0]),
            Lens(BrownConrady, &[0.1, 0.2, 0.001, 0.002]),
            Note("scale = 0.5"),
        ],
    );
    refused(
        "fisheye's numbers",
        "cam.yaml",
        &text.replace("Pinhole", "EquidistantCamera"),
        &["cam_d0", "does not use it"],
    );
    refused("atan", "cam.yaml", &text.replace("Pinhole", "ATAN"), &["cam_model", "`ATAN`"]);
}

#[test]
fn opensfm_projections_are_imported_or_refused() {
    // In portrait format the longer side is the height.
    let text = r#"{"v2 phone 3000 4000 brown 0.85": {"projection_type": "brown",
        "width": 3000, "height": 4000, "focal_x": 0.8, "focal_y": 0.81, "c_x": 0.01, "c_y": -0.02,
        "k1": -0.1, "k2": 0.02, "p1": 0.001, "p2": 0.002, "k3": 0.003}}"#;
    let expectations = [
        Size([3000, 4000]),
        Intrinsics([3200.0, 3240.0, 1499.5 + 40.0, 1999.5 - 80.0]),
        Lens(BrownConrady, &[-0.1, 0.02, 0.001, 0.002, 0.003]),
    ];
    check("brown", &read("camera_models.json", text), &expectations);
    let reconstruction =
        format!(r#"[{{"cameras": {text}, "shots": {{"a.jpg": {{"gps_dop": 15.0}}}}, "points": {{}}}}]"#);
    check("reconstruction", &read("reconstruction.json", &reconstruction), &expectations);
    let fisheye = text
        .replace("\"brown\"", "\"fisheye_opencv\"")
        .replace(r#""p1": 0.001, "p2": 0.002, "k3": 0.003"#, r#""k3": 0.003, "k4": 0.004"#);
    check(
        "fisheye",
        &read("camera_models.json", &fisheye),
        &[Lens(KannalaBrandt, &[-0.1, 0.02, 0.003, 0.004])],
    );
    for (from, to, words) in [
        ("\"brown\"", "\"spherical\"", ["projection_type", "panorama"]),
        ("\"brown\"", "\"fisheye624\"", ["projection_type", "fisheye624"]),
        ("\"brown\"", "\"perspective\"", ["k3", "`perspective` has only k1, k2"]),
        ("\"width\": 3000, ", "", ["width", "longer side"]),
        ("\"focal_y\": 0.81", "\"focal\": 0.9", ["focal", "differs from focal_x"]),
    ] {
        refused(to, "camera_models.json", &text.replace(from, to), &words);
    }
}

const GYROFLOW: &str = r#"{"calib_dimension": {"w": 2704, "h": 2028}, "orig_dimension": {"w": 2704,
    "h": 2028}, "frame_readout_time": -11.5, "fps": 29.97, "asymmetrical": true,
    "fisheye_params": {"camera_matrix": [[1340.0, 0.0, 1353.5], [0.0, 1345.0, 1022.9], [0.0, 0.0, 1.0]],
        "distortion_coeffs": [0.041, 0.027, -0.015, 0.002]}}"#;

#[test]
fn gyroflow_profiles_are_imported_or_refused() {
    let imported = read("p.json", GYROFLOW);
    check(
        "asymmetrical",
        &imported,
        &[Intrinsics([1340.0, 1345.0, 1353.5, 1022.9]), Ms(11.5), Note("negative"), Without("no shutter")],
    );
    assert_eq!(imported.spec.shutter.readout, Readout::BottomToTop);
    let other = |from: &str, to: &str| GYROFLOW.replace(from, to);
    check(
        "symmetrical",
        &read("p.json", &other(r#""asymmetrical": true,"#, "")),
        &[Intrinsics([1340.0, 1345.0, 1352.0, 1014.0]), Note("1353.5")],
    );
    check(
        "crop",
        &read("p.json", &other("\"fps\"", r#""crop": 2.0, "fps""#)),
        &[Intrinsics([670.0, 672.5, 1353.5, 1022.9]), Note("crop = 2")],
    );
    check(
        "global",
        &read("p.json", &other("\"fps\"", r#""global_shutter": true, "fps""#)),
        &[Ms(0.0), Note("11.5 ms")],
    );
    check(
        "original",
        &read("p.json", &other(r#""orig_dimension": {"w": 2704"#, r#""orig_dimension": {"w": 5408"#)),
        &[Size([2704, 2028]), Note("orig_dimension is [5408")],
    );
    let sideways = read("p.json", &other("\"fps\"", r#""frame_readout_direction": "LeftToRight", "fps""#));
    assert_eq!(sideways.spec.shutter.readout, Readout::RightToLeft);
    for (from, to, words) in [
        ("\"fps\"", r#""digital_lens": "gopro_superview", "fps""#, ["digital_lens", "gopro_superview"]),
        ("\"fps\"", r#""input_horizontal_stretch": 1.33, "fps""#, ["input_horizontal_stretch", "1.33"]),
        ("\"fps\"", r#""distortion_model": "poly5", "fps""#, ["distortion_model", "poly5"]),
        ("\"fps\"", r#""distortion_model_id": 2, "fps""#, ["distortion_model_id", "OpenCV's fisheye"]),
        (
            "\"fps\"",
            r#""frame_readout_direction": "Diagonal", "fps""#,
            ["frame_readout_direction", "not a direction"],
        ),
        (
            "\"fps\"",
            r#""use_opencv_fisheye": false, "fps""#,
            ["use_opencv_fisheye", "set one of them to true"],
        ),
        (", 0.002]", "]", ["distortion_coeffs", "has 3 numbers"]),
        ("-11.5", "11500", ["frame_readout_time", "check its unit"]),
        ("-11.5", "\"11,5\"", ["frame_readout_time", "not a finite number"]),
        ("[1340.0, 0.0,", "[1340.0, 2.0,", ["camera_matrix", "skew of 2"]),
    ] {
        refused(to, "p.json", &other(from, to), &words);
    }
}

#[test]
fn metashape_calibrations_and_projects_are_imported() {
    let text = "<calibration><projection>frame</projection><width>2000</width><height>1000</height>\
        <f>1500</f><cx>10</cx><cy>-20</cy><b1>3</b1><k1>0.1</k1><p1>0.001</p1><p2>0.002</p2></calibration>";
    check(
        "b1",
        &read("m.xml", text),
        &[Intrinsics([1503.0, 1500.0, 1009.5, 479.5]), Lens(BrownConrady, &[0.1, 0.0, 0.002, 0.001])],
    );
    let other = |to: &str| text.replace("<k1>", &format!("{to}<k1>"));
    for (to, words) in [
        ("<b2>0.5</b2>", ["b2", "skew"]),
        ("<p3>0.5</p3>", ["p3", "tangential"]),
        ("<k4>0.5</k4>", ["k4", "r^8"]),
        ("<k5>0.5</k5>", ["k5", "coefficient"]),
        ("<f>1400</f>", ["f", "not a finite number"]),
    ] {
        refused(to, "m.xml", &other(to), &words);
    }
    refused("spherical", "m.xml", &text.replace(">frame<", ">spherical<"), &["projection", "`spherical`"]);
    let project = |sensor: &str| {
        format!(
            "<document version=\"1.5.0\"><chunk><sensors>{sensor}</sensors><cameras><camera \
             id=\"0\"/></cameras></chunk></document>"
        )
    };
    let sensor = |label: &str, body: &str| {
        format!(
            "<sensor id=\"3\" label=\"{label}\" type=\"fisheye\"><resolution width=\"2000\" \
             height=\"1000\"/>{body}</sensor>"
        )
    };
    let both = "<calibration type=\"fisheye\" \
                class=\"adjusted\"><f>600</f><k1>0.1</k1></calibration><calibration type=\"fisheye\" \
                class=\"initial\"><f>500</f></calibration><rolling_shutter>1</rolling_shutter>";
    let imported = read("cameras.xml", &project(&sensor("DJI 8.8 mm", both)));
    check(
        "adjusted",
        &imported,
        &[
            Size([2000, 1000]),
            Intrinsics([600.0, 600.0, 999.5, 499.5]),
            Lens(KannalaBrandt, &[0.1]),
            Note("rolling_shutter = 1"),
            Without("no shutter times"),
        ],
    );
    refused("not aligned", "cameras.xml", &project(&sensor("DJI", "")), &["calibration", "align"]);
    refused("no sensors", "cameras.xml", &project(""), &["chunk.sensors"]);
}

#[test]
fn camodocal_full_model_is_imported() {
    let text = "model_type: PINHOLE_FULL\nimage_width: 640\nimage_height: 480\ndistortion_parameters:\n   \
                k1: 0.1\n   k2: 0.2\n   k3: 0.3\n   k4: 0.4\n   k5: 0.5\n   k6: 0.6\n   p1: 0.01\n   p2: \
                0.02\nprojection_parameters:\n   fx: 400\n   fy: 400\n   cx: 320\n   cy: 240\n";
    check(
        "full",
        &read("cam.yaml", text),
        &[Lens(BrownConrady, &[0.1, 0.2, 0.01, 0.02, 0.3, 0.4, 0.5, 0.6])],
    );
    refused(
        "k3 of a PINHOLE",
        "cam.yaml",
        &text.replace("_FULL", ""),
        &["distortion_parameters.k3", "PINHOLE_FULL"],
    );
    refused(
        "scaramuzza",
        "cam.yaml",
        &text.replace("PINHOLE_FULL", "SCARAMUZZA"),
        &["model_type", "OCamCalib"],
    );
    let main = "%YAML:1.0\nimu: 1\nnum_of_cam: 2\ncam0_calib: \"cam0_mei.yaml\"\ncam1_calib: \
                \"cam1_mei.yaml\"\nimage_width: 752\n";
    refused("the main file", "euroc.yaml", main, &["import one of those (cam0_mei.yaml, cam1_mei.yaml)"]);
}
