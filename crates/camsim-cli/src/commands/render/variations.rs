//! `camsim render` of a scenario with `[randomize]`: variations, each in a folder of its own.

use std::{cell::OnceCell, path::Path};

use anyhow::anyhow;
use camsim_io::{
    manifest::in_shard,
    scenario_file::RandomScenario,
    write::{VariationsError, variation_folder, write_variations},
};

use super::{
    RenderArgs,
    stage::{Part, Stage},
    summary,
};
use crate::{
    commands::export::export_datasets,
    console::Console,
    failure::{Failure, OrFail},
    inputs::refuse_fixed,
    progress::waiting,
    render_run::{Lock, Outcome},
};

/// Renders the variations of this run's shard.
pub fn run(
    args: &RenderArgs,
    scenario: &RandomScenario,
    folder: &Path,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    refuse_fixed(scenario)?;
    let all = numbers(args, scenario).map_err(|message| Failure::bad_input(anyhow!(message)))?;
    refuse(args, folder, &all)?;
    let ours: Vec<u64> = all
        .iter()
        .copied()
        .filter(|&index| args.shard.is_none_or(|shard| in_shard(index, shard.0)))
        .collect();
    // What is out of range is reported before anything is written.
    let checking = waiting("checking variations", console.is_quiet());
    let checked = scenario.check(&ours).or_bad_input();
    checking.finish_and_clear();
    checked?;
    write_table(folder, scenario, &all)?;
    let engine = OnceCell::new();
    let (mut stage, mut total) = (Stage::new(&engine), Outcome::default());
    console.begin_series();
    for &index in &ours {
        console.set_variation(Some(index));
        let variation = scenario.variation(index).or_bad_input()?;
        let target = folder.join(variation_folder(index));
        let datasets = variation.rig.first().output.datasets.clone();
        let record = Some(variation.record());
        let part = Part { rig: variation.rig, folder: &target, variation: record, export: None, shard: None };
        let outcome = stage.render(args, part, console).map_err(|failure| failure.of_variation(index))?;
        export_datasets(&target, &datasets, true, console).map_err(|failure| failure.of_variation(index))?;
        total.add(&outcome);
    }
    console.set_variation(None);
    let text = format!("{} variations: {}", ours.len(), summary(&total, folder));
    stage.report(args, &total, &text, console)
}

/// Numbers of the variations of all shards, in ascending order.
fn numbers(args: &RenderArgs, scenario: &RandomScenario) -> Result<Vec<u64>, String> {
    match (&args.variations, scenario.variations()) {
        (Some(list), count) => list.variations(count),
        (None, Some(count)) => Ok((0..count).collect()),
        (None, None) => {
            Err("the scenario has [randomize]: choose variations by --variations 0..100, or state \
                             randomize.variations"
                .into())
        }
    }
}

/// Refuses what only one variation can have, and folders of other frames.
fn refuse(args: &RenderArgs, folder: &Path, all: &[u64]) -> Result<(), Failure> {
    if args.pipe && all.len() > 1 {
        return Err(Failure::bad_input(anyhow!(
            "--pipe passes on the frames of one variation: choose it by --variation K"
        )));
    }
    if folder.join("run.json").exists() {
        return Err(Failure::bad_input(anyhow!(
            "{} has frames of a scenario without [randomize]: choose another folder with -o, or remove that one",
            folder.display()
        )));
    }
    Ok(())
}

/// Adds all of them to `variations.csv`: shards write the same table.
fn write_table(folder: &Path, scenario: &RandomScenario, all: &[u64]) -> Result<(), Failure> {
    let _lock = Lock::take(folder)?;
    match write_variations(folder, scenario, all) {
        Err(error @ VariationsError::Write(_)) => Err(error).or_failed(),
        written => written.or_bad_input(),
    }
}
