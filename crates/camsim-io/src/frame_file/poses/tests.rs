#![allow(clippy::unwrap_used)]

use super::*;

fn read(text: &str, format: TrajectoryFormat, base_s: f64) -> Result<(Vec<PoseRow>, Vec<String>), String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("p.csv");
    std::fs::write(&path, text).unwrap();
    read_poses(&path, format, base_s).map_err(|error| error.to_string())
}

/// The first row as t, position and quaternion w, x, y, z.
fn first(text: &str, format: TrajectoryFormat) -> [f64; 8] {
    let PoseRow { t_s, position_m: p, world_from_camera: q } =
        read(text, format, 0.0).unwrap_or_else(|error| panic!("{text}\n{error}")).0[0];
    [t_s, p.x, p.y, p.z, q.w, q.x, q.y, q.z]
}

const ROW: [f64; 8] = [2.5, 1.0, -2.0, 3.0, 0.5, -0.5, 0.5, 0.5];

fn is_expected(values: [f64; 8]) -> bool {
    values.iter().zip(ROW).all(|(value, expected)| (value - expected).abs() < 1e-9)
}

#[test]
fn units_and_order_follow_the_column_names() {
    for text in [
        "t_s,x,y,z,qw,qx,qy,qz\n2.5,1,-2,3,0.5,-0.5,0.5,0.5\n",
        "t_ms,x_mm,y_mm,z_mm,qx,qy,qz,qw\n2500,1000,-2000,3000,-0.5,0.5,0.5,0.5\n",
        "qz,qy,qx,qw,z_cm,y_m,x_km,t_ns\n0.5,0.5,-0.5,0.5,300,-2,0.001,2500000000\n",
        "timestamp [us],tx [m],ty [m],tz [m],q_x,q_y,q_z,q_w\n2.5e6,1,-2,3,-0.5,0.5,0.5,0.5\n",
    ] {
        assert!(
            is_expected(first(text, TrajectoryFormat::Csv)),
            "{text}: {:?}",
            first(text, TrajectoryFormat::Csv)
        );
    }
    for text in [
        "2.5 1 -2 3 -0.5 0.5 0.5 0.5\n",
        "# a flight\n# timestamp tx ty tz qx qy qz qw\n2.5 1 -2 3 -0.5 0.5 0.5 0.5\n",
        "# format: timestamp tx ty tz qx qy qz qw\n2.5 1 -2 3 -0.5 0.5 0.5 0.5\n",
        "# timestamp tx ty tz qw qx qy qz\n2.5 1 -2 3 0.5 -0.5 0.5 0.5\n",
        "#t_ms, x_mm, y_mm, z_mm, qw, qx, qy, qz\n2500 1000 -2000 3000 0.5 -0.5 0.5 0.5\n",
    ] {
        assert!(
            is_expected(first(text, TrajectoryFormat::Tum)),
            "{text}: {:?}",
            first(text, TrajectoryFormat::Tum)
        );
    }
}

#[test]
fn missing_units_and_ambiguous_columns_are_refused() {
    let q = "qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n";
    for (text, wanted) in [
        (format!("t,x,y,z,{q}"), "p.csv:1: the column `t` does not say its unit: call it t_s, t_ms"),
        (format!("timestamp,x,y,z,{q}"), "the column `timestamp` does not say its unit"),
        (format!("t_ticks,x,y,z,{q}"), "the column `t_ticks` is in a unit that is not known"),
        (format!("t_s,x_px,y,z,{q}"), "the column `x_px` is in a unit"),
        ("t_s,t_ns,x,y,z,qw,qx,qy,qz\n".into(), "two columns for t_s, `t_s` and `t_ns`"),
        ("t_s,x,x_mm,y,z,qw,qx,qy,qz\n".into(), "two columns for x, `x` and `x_mm`"),
        ("t_s,x,y,z,qw,qx,qy,qy\n".into(), "two columns for qy"),
        ("t_s,x,y,z,roll,pitch,yaw\n".into(), "names no column qw"),
        (
            "t_s,x,y,z,qw,qx,qy,qz\n1.7e18,0,0,0,1,0,0,0\n".into(),
            "p.csv:2: its time is 1.7e18 s, which no clock has",
        ),
        ("t_s,x_mm,y,z,qw,qx,qy,qz\n1,one,0,0,1,0,0,0\n".into(), "p.csv:2: x_mm is `one`"),
    ] {
        let error = read(&text, TrajectoryFormat::Csv, 0.0).unwrap_err();
        assert!(error.contains(wanted), "{text}\n  gives {error}\n  not   {wanted}");
    }
    let error = read("1403715282262142976 0 0 0 0 0 0 1\n", TrajectoryFormat::Tum, 0.0).unwrap_err();
    assert!(error.contains("p.csv:1: its time is") && error.contains("t_ns"), "{error}");
    let (_, notes) =
        read("t_s,x,y,z,qw,qx,qy,qz,vx,roll_deg\n1,0,0,0,1,0,0,0,9,9\n", TrajectoryFormat::Csv, 0.0).unwrap();
    assert!(notes.len() == 1 && notes[0].contains("the columns vx, roll_deg are not read"), "{notes:?}");
}
