//! `variations.csv`: what each variation of a scenario with `[randomize]` has drawn, one row each.
//!
//! A row depends on the scenario and its number only, so runs that share a folder write the same rows.

use std::{collections::BTreeMap, path::Path};

use rayon::prelude::*;
use thiserror::Error;
use toml::Value;

use super::{Number, WriteError, write_atomic};
use crate::scenario_file::{Drawn, RandomScenario, ScenarioError};

/// The table.
pub const VARIATIONS_CSV: &str = "variations.csv";
/// Columns before those of the drawn values.
const COLUMNS: [&str; 2] = ["variation", "folder"];

/// Cells of each row, by the number of its variation.
type Rows = BTreeMap<u64, Vec<String>>;

/// Why the table was not written.
#[derive(Debug, Error)]
pub enum VariationsError {
    /// It has variations of another scenario.
    #[error(
        "{path}: {what}: the folder has variations of another [randomize]; choose another folder with -o, or \
            remove that one"
    )]
    Others {
        /// The file.
        path: String,
        /// What differs.
        what: String,
    },
    /// A value does not fit its key.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// It cannot be read or written.
    #[error(transparent)]
    Write(#[from] WriteError),
}

/// Name of the folder of a variation.
#[must_use]
pub fn variation_folder(index: u64) -> String {
    format!("variation_{index:06}")
}

/// Adds the rows of these variations to the table in `folder`. Those that are there must be of the same scenario.
///
/// # Errors
/// [`VariationsError`].
pub fn write_variations(
    folder: &Path,
    scenario: &RandomScenario,
    indices: &[u64],
) -> Result<(), VariationsError> {
    let path = folder.join(VARIATIONS_CSV);
    let others = |what: String| VariationsError::Others { path: path.display().to_string(), what };
    let (old_columns, old) = read(&path)?;
    // Rows of earlier runs are drawn again, too.
    let mut all: Vec<u64> = old.keys().chain(indices).copied().collect();
    all.sort_unstable();
    all.dedup();
    let row = |index: &u64| Ok((*index, scenario.drawn(*index)?));
    let drawn: Vec<(u64, Vec<Drawn>)> = all.par_iter().map(row).collect::<Result<_, ScenarioError>>()?;
    let columns = COLUMNS.map(str::to_owned).into_iter();
    let columns: Vec<String> =
        columns.chain(drawn.first().into_iter().flat_map(|(_, drawn)| drawn).flat_map(names)).collect();
    if !old.is_empty() && old_columns != columns {
        return Err(others(format!("its columns are {}, not {}", old_columns.join(" "), columns.join(" "))));
    }
    let rows = drawn.iter().map(|(index, drawn)| {
        let begin = [index.to_string(), variation_folder(*index)];
        (*index, begin.into_iter().chain(drawn.iter().flat_map(cells)).collect())
    });
    let rows: Rows = rows.collect();
    match old.iter().find(|(index, row)| rows.get(index) != Some(row)) {
        Some((index, _)) => Err(others(format!("the row of variation {index} has other values"))),
        None => Ok(write_atomic(
            &path,
            &csv_of(&columns, &rows).map_err(|message| WriteError::Encode { path: path.clone(), message })?,
        )?),
    }
}

/// The columns and rows of a table; none if the file does not exist or is no such table.
fn read(path: &Path) -> Result<(Vec<String>, Rows), WriteError> {
    let mut rows = BTreeMap::new();
    let text = match std::fs::read(path) {
        Ok(text) => text,
        Err(source) if source.kind() == std::io::ErrorKind::NotFound => return Ok((Vec::new(), rows)),
        Err(source) => return Err(WriteError::Io { path: path.into(), source }),
    };
    let mut reader = csv::Reader::from_reader(&*text);
    let list = |record: &csv::StringRecord| record.iter().map(str::to_owned).collect::<Vec<_>>();
    let columns = reader.headers().map(list).unwrap_or_default();
    for record in reader.records().flatten() {
        if let Some(index) = record.get(0).and_then(|index| index.parse().ok()) {
            rows.insert(index, list(&record));
        }
    }
    Ok((columns, rows))
}

fn csv_of(columns: &[String], rows: &Rows) -> Result<Vec<u8>, String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut all = std::iter::once(columns).chain(rows.values().map(Vec::as_slice));
    all.try_for_each(|row| writer.write_record(row)).map_err(|error| error.to_string())?;
    writer.into_inner().map_err(|error| error.to_string())
}

/// Columns of a value.
fn names(drawn: &Drawn) -> Vec<String> {
    match &drawn.value {
        Value::Array(list) if drawn.is_numbers => {
            (0..list.len()).map(|i| format!("{}.{i}", drawn.key)).collect()
        }
        _ => vec![drawn.key.clone()],
    }
}

/// Cells of a value.
fn cells(drawn: &Drawn) -> Vec<String> {
    match &drawn.value {
        Value::Array(list) if drawn.is_numbers => list.iter().map(cell).collect(),
        value => vec![cell(value)],
    }
}

/// Numbers in the shortest form, texts as they are, anything else as JSON.
fn cell(value: &Value) -> String {
    match value {
        Value::Float(number) => Number(*number).to_string(),
        Value::String(text) => text.clone(),
        value => serde_json::to_string(value).unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;
    use crate::scenario_file::parse_random_scenario;

    fn scenario(randomize: &str) -> RandomScenario {
        let text = format!(
            "[flight]\nlog = \"a.csv\"\n[scene.pattern]\nimage = \"g.png\"\nwidth_m = 10\n[randomize]\n{randomize}"
        );
        parse_random_scenario(&text, Path::new("s.toml"), &[]).unwrap()
    }

    const KEYS: &str = "\"camera.mount.angles_deg\" = { uniform = [[0, -95, 0], [0, -85, 360]] }\n\
        \"camera.lens\" = { choice = [{ model = \"pinhole\" }, { model = \"pinhole\", coefficients = [] }] }\n\
        \"scene.pattern.image\" = { choice = [\"a, b.png\"] }\n";

    #[test]
    fn parts_in_any_order_make_the_table_of_one_run() {
        let scenario = scenario(KEYS);
        let [whole, parts] = [tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap()];
        write_variations(whole.path(), &scenario, &[0, 1, 2, 700_000]).unwrap();
        for part in [&[2, 700_000][..], &[1], &[0, 2]] {
            write_variations(parts.path(), &scenario, part).unwrap();
        }
        let [a, b] =
            [&whole, &parts].map(|dir| std::fs::read_to_string(dir.path().join(VARIATIONS_CSV)).unwrap());
        assert_eq!(a, b);
        let mut lines = a.lines();
        assert_eq!(
            lines.next().unwrap(),
            "variation,folder,camera.lens,camera.mount.angles_deg.0,camera.mount.angles_deg.1,\
             camera.mount.angles_deg.2,scene.pattern.image,seed"
        );
        let first = lines.next().unwrap();
        assert!(
            first.starts_with("0,variation_000000,\"{\"\"") && first.contains(",\"a, b.png\","),
            "{first}"
        );
        let angles: Vec<f64> = {
            let mut reader = csv::Reader::from_reader(a.as_bytes());
            let row = reader.records().nth(3).unwrap().unwrap();
            [3, 4, 5].map(|i| row[i].parse().unwrap()).to_vec()
        };
        let drawn = scenario.variation(700_000).unwrap().rig.first().camera.mount.angles_deg;
        assert_eq!(angles, drawn);
    }

    #[test]
    fn a_table_of_another_scenario_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        write_variations(dir.path(), &scenario(KEYS), &[0, 1]).unwrap();
        for (other, wanted) in [
            (format!("seed = 4\n{KEYS}"), "the row of variation 0 has other values"),
            (format!("\"camera.fps\" = {{ uniform = [1, 2] }}\n{KEYS}"), "its columns are"),
        ] {
            let error = write_variations(dir.path(), &scenario(&other), &[5]).unwrap_err().to_string();
            assert!(error.contains(wanted) && error.contains("choose another folder"), "{error}");
        }
    }
}
