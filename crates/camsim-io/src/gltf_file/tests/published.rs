//! Models published by others: `CAMSIM_DATA/gltf`.

use super::*;

fn data() -> Option<PathBuf> {
    let folder = std::env::var_os("CAMSIM_DATA").map(|data| PathBuf::from(data).join("gltf"));
    if folder.is_none() {
        eprintln!("CAMSIM_DATA is not set: published models are not tested");
    }
    folder
}

fn all_models(folder: &Path) -> Vec<PathBuf> {
    let mut paths = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let is_model = path.extension().is_some_and(|ending| ending == "gltf" || ending == "glb");
        if path.is_dir() {
            paths.extend(all_models(&path));
        } else if is_model {
            paths.push(path);
        }
    }
    paths.sort();
    paths
}

#[test]
fn malformed_published_files_are_refused() {
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

#[test]
fn damaged_files_do_not_panic() {
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
                let index = random() % bytes.len().max(1);
                if let Some(byte) = bytes.get_mut(index) {
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
fn published_models_have_their_documented_size() {
    let Some(data) = data() else { return };
    let size = |name: &str, time_s: Option<f64>| {
        let model = read_gltf(&data.join(name), GltfOptions { time_s, ..GltfOptions::default() }).unwrap();
        let points: Vec<DVec3> = corners(&model).into_iter().flatten().collect();
        let low = points.iter().fold(DVec3::INFINITY, |low, point| low.min(*point));
        points.iter().fold(DVec3::NEG_INFINITY, |high, point| high.max(*point)) - low
    };
    // The same box, one metre a side, in four encodings.
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
fn normals_of_published_models_point_outwards_also_when_skinned() {
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

#[test]
fn published_alpha_mode_test_has_its_blend_modes() {
    let Some(data) = data() else { return };
    let model = read_gltf(
        &data.join("AlphaBlendModeTest/glTF-Binary/AlphaBlendModeTest.glb"),
        GltfOptions::default(),
    )
    .unwrap();
    assert_eq!(
        model.notes,
        ["colour is albedo alone: metallicRoughnessTexture, normalTexture and occlusionTexture are ignored"]
    );
    let modes: Vec<_> =
        model.place(DVec3::ZERO, 0.0, 1.0).map(|mesh| (mesh.material.blends, mesh.material.cutoff)).collect();
    for (blends, alpha) in [(true, 0.5), (false, 0.25), (false, 0.5), (false, 0.75)] {
        assert!(
            modes.iter().any(|mode| mode.0 == blends && cuts_just_below(alpha, mode.1)),
            "{blends} {alpha} of {modes:?}"
        );
    }
    assert!(modes.contains(&(false, None)), "{modes:?}");
}

#[test]
fn published_models_have_few_and_known_notes() {
    let Some(data) = data() else { return };
    let known = [
        "colour is albedo alone: ",
        "has animations, but time_s is not set",
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
