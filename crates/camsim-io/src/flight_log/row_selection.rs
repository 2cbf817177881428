//! Rows that a table itself says are not of the flight: without a fix, or of a receiver that is not the one in
//! use.

use std::collections::BTreeMap;

use camsim_core::flight_log::Note;

use super::{
    column_meaning::FixCode,
    layout::TableLayout,
    text_table::{Line, Table, is_missing},
    word_list::has_word,
};

/// With more values than this a column counts something else than receivers.
pub(super) const MAX_RECEIVERS: usize = 8;
/// Fewer rows are no flight.
pub(super) const MIN_ROWS: usize = 2;

/// The table without the rows that the columns of receivers and fixes exclude.
///
/// # Errors
/// No rows are left: the error message.
pub(super) fn good_rows<'a>(
    table: Table<'a>,
    layout: &TableLayout,
    notes: &mut Vec<Note>,
) -> Result<Table<'a>, String> {
    let table = match layout.receiver {
        Some(column) => of_one_receiver(table, layout, column, notes),
        None => table,
    };
    let in_use = layout.in_use.map(|column| (column, Judgement::InUse));
    let fixes = layout.fixes.iter().map(|&(column, code)| (column, Judgement::Fix(code)));
    in_use.into_iter().chain(fixes).try_fold(table, |table, judged| well_judged(table, layout, judged, notes))
}

/// How the fields of a column judge their rows.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Judgement {
    InUse,
    Fix(FixCode),
}

impl Judgement {
    /// Whether a row counts; `None` where the field says nothing that is known.
    fn of(self, text: &str) -> Option<bool> {
        match self {
            Self::InUse => flag(text),
            Self::Fix(code) => has_fix(text, code),
        }
    }

    fn is_vague(self) -> bool {
        match self {
            Self::InUse => true,
            Self::Fix(code) => code.is_vague(),
        }
    }

    /// What rows that do not count lack.
    fn lack(self) -> &'static str {
        match self {
            Self::InUse => "are not in use",
            Self::Fix(FixCode::Dimensions) => "have no three-dimensional fix",
            Self::Fix(FixCode::Satellites) => "have no satellites",
            Self::Fix(FixCode::Words | FixCode::Negated | FixCode::Rtklib) => "have no valid position",
            Self::Fix(_) => "have no fix",
        }
    }
}

/// The rows whose receiver was in use, else those of the receiver of the lowest number.
fn of_one_receiver<'a>(
    table: Table<'a>,
    layout: &TableLayout,
    receiver: usize,
    notes: &mut Vec<Note>,
) -> Table<'a> {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for name in table.column(receiver).filter(|name| !is_missing(name)) {
        *counts.entry(name).or_default() += 1;
        if counts.len() > MAX_RECEIVERS {
            break;
        }
    }
    if !(2..=MAX_RECEIVERS).contains(&counts.len()) {
        return table;
    }
    let in_use = layout.in_use.filter(|&column| {
        let uses: Vec<bool> = table.column(column).filter_map(flag).collect();
        uses.contains(&true) && uses.contains(&false)
    });
    let first = lowest(&counts);
    let counts_row = |row: &Line<'_>| {
        let name = table.field(row, receiver);
        // Rows of other messages name no receiver.
        is_missing(name)
            || match in_use {
                Some(column) => flag(table.field(row, column)) != Some(false),
                None => name == first,
            }
    };
    let keeps: Vec<bool> = table.rows.iter().map(counts_row).collect();
    let which = match in_use {
        Some(column) => format!("those that {} says are in use count", layout.describe(column)),
        None => format!("those of `{first}` count"),
    };
    notes.push(receivers_note(layout, receiver, &counts, &which, &keeps));
    table.with_rows_kept(&keeps)
}

/// The receiver of the lowest number, else the first by name.
pub(super) fn lowest<'a>(counts: &BTreeMap<&'a str, usize>) -> &'a str {
    counts.keys().min_by(|a, b| number(a).total_cmp(&number(b))).copied().unwrap_or_default()
}

pub(super) fn receivers_note(
    layout: &TableLayout,
    receiver: usize,
    counts: &BTreeMap<&str, usize>,
    which: &str,
    keeps: &[bool],
) -> Note {
    let all: Vec<String> = counts.iter().map(|(name, rows)| format!("`{name}` ({rows} rows)")).collect();
    Note::warning(format!(
        "{} has rows of {}: {which}, and {} rows are skipped; keep the rows of one to choose another",
        layout.describe(receiver),
        all.join(" and "),
        keeps.iter().filter(|keeps| !**keeps).count()
    ))
}

/// A number, also in hexadecimal; infinity for any other text.
fn number(text: &str) -> f64 {
    let hexadecimal = text.strip_prefix("0x").and_then(|digits| u32::from_str_radix(digits, 16).ok());
    hexadecimal.map_or_else(|| text.parse().unwrap_or(f64::INFINITY), f64::from)
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
    let value = number(text);
    if value.is_finite() {
        let is_code = value.fract() == 0.0 && value.abs() < 256.0;
        return match code {
            _ if !is_code => None,
            FixCode::Dimensions => Some(value >= 3.0),
            FixCode::NonZero | FixCode::Satellites => Some(value != 0.0),
            FixCode::NonNegative => Some(value >= 0.0),
            FixCode::Rtklib => (0.0..10.0).contains(&value).then_some(value != 0.0),
            FixCode::Negated => Some(value == 0.0),
            FixCode::Words if value < 0.0 => Some(false),
            FixCode::Words | FixCode::Unknown => None,
        };
    }
    let word: String = text.to_ascii_lowercase().chars().filter(char::is_ascii_alphanumeric).collect();
    let word = word.trim_start_matches("gpsfixtype").trim_start_matches("fixtype").trim_start_matches("gps");
    match code {
        FixCode::Unknown | FixCode::Rtklib | FixCode::Satellites => None,
        FixCode::Negated => flag(text).map(|is_set| !is_set),
        // NMEA's letter of a solution with real ambiguities.
        FixCode::Words if word == "f" => None,
        _ => word_has_fix(word),
    }
}

/// Words for no position, in lower case, without marks.
const NO_FIX: &str = "none nofix no n invalid false v nogps f lost notvalid unavailable void bad fail \
    failed notracking nottracking nosolution insufficientobs noconvergence searching acquiring";

/// Words for a position.
const FIX: &str = "true a d r t y yes valid ok good fix fixed float dgps single sbas waas ppp spp \
    autonomous tracking tracked solcomputed inssolutiongood solutiongood";

/// Beginnings of such words: `3DDiff`, `RTK_INT`, and NovAtel's types of positions.
const FIX_BEGINNINGS: &[&str] = &["3d", "rtk", "narrow", "wide", "l1", "psr", "inspsr", "insrtk"];

fn word_has_fix(word: &str) -> Option<bool> {
    match word {
        // `2D Lock`, `3D RTK GPS Lock (float)`.
        word if word.starts_with("2d") => Some(false),
        word if FIX_BEGINNINGS.iter().any(|beginning| word.starts_with(beginning)) => Some(true),
        word if has_word(NO_FIX, word) => Some(false),
        word if has_word(FIX, word) => Some(true),
        _ => None,
    }
}

/// The table without the rows that a column judges as not of the flight.
fn well_judged<'a>(
    table: Table<'a>,
    layout: &TableLayout,
    (column, judgement): (usize, Judgement),
    notes: &mut Vec<Note>,
) -> Result<Table<'a>, String> {
    let name = layout.describe(column);
    let fields: Vec<&str> = table.column(column).collect();
    let is_flag = |field: &&str| is_missing(field) || matches!(number(field), 0.0 | 1.0);
    let judgement = if judgement == Judgement::Fix(FixCode::Dimensions)
        && fields.iter().all(is_flag)
        && fields.iter().any(|field| number(field) == 1.0)
    {
        notes.push(Note::warning(format!("{name} holds only 0 and 1, so 1 is taken as a fix")));
        Judgement::Fix(FixCode::NonZero)
    } else {
        judgement
    };
    let is_rate = || layout.names.iter().any(|name| ["p", "r"].contains(&&*name.to_ascii_lowercase()));
    if judgement == Judgement::Fix(FixCode::Rtklib) && is_rate() {
        return Ok(table);
    }
    let judged: Vec<Option<bool>> = fields.iter().map(|field| judgement.of(field)).collect();
    let unknown = (0..fields.len()).find(|&row| judged[row].is_none() && !is_missing(fields[row]));
    match unknown {
        Some(row) if !judgement.is_vague() => {
            notes.push(Note::warning(format!(
                "{name} is not read: `{}` (line {}) is no known quality of a fix",
                fields[row], table.rows[row].number
            )));
            return Ok(table);
        }
        Some(_) if judgement != Judgement::Fix(FixCode::Words) => return Ok(table),
        _ => {}
    }
    if judgement == Judgement::Fix(FixCode::Satellites) {
        notes.extend(few_satellites_note(&name, &fields));
    }
    let left_out = judged.iter().filter(|counts| **counts == Some(false)).count();
    if left_out == 0 {
        return Ok(table);
    }
    let (count, lack) = (judged.len(), judgement.lack());
    // Below 0 is no position whatever the other numbers are.
    let is_unknown_code = |field: &str| unknown.is_some() && (0.0..f64::INFINITY).contains(&number(field));
    let kept = (0..count).filter(|&row| judged[row] == Some(true) || is_unknown_code(fields[row]));
    let is_flight = kept.count() >= MIN_ROWS;
    if !is_flight && !judgement.is_vague() {
        return Err(format!(
            "{name} says that {left_out} of {count} rows {lack}, so there is no flight: remove the column if \
                that is not so"
        ));
    }
    let other = other_in_use(&table, layout, column, judgement);
    if !is_flight {
        notes.push(Note::warning(format!(
            "{name} says that {left_out} of {count} rows {lack}: it is not applied, for no flight would be \
                left{other}"
        )));
        return Ok(table);
    }
    notes.push(Note::warning(format!("{left_out} rows {lack} by {name}, and are skipped{other}")));
    let keeps: Vec<bool> = judged.iter().map(|counts| *counts != Some(false)).collect();
    Ok(table.with_rows_kept(&keeps))
}

/// A position in three dimensions and the receiver's clock are four unknowns.
fn few_satellites_note(name: &str, fields: &[&str]) -> Option<Note> {
    let few = fields.iter().filter(|field| (1.0..4.0).contains(&number(field))).count();
    (few > 0).then(|| {
        Note::warning(format!(
            "{few} rows have fewer than four satellites by {name}, which give no height: they are flown as \
                they stand; remove them if their positions jump"
        ))
    })
}

/// Names another message of a merged table whose receiver was in use, as `GPS2.U` beside `GPS.U` says.
fn other_in_use(table: &Table<'_>, layout: &TableLayout, column: usize, judgement: Judgement) -> String {
    let parts = |column: usize| layout.names.get(column).and_then(|name| name.rsplit_once('.'));
    let Some((message, field)) = parts(column).filter(|_| judgement == Judgement::InUse) else {
        return String::new();
    };
    let is_used = |&other: &usize| {
        other != column
            && parts(other).is_some_and(|(_, other)| other == field)
            && table.column(other).any(|field| flag(field) == Some(true))
    };
    (0..layout.names.len()).find(is_used).map_or(String::new(), |other| {
        format!(
            "; {} says that its receiver was: remove the columns of `{message}` to fly it",
            layout.describe(other)
        )
    })
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
