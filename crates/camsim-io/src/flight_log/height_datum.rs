//! What heights are above, where a column of words, the heights themselves or a comment say it.

use camsim_core::{flight_log::Note, scenario::FlightSpec};

use super::{
    column_meaning::ColumnMeaning,
    column_selection::push_warning,
    columns::Frame,
    header::HeaderColumns,
    streams,
    text_table::{HeaderLine, Table, is_missing},
    units::{Qualifier, VerticalDatum, parse_qualifier},
};

/// Warns where the file says that the heights of a column whose name states no datum are above another one
/// than `flight.height`.
pub(super) fn check(
    header: &HeaderColumns,
    table: &Table<'_>,
    height: usize,
    frame: Frame,
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) {
    let is_unnamed =
        header.parsed(height).is_some_and(|parsed| parsed.meaning == ColumnMeaning::Height(None));
    if frame != Frame::Geodetic || !is_unnamed {
        return;
    }
    let words = header.columns_where(|meaning| meaning == ColumnMeaning::HeightDatum);
    for column in words.into_iter().chain([height]) {
        check_words(header, table, (column, height), spec, notes);
    }
    if let Some((line, datum)) = table.headers.iter().find_map(|line| Some((line.number, of_comment(line)?)))
    {
        notes.extend(stated_note(&format!("line {line}"), datum, spec));
    }
}

fn stated_note(where_stated: &str, datum: VerticalDatum, spec: &FlightSpec) -> Option<Note> {
    let what = format!("the heights, as {where_stated} says,");
    streams::height_note(&what, datum == VerticalDatum::MeanSeaLevel, spec)
}

/// The datum that a field names; `None` for other texts.
fn of_words(text: &str, is_own_column: bool) -> Option<VerticalDatum> {
    let key = text.trim().to_ascii_lowercase();
    match key.as_str() {
        // Codes of photos.
        "0" | "1" if is_own_column => return Some(VerticalDatum::MeanSeaLevel),
        "mslv" | "below sea level" => return Some(VerticalDatum::MeanSeaLevel),
        _ => {}
    }
    match parse_qualifier(key.trim_end_matches(" height"))? {
        Qualifier::Datum(datum) => Some(datum),
        _ => None,
    }
}

/// Checks the words of a column, or behind the unit of heights.
fn check_words(
    header: &HeaderColumns,
    table: &Table<'_>,
    (column, height): (usize, usize),
    spec: &FlightSpec,
    notes: &mut Vec<Note>,
) {
    let is_own_column = column != height;
    let mut found: Option<VerticalDatum> = None;
    for row in &table.rows {
        let fields = table.fields(row);
        let Some(field) = fields.get(column).copied().filter(|field| !is_missing(field)) else { continue };
        let words =
            if is_own_column { field } else { field.split_once(" m ").map_or("", |(_, words)| words) };
        if words.is_empty() {
            return;
        }
        let Some(datum) = of_words(words, is_own_column) else {
            push_warning(
                notes,
                format!(
                    "{} is not read: `{words}` (line {}) names no vertical datum known; flight.height says \
                        what heights are above",
                    header.describe(&[column]),
                    row.number
                ),
            );
            return;
        };
        if *found.get_or_insert(datum) != datum {
            push_warning(
                notes,
                format!(
                    "{} names several vertical datums (line {}): all heights are taken as flight.height says",
                    header.describe(&[column]),
                    row.number
                ),
            );
            return;
        }
        let is_below = is_own_column && (words == "1" || words.eq_ignore_ascii_case("below sea level"));
        let is_positive =
            fields.get(height).and_then(|field| table.number(field)).is_some_and(|value| value > 0.0);
        if is_below && is_positive {
            push_warning(
                notes,
                format!(
                    "{} says below sea level (line {}), but the heights are positive: write them with a minus",
                    header.describe(&[column]),
                    row.number
                ),
            );
            return;
        }
    }
    if let Some(datum) = found {
        notes.extend(stated_note(&format!("column {}", header.describe(&[column])), datum, spec));
    }
}

/// The datum in the comment that RTKLIB writes about its solution.
pub(super) fn of_comment(line: &HeaderLine<'_>) -> Option<VerticalDatum> {
    let (_, after) = line.text.split_once("lat/lon/height=")?;
    match after.split_once('/')?.1.split(|c: char| !c.is_alphanumeric()).next()? {
        "ellipsoidal" => Some(VerticalDatum::Ellipsoid),
        "geodetic" => Some(VerticalDatum::MeanSeaLevel),
        _ => None,
    }
}
