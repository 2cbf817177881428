//! CSV tables with a header, of which blanks around cells and lines after `#` do not count.

use std::{fs::File, path::Path};

/// Opens a table. A byte-order mark is skipped.
pub(crate) fn open_table(path: &Path) -> csv::Result<csv::Reader<File>> {
    csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_path(path)
}

/// A cell as a finite number.
pub(crate) fn finite(row: &csv::StringRecord, column: usize) -> Result<f64, String> {
    let text = row.get(column).unwrap_or_default();
    let value = text.parse().ok().filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| format!("`{text}` is no finite number"))
}
