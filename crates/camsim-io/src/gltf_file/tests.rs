#![allow(clippy::unwrap_used, reason = "tests")]

use camsim_core::scene::{MeshVertex, light::transformed_normal};
use glam::DVec2;

use super::*;

mod animation;
mod emissive;
mod extensions;
mod malformed;
mod materials;
mod moving;
mod normals;
mod published;

/// Reads a file with one buffer; `rest` is the JSON after `"buffers"`.
fn model(bytes: &[u8], rest: &str, options: GltfOptions) -> Result<Model, String> {
    moving_model(bytes, rest, options, &ModelMotion::default())
}

fn moving_model(
    bytes: &[u8],
    rest: &str,
    options: GltfOptions,
    motion: &ModelMotion,
) -> Result<Model, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a b.bin"), bytes).unwrap();
    let path = folder.path().join("model.gltf");
    let buffers = format!("\"buffers\": [{{ \"byteLength\": {}, \"uri\": \"a%20b.bin\" }}]", bytes.len());
    std::fs::write(
        &path,
        format!("{{ \"asset\": {{ \"version\": \"2.0\" }}, \"scene\": 0, {buffers}, {rest} }}"),
    )
    .unwrap();
    read_moving_gltf(&path, options, motion).map_err(|error| error.to_string())
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// A square of four vertices, (0, 0) to (1, 1), with topology `mode`; `more` is JSON inside the primitive.
fn square(mode: u32, more: &str, nodes: &str) -> Result<Model, String> {
    square_with(mode, more, nodes, GltfOptions::default())
}

fn square_with(mode: u32, more: &str, nodes: &str, options: GltfOptions) -> Result<Model, String> {
    let bytes = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    let rest = format!(
        r#""bufferViews": [{{ "buffer": 0, "byteLength": 48 }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0],
            "max": [1, 1, 0] }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "mode": {mode} {more} }}] }}],
        "nodes": [{nodes}], "scenes": [{{ "nodes": [0] }}]"#
    );
    model(&bytes, &rest, options)
}

/// NED positions, metres, of the triangles of a model placed at the origin.
fn corners(model: &Model) -> Vec<[DVec3; 3]> {
    let triangles = |mesh: Mesh| {
        mesh.shape
            .indices
            .chunks_exact(3)
            .map(|t| [t[0], t[1], t[2]].map(|v| mesh.position_ned_m(v)))
            .collect::<Vec<_>>()
    };
    model.place(DVec3::ZERO, 0.0, 1.0).flat_map(triangles).collect()
}

const WITH_NORMALS: GltfOptions = GltfOptions { normals: true, scene: None, time_s: None, animation: None };

/// NED normals of the vertices of a placed model.
fn ned_normals(model: &Model, heading_rad: f64) -> Vec<DVec3> {
    let normals = |mesh: Mesh| {
        let transformed = |normal: &[f32; 3]| {
            transformed_normal(&mesh.ned_from_shape, DVec3::from_array(normal.map(f64::from)))
        };
        mesh.shape.normals.iter().map(transformed).collect::<Vec<_>>()
    };
    model.place(DVec3::ZERO, heading_rad, 2.0).flat_map(normals).collect()
}

/// Whether a cut-off is just below an alpha: low enough for a half float rounded down by up to 2^-11, and no
/// lower.
fn cuts_just_below(alpha: f32, cutoff: Option<f32>) -> bool {
    cutoff.is_some_and(|cutoff| cutoff < alpha * (1.0 - 0.5_f32.powi(11)) && cutoff > 0.999 * alpha)
}

#[test]
fn strips_and_fans_have_uniform_winding() {
    let turns =
        |model: &Model| corners(model).iter().map(|[a, b, c]| (*b - *a).cross(*c - *a)).collect::<Vec<_>>();
    let strip = turns(&square(5, "", r#"{ "mesh": 0 }"#).unwrap());
    assert_eq!(strip.len(), 2);
    // The normals point along z, forward: north.
    assert!(strip.iter().all(|turn| turn.distance(DVec3::X) < 1e-12), "{strip:?}");
    let fan = turns(&square(6, "", r#"{ "mesh": 0 }"#).unwrap());
    assert_eq!((fan.len(), fan[0].distance(DVec3::X) < 1e-12), (2, true));
    let lines = square(1, "", r#"{ "mesh": 0 }"#).unwrap();
    assert_eq!((lines.triangles(), lines.notes.len()), (0, 2));
}

#[test]
fn mirrored_nodes_keep_their_front_faces() {
    let mirrored = square(5, "", r#"{ "mesh": 0, "scale": [1, 1, -2] }"#).unwrap();
    for [a, b, c] in corners(&mirrored) {
        assert!((b - a).cross(c - a).normalize().distance(-DVec3::X) < 1e-12);
    }
    // The other node is not mirrored and shares no shape.
    let both = square(
        5,
        "",
        r#"{ "mesh": 0, "children": [1], "scale": [1, 1, -1] }, { "mesh": 0, "scale": [-1, 1, 1] }"#,
    )
    .unwrap();
    let turns: Vec<f64> = corners(&both).iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).x).collect();
    assert_eq!(turns, [-1.0, -1.0, -1.0, -1.0]);
    let meshes: Vec<Mesh> = both.place(DVec3::ZERO, 0.0, 1.0).collect();
    assert!(!Arc::ptr_eq(&meshes[0].shape, &meshes[1].shape));
}

#[test]
fn placed_model_faces_its_heading() {
    let square = square(5, "", r#"{ "mesh": 0, "translation": [1, 2, 3] }"#).unwrap();
    let first_vertex_ned_m = |heading_deg: f64| {
        let mesh =
            square.place(DVec3::new(10.0, 20.0, 30.0), f64::to_radians(heading_deg), 2.0).next().unwrap();
        mesh.position_ned_m(0)
    };
    // Left, up, ahead of the origin, twice as large.
    assert!(
        first_vertex_ned_m(0.0).distance(DVec3::new(16.0, 18.0, 26.0)) < 1e-12,
        "{}",
        first_vertex_ned_m(0.0)
    );
    assert!(
        first_vertex_ned_m(90.0).distance(DVec3::new(12.0, 26.0, 26.0)) < 1e-12,
        "{}",
        first_vertex_ned_m(90.0)
    );
}
