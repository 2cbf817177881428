//! Generates docs/reference/inputs/LOGS.md: `page.md`, with the reader's own tables in it.

use super::{
    column_names::{KNOWN_NAMES, PREFIXES},
    foreign_formats::{FOREIGN_FORMATS, OTHER_BINARY, OTHER_XML, SUBTITLES},
    message_columns,
    receiver_logs::RECEIVER_LOGS,
    units::{Dimension, UNITS, Unit},
};

/// The page, with a name in braces for each table.
const PAGE: &str = include_str!("page.md");

/// Names, units, formats and rules of flight logs, as Markdown.
#[must_use]
pub fn page() -> String {
    let columns = KNOWN_NAMES
        .iter()
        .map(|known| [known.quantity.to_owned(), codes(known.names), known.treatment.to_owned()]);
    let units = UNITS.iter().map(|unit| {
        [unit.dimension.name().to_owned(), unit.name.to_owned(), value(unit), codes(unit.spellings)]
    });
    let by_signature = FOREIGN_FORMATS.iter().map(|(name, _, advice)| (*name, *advice));
    let refused = by_signature.chain(OTHER_BINARY).chain(RECEIVER_LOGS).chain([SUBTITLES, OTHER_XML]);
    PAGE.replace("{prefixes}", &codes(PREFIXES))
        .replace("{columns}\n", &rows(columns))
        .replace("{messages}\n", &rows(message_columns::documentation()))
        .replace("{units}\n", &rows(units))
        .replace("{refused}\n", &rows(refused.map(|(name, advice)| [name.to_owned(), advice.to_owned()])))
}

/// Words of a list, each as code.
fn codes(words: &str) -> String {
    words.split(' ').map(|word| format!("`{word}`")).collect::<Vec<_>>().join(", ")
}

/// Rows of a table.
fn rows<const N: usize>(rows: impl Iterator<Item = [String; N]>) -> String {
    rows.map(|cells| format!("| {} |\n", cells.join(" | "))).collect()
}

/// A unit in seconds, metres or degrees.
fn value(unit: &Unit) -> String {
    let (base, scale) = match unit.dimension {
        Dimension::Time => ("s", 1e9),
        Dimension::Length => ("m", 1.0),
        Dimension::Angle => ("deg", 1.0),
    };
    let factor = unit.factor / scale;
    if (1e-3..1e6).contains(&factor) { format!("{factor} {base}") } else { format!("{factor:e} {base}") }
}
