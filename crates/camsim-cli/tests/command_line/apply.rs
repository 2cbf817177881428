//! `camsim apply`.

use std::fs;

use super::{assets, camsim, text};

#[test]
fn apply_renders_a_single_image() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    fs::copy(assets().join("acircles.png"), file("ideal.png")).unwrap();
    let (camera, frame, out) = (file("CAMERA.toml"), file("FRAME.toml"), file("out.png"));
    fs::write(&camera, "size_px = [64, 48]\nfocal_px = [60.0, 60.0]\n[shutter]\nreadout_ms = 33.0\n")
        .unwrap();
    let turning =
        "color = \"ideal.png\"\nfocal_px = [300.0, 300.0]\n[motion]\nangular_rate_rad_s = [0.0, 0.0, 1.0]\n";
    fs::write(&frame, turning).unwrap();
    for solver in ["linear", "rk2", "reproject"] {
        let (code, answer, err) =
            camsim(["apply", text(&camera), text(&frame), "--solver", solver, "-o", text(&out)]);
        assert_eq!((code, answer.as_str()), (0, ""), "{err}");
        assert!(err.contains("64x48"), "{err}");
    }
    // The paper's two models differ slightly for a rotation of half a degree.
    let other = file("linear.png");
    assert_eq!(
        camsim(["-q", "apply", text(&camera), text(&frame), "--solver", "linear", "-o", text(&other)]).0,
        0
    );
    let (_, report, _) = camsim(["compare", text(&out), text(&other), "--json"]);
    let report: serde_json::Value = serde_json::from_str(&report).unwrap();
    assert!(report["rmse"].as_f64().unwrap() < 0.02, "{report}");
    assert_eq!(
        camsim([
            "-q",
            "apply",
            text(&camera),
            text(&frame),
            "--preset",
            "paper",
            "-o",
            text(&file("out.exr"))
        ])
        .0,
        0
    );
    assert!(file("out.exr").is_file());

    for (solver, expected) in [("reproject", 2), ("linear", 2), ("rk2", 0)] {
        let (code, _, err) = camsim([
            "apply",
            text(&camera),
            text(&frame),
            "--preset",
            "paper",
            "--solver",
            solver,
            "-o",
            text(&out),
        ]);
        assert!(
            code == expected && err.contains("--solver is rk2 with --preset paper") == (code == 2),
            "{solver}: {err}"
        );
    }

    // An image of sky only is valid, with a warning that velocity has no effect.
    let png = fs::read(file("ideal.png")).unwrap();
    // Width and height are in the first chunk of a PNG.
    let [width, height] = [16, 20].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().unwrap()));
    let sky: Vec<u8> = format!("P5\n{width} {height}\n65535\n")
        .bytes()
        .chain(vec![0; 2 * (width * height) as usize])
        .collect();
    fs::write(file("sky.pgm"), sky).unwrap();
    let depth = "depth = \"sky.pgm\"\ndepth_per_metre = 1000\n[motion]";
    fs::write(&frame, turning.replace("[motion]", depth).replace("angular_rate_rad_s", "velocity_m_s"))
        .unwrap();
    let (code, _, err) = camsim(["apply", text(&camera), text(&frame), "-o", text(&out)]);
    assert!(code == 0 && err.contains("FRAME.toml: no pixel has a depth"), "{err}");
    fs::write(file("poses.csv"), "t_s,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,1,0,0,1,0,0,0\n").unwrap();

    for (change, wanted) in [
        (turning.replace("color =", "colour ="), "did you mean `color`?"),
        (turning.replace("angular_rate_rad_s", "velocity_m_s"), "depth: is missing"),
        (turning.replace("ideal.png", "none.png"), "none.png: cannot be read"),
        (
            format!("{turning}[fog]\nend_m = 10.0\ncolor = [0.0, 0.0, 0.0]\n"),
            "FRAME.toml: linear fog after the blur belongs",
        ),
        (
            turning
                .replace("angular_rate_rad_s = [0.0, 0.0, 1.0]", "trajectory = \"poses.csv\"\nstamp_s = 9.0")
                .replace("[motion]", depth),
            "FRAME.toml: the trajectory covers",
        ),
    ] {
        fs::write(&frame, change).unwrap();
        let (code, _, err) = camsim(["apply", text(&camera), text(&frame), "-o", text(&out)]);
        assert!(code == 2 && err.contains(wanted), "{err}");
    }
    let (code, _, err) = camsim(["apply", text(&camera), text(&frame), "-o", "picture.jpg"]);
    assert!(code == 2 && err.contains(".exr or .png"), "{err}");
    fs::write(&camera, "[camera]\nsize_px = [64, 48]\n").unwrap();
    let (code, _, err) = camsim(["apply", text(&camera), text(&frame), "-o", text(&out)]);
    assert!(
        code == 2
            && err.contains("CAMERA.toml:1: camera: a CAMERA.toml has the keys of [camera] at its root"),
        "{err}"
    );
    fs::write(&camera, "size_px = [64, 48]\nfocal_px = [60.0, 60.0]\n[shutter]\nreadout_ms = -33.0\n")
        .unwrap();
    let (code, _, err) = camsim(["apply", text(&camera), text(&frame), "-o", text(&out)]);
    assert!(code == 2 && err.contains("shutter.readout_ms: must be"), "{err}");
}

#[test]
fn apply_renders_a_folder_of_images() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    fs::create_dir(file("rgb")).unwrap();
    for i in 0..4 {
        fs::copy(assets().join("acircles.png"), file(&format!("rgb/{i}.5.png"))).unwrap();
    }
    let (camera, frames, out) = (file("CAMERA.toml"), file("FRAMES.toml"), file("out"));
    fs::write(
        &camera,
        "size_px = [64, 48]\nfocal_px = [60.0, 60.0]\n[shutter]\nreadout_ms = \
                        33.0\n[photometric]\nnoise_sigma = 0.01\n",
    )
    .unwrap();
    let twist = "color = \"rgb/*.png\"\nname_unit = \"s\"\nfocal_px = [300.0, \
                 300.0]\n[motion]\nangular_rate_rad_s = [0.0, 0.0, 1.0]\n";
    fs::write(&frames, twist).unwrap();
    let apply = |more: &[&str]| {
        camsim(["apply", text(&camera), text(&frames), "-o", text(&out)].iter().chain(more).copied())
    };
    let (code, _, err) = apply(&["--frames", "1..3", "--format", "png,exr"]);
    assert!(code == 0 && err.contains("2 frames in"), "{err}");
    let table = fs::read_to_string(out.join("frames.csv")).unwrap();
    let rows: Vec<&str> = table.lines().collect();
    assert_eq!(rows[0], "frame,stamp_ns,from_color,from_depth,color_png,color_exr,valid");
    assert!(
        rows.len() == 3
            && rows[1].starts_with("1,1500000000,")
            && rows[1].ends_with("color/frame_000001.exr,valid/frame_000001.png"),
        "{table}"
    );
    for name in ["color/frame_000002.png", "valid/frame_000002.png", "run.json", "camera.toml"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    assert!(!out.join("color/frame_000000.png").exists() && !out.join("depth").exists());

    // Existing frames are kept, missing ones equal those of a single run, and the table lists both.
    let existing = fs::read(out.join("color/frame_000001.exr")).unwrap();
    fs::remove_file(out.join("color/frame_000002.exr")).unwrap();
    let (code, _, err) = apply(&["--resume", "--format", "png,exr"]);
    assert!(code == 0 && err.contains("3 frames (1 existed)"), "{err}");
    assert_eq!(fs::read(out.join("color/frame_000001.exr")).unwrap(), existing);
    assert_eq!(fs::read_to_string(out.join("frames.csv")).unwrap().lines().count(), 5);
    let alone = file("alone");
    assert_eq!(
        camsim(["-q", "apply", text(&camera), text(&frames), "-o", text(&alone), "--frames", "1"]).0,
        0
    );
    assert_eq!(
        fs::read(alone.join("color/frame_000001.exr")).unwrap(),
        existing,
        "a frame does not depend on those beside it"
    );
    let noise = |frame: u32| fs::read(out.join(format!("color/frame_00000{frame}.exr"))).unwrap();
    assert_ne!(noise(1), noise(2), "noise differs between frames");

    // The written frames.csv is accepted as a table of frames.
    let again = file("AGAIN.toml");
    fs::write(&again, "frames = \"out/frames.csv\"\nfocal_px = [60.0, 60.0]\n").unwrap();
    let (code, _, err) =
        camsim(["apply", text(&camera), text(&again), "-o", text(&file("twice")), "--frames", "0"]);
    assert!(code == 0, "{err}");

    let (code, _, err) = apply(&["--resume", "--seed", "3"]);
    assert!(code == 2 && err.contains("seed was 0, now 3"), "{err}");
    // A changed input image is detected as well.
    let picture = file("rgb/1.5.png");
    let original = fs::read(&picture).unwrap();
    fs::write(&picture, [&original[..], b"more"].concat()).unwrap();
    let (code, _, err) = apply(&["--resume"]);
    assert!(
        code == 2 && err.contains("from other inputs: pictures.") && err.contains("rgb/1.5.png"),
        "{err}"
    );
    fs::write(&picture, original).unwrap();
    let (code, _, err) = apply(&["--frames", "3..9"]);
    assert!(code == 2 && err.contains("names frames 0 to 3"), "{err}");
    let (code, _, err) = camsim(["apply", text(&camera), text(&frames), "-o", text(&file("p.png"))]);
    assert!(code == 2 && err.contains("names 4 frames, so it must be a folder"), "{err}");

    // A trajectory that does not cover all frames is an error before anything is written.
    fs::write(file("poses.csv"), "t_s,x,y,z,qw,qx,qy,qz\n1,0,0,0,1,0,0,0\n3,0,0,0,1,0,0,0\n").unwrap();
    fs::write(&frames, twist.replace("angular_rate_rad_s = [0.0, 0.0, 1.0]", "trajectory = \"poses.csv\""))
        .unwrap();
    let new = file("new");
    let (code, _, err) = camsim(["apply", text(&camera), text(&frames), "-o", text(&new)]);
    assert!(
        code == 2 && err.contains("2 of 4 frames, first frame 0") && err.contains("it covers --frames 1..=2"),
        "{err}"
    );
    assert!(!new.exists());
    // A trajectory with gaps gives a warning.
    let (_, _, err) = camsim(["apply", text(&camera), text(&frames), "-o", text(&new), "--frames", "1..3"]);
    assert!(
        err.contains(
            "FRAMES.toml: 2 of 2 frames, first frame 1, are in gaps of the trajectory of up to 2.0 s"
        ),
        "{err}"
    );

    // A single frame is no folder.
    fs::write(&frames, "color = \"rgb/0.5.png\"\nfocal_px = [300.0, 300.0]\n").unwrap();
    let (code, _, err) = camsim(["apply", text(&camera), text(&frames), "-o", text(&new)]);
    assert!(code == 2 && err.contains("a single frame is an image"), "{err}");
    let (code, _, err) =
        camsim(["apply", text(&camera), text(&frames), "-o", text(&file("p.png")), "--resume"]);
    assert!(code == 2 && err.contains("--resume is for several frames"), "{err}");
}
