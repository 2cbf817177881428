//! Encodings, malformed files, and files that are not calibrations.

use super::Expected::{Intrinsics, Note, Size};
use super::{check, import, read, refused};

const CHAIN: &str = "cam0:\n  camera_model: pinhole\n  distortion_model: radtan\n  distortion_coeffs: [0.1, \
                     0.2, 0.003, 0.004]\n  intrinsics: [400, 401, 320, 240]\n  resolution: [640, 480]\n";

#[test]
fn encodings_are_accepted() {
    let expectations = [Size([640, 480]), Intrinsics([400.0, 401.0, 320.0, 240.0])];
    check("CRLF", &read("c.yaml", &CHAIN.replace('\n', "\r\n")), &expectations);
    check("byte-order mark", &read("c.yaml", &format!("\u{feff}{CHAIN}")), &expectations);
    check(
        "byte-order mark, OpenCV",
        &read("c.yaml", &format!("\u{feff}%YAML:1.0\n---\n{CHAIN}")),
        &expectations,
    );
    check("comments", &read("c.yaml", &format!("# a\n\n{CHAIN}# z\n")), &expectations);
    check(
        "numbers as text",
        &read("c.yaml", &CHAIN.replace("[400, 401,", "[\"400\", '401.',")),
        &expectations,
    );
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("utf16.yaml");
    std::fs::write(&path, CHAIN.encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<u8>>()).unwrap();
    let error = camsim_io::formats::reading::import_camera(&path).unwrap_err().to_string();
    assert!(error.contains("utf16.yaml"), "{error}");
}

#[test]
fn malformed_kalibr_files_are_refused() {
    for (from, to, words) in [
        ("pinhole", "omni", ["cam0.intrinsics", "has 4 parameters where `omni` has 1 or 5"]),
        ("pinhole", "ds", ["cam0.distortion_model", "is `radtan` with `ds`"]),
        ("pinhole", "eucm", ["cam0.distortion_model", "is `radtan` with `eucm`"]),
        ("pinhole", "ocam", ["cam0.distortion_model", "is `radtan` with `ocam`"]),
        ("radtan", "fov", ["cam0.distortion_coeffs", "has 4 parameters"]),
        ("radtan", "none", ["cam0.distortion_coeffs", "states no distortion"]),
        ("distortion_model: radtan", "distortion_mode: radtan", ["cam0.distortion_coeffs", "is empty"]),
        ("  distortion_coeffs: [0.1, 0.2, 0.003, 0.004]\n", "", ["cam0.distortion_coeffs", "is missing"]),
        ("distortion_coeffs", "distortion_coefs", ["cam0.distortion_coeffs", "is missing"]),
        ("0.003, 0.004]", "0.003]", ["cam0.distortion_coeffs", "has 3 numbers"]),
        ("[400, 401, 320, 240]", "[0.9, 400, 401, 320, 240]", ["cam0.intrinsics", "has 5 numbers"]),
        ("[640, 480]", "[640, 480.5]", ["cam0.resolution", "positive integers"]),
        ("[400, 401, 320, 240]", "[400 401 320 240]", ["cam0.intrinsics", "not a list"]),
        ("[400, 401,", "[\"400,5\", 401,", ["cam0.intrinsics", "finite"]),
        ("[640, 480]\n", "[640, 480]\n  resolution: [752, 480]\n", ["c.yaml", "duplicate"]),
        (
            "[640, 480]\n",
            "[640, 480]\n  distortion_coefficients: [0, 0, 0, 0]\n",
            ["cam0.distortion_coefficients", "differs from"],
        ),
        ("[640, 480]\n", "[640, 480]\n  skew: 1.5\n", ["cam0.skew", "1.5"]),
        ("[640, 480]\n", "[640, 480]\n  xi: 0.9\n", ["cam0.xi", "MEI"]),
    ] {
        refused(to, "c.yaml", &CHAIN.replace(from, to), &words);
    }
    let imported = import(
        "c.yaml",
        &CHAIN.replace("[640, 480]\n", "[640, 480]\n  focal_mm: 8.8\n  pixel_pitch_um: 3.4\n"),
        None,
        None,
    )
    .unwrap();
    check("unknown", &imported, &[Note("cam0.focal_mm = 8.8, cam0.pixel_pitch_um = 3.4")]);
}

#[test]
fn malformed_ros_ini_files_are_refused() {
    let ini = "# oST version 5.0 parameters\n\n[image]\n\nwidth\n640\n\nheight\n480\n\n[cam]\n\ncamera \
               matrix\n400 0 320\n0 401 240\n0 0 1\n\ndistortion\n0.1 0.2 0.003 0.004 \
               0.5\n\nrectification\n1 0 0\n0 1 0\n0 0 1\n\nprojection\n400 0 320 0\n0 401 240 0\n0 0 1 0\n";
    check("good", &read("c.ini", ini), &[Size([640, 480]), Intrinsics([400.0, 401.0, 320.0, 240.0])]);
    for (from, to, words) in [
        ("0.1 0.2 0.003 0.004 0.5", "0.1 0.2 0.003 0.004", ["distortion", "cannot state a model"]),
        ("0.1 0.2 0.003 0.004 0.5", "0.1 0.2 0.003 0.004 0.5 0 0 0 0.1", ["distortion", "has 9 numbers"]),
        ("distortion\n0.1 0.2 0.003 0.004 0.5\n", "", ["distortion", "missing"]),
        ("0 0 1\n\ndistortion", "0 0\n\ndistortion", ["camera_matrix", "has 8 numbers"]),
        ("width\n640", "width\n640\n\nwidth\n752", ["c.ini", "duplicate"]),
        ("height\n480\n", "", ["height", "missing"]),
        ("400 0 320\n0 401", "400 0.5 320\n0 401", ["camera_matrix", "skew"]),
        ("[image]", "[image]\n12\n", ["c.ini:4", "follow a name"]),
    ] {
        refused(to, "c.ini", &ini.replacen(from, to, 1), &words);
    }
    let unknown = read("c.ini", &format!("{ini}\nbinning\n2\n\ngain\n3\n").replace("binning\n2\n\n", ""));
    check("unknown", &unknown, &[Note("cameras[0].gain = 3")]);
    refused("binning", "c.ini", &format!("{ini}\nbinning\n2\n"), &["binning", "2"]);
}

#[test]
fn other_files_are_refused_with_a_hint() {
    refused(
        "a CAMERA.toml",
        "CAMERA.toml",
        "size_px = [640, 480]\nfocal_px = [500.0, 500.0]\n",
        &["needs no import"],
    );
    refused(
        "a bad CAMERA.toml",
        "CAMERA.toml",
        "size_px = [640, 480]\nfocal = [500.0, 500.0]\n",
        &["CAMERA.toml:2", "focal_px"],
    );
    refused(
        "lensfun",
        "db.xml",
        "<lensdatabase><lens><model>x</model></lens></lensdatabase>",
        &["database of lenses"],
    );
    refused(
        "a distortion alone",
        "d.yaml",
        "distortion_model: plumb_bob\nD: [0, 0, 0, 0, 0]\n",
        &["no 3 x 3 camera matrix"],
    );
    refused(
        "nerfstudio, a camera for each picture",
        "transforms.json",
        r#"{"fl_x": 500, "cx": 320, "cy": 240, "w": 640, "h": 480, "frames": [{"fl_x": 1.0}]}"#,
        &["frames[0].fl_x", "a camera of its own"],
    );
    refused(
        "RealSense",
        "i.json",
        r#"{"width": 640, "height": 480, "ppx": 321, "ppy": 241, "fx": 600, "fy": 601}"#,
        &["[fx, 0, ppx"],
    );
    refused(
        "KITTI",
        "calib.txt",
        "P0: 7e2 0 6e2 0 0 7e2 2e2 0 0 0 1 0\nP1: 7e2 0 6e2 -3 0 7e2 2e2 0 0 0 1 0\n",
        &["rectified pictures"],
    );
    refused(
        "MATLAB",
        "m.yaml",
        "ImageSize: [480, 640]\nIntrinsicMatrix: [[400, 0, 0], [0, 401, 0], [320, 240, 1]]\n",
        &["transposed"],
    );
    refused("a list", "l.json", "[1, 2, 3]", &["not a known camera file", "COLMAP"]);
    refused("a number", "n.yaml", "12\n", &["not a known camera file"]);
    refused("nothing", "e.json", "", &["empty"]);
    refused("comments alone", "e.yaml", "# nothing\n", &["e.yaml"]);
    refused("cut off", "c.json", "{\"K\": [[1, 2", &["c.json:1", "JSON"]);
}
