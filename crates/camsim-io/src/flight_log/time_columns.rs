//! Selection of the columns of a header that hold the time.

use camsim_core::flight_log::Note;

use super::{
    column_meaning::ColumnMeaning::{Date, DateTime, NanosecondsPart, Time, TimePart},
    columns::TimeColumns,
    header::{HeaderColumns, normal_form},
    missing_columns::missing_columns_message,
    split_stamps,
    text_table::Table,
    time_fields::TimeFormat,
    units::NANOSECOND,
    word_list::has_word,
};

/// The columns of the time.
///
/// # Errors
/// There is no time, or several columns of it among which none can be preferred.
pub(super) fn time_columns(
    header: &HeaderColumns,
    table: &Table<'_>,
    notes: &mut Vec<Note>,
) -> Result<TimeColumns, String> {
    let times = stamps_of_the_measurement(header, table, notes);
    let mut parts = header.columns(NanosecondsPart);
    parts.retain(|&column| header.stem(column) != "ns" || !counts_satellites(table, column));
    let texts = date_times(header, table, notes);
    let column = one_time(header, [&times, &parts, &texts], notes)?;
    header.check_usable(column)?;
    let unit_ns =
        if times.is_empty() && texts.is_empty() { Some(NANOSECOND.factor) } else { header.factor(column) };
    let time_parts = header.columns(TimePart);
    if is_bare_unit(header, column) && !time_parts.is_empty() {
        return Err(format!(
            "the time is in several columns ({}): write one, such as seconds since the start",
            header.describe(&[&time_parts[..], &[column]].concat())
        ));
    }
    let nanoseconds = nanoseconds_beside(header, column, &times, &parts)?;
    if nanoseconds.is_none() && unit_ns == Some(NANOSECOND.factor) {
        split_stamps::check_is_clock(header, table, column)?;
    }
    let date = date_column(header, column, notes)?;
    let week = week_column(header, column);
    let column = sample_of(header, table, column, notes).unwrap_or(column);
    Ok(TimeColumns { column, unit_ns, integers_are_ns: false, date, week, nanoseconds })
}

/// Whether a name is only a unit: `time, ms` are two parts of one time; `time, time_ms` are two times.
fn is_bare_unit(header: &HeaderColumns, column: usize) -> bool {
    header.parsed(column).is_some_and(|parsed| parsed.is_bare_unit)
}

/// The one column of times, of nanoseconds, or of dates with times.
fn one_time(
    header: &HeaderColumns,
    [times, parts, texts]: [&[usize]; 3],
    notes: &mut Vec<Note>,
) -> Result<usize, String> {
    let names_unit = |column: &usize| header.factor(*column).is_some() && !is_bare_unit(header, *column);
    let with_unit: Vec<usize> = times.iter().copied().filter(names_unit).collect();
    match (times, &with_unit[..], parts, texts) {
        ([column], ..) => Ok(*column),
        ([_, ..], [column], ..) => {
            notes.push(Note::information(format!(
                "of the times {} the one that names its unit counts: `{}`",
                header.describe(times),
                header.name(*column)
            )));
            Ok(*column)
        }
        ([_, ..], ..) => Err(header.ambiguity_message(times)),
        ([], _, _, [column]) | ([], _, [column], []) => Ok(*column),
        ([], _, [], []) => Err(missing_columns_message(header)),
        ([], _, _, []) => Err(header.ambiguity_message(parts)),
        ([], ..) => Err(header.ambiguity_message(texts)),
    }
}

/// The column of the nanoseconds that are added to a time.
fn nanoseconds_beside(
    header: &HeaderColumns,
    time: usize,
    times: &[usize],
    parts: &[usize],
) -> Result<Option<usize>, String> {
    let of_time = split_stamps::nanoseconds_of(header, time);
    if of_time.is_some() || times.is_empty() {
        return Ok(of_time);
    }
    let all_times = header.columns(Time);
    let is_of_another = |part: &usize| {
        all_times.iter().any(|&time| split_stamps::nanoseconds_of(header, time) == Some(*part))
    };
    match parts {
        [part] if header.stem(time).starts_with("sec") => Ok(Some(*part)),
        [_, ..] if !parts.iter().all(is_of_another) => {
            Err(header.ambiguity_message(&[times, parts].concat()))
        }
        _ => Ok(None),
    }
}

/// The normal form of a name without its units in brackets.
fn plain_name(header: &HeaderColumns, column: usize) -> String {
    normal_form(header.name(column).split(['[', '(']).next().unwrap_or(""))
}

/// The column of the dates; of several that whose name begins as that of the time does, else the first.
///
/// # Errors
/// Its name has a unit.
fn date_column(header: &HeaderColumns, time: usize, notes: &mut Vec<Note>) -> Result<Option<usize>, String> {
    let mut dates = header.columns(Date);
    dates.retain(|&column| column != time);
    let first_word = |column: usize| normal_form(header.name(column)).split('_').next().map(str::to_owned);
    let alike = dates.iter().copied().find(|&column| first_word(column) == first_word(time));
    let Some(date) = alike.or(dates.first().copied()) else { return Ok(None) };
    header.check_usable(date)?;
    if dates.len() > 1 {
        notes.push(header.choice_note("dates", &dates, date));
    }
    Ok(Some(date))
}

/// Names of GPS weeks, in normal form.
const WEEKS: &str = "week weeks gps_week gpsweek week_number gps_week_number week_no wn wno";

/// The column of the weeks, beside times that by their name count within one.
fn week_column(header: &HeaderColumns, time: usize) -> Option<usize> {
    let name = plain_name(header, time);
    let is_of_week =
        name.starts_with("sec") || ["tow", "sow", "week", "gps"].iter().any(|part| name.contains(part));
    let is_week = |&column: &usize| has_word(WEEKS, &plain_name(header, column));
    (0..header.0.len()).find(is_week).filter(|_| is_of_week)
}

/// The time of the measurement beside that of its message, as PX4 names it: `timestamp_sample`.
fn sample_of(header: &HeaderColumns, table: &Table<'_>, time: usize, notes: &mut Vec<Note>) -> Option<usize> {
    let name = plain_name(header, time) + "_sample";
    let sample = (0..header.0.len()).find(|&column| plain_name(header, column) == name)?;
    if is_constant(table, sample) {
        return None;
    }
    notes.push(measurement_note(header, &[time, sample], sample));
    Some(sample)
}

fn measurement_note(header: &HeaderColumns, times: &[usize], chosen: usize) -> Note {
    Note::information(format!(
        "of the times {} the one of the measurement counts: `{}`",
        header.describe(times),
        header.name(chosen)
    ))
}

/// Whether a column holds one text in all of several rows.
fn is_constant(table: &Table<'_>, column: usize) -> bool {
    let mut fields = table.column(column);
    let first = fields.next();
    table.rows.len() > 1 && fields.all(|field| Some(field) == first)
}

/// Columns of times, without those that stand still. Of ROS messages the time of the measurement, in their
/// header, counts before the time of their arrival, which jitters.
fn stamps_of_the_measurement(header: &HeaderColumns, table: &Table<'_>, notes: &mut Vec<Note>) -> Vec<usize> {
    let mut times = header.columns(Time);
    let all = times.clone();
    // Parts of a time may stand still.
    let has_parts = header.has(NanosecondsPart);
    times.retain(|&column| has_parts || is_bare_unit(header, column) || !is_constant(table, column));
    if times.is_empty() {
        times = all;
    } else if times.len() < all.len() {
        notes.push(Note::information(format!(
            "of the times {} those that stand still do not count",
            header.describe(&all)
        )));
    }
    let is_of_header = |stem: &str| stem.ends_with("header_stamp") || stem.ends_with("header_stamp_secs");
    let stamps: Vec<usize> =
        times.iter().copied().filter(|&column| is_of_header(header.stem(column))).collect();
    if stamps.len() != 1 || times.len() == 1 {
        return times;
    }
    notes.push(measurement_note(header, &times, stamps[0]));
    stamps
}

/// Whether a column `ns` holds numbers of satellites: a clock of nanoseconds does not stay within a
/// microsecond.
fn counts_satellites(table: &Table<'_>, column: usize) -> bool {
    let is_small = |value: f64| value.is_nan() || value.abs() < 1000.0;
    table.column(column).all(|field| table.number(field).is_some_and(is_small))
}

/// Names of dates with times in photos, the one with decimals of seconds first.
const PHOTO_TIMES: [&str; 4] =
    ["sub_sec_date_time_original", "gps_date_time", "date_time_original", "create_date"];

/// Columns of dates with times. Of several that photos have, one counts.
fn date_times(header: &HeaderColumns, table: &Table<'_>, notes: &mut Vec<Note>) -> Vec<usize> {
    let texts = header.columns(DateTime);
    if texts.is_empty() {
        let format = |column: usize| table.column(column).find_map(TimeFormat::detect);
        let mut dates = header.columns(Date);
        dates.retain(|&column| format(column) == Some(TimeFormat::DateTime));
        return dates;
    }
    let rank = |column: usize| PHOTO_TIMES.iter().position(|name| *name == header.stem(column));
    let first = texts.iter().copied().min_by_key(|&column| rank(column));
    match first.filter(|_| texts.len() > 1 && texts.iter().all(|&column| rank(column).is_some())) {
        Some(first) => {
            notes.push(header.choice_note("times", &texts, first));
            vec![first]
        }
        None => texts,
    }
}
