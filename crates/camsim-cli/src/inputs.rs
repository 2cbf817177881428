//! Input that several commands share: a scenario with changes, and loading of its files.

use std::path::PathBuf;

use camsim_core::{
    flight_log::FlightLog,
    scenario::{Preset, Scenario},
    tracker::TrackResult,
};
use camsim_io::{
    load::{Loaded, flight_warnings, load_flight, load_sequence},
    scenario_file::read_scenario,
};

use crate::{
    console::Console,
    failure::{Failure, OrFail},
};

/// A scenario file, and changes of it by the command line.
#[derive(Clone, Debug, clap::Args)]
pub struct ScenarioArgs {
    /// Scenario (TOML); `camsim render --print-default` prints one with every key explained
    pub scenario: PathBuf,
    #[command(flatten)]
    pub changes: Changes,
}

/// Changes of a scenario by the command line.
#[derive(Clone, Debug, Default, clap::Args)]
pub struct Changes {
    /// Change a key of the scenario: --set camera.shutter.readout_ms=0 (may be repeated)
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = parse_set)]
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

fn parse_set(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((key, value)) if !key.trim().is_empty() => Ok((key.trim().to_owned(), value.trim().to_owned())),
        _ => Err("write KEY=VALUE, such as camera.fps=25".to_owned()),
    }
}

impl ScenarioArgs {
    /// Reads the scenario and applies the changes; hints name it from then on.
    pub fn read(&self, console: &mut Console<'_>) -> Result<Scenario, Failure> {
        console.set_scenario(&self.scenario, self.changes.words());
        let preset = self.changes.preset.map(|preset| match preset {
            PresetArg::Default => Preset::Default,
            PresetArg::Paper => Preset::Paper,
        });
        read_scenario(&self.scenario, &self.changes.sets, preset).or_bad_input()
    }
}

/// Loads the files of a scenario, and prints warnings.
pub fn load(scenario: &Scenario, console: &mut Console<'_>) -> Result<Loaded, Failure> {
    let mut loaded = load_sequence(scenario).or_bad_input()?;
    loaded.warnings.iter_mut().for_each(|warning| *warning = console.whole(warning));
    for warning in &loaded.warnings {
        console.warn(warning);
    }
    print_details(scenario, &loaded.log, console);
    Ok(loaded)
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
    console.detail(format_args!("{file}: {}", log.report));
    for note in log.notes.iter().filter(|note| !note.is_warning) {
        console.detail(format_args!("{file}: {}", note.text));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn set_splits_at_the_first_equals_sign() {
        assert_eq!(parse_set("a.b = c=d"), Ok(("a.b".to_owned(), "c=d".to_owned())));
        assert_eq!(parse_set("a="), Ok(("a".to_owned(), String::new())));
        assert!(parse_set("a").is_err());
        assert!(parse_set("=1").is_err());
    }
}
