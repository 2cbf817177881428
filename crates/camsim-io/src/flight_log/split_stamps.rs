//! Times in two columns, as ROS has them: whole seconds, and the nanoseconds since.

use super::{
    column_meaning::ColumnMeaning,
    header::{HeaderColumn, HeaderColumns, ParsedName, normal_form},
    text_table::Table,
    units::{NANOSECOND, SECOND},
    word_list::has_word,
};

const SECONDS: &str = "sec secs second seconds";
const NANOSECONDS: &str = "nsec nsecs nanosec nanosecs nanosecond nanoseconds";
const SECOND_NS: f64 = 1e9;

/// Gives the two columns of each time their meanings: `NAME.secs` and `NAME.nsecs`, whatever the name. A name that
/// is only `nsecs` belongs to the column before it.
pub(super) fn apply(columns: &mut [HeaderColumn]) {
    for part in 0..columns.len() {
        let Some(name) = stem_before(&columns[part].name, NANOSECONDS) else { continue };
        let is_seconds_of =
            |column: &HeaderColumn| stem_before(&column.name, SECONDS).is_some_and(|stem| stem == name);
        let before = part.checked_sub(1).and_then(|before| stem_before(&columns[before].name, SECONDS));
        // `secs` and `nsecs` alone are known names.
        let has_plain_seconds = || columns.iter().any(|column| has_word(SECONDS, &normal_form(&column.name)));
        let (seconds, name) = match before {
            Some(before) if name.is_empty() && !has_plain_seconds() => (part - 1, before),
            _ if name.is_empty() => continue,
            _ => match columns.iter().position(is_seconds_of) {
                Some(seconds) => (seconds, name),
                None => continue,
            },
        };
        let stated =
            |meaning, unit, end| Some(ParsedName::stated(meaning, &format!("{name}{end}"), Some(unit)));
        columns[seconds].parsed = stated(ColumnMeaning::Time, &SECOND, "secs");
        columns[part].parsed = stated(ColumnMeaning::NanosecondsPart, &NANOSECOND, "nsecs");
    }
}

/// The beginning of a name, in normal form, before one of several last words; `None` where it has another.
fn stem_before(name: &str, words: &str) -> Option<String> {
    let normal = normal_form(name.trim_matches(['"', '\'', ' ']));
    let begin = normal.rfind('_').map_or(0, |end| end + 1);
    has_word(words, &normal[begin..]).then(|| normal[..begin].to_owned())
}

/// The column of the nanoseconds that belong to one of seconds.
pub(super) fn nanoseconds_of(header: &HeaderColumns, seconds: usize) -> Option<usize> {
    let name = header.stem(seconds).strip_suffix("secs")?;
    header
        .columns(ColumnMeaning::NanosecondsPart)
        .into_iter()
        .find(|&part| header.stem(part) == format!("{name}nsecs"))
}

/// Refuses nanoseconds within a second as the only time.
///
/// # Errors
/// All numbers are below 1e9, and they begin again.
pub(super) fn check_is_clock(header: &HeaderColumns, table: &Table<'_>, column: usize) -> Result<(), String> {
    let (mut before, mut again) = (f64::NEG_INFINITY, None);
    for row in &table.rows {
        let value = table.number(table.field(row, column));
        let Some(value) = value.filter(|value| !value.is_nan()) else { continue };
        if !(0.0..SECOND_NS).contains(&value) {
            return Ok(());
        }
        if value < before - SECOND_NS / 2.0 {
            again.get_or_insert(row.number);
        }
        before = value;
    }
    match again {
        Some(line) => Err(format!(
            "{} holds nanoseconds within a second, which begin again at line {line}: give the column of the \
                seconds, too, and name both alike (stamp.secs, stamp.nsecs)",
            header.describe(&[column])
        )),
        None => Ok(()),
    }
}
