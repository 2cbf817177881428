//! Models and RGB-D frames as users have them: each is read as it states, or refused with a remedy.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::path::{Path, PathBuf};

use camsim_core::scene::Mesh;
use camsim_io::{
    frame_file::read_frame,
    load::{Loaded, load_sequence},
    scenario_file::parse_scenario,
};
use glam::DVec3;

fn field(folder: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/field").join(folder)
}

fn frame_error(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    for file in std::fs::read_dir(field("apply")).unwrap() {
        let file = file.unwrap().path();
        std::fs::copy(&file, folder.path().join(file.file_name().unwrap())).unwrap();
    }
    let path = folder.path().join("FRAME.toml");
    std::fs::write(&path, text).unwrap();
    read_frame(&path).unwrap_err().to_string()
}

fn load(name: &str) -> Result<Loaded, String> {
    let path = field("gltf").join(name);
    let scenario = parse_scenario(&std::fs::read_to_string(&path).unwrap(), &path, &[])
        .map_err(|error| error.to_string())?;
    load_sequence(&scenario).map_err(|error| error.to_string())
}

fn meshes(name: &str) -> (Vec<Mesh>, Vec<String>) {
    let loaded = load(name).unwrap();
    (loaded.sequence.scene.meshes.clone(), loaded.warnings)
}

#[test]
fn carla_depth_needs_its_encoding_and_is_decoded() {
    let error = read_frame(&field("apply/carla_auto.toml")).unwrap_err().to_string();
    for part in [
        "carla.png: is an 8-bit RGB picture",
        "\"carla\" where metres are 1000 (R + 256 G + 65536 B) / 16777215",
        "\"packed24\" where they are (65025 R + 255 G + B) / 255",
    ] {
        assert!(error.contains(part), "{error}\n  lacks {part}");
    }
    let text = std::fs::read_to_string(field("apply/carla_auto.toml")).unwrap();
    let folder = field("apply");
    let temporary = tempfile::tempdir().unwrap();
    let path = temporary.path().join("FRAME.toml");
    let with_encoding = text.replace("\"c.png\"", &format!("{:?}", folder.join("c.png"))).replace(
        "depth = \"carla.png\"",
        &format!("depth = {:?}\ndepth_encoding = \"carla\"", folder.join("carla.png")),
    );
    std::fs::write(&path, with_encoding).unwrap();
    let file = read_frame(&path).unwrap();
    // 167 772 / 16 777 215 of a kilometre everywhere.
    let expected = 1000.0 * 167_772.0 / 16_777_215.0;
    assert!(
        file.frame.inverse_depth.iter().all(|w| (1.0 / f64::from(*w) - expected).abs() < 1e-5),
        "{}",
        1.0 / file.frame.inverse_depth[0]
    );
    assert!((expected - 10.0).abs() < 1e-4 && file.notes.is_empty());
}

#[test]
fn stated_depth_encoding_is_used() {
    // The picture has CARLA's encoding, but FRAME.toml states packed24: the stated one is used.
    let file = read_frame(&field("apply/carla_packed24.toml")).unwrap();
    assert!(
        (1.0 / f64::from(file.frame.inverse_depth[0]) - (92.0 * 255.0 + 143.0 + 2.0 / 255.0)).abs() < 0.01
    );
}

#[test]
fn pfm_scale_is_applied_with_a_note() {
    let file = read_frame(&field("apply/pfm_scale01.toml")).unwrap();
    // The stored depth is 100, the scale 0.1.
    assert!(file.frame.inverse_depth.iter().all(|w| (f64::from(*w) - 0.1).abs() < 1e-7));
    assert!(
        file.notes.len() == 1 && file.notes[0].contains("d01.pfm: the scale -0.1 of its header is applied"),
        "{:?}",
        file.notes
    );
    // The order of rows must be given.
    let error = frame_error("color = \"c.png\"\nfocal_px = [60, 60]\ndepth = \"d01.pfm\"\n");
    assert!(error.contains("depth_rows: is missing"), "{error}");
}

#[test]
fn invisible_nodes_show_nothing() {
    let (meshes, warnings) = meshes("invisible.toml");
    assert!(meshes.is_empty());
    assert!(
        warnings.iter().any(|warning| warning.contains("invisible.gltf: has no visible triangles")),
        "{warnings:?}"
    );
}

#[test]
fn accessors_without_data_are_zero() {
    let (meshes, warnings) = meshes("uv_nobufferview.toml");
    assert_eq!(meshes.len(), 1);
    let shape = &meshes[0].shape;
    assert!(
        shape.indices.len() == 6 && shape.vertices.iter().all(|vertex| vertex.uv == [0.0; 2]),
        "{:?}",
        shape.vertices
    );
    // The square is 10 m wide; with heading 180 its x points east and its -z north.
    let corner = meshes[0].position_ned_m(0);
    assert!(corner.distance(DVec3::new(5.0, -5.0, 0.0)) < 1e-9, "{corner}");
    assert!(
        warnings.iter().any(|warning| warning.contains("accessors.1: has no bufferView: its values are 0")),
        "{warnings:?}"
    );
}

#[test]
fn compressed_buffers_are_refused_by_extension_name() {
    let error = load("meshopt_fallback_nouri.toml").unwrap_err();
    let expected = "meshopt_fallback_nouri.gltf: needs the extension EXT_meshopt_compression, which is not \
                    supported: export the file without compression";
    assert!(error.contains(expected), "{error}");
}
