//! The paths of a scenario, whichever keys hold them.

use serde_json::Value;

use super::{
    schema::{Kind, SCENARIO},
    tree::join,
};

/// Shows every path of a scenario, as a tree of JSON, with its key (elements of arrays by index), in order of
/// keys.
pub(crate) fn for_each_path(scenario: &mut Value, with: &mut dyn FnMut(&str, &mut String)) {
    visit(scenario, "", "", with);
}

/// `at` is the key with indices, `key` the one without, which the schema knows.
fn visit(value: &mut Value, at: &str, key: &str, with: &mut dyn FnMut(&str, &mut String)) {
    match value {
        Value::Object(map) => {
            map.iter_mut().for_each(|(name, value)| visit(value, &join(at, name), &join(key, name), with))
        }
        Value::Array(list) => list
            .iter_mut()
            .enumerate()
            .for_each(|(i, value)| visit(value, &join(at, &i.to_string()), key, with)),
        Value::String(text) if SCENARIO.kind_of(key) == Some(Kind::Path) => with(at, text),
        _ => {}
    }
}
