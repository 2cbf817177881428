//! `docs/reference/KEYS.md`.

use camsim_core::scenario::{
    Scenario,
    keys::{Field, Value, ValueKind, join},
};

use super::is_absent;

const HEAD: &str = "\
# Keys of a scenario

Made from the fields of the scenario by `CAMSIM_BLESS=1 cargo test --workspace --lib listing`. Lengths are metres and \
angles radians, unless a key's name says otherwise. `camsim render --print-default` prints all keys as a file; \
`camsim schema` prints their JSON schema for editors. `camera` may also be the path of a CAMERA.toml. The unit x is a factor.
";

/// Keys that are no fields of a scenario.
const FOOT: &str = "
## `[[cameras]]`

Several cameras on the platform, instead of `[camera]`: each has all of its keys, a required `name`, and may have a \
`file` (a CAMERA.toml, whose keys those beside it replace). See [rigs](../guide/RIGS.md).

## `[randomize]`

Distributions of keys, from which variations are drawn. See [random scenarios](../guide/RANDOMIZE.md).
";

pub fn page() -> String {
    let mut text = HEAD.to_owned();
    text += "\n## The root\n";
    add_table(&mut text, Scenario::FIELDS, "", Scenario::ABOUT, "");
    text + FOOT
}

fn add_table(text: &mut String, fields: &[Field], table: &str, about: &str, unit: &str) {
    let is_table = |field: &&Field| matches!(field.kind, ValueKind::Table | ValueKind::Tables);
    *text += &format!("\n{about}\n");
    if fields.iter().any(|field| !is_table(&field)) {
        *text += "\n| key | value | default | meaning |\n|---|---|---|---|\n";
    }
    for field in fields.iter().filter(|field| !is_table(field)) {
        let default = match (field.is_required, is_absent(field)) {
            (true, _) => "required".to_owned(),
            (_, true) => "absent".to_owned(),
            _ => format!("`{}`", (field.default)()),
        };
        let about = field.about.replace('|', "\\|");
        *text +=
            &format!("| `{}` | {} | {default} | {about}{} |\n", field.name, value(field, unit), words(field));
    }
    for field in fields.iter().filter(is_table) {
        let name = join(table, field.name);
        let is_list = field.kind == ValueKind::Tables;
        *text += &if is_list { format!("\n## `[[{name}]]`\n") } else { format!("\n## `[{name}]`\n") };
        add_table(text, field.fields, &name, field.about, field.unit);
    }
}

/// The words that a key takes, with their meanings.
fn words(field: &Field) -> String {
    let word = |word: &camsim_core::scenario::keys::Word| match word.about {
        "" => format!("`{}`", word.name),
        about => format!("`{}`: {}", word.name, about.strip_suffix('.').unwrap_or(about).replace('|', "\\|")),
    };
    match field.words {
        [] => String::new(),
        words => format!("<br>{}", words.iter().map(word).collect::<Vec<_>>().join("<br>")),
    }
}

/// The kind of a value, with its interval and unit.
fn value(field: &Field, table_unit: &str) -> String {
    let unit = field.unit_in(table_unit);
    let interval = match field.interval() {
        interval if interval == "finite" => String::new(),
        interval => match interval.strip_prefix("a finite number") {
            Some(rest) => rest.to_owned(),
            None => format!(", {interval}"),
        },
    };
    let quoted =
        |words: &[&str]| words.iter().map(|word| format!("`\"{word}\"`")).collect::<Vec<_>>().join(", ");
    let names = if field.names.is_empty() { String::new() } else { format!(" ({})", field.names.join(", ")) };
    let kind = match field.kind {
        ValueKind::Number => format!("number{interval}"),
        ValueKind::NumberOr(words) => format!("number{interval}, or {}", quoted(words)),
        ValueKind::Whole => "whole number".to_owned(),
        ValueKind::Within(..) if !field.only.is_empty() => format!("whole number{interval}"),
        ValueKind::Within(low, high) if high == u32::MAX => format!("whole number from {low}"),
        ValueKind::Within(low, high) => format!("whole number, {low} to {high}"),
        ValueKind::CountOr(_, words) => format!("whole number{interval}, or {}", quoted(words)),
        ValueKind::Numbers(count) => format!("{count} numbers{names}{interval}"),
        ValueKind::Counts(count, _) => format!("{count} whole numbers{names}{interval}"),
        ValueKind::NumbersOr(count, word) => format!("{count} numbers{names}, or `\"{word}\"`"),
        ValueKind::NumberOrNumbers(count) => format!("number, or {count} numbers{interval}"),
        ValueKind::NumberOrList => format!("number, or list of numbers{interval}"),
        ValueKind::NumberList => format!("list of numbers{interval}"),
        ValueKind::WholeList => "list of whole numbers".to_owned(),
        ValueKind::Points(count) => format!("list of {count} numbers each{names}{interval}"),
        ValueKind::Flag => "`true` or `false`".to_owned(),
        ValueKind::Path => "path".to_owned(),
        ValueKind::Paths => "path, or list of paths".to_owned(),
        ValueKind::Text => "text".to_owned(),
        ValueKind::Texts => "list of texts".to_owned(),
        ValueKind::Word(_) => "word".to_owned(),
        ValueKind::Words(_) => "list of words".to_owned(),
        ValueKind::WordsOrTables(words) => format!("{} or a path, or a list of these", quoted(words)),
        ValueKind::Numbered(low, high) => format!("table of names with whole numbers, {low} to {high}"),
        ValueKind::Table | ValueKind::Tables => String::new(),
    };
    if unit.is_empty() { kind } else { format!("{kind}; {unit}") }
}
