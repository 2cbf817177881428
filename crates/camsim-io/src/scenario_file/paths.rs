//! Visits all paths of a scenario.

use serde_json::Value;

use super::{schema::SCENARIO, tree::join};

/// Calls `visitor` for every path of a scenario, a tree of JSON, in the order of keys. Array elements have
/// their index in the key.
pub(crate) fn for_each_path(scenario: &mut Value, visitor: &mut dyn FnMut(&str, &mut String)) {
    visit(scenario, "", "", visitor);
}

/// Visits one value. `indexed_key` has the indices of array elements, `key`, the schema's, has not.
fn visit(value: &mut Value, indexed_key: &str, key: &str, visitor: &mut dyn FnMut(&str, &mut String)) {
    match value {
        Value::Object(map) => map
            .iter_mut()
            .for_each(|(name, value)| visit(value, &join(indexed_key, name), &join(key, name), visitor)),
        Value::Array(list) => list
            .iter_mut()
            .enumerate()
            .for_each(|(i, value)| visit(value, &join(indexed_key, &i.to_string()), key, visitor)),
        Value::String(text) if SCENARIO.kind(key).is_some_and(|kind| kind.is_path(text)) => {
            visitor(indexed_key, text);
        }
        _ => {}
    }
}
