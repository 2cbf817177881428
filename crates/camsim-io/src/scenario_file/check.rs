//! Keys and types against the schema, and paths resolved on the way.

use toml::{Table, Value};

use super::{
    schema::{self, Kind, Schema},
    tree::{Tree, join},
};

/// Checks `tree` below `prefix` (`""` for a scenario, `"camera"` for a camera file) and resolves its paths;
/// gives one line a problem.
pub(crate) fn check(tree: &mut Tree, schema: &Schema, prefix: &str) -> Vec<String> {
    let mut problems = Vec::new();
    let mut root = std::mem::take(&mut tree.root);
    check_table(tree, schema, &mut root, prefix, prefix, &mut problems);
    tree.root = root;
    // In a camera file of its own the keys stand at the root.
    let inner = if prefix.is_empty() { String::new() } else { format!("{prefix}.") };
    let line = |(at, message): &(String, String)| {
        let message = message.replace(&format!("`{inner}"), "`").replace(&format!("[[{inner}"), "[[");
        format!("{}: {}: {message}", tree.place(at), at.strip_prefix(&inner).unwrap_or(at))
    };
    problems.iter().map(line).collect()
}

/// `at` is the key with indices (its place), `key` the one without (the schema's). Problems are pairs of
/// place and message.
fn check_table(
    tree: &Tree,
    schema: &Schema,
    table: &mut Table,
    at: &str,
    key: &str,
    problems: &mut Vec<(String, String)>,
) {
    for (name, value) in table.iter_mut() {
        let (at, key) = (join(at, name), join(key, name));
        let wrong = match (schema.kind_of(&key), value) {
            (Some(Kind::Tables), Value::Array(array)) if array.iter().all(Value::is_table) => {
                for (index, element) in array.iter_mut().enumerate() {
                    if let Value::Table(table) = element {
                        check_table(tree, schema, table, &join(&at, &index.to_string()), &key, problems);
                    }
                }
                None
            }
            (Some(Kind::Path), Value::String(path)) => {
                *path = tree.resolve(&at, path).to_string_lossy().into_owned();
                None
            }
            (Some(kind), value) => expected(schema, &key, kind, value),
            (None, Value::Table(table)) if schema.is_table(&key) => {
                check_table(tree, schema, table, &at, &key, problems);
                None
            }
            (None, value) if schema.is_table(&key) => {
                Some(format!("expected a table, found {}", show(value)))
            }
            (None, _) => Some(match schema.nearest(&key) {
                Some(near) => format!("unknown key; did you mean `{near}`?"),
                None => format!("unknown key; {}", schema.listing),
            }),
        };
        problems.extend(wrong.map(|message| (at, message)));
    }
    for (required, within) in schema.required {
        let missing = *within == key;
        let path = required.strip_prefix(within).unwrap_or(required).trim_start_matches('.');
        if missing && !has(table, path) {
            problems.push((join(at, path), "is missing, and has no default; add it".into()));
        }
    }
}

fn has(table: &Table, path: &str) -> bool {
    match path.split_once('.') {
        Some((first, rest)) => {
            table.get(first).and_then(Value::as_table).is_some_and(|table| has(table, rest))
        }
        None => table.contains_key(path),
    }
}

fn expected(schema: &Schema, key: &str, kind: Kind, value: &Value) -> Option<String> {
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
        Kind::Number => (number(value), "a number".to_owned()),
        Kind::NumberOr(words) => {
            (number(value) || among(value, words), format!("a number or {}", list(words)))
        }
        Kind::Whole => (whole(value), "a whole number, 0 or more".to_owned()),
        Kind::Within(least, most) => {
            let range = i64::from(least)..=i64::from(most);
            (
                value.as_integer().is_some_and(|v| range.contains(&v)),
                format!("a whole number, {least} to {most}"),
            )
        }
        Kind::CountOr(most, words) => {
            (count(value) || among(value, words), format!("a whole number up to {most} or {}", list(words)))
        }
        Kind::Numbers(n) => (all(value, Some(n), &number), format!("a list of {n} numbers")),
        Kind::Flag => (value.is_bool(), "true or false".to_owned()),
        Kind::NumbersOr(n, word) => (
            all(value, Some(n), &number) || among(value, &[word]),
            format!("a list of {n} numbers or \"{word}\""),
        ),
        Kind::Counts(n, most) => {
            (all(value, Some(n), &count), format!("a list of {n} whole numbers up to {most}"))
        }
        Kind::NumberList => (all(value, None, &number), "a list of numbers".to_owned()),
        Kind::Path => (false, "a path in quotes".to_owned()),
        Kind::Text => (value.is_str(), "a text in quotes".to_owned()),
        Kind::Texts => (all(value, None, &Value::is_str), "a list of texts in quotes".to_owned()),
        Kind::Tables => (false, format!("a list of tables; write [[{key}]]")),
        Kind::Word(words) => (among(value, words), format!("one of {}", list(words))),
        Kind::Words(words) => {
            (all(value, None, &|value| among(value, words)), format!("a list of any of {}", list(words)))
        }
        Kind::Later => return Some("is not supported by this version; leave it out".into()),
    };
    if ok {
        return None;
    }
    let written: Vec<&str> = value
        .as_str()
        .into_iter()
        .chain(value.as_array().into_iter().flatten().filter_map(Value::as_str))
        .collect();
    if let Some((_, word)) =
        schema.later_words.iter().find(|(its_key, word)| *its_key == key && written.contains(word))
    {
        return Some(format!("\"{word}\" is not supported by this version; expected {text}"));
    }
    let hint = match kind {
        Kind::Word(words) | Kind::Words(words) | Kind::NumberOr(words) | Kind::CountOr(_, words) => written
            .iter()
            .find(|word| !words.contains(word))
            .and_then(|word| schema::nearest_word(word, words)),
        _ => None,
    };
    let hint = hint.map_or(String::new(), |word| format!("; did you mean \"{word}\"?"));
    Some(format!("expected {text}, found {}{hint}", show(value)))
}

fn list(words: &[&str]) -> String {
    words.iter().map(|word| format!("\"{word}\"")).collect::<Vec<_>>().join(", ")
}

/// A value for a message, shortened.
fn show(value: &Value) -> String {
    let text = match value {
        Value::Table(_) => return "a table".into(),
        value => value.to_string(),
    };
    if text.chars().count() > 60 { text.chars().take(57).chain("...".chars()).collect() } else { text }
}
