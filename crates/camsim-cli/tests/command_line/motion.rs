//! `camsim track`, and `camsim explain` on the same flight.

use std::fs;

use super::{assets, camsim, text};

#[test]
fn built_in_flight_is_tracked_and_explained() {
    let folder = tempfile::tempdir().unwrap();
    let (scenario, table) = (assets().join("pattern.toml"), folder.path().join("traj.csv"));
    let (code, out, err) =
        camsim(["track", text(&scenario), "--rate", "25", "-o", text(&table), "--report", "--json"]);
    assert_eq!(code, 0, "{err}");
    let report: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert!(
        report["rms"]["north_m"].as_f64().unwrap() < 1.0 && report["max_used"]["speed_m_s"].is_f64(),
        "{report}"
    );
    assert!(report["max_error"]["attitude_deg"].is_f64(), "{report}");
    let rows: Vec<Vec<f64>> = fs::read_to_string(&table)
        .unwrap()
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
        .collect();
    // The window of 10 to 12 s at 25 Hz, both ends.
    assert_eq!(rows.len(), 51);
    assert!((rows[50][0] - rows[0][0] - 2.0).abs() < 1e-8);
    assert!(rows.iter().all(|row| row.len() == 20 && row.iter().all(|value| value.is_finite())));
    assert!(rows.windows(2).all(|pair| (pair[1][0] - pair[0][0] - 0.04).abs() < 1e-8));

    let (code, out, err) = camsim(["explain", text(&scenario), "--frame", "3", "--json"]);
    assert_eq!(code, 0, "{err}");
    let explained: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!((explained["plan"]["frame"].as_u64(), explained["frames"].as_u64()), (Some(3), Some(60)));
    let (code, out, _) = camsim(["explain", text(&scenario), "--set", "camera.shutter.exposure_ms=0"]);
    assert!(code == 0 && out.contains("skipped") && !out.contains("light:"), "{out}");
    let (code, out, err) = camsim(["explain", text(&scenario), "--set", "scene.light.sun=0.7"]);
    assert!(
        code == 0 && out.contains("light: sun 0.7 from 180 deg") && !out.contains("terrain texture"),
        "{out}"
    );
    assert!(err.contains("scene.light changes nothing"), "{err}");
    let (code, out, err) =
        camsim(["explain", text(&assets().join("demo.toml")), "--set", "scene.light.sun=0.7"]);
    assert!(
        code == 0 && out.contains("in steps of 8 bits") && !err.contains("changes nothing"),
        "{out} {err}"
    );
}

#[test]
fn camera_motion_contains_mount_and_vibration() {
    let folder = tempfile::tempdir().unwrap();
    let (scenario, table) = (assets().join("pattern.toml"), folder.path().join("poses.csv"));
    let track = |more: &[&str]| {
        let (code, _, err) = camsim([&["track", text(&scenario), "-o", text(&table)][..], more].concat());
        assert_eq!(code, 0, "{err}");
        let all = fs::read_to_string(&table).unwrap();
        let header = all.lines().next().unwrap().to_owned();
        let rows = all
            .lines()
            .skip(1)
            .map(|line| line.split(',').map(|cell| cell.parse().unwrap()).collect())
            .collect::<Vec<Vec<f64>>>();
        (header, rows, err)
    };
    let still =
        ["--set", "camera.mount.vibration=[]", "--set", "camera.mount.offset_m=[2, 0, 0]", "--rate", "100"];
    let (_, body, _) = track(&still);
    let (header, rigid, err) = track(&[&still[..], &["--of", "camera"]].concat());
    assert_eq!(header, "t_s,n_m,e_m,d_m,vn,ve,vd,qw,qx,qy,qz,wx,wy,wz");
    assert!(body.len() == 201 && rigid.len() == 201 && !err.contains("too few"), "{err}");
    let vibrating = [
        "--set",
        "camera.mount.vibration=[{ axis = \"roll\", amplitude_deg = 0.5, hz = 17, phase_deg = 30 }]",
    ];
    let (_, vibrating, err) = track(&[&still[2..], &vibrating[..], &["--of", "camera"]].concat());
    assert!(!err.contains("too few"), "{err}");
    for (i, (body, (rigid, vibrating))) in body.iter().zip(rigid.iter().zip(&vibrating)).enumerate() {
        assert_eq!((body[0], body[0]), (rigid[0], vibrating[0]));
        let quaternion = |row: &[f64]| glam::DQuat::from_xyzw(row[1], row[2], row[3], row[0]);
        let (body_attitude, rigid_attitude, vibrating_attitude) =
            (quaternion(&body[10..14]), quaternion(&rigid[7..11]), quaternion(&vibrating[7..11]));
        // The camera looks straight down with its top towards the nose, 2 m ahead.
        let ahead = body_attitude * glam::DVec3::new(2.0, 0.0, 0.0);
        let offset = glam::DVec3::new(rigid[1] - body[1], rigid[2] - body[2], rigid[3] - body[3]);
        assert!((offset - ahead).length() < 1e-9, "{offset} {ahead}");
        assert!((rigid_attitude * glam::DVec3::Z - body_attitude * glam::DVec3::Z).length() < 1e-9);
        assert!((rigid_attitude * -glam::DVec3::Y - body_attitude * glam::DVec3::X).length() < 1e-9);
        // The window begins 10 s after the first good row, where the phase is zero; the rotation is about the
        // body's forward axis, before the mount.
        let angle_rad = 0.5_f64.to_radians()
            * (std::f64::consts::TAU * 17.0 * (10.0 + 0.01 * i as f64) + 30_f64.to_radians()).sin();
        let expected = body_attitude
            * glam::DQuat::from_rotation_x(angle_rad)
            * body_attitude.inverse()
            * rigid_attitude;
        assert!(
            vibrating_attitude.angle_between(expected) < 1e-7,
            "{i}: {}",
            vibrating_attitude.angle_between(expected)
        );
    }
    let (_, _, err) = track(&["--of", "camera", "--rate", "30", "--set", "output.stamps=zero"]);
    assert!(
        err.contains("30 rows per second are too few for the mount's vibration of 17 Hz: use --rate 136"),
        "{err}"
    );
    assert!(fs::read_to_string(&table).unwrap().lines().nth(1).unwrap().starts_with("0.000000000,"));
}
