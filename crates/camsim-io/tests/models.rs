//! Placement of a scenario's models and boards.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::{path::Path, sync::Arc};

use camsim_io::{load::load_sequence, scenario_file::parse_scenario};
use glam::DVec3;

/// A triangle of half a metre, with its positions in a data URI.
const MODEL: &str = r#"{ "asset": { "version": "2.0" }, "scenes": [{ "nodes": [0] }],
    "nodes": [{ "mesh": 0 }],
  "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
  "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3", "min": [0, 0, 0],
      "max": [0.5, 0.5, 0] }],
  "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
  "buffers": [{ "byteLength": 36,
      "uri": "data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAAAAPwAAAAAAAAAAAAAAAAAAAD8AAAAA" }] }"#;

fn load(folder: &Path, log: &str, scene: &str) -> Result<Vec<camsim_core::scene::Mesh>, String> {
    std::fs::write(folder.join("model.gltf"), MODEL).unwrap();
    std::fs::write(folder.join("log.csv"), log).unwrap();
    let text = format!("[flight]\nlog = \"log.csv\"\n[scene]\n{scene}\n");
    let scenario =
        parse_scenario(&text, &folder.join("scenario.toml"), &[]).map_err(|error| error.to_string())?;
    Ok(load_sequence(&scenario).map_err(|error| error.to_string())?.sequence.scene.meshes.clone())
}

const LOCAL: &str = "t_s,n_m,e_m,d_m,roll_deg,pitch_deg,yaw_deg\n0,0,0,-50,0,0,0\n1,1,0,-50,0,0,0\n";
const GEODETIC: &str =
    "t_s,lat_deg,lon_deg,height_m,roll_deg,pitch_deg,yaw_deg\n0,47,8,500,0,0,0\n1,47.0001,8,500,0,0,0\n";

#[test]
fn models_are_placed_at_their_positions_and_headings() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(
        folder.path().join("places.csv"),
        "n_m,e_m,d_m,heading_deg,scale\n10,20,-1,90,2\n30,40,-2,0,1\n",
    )
    .unwrap();
    let scene = "gltf = [{ file = \"model.gltf\", at = [1, 2, 3] }, { file = \"model.gltf\", placements = \
                 \"places.csv\", scale = 3 }]";
    let meshes = load(folder.path(), LOCAL, scene).unwrap();
    let origins: Vec<DVec3> = meshes.iter().map(|mesh| mesh.origin_ned_m).collect();
    assert_eq!(
        origins,
        [DVec3::new(1.0, 2.0, 3.0), DVec3::new(10.0, 20.0, -1.0), DVec3::new(30.0, 40.0, -2.0)]
    );
    let first = &meshes[0];
    for mesh in &meshes {
        assert!(Arc::ptr_eq(&mesh.shape, &first.shape), "copies of all entries share their shape");
        assert!(mesh.material.is_same_as(&first.material), "and their texture");
    }
    // A vertex half a metre to the left of a model that faces east lies north of it, at scale 2 x 3.
    assert!(
        meshes[1].position_ned_m(1).distance(DVec3::new(13.0, 20.0, -1.0)) < 1e-9,
        "{}",
        meshes[1].position_ned_m(1)
    );
}

#[test]
fn earth_centred_vertices_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for (translation, name) in [
        ("4277000, 623000, 4672000", "earth-centred coordinates (ECEF)"),
        ("4277000, 4672000, -623000", "earth-centred coordinates (ECEF)"),
        // Easting and northing of Gauss-Krueger's third zone are as long.
        ("3500000, 500, -5320000", "a map grid"),
    ] {
        let far = MODEL.replace("\"mesh\": 0", &format!("\"mesh\": 0, \"translation\": [{translation}]"));
        std::fs::write(folder.path().join("far.gltf"), far).unwrap();
        std::fs::write(folder.path().join("log.csv"), LOCAL).unwrap();
        let text = "[flight]\nlog = \"log.csv\"\n[scene]\ngltf = [{ file = \"far.gltf\" }]\n";
        let scenario = parse_scenario(text, &folder.path().join("scenario.toml"), &[]).unwrap();
        let warnings = load_sequence(&scenario).unwrap().warnings.join("\n");
        assert!(warnings.contains(name), "{translation}: {warnings}");
    }
}

#[test]
fn geodetic_placements_use_the_frame_of_the_log() {
    let folder = tempfile::tempdir().unwrap();
    let scene = "gltf = [{ file = \"model.gltf\", geodetic = [47.001, 8.0, 450.0] }]\n[scene.board]\nkind = \
                 \"circles\"\ncolumns = 4\nrows = 3\nsize_m = 0.1\ngeodetic = [47.0, 8.0, 480.0]";
    let meshes = load(folder.path(), GEODETIC, scene).unwrap();
    // The board comes first, 20 m below the log's first row; the model is 111 m north of it.
    assert!(meshes[0].origin_ned_m.distance(DVec3::new(0.0, 0.0, 20.0)) < 1e-6, "{}", meshes[0].origin_ned_m);
    let model = meshes[1].origin_ned_m;
    assert!(
        (model.x - 111.2).abs() < 0.2 && model.y.abs() < 1e-6 && (model.z - 50.0).abs() < 0.01,
        "{model}"
    );
    let error = load(folder.path(), LOCAL, scene).unwrap_err();
    assert!(error.contains("log.csv has local coordinates") && error.contains("flight.origin"), "{error}");
}

#[test]
fn invalid_placements_and_files_are_refused_by_name() {
    let folder = tempfile::tempdir().unwrap();
    for (scene, expected) in [
        ("gltf = [{ file = \"model.gltf\", on_ground = true }]", "scene.gltf.0.on_ground: needs a terrain"),
        ("gltf = [{ file = \"none.glb\" }]", "none.glb: cannot be read"),
        ("gltf = [{ file = \"log.csv\" }]", "log.csv: is no glTF"),
        ("gltf = [{ file = \"model.gltf\", placements = \"none.csv\" }]", "none.csv: cannot be read"),
        ("gltf = [{ file = \"model.gltf\", scene = 3 }]", "has no scene 3"),
        ("gltf = [{ file = \"model.gltf\", animation = 3, time_s = 1.0 }]", "has no animation 3"),
        ("gltf = [{ at = [1, 2, 3] }]", "file: is missing"),
        (
            "gltf = [{ file = \"model.gltf\", scale = 1e12 }]",
            "model.gltf reaches 8.7e11 m from the local frame's origin",
        ),
        ("gltf = [{ file = \"model.gltf\", at = [1e300, 0, 0] }]", "check its position and scale"),
    ] {
        let error = load(folder.path(), LOCAL, scene).unwrap_err();
        assert!(error.contains(expected), "{error}");
    }
}

/// Where a model's second vertex, half a metre to its left, is at a path time.
fn left(mesh: &camsim_core::scene::Mesh, t_s: f64) -> DVec3 {
    mesh.at(t_s).position_ned_m(1)
}

#[test]
fn models_move_along_paths_and_tables() {
    let folder = tempfile::tempdir().unwrap();
    let path = "gltf = [{ file = \"model.gltf\", heading_deg = 90, motion = { path = [[1, 2, 3], [1, 22, 3]], \
                speed_m_s = 4, start_s = 1 } }]";
    let mesh = &load(folder.path(), LOCAL, path).unwrap()[0];
    // Its path leads east and its front 90 degrees to the right of that: south, so that its left is east.
    for (t_s, east_m) in [(0.0, 2.5), (1.0, 2.5), (2.5, 8.5), (99.0, 22.5)] {
        assert!(left(mesh, t_s).distance(DVec3::new(1.0, east_m, 3.0)) < 1e-9, "{t_s}: {}", left(mesh, t_s));
    }
    let table = "gltf = [{ file = \"model.gltf\", motion = { poses = \"poses.csv\" } }]";
    let with_table = |rows: &str, log: &str| {
        std::fs::write(folder.path().join("poses.csv"), rows).unwrap();
        load(folder.path(), log, table)
    };
    // Times of the log's clock, which begins at 100 s.
    let late = LOCAL.replace("\n0,0", "\n100,0").replace("\n1,1", "\n101,1");
    let meshes =
        with_table("t_ms,n_m,e_m,d_m,heading_deg\n100500,0,0,0,350\n101500,0,10,0,10\n", &late).unwrap();
    let at = |t_s: f64, east_m: f64, heading_deg: f64| {
        let (sin, cos) = heading_deg.to_radians().sin_cos();
        let expected = DVec3::new(0.5 * sin, east_m - 0.5 * cos, 0.0);
        assert!(
            left(&meshes[0], t_s).distance(expected) < 1e-9,
            "{t_s}: {} {expected}",
            left(&meshes[0], t_s)
        );
    };
    at(-1.0, 0.0, -10.0);
    at(1.0, 5.0, 0.0);
    at(1.25, 7.5, 5.0);
    at(9.0, 10.0, 10.0);
    // Without attitudes it looks where it goes.
    let meshes = with_table("t_s,n_m,e_m,d_m\n100,0,0,0\n101,0,10,0\n", &late).unwrap();
    assert!(left(&meshes[0], 0.5).distance(DVec3::new(0.5, 5.0, 0.0)) < 1e-9);
    for (rows, wanted) in [
        ("t_s,n_m,e_m,d_m\n1,0,0,0\n1,0,0,0\n", "poses.csv: line 3: its time is not later"),
        ("t_s,n_m,e_m,d_m\n", "has no row"),
        ("t_s,n_m,e_m,d_m\n1,a,0,0\n", "line 2: `a` is no finite number"),
        ("t_s,lat_deg,lon_deg,height_m\n1,147,0,0\n", "no position on Earth"),
    ] {
        let error = with_table(rows, LOCAL).unwrap_err();
        assert!(error.contains(wanted), "{error}");
    }
}
