//! Nodes that move during frames.

use std::f64::consts::{FRAC_PI_2, TAU};

use glam::DQuat;

use super::*;

/// The square of `square_with` and, at byte 48, two times and two translations; `more` is JSON beside nodes.
fn read(nodes: &str, more: &str, options: GltfOptions, motion: &ModelMotion) -> Result<Model, String> {
    let square = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0];
    let keys = [0.0, 1.0, 0.0, 0.0, 0.0, 3.0, 0.0, 0.0];
    let bytes = floats(&[&square[..], &keys].concat());
    let rest = format!(
        r#""bufferViews": [{{ "buffer": 0, "byteLength": 48 }},
            {{ "buffer": 0, "byteOffset": 48, "byteLength": 8 }},
            {{ "buffer": 0, "byteOffset": 56, "byteLength": 24 }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0],
                "max": [1, 1, 0] }},
            {{ "bufferView": 1, "componentType": 5126, "count": 2, "type": "SCALAR", "min": [0], "max": [1] }},
            {{ "bufferView": 2, "componentType": 5126, "count": 2, "type": "VEC3" }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "mode": 5 }}] }}], {more}
        "nodes": [{nodes}], "scenes": [{{ "nodes": [0] }}]"#
    );
    moving_model(&bytes, &rest, options, motion)
}

fn spin(node: Option<&str>) -> ModelMotion {
    let spin = NodeSpin { node: node.map(Into::into), axis: DVec3::Z * 3.0, hz: 2.0, phase_rad: FRAC_PI_2 };
    ModelMotion { spins: vec![spin], animate: false }
}

/// Largest distance of the corners of a model placed at heading 0 from `corner(t, p)`, in the model's axes.
fn off(model: &Model, corner: impl Fn(f64, DVec3) -> DVec3) -> f64 {
    let mut most = 0.0_f64;
    for mesh in model.place(DVec3::new(5.0, 6.0, 7.0), 0.0, 1.0) {
        for t_s in [0.0, 0.13, 0.7, 3.1] {
            for (v, local) in (0..4).zip([DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::new(1.0, 1.0, 0.0)]) {
                let DVec3 { x, y, z } = corner(t_s, local);
                let expected = DVec3::new(5.0 + z, 6.0 - x, 7.0 - y);
                most = most.max(mesh.at(t_s).position_ned_m(v).distance(expected));
            }
        }
    }
    most
}

const TREE: &str = r#"{ "name": "arm", "translation": [0, 2, 0], "scale": [2, 2, 2], "children": [1] },
    { "name": "rotor", "translation": [1, 0, 0], "mesh": 0 }"#;

#[test]
fn a_named_node_spins_about_its_origin() {
    let turned = |t_s: f64, p: DVec3| DQuat::from_rotation_z(TAU * 2.0 * t_s + FRAC_PI_2) * p;
    let model = read(TREE, "", GltfOptions::default(), &spin(Some("rotor"))).unwrap();
    let off_m = off(&model, |t_s, p| DVec3::new(2.0, 2.0, 0.0) + 2.0 * turned(t_s, p));
    assert!(off_m < 1e-12, "{off_m:.1e}");
    // The whole model, about its own origin.
    let model = read(TREE, "", GltfOptions::default(), &spin(None)).unwrap();
    let off_m = off(&model, |t_s, p| turned(t_s, DVec3::new(2.0, 2.0, 0.0) + 2.0 * p));
    assert!(off_m < 1e-12, "{off_m:.1e}");
}

#[test]
fn missing_nodes_and_uneven_axes_are_refused() {
    let error = read(TREE, "", GltfOptions::default(), &spin(Some("wheel"))).unwrap_err();
    assert!(error.contains("no node \"wheel\"") && error.contains("its nodes are arm, rotor"), "{error}");
    let uneven = TREE.replace("[2, 2, 2]", "[2, 1, 2]");
    let error = read(&uneven, "", GltfOptions::default(), &spin(Some("rotor"))).unwrap_err();
    assert!(error.contains("nodes.1") && error.contains("stretched unevenly"), "{error}");
    // Only what is above counts.
    assert!(read(&uneven, "", GltfOptions::default(), &spin(Some("arm"))).is_ok());
}

#[test]
fn animations_play_again_and_again() {
    let animation = |path: &str| {
        format!(
            r#""animations": [{{ "channels": [{{ "sampler": 0, "target": {{ "node": 1, "path": "{path}" }} }}],
                "samplers": [{{ "input": 1, "output": 2 }}] }}],"#
        )
    };
    let animate = ModelMotion { spins: Vec::new(), animate: true };
    let options = GltfOptions { time_s: Some(0.25), ..GltfOptions::default() };
    let model = read(TREE, &animation("translation"), options, &animate).unwrap();
    let off_m = off(&model, |t_s, p| {
        let x = 3.0 * (t_s + 0.25).fract();
        DVec3::new(0.0, 2.0, 0.0) + 2.0 * (p + DVec3::X * x)
    });
    assert!(off_m < 1e-6, "{off_m:.1e}");
    assert_eq!(model.notes, Vec::<String>::new());
    let model = read(TREE, &animation("scale"), options, &animate).unwrap();
    assert!(model.place(DVec3::ZERO, 0.0, 1.0).all(|mesh| mesh.motion.is_none()));
    assert!(model.notes.iter().any(|note| note.contains("nodes.1 keeps the size")), "{:?}", model.notes);
    let model = read(TREE, "", GltfOptions::default(), &animate).unwrap();
    assert!(
        model.notes.iter().any(|note| note.contains("no animation for motion.animate")),
        "{:?}",
        model.notes
    );
}
