//! Scenes as users have them (`tests/data/field-2`): each is read as its files state, named in a warning, or
//! refused with a remedy.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::{collections::HashSet, path::Path};

use camsim_io::{
    load::{Loaded, load_sequence},
    scenario_file::parse_scenario,
};

/// Loads `[scene]` in a folder, with a flight over the terrains or past the origin.
fn load(folder: &str, scene: &str) -> Result<Loaded, String> {
    let log = if scene.contains("terrain") { "24-dem-citation-feet/geo" } else { "46-model-far-away/flight" };
    let text = format!(
        "[flight]\nlog = \"../{log}.csv\"\nheight = \"msl\"\n[camera]\nsize_px = [160, 120]\nfocal_px = [120.0, 120.0]\n\
         [camera.mount]\nangles_deg = [0.0, -90.0, 0.0]\n[scene]\n{scene}\n"
    );
    load_text(&format!("{folder}/s.toml"), &text)
}

fn load_text(file: &str, text: &str) -> Result<Loaded, String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/field-2").join(file);
    let scenario = parse_scenario(text, &path, &[]).map_err(|error| error.to_string())?;
    load_sequence(&scenario).map_err(|error| error.to_string())
}

enum Expected {
    /// It is loaded with warnings, each once, that contain all of these; without any, with none.
    Warns(&'static [&'static str]),
    /// It is refused with a message that contains all of these.
    Refused(&'static [&'static str]),
}

use Expected::{Refused, Warns};

fn assert_contains(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{text}\n  lacks {part}");
    }
}

#[test]
fn faulty_scenes_are_read_or_refused_as_expected() {
    let cm = r#"terrain = { dem = "T07f_zstd_i32cm.tif", height = "msl", height_unit = "cm" }"#;
    let cases = [
        (
            "24-dem-citation-feet",
            r#"terrain = { dem = "Z5_gtcit.tif", height = "msl" }"#,
            Warns(&["Z5_gtcit.tif: its heights are read in units of 0.3048006", "GTCitation `NAVD88 height"]),
        ),
        (
            "40-dem-centimetres",
            r#"terrain = { dem = "T07f_zstd_i32cm.tif", height = "msl" }"#,
            Refused(&[
                "its values are no plausible heights in metres (-11 500 to 9500 m), but 40000 to 46000: ",
                "scene.terrain.height_unit",
                "\"cm\" makes 400 to 460 m",
            ]),
        ),
        ("40-dem-centimetres", cm, Warns(&[])),
        (
            "41-ortho-described-bgrn",
            r#"terrain = { dem = "T00_base.tif", ortho = "O7_bgrn.tif", height = "msl" }"#,
            Warns(&["described as Blue, Green, Red, NIR: red, green and blue are taken from bands 3, 2, 1"]),
        ),
        (
            "32-b3dm-and-obj",
            r#"gltf = [{ file = "G04.b3dm" }]"#,
            Refused(&["is a tile of 3D Tiles (b3dm)", "b3dmToGlb", "4277000 623000 4672000", "geodetic = ["]),
        ),
        (
            "32-b3dm-and-obj",
            r#"gltf = [{ file = "G04_tileset.json" }]"#,
            Refused(&["is a tileset of 3D Tiles", "G04.b3dm", "b3dmToGlb"]),
        ),
        (
            "32-b3dm-and-obj",
            r#"gltf = [{ file = "G04b.obj" }]"#,
            Refused(&["is an OBJ model, not glTF", "npx obj2gltf -i "]),
        ),
    ];
    for (folder, scene, expected) in cases {
        match (expected, load(folder, scene)) {
            (Refused(parts), Err(error)) => assert_contains(&error, parts),
            (Warns(&[]), Ok(loaded)) => assert_eq!(loaded.warnings, [""; 0]),
            (Warns(parts), Ok(loaded)) => {
                assert_contains(&loaded.warnings.join("\n"), parts);
                let different: HashSet<&String> = loaded.warnings.iter().collect();
                assert_eq!(different.len(), loaded.warnings.len(), "{:?}", loaded.warnings);
            }
            (Refused(_), Ok(loaded)) => panic!("{scene}: is not refused: {:?}", loaded.warnings),
            (Warns(_), Err(error)) => panic!("{scene}: {error}"),
        }
    }
}

#[test]
fn units_of_citations_and_described_bands_are_applied() {
    let feet = load("24-dem-citation-feet", r#"terrain = { dem = "Z5_gtcit.tif", height = "msl" }"#).unwrap();
    let [low_m, high_m] = feet.terrain.unwrap().height_range_m;
    let cm = r#"terrain = { dem = "T07f_zstd_i32cm.tif", height = "msl", height_unit = "cm" }"#;
    let metres = load("40-dem-centimetres", cm).unwrap().terrain.unwrap();
    assert!((low_m - 400.0).abs() < 0.01 && (high_m - 460.0).abs() < 0.01, "{low_m} {high_m}");
    assert_eq!(metres.height_range_m, [400.0, 460.0]);
    let scene = r#"terrain = { dem = "T00_base.tif", ortho = "O7_bgrn.tif", height = "msl" }"#;
    let loaded = load("41-ortho-described-bgrn", scene).unwrap();
    let texture = &loaded.sequence.scene.terrain.as_ref().unwrap().texture;
    // The picture of 200 x 160 has a margin of 64 pixels.
    assert_eq!(texture.size_px, [328, 288]);
    assert_eq!(texture.rgba8[4 * (104 * 328 + 114)..][..3], [200, 150, 90]);
}

#[test]
fn backslashes_of_windows_are_named_with_what_to_write() {
    for (name, wanted) in [
        (
            "c.toml",
            r#"flight.log: the path holds a form feed (\f): backslashes in "..." are escapes: write 'data\flight.csv' or "data/flight.csv""#,
        ),
        ("c2.toml", r#"write 'data\logs\flight.csv' or "data/logs/flight.csv""#),
        ("c3.toml", r#"write 'C:\Users\me\flight.csv' or "C:/Users/me/flight.csv""#),
    ] {
        let file = format!("45-windows-backslashes/{name}");
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/field-2").join(&file);
        let error = load_text(&file, &std::fs::read_to_string(path).unwrap()).unwrap_err();
        assert_contains(&error, &[name, wanted]);
    }
}

#[test]
fn a_model_far_from_the_flight_is_named_with_its_position() {
    let model = |at: &str| format!(r#"gltf = [{{ file = "G09_hugeverts.gltf", at = {at} }}]"#);
    let loaded = load("46-model-far-away", &model("[0.0, 0.0, 0.0]")).unwrap();
    let far = loaded.warnings.iter().find(|warning| warning.contains("km from the flight")).unwrap();
    assert_contains(
        far,
        &["G09_hugeverts.gltf: the model is 5232 km", "map grid", "at = [-5211000.0, 466000.0, 0.0]"],
    );
    let coarse = loaded.warnings.iter().find(|warning| warning.contains("32-bit floats")).unwrap();
    assert_contains(coarse, &["G09_hugeverts.gltf: ", "hold them only to 0.5 m"]);
    // With what the warning says, the model stands at the origin.
    let loaded = load("46-model-far-away", &model("[-5211000.0, 466000.0, 0.0]")).unwrap();
    assert!(!loaded.warnings.iter().any(|warning| warning.contains("km from")), "{:?}", loaded.warnings);
    let bounds = loaded.sequence.scene.meshes[0].bounds();
    assert!(bounds.min.length() < 10.0 && bounds.max.length() < 10.0, "{bounds:?}");
}
