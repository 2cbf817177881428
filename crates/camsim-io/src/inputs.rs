//! Fingerprints of the input files of a run. `--resume` continues a run only with the same inputs.

use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, Read},
    path::{Path, PathBuf},
    time::UNIX_EPOCH,
};

use camsim_core::scenario::{PointSource, Scenario};
use rayon::prelude::*;

use crate::{
    gltf_file::referenced_files,
    raster::{files::terrain_files, sidecar_files},
};

/// Fingerprints of files by their paths.
pub type Inputs = BTreeMap<String, String>;

/// Size of the read buffer, bytes.
const BUFFER_BYTES: usize = 1 << 20;

/// Fingerprints of all files that a scenario names, and of those that these need: buffers and pictures of
/// models, files beside rasters. Camera files are part of the scenario itself.
#[must_use]
pub fn scenario_fingerprints(scenario: &Scenario) -> Inputs {
    let scene = &scenario.scene;
    let mut paths = vec![scenario.flight.log.clone()];
    paths.extend(scenario.camera.photometric.vignette.clone());
    paths.extend(scenario.camera.zoom_track.clone());
    paths.extend(scenario.camera.lens_table.iter().map(|table| table.path.clone()));
    let spread = scenario.camera.point_spread.as_ref();
    paths.extend(spread.and_then(|spread| spread.kernel.as_ref()).map(|file| file.path.clone()));
    if let Some(terrain) = &scene.terrain {
        for raster in terrain_files(&terrain.dem, terrain.ortho.as_ref()) {
            paths.extend(sidecar_files(&raster));
            paths.push(raster);
        }
    }
    paths.extend(scene.pattern.iter().map(|pattern| pattern.image.clone()));
    paths.extend(scene.board.iter().filter_map(|board| board.target.clone()));
    for model in &scene.gltf {
        paths.push(model.file.clone());
        paths.extend(referenced_files(&model.file));
        paths.extend(model.placements.clone());
    }
    let tracked = scenario.output.tracks.iter().flat_map(|tracks| &tracks.points);
    paths.extend(tracked.filter_map(|source| match source {
        PointSource::Table(path) => Some(path.clone()),
        PointSource::Terrain | PointSource::Vertices | PointSource::Board => None,
    }));
    file_fingerprints(paths)
}

/// Fingerprints of files.
#[must_use]
pub fn file_fingerprints(mut paths: Vec<PathBuf>) -> Inputs {
    paths.sort();
    paths.dedup();
    paths.par_iter().map(|path| (path.display().to_string(), fingerprint(path))).collect()
}

/// The fingerprint of a file that cannot be read.
pub(crate) const NOT_READABLE: &str = "not readable";

/// Length and CRC-32 of a file, or [`NOT_READABLE`].
fn fingerprint(path: &Path) -> String {
    match checksum(path) {
        Ok((bytes, crc)) => format!("{bytes} bytes, CRC-32 {crc:08x}"),
        Err(_) => NOT_READABLE.to_owned(),
    }
}

/// Length in bytes and CRC-32 of a file.
fn checksum(path: &Path) -> io::Result<(u64, u32)> {
    // A pipe has been read already, and opening it again would block.
    if !path.metadata()?.is_file() {
        return Err(io::ErrorKind::InvalidInput.into());
    }
    let mut file = File::open(path)?;
    let (mut buffer, mut hasher, mut bytes) = (vec![0; BUFFER_BYTES], crc32fast::Hasher::new(), 0);
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

/// Length and modification time of a file: a fingerprint that needs no reading, for large sets of files.
#[must_use]
pub fn size_and_mtime(path: &Path) -> String {
    let metadata = path.metadata().and_then(|metadata| Ok((metadata.len(), metadata.modified()?)));
    let Ok((bytes, modified)) = metadata else { return NOT_READABLE.to_owned() };
    let modified_s = modified.duration_since(UNIX_EPOCH).map_or(0.0, |since| since.as_secs_f64());
    format!("{bytes} bytes, changed {modified_s:.6} s after 1970")
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use crate::scenario_file::parse_scenario;

    #[test]
    fn changes_of_any_input_file_change_its_fingerprint() {
        let folder = tempfile::tempdir().unwrap();
        let names = [
            "log.csv",
            "dem.tif",
            "ortho.jpg",
            "ortho.jgw",
            "pattern.png",
            "vignette.png",
            "kernel.png",
            "zoom.csv",
            "board.yaml",
            "places.csv",
            "points.csv",
            "a mesh.bin",
            "skin.png",
            "house.gltf",
        ];
        let model = r#"{ "asset": { "version": "2.0" }, "buffers": [{ "uri": "a%20mesh.bin", "byteLength": 1 },
                { "uri": "data:,x", "byteLength": 1 }],
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
            [camera.point_spread]
            kernel = "kernel.png"
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
            [output.tracks]
            points = ["terrain", "points.csv"]
        "#;
        let scenario = parse_scenario(text, &folder.path().join("s.toml"), &[]).unwrap();
        let before = scenario_fingerprints(&scenario);
        let path = |name: &str| folder.path().join(name).display().to_string();
        assert_eq!(before[&path("log.csv")], "3 bytes, CRC-32 7a6c86f1");
        assert_eq!(before[&path("gone.glb")], "not readable");
        assert_eq!(before.len(), names.len() + 1);
        for name in names {
            // The new content has the same length.
            std::fs::write(
                folder.path().join(name),
                if name.ends_with("gltf") { model.replace("2.0", "2.1") } else { "two".to_owned() },
            )
            .unwrap();
            let now = scenario_fingerprints(&scenario);
            let changed: Vec<&String> = now
                .iter()
                .filter(|(path, content)| before.get(*path) != Some(content))
                .map(|(path, _)| path)
                .collect();
            assert_eq!(changed, [&path(name)]);
            std::fs::write(folder.path().join(name), if name.ends_with("gltf") { model } else { "one" })
                .unwrap();
        }
        assert_eq!(scenario_fingerprints(&scenario), before);
    }
}
