//! Checks keys and types against the schema, and resolves paths.

use camsim_core::lens::foreign_model;
use toml::{Table, Value};

use super::{
    escapes,
    schema::{self, Schema, ValueKind},
    similar,
    tree::{Tree, join},
};

/// Checks `tree` below `prefix` (`""` for a scenario, `"camera"` for a camera file) and resolves its paths.
/// Returns one line of text per problem.
pub(crate) fn check(tree: &mut Tree, schema: &Schema, prefix: &str) -> Vec<String> {
    let mut problems = Vec::new();
    let mut root = std::mem::take(&mut tree.root);
    check_table(tree, schema, &mut root, prefix, prefix, &mut problems);
    tree.root = root;
    // The keys of a camera file stand at its root, so messages leave out the prefix.
    let hidden = if prefix.is_empty() { String::new() } else { format!("{prefix}.") };
    let line = |(indexed_key, message): &(String, String)| {
        let message = message.replace(&format!("`{hidden}"), "`").replace(&format!("[[{hidden}"), "[[");
        format!(
            "{}: {}: {message}",
            tree.location(indexed_key),
            indexed_key.strip_prefix(&hidden).unwrap_or(indexed_key)
        )
    };
    problems.iter().map(line).collect()
}

/// Checks one table. `indexed_key` has the indices of array elements and `key`, the schema's, has not.
/// Problems are pairs of indexed key and message.
fn check_table(
    tree: &Tree,
    schema: &Schema,
    table: &mut Table,
    indexed_key: &str,
    key: &str,
    problems: &mut Vec<(String, String)>,
) {
    for (name, value) in table.iter_mut() {
        let (indexed_key, key) = (join(indexed_key, name), join(key, name));
        let problem = match (schema.kind(&key), value) {
            (Some(ValueKind::Tables), Value::Array(array)) if array.iter().all(Value::is_table) => {
                for (index, element) in array.iter_mut().enumerate() {
                    if let Value::Table(table) = element {
                        let element_key = join(&indexed_key, &index.to_string());
                        check_table(tree, schema, table, &element_key, &key, problems);
                    }
                }
                None
            }
            (Some(ValueKind::Path | ValueKind::Paths), Value::String(path)) => {
                resolve(tree, &indexed_key, path)
            }
            (Some(ValueKind::Paths), Value::Array(paths))
                if !paths.is_empty() && paths.iter().all(Value::is_str) =>
            {
                for (index, element) in paths.iter_mut().enumerate() {
                    if let Value::String(path) = element {
                        let element_key = join(&indexed_key, &index.to_string());
                        let message = resolve(tree, &element_key, path);
                        problems.extend(message.map(|message| (element_key, message)));
                    }
                }
                None
            }
            (Some(kind @ ValueKind::WordsOrTables(words)), value) => {
                type_problem(&key, kind, value).or_else(|| resolve_tables(tree, words, value, &indexed_key))
            }
            (Some(kind), value) => type_problem(&key, kind, value),
            (None, Value::Table(table)) if schema.is_table(&key) => {
                check_table(tree, schema, table, &indexed_key, &key, problems);
                None
            }
            (None, value) if schema.is_table(&key) => {
                Some(format!("expected a table, found {}", show(value)))
            }
            (None, _) if schema.is_outside_tables(&key) => Some(format!(
                "unknown key; `{}` stands outside of all tables: move the line above the first [table]",
                key.rsplit('.').next().unwrap_or(&key)
            )),
            (None, _) => Some(match schema.nearest(&key) {
                Some(near) => format!("unknown key; did you mean `{near}`?"),
                None => format!("unknown key; {}", schema.listing),
            }),
        };
        problems.extend(problem.map(|message| (indexed_key, message)));
    }
    for (required, parent) in &schema.required {
        let path = required.strip_prefix(parent.as_str()).unwrap_or(required).trim_start_matches('.');
        if *parent == schema::like_camera(key) && !has(table, path) {
            problems.push((join(indexed_key, path), "is missing, and has no default; add it".into()));
        }
    }
}

/// Resolves a path. Returns what is wrong with it.
fn resolve(tree: &Tree, indexed_key: &str, path: &mut String) -> Option<String> {
    if path.is_empty() {
        return Some("the path is empty; name a file, or remove the key".into());
    }
    let resolved = tree.resolve(indexed_key, path);
    let problem = escapes::path_problem(path, &resolved);
    *path = resolved.to_string_lossy().into_owned();
    problem
}

/// Resolves the paths of a value that is a word, the path of a table, or a list of these. Returns what is wrong
/// with the first that cannot be meant.
fn resolve_tables(tree: &Tree, words: &[&str], value: &mut Value, indexed_key: &str) -> Option<String> {
    match value {
        Value::String(text) if !words.contains(&text.as_str()) => resolve(tree, indexed_key, text),
        Value::Array(array) => array.iter_mut().enumerate().fold(None, |problem, (i, element)| {
            let own = resolve_tables(tree, words, element, &join(indexed_key, &i.to_string()));
            problem.or(own)
        }),
        _ => None,
    }
}

/// Whether a table has a value at a dotted path.
fn has(table: &Table, path: &str) -> bool {
    match path.split_once('.') {
        Some((first, rest)) => {
            table.get(first).and_then(Value::as_table).is_some_and(|table| has(table, rest))
        }
        None => table.contains_key(path),
    }
}

/// The message for a value of the wrong type; `None` if it is right.
// Long because it is one table of kinds.
fn type_problem(key: &str, kind: ValueKind, value: &Value) -> Option<String> {
    let number = |value: &Value| value.is_float() || value.is_integer();
    let whole = |value: &Value| value.as_integer().is_some_and(|value| value >= 0);
    let count = |value: &Value| value.as_integer().is_some_and(|value| u32::try_from(value).is_ok());
    let all = |value: &Value, count: Option<usize>, test: &dyn Fn(&Value) -> bool| {
        value
            .as_array()
            .is_some_and(|array| count.is_none_or(|count| array.len() == count) && array.iter().all(test))
    };
    let among = |value: &Value, words: &[&str]| value.as_str().is_some_and(|word| words.contains(&word));
    let (ok, text) = match kind {
        ValueKind::Number => (number(value), "a number".to_owned()),
        ValueKind::NumberOr(words) => {
            (number(value) || among(value, words), format!("a number or {}", list(words)))
        }
        ValueKind::Whole => (whole(value), "a whole number, 0 or more".to_owned()),
        ValueKind::Within(min, max) => {
            let range = i64::from(min)..=i64::from(max);
            (
                value.as_integer().is_some_and(|v| range.contains(&v)),
                format!("a whole number, {min} to {max}"),
            )
        }
        ValueKind::Numbered(min, max) => {
            let range = i64::from(min)..=i64::from(max);
            let is_number = |value: &Value| value.as_integer().is_some_and(|v| range.contains(&v));
            (
                value.as_table().is_some_and(|table| table.values().all(is_number)),
                format!("a table of names with whole numbers, {min} to {max}, such as {{ roof = {min} }}"),
            )
        }
        ValueKind::CountOr(max, words) => {
            (count(value) || among(value, words), format!("a whole number up to {max} or {}", list(words)))
        }
        ValueKind::Numbers(n) => (all(value, Some(n), &number), format!("a list of {n} numbers")),
        ValueKind::Flag => (value.is_bool(), "true or false".to_owned()),
        ValueKind::NumbersOr(n, word) => (
            all(value, Some(n), &number) || among(value, &[word]),
            format!("a list of {n} numbers or \"{word}\""),
        ),
        ValueKind::Counts(n, max) => {
            (all(value, Some(n), &count), format!("a list of {n} whole numbers up to {max}"))
        }
        ValueKind::NumberOrNumbers(n) => {
            (number(value) || all(value, Some(n), &number), format!("a number or a list of {n} numbers"))
        }
        ValueKind::NumberOrList => {
            (number(value) || all(value, None, &number), "a number or a list of numbers".to_owned())
        }
        ValueKind::NumberList => (all(value, None, &number), "a list of numbers".to_owned()),
        ValueKind::WholeList => (all(value, None, &whole), "a list of whole numbers, 0 or more".to_owned()),
        ValueKind::Points(n) => (
            all(value, None, &|point| all(point, Some(n), &number)),
            format!("a list of lists of {n} numbers"),
        ),
        ValueKind::Path => (false, "a path in quotes".to_owned()),
        ValueKind::Paths => (false, "a path in quotes or a list of these".to_owned()),
        ValueKind::Text => (value.is_str(), "a text in quotes".to_owned()),
        ValueKind::Texts => (all(value, None, &Value::is_str), "a list of texts in quotes".to_owned()),
        ValueKind::Table => (value.is_table(), "a table".to_owned()),
        ValueKind::Tables => (false, format!("a list of tables; write [[{key}]]")),
        ValueKind::Word(words) => (among(value, words), format!("one of {}", list(words))),
        ValueKind::Words(words) => {
            (all(value, None, &|value| among(value, words)), format!("a list of any of {}", list(words)))
        }
        ValueKind::WordsOrTables(words) => {
            let ending = |path: &str| path.len() > 4 && path.to_ascii_lowercase().ends_with(".csv");
            let fits = |value: &Value| among(value, words) || value.as_str().is_some_and(ending);
            (
                fits(value) || all(value, None, &fits),
                format!("one of {} or a table \"NAME.csv\", or a list of these", list(words)),
            )
        }
    };
    if ok {
        return None;
    }
    let written: Vec<&str> = value
        .as_str()
        .into_iter()
        .chain(value.as_array().into_iter().flatten().filter_map(Value::as_str))
        .collect();
    let hint = match kind {
        ValueKind::Word(words)
        | ValueKind::Words(words)
        | ValueKind::WordsOrTables(words)
        | ValueKind::NumberOr(words)
        | ValueKind::CountOr(_, words) => {
            written.iter().find(|word| !words.contains(word)).and_then(|word| meant_word(key, word, words))
        }
        _ => None,
    };
    let hint = match kind {
        ValueKind::Whole | ValueKind::WholeList if has_too_large(value) => {
            format!("; whole numbers end at {}", i64::MAX)
        }
        _ => hint.map_or(String::new(), |word| format!("; did you mean \"{word}\"?")),
    };
    Some(format!("expected {text}, found {}{hint}", show(value)))
}

/// Whether a value has a whole number that TOML has no room for: text on the command line, a decimal in JSON.
fn has_too_large(value: &Value) -> bool {
    let is_beyond = |digits: &str| digits.len() > 18 && digits.parse::<i64>().is_err();
    match value {
        Value::String(text) => text
            .split(|c: char| !c.is_ascii_digit() && c != '_')
            .any(|digits| is_beyond(&digits.replace('_', ""))),
        Value::Float(number) => number.fract() == 0.0 && *number >= i64::MAX as f64,
        Value::Array(list) => list.iter().any(has_too_large),
        _ => false,
    }
}

/// The word that was probably meant: of a lens model the one that other programs call so, else the most similar.
fn meant_word<'a>(key: &str, word: &str, words: &[&'a str]) -> Option<&'a str> {
    let foreign = foreign_model(word).filter(|_| key.ends_with("lens.model"));
    let known = foreign.and_then(|model| words.iter().copied().find(|known| *known == model.name()));
    known.or_else(|| similar::nearest_word(word, words))
}

/// Quoted words, separated by commas.
fn list(words: &[&str]) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}

/// A value as text for a message, cut at 60 characters.
fn show(value: &Value) -> String {
    let text = match value {
        Value::Table(_) => return "a table".into(),
        value => value.to_string(),
    };
    if text.chars().count() > 60 { text.chars().take(57).chain("...".chars()).collect() } else { text }
}
