//! The points of a study.

use std::fmt::Write as _;

use super::Study;

/// Values of keys, for one run of the command.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Keys and values that differ among points, in the order of the study.
    pub values: Vec<(String, toml::Value)>,
    /// Value of the key `seed`, if the study gives seeds.
    pub seed: Option<u64>,
}

impl Study {
    /// All points, the first key of `vary` slowest, seeds fastest.
    #[must_use]
    pub fn points(&self) -> Vec<Point> {
        let mut all: Vec<Vec<(String, toml::Value)>> = match self.point.is_empty() {
            true => vec![Vec::new()],
            false => self.point.iter().map(|table| table.clone().into_iter().collect()).collect(),
        };
        for vary in &self.vary {
            let with = |values: &Vec<(String, toml::Value)>| {
                let with = |value: &toml::Value| {
                    let mut values = values.clone();
                    values.push((vary.key.clone(), value.clone()));
                    values
                };
                vary.values.iter().map(with).collect::<Vec<_>>()
            };
            all = all.iter().flat_map(with).collect();
        }
        let seeds: Vec<Option<u64>> =
            if self.seeds.is_empty() { vec![None] } else { self.seeds.iter().copied().map(Some).collect() };
        let point = |values: Vec<(String, toml::Value)>| {
            seeds.iter().map(move |&seed| Point { values: values.clone(), seed }).collect::<Vec<_>>()
        };
        all.into_iter().flat_map(point).collect()
    }
}

impl Point {
    /// The keys that differ among points.
    #[must_use]
    pub fn keys(&self) -> Vec<&str> {
        self.values.iter().map(|(key, _)| key.as_str()).collect()
    }

    /// The value of a key.
    #[must_use]
    pub fn value(&self, key: &str) -> Option<&toml::Value> {
        self.values.iter().find(|(known, _)| known == key).map(|(_, value)| value)
    }

    /// Its number along an axis.
    #[must_use]
    pub fn number(&self, key: &str) -> Option<f64> {
        match self.value(key)? {
            toml::Value::Integer(value) => Some(*value as f64),
            toml::Value::Float(value) => Some(*value),
            _ => None,
        }
    }

    /// Keys and values as of `--set`: those that the algorithm needs, those of all points, its own; the last counts.
    #[must_use]
    pub fn sets(&self, study: &Study) -> Vec<(String, String)> {
        let needed = study.algorithm().map_or(&[][..], |algorithm| algorithm.sets);
        let needed = needed.iter().map(|&(key, value)| (key.to_owned(), value.to_owned()));
        let all = study.set.iter().chain(self.values.iter().map(|(key, value)| (key, value)));
        let seed = self.seed.map(|seed| ("seed".to_owned(), seed.to_string()));
        needed.chain(all.map(|(key, value)| (key.clone(), value.to_string()))).chain(seed).collect()
    }

    /// What it is, for users: `camera.shutter.readout_ms = 20, seed = 1`.
    #[must_use]
    pub fn label(&self) -> String {
        let values = self.values.iter().map(|(key, value)| format!("{key} = {value}"));
        let seed = self.seed.map(|seed| format!("seed = {seed}"));
        values.chain(seed).collect::<Vec<_>>().join(", ")
    }

    /// Name of its folder: its values as far as a file name holds them, and their checksum. It depends on nothing else,
    /// so that a study with more points finds those that it has.
    #[must_use]
    pub fn folder(&self) -> String {
        let label = self.label();
        let mut name = String::new();
        for (key, value) in &self.values {
            let last = key.rsplit('.').next().unwrap_or(key);
            let _ = write!(name, "{last}={value}_");
        }
        if let Some(seed) = self.seed {
            let _ = write!(name, "seed={seed}_");
        }
        let plain = |c: char| if c.is_ascii_alphanumeric() || "=_.-".contains(c) { c } else { '-' };
        let name: String = name.chars().map(plain).take(60).collect();
        format!("{name}{:08x}", crc32fast::hash(label.as_bytes()))
    }
}
