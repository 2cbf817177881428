//! Normals of models.

use super::*;

#[test]
fn flat_normals_follow_the_winding() {
    let quarter = std::f64::consts::FRAC_PI_2;
    for (nodes, heading_rad, expected) in [
        (r#"{ "mesh": 0 }"#, 0.0, DVec3::X),
        (r#"{ "mesh": 0 }"#, quarter, DVec3::Y),
        (r#"{ "mesh": 0, "scale": [1, 1, -2] }"#, 0.0, -DVec3::X),
        (r#"{ "mesh": 0, "scale": [-1, 1, 1] }"#, quarter, DVec3::Y),
        // Rotated about x to face down; stretching does not change the normal of a plane.
        (r#"{ "mesh": 0, "rotation": [0.70710678, 0, 0, 0.70710678], "scale": [5, 1, 3] }"#, 0.3, DVec3::Z),
    ] {
        let model = square_with(5, "", nodes, WITH_NORMALS).unwrap();
        let normals = ned_normals(&model, heading_rad);
        assert_eq!(normals.len(), 4, "both triangles share their vertices");
        assert!(normals.iter().all(|normal| normal.distance(expected) < 2e-6), "{nodes}: {normals:?}");
        assert_eq!(corners(&model), corners(&square_with(5, "", nodes, GltfOptions::default()).unwrap()));
    }
    assert!(ned_normals(&square(5, "", r#"{ "mesh": 0 }"#).unwrap(), 0.0).is_empty());
}

#[test]
fn planes_do_not_share_vertices_and_invalid_normals_are_replaced() {
    // Two faces of a tent.
    let vertices = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        .map(|position| MeshVertex::new(position, [0.0; 2]));
    let shape = crate::gltf_file::normals::with_flat_normals(&vertices, &[0, 1, 2, 0, 2, 3], false);
    assert_eq!((shape.vertices.len(), shape.indices.len()), (6, 6));
    let normal = |k: usize| shape.normals[shape.indices[k] as usize];
    assert_eq!(
        [normal(0), normal(2), normal(3), normal(5)],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    );
    let file_normals = vec![DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::NAN, DVec3::new(3.0, 0.0, -4.0)];
    let normalized =
        crate::gltf_file::normals::normalized(file_normals, &vertices, &[0, 1, 2, 0, 2, 3], false);
    let between = 0.5_f32.sqrt();
    for (found, expected) in normalized.into_iter().zip([
        [0.0, 0.0, 1.0],
        [0.0, 0.0, 1.0],
        [between, 0.0, between],
        [0.6, 0.0, -0.8],
    ]) {
        assert!(
            DVec3::from_array(found.map(f64::from)).distance(DVec3::from_array(expected.map(f64::from)))
                < 1e-6,
            "{found:?}"
        );
    }
}

#[test]
fn unlit_materials_get_no_normals() {
    for (material, lit) in [
        (r#"{}"#, true),
        (r#"{ "emissiveFactor": [0.5, 0, 0] }"#, true),
        (r#"{ "extensions": { "KHR_materials_unlit": {} } }"#, false),
    ] {
        let rest = format!(r#", "material": 0 }}] }}], "materials": [{material}], "x": [{{ "y": [{{ "z": 1"#);
        let model = square_with(5, &rest, r#"{ "mesh": 0 }"#, WITH_NORMALS).unwrap();
        assert_eq!(!ned_normals(&model, 0.0).is_empty(), lit, "{material}");
    }
}
