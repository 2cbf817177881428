//! What lists all keys: the printed default scenario, the reference page and the JSON schema, from the facts of the
//! fields.

mod default_toml;
mod json_schema;
#[cfg(test)]
mod keys_page;
#[cfg(test)]
mod python_keys;
#[cfg(test)]
mod tests;

use camsim_core::scenario::keys::{Field, ValueKind};

pub use default_toml::print_default;
pub use json_schema::json_schema;

/// Whether a key is absent by default: then it is shown with an example.
fn is_absent(field: &Field) -> bool {
    let default = (field.default)();
    default.is_empty() || (!field.example.is_empty() && matches!(default.as_str(), "[]" | "{  }" | "\"\""))
}

/// The default as TOML, or an example where there is none.
fn shown_value(field: &Field) -> String {
    match (field.is_required || is_absent(field), field.example.is_empty()) {
        (true, false) => field.example.to_owned(),
        (true, true) => placeholder(field),
        (false, _) => (field.default)(),
    }
}

/// A value of a kind for which no example is given.
fn placeholder(field: &Field) -> String {
    let low = field.low.value().unwrap_or_default();
    match field.kind {
        ValueKind::Flag => "true".to_owned(),
        ValueKind::Word(words) => format!("{:?}", words.first().unwrap_or(&"")),
        ValueKind::Numbers(count) | ValueKind::NumbersOr(count, _) => format!("{:?}", vec![low; count]),
        ValueKind::Text | ValueKind::Path | ValueKind::Paths => "\"\"".to_owned(),
        ValueKind::Within(low, _) => low.to_string(),
        _ => format!("{low:?}"),
    }
}
