#![allow(clippy::unwrap_used, reason = "tests")]

use camsim_core::scene::{MeshVertex, light::transformed_normal};
use glam::DVec2;

use super::*;

mod emitted_light;
mod extensions;
mod malformed;

fn data() -> Option<PathBuf> {
    let found = std::env::var_os("CAMSIM_DATA").map(|data| PathBuf::from(data).join("gltf"));
    if found.is_none() {
        eprintln!("CAMSIM_DATA is not set: models of other people are not read");
    }
    found
}

/// A file of one buffer, written out; `rest` is what follows `"asset"`.
fn model(bytes: &[u8], rest: &str, options: GltfOptions) -> Result<Model, String> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a b.bin"), bytes).unwrap();
    let path = folder.path().join("model.gltf");
    let buffers = format!("\"buffers\": [{{ \"byteLength\": {}, \"uri\": \"a%20b.bin\" }}]", bytes.len());
    std::fs::write(
        &path,
        format!("{{ \"asset\": {{ \"version\": \"2.0\" }}, \"scene\": 0, {buffers}, {rest} }}"),
    )
    .unwrap();
    read_gltf(&path, options).map_err(|error| error.to_string())
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// A square of four corners, (0, 0) to (1, 1), as `mode`; `more` follows the primitive.
fn square(mode: u32, more: &str, nodes: &str) -> Result<Model, String> {
    square_with(mode, more, nodes, GltfOptions::default())
}

fn square_with(mode: u32, more: &str, nodes: &str, options: GltfOptions) -> Result<Model, String> {
    let bytes = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    let rest = format!(
        r#""bufferViews": [{{ "buffer": 0, "byteLength": 48 }}],
        "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }}],
        "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "mode": {mode} {more} }}] }}],
        "nodes": [{nodes}], "scenes": [{{ "nodes": [0] }}]"#
    );
    model(&bytes, &rest, options)
}

/// Corners of a placed model, north-east-down, triangle by triangle.
fn corners(model: &Model) -> Vec<[DVec3; 3]> {
    let of = |mesh: Mesh| {
        mesh.shape
            .indices
            .chunks_exact(3)
            .map(|t| [t[0], t[1], t[2]].map(|v| mesh.position_ned_m(v)))
            .collect::<Vec<_>>()
    };
    model.place(DVec3::ZERO, 0.0, 1.0).flat_map(of).collect()
}

#[test]
fn strips_and_fans_turn_one_way() {
    let turns =
        |model: &Model| corners(model).iter().map(|[a, b, c]| (*b - *a).cross(*c - *a)).collect::<Vec<_>>();
    let strip = turns(&square(5, "", r#"{ "mesh": 0 }"#).unwrap());
    assert_eq!(strip.len(), 2);
    // They look along z, which is ahead: north.
    assert!(strip.iter().all(|turn| turn.distance(DVec3::X) < 1e-12), "{strip:?}");
    let fan = turns(&square(6, "", r#"{ "mesh": 0 }"#).unwrap());
    assert_eq!((fan.len(), fan[0].distance(DVec3::X) < 1e-12), (2, true));
    let lines = square(1, "", r#"{ "mesh": 0 }"#).unwrap();
    assert_eq!((lines.triangles(), lines.notes.len()), (0, 2));
}

#[test]
fn a_time_without_an_animation_is_noted() {
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
fn what_is_mirrored_keeps_its_outside() {
    let mirrored = square(5, "", r#"{ "mesh": 0, "scale": [1, 1, -2] }"#).unwrap();
    for [a, b, c] in corners(&mirrored) {
        assert!((b - a).cross(c - a).normalize().distance(-DVec3::X) < 1e-12);
    }
    // Its neighbour, which is not, shares none of its triangles.
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
fn a_model_stands_with_its_front_to_its_heading() {
    let square = square(5, "", r#"{ "mesh": 0, "translation": [1, 2, 3] }"#).unwrap();
    let at = |heading_deg: f64| {
        let mesh =
            square.place(DVec3::new(10.0, 20.0, 30.0), f64::to_radians(heading_deg), 2.0).next().unwrap();
        mesh.position_ned_m(0)
    };
    // Left, up, ahead of the origin, twice as large.
    assert!(at(0.0).distance(DVec3::new(16.0, 18.0, 26.0)) < 1e-12, "{}", at(0.0));
    assert!(at(90.0).distance(DVec3::new(12.0, 26.0, 26.0)) < 1e-12, "{}", at(90.0));
}

#[test]
fn files_that_need_more_or_are_wrong_are_named() {
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
            "KHR_draco_mesh_compression, which is not supported: write the file again without compression",
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

#[test]
fn malformed_files_of_other_people_are_refused() {
    let Some(data) = data() else { return };
    for name in [
        "integer-out-of-bounds",
        "invalid-buffer-index",
        "invalid-buffer-view-index",
        "invalid-primitive-indices",
    ] {
        let error = read_gltf(&data.join(format!("tinygltf_regression/{name}.gltf")), GltfOptions::default())
            .unwrap_err()
            .to_string();
        eprintln!("{error}");
        assert!(error.contains(name), "{error}");
    }
    for (name, triangles) in [
        ("tinygltf_regression/box01.glb", 12),
        ("tinygltf_regression/unassigned-skeleton.gltf", 8),
        ("trimesh/empty_nodes.glb", 0),
        ("trimesh/cubevc.glb", 48),
    ] {
        let model = read_gltf(&data.join(name), GltfOptions::default()).unwrap();
        assert_eq!(model.triangles(), triangles, "{name}");
    }
}

fn all_models(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let is_model = path.extension().is_some_and(|ending| ending == "gltf" || ending == "glb");
        if path.is_dir() {
            found.extend(all_models(&path));
        } else if is_model {
            found.push(path);
        }
    }
    found.sort();
    found
}

#[test]
fn nothing_panics_on_damaged_files() {
    let Some(data) = data() else { return };
    let folder = tempfile::tempdir().unwrap();
    let mut state = 1_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    let (mut read, mut refused) = (0, 0);
    for path in all_models(&data) {
        let bytes = std::fs::read(&path).unwrap();
        if bytes.len() > 100_000 {
            continue;
        }
        let damaged = folder.path().join(path.file_name().unwrap());
        for round in 0..40 {
            let mut bytes = bytes.clone();
            if round % 4 == 0 {
                bytes.truncate(random() % bytes.len());
            }
            for _ in 0..1 + round % 8 {
                let at = random() % bytes.len().max(1);
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << (random() % 8);
                }
            }
            std::fs::write(&damaged, &bytes).unwrap();
            match read_gltf(&damaged, GltfOptions { time_s: Some(0.3), ..GltfOptions::default() }) {
                Ok(_) => read += 1,
                Err(_) => refused += 1,
            }
        }
    }
    eprintln!("{read} damaged files read, {refused} refused");
    assert!(read > 50 && refused > 200);
}

#[test]
fn models_of_other_people_have_the_size_that_they_say() {
    let Some(data) = data() else { return };
    let size = |name: &str, time_s: Option<f64>| {
        let model = read_gltf(&data.join(name), GltfOptions { time_s, ..GltfOptions::default() }).unwrap();
        let points: Vec<DVec3> = corners(&model).into_iter().flatten().collect();
        let low = points.iter().fold(DVec3::INFINITY, |low, point| low.min(*point));
        points.iter().fold(DVec3::NEG_INFINITY, |high, point| high.max(*point)) - low
    };
    // Sides of one metre; the same box in four ways of storing it.
    for name in [
        "Box/glTF-Binary/Box.glb",
        "Box/glTF-Embedded/Box.gltf",
        "BoxInterleaved/glTF/BoxInterleaved.gltf",
        "BoxTextured/glTF/BoxTextured.gltf",
    ] {
        assert!(size(name, None).distance(DVec3::ONE) < 1e-6, "{name}: {}", size(name, None));
    }
    // The quantised file is the same cube, to the step of its numbers: weights in bytes move a corner by 2 m
    // / 255 at most.
    let [cube, quantised] = ["glTF-Binary/AnimatedMorphCube.glb", "glTF-Quantized/AnimatedMorphCube.gltf"]
        .map(|name| format!("AnimatedMorphCube/{name}"));
    for time_s in [None, Some(0.0), Some(1.3), Some(9.0)] {
        let (a, b) = (size(&cube, time_s), size(&quantised, time_s));
        assert!(a.distance(b) < 2.0 / 255.0, "{time_s:?}: {a} {b}");
    }
    assert!(
        size(&cube, Some(1.3)).distance(size(&cube, Some(0.0))) > 0.01 * size(&cube, None).length(),
        "it changes"
    );
    // The truck is some 4.8 m long; a fox of 140 units.
    let truck = size("CesiumMilkTruck/glTF-Binary/CesiumMilkTruck.glb", None);
    assert!((4.0..6.0).contains(&truck.max_element()), "{truck}");
    let fox = size("Fox/glTF-Binary/Fox.glb", Some(0.0));
    assert!((100.0..200.0).contains(&fox.max_element()), "{fox}");
    // Eight instances of a box at the corners of a larger one.
    let many =
        read_gltf(&data.join("SimpleInstancing/glTF/SimpleInstancing.gltf"), GltfOptions::default()).unwrap();
    assert!(many.triangles() > 12 && many.triangles().is_multiple_of(12), "{}", many.triangles());
    let meshes: Vec<Mesh> = many.place(DVec3::ZERO, 0.0, 1.0).collect();
    assert!(
        meshes.iter().all(|mesh| Arc::ptr_eq(&mesh.shape, &meshes[0].shape)),
        "instances share their triangles"
    );
}

#[test]
fn texture_coordinates_are_turned_as_their_extension_says() {
    let rule = |rotation: f64, offset: [f64; 2], scale: [f64; 2]| material::UvRule {
        set: 0,
        offset,
        rotation,
        scale,
        factor: [1.0; 4],
        vertex_colors: true,
        loses_colors: false,
        takes_light: true,
    };
    let at = |rule: material::UvRule, uv: [f64; 2]| DVec2::from_array(rule.apply(uv).map(f64::from));
    assert!(at(rule(0.0, [0.5, -0.25], [2.0, 3.0]), [0.1, 0.2]).distance(DVec2::new(0.7, 0.35)) < 1e-6);
    // A quarter anticlockwise as one sees it, where v goes down: u becomes -v.
    assert!(
        at(rule(std::f64::consts::FRAC_PI_2, [0.0; 2], [1.0; 2]), [1.0, 0.0]).distance(DVec2::new(0.0, -1.0))
            < 1e-6
    );
}

const WITH_NORMALS: GltfOptions = GltfOptions { normals: true, scene: None, time_s: None, animation: None };

/// Normals of a model's corners as it stands.
fn standing(model: &Model, heading_rad: f64) -> Vec<DVec3> {
    let of = |mesh: Mesh| {
        let turned = |normal: &[f32; 3]| {
            transformed_normal(&mesh.ned_from_shape, DVec3::from_array(normal.map(f64::from)))
        };
        mesh.shape.normals.iter().map(turned).collect::<Vec<_>>()
    };
    model.place(DVec3::ZERO, heading_rad, 2.0).flat_map(of).collect()
}

#[test]
fn flat_triangles_look_where_they_turn_to() {
    let quarter = std::f64::consts::FRAC_PI_2;
    for (nodes, heading_rad, expected) in [
        (r#"{ "mesh": 0 }"#, 0.0, DVec3::X),
        (r#"{ "mesh": 0 }"#, quarter, DVec3::Y),
        (r#"{ "mesh": 0, "scale": [1, 1, -2] }"#, 0.0, -DVec3::X),
        (r#"{ "mesh": 0, "scale": [-1, 1, 1] }"#, quarter, DVec3::Y),
        // Turned about x, so that it looks down; stretched, which changes nothing of a face.
        (r#"{ "mesh": 0, "rotation": [0.70710678, 0, 0, 0.70710678], "scale": [5, 1, 3] }"#, 0.3, DVec3::Z),
    ] {
        let model = square_with(5, "", nodes, WITH_NORMALS).unwrap();
        let found = standing(&model, heading_rad);
        assert_eq!(found.len(), 4, "both triangles share their corners");
        assert!(found.iter().all(|normal| normal.distance(expected) < 2e-6), "{nodes}: {found:?}");
        assert_eq!(corners(&model), corners(&square_with(5, "", nodes, GltfOptions::default()).unwrap()));
    }
    assert!(standing(&square(5, "", r#"{ "mesh": 0 }"#).unwrap(), 0.0).is_empty());
}

#[test]
fn planes_do_not_share_corners_and_given_normals_are_mended() {
    // Two faces of a tent.
    let at = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        .map(|at| MeshVertex::new(at, [0.0; 2]));
    let shape = normals::flat(&at, &[0, 1, 2, 0, 2, 3], false);
    assert_eq!((shape.vertices.len(), shape.indices.len()), (6, 6));
    let normal = |k: usize| shape.normals[shape.indices[k] as usize];
    assert_eq!(
        [normal(0), normal(2), normal(3), normal(5)],
        [[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]
    );
    let given = vec![DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::NAN, DVec3::new(3.0, 0.0, -4.0)];
    let mended = normals::mended(given, &at, &[0, 1, 2, 0, 2, 3], false);
    let between = 0.5_f32.sqrt();
    for (found, expected) in
        mended.into_iter().zip([[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [between, 0.0, between], [0.6, 0.0, -0.8]])
    {
        assert!(
            DVec3::from_array(found.map(f64::from)).distance(DVec3::from_array(expected.map(f64::from)))
                < 1e-6,
            "{found:?}"
        );
    }
}

#[test]
fn light_falls_on_nothing_that_is_unlit_or_shines() {
    for (material, lit) in [
        (r#"{}"#, true),
        (r#"{ "emissiveFactor": [0.5, 0, 0] }"#, true),
        (r#"{ "extensions": { "KHR_materials_unlit": {} } }"#, false),
    ] {
        let rest = format!(r#", "material": 0 }}] }}], "materials": [{material}], "x": [{{ "y": [{{ "z": 1"#);
        let model = square_with(5, &rest, r#"{ "mesh": 0 }"#, WITH_NORMALS).unwrap();
        assert_eq!(!standing(&model, 0.0).is_empty(), lit, "{material}");
    }
}

#[test]
fn normals_of_real_models_look_outwards_wherever_joints_take_them() {
    let Some(data) = data() else { return };
    for (name, time_s) in [
        ("CesiumMilkTruck/glTF-Binary/CesiumMilkTruck.glb", None),
        ("Fox/glTF-Binary/Fox.glb", None),
        ("Fox/glTF-Binary/Fox.glb", Some(0.4)),
        ("RecursiveSkeletons/glTF-Binary/RecursiveSkeletons.glb", Some(0.5)),
        ("AnimatedMorphCube/glTF-Binary/AnimatedMorphCube.glb", Some(1.1)),
        ("Box/glTF-Binary/Box.glb", None),
    ] {
        let read = |normals: bool| {
            read_gltf(&data.join(name), GltfOptions { time_s, normals, ..GltfOptions::default() }).unwrap()
        };
        let (model, plain) = (read(true), read(false));
        assert_eq!(corners(&model), corners(&plain), "{name}");
        let (mut outwards, mut all) = (0.0, 0.0);
        for mesh in model.place(DVec3::ZERO, 0.4, 1.0) {
            assert!(mesh.shape.has_normals(), "{name}");
            for triangle in mesh.shape.indices.chunks_exact(3) {
                let [a, b, c] = [0, 1, 2].map(|k| mesh.position_ned_m(triangle[k]));
                let face = (b - a).cross(c - a);
                for &corner in triangle {
                    let normal = transformed_normal(
                        &mesh.ned_from_shape,
                        DVec3::from_array(mesh.shape.normals[corner as usize].map(f64::from)),
                    );
                    assert!((normal.length() - 1.0).abs() < 1e-9, "{name}");
                    all += face.length();
                    outwards += if normal.dot(face) > 0.5 * face.length() { face.length() } else { 0.0 };
                }
            }
        }
        eprintln!(
            "{name} {time_s:?}: {:.4} of the area has normals within 60 degrees of its faces'",
            outwards / all
        );
        assert!(outwards > 0.9 * all, "{name}: {outwards} of {all}");
    }
}

/// The material of a square; `color` is the first corner's.
fn material_of(material: &str) -> Material {
    let rest = format!(r#", "material": 0 }}] }}], "materials": [{material}], "x": [{{ "y": [{{ "z": 1"#);
    let model = square_with(5, &rest, r#"{ "mesh": 0 }"#, GltfOptions::default()).unwrap();
    assert!(model.notes.is_empty(), "{:?}", model.notes);
    model.place(DVec3::ZERO, 0.0, 1.0).next().unwrap().material
}

/// What cuts at an alpha: just below it, as what has that alpha is there, of which a half float that is
/// rounded down loses up to 2^-11; and no lower.
fn cut_at(alpha: f32, cutoff: Option<f32>) -> bool {
    cutoff.is_some_and(|cutoff| cutoff < alpha * (1.0 - 0.5_f32.powi(11)) && cutoff > 0.999 * alpha)
}

#[test]
fn what_is_blended_is_mixed_where_any_of_it_is_clear() {
    let of = |mode: &str, alpha: f32| {
        let factor = format!(r#""pbrMetallicRoughness": {{ "baseColorFactor": [1, 1, 1, {alpha}] }}"#);
        let found = material_of(&format!(r#"{{ "alphaMode": "{mode}", {factor} }}"#));
        (found.blends, found.cutoff)
    };
    let is = |found: (bool, Option<f32>), blends: bool| found.0 == blends && cut_at(0.5, found.1);
    assert!(is(of("BLEND", 0.5), true) && is(of("BLEND", 0.999), true));
    // Nothing is clear: it hides what is behind it.
    assert_eq!(of("BLEND", 1.0), (false, None));
    assert!(is(of("MASK", 0.4), false) && is(of("MASK", 1.0), false));
    assert_eq!(of("OPAQUE", 0.4), (false, None));
}

#[test]
fn factors_beyond_what_there_is_are_named() {
    let of = |material: &str| {
        let rest = format!(r#", "material": 0 }}] }}], "materials": [{material}], "x": [{{ "y": [{{ "z": 1"#);
        square_with(5, &rest, r#"{ "mesh": 0 }"#, GltfOptions::default())
    };
    let base = |factor: &str| {
        of(&format!(
            r#"{{ "alphaMode": "BLEND", "pbrMetallicRoughness": {{ "baseColorFactor": {factor} }} }}"#
        ))
    };
    assert!(base("[0, 1, 0.5, 0.25]").unwrap().notes.is_empty());
    for factor in ["[1, 1, 1, 1.5]", "[1, 1, 1, -0.5]", "[2, 1, 1, 0.5]"] {
        let notes = base(factor).unwrap().notes;
        let named = |note: &String| {
            ["materials.0:", "baseColorFactor", "nearest"].iter().all(|part| note.contains(part))
        };
        assert!(notes.len() == 1 && notes.iter().all(named), "{factor}: {notes:?}");
    }
    let error = base("[1, 1, 1, 1e39]").unwrap_err().to_string();
    assert!(
        ["materials.0:", "baseColorFactor", "not finite"].iter().all(|part| error.contains(part)),
        "{error}"
    );
    let notes = of(r#"{ "emissiveFactor": [3, 0, 0] }"#).unwrap().notes;
    assert!(notes.len() == 1 && notes[0].starts_with("materials.0: emissiveFactor"), "{notes:?}");
}

#[test]
fn a_real_model_blends_what_it_says() {
    let Some(data) = data() else { return };
    let model = read_gltf(
        &data.join("AlphaBlendModeTest/glTF-Binary/AlphaBlendModeTest.glb"),
        GltfOptions::default(),
    )
    .unwrap();
    assert_eq!(
        model.notes,
        ["colour is albedo alone: metallicRoughnessTexture, normalTexture and occlusionTexture are left out"]
    );
    let found: Vec<_> =
        model.place(DVec3::ZERO, 0.0, 1.0).map(|mesh| (mesh.material.blends, mesh.material.cutoff)).collect();
    for (blends, alpha) in [(true, 0.5), (false, 0.25), (false, 0.5), (false, 0.75)] {
        assert!(
            found.iter().any(|found| found.0 == blends && cut_at(alpha, found.1)),
            "{blends} {alpha} of {found:?}"
        );
    }
    assert!(found.contains(&(false, None)), "{found:?}");
}

#[test]
fn the_diffuse_colour_of_older_files_is_their_base_colour() {
    let material = |rest: &str| {
        format!(r#", "material": 0 }}] }}], "materials": [{{ {rest} }}], "unknown": [{{ "none": [{{ "x": 0"#)
    };
    let diffuse = r#""extensions": { "KHR_materials_pbrSpecularGlossiness": { "diffuseFactor": [0.25, 0.5, 0.75, 1.0] } }"#;
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

#[test]
fn animations_that_nothing_or_too_much_is_asked_of_are_noted() {
    let animation = r#"{ "channels": [{ "sampler": 0, "target": { "node": 0, "path": "translation" } }], "samplers": [{ "input": 1, "output": 0 }] }"#;
    let read = |count: usize, options: GltfOptions| {
        let bytes = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 2.0, 3.0]);
        let animations = vec![animation; count].join(", ");
        let rest = format!(
            r#""bufferViews": [{{ "buffer": 0, "byteLength": 48 }}, {{ "buffer": 0, "byteOffset": 48, "byteLength": 16 }}],
            "accessors": [{{ "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }},
                {{ "bufferView": 1, "componentType": 5126, "count": 4, "type": "SCALAR", "min": [0], "max": [3] }}],
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "mode": 5 }}] }}], "animations": [{animations}],
            "nodes": [{{ "mesh": 0 }}], "scenes": [{{ "nodes": [0] }}]"#
        );
        model(&bytes, &rest, options).unwrap().notes
    };
    let at = |time_s: Option<f64>, animation: Option<usize>| GltfOptions {
        time_s,
        animation,
        ..GltfOptions::default()
    };
    assert_eq!(read(1, at(Some(1.0), None)), Vec::<String>::new());
    assert_eq!(read(2, at(Some(1.0), Some(1))), Vec::<String>::new());
    let [unasked] = read(1, at(None, Some(0))).try_into().unwrap();
    assert!(unasked.contains("animation says nothing without time_s"), "{unasked}");
    let [mixed] = read(3, at(Some(1.0), None)).try_into().unwrap();
    assert!(mixed.contains("animations 0 and 1 both move node 0"), "{mixed}");
}

#[test]
fn corners_in_a_compressed_buffer_alone_are_named_by_their_extension() {
    let rest = |view: &str| {
        format!(
            r#""bufferViews": [{{ "buffer": 0, "byteLength": 48 }}], "extensionsUsed": ["KHR_draco_mesh_compression"],
            "accessors": [{{ {view} "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0] }}],
            "meshes": [{{ "primitives": [{{ "attributes": {{ "POSITION": 0 }}, "mode": 5,
                "extensions": {{ "KHR_draco_mesh_compression": {{ "bufferView": 0, "attributes": {{ "POSITION": 0 }} }} }} }}] }}],
            "nodes": [{{ "mesh": 0 }}], "scenes": [{{ "nodes": [0] }}]"#
        )
    };
    let bytes = floats(&[0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0, 1.0, 0.0]);
    let error = model(&bytes, &rest(""), GltfOptions::default()).unwrap_err();
    assert!(error.contains("KHR_draco_mesh_compression") && error.contains("without compression"), "{error}");
    // With what readers without it are given instead.
    assert_eq!(
        corners(&model(&bytes, &rest(r#""bufferView": 0,"#), GltfOptions::default()).unwrap()).len(),
        2
    );
}
