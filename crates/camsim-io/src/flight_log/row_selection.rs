//! Rows that a table itself says are not of the flight: without a fix, or of a receiver that is not the one in
//! use.

use std::collections::BTreeMap;

use camsim_core::flight_log::Note;

use super::{
    column_meaning::FixCode,
    column_selection::push_warning,
    layout::TableLayout,
    text_table::{Table, is_missing},
};

/// With more values than this a column counts something else than receivers.
const MAX_RECEIVERS: usize = 8;
/// Fewer rows are no flight.
const MIN_ROWS: usize = 2;

/// Removes the rows that the columns of receivers and fixes exclude, with notes.
///
/// # Errors
/// No rows are left: the error message.
pub(super) fn keep_rows(
    table: &mut Table<'_>,
    layout: &TableLayout,
    notes: &mut Vec<Note>,
) -> Result<(), String> {
    keep_one_receiver(table, layout, notes);
    for &(column, code) in &layout.fixes {
        keep_fixes(table, layout, (column, code), notes)?;
    }
    Ok(())
}

fn field_of<'a>(table: &Table<'a>, row: usize, column: usize) -> &'a str {
    table.fields(&table.rows[row]).get(column).copied().unwrap_or("")
}

/// Keeps the rows whose receiver was in use, else those of the receiver of the lowest number.
fn keep_one_receiver(table: &mut Table<'_>, layout: &TableLayout, notes: &mut Vec<Note>) {
    let Some(receiver) = layout.receiver else { return };
    let mut counts: BTreeMap<String, usize> = BTreeMap::new();
    for row in 0..table.rows.len() {
        let name = field_of(table, row, receiver);
        if !is_missing(name) {
            *counts.entry(name.to_owned()).or_default() += 1;
        }
        if counts.len() > MAX_RECEIVERS {
            return;
        }
    }
    if counts.len() < 2 {
        return;
    }
    let in_use = layout.in_use.filter(|&column| {
        let uses: Vec<bool> =
            (0..table.rows.len()).filter_map(|row| flag(field_of(table, row, column))).collect();
        uses.contains(&true) && uses.contains(&false)
    });
    let names: Vec<&String> = counts.keys().collect();
    let first = names
        .iter()
        .min_by(|a, b| number(a).total_cmp(&number(b)))
        .map_or(String::new(), |name| (**name).clone());
    let before = table.rows.len();
    let keeps: Vec<bool> = (0..before)
        .map(|row| {
            let name = field_of(table, row, receiver);
            // Rows of other messages name no receiver.
            is_missing(name)
                || match in_use {
                    Some(column) => flag(field_of(table, row, column)) != Some(false),
                    None => name == first,
                }
        })
        .collect();
    retain(table, &keeps);
    let which = match in_use {
        Some(column) => {
            format!("those that column {}{} says are in use count", column + 1, layout.bracketed_name(column))
        }
        None => format!("those of `{first}` count"),
    };
    let all: Vec<String> = counts.iter().map(|(name, rows)| format!("`{name}` ({rows} rows)")).collect();
    push_warning(
        notes,
        format!(
            "column {}{} has rows of {}: {which}, and {} rows are left out; keep the rows of one to choose another",
            receiver + 1,
            layout.bracketed_name(receiver),
            all.join(" and "),
            before - table.rows.len()
        ),
    );
}

fn number(text: &str) -> f64 {
    text.parse().unwrap_or(f64::INFINITY)
}

/// A flag; `None` where the field is missing or is none.
fn flag(text: &str) -> Option<bool> {
    match text.trim().to_ascii_lowercase().as_str() {
        "true" | "yes" | "t" | "y" => Some(true),
        "false" | "no" | "f" | "n" => Some(false),
        other => other.parse::<f64>().ok().map(|value| value != 0.0),
    }
}

/// Whether a fix is stated; `None` where the field says nothing that is known.
fn has_fix(text: &str, code: FixCode) -> Option<bool> {
    if is_missing(text) && !text.eq_ignore_ascii_case("none") {
        return None;
    }
    if let Ok(value) = text.parse::<f64>() {
        let is_code = value.fract() == 0.0 && value.abs() < 256.0;
        return is_code.then_some(match code {
            FixCode::Dimensions => value >= 3.0,
            FixCode::NonZero => value != 0.0,
            FixCode::NonNegative => value >= 0.0,
        });
    }
    let word: String = text.to_ascii_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
    let word = word.trim_start_matches("gpsfixtype").trim_start_matches("fixtype").trim_start_matches("gps");
    const NONE: &[&str] =
        &["none", "nofix", "no", "invalid", "false", "v", "nogps", "f", "lost", "notvalid", "unavailable"];
    const SOME: &[&str] = &[
        "true",
        "a",
        "t",
        "yes",
        "valid",
        "ok",
        "fix",
        "fixed",
        "rtk",
        "rtkfixed",
        "rtkfix",
        "rtkfloat",
        "float",
        "dgps",
        "single",
        "sbas",
        "ppp",
        "spp",
        "autonomous",
    ];
    match word {
        // `2D Lock`, `3D RTK GPS Lock (float)`.
        word if word.starts_with("2d") => Some(false),
        word if word.starts_with("3d") => Some(true),
        word if NONE.contains(&word) => Some(false),
        word if SOME.contains(&word) => Some(true),
        _ => None,
    }
}

fn keep_fixes(
    table: &mut Table<'_>,
    layout: &TableLayout,
    (column, code): (usize, FixCode),
    notes: &mut Vec<Note>,
) -> Result<(), String> {
    let name = format!("column {}{}", column + 1, layout.bracketed_name(column));
    let field = |row: usize| field_of(table, row, column);
    let rows = 0..table.rows.len();
    let is_flag = |row: usize| is_missing(field(row)) || matches!(number(field(row)), 0.0 | 1.0);
    let code = if code == FixCode::Dimensions
        && rows.clone().all(is_flag)
        && rows.clone().any(|row| number(field(row)) == 1.0)
    {
        push_warning(notes, format!("{name} holds only 0 and 1, so 1 is taken as a fix"));
        FixCode::NonZero
    } else {
        code
    };
    let kind = if code == FixCode::Dimensions { "three-dimensional fix" } else { "fix" };
    let fixes: Vec<Option<bool>> = rows.clone().map(|row| has_fix(field(row), code)).collect();
    if let Some(row) = rows.clone().find(|&row| fixes[row].is_none() && !is_missing(field(row))) {
        let (text, line) = (field(row), table.rows[row].number);
        push_warning(
            notes,
            format!("{name} is not read: `{text}` (line {line}) is no known quality of a fix"),
        );
        return Ok(());
    }
    let left_out = fixes.iter().filter(|fix| **fix == Some(false)).count();
    if left_out == 0 {
        return Ok(());
    }
    if fixes.iter().filter(|fix| **fix == Some(true)).count() < MIN_ROWS {
        return Err(format!(
            "{name} says that {left_out} of {} rows have no {kind}, so there is no flight: remove the column if that \
                is not so",
            fixes.len()
        ));
    }
    let keeps: Vec<bool> = fixes.iter().map(|fix| *fix != Some(false)).collect();
    retain(table, &keeps);
    push_warning(notes, format!("{left_out} rows have no {kind} by {name}, and are left out"));
    Ok(())
}

fn retain(table: &mut Table<'_>, keeps: &[bool]) {
    let mut keeps = keeps.iter();
    table.rows.retain(|_| keeps.next() != Some(&false));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_fixes() {
        use FixCode::{Dimensions, NonNegative, NonZero};
        for (text, code, fix) in [
            ("0", Dimensions, Some(false)),
            ("1", Dimensions, Some(false)),
            ("2", Dimensions, Some(false)),
            ("3", Dimensions, Some(true)),
            ("6", Dimensions, Some(true)),
            ("GPS_FIX_TYPE_NO_FIX", Dimensions, Some(false)),
            ("3D_FIX", Dimensions, Some(true)),
            ("none", Dimensions, Some(false)),
            ("0", NonZero, Some(false)),
            ("5", NonZero, Some(true)),
            ("V", NonZero, Some(false)),
            ("A", NonZero, Some(true)),
            ("False", NonZero, Some(false)),
            ("-1", NonNegative, Some(false)),
            ("0", NonNegative, Some(true)),
            ("", Dimensions, None),
            ("excellent", NonZero, None),
            ("0.93", NonZero, None),
        ] {
            assert_eq!(has_fix(text, code), fix, "{text} {code:?}");
        }
    }
}
