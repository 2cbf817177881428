//! `camsim explain`.

use super::{assets, camsim, text};

#[test]
fn explain_prints_the_frame_of_source_coordinates() {
    let scenario = assets().join("pattern.toml");
    let (code, out, err) = camsim(["explain", text(&scenario), "--frame", "3", "--json"]);
    assert_eq!(code, 0, "{err}");
    let explained: serde_json::Value = serde_json::from_str(&out).unwrap();
    let (plan, source) = (&explained["plan"], &explained["source_frame"]);
    assert_eq!(source["ideal_width_px"], plan["ideal_size_px"][0]);
    assert_eq!(
        (&source["ideal_fx_px"], &source["ideal_cy_px"]),
        (&plan["ideal_focal_px"][0], &plan["ideal_principal_px"][1])
    );
    let q: Vec<f64> =
        source["ideal_q_wxyz"].as_array().unwrap().iter().map(|q| q.as_f64().unwrap()).collect();
    assert!((q.iter().map(|q| q * q).sum::<f64>() - 1.0).abs() < 1e-9 && source["ideal_t_ns"].is_i64());
    let (_, out, _) = camsim(["explain", text(&scenario), "--frame", "3"]);
    let width = &source["ideal_width_px"];
    assert!(
        out.contains(&format!("source coordinates (x, y of coords) are in a frame of {width}x"))
            && out.contains("ned_from_camera w "),
        "{out}"
    );
}

#[test]
fn motion_within_a_frame_is_its_own_whatever_ideal_frame_it_shares() {
    let scenario = assets().join("demo.toml");
    let explain = |more: &[&str]| {
        let (code, out, err) = camsim([&["explain", text(&scenario), "--frame", "20"][..], more].concat());
        assert_eq!(code, 0, "{err}");
        out
    };
    let motion = |more: &[&str]| -> serde_json::Value {
        let out = explain(&[more, &["--json"]].concat());
        serde_json::from_str::<serde_json::Value>(&out).unwrap()["plan"]["motion"].take()
    };
    let (shared, alone) = (motion(&[]), motion(&["--set", "quality.frames_per_ideal=1"]));
    let metres = |motion: &serde_json::Value| motion["travel_m"].as_f64().unwrap();
    assert_eq!(metres(&shared["own"]), metres(&alone["own"]));
    assert_eq!(shared["own"]["rotation_rad"], alone["own"]["rotation_rad"]);
    assert!(metres(&shared) > 2.0 * metres(&shared["own"]), "{shared}");
    // From the middle of its own window a frame gets half as far as from its beginning, but for the vibration.
    assert!((metres(&alone) / metres(&alone["own"]) - 0.5).abs() < 0.05, "{alone}");
    let wanted = format!("motion within the frame\n  travel {:.4} m, rotation", metres(&shared["own"]));
    assert!(explain(&[]).contains(&wanted), "{wanted}");
}

#[test]
fn the_field_of_view_and_the_range_of_the_sensor_are_told() {
    let scenario = assets().join("pattern.toml");
    let mut args = vec!["explain", text(&scenario)];
    for change in [
        "camera.lens={ model = \"pinhole\" }",
        "camera.focal_px=[400, 400]",
        "camera.principal_point_px=[319.5, 239.5]",
        "camera.sensor={ model = \"imx250\", white_e = 5350, black_dn = 95 }",
        "camera.photometric.noise_sigma=0",
    ] {
        args.extend(["--set", change]);
    }
    let (code, out, err) = camsim(&args);
    assert_eq!(code, 0, "{err}");
    // 2 atan(320 / 400), 2 atan(240 / 400), 2 atan(400 / 400).
    let field = "640x480 px, pinhole, focal length 400.000, 400.000 px; field of view 77.32 degrees across, 61.93 down, \
                 90.00 diagonal\n";
    assert!(out.contains(field), "{out}");
    // 10700 electrons over 4095 - 95 numbers.
    let sensor = "sensor: white 5350.0 electrons of at most 10700.0, gain 2.6750 e-/DN, black 95 DN, white 2095.0 DN, \
                  exposed for 8 ms, 12 bits\n";
    assert!(out.contains(sensor), "{out}");
    let (_, out, _) = camsim([&args[..], &["--json"]].concat());
    let explained: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert!((explained["camera"]["field_deg"][2].as_f64().unwrap() - 90.0).abs() < 1e-9, "{out}");
    assert_eq!(explained["camera"]["sensor"]["bits"], 12);
}

#[test]
fn what_moves_and_what_senses_is_listed() {
    let scenario = assets().join("../examples/propeller/propeller.toml");
    let imu = "imu=[{ name = \"imu0\", rate_hz = 100, attached_to = \"camera\", mount = { offset_m = [0.1, 0, 0] } }]";
    let args = ["explain", text(&scenario), "--set", imu, "--set", "output.twin=[]"];
    let (code, out, err) = camsim(args);
    assert_eq!(code, 0, "{err}");
    let moves = "moves: propeller/rotor; pixels that show it, or its shadow, are means of 64 rays of their own, which the predicted \
                 errors do not cover";
    assert!(out.contains(moves), "{out}");
    // The window of two seconds with the exposures of its first and last row, and one second before and after.
    assert!(
        out.contains("sensors\n  imu imu0: 100 Hz, 403 samples, on the camera at 0.1, 0, 0 m\n"),
        "{out}"
    );
    let (_, out, _) = camsim([&args[..], &["--json"]].concat());
    let explained: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(explained["moving"], serde_json::json!(["propeller/rotor"]));
    assert_eq!(
        (&explained["sensors"][0]["name"], &explained["sensors"][0]["samples"]),
        (&"imu0".into(), &403.into())
    );
    let (_, out, _) = camsim(["explain", text(&assets().join("pattern.toml"))]);
    assert!(!out.contains("moves:") && !out.contains("sensors"), "{out}");
}

#[test]
fn predicted_error_is_listed_by_cause() {
    let scenario = assets().join("pattern.toml");
    let explain = |more: &[&str]| {
        let (code, out, err) = camsim([&["explain", text(&scenario)][..], more].concat());
        assert_eq!(code, 0, "{err}");
        out
    };
    let out = explain(&[]);
    assert!(
        out.contains("predicted source error")
            && out.contains("within the tolerance")
            && out.contains("single precision"),
        "{out}"
    );
    let plan_of = |more: &[&str]| {
        serde_json::from_str::<serde_json::Value>(&explain(&[&["--json"][..], more].concat())).unwrap()["plan"].clone()
    };
    let plan = plan_of(&[]);
    let predicted = &plan["predicted"];
    let total_px = predicted["total_px"].as_f64().unwrap();
    assert!(
        total_px > 0.0
            && total_px <= 0.05
            && predicted["source_error_kept"] == true
            && predicted["source_error_obstacle"].is_null(),
        "{predicted}"
    );
    // The paper's motion model is less accurate, and single precision has a floor: both are listed.
    let [linear, exact] =
        ["linear", "reproject"].map(|solver| plan_of(&["--set", &format!("quality.solver={solver}")]));
    let temporal_px = |plan: &serde_json::Value| plan["predicted"]["temporal_px"].as_f64().unwrap();
    assert!(temporal_px(&linear) > temporal_px(&exact), "{linear} {exact}");
    // The picture error has its own tolerance.
    assert!(
        predicted["picture_error_kept"] == true && predicted["picture_error_obstacle"].is_null(),
        "{predicted}"
    );
    let coarse = plan_of(&["--set", "quality.max_error_dn=1e-3"]);
    assert!(
        coarse["predicted"]["picture_error_kept"] == false
            && coarse["predicted"]["picture_error_obstacle"].as_str().unwrap().contains("/255"),
        "{coarse}"
    );
    let floor = plan_of(&["--set", "quality.max_error_px=1e-7"]);
    assert!(
        floor["predicted"]["source_error_kept"] == false
            && floor["predicted"]["source_error_obstacle"].as_str().unwrap().contains("the lens inverse"),
        "{floor}"
    );
}

#[test]
fn shadows_are_a_pass_or_are_skipped_with_a_reason() {
    let scenario = assets().join("demo.toml");
    let explain = |settings: &[&str]| {
        let sets = settings.iter().flat_map(|set| ["--set", *set]);
        let (code, out, err) =
            camsim([&["explain", text(&scenario)][..], &sets.collect::<Vec<_>>()].concat());
        assert_eq!(code, 0, "{err}");
        out
    };
    assert!(explain(&[]).contains("  shadows: scene.light is not set\n"));
    let off = explain(&["scene.light.sun=0.7"]);
    assert!(
        off.contains("  shadows: scene.light.shadows is off\n") && off.contains("without shadows"),
        "{off}"
    );
    let on = explain(&["scene.light.shadows=true"]);
    assert!(on.contains("  shadows: a ray to the sun from each") && on.contains("with shadows"), "{on}");
    assert!(
        on.contains("not in it: borders of shadows") && !on.contains("scene.light.shadows is off"),
        "{on}"
    );
}
