//! Golden files: where they are, how they are written anew, and what differs from them.

use std::{fs, path::PathBuf};

use serde_json::{Number, Value};

/// Relative difference that numbers may have: libraries of other machines round sines otherwise.
const SAME: f64 = 1e-6;
/// Below this a number is rounding: pixels, metres, seconds or grey levels.
const NOTHING: f64 = 1e-9;

pub fn path(file: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../tests/data/net").join(file)
}

pub fn is_blessing() -> bool {
    std::env::var_os("CAMSIM_BLESS").is_some_and(|bless| bless == "1")
}

pub fn write(file: &str, text: &str) {
    fs::create_dir_all(path("")).expect("a folder");
    fs::write(path(file), text).expect(file);
}

pub fn read(file: &str) -> String {
    fs::read_to_string(path(file)).unwrap_or_else(|error| panic!("{file}: {error}; CAMSIM_BLESS=1 writes it"))
}

/// With numbers to nine digits: what is beyond them would differ on every machine that writes the file anew.
pub fn rounded(value: Value) -> Value {
    match value {
        Value::Number(number) if number.is_f64() => {
            let digits = number.as_f64().and_then(|x| format!("{x:.8e}").parse().ok());
            digits.and_then(Number::from_f64).map_or(Value::Null, Value::Number)
        }
        Value::Array(values) => Value::Array(values.into_iter().map(rounded).collect()),
        Value::Object(map) => {
            let entries = map.into_iter().map(|(key, value)| (key, rounded(value)));
            Value::Object(entries.collect())
        }
        other => other,
    }
}

/// Adds a line for each value below `at` where `found` is not `golden`: numbers with a fraction may differ by
/// rounding, everything else decides something and must be equal.
pub fn compare(at: &str, golden: &Value, found: &Value, differences: &mut Vec<String>) {
    match (golden, found) {
        (Value::Object(a), Value::Object(b)) => {
            for (key, golden) in a {
                match b.get(key) {
                    Some(found) => compare(&format!("{at}.{key}"), golden, found, differences),
                    None => differences.push(format!("{at}.{key}: golden {golden}, now missing")),
                }
            }
            let added = b.iter().filter(|(key, _)| !a.contains_key(*key));
            let told = added.map(|(key, value)| format!("{at}.{key}: not in the golden file, now {value}"));
            differences.extend(told);
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            for (i, (golden, found)) in a.iter().zip(b).enumerate() {
                compare(&format!("{at}[{i}]"), golden, found, differences);
            }
        }
        (Value::Number(a), Value::Number(b)) if are_alike(a, b) => {}
        _ if golden == found => {}
        _ => differences.push(format!("{at}: golden {golden}, now {found}")),
    }
}

fn are_alike(a: &Number, b: &Number) -> bool {
    let (Some(x), Some(y)) = (a.as_f64(), b.as_f64()) else { return false };
    let is_close = (x - y).abs() <= NOTHING + SAME * x.abs().max(y.abs());
    a.is_f64() && b.is_f64() && is_close
}
