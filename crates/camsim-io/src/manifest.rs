//! `run.json`: what made the files of a folder, so that the run can be repeated, and resumed only by the same scenario.

use std::path::{Path, PathBuf};

use camsim_core::scenario::Scenario;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use thiserror::Error;

use crate::{
    inputs::Inputs,
    write::{WriteError, write_atomic},
};

/// Contents of `run.json`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct RunManifest {
    /// Version of camsim.
    pub version: String,
    /// Adapter and driver, in words.
    pub adapter: String,
    /// Seed of every random number (as in the scenario).
    pub seed: u64,
    /// The scenario with all defaults, `--set` and paths resolved.
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
    #[error("{} is not a run.json of camsim ({message}); render without --resume, or into another folder", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// The parser's words.
        message: String,
    },
    /// Another scenario, or other files.
    #[error("{} was made {made}: {}; render without --resume, or into another folder", path.display(), shortened(differences))]
    Differs {
        /// The file.
        path: PathBuf,
        /// By what, or from what.
        made: &'static str,
        /// `key was old, now new`.
        differences: Vec<String>,
    },
}

impl RunManifest {
    /// Writes `run.json` into `folder`; a shard also writes `run.I-of-N.json`, so that shards in one folder keep their own counts.
    ///
    /// # Errors
    /// As [`write_atomic`].
    pub fn write(&self, folder: &Path) -> Result<(), WriteError> {
        let path = folder.join("run.json");
        let fail = |error: serde_json::Error| WriteError::Encode { path: path.clone(), message: error.to_string() };
        let text = serde_json::to_string_pretty(self).map_err(fail)? + "\n";
        if let Some([shard, of]) = self.shard {
            write_atomic(&folder.join(format!("run.{shard}-of-{of}.json")), text.as_bytes())?;
        }
        write_atomic(&path, text.as_bytes())
    }
}

/// Most differences that an error lists.
const MOST_LISTED: usize = 5;

fn shortened(differences: &[String]) -> String {
    let listed = differences[..differences.len().min(MOST_LISTED)].join("; ");
    let more = differences.len().saturating_sub(MOST_LISTED);
    if more > 0 { format!("{listed}; and {more} more") } else { listed }
}

/// Whether frames already in `folder` belong to `scenario` and to what is in its files. A folder without `run.json` holds none: `Ok(false)`.
///
/// # Errors
/// `run.json` cannot be read, or another scenario made it, or the same with other files.
pub fn check_resume(folder: &Path, scenario: &Scenario, inputs: &Inputs) -> Result<bool, ResumeError> {
    Ok(check_resume_of(folder, "scenario", "by another scenario", scenario)?
        && check_resume_of(folder, "inputs", "when a file had something else in it", inputs)?)
}

/// As [`check_resume`], of whatever stands under `key` in `run.json`; `made` is how the folder was made if that differs.
///
/// # Errors
/// As [`check_resume`].
pub fn check_resume_of(folder: &Path, key: &str, made: &'static str, here: &impl Serialize) -> Result<bool, ResumeError> {
    let path = folder.join("run.json");
    let text = match std::fs::read_to_string(&path) {
        Ok(text) => text,
        Err(source) if source.kind() == std::io::ErrorKind::NotFound => return Ok(false),
        Err(source) => return Err(ResumeError::Read { path, source }),
    };
    let parse = |error: serde_json::Error| ResumeError::Parse { path: path.clone(), message: error.to_string() };
    let there: Value = serde_json::from_str(&text).map_err(parse)?;
    let there = there.get(key).ok_or_else(|| ResumeError::Parse { path: path.clone(), message: format!("it has no {key}") })?;
    // Through text, so that numbers that print alike are alike.
    let here: Value = serde_json::to_string(here).and_then(|text| serde_json::from_str(&text)).map_err(parse)?;
    let mut differences = Vec::new();
    compare(there, &here, "", &mut differences);
    if differences.is_empty() { Ok(true) } else { Err(ResumeError::Differs { path, made, differences }) }
}

fn compare(there: &Value, here: &Value, key: &str, differences: &mut Vec<String>) {
    if let (Value::Object(a), Value::Object(b)) = (there, here) {
        for name in a.keys().chain(b.keys().filter(|name| !a.contains_key(*name))) {
            let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
            compare(a.get(name).unwrap_or(&Value::Null), b.get(name).unwrap_or(&Value::Null), &key, differences);
        }
    } else if there != here {
        let show = |value: &Value| if value.is_null() { "nothing".to_owned() } else { value.to_string() };
        differences.push(format!("{key} was {}, now {}", show(there), show(here)));
    }
}

/// Whether shard `[i, n]` (i from 1) has frame `index`: every n-th frame, so that shards take about the same time.
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
        let ours = manifest(scenario(&[("camera.fps", "29.97"), ("camera.mount.angles_deg", "[0.1, -0.3, 1e-7]")]));
        ours.write(dir.path()).unwrap();
        let text = std::fs::read_to_string(dir.path().join("run.2-of-4.json")).unwrap();
        assert_eq!(serde_json::from_str::<RunManifest>(&text).unwrap(), ours);
        assert!(check_resume(dir.path(), &ours.scenario, &ours.inputs).unwrap());
        let changed = [("a.csv".to_owned(), "4 bytes".to_owned())].into();
        let error = check_resume(dir.path(), &ours.scenario, &changed).unwrap_err().to_string();
        assert!(error.contains("a.csv was \"3 bytes\", now \"4 bytes\""), "{error}");

        let mut other = ours.scenario.clone();
        other.camera.fps = 25.0;
        other.scene.fog_visibility_m = Some(900.0);
        let error = check_resume(dir.path(), &other, &ours.inputs).unwrap_err().to_string();
        assert!(error.contains("camera.fps was 29.97, now 25") && error.contains("scene.fog_visibility_m was nothing, now 900"), "{error}");

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
        let ours = manifest(parse_scenario(text, Path::new("there/s.toml"), &[]).unwrap());
        ours.write(dir.path()).unwrap();
        let run = dir.path().join("run.json");
        // Paths are those of the working directory, not of the folder that the manifest is in.
        assert_eq!(ours.scenario.flight.log, Path::new("there/logs/a.csv"));
        assert_eq!(read_scenario(&run, &[], None).unwrap(), ours.scenario);
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
    fn shards_share_out_all_frames_once() {
        for index in 0..20 {
            assert_eq!((1..=4).filter(|&i| in_shard(index, [i, 4])).count(), 1);
        }
        assert!(!in_shard(0, [1, 0]));
    }
}
