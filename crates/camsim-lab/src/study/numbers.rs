//! What a command leaves.

use std::{collections::BTreeMap, path::Path};

use super::StudyError;

/// Columns of `study.csv` that are no numbers of a command's.
const RESERVED: [&str; 3] = ["seed", "folder", "problem"];

/// Named numbers, by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Numbers(pub BTreeMap<String, f64>);

impl Numbers {
    /// Reads a result: a JSON object of numbers and of such objects, whose names are joined by dots (`null` is NaN); or a
    /// CSV file of a header and rows of numbers, whose means are taken.
    ///
    /// # Errors
    /// The file is missing or holds something else.
    pub fn read(path: &Path) -> Result<Self, StudyError> {
        let text = std::fs::read_to_string(path)
            .map_err(|source| StudyError::Read { path: path.to_owned(), source })?;
        let wrong = |problem: String| StudyError::Content { path: path.to_owned(), problem };
        let numbers = match text.trim_start().starts_with('{') {
            true => of_json(&text).map_err(wrong)?,
            false => of_csv(&text).map_err(wrong)?,
        };
        if let Some(name) = numbers.keys().find(|name| RESERVED.contains(&name.as_str())) {
            return Err(wrong(format!("`{name}` is a column of study.csv: give the number another name")));
        }
        if numbers.is_empty() { Err(wrong("holds no number".into())) } else { Ok(Self(numbers)) }
    }
}

fn of_json(text: &str) -> Result<BTreeMap<String, f64>, String> {
    fn add(found: &mut BTreeMap<String, f64>, name: &str, value: &serde_json::Value) -> Result<(), String> {
        use serde_json::Value;
        match value {
            Value::Number(number) => {
                found.insert(name.to_owned(), number.as_f64().unwrap_or(f64::NAN));
            }
            Value::Bool(value) => {
                found.insert(name.to_owned(), f64::from(u8::from(*value)));
            }
            Value::Null => {
                found.insert(name.to_owned(), f64::NAN);
            }
            Value::Object(parts) => {
                for (part, value) in parts {
                    let joined = if name.is_empty() { part.clone() } else { format!("{name}.{part}") };
                    add(found, &joined, value)?;
                }
            }
            Value::String(_) | Value::Array(_) => {
                return Err(format!("`{name}` is neither a number nor an object of numbers: leave it out"));
            }
        }
        Ok(())
    }
    let value: serde_json::Value = serde_json::from_str(text).map_err(|error| error.to_string())?;
    let mut found = BTreeMap::new();
    add(&mut found, "", &value)?;
    Ok(found)
}

fn of_csv(text: &str) -> Result<BTreeMap<String, f64>, String> {
    let mut lines = text.lines().filter(|line| !line.trim().is_empty());
    let header: Vec<&str> = lines.next().unwrap_or("").split(',').map(str::trim).collect();
    let (mut sums, mut rows) = (vec![0.0; header.len()], 0.0);
    for (number, line) in (2..).zip(lines) {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        if cells.len() != header.len() {
            return Err(format!("line {number} has {} cells, the header has {}", cells.len(), header.len()));
        }
        for ((sum, cell), name) in sums.iter_mut().zip(cells).zip(&header) {
            *sum +=
                cell.parse::<f64>().map_err(|_| format!("line {number}, {name}: `{cell}` is no number"))?;
        }
        rows += 1.0;
    }
    if rows == 0.0 {
        return Err("is neither a JSON object of numbers nor a CSV table with rows below its header".into());
    }
    Ok(header.into_iter().map(str::to_owned).zip(sums.into_iter().map(|sum| sum / rows)).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Vec<(String, f64)>, String> {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("result");
        std::fs::write(&path, text).expect("a file");
        Numbers::read(&path).map(|numbers| numbers.0.into_iter().collect()).map_err(|error| error.to_string())
    }

    #[test]
    fn json_and_csv_give_named_numbers() {
        let expected = vec![("a".to_owned(), 1.5), ("b.c".to_owned(), 2.0)];
        assert_eq!(read(r#"{"b": {"c": 2}, "a": 1.5}"#), Ok(expected));
        assert_eq!(read("x, y\n1, 10\n3, 20\n"), Ok(vec![("x".to_owned(), 2.0), ("y".to_owned(), 15.0)]));
    }

    #[test]
    fn other_content_is_refused_with_its_place() {
        for (text, wanted) in [
            ("{", "EOF"),
            ("{}", "no number"),
            (r#"{"a": "b"}"#, "`a`"),
            ("x,y\n1\n", "line 2 has 1 cells"),
            ("x\none\n", "`one` is no number"),
            ("x\n", "nor a CSV table"),
            (r#"{"seed": 1}"#, "another name"),
        ] {
            let error = read(text).expect_err(text);
            assert!(error.contains(wanted), "{error}");
        }
    }
}
