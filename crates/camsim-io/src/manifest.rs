//! `run.json`: what made the files of a folder, so that the run can be repeated, and resumed only by the same
//! scenario.
//!
//! Its paths are relative to it. A folder that was moved, or whose inputs were, is still of the same scenario
//! if they have the same contents.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use camsim_core::scenario::Scenario;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

use crate::{
    inputs::Inputs,
    portable::{portable_scenario, relative_to},
    scenario_file::for_each_path,
    write::{WriteError, write_atomic},
};

/// What `run.json` says of its paths. Those of early versions, which say nothing, are of the working
/// directory.
pub const PATHS: &str = "relative to this file";

/// Contents of `run.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunManifest {
    /// Version of camsim.
    pub version: String,
    /// Adapter and driver, in words.
    pub adapter: String,
    /// Seed of every random number (as in the scenario).
    pub seed: u64,
    /// How the paths below are meant: [`PATHS`].
    pub paths: String,
    /// The scenario with all defaults and `--set`.
    pub scenario: Scenario,
    /// What was in the files that it names.
    pub inputs: Inputs,
    /// Frames that the run covers, `--frames` applied: first and one past the last.
    pub frames: [u64; 2],
    /// `[I, N]` of `--shard I/N`, from 1.
    pub shard: Option<[u64; 2]>,
    /// Frames written.
    pub written: u64,
    /// Frames that `--resume` found done.
    pub skipped: u64,
    /// Whether the run came to its end; `false` is written at the start.
    pub finished: bool,
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// Why a run cannot be resumed in a folder.
#[derive(Debug, Error)]
pub enum ResumeError {
    /// `run.json` cannot be read.
    #[error("cannot read {}: {source}; render without --resume, or into another folder", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Reason.
        source: std::io::Error,
    },
    /// `run.json` is not one.
    #[error("{} is not a run.json of camsim ({message}); render without --resume, or into another \
        folder", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// The parser's words.
        message: String,
    },
    /// Another scenario, or other files.
    #[error("{} was made {made}: {}; render without --resume, or into another \
        folder", path.display(), shortened(differences))]
    Differs {
        /// The file.
        path: PathBuf,
        /// By what, or from what.
        made: &'static str,
        /// `key was old, now new`.
        differences: Vec<String>,
    },
}

/// How a folder was made that has another scenario.
pub const BY_SCENARIO: &str = "by another scenario";

impl ResumeError {
    /// What is wrong, without what to do.
    #[must_use]
    pub fn what(&self) -> String {
        let text = self.to_string();
        text.strip_suffix(WAY_OUT).map_or_else(|| text.clone(), str::to_owned)
    }
}

/// How every text of a [`ResumeError`] ends.
const WAY_OUT: &str = "; render without --resume, or into another folder";

impl RunManifest {
    /// Writes `run.json` into `folder`; a shard also writes `run.I-of-N.json`, so that shards in one folder
    /// keep their own counts.
    ///
    /// # Errors
    /// As [`write_atomic`].
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        let path = folder.join("run.json");
        let fail =
            |error: serde_json::Error| WriteError::Encode { path: path.clone(), message: error.to_string() };
        let portable = Self {
            paths: PATHS.to_owned(),
            scenario: portable_scenario(&self.scenario, folder).map_err(fail)?,
            inputs: portable_inputs(&self.inputs, folder),
            ..self.clone()
        };
        let text = serde_json::to_string_pretty(&portable).map_err(fail)? + "\n";
        if let Some([shard, of]) = self.shard {
            write_atomic(&folder.join(format!("run.{shard}-of-{of}.json")), text.as_bytes())?;
        }
        write_atomic(&path, text.as_bytes())
    }
}

/// Inputs by their paths from a folder.
#[must_use]
pub fn portable_inputs(inputs: &Inputs, folder: &Path) -> Inputs {
    let name = |path: &String| relative_to(Path::new(path), folder).to_string_lossy().into_owned();
    inputs.iter().map(|(path, content)| (name(path), content.clone())).collect()
}

/// Most differences that an error lists.
const MOST_LISTED: usize = 5;

fn shortened(differences: &[String]) -> String {
    let listed = differences[..differences.len().min(MOST_LISTED)].join("; ");
    let more = differences.len().saturating_sub(MOST_LISTED);
    if more > 0 { format!("{listed}; and {more} more") } else { listed }
}

/// Whether frames already in `folder` belong to `scenario` and to what is in its files. A folder without
/// `run.json` holds none: `Ok(false)`.
///
/// # Errors
/// `run.json` cannot be read, or another scenario made it, or the same with other files.
pub fn check_resume(folder: &Path, scenario: &Scenario, inputs: &Inputs) -> Result<bool, ResumeError> {
    let path = folder.join("run.json");
    let Some(run) = read_run(&path)? else { return Ok(false) };
    let parse =
        |error: serde_json::Error| ResumeError::Parse { path: path.clone(), message: error.to_string() };
    let (mut there, there_inputs) = (part(&run, "scenario", &path)?.clone(), part(&run, "inputs", &path)?);
    let mut here = as_read(&portable_scenario(scenario, folder).map_err(parse)?).map_err(parse)?;
    let here_inputs = portable_inputs(inputs, folder);
    let moved = Moved::between(&mut there, there_inputs, &mut here, &here_inputs);
    differs(&path, BY_SCENARIO, &there, &here)?;
    let here_inputs = as_read(&here_inputs).map_err(parse)?;
    differs(&path, "when a file had something else in it", &moved.inputs(there_inputs), &here_inputs)?;
    Ok(true)
}

/// As [`check_resume`], of whatever stands under `key` in `run.json`; `made` is how the folder was made if
/// that differs.
///
/// # Errors
/// As [`check_resume`].
pub fn check_resume_of(
    folder: &Path,
    key: &str,
    made: &'static str,
    here: &impl Serialize,
) -> Result<bool, ResumeError> {
    let path = folder.join("run.json");
    let Some(run) = read_run(&path)? else { return Ok(false) };
    let here = as_read(here)
        .map_err(|error| ResumeError::Parse { path: path.clone(), message: error.to_string() })?;
    differs(&path, made, part(&run, key, &path)?, &here)?;
    Ok(true)
}

fn read_run(path: &Path) -> Result<Option<Value>, ResumeError> {
    match std::fs::read_to_string(path) {
        Ok(text) => serde_json::from_str(&text)
            .map(Some)
            .map_err(|error| ResumeError::Parse { path: path.into(), message: error.to_string() }),
        Err(source) if source.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(ResumeError::Read { path: path.into(), source }),
    }
}

fn part<'a>(run: &'a Value, key: &str, path: &Path) -> Result<&'a Value, ResumeError> {
    run.get(key).ok_or_else(|| ResumeError::Parse { path: path.into(), message: format!("it has no {key}") })
}

/// Through text, so that numbers that print alike are alike.
fn as_read(value: &impl Serialize) -> Result<Value, serde_json::Error> {
    serde_json::to_string(value).and_then(|text| serde_json::from_str(&text))
}

fn differs(path: &Path, made: &'static str, there: &Value, here: &Value) -> Result<(), ResumeError> {
    let mut differences = Vec::new();
    compare(there, here, "", &mut differences);
    if differences.is_empty() {
        Ok(())
    } else {
        Err(ResumeError::Differs { path: path.into(), made, differences })
    }
}

/// Files and folders that are elsewhere than when a folder was made, by what is in the files.
struct Moved {
    files: BTreeMap<String, String>,
    folders: BTreeMap<PathBuf, PathBuf>,
}

impl Moved {
    /// Pairs the paths under the same keys; those of `there` whose files have the same contents become those
    /// of `here`.
    fn between(there: &mut Value, there_inputs: &Value, here: &mut Value, here_inputs: &Inputs) -> Self {
        let mut now = BTreeMap::new();
        for_each_path(here, &mut |key, path| {
            now.insert(key.to_owned(), path.clone());
        });
        let mut moved = Self { files: BTreeMap::new(), folders: BTreeMap::new() };
        for_each_path(there, &mut |key, path| {
            let Some(new) = now.get(key).filter(|new| *new != path) else { return };
            let contents = (
                there_inputs.get(path.as_str()).and_then(Value::as_str),
                here_inputs.get(new).map(String::as_str),
            );
            if contents.0.is_none()
                || contents.0 != contents.1
                || contents.0 == Some(crate::inputs::NOT_READABLE)
            {
                return;
            }
            if let (Some(from), Some(to)) = (Path::new(path).parent(), Path::new(new).parent()) {
                moved.folders.insert(from.into(), to.into());
            }
            moved.files.insert(path.clone(), new.clone());
            path.clone_from(new);
        });
        moved
    }

    /// The inputs of then where they are now; what a moved file names moved with it.
    fn inputs(&self, there: &Value) -> Value {
        let now = |path: &String| {
            let beside = || {
                let folder = self.folders.get(Path::new(path).parent()?)?;
                Some(folder.join(Path::new(path).file_name()?).to_string_lossy().into_owned())
            };
            self.files.get(path).cloned().or_else(beside).unwrap_or_else(|| path.clone())
        };
        let Value::Object(map) = there else { return there.clone() };
        Value::Object(map.iter().map(|(path, content)| (now(path), content.clone())).collect())
    }
}

fn compare(there: &Value, here: &Value, key: &str, differences: &mut Vec<String>) {
    if let (Value::Object(a), Value::Object(b)) = (there, here) {
        for name in a.keys().chain(b.keys().filter(|name| !a.contains_key(*name))) {
            let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            compare(
                a.get(name).unwrap_or(&Value::Null),
                b.get(name).unwrap_or(&Value::Null),
                &key,
                differences,
            );
        }
    } else if there != here {
        let show = |value: &Value| if value.is_null() { "nothing".to_owned() } else { value.to_string() };
        differences.push(format!("{key} was {}, now {}", show(there), show(here)));
    }
}

/// Whether shard `[i, n]` (i from 1) has frame `index`: every n-th frame, so that shards take about the same
/// time.
pub fn in_shard(index: u64, [i, n]: [u64; 2]) -> bool {
    n > 0 && index % n + 1 == i
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]
    use super::*;
    use crate::scenario_file::{parse_scenario, read_scenario};

    fn scenario(sets: &[(&str, &str)]) -> Scenario {
        let sets: Vec<_> = sets.iter().map(|(k, v)| ((*k).to_owned(), (*v).to_owned())).collect();
        let text = "[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n";
        parse_scenario(text, Path::new("s.toml"), &sets).unwrap()
    }

    fn manifest(scenario: Scenario) -> RunManifest {
        RunManifest {
            version: "0.1.0".into(),
            adapter: "llvmpipe".into(),
            seed: scenario.seed,
            paths: PATHS.to_owned(),
            scenario,
            inputs: [("a.csv".to_owned(), "3 bytes".to_owned())].into(),
            frames: [0, 10],
            shard: Some([2, 4]),
            written: 3,
            skipped: 0,
            finished: true,
            warnings: vec![],
        }
    }

    #[test]
    fn a_manifest_reads_back_and_only_its_own_scenario_resumes() {
        let dir = tempfile::tempdir().unwrap();
        assert!(!check_resume(dir.path(), &scenario(&[]), &Inputs::new()).unwrap());
        let ours =
            manifest(scenario(&[("camera.fps", "29.97"), ("camera.mount.angles_deg", "[0.1, -0.3, 1e-7]")]));
        ours.write(dir.path()).unwrap();
        let text = std::fs::read_to_string(dir.path().join("run.2-of-4.json")).unwrap();
        let read: RunManifest = serde_json::from_str(&text).unwrap();
        let portable = portable_scenario(&ours.scenario, dir.path()).unwrap();
        assert_eq!(
            read,
            RunManifest {
                scenario: portable,
                inputs: portable_inputs(&ours.inputs, dir.path()),
                ..ours.clone()
            }
        );
        assert!(check_resume(dir.path(), &ours.scenario, &ours.inputs).unwrap());
        let changed = [("a.csv".to_owned(), "4 bytes".to_owned())].into();
        let error = check_resume(dir.path(), &ours.scenario, &changed).unwrap_err().to_string();
        assert!(error.contains("a.csv was \"3 bytes\", now \"4 bytes\""), "{error}");

        let mut other = ours.scenario.clone();
        other.camera.fps = 25.0;
        other.scene.fog_visibility_m = Some(900.0);
        let error = check_resume(dir.path(), &other, &ours.inputs).unwrap_err().to_string();
        assert!(
            error.contains("camera.fps was 29.97, now 25")
                && error.contains("scene.fog_visibility_m was nothing, now 900"),
            "{error}"
        );

        std::fs::write(dir.path().join("run.json"), "{").unwrap();
        assert!(matches!(check_resume(dir.path(), &other, &ours.inputs), Err(ResumeError::Parse { .. })));
    }

    #[test]
    fn the_run_of_a_manifest_can_be_made_again() {
        let dir = tempfile::tempdir().unwrap();
        let text = r#"
            seed = 9
            [flight]
            log = "logs/a.csv"
            window_s = [1.0, 2.5]
            origin = [46.5, 7.25, 900.0]
            [camera.shutter]
            interlace_ms = "field"
            [[camera.mount.vibration]]
            axis = "roll"
            amplitude_deg = 0.1
            hz = 30.0
            phase_deg = 0.0
            [scene]
            terrain = { dem = "/maps/dem.tif", ortho = "ortho.tif" }
            sky = [0.1, 0.2, 0.3]
            [scene.light]
            sun_azimuth_deg = 150.0
            sun_elevation_deg = 35.0
            [[scene.gltf]]
            file = "house.glb"
            placements = "houses.csv"
            on_ground = true
            [[scene.gltf]]
            file = "../tower.glb"
            geodetic = [46.5, 7.25, 0.0]
            time_s = 1.5
            [quality]
            solver = "rk2"
            [output]
            channels = ["color", "coords"]
        "#;
        // Paths lead from the folder that the manifest is in.
        let scenario = parse_scenario(text, &dir.path().join("there/s.toml"), &[]).unwrap();
        let ours = manifest(scenario.clone());
        ours.write(&dir.path().join("out")).unwrap();
        let written: Value =
            serde_json::from_slice(&std::fs::read(dir.path().join("out/run.json")).unwrap()).unwrap();
        assert_eq!(written["scenario"]["flight"]["log"], "../there/logs/a.csv");
        assert_eq!(written["scenario"]["scene"]["terrain"]["dem"], "/maps/dem.tif");
        assert_eq!(written["scenario"]["scene"]["gltf"][1]["file"], "../tower.glb");
        let run = dir.path().join("out/run.json");
        let read = read_scenario(&run, &[], None).unwrap();
        assert_eq!(read.flight.log, dir.path().join("out/../there/logs/a.csv"));
        assert_eq!(
            portable_scenario(&read, dir.path()).unwrap(),
            portable_scenario(&scenario, dir.path()).unwrap()
        );
        let sets = [("camera.fps".to_owned(), "12.5".to_owned())];
        assert_eq!(read_scenario(&run, &sets, None).unwrap().camera.fps, 12.5);
        for (text, wanted) in [
            ("{ \"apply\": {} }", "run.json: JSON without `scenario`"),
            ("{ \"scenario\": ", "run.json: neither TOML nor JSON"),
            ("{ \"scenario\": { \"fligth\": {} } }", "run.json: fligth: unknown key"),
        ] {
            std::fs::write(&run, text).unwrap();
            let error = read_scenario(&run, &[], None).unwrap_err().to_string();
            assert!(error.contains(wanted), "{error}");
        }
    }

    #[test]
    fn a_folder_that_was_moved_is_still_its_scenarios() {
        let base = tempfile::tempdir().unwrap();
        let at = |name: &str| base.path().join(name);
        std::fs::create_dir_all(at("data/maps")).unwrap();
        for name in ["data/a.csv", "data/g.png", "data/maps/g.pgw"] {
            std::fs::write(at(name), name).unwrap();
        }
        let read = |folder: &str| {
            let text = "[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n";
            let scenario = parse_scenario(text, &at(folder).join("s.toml"), &[]).unwrap();
            let mut inputs = crate::inputs::of_scenario(&scenario);
            // As a world file or a model's buffer stands beside.
            let beside = at(folder).join("g.pgw");
            inputs.insert(beside.display().to_string(), "a world file".into());
            (scenario, inputs)
        };
        let (scenario, inputs) = read("data");
        let ours = RunManifest { inputs: inputs.clone(), ..manifest(scenario.clone()) };
        ours.write(&at("runs/out")).unwrap();
        assert!(check_resume(&at("runs/out"), &scenario, &inputs).unwrap());
        std::fs::rename(at("runs/out"), at("out")).unwrap();
        assert!(check_resume(&at("out"), &scenario, &inputs).unwrap(), "the folder is elsewhere");
        std::fs::rename(at("data"), at("other")).unwrap();
        let (scenario, inputs) = read("other");
        assert!(check_resume(&at("out"), &scenario, &inputs).unwrap(), "the inputs are elsewhere");
        std::fs::write(at("other/a.csv"), "another log").unwrap();
        let (scenario, inputs) = read("other");
        let error = check_resume(&at("out"), &scenario, &inputs).unwrap_err().to_string();
        assert!(error.contains("flight.log was \"../../data/a.csv\", now \"../other/a.csv\""), "{error}");
    }

    #[test]
    fn every_path_of_a_scenario_is_made_relative() {
        use crate::scenario_file::{ValueKind, keys};
        let text = r#"
            flight = { log = "x/1" }
            [camera]
            zoom_track = "x/2"
            photometric = { vignette = "x/3" }
            [[camera.zoom]]
            at = 1.0
            focal_px = [1.0, 1.0]
            [scene]
            terrain = { dem = "x/4", ortho = "x/5" }
            pattern = { image = "x/6", width_m = 1.0 }
            board = { target = "x/7" }
            gltf = [{ file = "x/8", placements = "x/9" }, { file = "x/10" }]
        "#;
        let scenario = parse_scenario(text, Path::new("s.toml"), &[]).unwrap();
        let mut tree = serde_json::to_value(&scenario).unwrap();
        let mut seen = Vec::new();
        for_each_path(&mut tree, &mut |key, _| seen.push(key.replace(".0.", ".").replace(".1.", ".")));
        for (key, _) in keys().iter().filter(|(_, kind)| *kind == ValueKind::Path) {
            assert!(seen.iter().any(|seen| seen == key), "{key}");
        }
        assert_eq!(seen.len(), 10);
    }

    #[test]
    fn shards_share_out_all_frames_once() {
        for index in 0..20 {
            assert_eq!((1..=4).filter(|&i| in_shard(index, [i, 4])).count(), 1);
        }
        assert!(!in_shard(0, [1, 0]));
    }
}
