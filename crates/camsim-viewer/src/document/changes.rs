//! Differences of two trees of values, by keys.

use camsim_io::scenario_file::CAMERAS;
use toml::{Table, Value};

/// Collects keys of `now` that are new or differ from `before`, with their values.
pub fn collect_changes(now: &Table, before: &Table, prefix: &str, into: &mut Vec<(String, Value)>) {
    for (name, value) in now {
        let key = joined(prefix, name);
        match (value, before.get(name)) {
            (Value::Table(now), Some(Value::Table(before))) => collect_changes(now, before, &key, into),
            (value, before) if before != Some(value) => match camera_tables(&key, value, before) {
                Some(cameras) => cameras.iter().for_each(|(key, now, before)| {
                    collect_changes(now, before, key, into);
                }),
                None => into.push((key, value.clone())),
            },
            _ => {}
        }
    }
}

/// Collects keys of `before` that `now` lacks.
pub fn collect_removed(before: &Table, now: &Table, prefix: &str, into: &mut Vec<String>) {
    for (name, value) in before {
        let key = joined(prefix, name);
        match (value, now.get(name)) {
            (Value::Table(before), Some(Value::Table(now))) => collect_removed(before, now, &key, into),
            (_, None) => into.push(key),
            (value, now) => {
                for (key, before, now) in camera_tables(&key, value, now).unwrap_or_default() {
                    collect_removed(before, now, &key, into);
                }
            }
        }
    }
}

fn joined(prefix: &str, name: &str) -> String {
    if prefix.is_empty() { name.to_owned() } else { format!("{prefix}.{name}") }
}

/// The cameras of two rigs of as many, with their keys; `None` for the values of another key.
fn camera_tables<'a>(
    key: &str,
    a: &'a Value,
    b: Option<&'a Value>,
) -> Option<Vec<(String, &'a Table, &'a Table)>> {
    let (Value::Array(a), Some(Value::Array(b)), true) = (a, b, key == CAMERAS) else { return None };
    let pair = |(i, (a, b)): (usize, (&'a Value, &'a Value))| {
        Some((format!("{CAMERAS}.{i}"), a.as_table()?, b.as_table()?))
    };
    (a.len() == b.len()).then(|| a.iter().zip(b).enumerate().map(pair).collect())?
}
