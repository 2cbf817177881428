//! Base colours, blending and texture transforms of materials.

use super::*;

#[test]
fn texture_transform_rotates_offsets_and_scales() {
    let rule = |rotation_rad: f64, offset: [f64; 2], scale: [f64; 2]| material::VertexRule {
        set: 0,
        offset,
        rotation_rad,
        scale,
        factor: [1.0; 4],
        uses_vertex_colors: true,
        ignores_vertex_colors: false,
        is_lit: true,
    };
    let transformed =
        |rule: material::VertexRule, uv: [f64; 2]| DVec2::from_array(rule.transform_uv(uv).map(f64::from));
    assert!(
        transformed(rule(0.0, [0.5, -0.25], [2.0, 3.0]), [0.1, 0.2]).distance(DVec2::new(0.7, 0.35)) < 1e-6
    );
    // A quarter turn anticlockwise with v pointing down: u becomes -v.
    assert!(
        transformed(rule(std::f64::consts::FRAC_PI_2, [0.0; 2], [1.0; 2]), [1.0, 0.0])
            .distance(DVec2::new(0.0, -1.0))
            < 1e-6
    );
}

/// The material of a square.
fn square_material(material: &str) -> Material {
    let rest = format!(r#", "material": 0 }}] }}], "materials": [{material}], "x": [{{ "y": [{{ "z": 1"#);
    let model = square_with(5, &rest, r#"{ "mesh": 0 }"#, GltfOptions::default()).unwrap();
    assert!(model.notes.is_empty(), "{:?}", model.notes);
    model.place(DVec3::ZERO, 0.0, 1.0).next().unwrap().material
}

#[test]
fn blended_material_without_transparency_is_opaque() {
    let blending = |mode: &str, alpha: f32| {
        let factor = format!(r#""pbrMetallicRoughness": {{ "baseColorFactor": [1, 1, 1, {alpha}] }}"#);
        let material = square_material(&format!(r#"{{ "alphaMode": "{mode}", {factor} }}"#));
        (material.blends, material.cutoff)
    };
    let is = |blending: (bool, Option<f32>), blends: bool| {
        blending.0 == blends && cuts_just_below(0.5, blending.1)
    };
    assert!(is(blending("BLEND", 0.5), true) && is(blending("BLEND", 0.999), true));
    // Without transparency the material is opaque.
    assert_eq!(blending("BLEND", 1.0), (false, None));
    assert!(is(blending("MASK", 0.4), false) && is(blending("MASK", 1.0), false));
    assert_eq!(blending("OPAQUE", 0.4), (false, None));
}

#[test]
fn factors_outside_0_to_1_are_clamped_with_a_note() {
    let read = |material: &str| {
        let rest = format!(r#", "material": 0 }}] }}], "materials": [{material}], "x": [{{ "y": [{{ "z": 1"#);
        square_with(5, &rest, r#"{ "mesh": 0 }"#, GltfOptions::default())
    };
    let base = |factor: &str| {
        read(&format!(
            r#"{{ "alphaMode": "BLEND", "pbrMetallicRoughness": {{ "baseColorFactor": {factor} }} }}"#
        ))
    };
    assert!(base("[0, 1, 0.5, 0.25]").unwrap().notes.is_empty());
    for factor in ["[1, 1, 1, 1.5]", "[1, 1, 1, -0.5]", "[2, 1, 1, 0.5]"] {
        let notes = base(factor).unwrap().notes;
        let named = |note: &String| {
            ["materials.0:", "baseColorFactor", "clamped"].iter().all(|part| note.contains(part))
        };
        assert!(notes.len() == 1 && notes.iter().all(named), "{factor}: {notes:?}");
    }
    let error = base("[1, 1, 1, 1e39]").unwrap_err().to_string();
    assert!(
        ["materials.0:", "baseColorFactor", "not finite"].iter().all(|part| error.contains(part)),
        "{error}"
    );
    let notes = read(r#"{ "emissiveFactor": [3, 0, 0] }"#).unwrap().notes;
    assert!(notes.len() == 1 && notes[0].starts_with("materials.0: emissiveFactor"), "{notes:?}");
}

#[test]
fn diffuse_factor_of_specular_glossiness_is_the_base_colour() {
    let material = |rest: &str| {
        format!(r#", "material": 0 }}] }}], "materials": [{{ {rest} }}], "unknown": [{{ "none": [{{ "x": 0"#)
    };
    let diffuse = r#""extensions": {
        "KHR_materials_pbrSpecularGlossiness": { "diffuseFactor": [0.25, 0.5, 0.75, 1.0] } }"#;
    let tint = |rest: &str| square(4, &material(rest), r#"{ "mesh": 0 }"#).map(|model| corners_tints(&model));
    assert_eq!(tint(diffuse).unwrap(), vec![[0.25, 0.5, 0.75, 1.0]; 4]);
    assert_eq!(tint("").unwrap(), vec![[1.0; 4]; 4]);
    let error = tint(&diffuse.replace("0.25", "1e39")).unwrap_err();
    assert!(
        error.contains("materials.0: extensions.KHR_materials_pbrSpecularGlossiness.diffuseFactor"),
        "{error}"
    );
}

fn corners_tints(model: &Model) -> Vec<[f32; 4]> {
    model
        .place(DVec3::ZERO, 0.0, 1.0)
        .flat_map(|mesh| mesh.shape.vertices.iter().map(|vertex| vertex.tint).collect::<Vec<_>>())
        .collect()
}
