//! Studies: a command of the user's on the frames of many scenarios (`camsim study`).
//!
//! A [`Study`] is a scenario, keys with several values each, and a command. [`Study::points`] lists the combinations
//! of the values; [`Numbers`] are what the command leaves for each; [`table`], [`summary`] and [`plots`] are made from
//! them. Rendering and running are the caller's.

use std::{
    collections::BTreeSet,
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};

mod algorithms;
mod numbers;
mod points;
mod report;

pub use algorithms::{ALGORITHMS, Algorithm, COMMON};
pub use numbers::Numbers;
pub use points::Point;
pub use report::{Done, is_plot, plots, summary, table};

/// Why a study cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum StudyError {
    /// The file cannot be read.
    #[error("{path}: {source}")]
    Read {
        /// The study.
        path: PathBuf,
        /// Cause.
        source: std::io::Error,
    },
    /// It is no study.
    #[error("{path}: {problem}")]
    Content {
        /// The study, or a file of results.
        path: PathBuf,
        /// What is wrong, and what to do.
        problem: String,
    },
}

/// A study, as its file states it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Study {
    /// Scenario, from the study's folder on.
    pub scenario: PathBuf,
    /// What is run for each point: program and arguments. `{data}` is the folder of the frames, `{result}` the file
    /// that it writes, JSON or CSV ([`Numbers::read`]).
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub command: Vec<String>,
    /// One of [`ALGORITHMS`], instead of a command.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub algorithm: Option<String>,
    /// Frames of each camera, as of `camsim render --frames`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frames: Option<String>,
    /// Layout of the frames, as of `camsim export --as`; without it the folder of `camsim render`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub export: Option<String>,
    /// Values of the key `seed`: each point is run with each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub seeds: Vec<u64>,
    /// Whether the frames of a point are kept after its command.
    #[serde(default = "yes")]
    pub keep_frames: bool,
    /// Longest time of a command, seconds; without it there is no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub timeout_s: Option<f64>,
    /// Keys of all points.
    #[serde(default, skip_serializing_if = "toml::Table::is_empty")]
    pub set: toml::Table,
    /// Keys with their values: all combinations are points.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub vary: Vec<Vary>,
    /// Points one by one, instead of `vary`: the keys of each.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub point: Vec<toml::Table>,
    /// Plots; without any, each number over the first key with several numbers.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub plot: Vec<PlotSpec>,
}

/// A key with its values.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Vary {
    /// Key of the scenario, with dots.
    pub key: String,
    /// Its values.
    pub values: Vec<toml::Value>,
    /// Its name in plots, with unit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub label: Option<String>,
}

/// A plot.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlotSpec {
    /// Key along the x axis, whose values are numbers.
    pub x: String,
    /// Number of the command's along the y axis.
    pub y: String,
    /// Key with a curve for each value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub by: Option<String>,
    /// Whether the y axis is logarithmic.
    #[serde(default)]
    pub log: bool,
}

fn yes() -> bool {
    true
}

impl Study {
    /// Reads a study; `algorithm` replaces its own, or its command.
    ///
    /// # Errors
    /// [`StudyError`] names the file and the key.
    pub fn read(path: &Path, algorithm: Option<&str>) -> Result<Self, StudyError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| StudyError::Read { path: path.to_owned(), source })?;
        let wrong = |problem: String| StudyError::Content { path: path.to_owned(), problem };
        let study: Self =
            toml::from_str(&text).map_err(|error| wrong(error.to_string().trim_end().to_owned()))?;
        let study = study.with_algorithm(algorithm);
        study.problem().map_or(Ok(study), |problem| Err(wrong(problem)))
    }

    /// What makes the study unusable.
    fn problem(&self) -> Option<String> {
        let names = || Algorithm::names().collect::<Vec<_>>().join(", ");
        match (&self.algorithm, self.command.is_empty()) {
            (None, true) => {
                return Some(format!(
                    "has neither a command nor an algorithm: give one; algorithms are {}",
                    names()
                ));
            }
            (Some(_), false) => return Some("has a command and an algorithm: remove one".into()),
            (Some(name), true) if Algorithm::named(name).is_none() => {
                return Some(format!("algorithm `{name}` is not known: there are {}", names()));
            }
            (Some(_), true) if self.export.is_some() => {
                return Some(
                    "export belongs to a command: an algorithm has its own layout; remove it".into(),
                );
            }
            _ => {}
        }
        if !self.command.is_empty() && !self.command.iter().any(|word| word.contains("{result}")) {
            return Some("command does not name {result}, the file that it must write: add it".into());
        }
        if self.vary.is_empty() == self.point.is_empty() {
            return Some("needs [[vary]] tables or [[point]] tables, and not both".into());
        }
        if let Some(empty) = self.vary.iter().find(|vary| vary.values.is_empty()) {
            return Some(format!("[[vary]] of {} has no values: give some", empty.key));
        }
        if let Some(timeout_s) = self.timeout_s.filter(|t_s| !(t_s.is_finite() && *t_s > 0.0)) {
            return Some(format!("timeout_s is {timeout_s}: give a positive number of seconds"));
        }
        let is_twice = |at: &usize| self.vary[..*at].iter().any(|vary| vary.key == self.vary[*at].key);
        if let Some(at) = (0..self.vary.len()).find(is_twice) {
            return Some(format!("two [[vary]] tables are of {}: join their values", self.vary[at].key));
        }
        let points = self.points();
        let keys: BTreeSet<&str> = points.iter().flat_map(Point::keys).collect();
        self.plot.iter().find_map(|plot| {
            [Some(&plot.x), plot.by.as_ref()]
                .into_iter()
                .flatten()
                .find(|key| !keys.contains(key.as_str()))
                .map(|key| {
                    let known = keys.iter().copied().collect::<Vec<_>>().join(", ");
                    format!("[[plot]] names {key}, which does not vary: the keys are {known}")
                })
        })
    }

    fn with_algorithm(self, name: Option<&str>) -> Self {
        match name {
            None => self,
            Some(name) => Self { algorithm: Some(name.into()), command: Vec::new(), export: None, ..self },
        }
    }

    /// The algorithm, if it is one of camsim's.
    #[must_use]
    pub fn algorithm(&self) -> Option<&'static Algorithm> {
        Algorithm::named(self.algorithm.as_deref()?)
    }

    /// Layout of the frames: that of the algorithm, or the study's.
    #[must_use]
    pub fn layout(&self) -> Option<&str> {
        self.algorithm().map_or(self.export.as_deref(), |algorithm| algorithm.layout)
    }

    /// Name of a key in plots.
    fn label<'a>(&'a self, key: &'a str) -> &'a str {
        self.vary.iter().find(|vary| vary.key == key).and_then(|vary| vary.label.as_deref()).unwrap_or(key)
    }
}
