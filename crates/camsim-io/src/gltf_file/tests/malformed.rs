//! A valid model with one defect each: the message names the file, the JSON path and a remedy.

use serde_json::{Value, json};

use super::*;

/// A square with a texture, vertex colours and indices, in one buffer.
pub(super) struct ModelFile {
    pub json: Value,
    pub bytes: Vec<u8>,
}

pub(super) fn png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(width, height).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

pub(super) fn valid_model(picture: &[u8]) -> ModelFile {
    let parts = [
        floats(&[0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 2.0, 0.0, 2.0, 2.0, 0.0]),
        floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0]),
        vec![0, 0, 1, 0, 2, 0, 1, 0, 3, 0, 2, 0],
        [255, 0, 0, 255].repeat(4),
        picture.to_vec(),
    ];
    let mut bytes = Vec::new();
    let mut views = Vec::new();
    for part in parts {
        views.push(json!({ "buffer": 0, "byteOffset": bytes.len(), "byteLength": part.len() }));
        bytes.extend(part);
    }
    let accessor = |view: u32, component: u32, count: u32, kind: &str| json!({ "bufferView": view, "componentType": component, "count": count, "type": kind });
    let mut positions = accessor(0, 5126, 4, "VEC3");
    (positions["min"], positions["max"]) = (json!([0, 0, 0]), json!([2, 2, 0]));
    let mut colors = accessor(3, 5121, 4, "VEC4");
    colors["normalized"] = json!(true);
    let json = json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }], "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 3 },
            "indices": 2, "material": 0 }] }],
        "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "textures": [{ "source": 0 }], "images": [{ "bufferView": 4, "mimeType": "image/png" }],
        "accessors": [positions, accessor(1, 5126, 4, "VEC2"), accessor(2, 5123, 6, "SCALAR"), colors],
        "bufferViews": views, "buffers": [{ "byteLength": bytes.len(), "uri": "a.bin" }],
    });
    ModelFile { json, bytes }
}

impl ModelFile {
    pub fn read(&self) -> Result<Model, String> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("a.bin"), &self.bytes).unwrap();
        let path = folder.path().join("model.gltf");
        std::fs::write(&path, self.json.to_string()).unwrap();
        let options =
            GltfOptions { time_s: self.json.get("animations").map(|_| 0.5), ..GltfOptions::default() };
        read_gltf(&path, options).map_err(|error| error.to_string())
    }
}

/// Reads the valid model with `value` at each of these JSON pointers; null removes the element.
pub(super) fn read_with(changes: &[(&str, Value)]) -> Result<Model, String> {
    let mut good = valid_model(&png(4, 4));
    for (pointer, value) in changes {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = good.json.pointer_mut(parent).unwrap();
        match (parent, value) {
            (Value::Object(map), Value::Null) => drop(map.remove(key)),
            (Value::Object(map), value) => drop(map.insert(key.to_owned(), value.clone())),
            (Value::Array(list), value) => list[key.parse::<usize>().unwrap()] = value.clone(),
            _ => panic!("{pointer} does not exist"),
        }
    }
    good.read()
}

const PRIMITIVE: &str = "/meshes/0/primitives/0";

#[test]
fn valid_model_is_read() {
    let model = read_with(&[]).unwrap();
    assert_eq!((model.triangles(), &model.notes[..]), (2, &[][..]));
}

#[test]
fn invalid_types_and_transforms_are_refused() {
    let pointer = |accessor: u32, key: &str| format!("/accessors/{accessor}/{key}");
    for (pointer, value, wanted) in [
        (pointer(0, "type"), json!("SCALAR"), "accessors.0 has type Scalar, which POSITION cannot have"),
        (pointer(0, "type"), json!("VEC4"), "accessors.0 has type Vec4, which POSITION cannot have"),
        (pointer(1, "type"), json!("VEC3"), "accessors.1 has type Vec3, which TEXCOORD_0 cannot have"),
        (pointer(3, "type"), json!("MAT2"), "accessors.3 has type Mat2, which COLOR_0 cannot have"),
        (pointer(2, "componentType"), json!(5120), "accessors.2 has type Scalar of I8: indices must be"),
        (pointer(2, "componentType"), json!(5126), "accessors.2 has type Scalar of F32: indices must be"),
        (pointer(2, "type"), json!("VEC2"), "accessors.2 has type Vec2 of U16: indices must be"),
        (
            "/nodes/0/translation".into(),
            json!([1e30, 0, 0]),
            "nodes.0: places points of meshes.0 1.0e30 m from",
        ),
        (
            "/nodes/0/scale".into(),
            json!([1e12, 1, 1]),
            "more than 1e9 m: check the mesh's positions and the translation",
        ),
        ("/nodes/0/matrix".into(), json!([1e39].repeat(16)), "nodes.0: places points of meshes.0 NaN m from"),
    ] {
        let error = read_with(&[(&pointer, value)]).unwrap_err();
        assert!(
            error.contains(wanted) && error.contains("model.gltf"),
            "{pointer}\n  gives {error}\n  not   {wanted}"
        );
    }
    let turned = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "ROTATION": 4 } } });
    let zeros =
        json!({ "bufferView": 2, "byteOffset": 0, "componentType": 5121, "count": 1, "type": "VEC4" });
    let mut good = valid_model(&png(4, 4));
    good.json["nodes"][0]["extensions"] = turned;
    good.json["accessors"].as_array_mut().unwrap().push(zeros);
    good.bytes[80..84].fill(0);
    assert!(good.read().unwrap_err().contains("meshes.0 NaN m from"));
}

#[test]
fn missing_elements_and_files_are_reported_with_their_json_path() {
    let pictures = json!([{ "uri": "none.png" }]);
    let channel = json!([{ "channels": [{ "sampler": 0, "target": { "node": 9, "path": "scale" } }],
        "samplers": [{ "input": 2, "output": 0 }] }]);
    let compressed = json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }]);
    for (changes, wanted) in [
        (vec![("/buffers/0/uri", json!("none.bin"))], "model.gltf: buffers.0: its file"),
        (vec![("/buffers/0/uri", json!("none.bin"))], "none.bin cannot be read"),
        (vec![("/images", pictures)], "model.gltf: images.0: its file"),
        (vec![("/buffers/0/uri", json!(""))], "model.gltf: buffers.0: its uri is not a file name"),
        (
            vec![("/animations", channel)],
            "model.gltf: animations.0.channels.0: moves node 9, but there are 1",
        ),
        (
            vec![("/textures", compressed)],
            "needs the extension KHR_texture_basisu, which is not supported: export its images as PNG",
        ),
        (
            vec![("/asset", json!({ "version": "2.0", "minVersion": "2.9" }))],
            "needs glTF 2.9 (asset.minVersion)",
        ),
        (vec![("/asset", Value::Null)], "has no asset.version"),
        (
            vec![("/nodes/0/mesh", json!(5))],
            "is not valid: nodes[0].mesh refers to an element that does not exist; export the file again",
        ),
        (
            vec![("/bufferViews/4/byteLength", json!(0))],
            "images.0: cannot be decoded as PNG, JPEG or WebP: it has no bytes",
        ),
    ] {
        let error = read_with(&changes).unwrap_err();
        assert!(error.contains(wanted), "{changes:?}\n  gives {error}\n  not   {wanted}");
    }
    // An error that occurs at many locations is listed for some.
    let mut many = valid_model(&png(4, 4));
    let mut primitive = many.json.pointer(PRIMITIVE).unwrap().clone();
    primitive["material"] = json!(7);
    many.json["meshes"][0]["primitives"] = vec![primitive; 300].into();
    let error = many.read().unwrap_err();
    assert!(
        error.contains(
            "primitives[2].material refers to an element that does not exist, and 297 more; export"
        ),
        "{error}"
    );
    assert!(error.len() < 450, "{error}");
}

#[test]
fn missing_uv_set_is_noted() {
    let model =
        read_with(&[("/materials/0/pbrMetallicRoughness/baseColorTexture/texCoord", json!(5))]).unwrap();
    assert_eq!(
        model.notes,
        ["meshes.0: has no TEXCOORD_5 for its texture: one texel covers the whole surface"]
    );
}

#[test]
fn large_images_are_noted_and_too_large_ones_refused() {
    let model = |width: u32, height: u32| valid_model(&png(width, height)).read();
    assert!(model(16_384, 1).unwrap().notes.is_empty());
    let notes = model(20_000, 1).unwrap().notes;
    assert!(
        notes.len() == 1
            && notes[0].contains("images.0: has 20000x1 px")
            && notes[0].contains("at most 16384"),
        "{notes:?}"
    );
    let error = model(40_000, 1).unwrap_err();
    assert!(
        error.contains("model.gltf: images.0: has 40000x1 px, but a side can have at most 32768"),
        "{error}"
    );
    let mut claims = png(4, 4);
    claims[16..24].copy_from_slice(&[0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]);
    assert!(valid_model(&claims).read().unwrap_err().contains("images.0: "));
    for bytes in [&b"hello"[..], b"\xabKTX 20\xbb\r\n\x1a\n", &png(4, 4)[..40]] {
        let error = valid_model(bytes).read().unwrap_err();
        assert!(error.contains("images.0: cannot be decoded as PNG, JPEG or WebP: "), "{error}");
    }
}

#[test]
fn byte_order_mark_is_skipped_and_empty_file_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.gltf");
    std::fs::write(&path, b"\xef\xbb\xbf{ \"asset\": { \"version\": \"2.0\" } }").unwrap();
    assert_eq!(read_gltf(&path, GltfOptions::default()).unwrap().triangles(), 0);
    std::fs::write(&path, b"").unwrap();
    assert!(
        read_gltf(&path, GltfOptions::default()).unwrap_err().to_string().ends_with("model.gltf: is empty")
    );
}

#[test]
fn errors_name_the_file_and_the_cause() {
    let wrong = |more: &str, nodes: &str| square(4, more, nodes).unwrap_err();
    for (message, wanted) in [
        (wrong(r#", "indices": 7"#, r#"{ "mesh": 0 }"#), "is not valid"),
        (wrong("", r#"{ "mesh": 0, "children": [0] }"#), "nodes.0: has two parents"),
        (wrong("", r#"{ "mesh": 0, "children": [1] }, { "children": [0] }"#), "has two parents"),
        (wrong("", r#"{ "mesh": 9 }"#), "is not valid"),
        (
            square(
                4,
                r#" }] }], "extensionsRequired": ["KHR_draco_mesh_compression"], "x": [{ "y": [{ "z": 1"#,
                r#"{ "mesh": 0 }"#,
            )
            .unwrap_err(),
            "KHR_draco_mesh_compression, which is not supported: export the file without compression",
        ),
        (
            model(b"", r#""extensionsRequired": ["EXT_meshopt_compression"]"#, GltfOptions::default())
                .unwrap_err(),
            "EXT_meshopt_compression",
        ),
        (
            model(b"", r#""extensionsRequired": ["KHR_texture_basisu"]"#, GltfOptions::default())
                .unwrap_err(),
            "PNG or JPEG",
        ),
        (
            model(
                b"",
                r#""scenes": [{ "nodes": [] }]"#,
                GltfOptions { scene: Some(2), ..GltfOptions::default() },
            )
            .unwrap_err(),
            "no scene 2",
        ),
    ] {
        assert!(message.contains(wanted) && message.contains("model.gltf"), "{message}");
    }
    assert!(
        read_gltf(Path::new("/none/such.glb"), GltfOptions::default())
            .unwrap_err()
            .to_string()
            .contains("such.glb: cannot be read")
    );
}
