//! Input that several commands share: a scenario with changes, and loading of its files.

use std::path::{Path, PathBuf};

use anyhow::anyhow;
use camsim_core::{
    flight_log::FlightLog,
    scenario::{Preset, Rig, Scenario, keys::Key},
    tracker::TrackResult,
};
use camsim_io::{
    load::{Loaded, flight_warnings, load_flight, load_sequence, reload_rig, reload_sequence},
    scenario_file::{RandomScenario, ValueKind, keys, read_random_scenario},
};
use clap::builder::{PossibleValue, TypedValueParser};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
    frame_list::whole_number,
};

/// A scenario file, and changes of it by the command line.
#[derive(Clone, Debug, clap::Args)]
pub struct ScenarioArgs {
    /// Scenario (TOML); `camsim render --print-default` prints one with every key explained
    pub scenario: PathBuf,
    #[command(flatten)]
    pub changes: Changes,
    /// Camera of a scenario with [[cameras]], by its name [default: the first]
    #[arg(long, value_name = "NAME")]
    pub camera: Option<String>,
    /// Variation of a scenario with [randomize] [default: without what is drawn]
    #[arg(long, value_name = "K", value_parser = whole_number, allow_hyphen_values = true)]
    pub variation: Option<u64>,
}

/// Changes of a scenario by the command line.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Changes {
    /// Change a key of the scenario: --set camera.shutter.readout_ms=0 (may be repeated)
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = SetParser, hide_possible_values = true)]
    pub sets: Vec<(String, String)>,
    /// Set of methods: camsim's own, or the paper's
    #[arg(long, value_enum)]
    pub preset: Option<PresetArg>,
}

impl Changes {
    /// The options as typed.
    fn words(&self) -> Vec<String> {
        let sets = self.sets.iter().flat_map(|(key, value)| ["--set".to_owned(), format!("{key}={value}")]);
        let preset = self
            .preset
            .iter()
            .flat_map(|preset| ["--preset".to_owned(), format!("{preset:?}").to_lowercase()]);
        sets.chain(preset).collect()
    }
}

/// `--preset`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum PresetArg {
    /// The cheapest methods that keep the tolerances
    Default,
    /// The methods and approximations of the paper
    Paper,
}

/// Parser of `--set`, which completes the keys.
#[derive(Clone, Debug)]
struct SetParser;

impl TypedValueParser for SetParser {
    type Value = (String, String);

    fn parse_ref(
        &self,
        command: &clap::Command,
        arg: Option<&clap::Arg>,
        value: &std::ffi::OsStr,
    ) -> Result<Self::Value, clap::Error> {
        parse_set.parse_ref(command, arg, value)
    }

    fn possible_values(&self) -> Option<Box<dyn Iterator<Item = PossibleValue> + '_>> {
        let keys = keys().iter().filter(|key| key.field.kind != ValueKind::Tables);
        let value = |key: &Key| PossibleValue::new(format!("{}=", key.name)).help(key.field.summary());
        Some(Box::new(keys.map(value)))
    }
}

fn parse_set(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err("write KEY=VALUE, such as camera.fps=25".to_owned()),
    }
}

impl ScenarioArgs {
    /// Reads the scenario, of one of its cameras, and applies the changes; hints name both from then on.
    pub fn read(&self, console: &mut Console<'_>) -> Result<Scenario, Failure> {
        let rig = read_changed_rig(&self.scenario, &self.changes, self.variation, console)?;
        choose_camera(&rig, self.camera.as_deref(), console).cloned()
    }
}

/// Reads a scenario, or one variation of it, and applies the changes; hints name it from then on.
pub fn read_changed_rig(
    path: &Path,
    changes: &Changes,
    variation: Option<u64>,
    console: &mut Console<'_>,
) -> Result<Rig, Failure> {
    let scenario = read_changed(path, changes, console)?;
    let Some(index) = variation else {
        if scenario.is_random() {
            console.note("[randomize] is not applied: --variation K chooses values");
        }
        return Ok(scenario.into_base());
    };
    refuse_fixed(&scenario)?;
    console.set_variation(Some(index));
    Ok(scenario.variation(index).or_bad_input()?.rig)
}

/// Refuses a scenario without `[randomize]` where a variation is asked for.
pub fn refuse_fixed(scenario: &RandomScenario) -> Result<(), Failure> {
    if scenario.is_random() {
        return Ok(());
    }
    Err(Failure::bad_input(anyhow!(
        "the scenario has no [randomize], so it has no variations: leave out --variation, or add [randomize]"
    )))
}

/// Reads a scenario of one camera or several, which may have `[randomize]`, and applies the changes; hints name it
/// from then on.
pub fn read_changed(
    path: &Path,
    changes: &Changes,
    console: &mut Console<'_>,
) -> Result<RandomScenario, Failure> {
    console.set_scenario(path, changes.words());
    let preset = changes.preset.map(|preset| match preset {
        PresetArg::Default => Preset::Default,
        PresetArg::Paper => Preset::Paper,
    });
    read_random_scenario(path, &changes.sets, preset).or_bad_input()
}

/// The scenario of the camera with a name. Without a name it is that of the first one; of several, a note says
/// so.
pub fn choose_camera<'r>(
    rig: &'r Rig,
    name: Option<&str>,
    console: &mut Console<'_>,
) -> Result<&'r Scenario, Failure> {
    let scenario = match name {
        Some(name) => &rig.scenarios()[camera_position(rig, name)?],
        None => rig.first(),
    };
    if rig.is_list() {
        console.set_camera(Some(&scenario.camera.name));
        if name.is_none() && rig.scenarios().len() > 1 {
            let names: Vec<&str> = rig.names().collect();
            console.note(format_args!(
                "camera {}, the first of {}: --camera NAME chooses another",
                names[0],
                names.join(", ")
            ));
        }
    }
    Ok(scenario)
}

/// Number of the camera with a name, of `--camera`.
pub fn camera_position(rig: &Rig, name: &str) -> Result<usize, Failure> {
    let names = || rig.names().collect::<Vec<_>>().join(", ");
    rig.position(name).ok_or_else(|| {
        Failure::bad_input(match (rig.is_list(), rig.first().camera.name.as_str()) {
            (true, _) => anyhow!("--camera {name}: there is no such camera; the cameras are {}", names()),
            (false, "") => {
                anyhow!("--camera {name}: the scenario has one [camera], without a name; leave it out")
            }
            (false, only) => anyhow!("--camera {name}: the scenario has one [camera], named {only}"),
        })
    })
}

/// Loads the files of a scenario, and prints warnings.
pub fn load(scenario: &Scenario, console: &mut Console<'_>) -> Result<Loaded, Failure> {
    with_warnings(load_sequence(scenario).or_bad_input()?, console)
}

/// Prints the warnings of a loaded scenario.
fn with_warnings(mut loaded: Loaded, console: &mut Console<'_>) -> Result<Loaded, Failure> {
    loaded.warnings.iter_mut().for_each(|warning| *warning = console.whole(warning));
    for warning in &loaded.warnings {
        console.warn(warning);
    }
    print_details(&loaded.sequence.scenario, &loaded.log, console);
    Ok(loaded)
}

/// As [`load`], for all cameras of a rig. A warning that several of them have is printed once, with their names if
/// not all have it. What is the same in `before` is not read again.
pub fn load_cameras(rig: &Rig, before: &[Loaded], console: &mut Console<'_>) -> Result<Vec<Loaded>, Failure> {
    if !rig.is_list() {
        let loaded = match before.first() {
            Some(before) => reload_sequence(rig.first(), before),
            None => load_sequence(rig.first()),
        };
        return Ok(vec![with_warnings(loaded.or_bad_input()?, console)?]);
    }
    let mut all = reload_rig(rig, before).or_bad_input()?;
    let told = warnings_of_cameras(rig.names().zip(all.iter().map(|loaded| &loaded.warnings[..])));
    for (warning, names) in &told {
        if names.len() == all.len() {
            console.warn(console.whole(warning));
            continue;
        }
        console.set_camera(names.first().copied());
        let s = if names.len() == 1 { "" } else { "s" };
        console.warn(format_args!("camera{s} {}: {}", names.join(", "), console.whole(warning)));
        console.set_camera(None);
    }
    let told: Vec<(String, usize)> =
        told.into_iter().map(|(warning, names)| (warning, names.len())).collect();
    let of_all = all.len();
    for (loaded, name) in all.iter_mut().zip(rig.names()) {
        for warning in &mut loaded.warnings {
            let is_shared = told.iter().any(|(text, cameras)| text == warning && *cameras == of_all);
            console.set_camera((!is_shared).then_some(name));
            *warning = console.whole(warning);
        }
    }
    console.set_camera(None);
    print_details(rig.first(), &all[0].log, console);
    Ok(all)
}

/// Each warning with the names of the cameras that have it, those of the most cameras first.
fn warnings_of_cameras<'a>(
    cameras: impl Iterator<Item = (&'a str, &'a [String])>,
) -> Vec<(String, Vec<&'a str>)> {
    let mut told: Vec<(String, Vec<&str>)> = Vec::new();
    for (name, warnings) in cameras {
        for warning in warnings {
            match told.iter_mut().find(|(text, _)| text == warning) {
                Some((_, names)) if names.contains(&name) => {}
                Some((_, names)) => names.push(name),
                None => told.push((warning.clone(), vec![name])),
            }
        }
    }
    told.sort_by_key(|(_, names)| std::cmp::Reverse(names.len()));
    told
}

/// Loads and tracks the log, without the scene.
pub fn load_flight_only(
    scenario: &Scenario,
    console: &mut Console<'_>,
) -> Result<(FlightLog, TrackResult), Failure> {
    let (log, tracked) = load_flight(scenario).or_bad_input()?;
    for warning in flight_warnings(scenario, &log, &tracked) {
        console.warn(warning);
    }
    print_details(scenario, &log, console);
    Ok((log, tracked))
}

/// Prints the notes of the log's reader that are no warnings.
fn print_details(scenario: &Scenario, log: &FlightLog, console: &mut Console<'_>) {
    let file = scenario.flight.log.display();
    // Repairs are a warning, and have been printed.
    if log.report.is_clean() {
        console.detail(format_args!("{file}: {}", log.report));
    }
    for note in log.notes.iter().filter(|note| !note.is_warning) {
        console.detail(format_args!("{file}: {}", note.text));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_of_several_cameras_is_told_once_with_their_names() {
        let [left, right, down] = [&["b", "a"][..], &["a", "b", "b"], &["a"]]
            .map(|texts| texts.iter().map(|&text| text.to_owned()).collect::<Vec<_>>());
        let cameras = [("left", &left[..]), ("right", &right[..]), ("down", &down[..])];
        let told = warnings_of_cameras(cameras.into_iter());
        assert_eq!(
            told,
            [("a".to_owned(), vec!["left", "right", "down"]), ("b".to_owned(), vec!["left", "right"])]
        );
    }

    #[test]
    fn set_splits_at_the_first_equals_sign() {
        assert_eq!(parse_set("a.b = c=d"), Ok(("a.b".to_owned(), "c=d".to_owned())));
        assert_eq!(parse_set("a="), Ok(("a".to_owned(), String::new())));
        assert!(parse_set("a").is_err());
        assert!(parse_set("=1").is_err());
    }
}
