//! Notes about animations.

use super::*;

#[test]
fn time_without_animation_is_noted() {
    let noted = |time_s: Option<f64>| {
        square_with(5, "", r#"{ "mesh": 0 }"#, GltfOptions { time_s, ..GltfOptions::default() })
            .unwrap()
            .notes
    };
    assert!(noted(None).is_empty());
    let notes = noted(Some(1.0));
    assert!(notes.len() == 1 && notes[0].starts_with("has no animation for time_s"), "{notes:?}");
}

#[test]
fn unused_animation_option_and_conflicting_animations_are_noted() {
    let animation = r#"{ "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }],
        "samplers": [{ "input": 1, "output": 0 }] }"#;
    let read = |count: usize, options: GltfOptions| {
        let bytes = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
        let animations = vec![animation; count].join(", ");
        let rest = format!(
            r#""bufferViews": [{{ "buffer": 0, "byteLength": 48 }}, {{ "buffer": 0, "byteOffset": 48,
                "byteLength": 16 }}],
            "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
                "min": [0, 0, 0], "max": [1, 1, 0] }},
                {{ "bufferView": 1, "componentType": 5126, "count": 4, "type": "SCALAR", "min": [0],
                    "max": [3] }}],
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "mode": 5 }}] }}],
                "animations": [{animations}],
            "nodes": [{{ "mesh": 0 }}], "scenes": [{{ "nodes": [0] }}]"#
        );
        model(&bytes, &rest, options).unwrap().notes
    };
    let options = |time_s: Option<f64>, animation: Option<usize>| GltfOptions {
        time_s,
        animation,
        ..GltfOptions::default()
    };
    assert_eq!(read(1, options(Some(1.0), None)), Vec::<String>::new());
    assert_eq!(read(2, options(Some(1.0), Some(1))), Vec::<String>::new());
    let [unused] = read(1, options(None, Some(0))).try_into().unwrap();
    assert!(unused.contains("animation has no effect without time_s"), "{unused}");
    let [conflict] = read(3, options(Some(1.0), None)).try_into().unwrap();
    assert!(conflict.contains("animations 0 and 1 both move node 0"), "{conflict}");
}
