//! The files that a run is made from, told apart by what is in them: `--resume` goes on only with the same.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
    time::UNIX_EPOCH,
};

use camsim_core::scenario::Scenario;
use rayon::prelude::*;

use crate::{gltf_file::referenced_files, terrain::sidecar_files};

/// What is in files, by their paths.
pub type Inputs = BTreeMap<String, String>;

/// Bytes that are read at once.
const AT_ONCE: usize = 1 << 20;

/// Of all files that a scenario names, and of those that these name: a model's buffers and pictures, what
/// lies beside rasters. Camera files are part of the scenario itself.
#[must_use]
pub fn of_scenario(scenario: &Scenario) -> Inputs {
    let scene = &scenario.scene;
    let mut paths = vec![scenario.flight.log.clone()];
    paths.extend(scenario.camera.photometric.vignette.clone());
    paths.extend(scenario.camera.zoom_track.clone());
    for picture in scene.terrain.iter().flat_map(|terrain| terrain.ortho.iter().chain([&terrain.dem])) {
        paths.push(picture.clone());
        paths.extend(sidecar_files(picture));
    }
    paths.extend(scene.pattern.iter().map(|pattern| pattern.image.clone()));
    paths.extend(scene.board.iter().filter_map(|board| board.target.clone()));
    for model in &scene.gltf {
        paths.push(model.file.clone());
        paths.extend(referenced_files(&model.file));
        paths.extend(model.placements.clone());
    }
    of_files(paths)
}

/// Of these.
#[must_use]
pub fn of_files(mut paths: Vec<PathBuf>) -> Inputs {
    paths.sort();
    paths.dedup();
    paths.par_iter().map(|path| (path.display().to_string(), content(path))).collect()
}

/// What stands for the content of a file that cannot be read.
pub(crate) const NOT_READABLE: &str = "not readable";

/// Length and checksum, or that there is nothing to read.
fn content(path: &Path) -> String {
    match checksum(path) {
        Ok((bytes, crc)) => format!("{bytes} bytes, CRC-32 {crc:08x}"),
        Err(_) => NOT_READABLE.to_owned(),
    }
}

fn checksum(path: &Path) -> io::Result<(u64, u32)> {
    // What comes through a pipe has been read, and opening it again would wait for more.
    if !path.metadata()?.is_file() {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    let mut file = File::open(path)?;
    let (mut buffer, mut hasher, mut bytes) = (vec![0; AT_ONCE], crc32fast::Hasher::new(), 0);
    loop {
        match file.read(&mut buffer) {
            Ok(0) => return Ok((bytes, hasher.finalize())),
            Ok(read) => {
                hasher.update(&buffer[..read]);
                bytes += read as u64;
            }
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}

/// Length of a file and when it was changed, for those that are too many to be read for it.
#[must_use]
pub fn dated(path: &Path) -> String {
    let of = path.metadata().and_then(|of| Ok((of.len(), of.modified()?)));
    let Ok((bytes, modified)) = of else { return NOT_READABLE.to_owned() };
    let modified_s = modified.duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64());
    format!("{bytes} bytes, changed {modified_s:.6} s after 1970")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use crate::scenario_file::parse_scenario;

    #[test]
    fn a_change_of_any_file_shows_under_its_name() {
        let folder = tempfile::tempdir().unwrap();
        let names = [
            "log.csv",
            "dem.tif",
            "ortho.jpg",
            "ortho.jgw",
            "pattern.png",
            "vignette.png",
            "zoom.csv",
            "board.yaml",
            "places.csv",
            "a mesh.bin",
            "skin.png",
            "house.gltf",
        ];
        let model = r#"{ "asset": { "version": "2.0" }, "buffers": [{ "uri": "a%20mesh.bin", "byteLength": 1 }, { "uri": "data:,x", "byteLength": 1 }],
            "images": [{ "uri": "skin.png" }, { "bufferView": 0 }] }"#;
        for name in names {
            std::fs::write(folder.path().join(name), if name.ends_with("gltf") { model } else { "one" })
                .unwrap();
        }
        let text = r#"
            [camera]
            zoom_track = "zoom.csv"
            [[camera.zoom]]
            at = 1.0
            focal_px = [100.0, 100.0]
            [camera.photometric]
            vignette = "vignette.png"
            [flight]
            log = "log.csv"
            [scene]
            terrain = { dem = "dem.tif", ortho = "ortho.jpg" }
            pattern = { image = "pattern.png", width_m = 10.0 }
            board = { target = "board.yaml" }
            [[scene.gltf]]
            file = "house.gltf"
            placements = "places.csv"
            [[scene.gltf]]
            file = "gone.glb"
        "#;
        let scenario = parse_scenario(text, &folder.path().join("s.toml"), &[]).unwrap();
        let before = of_scenario(&scenario);
        let path = |name: &str| folder.path().join(name).display().to_string();
        assert_eq!(before[&path("log.csv")], "3 bytes, CRC-32 7a6c86f1");
        assert_eq!(before[&path("gone.glb")], "not readable");
        assert_eq!(before.len(), names.len() + 1);
        for name in names {
            // Of the same length.
            std::fs::write(
                folder.path().join(name),
                if name.ends_with("gltf") { model.replace("2.0", "2.1") } else { "two".to_owned() },
            )
            .unwrap();
            let now = of_scenario(&scenario);
            let changed: Vec<&String> = now
                .iter()
                .filter(|(path, content)| before.get(*path) != Some(content))
                .map(|(path, _)| path)
                .collect();
            assert_eq!(changed, [&path(name)]);
            std::fs::write(folder.path().join(name), if name.ends_with("gltf") { model } else { "one" })
                .unwrap();
        }
        assert_eq!(of_scenario(&scenario), before);
    }
}
