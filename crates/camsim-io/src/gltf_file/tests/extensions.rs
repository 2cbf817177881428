//! Extensions and properties: applied, refused or reported.

use serde_json::{Value, json};

use super::{
    malformed::{png, read_with, valid_model},
    *,
};

const EXTENSIONS: &str = "/materials/0/extensions";

fn notes(changes: &[(&str, Value)]) -> Vec<String> {
    read_with(changes).unwrap_or_else(|error| panic!("{changes:?}: {error}")).notes
}

#[test]
fn unsupported_required_extension_is_refused_by_name() {
    for (name, fix) in [
        ("KHR_materials_transmission", "or remove it from extensionsRequired"),
        ("KHR_lights_punctual", "or remove it from extensionsRequired"),
        ("KHR_materials_variants", "or remove it from extensionsRequired"),
        ("KHR_animation_pointer", "or remove it from extensionsRequired"),
        ("EXT_texture_avif", "export its images as PNG or JPEG"),
        ("KHR_meshopt_compression", "export the file without compression"),
        ("ACME_glow", "export the file without it"),
    ] {
        let error =
            read_with(&[("/extensionsRequired", json!(["KHR_texture_transform", name]))]).unwrap_err();
        assert!(
            error.contains(&format!("needs the extension {name}, which is not supported"))
                && error.contains(fix),
            "{error}"
        );
    }
    let supported = json!([
        "KHR_node_visibility",
        "KHR_materials_emissive_strength",
        "EXT_texture_webp",
        "KHR_xmp_json_ld",
        "EXT_mesh_features"
    ]);
    assert!(notes(&[("/extensionsRequired", supported)]).is_empty());
}

#[test]
fn ignored_extensions_are_noted_once_where_they_occur() {
    let glass =
        json!({ "KHR_materials_transmission": { "transmissionFactor": 1 }, "KHR_materials_clearcoat": {} });
    let two = json!([{ "extensions": glass, "normalTexture": { "index": 0 } }, { "extensions": glass,
        "normalTexture": { "index": 0 } }]);
    assert_eq!(
        notes(&[
            ("/materials", two),
            ("/extensionsUsed", json!(["KHR_materials_transmission", "KHR_materials_sheen"]))
        ]),
        ["colour is albedo alone: KHR_materials_clearcoat, KHR_materials_transmission and normalTexture \
             are ignored"]
    );
    // Listed in extensionsUsed but not used.
    assert!(
        notes(&[("/extensionsUsed", json!(["KHR_materials_sheen", "KHR_lights_punctual", "ACME_glow"]))])
            .is_empty()
    );
    // Used but not listed.
    assert_eq!(
        notes(&[(EXTENSIONS, json!({ "ACME_glow": {} }))]),
        ["the extension ACME_glow is unknown and ignored"]
    );
    let lamp = json!({ "KHR_lights_punctual": { "light": 0 } });
    assert_eq!(
        notes(&[("/nodes/0/extensions", lamp)]),
        ["KHR_lights_punctual is ignored: lights are the scenario's"]
    );
    // Application-specific data are not part of the model.
    assert!(notes(&[("/nodes/0/extras", json!({ "extensions": { "ACME_glow": {} } }))]).is_empty());
    let metal = json!({ "metallicFactor": 0.5, "baseColorTexture": { "index": 0 } });
    // Without light, a metal looks as it is painted.
    assert!(notes(&[("/materials/0/pbrMetallicRoughness", metal.clone())]).is_empty());
    let of_lit = treatments::notes(&json!({ "materials": [{ "pbrMetallicRoughness": metal }] }), true);
    assert_eq!(of_lit, ["colour is albedo alone: metallicFactor is ignored"]);
    let unlit = json!([{ "pbrMetallicRoughness": metal, "normalTexture": { "index": 0 },
        "extensions": { "KHR_materials_unlit": {} } }]);
    assert!(notes(&[("/materials", unlit)]).is_empty(), "unlit materials have no shading properties");
    let more = json!({ "POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 3, "COLOR_1": 3 });
    let list = notes(&[("/meshes/0/primitives/0/attributes", more)]);
    assert!(list.len() == 1 && list[0].starts_with("meshes.0: COLOR_1 is ignored"), "{list:?}");
    let targets = json!([{ "POSITION": 0, "COLOR_0": 3 }]);
    let list = notes(&[("/meshes/0/primitives/0/targets", targets)]);
    assert!(
        list.len() == 1 && list[0].starts_with("meshes.0: COLOR_0 of its morph targets is ignored"),
        "{list:?}"
    );
}

#[test]
fn node_visibility_hides_descendants_only() {
    let hidden = json!({ "KHR_node_visibility": { "visible": false } });
    let shown = json!({ "KHR_node_visibility": { "visible": true } });
    let triangles = |parent: &Value, child: &Value| {
        let nodes = json!([{ "children": [1], "extensions": parent }, { "mesh": 0, "extensions": child },
            { "mesh": 0 }]);
        read_with(&[("/nodes", nodes), ("/scenes", json!([{ "nodes": [0, 2] }]))]).unwrap().triangles()
    };
    assert_eq!(
        [
            triangles(&shown, &shown),
            triangles(&hidden, &shown),
            triangles(&shown, &hidden),
            triangles(&json!({ "KHR_node_visibility": {} }), &json!({}))
        ],
        [4, 2, 2, 4]
    );
    let nodes = json!([{ "mesh": 0, "extensions": hidden }]);
    let model = read_with(&[("/nodes", nodes), ("/scenes", json!([{ "nodes": [0] }]))]).unwrap();
    assert!(
        model.notes[0].contains("no visible triangles: KHR_node_visibility hides nodes.0"),
        "{:?}",
        model.notes
    );
    // A cycle is refused even in hidden nodes.
    let nodes = json!([{ "children": [1], "extensions": hidden }, { "children": [1], "mesh": 0 }]);
    assert!(read_with(&[("/nodes", nodes)]).unwrap_err().contains("has two parents"));
}

#[test]
fn emissive_strength_scales_beyond_white() {
    let emissive_and_notes = |factor: f64, strength: f64| {
        let strength = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": strength } });
        let model =
            read_with(&[("/materials/0/emissiveFactor", json!([factor, 0, 0])), (EXTENSIONS, strength)])
                .unwrap();
        let emissive = model.place(DVec3::ZERO, 0.0, 1.0).next().unwrap().material.emissive;
        (emissive, model.notes)
    };
    assert_eq!(emissive_and_notes(0.25, 2.0), ([0.5, 0.0, 0.0], Vec::new()));
    // Unlit materials show the base colour alone.
    let unlit = [
        ("/materials/0/emissiveFactor", json!([1, 1, 1])),
        (EXTENSIONS, json!({ "KHR_materials_unlit": {} })),
    ];
    assert_eq!(read_with(&unlit).unwrap().parts[0].material.emissive, [0.0; 3]);
    assert_eq!(emissive_and_notes(0.5, 5.0), ([2.5, 0.0, 0.0], Vec::new()));
    // Half floats end there.
    let (emissive, notes) = emissive_and_notes(1.0, 1e5);
    assert_eq!(emissive, [65_504.0, 0.0, 0.0]);
    let wanted = "materials.0: emissiveFactor times emissiveStrength is [100000.0, 0.0, 0.0] and is clamped to 0 to 65504";
    assert!(notes.len() == 1 && notes[0].contains(wanted), "{notes:?}");
}

#[test]
fn meshopt_views_need_a_fallback_buffer() {
    let compressed = |buffer: u32| {
        json!({ "buffer": buffer, "byteLength": 48,
        "extensions": { "EXT_meshopt_compression": { "buffer": 0, "byteLength": 9, "byteStride": 12,
        "count": 4 } } })
    };
    assert_eq!(
        read_with(&[("/bufferViews/0", compressed(0))]).unwrap().triangles(),
        2,
        "the bytes are in the file"
    );
    let mut alone = valid_model(&png(4, 4));
    alone.json["bufferViews"][0] = compressed(1);
    for buffer in [
        json!({ "byteLength": 48 }),
        json!({ "byteLength": 48, "extensions": { "EXT_meshopt_compression": { "fallback": true } } }),
    ] {
        alone.json["buffers"] = json!([alone.json["buffers"][0], buffer]);
        let error = alone.read().unwrap_err();
        assert!(error.contains("needs the extension EXT_meshopt_compression"), "{error}");
    }
    // Without the extension the buffer has no data.
    alone.json["bufferViews"][0] = json!({ "buffer": 1, "byteLength": 48 });
    alone.json["buffers"][1] = json!({ "byteLength": 48 });
    let error = alone.read().unwrap_err();
    assert!(error.contains("buffers.1: has no uri, which only the first buffer"), "{error}");
    // Indices that exist only in Draco form are refused as well.
    let mut draco = valid_model(&png(4, 4));
    draco.json["accessors"][2].as_object_mut().unwrap().remove("bufferView");
    draco.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": {} } });
    assert!(draco.read().unwrap_err().contains("KHR_draco_mesh_compression"));
}

#[test]
fn accessors_without_buffer_view_are_zero_except_sparse_values() {
    let mut empty = valid_model(&png(4, 4));
    let positions = empty.json["accessors"][0].as_object_mut().unwrap();
    positions.remove("bufferView");
    // The sparse value moves vertex 1 to the second of the file's positions.
    positions.insert(
        "sparse".into(),
        json!({ "count": 1, "indices": { "bufferView": 2, "byteOffset": 2, "componentType": 5123 },
            "values": { "bufferView": 0, "byteOffset": 12 } }),
    );
    let model = empty.read().unwrap();
    let shape = &model.parts[0].shape;
    let positions_m: Vec<[f32; 3]> = shape.vertices.iter().map(|vertex| vertex.position_m).collect();
    assert_eq!(positions_m, [[0.0; 3], [2.0, 0.0, 0.0], [0.0; 3], [0.0; 3]]);
    assert!(model.notes.is_empty());
    let huge = json!({ "componentType": 5126, "count": 4_000_000_000_u64, "type": "VEC2" });
    let error = read_with(&[("/accessors/1", huge)]).unwrap_err();
    assert!(error.contains("accessors.1: has 4000000000 elements and no bufferView"), "{error}");
}

#[test]
fn animation_channels_without_node_are_ignored_and_counted() {
    let target = |target: Value| json!({ "sampler": 0, "target": target });
    let pointer = json!({ "path": "pointer",
        "extensions": { "KHR_animation_pointer": { "pointer": "/materials/0/alphaCutoff" } } });
    let channels = json!([
        target(json!({ "node": 0, "path": "translation" })),
        target(pointer),
        target(json!({ "path": "scale" }))
    ]);
    let sampler = json!([{ "input": 4, "output": 0 }]);
    let mut moved = valid_model(&png(4, 4));
    moved.json["animations"] = json!([{ "channels": channels, "samplers": sampler }]);
    // Four key times from the texture coordinates: 0, 0, 1, 0.
    moved.json["accessors"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "bufferView": 0, "componentType": 5126, "count": 4, "type": "SCALAR", "min": [0],
            "max": [2] }));
    let notes = moved.read().unwrap().notes;
    assert_eq!(
        notes,
        [
            "KHR_animation_pointer is ignored: animations move nodes, skins and morph targets",
            "animations.0: 2 of its 3 channels move no node and are ignored"
        ]
    );
}

#[test]
fn webp_image_replaces_the_fallback() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(6, 5, image::Rgb([10, 200, 30]))
        .write_to(&mut bytes, image::ImageFormat::WebP)
        .unwrap();
    let mut model = valid_model(&bytes.into_inner());
    model.json["images"] = json!([{ "uri": "none.png" }, { "bufferView": 4, "mimeType": "image/webp" }]);
    for texture in [json!({ "source": 0 }), json!({})] {
        let mut texture = texture;
        texture["extensions"] = json!({ "EXT_texture_webp": { "source": 1 } });
        model.json["textures"] = json!([texture]);
        let read = model.read().unwrap();
        let texture = &read.parts[0].material.texture;
        assert_eq!(
            (texture.size_px, &texture.rgba8[..4], read.notes.len()),
            ([6, 5], &[10, 200, 30, 255][..], 0)
        );
    }
}

#[test]
fn instance_attributes_of_different_length_are_refused() {
    let mut many = valid_model(&png(4, 4));
    many.json["nodes"][0]["extensions"] =
        json!({ "EXT_mesh_gpu_instancing": { "attributes": { "TRANSLATION": 0, "SCALE": 4 } } });
    many.json["accessors"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }));
    let error = many.read().unwrap_err();
    assert!(error.contains("nodes.0: its instances have attributes of 4 and of 3 elements"), "{error}");
}

#[test]
fn emissive_texture_that_cannot_be_baked_is_noted_with_its_material() {
    // Base colour and emissive texture use one UV set, with a scale of 2 for the emissive texture.
    let light = json!({ "index": 0, "extensions": { "KHR_texture_transform": { "scale": [2, 2] } } });
    let emits = [
        ("/materials/0/emissiveTexture", light),
        ("/materials/0/emissiveFactor", json!([1, 1, 1])),
        ("/materials/0/name", json!("lamp")),
    ];
    let mut picture = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_fn(8, 8, |x, y| image::Rgb([(32 * x) as u8, (32 * y) as u8, 0]))
        .write_to(&mut picture, image::ImageFormat::Png)
        .unwrap();
    let mut model = valid_model(picture.get_ref());
    for (pointer, value) in emits {
        model.json["materials"][0][pointer.rsplit('/').next().unwrap()] = value;
    }
    let read = model.read().unwrap();
    assert!(read.notes.is_empty(), "{:?}", read.notes);
    assert_ne!(read.parts[0].material.texture.size_px, [8, 8], "baked");
    // The two triangles overlap in both UV layouts, in different orientations.
    model.bytes[48..80].copy_from_slice(&floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 0.0]));
    let start = model.bytes.len();
    model.bytes.extend(floats(&[0.0, 1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0]));
    model.json["materials"][0]["emissiveTexture"] = json!({ "index": 0, "texCoord": 1 });
    model.json["bufferViews"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "buffer": 0, "byteOffset": start, "byteLength": 32 }));
    model.json["buffers"][0]["byteLength"] = json!(model.bytes.len());
    model.json["accessors"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "bufferView": 5, "componentType": 5126, "count": 4, "type": "VEC2" }));
    model.json["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_1"] = json!(4);
    let read = model.read().unwrap();
    let named =
        read.notes.len() == 1 && read.notes[0].starts_with("materials.0 (lamp): emissiveTexture is ignored");
    assert!(named && read.parts[0].material.texture.size_px == [8, 8], "{:?}", read.notes);
}

#[test]
fn draco_data_without_fallback_are_refused_by_extension_name() {
    let rest = |view: &str| {
        format!(
            r#""bufferViews": [{{ "buffer": 0, "byteLength": 48 }}],
                "extensionsUsed": ["KHR_draco_mesh_compression"],
            "accessors": [{{ {view} "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0],
                "max": [1, 1, 0] }}],
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "mode": 5,
                "extensions": {{ "KHR_draco_mesh_compression": {{ "bufferView": 0,
                    "attributes": {{ "POSITION": 0 }} }} }} }}] }}],
            "nodes": [{{ "mesh": 0 }}], "scenes": [{{ "nodes": [0] }}]"#
        )
    };
    let bytes = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    let error = model(&bytes, &rest(""), GltfOptions::default()).unwrap_err();
    assert!(error.contains("KHR_draco_mesh_compression") && error.contains("without compression"), "{error}");
    // With a fallback for readers without the extension.
    assert_eq!(
        corners(&model(&bytes, &rest(r#""bufferView": 0,"#), GltfOptions::default()).unwrap()).len(),
        2
    );
}
