//! `run.json`: the scenario and inputs of a run, so that it can be repeated, and resumed with the same
//! scenario only.
//!
//! Its paths are relative to its folder. A run can be resumed after its folder or its inputs were moved, if
//! the inputs have the same content.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use camsim_core::scenario::{BurstOver, Scenario, TwinSpec};
use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

use crate::{
    inputs::Inputs,
    portable::{portable_scenario, relative_to},
    scenario_file::for_each_path,
    write::{WriteError, write_atomic},
};

/// Value of the key `paths` of `run.json`. Early versions have no such key, and paths relative to the working
/// directory.
pub const PATHS: &str = "relative to this file";

/// Contents of `run.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunManifest {
    /// Version of camsim.
    pub version: String,
    /// Names of adapter and driver.
    pub adapter: String,
    /// Seed of all random numbers, as in the scenario.
    pub seed: u64,
    /// Base of the paths: [`PATHS`].
    pub paths: String,
    /// In the folder of a twin: which one it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub twin: Option<TwinRecord>,
    /// The scenario with defaults and `--set` applied. In the folder of a twin, the one whose frames the twin's
    /// pictures are; of a burst, that of its centre.
    pub scenario: Scenario,
    /// Fingerprints of the files that the scenario names.
    pub inputs: Inputs,
    /// Frames of the run, `--frames` applied: the first, and one past the last.
    pub frames: [u64; 2],
    /// `[I, N]` of `--shard I/N`, from 1.
    pub shard: Option<[u64; 2]>,
    /// Number of frames written.
    pub written: u64,
    /// Number of frames that `--resume` skipped.
    pub skipped: u64,
    /// Whether the run is finished; `false` is written at its start.
    pub finished: bool,
    /// Number of tracked points, if the scenario has `[output.tracks]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracked_points: Option<u64>,
    /// Warnings for the user.
    pub warnings: Vec<String>,
}

/// What `run.json` in the folder of a twin says of it.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TwinRecord {
    /// Its name.
    pub name: String,
    /// The run whose frames it belongs to, relative to this file.
    pub of: String,
    /// Number of pictures in a burst.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub instants: Option<u32>,
    /// What a burst is spread over.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub over: Option<BurstOver>,
}

impl TwinRecord {
    /// The record of a twin in a folder below that of the frames.
    #[must_use]
    pub fn new(twin: &TwinSpec) -> Self {
        let over = twin.instants.map(|_| twin.over.unwrap_or_default());
        Self { name: twin.name.clone(), of: "../run.json".into(), instants: twin.instants, over }
    }
}

/// Why a run cannot be resumed in a folder.
#[derive(Debug, Error)]
pub enum ResumeError {
    /// `run.json` cannot be read.
    #[error("cannot read {}: {source}; render without --resume, or into another folder", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Error of the system.
        source: std::io::Error,
    },
    /// `run.json` cannot be parsed.
    #[error("{} is not a run.json of camsim ({message}); render without --resume, or into another \
        folder", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Message of the parser.
        message: String,
    },
    /// `run.json` is of another scenario, or of other inputs.
    #[error("{} was made {made}: {}; render without --resume, or into another \
        folder", path.display(), shortened(differences))]
    Differs {
        /// The file.
        path: PathBuf,
        /// Rest of the sentence "the folder was made ...".
        made: &'static str,
        /// One text per difference: `key was old, now new`.
        differences: Vec<String>,
    },
}

/// Value of [`ResumeError::Differs::made`] for another scenario.
pub const BY_OTHER_SCENARIO: &str = "by another scenario";

impl ResumeError {
    /// The message without the advice at its end.
    #[must_use]
    pub fn reason(&self) -> String {
        let text = self.to_string();
        text.strip_suffix(ADVICE).map_or_else(|| text.clone(), str::to_owned)
    }
}

/// Advice at the end of the message of every [`ResumeError`].
const ADVICE: &str = "; render without --resume, or into another folder";

impl RunManifest {
    /// Writes `run.json` into `folder`. A shard also writes `run.I-of-N.json`, so that the counts of all
    /// shards in one folder are kept.
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
        if let Some([shard, shards]) = self.shard {
            write_atomic(&folder.join(format!("run.{shard}-of-{shards}.json")), text.as_bytes())?;
        }
        write_atomic(&path, text.as_bytes())
    }
}

/// Fingerprints by paths relative to a folder.
#[must_use]
pub fn portable_inputs(inputs: &Inputs, folder: &Path) -> Inputs {
    let name = |path: &String| relative_to(Path::new(path), folder).to_string_lossy().into_owned();
    inputs.iter().map(|(path, fingerprint)| (name(path), fingerprint.clone())).collect()
}

/// Maximum number of differences that an error lists.
const MAX_LISTED: usize = 5;

/// Differences as text, the first [`MAX_LISTED`] in full.
fn shortened(differences: &[String]) -> String {
    let listed = differences[..differences.len().min(MAX_LISTED)].join("; ");
    let more = differences.len().saturating_sub(MAX_LISTED);
    if more > 0 { format!("{listed}; and {more} more") } else { listed }
}

/// Checks that the frames in `folder` were made from `scenario` with these inputs. `Ok(false)` if there is no
/// `run.json`, hence no frames.
///
/// # Errors
/// `run.json` cannot be read, or is of another scenario or of other inputs.
pub fn check_resume(folder: &Path, scenario: &Scenario, inputs: &Inputs) -> Result<bool, ResumeError> {
    let path = folder.join("run.json");
    let Some(run) = read_run(&path)? else { return Ok(false) };
    let parse =
        |error: serde_json::Error| ResumeError::Parse { path: path.clone(), message: error.to_string() };
    let (mut old, old_inputs) =
        (value_of(&run, "scenario", &path)?.clone(), value_of(&run, "inputs", &path)?);
    let mut new = through_text(&portable_scenario(scenario, folder).map_err(parse)?).map_err(parse)?;
    // Each twin has a folder and a `run.json` of its own.
    [&mut old, &mut new].into_iter().filter_map(|tree| tree.get_mut("output")?.as_object_mut()).for_each(
        |output| {
            output.remove("twin");
        },
    );
    let new_inputs = portable_inputs(inputs, folder);
    let moved = MovedFiles::between(&mut old, old_inputs, &mut new, &new_inputs);
    check_equal(&path, BY_OTHER_SCENARIO, &old, &new)?;
    let new_inputs = through_text(&new_inputs).map_err(parse)?;
    check_equal(&path, "when a file had something else in it", &moved.inputs(old_inputs), &new_inputs)?;
    Ok(true)
}

/// Checks that the pictures in `folder` are those of the same burst, or of no burst. `Ok(false)` as
/// [`check_resume`].
///
/// # Errors
/// As [`check_resume`].
pub fn check_burst(folder: &Path, twin: Option<&TwinRecord>) -> Result<bool, ResumeError> {
    let path = folder.join("run.json");
    let Some(run) = read_run(&path)? else { return Ok(false) };
    let parse =
        |error: serde_json::Error| ResumeError::Parse { path: path.clone(), message: error.to_string() };
    let new = through_text(&twin).map_err(parse)?;
    let burst = |twin: Option<&Value>| {
        let fields = ["instants", "over"].map(|key| (key, twin.and_then(|twin| twin.get(key)).cloned()));
        fields.into_iter().filter_map(|(key, value)| Some((format!("twin.{key}"), value?))).collect()
    };
    check_equal(
        &path,
        BY_OTHER_SCENARIO,
        &Value::Object(burst(run.get("twin"))),
        &Value::Object(burst(Some(&new))),
    )?;
    Ok(true)
}

/// As [`check_resume`], for the value at `key` of `run.json`. `made` completes the sentence "the folder was
/// made ..." in the error.
///
/// # Errors
/// As [`check_resume`].
pub fn check_resume_key(
    folder: &Path,
    key: &str,
    made: &'static str,
    new: &impl Serialize,
) -> Result<bool, ResumeError> {
    let path = folder.join("run.json");
    let Some(run) = read_run(&path)? else { return Ok(false) };
    let new = through_text(new)
        .map_err(|error| ResumeError::Parse { path: path.clone(), message: error.to_string() })?;
    check_equal(&path, made, value_of(&run, key, &path)?, &new)?;
    Ok(true)
}

/// Parses `run.json`; `None` if there is no such file.
fn read_run(path: &Path) -> Result<Option<Value>, ResumeError> {
    match std::fs::read_to_string(path) {
        Ok(text) => serde_json::from_str(&text)
            .map(Some)
            .map_err(|error| ResumeError::Parse { path: path.into(), message: error.to_string() }),
        Err(source) if source.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(ResumeError::Read { path: path.into(), source }),
    }
}

/// The value at a key of `run.json`.
fn value_of<'a>(run: &'a Value, key: &str, path: &Path) -> Result<&'a Value, ResumeError> {
    run.get(key).ok_or_else(|| ResumeError::Parse { path: path.into(), message: format!("it has no {key}") })
}

/// Serialises and parses a value, so that numbers with the same text are equal.
fn through_text(value: &impl Serialize) -> Result<Value, serde_json::Error> {
    serde_json::to_string(value).and_then(|text| serde_json::from_str(&text))
}

/// Reports all differences of two values.
fn check_equal(path: &Path, made: &'static str, old: &Value, new: &Value) -> Result<(), ResumeError> {
    let mut differences = Vec::new();
    collect_differences(old, new, "", &mut differences);
    if differences.is_empty() {
        Ok(())
    } else {
        Err(ResumeError::Differs { path: path.into(), made, differences })
    }
}

/// Files with unchanged content that were moved since a run.
struct MovedFiles {
    /// New paths by old paths.
    files: BTreeMap<String, String>,
    /// New folders of moved files by their old folders.
    folders: BTreeMap<PathBuf, PathBuf>,
}

impl MovedFiles {
    /// Compares the paths at equal keys of two scenarios. Old paths whose files have the same content at the
    /// new path are replaced by it.
    fn between(old: &mut Value, old_inputs: &Value, new: &mut Value, new_inputs: &Inputs) -> Self {
        let mut new_paths = BTreeMap::new();
        for_each_path(new, &mut |key, path| {
            new_paths.insert(key.to_owned(), path.clone());
        });
        let mut moved = Self { files: BTreeMap::new(), folders: BTreeMap::new() };
        for_each_path(old, &mut |key, path| {
            let Some(new_path) = new_paths.get(key).filter(|new_path| *new_path != path) else { return };
            let old_fingerprint = old_inputs.get(path.as_str()).and_then(Value::as_str);
            let new_fingerprint = new_inputs.get(new_path).map(String::as_str);
            if old_fingerprint.is_none()
                || old_fingerprint != new_fingerprint
                || old_fingerprint == Some(crate::inputs::NOT_READABLE)
            {
                return;
            }
            if let (Some(from), Some(to)) = (Path::new(path).parent(), Path::new(new_path).parent()) {
                moved.folders.insert(from.into(), to.into());
            }
            moved.files.insert(path.clone(), new_path.clone());
            path.clone_from(new_path);
        });
        moved
    }

    /// Old fingerprints at the new paths. Files that a moved file needs are expected beside it.
    fn inputs(&self, old: &Value) -> Value {
        let new_path = |path: &String| {
            let beside_moved_file = || {
                let folder = self.folders.get(Path::new(path).parent()?)?;
                Some(folder.join(Path::new(path).file_name()?).to_string_lossy().into_owned())
            };
            self.files.get(path).cloned().or_else(beside_moved_file).unwrap_or_else(|| path.clone())
        };
        let Value::Object(map) = old else { return old.clone() };
        Value::Object(map.iter().map(|(path, fingerprint)| (new_path(path), fingerprint.clone())).collect())
    }
}

/// Appends `key was old, now new` for each leaf that differs.
fn collect_differences(old: &Value, new: &Value, key: &str, differences: &mut Vec<String>) {
    if let (Value::Object(a), Value::Object(b)) = (old, new) {
        for name in a.keys().chain(b.keys().filter(|name| !a.contains_key(*name))) {
            let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            let [a, b] = [a, b].map(|map| map.get(name).unwrap_or(&Value::Null));
            collect_differences(a, b, &key, differences);
        }
    } else if old != new {
        let show = |value: &Value| if value.is_null() { "nothing".to_owned() } else { value.to_string() };
        differences.push(format!("{key} was {}, now {}", show(old), show(new)));
    }
}

/// Whether shard `[i, n]` (i from 1) renders frame `index`. A shard has every n-th frame, so that all shards
/// take about the same time.
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
            twin: None,
            scenario,
            inputs: [("a.csv".to_owned(), "3 bytes".to_owned())].into(),
            frames: [0, 10],
            shard: Some([2, 4]),
            written: 3,
            skipped: 0,
            finished: true,
            tracked_points: None,
            warnings: vec![],
        }
    }

    #[test]
    fn manifests_read_back_and_resume_only_their_own_scenario() {
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
    fn twins_have_manifests_of_their_own() {
        let dir = tempfile::tempdir().unwrap();
        let mut ours = manifest(scenario(&[("camera.shutter.exposure_ms", "8")]));
        ours.write(dir.path()).unwrap();
        let mut with_twin = ours.scenario.clone();
        let burst = TwinSpec { name: "burst".into(), instants: Some(9), ..TwinSpec::default() };
        with_twin.output.twin.push(burst.clone());
        assert!(check_resume(dir.path(), &with_twin, &ours.inputs).unwrap(), "a twin changes no frame");
        let record = TwinRecord::new(&burst);
        let error = check_burst(dir.path(), Some(&record)).unwrap_err().to_string();
        assert!(error.contains("twin.instants was nothing, now 9"), "{error}");
        assert!(check_burst(dir.path(), None).unwrap());
        ours.twin = Some(record.clone());
        ours.write(dir.path()).unwrap();
        assert!(check_burst(dir.path(), Some(&record)).unwrap());
        let error = check_burst(dir.path(), None).unwrap_err().to_string();
        assert!(error.contains("twin.over was \"exposure\", now nothing"), "{error}");
        let more = TwinRecord { instants: Some(11), ..record };
        assert!(check_burst(dir.path(), Some(&more)).is_err());
        assert!(!check_burst(&dir.path().join("none"), None).unwrap());
    }

    #[test]
    fn manifests_are_scenarios_that_repeat_the_run() {
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
        // Paths are relative to the folder of the manifest.
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
    fn moved_folders_and_inputs_can_be_resumed() {
        let base = tempfile::tempdir().unwrap();
        let path = |name: &str| base.path().join(name);
        std::fs::create_dir_all(path("data/maps")).unwrap();
        for name in ["data/a.csv", "data/g.png", "data/maps/g.pgw"] {
            std::fs::write(path(name), name).unwrap();
        }
        let read = |folder: &str| {
            let text = "[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n";
            let scenario = parse_scenario(text, &path(folder).join("s.toml"), &[]).unwrap();
            let mut inputs = crate::inputs::scenario_fingerprints(&scenario);
            // A file beside an input, such as a world file or a buffer of a model.
            let world_file = path(folder).join("g.pgw");
            inputs.insert(world_file.display().to_string(), "a world file".into());
            (scenario, inputs)
        };
        let (scenario, inputs) = read("data");
        let ours = RunManifest { inputs: inputs.clone(), ..manifest(scenario.clone()) };
        ours.write(&path("runs/out")).unwrap();
        assert!(check_resume(&path("runs/out"), &scenario, &inputs).unwrap());
        std::fs::rename(path("runs/out"), path("out")).unwrap();
        assert!(check_resume(&path("out"), &scenario, &inputs).unwrap(), "the folder is elsewhere");
        std::fs::rename(path("data"), path("other")).unwrap();
        let (scenario, inputs) = read("other");
        assert!(check_resume(&path("out"), &scenario, &inputs).unwrap(), "the inputs are elsewhere");
        std::fs::write(path("other/a.csv"), "another log").unwrap();
        let (scenario, inputs) = read("other");
        let error = check_resume(&path("out"), &scenario, &inputs).unwrap_err().to_string();
        assert!(error.contains("flight.log was \"../../data/a.csv\", now \"../other/a.csv\""), "{error}");
    }

    #[test]
    fn all_paths_of_a_scenario_are_made_relative() {
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
            gltf = [{ file = "x/8", placements = "x/9" }, { file = "x/10", motion = { poses = "x/11" } }]
            [output.tracks]
            points = ["terrain", "x/12.csv"]
        "#;
        let scenario = parse_scenario(text, Path::new("s.toml"), &[]).unwrap();
        let mut tree = serde_json::to_value(&scenario).unwrap();
        let mut visited = Vec::new();
        for_each_path(&mut tree, &mut |key, _| visited.push(key.replace(".0.", ".").replace(".1.", ".")));
        for (key, _) in keys().iter().filter(|(_, kind)| *kind == ValueKind::Path) {
            assert!(visited.iter().any(|visited| visited == key), "{key}");
        }
        assert!(visited.contains(&"output.tracks.points.1".to_owned()), "{visited:?}");
        assert_eq!(visited.len(), 12);
    }

    #[test]
    fn shards_partition_the_frames() {
        for index in 0..20 {
            assert_eq!((1..=4).filter(|&i| in_shard(index, [i, 4])).count(), 1);
        }
        assert!(!in_shard(0, [1, 0]));
    }
}
