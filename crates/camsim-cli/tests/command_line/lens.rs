//! `camsim lens` and `camsim camera`.

use std::fs;

use super::{assets, camsim, text};

#[test]
fn distort_and_undistort_are_inverse() {
    let folder = tempfile::tempdir().unwrap();
    let (rays, pixels, back) =
        (folder.path().join("rays.csv"), folder.path().join("pixels.csv"), folder.path().join("back.csv"));
    let points = [[0.0, 0.0], [0.3, -0.2], [-0.55, 0.4], [1e-9, 0.1]];
    let rows: String = points.iter().map(|[u, v]| format!("{u},{v}\n")).collect();
    fs::write(&rays, format!("u,v\n{rows}")).unwrap();
    // The camera file alone and within a scenario.
    for camera in ["demo_camera.toml", "demo.toml"] {
        let camera = assets().join(camera);
        let (code, _, err) =
            camsim(["lens", text(&camera), "distort", "--points", text(&rays), "-o", text(&pixels)]);
        assert_eq!((code, err.as_str()), (0, ""));
        let (code, _, err) =
            camsim(["lens", text(&camera), "undistort", "--points", text(&pixels), "-o", text(&back)]);
        assert_eq!((code, err.as_str()), (0, ""));
        let answer = fs::read_to_string(&back).unwrap();
        let mut lines = answer.lines();
        assert_eq!(lines.next(), Some("u,v,valid"));
        for ([u, v], line) in points.iter().zip(lines) {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().unwrap()).collect();
            // Newton's method stops at 1e-13 of the ideal plane or better; the text keeps every bit.
            assert!(
                (cells[0] - u).abs() < 1e-11 && (cells[1] - v).abs() < 1e-11 && cells[2] == 1.0,
                "{line}"
            );
        }
    }
}

#[test]
fn pixels_without_a_ray_are_invalid_and_points_beyond_the_fold_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    let camera = folder.path().join("folds.toml");
    // d_r = 1 - 0.4 r^2 has its maximum at r = sqrt(1 / 1.2) = 0.913, where the image radius is 0.609.
    let lens = "[lens]\nmodel = \"brown-conrady\"\ncoefficients = [-0.4]\n";
    fs::write(&camera, format!("size_px = [640, 480]\nfocal_px = [400.0, 400.0]\n{lens}")).unwrap();
    let points = folder.path().join("points.csv");
    fs::write(&points, "x_px,y_px\n0,0\n319.5,239.5\n").unwrap();
    let (code, out, _) = camsim(["lens", text(&camera), "undistort", "--points", text(&points)]);
    assert_eq!((code, out.as_str()), (0, "u,v,valid\nNaN,NaN,0\n0.0,0.0,1\n"));
    fs::write(&points, "u,v\n1.5,0\nNaN,0\n0.1,0\n").unwrap();
    let (code, out, err) = camsim(["lens", text(&camera), "distort", "--points", text(&points)]);
    assert!(code == 0 && out.starts_with("x_px,y_px\n") && out.contains("\nNaN,NaN\n"), "{out}");
    assert!(
        err.contains("1 of 3 points lie beyond") && err.contains("1 of 3 points are not finite"),
        "{err}"
    );
    assert_eq!(camsim(["-q", "lens", text(&camera), "distort", "--points", text(&points)]).2, "");

    let (code, out, _) = camsim(["lens", text(&camera), "check", "--json"]);
    let check: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(code, 0);
    assert!((check["fold_radius_min"].as_f64().unwrap() - (1.0f64 / 1.2).sqrt()).abs() < 1e-6, "{check}");
    assert!(
        check["valid_fraction"].as_f64().unwrap() < 1.0
            && check["bijective"] == true
            && check["worst_roundtrip_px"].is_f64()
    );
}

#[test]
fn calibrations_of_other_programs_are_imported() {
    let folder = tempfile::tempdir().unwrap();
    let (kalibr, camera) = (folder.path().join("camchain.yaml"), folder.path().join("CAMERA.toml"));
    let chain = "cam0:\n  camera_model: pinhole\n  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00002]\n  \
                 distortion_model: radtan\n  intrinsics: [458.6, 457.3, 367.2, 248.4]\n  resolution: [752, \
                 480]\n";
    fs::write(&kalibr, chain).unwrap();
    let (code, _, err) = camsim(["camera", "import", text(&kalibr), "-o", text(&camera)]);
    assert!(code == 0 && err.contains("kalibr"), "{err}");
    let (code, out, err) = camsim(["lens", text(&camera), "check"]);
    assert!(code == 0 && out.contains("100.000 %"), "{out}{err}");
    let (code, out, _) = camsim(["camera", "import", text(&kalibr), "-q"]);
    assert_eq!((code, out), (0, fs::read_to_string(&camera).unwrap()));
}
