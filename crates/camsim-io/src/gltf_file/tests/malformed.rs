//! A good model with one thing wrong: each has one message that names the file, the place, and what to do.

use serde_json::{Value, json};

use super::*;

/// A square with a picture, vertex colours and indices, in one buffer.
pub(super) struct Good {
    pub json: Value,
    pub bytes: Vec<u8>,
}

pub(super) fn png(width: u32, height: u32) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    image::RgbImage::new(width, height).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

pub(super) fn good(picture: &[u8]) -> Good {
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
        "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0, "TEXCOORD_0": 1, "COLOR_0": 3 }, "indices": 2, "material": 0 }] }],
        "materials": [{ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } }],
        "textures": [{ "source": 0 }], "images": [{ "bufferView": 4, "mimeType": "image/png" }],
        "accessors": [positions, accessor(1, 5126, 4, "VEC2"), accessor(2, 5123, 6, "SCALAR"), colors],
        "bufferViews": views, "buffers": [{ "byteLength": bytes.len(), "uri": "a.bin" }],
    });
    Good { json, bytes }
}

impl Good {
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

/// Reads the good model with `value` at each of these places; null takes out what is there.
pub(super) fn with(changes: &[(&str, Value)]) -> Result<Model, String> {
    let mut good = good(&png(4, 4));
    for (pointer, value) in changes {
        let (parent, key) = pointer.rsplit_once('/').unwrap();
        let parent = good.json.pointer_mut(parent).unwrap();
        match (parent, value) {
            (Value::Object(map), Value::Null) => drop(map.remove(key)),
            (Value::Object(map), value) => drop(map.insert(key.to_owned(), value.clone())),
            (Value::Array(list), value) => list[key.parse::<usize>().unwrap()] = value.clone(),
            _ => panic!("{pointer} is nothing"),
        }
    }
    good.read()
}

const PRIMITIVE: &str = "/meshes/0/primitives/0";

#[test]
fn the_good_one_is_read() {
    let model = with(&[]).unwrap();
    assert_eq!((model.triangles(), &model.notes[..]), (2, &[][..]));
}

#[test]
fn numbers_that_mean_nothing_are_refused() {
    let at = |accessor: u32, key: &str| format!("/accessors/{accessor}/{key}");
    for (pointer, value, wanted) in [
        (at(0, "type"), json!("SCALAR"), "accessors.0 is of Scalar, which is nothing for POSITION"),
        (at(0, "type"), json!("VEC4"), "accessors.0 is of Vec4, which is nothing for POSITION"),
        (at(1, "type"), json!("VEC3"), "accessors.1 is of Vec3, which is nothing for TEXCOORD_0"),
        (at(3, "type"), json!("MAT2"), "accessors.3 is of Mat2, which is nothing for COLOR_0"),
        (at(2, "componentType"), json!(5120), "accessors.2 is of Scalar of I8: indices are whole numbers"),
        (at(2, "componentType"), json!(5126), "accessors.2 is of Scalar of F32: indices are whole numbers"),
        (at(2, "type"), json!("VEC2"), "accessors.2 is of Vec2 of U16: indices are whole numbers"),
        ("/nodes/0/translation".into(), json!([1e30, 0, 0]), "nodes.0: with it meshes.0 reaches 1.0e30 m"),
        ("/nodes/0/scale".into(), json!([1e12, 1, 1]), "more than 1e9: check its positions, and translation"),
        ("/nodes/0/matrix".into(), json!([1e39].repeat(16)), "nodes.0: with it meshes.0 reaches NaN m"),
    ] {
        let error = with(&[(&pointer, value)]).unwrap_err();
        assert!(
            error.contains(wanted) && error.contains("model.gltf"),
            "{pointer}\n  gives {error}\n  not   {wanted}"
        );
    }
    let turned = json!({ "EXT_mesh_gpu_instancing": { "attributes": { "ROTATION": 4 } } });
    let zeros =
        json!({ "bufferView": 2, "byteOffset": 0, "componentType": 5121, "count": 1, "type": "VEC4" });
    let mut good = good(&png(4, 4));
    good.json["nodes"][0]["extensions"] = turned;
    good.json["accessors"].as_array_mut().unwrap().push(zeros);
    good.bytes[80..84].fill(0);
    assert!(good.read().unwrap_err().contains("reaches NaN m"));
}

#[test]
fn what_is_not_there_is_named_with_its_place() {
    let pictures = json!([{ "uri": "none.png" }]);
    let channel = json!([{ "channels": [{ "sampler": 0, "target": { "node": 9, "path": "scale" } }], "samplers": [{ "input": 2, "output": 0 }] }]);
    let compressed = json!([{ "extensions": { "KHR_texture_basisu": { "source": 0 } } }]);
    for (changes, wanted) in [
        (vec![("/buffers/0/uri", json!("none.bin"))], "model.gltf: buffers.0: its file"),
        (vec![("/buffers/0/uri", json!("none.bin"))], "none.bin cannot be read"),
        (vec![("/images", pictures)], "model.gltf: images.0: its file"),
        (vec![("/buffers/0/uri", json!(""))], "model.gltf: buffers.0: its uri is no name of a file"),
        (
            vec![("/animations", channel)],
            "model.gltf: animations.0.channels.0: moves node 9, but there are 1",
        ),
        (
            vec![("/textures", compressed)],
            "needs the extension KHR_texture_basisu, which is not supported: write its pictures as PNG",
        ),
        (
            vec![("/asset", json!({ "version": "2.0", "minVersion": "2.9" }))],
            "needs glTF 2.9 (asset.minVersion)",
        ),
        (vec![("/asset", Value::Null)], "has no asset.version"),
        (
            vec![("/nodes/0/mesh", json!(5))],
            "is not valid: nodes[0].mesh names what is not there; write the file again",
        ),
        (
            vec![("/bufferViews/4/byteLength", json!(0))],
            "images.0: cannot be decoded as PNG, JPEG or WebP: it has no bytes",
        ),
    ] {
        let error = with(&changes).unwrap_err();
        assert!(error.contains(wanted), "{changes:?}\n  gives {error}\n  not   {wanted}");
    }
    // What is wrong in many places is told of some.
    let mut many = good(&png(4, 4));
    let mut primitive = many.json.pointer(PRIMITIVE).unwrap().clone();
    primitive["material"] = json!(7);
    many.json["meshes"][0]["primitives"] = vec![primitive; 300].into();
    let error = many.read().unwrap_err();
    assert!(error.contains("primitives[2].material names what is not there, and 297 more; write"), "{error}");
    assert!(error.len() < 400, "{error}");
}

#[test]
fn a_set_of_coordinates_that_is_not_there_is_noted() {
    let model = with(&[("/materials/0/pbrMetallicRoughness/baseColorTexture/texCoord", json!(5))]).unwrap();
    assert_eq!(
        model.notes,
        ["meshes.0: has no TEXCOORD_5 for its picture to lie by: one texel of it is all over"]
    );
}

#[test]
fn pictures_of_any_size_are_shown_or_named() {
    let of = |width: u32, height: u32| good(&png(width, height)).read();
    assert!(of(16_384, 1).unwrap().notes.is_empty());
    let notes = of(20_000, 1).unwrap().notes;
    assert!(
        notes.len() == 1
            && notes[0].contains("images.0: is of 20000x1 px")
            && notes[0].contains("at most 16384"),
        "{notes:?}"
    );
    let error = of(40_000, 1).unwrap_err();
    assert!(
        error.contains("model.gltf: images.0: is of 40000x1 px, and at most 32768 on a side can be shown"),
        "{error}"
    );
    let mut claims = png(4, 4);
    claims[16..24].copy_from_slice(&[0, 0, 0xea, 0x60, 0, 0, 0xea, 0x60]);
    assert!(good(&claims).read().unwrap_err().contains("images.0: "));
    for bytes in [&b"hello"[..], b"\xabKTX 20\xbb\r\n\x1a\n", &png(4, 4)[..40]] {
        let error = good(bytes).read().unwrap_err();
        assert!(error.contains("images.0: cannot be decoded as PNG, JPEG or WebP: "), "{error}");
    }
}

#[test]
fn a_byte_order_mark_is_skipped_and_an_empty_file_is_empty() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("model.gltf");
    std::fs::write(&path, b"\xef\xbb\xbf{ \"asset\": { \"version\": \"2.0\" } }").unwrap();
    assert_eq!(read_gltf(&path, GltfOptions::default()).unwrap().triangles(), 0);
    std::fs::write(&path, b"").unwrap();
    assert!(
        read_gltf(&path, GltfOptions::default()).unwrap_err().to_string().ends_with("model.gltf: is empty")
    );
}
