//! What heights are above, where a column of words, the heights themselves or a comment say it.

use camsim_core::{
    flight_log::Note,
    scenario::{FlightSpec, HeightReference},
};

use super::{
    column_meaning::ColumnMeaning,
    columns::Frame,
    header::HeaderColumns,
    streams,
    text_table::{HeaderLine, Table, is_missing},
    units::{Qualifier, parse_qualifier},
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
    for column in header.columns(ColumnMeaning::HeightDatum).into_iter().chain([height]) {
        notes.extend(match stated(table, column, height) {
            Ok(datum) => {
                datum.and_then(|datum| note(&format!("column {}", header.describe(&[column])), datum, spec))
            }
            Err(problem) => Some(Note::warning(format!("{} {problem}", header.describe(&[column])))),
        });
    }
    let comment = table.headers.iter().find_map(|line| Some((line.number, of_comment(line)?)));
    notes.extend(comment.and_then(|(line, datum)| note(&format!("line {line}"), datum, spec)));
}

fn note(where_stated: &str, datum: HeightReference, spec: &FlightSpec) -> Option<Note> {
    streams::height_note(&format!("the heights, as {where_stated} says,"), datum, spec)
}

/// The datum that a field names; `None` for other texts.
fn of_words(text: &str, is_own_column: bool) -> Option<HeightReference> {
    let key = text.trim().to_ascii_lowercase();
    match key.as_str() {
        // Codes of photos.
        "0" | "1" if is_own_column => return Some(HeightReference::Msl),
        "mslv" | "below sea level" => return Some(HeightReference::Msl),
        _ => {}
    }
    match parse_qualifier(key.trim_end_matches(" height"))? {
        Qualifier::Datum(datum) => Some(datum),
        _ => None,
    }
}

/// The datum that a column of words, or the words behind the unit of heights, name; `None` if there are none.
///
/// # Errors
/// The words are not read: why, behind the name of the column.
fn stated(table: &Table<'_>, column: usize, height: usize) -> Result<Option<HeightReference>, String> {
    let is_own_column = column != height;
    let mut found: Option<HeightReference> = None;
    for row in &table.rows {
        let field = table.field(row, column);
        if is_missing(field) {
            continue;
        }
        let words =
            if is_own_column { field } else { field.split_once(" m ").map_or("", |(_, words)| words) };
        if words.is_empty() {
            return Ok(None);
        }
        let line = row.number;
        let datum = of_words(words, is_own_column).ok_or_else(|| {
            format!(
                "is not read: `{words}` (line {line}) names no vertical datum known; flight.height says what \
                    heights are above"
            )
        })?;
        if *found.get_or_insert(datum) != datum {
            return Err(format!(
                "names several vertical datums (line {line}): all heights are taken as flight.height says"
            ));
        }
        let is_below = is_own_column && (words == "1" || words.eq_ignore_ascii_case("below sea level"));
        if is_below && table.number(table.field(row, height)).is_some_and(|value| value > 0.0) {
            return Err(format!(
                "says below sea level (line {line}), but the heights are positive: write them with a minus"
            ));
        }
    }
    Ok(found)
}

/// The datum in the comment that RTKLIB writes about its solution.
pub(super) fn of_comment(line: &HeaderLine<'_>) -> Option<HeightReference> {
    let (_, after) = line.text.split_once("lat/lon/height=")?;
    match after.split_once('/')?.1.split(|c: char| !c.is_alphanumeric()).next()? {
        "ellipsoidal" => Some(HeightReference::Ellipsoid),
        "geodetic" => Some(HeightReference::Msl),
        _ => None,
    }
}
