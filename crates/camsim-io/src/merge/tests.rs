#![allow(clippy::unwrap_used, reason = "tests")]

use std::{
    fs,
    path::{Path, PathBuf},
};

use serde_json::json;
use tempfile::TempDir;

use super::*;
use crate::{
    manifest::RunManifest,
    scenario_file::{print_default, read_scenario},
};

/// A folder with three finished shards of six frames and a twin, as `render` writes them.
struct Shards {
    dir: TempDir,
    folders: Vec<PathBuf>,
}

impl Shards {
    fn new() -> Self {
        let dir = tempfile::tempdir().unwrap();
        let folders: Vec<PathBuf> = (1..=3).map(|i| dir.path().join(format!("shards/{i}"))).collect();
        let scenario = dir.path().join("flight.toml");
        fs::write(&scenario, print_default()).unwrap();
        fs::write(dir.path().join("flight.csv"), "t,n,e,d\n").unwrap();
        let scenario = read_scenario(&scenario, &[], None).unwrap();
        for (i, folder) in (1..).zip(&folders) {
            for below in ["", "sharp"] {
                let folder = folder.join(below);
                fs::create_dir_all(folder.join("color")).unwrap();
                fs::write(folder.join("camera.toml"), "fps = 30\n").unwrap();
                let mut table = "frame,stamp_ns\n".to_owned();
                for frame in [i - 1, i + 2] {
                    fs::write(folder.join(format!("color/frame_{frame:06}.exr")), format!("picture {frame}"))
                        .unwrap();
                    table += &format!("{frame},{}\n", 100 * frame);
                }
                fs::write(folder.join("frames.csv"), table).unwrap();
                let manifest = RunManifest {
                    version: "1".into(),
                    adapter: "cpu".into(),
                    seed: 1,
                    paths: String::new(),
                    variation: None,
                    twin: None,
                    scenario: scenario.clone(),
                    inputs: [(dir.path().join("flight.csv").display().to_string(), "7".into())].into(),
                    frames: [0, 6],
                    shard: Some([i, 3]),
                    written: 1,
                    skipped: 1,
                    finished: true,
                    tracked_points: None,
                    warnings: vec!["slow".into(), format!("of {i}")],
                };
                manifest.write(&folder).unwrap();
            }
            write_checksums(folder).unwrap();
        }
        Self { dir, folders }
    }

    fn out(&self) -> PathBuf {
        self.dir.path().join("a/merged")
    }

    fn merge(&self) -> Result<MergeReport, MergeError> {
        merge(&self.folders, &self.out())
    }

    fn error(&self) -> String {
        self.merge().unwrap_err().to_string()
    }

    /// Changes a value of a shard's `run.json`.
    fn set(&self, shard: usize, key: &str, value: serde_json::Value) {
        let path = self.folders[shard].join("run.json");
        let mut run: serde_json::Value = serde_json::from_str(&fs::read_to_string(&path).unwrap()).unwrap();
        run[key] = value;
        fs::write(path, run.to_string()).unwrap();
        write_checksums(&self.folders[shard]).unwrap();
    }
}

fn read(path: &Path) -> String {
    fs::read_to_string(path).unwrap()
}

#[test]
fn shards_become_one_run_in_any_order() {
    let mut shards = Shards::new();
    shards.folders.rotate_left(1);
    let report = shards.merge().unwrap();
    assert_eq!(report, MergeReport { shards: 3, frames: 6, files: 12, checked: 3, warnings: Vec::new() });
    let out = shards.out();
    for below in ["", "sharp/"] {
        let table = "frame,stamp_ns\n0,0\n1,100\n2,200\n3,300\n4,400\n5,500\n";
        assert_eq!(read(&out.join(format!("{below}frames.csv"))), table);
        assert_eq!(read(&out.join(format!("{below}color/frame_000004.exr"))), "picture 4");
        let run: serde_json::Value =
            serde_json::from_str(&read(&out.join(format!("{below}run.json")))).unwrap();
        let counts = ["shard", "written", "skipped", "finished"].map(|key| run[key].clone());
        assert_eq!(counts, [json!(null), json!(6), json!(0), json!(true)]);
        assert_eq!(run["warnings"], json!(["slow", "of 1", "of 2", "of 3"]));
        // Paths are relative to the merged folder, which is at another depth than the shards.
        let inputs = run["inputs"].as_object().unwrap();
        assert!(inputs.keys().all(|input| out.join(below).join(input).is_file()), "{inputs:?}");
    }
    assert!(!out.join(CHECKSUMS_FILE).exists() && !out.join("run.1-of-3.json").exists());
    assert!(shards.error().contains("has a run already"));
}

#[test]
fn incomplete_and_foreign_shards_are_refused() {
    let mut shards = Shards::new();
    shards.set(1, "finished", json!(false));
    assert!(shards.error().contains("not finished: repeat `camsim render ... --shard 2/3 --resume`"));
    shards.set(1, "finished", json!(true));
    shards.set(1, "seed", json!(1));
    shards.set(1, "version", json!("2"));
    assert!(shards.error().contains("made by versions 1 and 2 of camsim"));
    shards.set(1, "version", json!("1"));
    shards.set(1, "inputs", json!({"../../flight.csv": "8"}));
    assert!(shards.error().contains("inputs with different content"));
    let second = shards.folders.remove(1);
    assert_eq!(shards.error(), "1 of 3 shards are missing: 2");
    shards.folders.push(shards.folders[0].clone());
    assert!(shards.error().contains("are both shard 1 of 3"));
    shards.folders[2] = second;
    shards.set(0, "shard", json!(null));
    assert!(shards.error().contains("is no shard"));
    assert!(!shards.out().exists());
}

#[test]
fn damaged_and_different_files_are_found() {
    let shards = Shards::new();
    let picture = shards.folders[2].join("color/frame_000005.exr");
    fs::write(&picture, "picture 6").unwrap();
    assert!(shards.error().contains("frame_000005.exr: has 9 bytes and CRC-32"));
    fs::remove_file(&picture).unwrap();
    assert!(shards.error().starts_with("cannot read"));
    fs::write(&picture, "picture 5").unwrap();
    fs::write(shards.folders[1].join("camera.toml"), "fps = 25\n").unwrap();
    write_checksums(&shards.folders[1]).unwrap();
    assert!(shards.error().contains("camera.toml: differs from"));
    fs::write(shards.folders[1].join("camera.toml"), "fps = 30\n").unwrap();
    write_checksums(&shards.folders[1]).unwrap();
    // An interrupted merge is repeated.
    let linked = shards.out().join("color/frame_000004.exr");
    fs::create_dir_all(linked.parent().unwrap()).unwrap();
    fs::write(&linked, "pict").unwrap();
    assert_eq!(shards.merge().unwrap().frames, 6);
    assert_eq!(read(&linked), "picture 4");
}

#[test]
fn other_adapters_are_named() {
    let shards = Shards::new();
    shards.set(2, "adapter", json!("gpu"));
    assert_eq!(
        shards.merge().unwrap().warnings,
        ["the shards were rendered by different adapters, whose frames differ by rounding: cpu; gpu"]
    );
}
