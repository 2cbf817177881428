//! ROS: regions of interest, binning, rectification, and the output of `rostopic echo`.

use camsim_core::scenario::LensModel::{BrownConrady, KannalaBrandt, Pinhole};

use super::Expected::{Intrinsics, Lens, Note, Size, Without};
use super::{check, read, refused};

const FILE: &str = "image_width: 1280\nimage_height: 800\ncamera_name: c\ncamera_matrix: {rows: 3, cols: 3, \
                    data: [400, 0, 630, 0, 404, 376, 0, 0, 1]}\ndistortion_model: \
                    plumb_bob\ndistortion_coefficients: {rows: 1, cols: 5, data: [0.015, -0.043, -0.0012, \
                    -0.0015, 0.009]}\n";

fn with(more: &str) -> String {
    format!("{FILE}{more}\n")
}

#[test]
fn region_and_binning_change_size_and_matrix() {
    for (more, size, expected) in [
        (
            "roi: {x_offset: 0, y_offset: 0, width: 0, height: 0, do_rectify: false}",
            [1280, 800],
            [400.0, 404.0, 630.0, 376.0],
        ),
        (
            "roi: {x_offset: 320, y_offset: 200, width: 640, height: 400}",
            [640, 400],
            [400.0, 404.0, 310.0, 176.0],
        ),
        ("binning_x: 2\nbinning_y: 2", [640, 400], [200.0, 202.0, 315.0, 188.0]),
        (
            "binning_x: 4\nbinning_y: 4\nroi: {x_offset: 320, y_offset: 200, width: 640, height: 400}",
            [160, 100],
            [100.0, 101.0, 77.5, 44.0],
        ),
        ("binning_x: 2\nbinning_y: 1", [640, 800], [200.0, 404.0, 315.0, 376.0]),
        ("binning_x: 0\nbinning_y: 0", [1280, 800], [400.0, 404.0, 630.0, 376.0]),
    ] {
        check(more, &read("info.yaml", &with(more)), &[Size(size), Intrinsics(expected)]);
    }
    for (more, words) in [
        ("roi: {x_offset: 700, y_offset: 0, width: 640, height: 400}", ["roi", "not within"]),
        ("roi: {x_offset: -1, y_offset: 0, width: 640, height: 400}", ["roi", "not within"]),
        ("roi: {x_offset: 320, y_offset: 200, width: 0, height: 0}", ["roi", "no size"]),
        ("roi: {x_offset: 0, y_offset: 0, width: 640, height: 0}", ["roi", "not within"]),
        ("roi: {x_offset: 0.5, y_offset: 0, width: 640, height: 400}", ["roi", "not within"]),
        (
            "roi: {x_offset: left, y_offset: 0, width: 640, height: 400}",
            ["roi.x_offset", "not a finite number"],
        ),
        ("binning_x: 3\nbinning_y: 1", ["binning_x", "does not divide"]),
        ("binning_x: 1\nbinning_y: -2", ["binning_y", "does not divide"]),
        ("binning_x: 0.5\nbinning_y: 1", ["binning_x", "does not divide"]),
        (
            "roi: {x_offset: 0, y_offset: 0, width: 642, height: 400}\nbinning_x: 4\nbinning_y: 4",
            ["binning_x", "does not divide 642"],
        ),
    ] {
        refused(more, "info.yaml", &with(more), &words);
    }
}

#[test]
fn rectification_is_reported_unless_identity() {
    let identity = "rectification_matrix: {rows: 3, cols: 3, data: [1, 0, 0, 0, 1, 0, 0, 0, 1]}";
    let same = "projection_matrix: {rows: 3, cols: 4, data: [400, 0, 630, 0, 0, 404, 376, 0, 0, 0, 1, 0]}";
    check(
        "none",
        &read("info.yaml", &with(&format!("{identity}\n{same}"))),
        &[Without("rectif"), Without("projection_matrix")],
    );
    check(
        "turned",
        &read("info.yaml", &with(&identity.replace("[1, 0", "[0.999, 0.04"))),
        &[Note("rectification_matrix")],
    );
    check(
        "another matrix",
        &read("info.yaml", &with(&same.replace("[400", "[390"))),
        &[Note("projection_matrix"), Intrinsics([400.0, 404.0, 630.0, 376.0])],
    );
    check(
        "a baseline",
        &read("info.yaml", &with(&same.replace("630, 0", "630, -48"))),
        &[Note("projection_matrix")],
    );
    check(
        "do_rectify",
        &read(
            "info.yaml",
            &with("roi: {x_offset: 0, y_offset: 0, width: 1280, height: 800, do_rectify: true}"),
        ),
        &[Note("roi.do_rectify = true")],
    );
    refused(
        "cut off",
        "info.yaml",
        &with("projection_matrix: [400, 0, 630]"),
        &["projection_matrix", "3 x 4"],
    );
}

#[test]
fn ros_models_are_imported_or_refused() {
    let other = |from: &str, to: &str| FILE.replace(from, to);
    let four = "{rows: 1, cols: 4, data: [0.1, 0.2, 0.3, 0.4]}";
    let list = "{rows: 1, cols: 5, data: [0.015, -0.043, -0.0012, -0.0015, 0.009]}";
    check(
        "equidistant",
        &read("i.yaml", &other(list, four).replace("plumb_bob", "equidistant")),
        &[Lens(KannalaBrandt, &[0.1, 0.2, 0.3, 0.4])],
    );
    check(
        "fisheye",
        &read("i.yaml", &other(list, four).replace("plumb_bob", "fisheye")),
        &[Lens(KannalaBrandt, &[0.1, 0.2, 0.3, 0.4])],
    );
    check("no distortion", &read("i.yaml", &other(list, "[]")), &[Lens(Pinhole, &[])]);
    let eight = other(list, "[1, 2, 0.1, 0.2, 3, 4, 5, 6]");
    check(
        "rational",
        &read("i.yaml", &eight.replace("plumb_bob", "rational_polynomial")),
        &[Lens(BrownConrady, &[1.0, 2.0, 0.1, 0.2, 3.0, 4.0, 5.0, 6.0])],
    );
    for (text, words) in [
        (eight, ["distortion_coefficients", "five"]),
        (other("plumb_bob", "\"\""), ["distortion_coefficients", "is empty"]),
        (
            other("plumb_bob", "thin_prism"),
            ["distortion_coefficients", "has 5 parameters where `thinprism` has 12 or 14"],
        ),
        (other(list, "[0.1, 0.2, 0.3]"), ["distortion_coefficients", "has 3 numbers"]),
        (other("plumb_bob", "equidistant"), ["distortion_coefficients", "fisheye has four"]),
        (
            other("[400, 0, 630, 0, 404, 376, 0, 0, 1]", "[0, 0, 0, 0, 0, 0, 0, 0, 0]"),
            ["camera_matrix", "not calibrated"],
        ),
        (
            other("[400, 0, 630, 0, 404, 376, 0, 0, 1]", "[400, 0, 0, 0, 404, 0, 630, 376, 1]"),
            ["camera_matrix", "transposed"],
        ),
        (with("K: [500, 0, 630, 0, 404, 376, 0, 0, 1]"), ["K", "differs from camera_matrix"]),
        (with("width: 640"), ["width", "differs from image_width"]),
        (with("image_width: 640"), ["i.yaml", "duplicate"]),
        (
            other("distortion_coefficients", "distortion_coefficents"),
            ["distortion_coefficients", "is missing"],
        ),
        (with("k4: 0.1"), ["k4", "coefficient"]),
        (other("image_height: 800\n", ""), ["height", "missing"]),
    ] {
        refused(&text, "i.yaml", &text, &words);
    }
}

#[test]
fn echoed_messages_are_imported() {
    let one = "header: \n  seq: 1\n  stamp: {secs: 1, nsecs: 5}\n  frame_id: cam\nheight: 480\nwidth: \
               640\ndistortion_model: \"plumb_bob\"\nD: [0.1, 0.2, 0.003, 0.004, 0.0]\nK: [400.0, 0.0, \
               320.0, 0.0, 401.0, 240.0, 0.0, 0.0, 1.0]\nR: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, \
               1.0]\nP: [400.0, 0.0, 320.0, 0.0, 0.0, 401.0, 240.0, 0.0, 0.0, 0.0, 1.0, 0.0]\nbinning_x: \
               0\nbinning_y: 0\nroi: \n  x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n  do_rectify: \
               False\n---\n";
    let expectations = [
        Size([640, 480]),
        Intrinsics([400.0, 401.0, 320.0, 240.0]),
        Lens(BrownConrady, &[0.1, 0.2, 0.003, 0.004]),
        Without("not applied"),
    ];
    check("one", &read("echo.yaml", one), &expectations);
    check(
        "two alike",
        &read("echo.yaml", &format!("{one}{}", one.replace("seq: 1", "seq: 2"))),
        &expectations,
    );
    refused(
        "two that differ",
        "echo.yaml",
        &format!("{one}{}", one.replace("400.0", "390.0")),
        &["several different YAML documents", "keep one"],
    );
    let undistorted = one.replace("D: [0.1, 0.2, 0.003, 0.004, 0.0]", "D: []").replace("\"plumb_bob\"", "''");
    check("no distortion", &read("echo.yaml", &undistorted), &[Lens(Pinhole, &[])]);
}
