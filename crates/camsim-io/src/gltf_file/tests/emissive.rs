//! Emissive textures with their own texture coordinates.

use super::*;

#[test]
fn emissive_texture_on_a_second_uv_set_is_shown_in_place() {
    let png = |pixels: [[u8; 3]; 2]| {
        let mut bytes = std::io::Cursor::new(Vec::new());
        image::RgbImage::from_raw(2, 1, pixels.concat())
            .unwrap()
            .write_to(&mut bytes, image::ImageFormat::Png)
            .unwrap();
        bytes.into_inner()
    };
    // The base colour is black on the left and blue on the right; the emissive texture red at the bottom and
    // black at the top.
    let pictures = [png([[0, 0, 0], [0, 0, 255]]), png([[255, 0, 0], [0, 0, 0]])];
    let positions = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    let first = floats(&[0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 1.0]);
    let second = floats(&[0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 1.0, 1.0]);
    let sampler = r#""samplers": [{ "magFilter": 9728, "wrapS": 33071, "wrapT": 33071 }]"#;
    let read = |second: &[u8], more: &str| {
        let mut bytes = [&positions[..], &first, second].concat();
        let [from, then] = [bytes.len(), bytes.len() + pictures[0].len()];
        bytes.extend(pictures.concat());
        let [a, b] = [pictures[0].len(), pictures[1].len()];
        let rest = format!(
            r#""bufferViews": [{{ "buffer": 0, "byteLength": 48 }}, {{ "buffer": 0, "byteOffset": 48,
                "byteLength": 32 }},
                {{ "buffer": 0, "byteOffset": 80, "byteLength": 32 }}, {{ "buffer": 0, "byteOffset": {from},
                    "byteLength": {a} }},
                {{ "buffer": 0, "byteOffset": {then}, "byteLength": {b} }}],
            "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3",
                "min": [0, 0, 0], "max": [1, 1, 0] }},
                {{ "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC2" }}, {{ "bufferView": 2,
                    "componentType": 5126, "count": 4, "type": "VEC2" }}],
            "images": [{{ "bufferView": 3, "mimeType": "image/png" }}, {{ "bufferView": 4,
                "mimeType": "image/png" }}], {sampler},
            "textures": [{{ "source": 0, "sampler": 0 }}, {{ "source": 1, "sampler": 0 }}],
            "materials": [{{ "name": "lamp",
                "pbrMetallicRoughness": {{ "baseColorTexture": {{ "index": 0 }} }},
                "emissiveFactor": [1, 1, 1], "emissiveTexture": {{ "index": 1, "texCoord": 1 }} {more} }}],
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0, "TEXCOORD_0": 1,
                "TEXCOORD_1": 2 }}, "mode": 5, "material": 0 }}] }}],
            "nodes": [{{ "mesh": 0 }}], "scenes": [{{ "nodes": [0] }}]"#
        );
        model(&bytes, &rest, GltfOptions::default()).unwrap()
    };
    let model = read(&second, "");
    assert!(model.notes.is_empty(), "{:?}", model.notes);
    let mesh = model.place(DVec3::ZERO, 0.0, 1.0).next().unwrap();
    // The colour in the middle of each quarter, far from the borders between texels.
    let color = |x: f32, y: f32| {
        let uv = |corner: usize| mesh.shape.vertices[corner].uv;
        let uv = [0, 1].map(|k: usize| uv(0)[k] + x * (uv(1)[k] - uv(0)[k]) + y * (uv(2)[k] - uv(0)[k]));
        let [w, h] = mesh.material.texture.size_px;
        let pixel = [(uv[0] * w as f32) as usize, (uv[1] * h as f32) as usize];
        let start = 4 * (pixel[1] * w as usize + pixel[0]);
        mesh.material.texture.rgba8[start..start + 3].to_vec()
    };
    assert_eq!(
        [color(0.25, 0.25), color(0.75, 0.25), color(0.25, 0.75), color(0.75, 0.75)],
        [[255, 0, 0], [255, 0, 255], [0, 0, 0], [0, 0, 255]]
    );
    // The emissive strength is baked too.
    let strength = read(
        &second,
        r#", "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 0.5 } }"#,
    );
    let mesh = strength.place(DVec3::ZERO, 0.0, 1.0).next().unwrap();
    let reddest = mesh.material.texture.rgba8.chunks_exact(4).map(|pixel| pixel[0]).max();
    assert_eq!(reddest, Some(188), "half of the light in sRGB");
    let strong = read(
        &second,
        r#", "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 5.0 } }"#,
    );
    let wanted = "clamped to 0 to 1; above white it needs a material without emissiveTexture";
    assert!(strong.notes.iter().any(|note| note.contains(wanted)), "{:?}", strong.notes);
}
