//! Lines above the names of the columns that are no comments, as `Length Units,Millimeters`.

use super::{
    header::HeaderColumns,
    text_table::{Line, Separator, is_header, is_value},
};

/// Lines at the beginning of a file among which the names are looked for.
const MAX_LINES: usize = 60;

/// Number of lines above the names of the columns, where some of them would be taken for rows; else 0.
///
/// Such lines begin with a word or with nothing, and the names below them include a time and a position.
pub(super) fn length(lines: &[Line<'_>], separator: Separator) -> usize {
    let mut fields = Vec::new();
    let mut has_row_above = false;
    for (index, line) in lines.iter().take(MAX_LINES).enumerate() {
        if line.text.starts_with(['#', '%']) {
            continue;
        }
        if is_header(line.text, separator, &mut fields) {
            if has_row_above && HeaderColumns::parse(&fields).has_time_and_position() {
                return index;
            }
            continue;
        }
        let first = fields.first().copied().unwrap_or("");
        if is_value(first, separator != Separator::Comma) {
            return 0;
        }
        has_row_above = true;
    }
    0
}
