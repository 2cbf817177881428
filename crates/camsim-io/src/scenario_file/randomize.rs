//! `[randomize]`: scenarios whose values are drawn.
//!
//! Variation k of a scenario is a scenario without `[randomize]`, with concrete values instead of the drawn ones. Each
//! value is a function of the seed, its key as written, and k, so that variations can be made in any order, and values
//! stay when other keys are added or fixed by `--set`.

use std::path::Path;

use camsim_core::{
    distribution::Draws,
    scenario::{Preset, Rig},
};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value as Json};
use toml::{Table, Value};

use super::{ScenarioError, rig_of_tree, rig_table, stated_rig, tree::Tree};

mod draw;
mod law;
mod written;

use draw::Draw;
use written::{Written, schema_key};

/// The table.
pub const RANDOMIZE: &str = "randomize";
/// Name of the random numbers that give each variation its seed, and the key that they set.
const SEED: &str = "seed";

/// A scenario as it is read: of one camera or several, with `[randomize]` or without.
#[derive(Clone, Debug)]
pub struct RandomScenario {
    tree: Tree,
    /// The scenario without what is drawn.
    base: Rig,
    /// As `base`, before `camera.resized` is applied.
    stated: Rig,
    /// The tree of `stated`, with all defaults.
    defaults: Table,
    preset: Option<Preset>,
    /// Without one there are no variations.
    spec: Option<RandomizeSpec>,
    /// The table that `spec` was read from.
    written: Option<Written>,
}

/// `[randomize]`.
#[derive(Clone, Debug)]
struct RandomizeSpec {
    seed: u64,
    variations: Option<u64>,
    own_seed: bool,
    draws: Vec<Draw>,
}

/// A value that a variation has drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawn {
    /// Dotted key, with names of cameras and numbers of other elements of lists.
    pub key: String,
    /// The value; paths as they are written.
    pub value: Value,
    /// Whether it is a list of numbers of their own, each with a column in tables.
    pub is_numbers: bool,
}

/// One scenario of those that `[randomize]` describes.
#[derive(Clone, Debug)]
pub struct Variation {
    /// Its number.
    pub index: u64,
    /// The concrete scenario.
    pub rig: Rig,
    /// What was drawn.
    pub drawn: Vec<Drawn>,
    /// Seed of the draws.
    seed: u64,
}

/// What `run.json` says of a variation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct VariationRecord {
    /// Its number.
    pub index: u64,
    /// Seed of the draws.
    pub seed: u64,
    /// The drawn values by their keys.
    pub values: Map<String, Json>,
}

/// Reads a scenario that may have `[randomize]`, otherwise as [`super::read_rig`].
///
/// # Errors
/// As [`super::read_rig`]; keys and distributions of `[randomize]` that do not fit.
pub fn read_random_scenario(
    path: &Path,
    sets: &[(String, String)],
    preset: Option<Preset>,
) -> Result<RandomScenario, ScenarioError> {
    RandomScenario::new(Tree::read_scenario(path)?, sets, preset)
}

/// As [`read_random_scenario`], from the text of the file `path`, which is not read.
///
/// # Errors
/// As [`read_random_scenario`].
pub fn parse_random_scenario(
    text: &str,
    path: &Path,
    sets: &[(String, String)],
) -> Result<RandomScenario, ScenarioError> {
    RandomScenario::new(Tree::parse(text, path, "")?, sets, None)
}

/// Variation `index` of the scenario in a text, and what was drawn. `path` is the file's, which is not read.
///
/// # Errors
/// As [`read_random_scenario`], and values that are out of range.
pub fn randomize(text: &str, path: &Path, index: u64) -> Result<Variation, ScenarioError> {
    parse_random_scenario(text, path, &[])?.variation(index)
}

impl RandomScenario {
    pub(super) fn new(
        mut tree: Tree,
        sets: &[(String, String)],
        preset: Option<Preset>,
    ) -> Result<Self, ScenarioError> {
        tree.resolve_cameras()?;
        let mut written = Written::take(&mut tree)?;
        let mut fixed = Vec::new();
        for (key, text) in sets {
            match key.strip_prefix(RANDOMIZE).and_then(|rest| rest.strip_prefix('.')) {
                Some(rest) => {
                    Written::set(&mut written, &mut tree, rest, text);
                    // The later word counts.
                    fixed.retain(|key: &String| !overlaps(&schema_key(key), &schema_key(rest)));
                }
                None => {
                    tree.set(key, text)?;
                    fixed.extend(tree.numbered(key));
                }
            }
        }
        tree.check_cameras()?;
        let base = rig_of_tree(&mut tree.clone(), preset)?;
        // Values are drawn for the keys as the file states them, which camera.resized changes afterwards.
        let stated = stated_rig(&mut tree.clone(), preset)?;
        let defaults = rig_table(&stated)
            .map_err(|error| ScenarioError::Problems(vec![format!("{}: {error}", tree.file.display())]))?;
        let spec = written.as_ref().map(|written| written.spec(&tree, &defaults, base.first().seed, &fixed));
        Ok(Self { spec: spec.transpose()?, written, tree, base, stated, defaults, preset })
    }

    /// The scenario without what is drawn.
    #[must_use]
    pub fn base(&self) -> &Rig {
        &self.base
    }

    /// As [`Self::base`], with `camera.resized` and the camera that it is applied to: what `[randomize]` draws are
    /// values of that camera.
    #[must_use]
    pub fn stated(&self) -> &Rig {
        &self.stated
    }

    /// As [`Self::base`].
    #[must_use]
    pub fn into_base(self) -> Rig {
        self.base
    }

    /// Whether it has `[randomize]`.
    #[must_use]
    pub fn is_random(&self) -> bool {
        self.spec.is_some()
    }

    /// Number of variations, if it is stated.
    #[must_use]
    pub fn variations(&self) -> Option<u64> {
        self.spec.as_ref()?.variations
    }

    /// `[randomize]` with absolute paths, for the same scenario in another folder; `None` without one.
    ///
    /// # Errors
    /// Of a key with `*`, only some elements are drawn, which a table cannot say.
    pub fn randomize_table(&self) -> Result<Option<Json>, ScenarioError> {
        let (Some(spec), Some(written)) = (&self.spec, &self.written) else { return Ok(None) };
        let mut table = Map::new();
        for draw in &spec.draws {
            table.insert(draw.name().to_owned(), written.portable(draw, &self.tree)?);
        }
        table.insert(SEED.into(), spec.seed.into());
        table.insert("own_seed".into(), spec.own_seed.into());
        if let Some(count) = spec.variations {
            table.insert("variations".into(), count.into());
        }
        Ok(Some(Json::Object(table)))
    }

    /// The concrete scenario of variation `index`; without `[randomize]` it is that of the file.
    ///
    /// # Errors
    /// [`ScenarioError::Variation`]: drawn values do not fit, or are out of range.
    pub fn variation(&self, index: u64) -> Result<Variation, ScenarioError> {
        let Some(spec) = &self.spec else {
            return Ok(Variation { index, rig: self.base.clone(), drawn: Vec::new(), seed: 0 });
        };
        let mut tree = self.tree.clone();
        let mut drawn = Vec::new();
        let rig = self
            .draw_into(spec, index, &mut tree, &mut drawn)
            .and_then(|()| rig_of_tree(&mut tree, self.preset))
            .map_err(|source| of_variation(index, &drawn, source))?;
        Ok(Variation { index, rig, drawn, seed: spec.seed })
    }

    /// Checks the scenarios of these variations.
    ///
    /// # Errors
    /// The first of [`Self::variation`].
    pub fn check(&self, indices: &[u64]) -> Result<(), ScenarioError> {
        let found =
            indices.par_iter().map(|index| self.variation(*index).map(|_| ())).find_first(Result::is_err);
        found.unwrap_or(Ok(()))
    }

    /// What variation `index` draws, without a check of the scenario.
    ///
    /// # Errors
    /// [`ScenarioError::Variation`]: a drawn value does not fit its key.
    pub fn drawn(&self, index: u64) -> Result<Vec<Drawn>, ScenarioError> {
        let mut drawn = Vec::new();
        let Some(spec) = &self.spec else { return Ok(drawn) };
        self.draw_into(spec, index, &mut self.tree.clone(), &mut drawn)
            .map_err(|source| of_variation(index, &drawn, source))?;
        Ok(drawn)
    }

    /// Draws the values of a variation and puts them into its tree.
    fn draw_into(
        &self,
        spec: &RandomizeSpec,
        index: u64,
        tree: &mut Tree,
        drawn: &mut Vec<Drawn>,
    ) -> Result<(), ScenarioError> {
        for draw in &spec.draws {
            draw.put(tree, &self.defaults, spec.seed, index, drawn)?;
        }
        if spec.own_seed {
            let value = Value::Integer(Draws::new(spec.seed, SEED).bits(index) as i64);
            let location = tree.location(RANDOMIZE);
            tree.put(SEED, value.clone(), &location, |message| ScenarioError::Problems(vec![message]))?;
            drawn.push(Drawn { key: SEED.into(), value, is_numbers: false });
        }
        Ok(())
    }
}

impl Variation {
    /// The record for `run.json`.
    #[must_use]
    pub fn record(&self) -> VariationRecord {
        VariationRecord { index: self.index, seed: self.seed, values: drawn_json(&self.drawn) }
    }
}

/// Drawn values by their keys.
#[must_use]
pub fn drawn_json(drawn: &[Drawn]) -> Map<String, Json> {
    let json = |value: &Value| serde_json::to_value(value).unwrap_or_default();
    drawn.iter().map(|drawn| (drawn.key.clone(), json(&drawn.value))).collect()
}

/// Whether one of two keys is the other, or stands below it.
fn overlaps(a: &str, b: &str) -> bool {
    let is_below = |key: &str, table: &str| {
        key.strip_prefix(table).is_some_and(|rest| rest.is_empty() || rest.starts_with('.'))
    };
    is_below(a, b) || is_below(b, a)
}

/// An error of a variation, with the values that it may come from.
fn of_variation(variation: u64, drawn: &[Drawn], source: ScenarioError) -> ScenarioError {
    /// Values that a message lists at most.
    const MOST: usize = 8;
    let text = source.to_string();
    let named: Vec<&Drawn> = drawn.iter().filter(|drawn| text.contains(&drawn.key)).collect();
    let listed = if named.is_empty() { drawn.iter().collect() } else { named };
    let mut values: Vec<String> =
        listed.iter().take(MOST).map(|drawn| format!("{} = {}", drawn.key, drawn.value)).collect();
    if listed.len() > MOST {
        values.push(format!("and {} more", listed.len() - MOST));
    }
    ScenarioError::Variation { variation, drawn: values.join(", "), source: Box::new(source) }
}

/// Problems of `[randomize]`, each with its key.
fn problems(tree: &Tree, found: &[(String, String)]) -> ScenarioError {
    let line = |(key, message): &(String, String)| {
        let key = super::tree::join(RANDOMIZE, key);
        format!("{}: {key}: {message}", tree.location(&key))
    };
    ScenarioError::Problems(found.iter().map(line).collect())
}

#[cfg(test)]
mod tests;
