//! The scenarios of the tables.

use std::{path::PathBuf, sync::Arc};

use camsim::{
    core::sequence::Sequence,
    io::{
        load::{load_rig, load_sequence},
        scenario_file::{read_rig, read_scenario},
    },
};

use crate::flight::Outcome;

/// The scenario of most tables.
pub const ALL_EFFECTS: &str = "benches/all_effects.toml";
/// The terrain with 5000 houses.
pub const HOUSES: &str = "benches/houses.toml";
/// Stereo low over grass, houses and trees.
pub const VIO_TOWN: &str = "benches/scenes/vio_town.toml";
/// Frames of a scenario that are measured.
pub const FRAMES: u64 = 96;

/// Path of a file in the repository.
pub fn in_repository(path: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join(path)
}

/// [`ALL_EFFECTS`] with changed keys.
pub fn all_effects_with(sets: &[(&str, String)]) -> Outcome<Arc<Sequence>> {
    sequence_with(ALL_EFFECTS, sets)
}

/// A scenario of the repository with changed keys.
pub fn sequence_with(path: &str, sets: &[(&str, String)]) -> Outcome<Arc<Sequence>> {
    let sets: Vec<(String, String)> =
        sets.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
    Ok(load_sequence(&read_scenario(&in_repository(path), &sets, None)?)?.sequence)
}

/// The cameras of a scenario of the repository.
pub fn rig(path: &str) -> Outcome<Vec<Arc<Sequence>>> {
    let loaded = load_rig(&read_rig(&in_repository(path), &[], None)?)?;
    Ok(loaded.into_iter().map(|loaded| loaded.sequence).collect())
}

/// [`ALL_EFFECTS`] with the paper's preset.
pub fn paper_preset() -> Outcome<Arc<Sequence>> {
    all_effects_with(&[("quality.preset", "\"paper\"".to_owned())])
}
