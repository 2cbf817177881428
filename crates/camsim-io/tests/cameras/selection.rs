//! Selection by name in files with several cameras.

use super::Expected::{Intrinsics, Note, Without};
use super::{check, import, read, refused};

#[test]
fn named_camera_is_imported() {
    let colmap = "1 PINHOLE 640 480 500 500 320 240\n7 PINHOLE 640 480 600 600 320 240\n";
    let okvis = |f: &str| {
        format!(
            "    - {{image_dimension: [640, 480], distortion_coefficients: [], distortion_type: none, \
             focal_length: [{f}, {f}], principal_point: [319.5, 239.5]}}\n"
        )
    };
    let okvis = format!("cameras:\n{}{}", okvis("500"), okvis("600"));
    let rig = |label: &str, f: &str| {
        format!(
            "- camera:\n    label: {label}\n    image_height: 480\n    image_width: 640\n    type: \
             pinhole\n    intrinsics: {{rows: 4, cols: 1, data: [{f}, {f}, 319.5, 239.5]}}\n    distortion: \
             {{type: none, parameters: {{rows: 0, cols: 1, data: []}}}}\n"
        )
    };
    let rig = format!("cameras:\n{}{}", rig("left", "500"), rig("right", "600"));
    let basalt = |f: &str| {
        format!(
            r#"{{"camera_type": "pinhole", "intrinsics": {{"fx": {f}, "fy": {f}, "cx": 319.5,
                "cy": 239.5}}}}"#
        )
    };
    let basalt = format!(
        r#"{{"value0": {{"intrinsics": [{}, {}], "resolution": [[640, 480], [640, 480]]}}}}"#,
        basalt("500"),
        basalt("600")
    );
    let sensor = |id: &str, f: &str| {
        format!(
            "<sensor id=\"{id}\" label=\"camera {id}\" type=\"frame\"><calibration><resolution width=\"640\" \
             height=\"480\"/><f>{f}</f></calibration></sensor>"
        )
    };
    let metashape = format!(
        "<document><chunk><sensors>{}{}</sensors></chunk></document>",
        sensor("0", "500"),
        sensor("1", "600")
    );
    let matrix = |f: &str| format!("[{f}, 0, 319.5, 0, {f}, 239.5, 0, 0, 1]");
    let stereo = format!(
        "image_width: 640\nimage_height: 480\nM1: {}\nD1: [0, 0, 0, 0, 0]\nM2: {}\nD2: [0, 0, 0, 0, 0]\n",
        matrix("500"),
        matrix("600")
    );
    let orb =
        |name: &str, f: &str| format!("{name}.fx: {f}\n{name}.fy: {f}\n{name}.cx: 319.5\n{name}.cy: 239.5\n");
    let orb =
        format!("Camera.width: 640\nCamera.height: 480\n{}{}", orb("Camera1", "500"), orb("Camera2", "600"));
    let ini = |name: &str, f: &str| {
        format!("[{name}]\n\ncamera matrix\n{f} 0 319.5\n0 {f} 239.5\n0 0 1\n\ndistortion\n0 0 0 0 0\n\n")
    };
    let ini =
        format!("[image]\n\nwidth\n640\n\nheight\n480\n\n{}{}", ini("left", "500"), ini("right", "600"));
    let sfm = |name: &str, f: f64| {
        format!(
            r#""{name}": {{"projection_type": "perspective", "width": 640, "height": 480, "focal": {},
                "k1": 0, "k2": 0}}"#,
            f / 640.0
        )
    };
    let sfm = format!("{{{}, {}}}", sfm("v2 a 0.8", 500.0), sfm("v2 b 0.9", 600.0));
    for (file, text, first, second) in [
        ("cameras.txt", colmap, "1", "7"),
        ("okvis.yaml", &okvis, "cam0", "cam1"),
        ("rig.yaml", &rig, "left", "right"),
        ("rig.yaml", &rig, "cam0", "1"),
        ("basalt.json", &basalt, "cam0", "cam1"),
        ("cameras.xml", &metashape, "camera 0", "camera 1"),
        ("cameras.xml", &metashape, "0", "1"),
        ("stereo.yml", &stereo, "M1", "M2"),
        ("orb.yaml", &orb, "Camera1", "Camera2"),
        ("stereo.ini", &ini, "left", "right"),
        ("camera_models.json", &sfm, "v2 a 0.8", "v2 b 0.9"),
    ] {
        let error = import(file, text, None, None).unwrap_err();
        assert!(error.contains("there are 2") && error.contains("--camera"), "{file}: {error}");
        for (name, f) in [(first, 500.0), (second, 600.0)] {
            let imported = import(file, text, None, Some(name)).unwrap_or_else(|error| panic!("{error}"));
            check(
                &format!("{file} {name}"),
                &imported,
                &[Intrinsics([f, f, 319.5, 239.5]), Without("not applied")],
            );
        }
        let error = import(file, text, None, Some("nobody")).unwrap_err();
        assert!(error.contains("there is no `nobody`"), "{file}: {error}");
    }
}

#[test]
fn single_camera_needs_no_name() {
    let one = "cam3:\n  camera_model: pinhole\n  distortion_model: none\n  intrinsics: [400, 400, 320, \
               240]\n  resolution: [640, 480]\n";
    check("cam3", &read("chain.yaml", one), &[Intrinsics([400.0, 400.0, 320.0, 240.0])]);
    let nameless = "image_width: 640\nimage_height: 480\ncam_model: Pinhole\ncam_width: 640\ncam_height: \
                    480\ncam_fx: 400\ncam_fy: 400\ncam_cx: 320\ncam_cy: 240\n";
    check("vikit", &read("cam.yaml", nameless), &[Note("image_width = 640")]);
    let error = import("cam.yaml", nameless, None, Some("cam0")).unwrap_err();
    assert!(error.contains("omit `--camera`"), "{error}");
    refused("two of one name", "rig.yaml", "cameras: []\n", &["not a known camera file"]);
}
