//! Extensions and properties that a reader without them would show otherwise: applied, refused or named.

use serde_json::{Value, json};

use super::{
    malformed::{good, png, with},
    *,
};

const EXTENSIONS: &str = "/materials/0/extensions";

fn notes(changes: &[(&str, Value)]) -> Vec<String> {
    with(changes).unwrap_or_else(|error| panic!("{changes:?}: {error}")).notes
}

#[test]
fn what_a_file_requires_and_is_not_done_is_refused_by_name() {
    for (name, fix) in [
        ("KHR_materials_transmission", "or take it out of extensionsRequired"),
        ("KHR_lights_punctual", "or take it out of extensionsRequired"),
        ("KHR_materials_variants", "or take it out of extensionsRequired"),
        ("KHR_animation_pointer", "or take it out of extensionsRequired"),
        ("EXT_texture_avif", "write its pictures as PNG or JPEG"),
        ("KHR_meshopt_compression", "write the file again without compression"),
        ("ACME_glow", "write the file again without it"),
    ] {
        let error = with(&[("/extensionsRequired", json!(["KHR_texture_transform", name]))]).unwrap_err();
        assert!(
            error.contains(&format!("needs the extension {name}, which is not supported"))
                && error.contains(fix),
            "{error}"
        );
    }
    let done = json!([
        "KHR_node_visibility",
        "KHR_materials_emissive_strength",
        "EXT_texture_webp",
        "KHR_xmp_json_ld",
        "EXT_mesh_features"
    ]);
    assert!(notes(&[("/extensionsRequired", done)]).is_empty());
}

#[test]
fn what_is_left_out_is_named_once_and_only_where_it_is() {
    let glass =
        json!({ "KHR_materials_transmission": { "transmissionFactor": 1 }, "KHR_materials_clearcoat": {} });
    let two = json!([{ "extensions": glass, "normalTexture": { "index": 0 } }, { "extensions": glass, "normalTexture": { "index": 0 } }]);
    assert_eq!(
        notes(&[
            ("/materials", two),
            ("/extensionsUsed", json!(["KHR_materials_transmission", "KHR_materials_sheen"]))
        ]),
        [
            "colour is albedo alone: KHR_materials_clearcoat, KHR_materials_transmission and normalTexture are left out"
        ]
    );
    // Listed, and nowhere.
    assert!(
        notes(&[("/extensionsUsed", json!(["KHR_materials_sheen", "KHR_lights_punctual", "ACME_glow"]))])
            .is_empty()
    );
    // There, and not listed.
    assert_eq!(
        notes(&[(EXTENSIONS, json!({ "ACME_glow": {} }))]),
        ["the extension ACME_glow is not known: what it adds is left out"]
    );
    let lamp = json!({ "KHR_lights_punctual": { "light": 0 } });
    assert_eq!(
        notes(&[("/nodes/0/extensions", lamp)]),
        ["KHR_lights_punctual is left out: lights are the scenario's"]
    );
    // What is anybody's own is no part of the model.
    assert!(notes(&[("/nodes/0/extras", json!({ "extensions": { "ACME_glow": {} } }))]).is_empty());
    let metal = json!({ "metallicFactor": 0.5, "baseColorTexture": { "index": 0 } });
    assert_eq!(
        notes(&[("/materials/0/pbrMetallicRoughness", metal.clone())]),
        ["colour is albedo alone: metallicFactor is left out"]
    );
    let unlit = json!([{ "pbrMetallicRoughness": metal, "normalTexture": { "index": 0 }, "extensions": { "KHR_materials_unlit": {} } }]);
    assert!(notes(&[("/materials", unlit)]).is_empty(), "what is unlit is not shaded");
    let more = json!({ "POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 3, "COLOR_1": 3 });
    let found = notes(&[("/meshes/0/primitives/0/attributes", more)]);
    assert!(found.len() == 1 && found[0].starts_with("meshes.0: COLOR_1 is left out"), "{found:?}");
    let targets = json!([{ "POSITION": 0, "COLOR_0": 3 }]);
    let found = notes(&[("/meshes/0/primitives/0/targets", targets)]);
    assert!(
        found.len() == 1 && found[0].starts_with("meshes.0: COLOR_0 of its morph targets is left out"),
        "{found:?}"
    );
}

#[test]
fn visibility_goes_down_the_tree_and_not_beside_it() {
    let hidden = json!({ "KHR_node_visibility": { "visible": false } });
    let shown = json!({ "KHR_node_visibility": { "visible": true } });
    let of = |parent: &Value, child: &Value| {
        let nodes = json!([{ "children": [1], "extensions": parent }, { "mesh": 0, "extensions": child }, { "mesh": 0 }]);
        with(&[("/nodes", nodes), ("/scenes", json!([{ "nodes": [0, 2] }]))]).unwrap().triangles()
    };
    assert_eq!(
        [
            of(&shown, &shown),
            of(&hidden, &shown),
            of(&shown, &hidden),
            of(&json!({ "KHR_node_visibility": {} }), &json!({}))
        ],
        [4, 2, 2, 4]
    );
    let nodes = json!([{ "mesh": 0, "extensions": hidden }]);
    let model = with(&[("/nodes", nodes), ("/scenes", json!([{ "nodes": [0] }]))]).unwrap();
    assert!(
        model.notes[0].contains("no triangles that are visible: KHR_node_visibility hides nodes.0"),
        "{:?}",
        model.notes
    );
    // A node that is within itself is no tree, seen or not.
    let nodes = json!([{ "children": [1], "extensions": hidden }, { "children": [1], "mesh": 0 }]);
    assert!(with(&[("/nodes", nodes)]).unwrap_err().contains("has two parents"));
}

#[test]
fn emitted_light_has_its_strength_and_more_than_white_is_white() {
    let of = |factor: f64, strength: f64| {
        let strength = json!({ "KHR_materials_emissive_strength": { "emissiveStrength": strength } });
        let model =
            with(&[("/materials/0/emissiveFactor", json!([factor, 0, 0])), (EXTENSIONS, strength)]).unwrap();
        let emissive = model.place(DVec3::ZERO, 0.0, 1.0).next().unwrap().material.emissive;
        (emissive, model.notes)
    };
    assert_eq!(of(0.25, 2.0), ([0.5, 0.0, 0.0], Vec::new()));
    // What is unlit has its base colour alone.
    let unlit = [
        ("/materials/0/emissiveFactor", json!([1, 1, 1])),
        (EXTENSIONS, json!({ "KHR_materials_unlit": {} })),
    ];
    assert_eq!(with(&unlit).unwrap().parts[0].material.emissive, [0.0; 3]);
    let (emissive, notes) = of(1.0, 5.0);
    assert_eq!(emissive, [1.0, 0.0, 0.0]);
    assert!(
        notes.len() == 1
            && notes[0].contains("materials.0: emissiveFactor times emissiveStrength is [5.0, 0.0, 0.0]"),
        "{notes:?}"
    );
}

#[test]
fn compressed_views_are_read_where_their_fallback_is_there() {
    let compressed = |buffer: u32| json!({ "buffer": buffer, "byteLength": 48, "extensions": { "EXT_meshopt_compression": { "buffer": 0, "byteLength": 9, "byteStride": 12, "count": 4 } } });
    assert_eq!(
        with(&[("/bufferViews/0", compressed(0))]).unwrap().triangles(),
        2,
        "the bytes are in the file"
    );
    let mut alone = good(&png(4, 4));
    alone.json["bufferViews"][0] = compressed(1);
    for buffer in [
        json!({ "byteLength": 48 }),
        json!({ "byteLength": 48, "extensions": { "EXT_meshopt_compression": { "fallback": true } } }),
    ] {
        alone.json["buffers"] = json!([alone.json["buffers"][0], buffer]);
        let error = alone.read().unwrap_err();
        assert!(error.contains("needs the extension EXT_meshopt_compression"), "{error}");
    }
    // Without the extension nothing says where its bytes are.
    alone.json["bufferViews"][0] = json!({ "buffer": 1, "byteLength": 48 });
    alone.json["buffers"][1] = json!({ "byteLength": 48 });
    let error = alone.read().unwrap_err();
    assert!(error.contains("buffers.1: has no uri, so that its bytes are nowhere"), "{error}");
    // Indices in a Draco buffer alone are as far away as corners.
    let mut draco = good(&png(4, 4));
    draco.json["accessors"][2].as_object_mut().unwrap().remove("bufferView");
    draco.json["meshes"][0]["primitives"][0]["extensions"] =
        json!({ "KHR_draco_mesh_compression": { "bufferView": 0, "attributes": {} } });
    assert!(draco.read().unwrap_err().contains("KHR_draco_mesh_compression"));
}

#[test]
fn accessors_without_a_view_are_zeros_with_what_is_sparse_in_them() {
    let mut empty = good(&png(4, 4));
    let positions = empty.json["accessors"][0].as_object_mut().unwrap();
    positions.remove("bufferView");
    // Corner 1 alone is elsewhere: that of the second row of the file's own positions.
    positions.insert(
        "sparse".into(),
        json!({ "count": 1, "indices": { "bufferView": 2, "byteOffset": 2, "componentType": 5123 }, "values": { "bufferView": 0, "byteOffset": 12 } }),
    );
    let model = empty.read().unwrap();
    let shape = &model.parts[0].shape;
    let at: Vec<[f32; 3]> = shape.vertices.iter().map(|vertex| vertex.position_m).collect();
    assert_eq!(at, [[0.0; 3], [2.0, 0.0, 0.0], [0.0; 3], [0.0; 3]]);
    assert!(model.notes.is_empty());
    let huge = json!({ "componentType": 5126, "count": 4_000_000_000_u64, "type": "VEC2" });
    let error = with(&[("/accessors/1", huge)]).unwrap_err();
    assert!(error.contains("accessors.1: has 4000000000 elements and no bufferView"), "{error}");
}

#[test]
fn channels_that_move_no_node_are_left_out_and_counted() {
    let target = |target: Value| json!({ "sampler": 0, "target": target });
    let pointer = json!({ "path": "pointer", "extensions": { "KHR_animation_pointer": { "pointer": "/materials/0/alphaCutoff" } } });
    let channels = json!([
        target(json!({ "node": 0, "path": "translation" })),
        target(pointer),
        target(json!({ "path": "scale" }))
    ]);
    let sampler = json!([{ "input": 4, "output": 0 }]);
    let mut moved = good(&png(4, 4));
    moved.json["animations"] = json!([{ "channels": channels, "samplers": sampler }]);
    // Four instants out of the texture coordinates: 0, 0, 1, 0 ascend enough to be times.
    moved.json["accessors"]
        .as_array_mut()
        .unwrap()
        .push(json!({ "bufferView": 0, "componentType": 5126, "count": 4, "type": "SCALAR", "min": [0], "max": [2] }));
    let notes = moved.read().unwrap().notes;
    assert_eq!(
        notes,
        [
            "KHR_animation_pointer is left out: animations move nodes, skins and morph targets",
            "animations.0: 2 of its 3 channels move no node and are left out"
        ]
    );
}

#[test]
fn webp_is_read_in_place_of_what_is_beside_it() {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbImage::from_pixel(6, 5, image::Rgb([10, 200, 30]))
        .write_to(&mut bytes, image::ImageFormat::WebP)
        .unwrap();
    let mut model = good(&bytes.into_inner());
    model.json["images"] = json!([{ "uri": "none.png" }, { "bufferView": 4, "mimeType": "image/webp" }]);
    for texture in [json!({ "source": 0 }), json!({})] {
        let mut texture = texture;
        texture["extensions"] = json!({ "EXT_texture_webp": { "source": 1 } });
        model.json["textures"] = json!([texture]);
        let found = model.read().unwrap();
        let texture = &found.parts[0].material.texture;
        assert_eq!(
            (texture.size_px, &texture.rgba8[..4], found.notes.len()),
            ([6, 5], &[10, 200, 30, 255][..], 0)
        );
    }
}

#[test]
fn instances_with_attributes_of_different_length_are_refused() {
    let mut many = good(&png(4, 4));
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
fn light_that_cannot_be_brought_together_names_its_material() {
    // Base colour and light are laid by one set, of which the light sees twice as much.
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
    let mut model = good(picture.get_ref());
    for (pointer, value) in emits {
        model.json["materials"][0][pointer.rsplit('/').next().unwrap()] = value;
    }
    let found = model.read().unwrap();
    assert!(found.notes.is_empty(), "{:?}", found.notes);
    assert_ne!(found.parts[0].material.texture.size_px, [8, 8], "brought together");
    // The base colour of the second triangle is that of the first one, and the light of both lies in another
    // way on each.
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
    let found = model.read().unwrap();
    let named = found.notes.len() == 1
        && found.notes[0].starts_with("materials.0 (lamp): its picture of emitted light is left out");
    assert!(named && found.parts[0].material.texture.size_px == [8, 8], "{:?}", found.notes);
}

#[test]
fn notes_of_real_models_are_few_and_tell_of_what_is_in_them() {
    let Some(data) = data() else { return };
    let known = [
        "colour is albedo alone: ",
        "has animations, and no time_s",
        "points and lines are not shown",
        "has no triangles",
        "has no scene",
    ];
    for path in all_models(&data) {
        let Ok(model) = read_gltf(&path, GltfOptions::default()) else { continue };
        eprintln!("{}: {} triangles, {:?}", path.display(), model.triangles(), model.notes);
        assert!(model.notes.len() <= 2, "{}: {:?}", path.display(), model.notes);
        assert!(
            model.notes.iter().all(|note| known.iter().any(|known| note.starts_with(known))),
            "{}: {:?}",
            path.display(),
            model.notes
        );
    }
}
