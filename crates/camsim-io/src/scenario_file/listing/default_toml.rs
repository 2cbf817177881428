//! The scenario that `camsim render --print-default` prints.

use camsim_core::scenario::{
    Scenario,
    keys::{Field, Value, ValueKind, join},
};

use super::{is_absent, shown_value};

const HEAD: &str = "\
# A camsim scenario with every key at its default. Only flight.log and the scene have none: change those two and it runs.
# Lengths are metres and angles radians, unless a key's name says otherwise. Paths start at this file's folder.
# Keys behind a # are absent by default; what stands there is an example. docs/reference/KEYS.md says more of each.
";

/// Keys that are no fields of a scenario.
const RIG: &str = "
# [[cameras]]                       # instead of [camera]: several cameras on the platform, each with all keys of [camera] (docs/guide/RIGS.md)
# name = \"left\"                     # required: its folder, and what `--camera left` and `--set cameras.left.fps=10` name
# file = \"camera.toml\"              # omitted: the keys beside it alone; else these replace those of the file
# mount = { angles_deg = [0.0, -90.0, 0.0], offset_m = [0.0, -0.1, 0.0] }
";
const RANDOMIZE: &str = "
# [randomize]                       # values that are drawn: camsim render --variations 0..100; docs/guide/RANDOMIZE.md
# \"camera.shutter.exposure_ms\" = { uniform = [2, 10] }   # log_uniform | normal = [mean, sigma], clip = [low, high] | integer | choice = [...]
# seed = 0                          # of the draws; omitted: the scenario's
# variations = 1000                 # how many; omitted: --variations says which
# own_seed = true                   # a seed for each variation, so that noise differs
";

/// The optional table that is shown in use: a scene needs one of its parts.
const USED: &str = "scene.terrain";
/// Width before the comments.
const COMMENT: usize = 35;

/// Every key of a scenario at its default, with comments; keys that are absent by default are commented out.
#[must_use]
pub fn print_default() -> String {
    let mut text = HEAD.to_owned();
    add_table(&mut text, Scenario::FIELDS, "", "");
    text + RANDOMIZE
}

/// Adds the keys of a table, then its tables. `mark` is `# ` where it is commented out.
fn add_table(text: &mut String, fields: &[Field], table: &str, mark: &str) {
    let is_table = |field: &&Field| matches!(field.kind, ValueKind::Table | ValueKind::Tables);
    for field in fields.iter().filter(|field| !is_table(field)) {
        let is_used = join(table, field.name).starts_with(USED) && field.name == "ortho";
        let mark = if is_absent(field) && !field.is_required && !is_used { "# " } else { mark };
        let line = format!("{mark}{} = {}", field.name, shown_value(field));
        *text += &format!("{line:COMMENT$} # {}\n", comment(field));
    }
    for field in fields.iter().filter(is_table) {
        let name = join(table, field.name);
        let is_list = field.kind == ValueKind::Tables;
        let mark = if is_list || (field.is_optional && name != USED) { "# " } else { mark };
        let header = if is_list { format!("{mark}[[{name}]]") } else { format!("{mark}[{name}]") };
        *text += &format!("\n{header:COMMENT$} # {}\n", comment(field));
        add_table(text, field.fields, &name, mark);
        if name == "camera" {
            *text += RIG;
        }
    }
}

fn names(field: &Field) -> String {
    field.names.join(", ")
}

/// What a key is, and the words that it takes.
fn comment(field: &Field) -> String {
    // A flag's one word says nothing without what follows.
    let about = if field.summary().contains(' ') { field.summary() } else { field.about };
    let about = about.trim_end_matches('.');
    match field.kind {
        ValueKind::Word(words) | ValueKind::Words(words) | ValueKind::WordsOrTables(words) => {
            format!("{about}: {}", words.join(" | "))
        }
        ValueKind::NumberOr(words) | ValueKind::CountOr(_, words) => {
            format!("{about}, or {:?}", words.join(" | "))
        }
        ValueKind::NumbersOr(_, word) => match names(field) {
            names if names.is_empty() => format!("{about}, or {word:?}"),
            names => format!("{about}: {word:?}, or [{names}]"),
        },
        _ => about.to_owned(),
    }
}
