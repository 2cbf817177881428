#![allow(clippy::unwrap_used)]

use std::path::Path;

use camsim_core::scenario::Scenario;

use crate::{
    load::{Loaded, load_sequence},
    scenario_file::parse_scenario,
};

/// Two nodes below a third; one of their meshes has two materials. One node has no name.
const HOUSE: &str = r#"{"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"name":"house","children":[1,2]},{"name":"walls","mesh":0},{"mesh":1}],
"materials":[{"name":"brick"},{"name":"tile"}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0},"material":0},{"attributes":{"POSITION":0},"material":1}]},
{"primitives":[{"attributes":{"POSITION":0},"material":1}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36}],
"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]}"#;

const LOG: &str =
    "t_s,n_m,e_m,d_m,roll_deg,pitch_deg,yaw_deg\n0,0,0,-50,0,0,0\n1,5,0,-50,0,0,0\n2,10,0,-50,0,0,0\n";

fn load(folder: &Path, scene: &str) -> Result<Loaded, String> {
    image::RgbImage::new(2, 2).save(folder.join("grid.png")).unwrap();
    for (name, text) in
        [("flight.csv", LOG), ("house.gltf", HOUSE), ("places.csv", "n_m,e_m,d_m\n1,2,3\n4,5,6\n")]
    {
        std::fs::write(folder.join(name), text).unwrap();
    }
    let text = format!("[flight]\nlog = \"flight.csv\"\n{scene}");
    let scenario: Scenario =
        parse_scenario(&text, &folder.join("s.toml"), &[]).map_err(|error| error.to_string())?;
    load_sequence(&scenario).map_err(|error| error.to_string())
}

/// Name and class of the objects, and the object of each mesh.
type Objects = (Vec<(String, u16)>, Vec<u32>);

fn objects(scene: &str) -> Result<Objects, String> {
    let folder = tempfile::tempdir().unwrap();
    let scene = load(folder.path(), scene)?.sequence.scene.clone();
    let objects = scene.objects.iter().map(|object| (object.name.clone(), object.class)).collect();
    Ok((objects, scene.meshes.iter().map(|mesh| mesh.object).collect()))
}

fn named(names: &[(&str, u16)]) -> Vec<(String, u16)> {
    names.iter().map(|&(name, class)| (name.to_owned(), class)).collect()
}

const PATTERN: &str = "[scene.pattern]\nimage = \"grid.png\"\nwidth_m = 10\n";
const MODEL: &str = "[[scene.gltf]]\nfile = \"house.gltf\"\n";

#[test]
fn objects_are_numbered_in_the_order_of_the_scenario() {
    let text = format!(
        "{PATTERN}class = 7\n{MODEL}{MODEL}name = \"shed\"\nclass = 2\nplacements = \"places.csv\"\n"
    );
    let (names, of_mesh) = objects(&text).unwrap();
    assert_eq!(names, named(&[("pattern", 7), ("house", 0), ("shed#1", 2), ("shed#2", 2)]));
    assert_eq!(of_mesh, [1, 2, 2, 2, 3, 3, 3, 4, 4, 4]);
}

#[test]
fn nodes_and_materials_can_be_objects_with_classes_of_their_own() {
    let text = format!("{MODEL}objects = \"node\"\nclass = 3\nclasses = {{ walls = 5 }}\n");
    let (names, of_mesh) = objects(&text).unwrap();
    assert_eq!((names, of_mesh), (named(&[("house/walls", 5), ("house/nodes.2", 3)]), vec![1, 1, 2]));
    // A node passes its class on to those below it that have none.
    let text = format!("{MODEL}objects = \"node\"\nclasses = {{ house = 4, walls = 5 }}\n");
    assert_eq!(objects(&text).unwrap().0, named(&[("house/walls", 5), ("house/nodes.2", 4)]));
    let text = format!(
        "{MODEL}name = \"h\"\nobjects = \"material\"\nclasses = {{ tile = 9 }}\nplacements = \"places.csv\"\n"
    );
    let (names, of_mesh) = objects(&text).unwrap();
    assert_eq!(names, named(&[("h#1/brick", 0), ("h#1/tile", 9), ("h#2/brick", 0), ("h#2/tile", 9)]));
    assert_eq!(of_mesh, [1, 2, 2, 3, 4, 4]);
}

#[test]
fn wrong_classes_are_refused_with_what_there_is() {
    let error = |text: &str| objects(&format!("{MODEL}{text}\n")).unwrap_err();
    let unknown = error("objects = \"material\"\nclasses = { tiles = 1 }");
    assert!(unknown.contains("no material `tiles`; its materials are `brick`, `tile`"), "{unknown}");
    let unknown = error("objects = \"node\"\nclasses = { tile = 1 }");
    assert!(unknown.contains("nodes are `house`, `nodes.2`, `walls`"), "{unknown}");
    for (text, wanted) in [
        ("classes = { walls = 1 }", "scene.gltf.0.classes: needs objects = \"node\""),
        ("objects = \"node\"\nclasses = { walls = 0 }", "whole numbers, 1 to 65535"),
        ("objects = \"node\"\nclasses = 3", "expected a table of names"),
        ("class = 70000", "scene.gltf.0.class: expected a whole number, 1 to 65535"),
        ("name = \" \"", "scene.gltf.0.name: is empty"),
        ("objects = \"mesh\"", "expected one of \"placement\", \"node\", \"material\""),
    ] {
        let error = error(text);
        assert!(error.contains(wanted), "{text}: {error}");
    }
}

#[test]
fn more_objects_than_a_picture_can_number_are_refused_if_they_are_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let rows: String = (0..33_000).map(|i| format!("{i},0,0\n")).collect();
    std::fs::write(folder.path().join("many.csv"), format!("n_m,e_m,d_m\n{rows}")).unwrap();
    let text = format!("{MODEL}objects = \"node\"\nplacements = \"many.csv\"\n");
    assert_eq!(load(folder.path(), &text).unwrap().sequence.scene.objects.len(), 66_000);
    let error = load(folder.path(), &format!("{text}[output]\nchannels = [\"class\"]\n")).unwrap_err();
    assert!(error.contains("66000 objects") && error.contains("at most 65535"), "{error}");
}
