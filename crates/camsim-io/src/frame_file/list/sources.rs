//! Reads patterns, lists and tables of pictures.

use std::path::{Path, PathBuf};

use super::{FrameEntry, key_error};
use crate::{
    frame_file::{
        FrameFileError, NameUnit,
        columns::{TableColumn, parse_column},
        poses::split_words,
    },
    table::open_table,
};

/// A picture, with its time if it has one.
pub(super) struct TimedPicture {
    /// Path of the picture.
    pub(super) path: PathBuf,
    /// Text that stands for the * in its name.
    pub(super) star: String,
    /// Time, nanoseconds.
    pub(super) stamp_ns: Option<i64>,
}

/// An error about a line of a table.
fn row_error(path: &Path, line: Option<u64>, message: impl Into<String>) -> FrameFileError {
    FrameFileError::Poses { path: path.into(), line, message: message.into() }
}

/// Splits a pattern into its folder and the name before and after the *.
pub(super) fn split_pattern(path: &Path) -> Result<(PathBuf, [String; 2]), String> {
    let name = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let folder = path.parent().unwrap_or(Path::new("")).to_path_buf();
    match name.split('*').collect::<Vec<_>>()[..] {
        [before, after] if !folder.to_string_lossy().contains('*') => {
            Ok((folder, [before.to_owned(), after.to_owned()]))
        }
        _ => {
            Err(format!("`{}` must have one * in the file's name, and none in the folder's", path.display()))
        }
    }
}

/// All files that match a pattern: in the order of numbers if all texts for the * are numbers, else by name.
pub(super) fn read_pattern(
    pattern: &Path,
    unit: Option<NameUnit>,
    frame_path: &Path,
    name: &'static str,
) -> Result<Vec<TimedPicture>, FrameFileError> {
    let fail = |message: String| key_error(frame_path, name, message);
    let (folder, [before, after]) = split_pattern(pattern).map_err(fail)?;
    // An empty folder name is the working directory.
    let readable_folder: &Path = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
    let unreadable = |error: std::io::Error| fail(format!("{} cannot be read: {error}", folder.display()));
    let mut items = Vec::new();
    for file in std::fs::read_dir(readable_folder).map_err(unreadable)? {
        let file = file.map_err(unreadable)?.file_name().to_string_lossy().into_owned();
        let star = file.strip_prefix(&before).and_then(|rest| rest.strip_suffix(&after));
        // Hidden files are skipped; they may be temporary.
        let Some(star) = star.filter(|star| !star.is_empty() && !file.starts_with('.')) else { continue };
        let stamp_ns = match unit {
            None => None,
            Some(unit) => Some(nanoseconds(star, unit).ok_or_else(|| {
                fail(format!(
                    "{}: `{star}` is no time, which name_unit says that it is",
                    folder.join(&file).display()
                ))
            })?),
        };
        items.push(TimedPicture { path: folder.join(&file), star: star.to_owned(), stamp_ns });
    }
    if items.is_empty() {
        return Err(fail(format!("no file is called {}", pattern.display())));
    }
    items.sort_by(|a, b| a.star.cmp(&b.star));
    if items.iter().all(|item| nanoseconds(&item.star, NameUnit::Ns).is_some()) {
        // Integers that overflow as seconds are ordered as nanoseconds.
        items.sort_by_key(|item| {
            (nanoseconds(&item.star, NameUnit::S), nanoseconds(&item.star, NameUnit::Ns))
        });
    }
    if let Some([a, b]) =
        items.array_windows().find(|[a, b]| a.stamp_ns.is_some() && a.stamp_ns == b.stamp_ns)
    {
        return Err(fail(format!("{} and {} are of one time", a.path.display(), b.path.display())));
    }
    Ok(items)
}

/// Reads a list with a line `time file` per picture, by ascending time.
pub(super) fn read_list(path: &Path) -> Result<Vec<TimedPicture>, FrameFileError> {
    let mut items: Vec<TimedPicture> = Vec::new();
    for (line, words) in lines(path)? {
        let [time, file] = &words[..] else {
            return Err(row_error(path, Some(line), "is not `time file`: correct it or leave it out"));
        };
        let stamp_ns = stamp(path, line, time, items.last().and_then(|item| item.stamp_ns))?;
        items.push(TimedPicture {
            path: picture(path, line, file)?,
            star: String::new(),
            stamp_ns: Some(stamp_ns),
        });
    }
    if items.is_empty() { Err(row_error(path, None, "names no picture")) } else { Ok(items) }
}

/// Reads a `frames.csv`, or a text of lines `time color` or `time color time depth`. Returns frames and
/// notes.
pub(super) fn read_table(path: &Path) -> Result<(Vec<FrameEntry>, Vec<String>), FrameFileError> {
    let is_text = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("txt"));
    let (entries, notes) = if is_text { (read_associations(path)?, Vec::new()) } else { read_csv(path)? };
    if entries.is_empty() { Err(row_error(path, None, "names no frame")) } else { Ok((entries, notes)) }
}

fn read_associations(path: &Path) -> Result<Vec<FrameEntry>, FrameFileError> {
    let mut entries: Vec<FrameEntry> = Vec::new();
    for (line, words) in lines(path)? {
        let (time, color, depth) = match &words[..] {
            [time, color] => (time, color, None),
            [time, color, _, depth] => (time, color, Some(depth)),
            _ => {
                return Err(row_error(
                    path,
                    Some(line),
                    "is neither `time color` nor `time color time depth`: correct it or leave it out",
                ));
            }
        };
        let stamp_ns = stamp(path, line, time, entries.last().and_then(|entry| entry.stamp_ns))?;
        let depth = depth.map(|depth| picture(path, line, depth)).transpose()?;
        entries.push(FrameEntry { color: picture(path, line, color)?, depth, stamp_ns: Some(stamp_ns) });
    }
    Ok(entries)
}

/// Index and unit of the time column of `frames.csv`; `None` if it has none.
fn time_column(header: &csv::StringRecord) -> Result<Option<(usize, NameUnit)>, String> {
    // stamp_ns, as in tables that camsim wrote, takes precedence over other times.
    if let Some(index) = header.iter().position(|cell| cell.eq_ignore_ascii_case("stamp_ns")) {
        return Ok(Some((index, NameUnit::Ns)));
    }
    let is_time = |name: &str| name.to_lowercase().starts_with('t');
    let times = header.iter().enumerate().filter(|(_, cell)| match parse_column(cell) {
        TableColumn::Time(_) => true,
        TableColumn::WrongUnit => is_time(cell),
        _ => false,
    });
    let times: Vec<(usize, &str)> = times.collect();
    match times[..] {
        [] => Ok(None),
        [(index, cell)] => match parse_column(cell) {
            TableColumn::Time(Some(unit)) => {
                let known =
                    [(1.0, NameUnit::S), (1e-3, NameUnit::Ms), (1e-6, NameUnit::Us), (1e-9, NameUnit::Ns)];
                let known = known.into_iter().find(|(factor, _)| *factor == unit.factor);
                known
                    .map(|(_, unit)| Some((index, unit)))
                    .ok_or_else(|| format!("the column `{cell}` is in minutes: give t_s"))
            }
            _ => Err(format!(
                "the column `{cell}` does not say its unit, or one that is not known: call it t_s, t_ms, \
                    t_us or t_ns"
            )),
        },
        [(_, a), (_, b), ..] => {
            Err(format!("the header names two columns of time, `{a}` and `{b}`: leave one out"))
        }
    }
}

fn read_csv(path: &Path) -> Result<(Vec<FrameEntry>, Vec<String>), FrameFileError> {
    let mut reader = open_table(path).map_err(|error| {
        row_error(path, None, format!("cannot be read: {error}; paths are relative to FRAME.toml"))
    })?;
    let header = reader.headers().map_err(|error| row_error(path, Some(1), error.to_string()))?.clone();
    let index_of = |names: &[&str]| {
        names.iter().find_map(|name| header.iter().position(|cell| cell.eq_ignore_ascii_case(name)))
    };
    let Some(color_index) = index_of(&["color", "color_exr", "color_png"]) else {
        return Err(row_error(
            path,
            Some(1),
            "the header names no column color; the columns are t_s (or stamp_ns, t_ms, t_us, t_ns), color, \
                depth",
        ));
    };
    let depth_index = index_of(&["depth"]);
    let time_index = time_column(&header).map_err(|message| row_error(path, Some(1), message))?;
    let is_repeated = |name: &str| header.iter().filter(|cell| cell.eq_ignore_ascii_case(name)).count() > 1;
    if let Some(name) =
        ["color", "color_exr", "color_png", "depth", "stamp_ns"].into_iter().find(|name| is_repeated(name))
    {
        return Err(row_error(path, Some(1), format!("the header names two columns {name}: leave one out")));
    }
    let notes = unread_columns_note(
        path,
        &header,
        [Some(color_index), depth_index, time_index.map(|(index, _)| index)],
    );
    let mut entries: Vec<FrameEntry> = Vec::new();
    for record in reader.records() {
        let record = record
            .map_err(|error| row_error(path, error.position().map(csv::Position::line), error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let cell = |index: usize| record.get(index).unwrap_or_default();
        let before = entries.last().and_then(|entry| entry.stamp_ns);
        let stamp_ns =
            time_index.map(|(index, unit)| stamp_in(path, line, cell(index), unit, before)).transpose()?;
        let depth = depth_index.map(|index| picture(path, line, cell(index))).transpose()?;
        entries.push(FrameEntry { color: picture(path, line, cell(color_index))?, depth, stamp_ns });
    }
    Ok((entries, notes))
}

/// A note about the columns that are not read, unless camsim wrote the table. `read` are indices of columns.
fn unread_columns_note(path: &Path, header: &csv::StringRecord, read: [Option<usize>; 3]) -> Vec<String> {
    let is_named = |cell: &str, name: &str| cell.eq_ignore_ascii_case(name);
    let index_of = |name: &str| header.iter().position(|cell| is_named(cell, name));
    let frame_index = index_of("frame");
    if frame_index.is_some() && index_of("stamp_ns").is_some() {
        return Vec::new();
    }
    let unread: Vec<&str> = header
        .iter()
        .enumerate()
        .filter(|(index, _)| !read.contains(&Some(*index)) && frame_index != Some(*index))
        .map(|(_, cell)| cell)
        .collect();
    match unread[..] {
        [] => Vec::new(),
        _ => vec![format!(
            "{}: the columns {} are not read: frames are of t_s, color and depth",
            path.display(),
            unread.join(", ")
        )],
    }
}

/// Words of the lines that are no comments, each with its line number.
fn lines(path: &Path) -> Result<Vec<(u64, Vec<String>)>, FrameFileError> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        row_error(path, None, format!("cannot be read as text: {error}; paths are relative to FRAME.toml"))
    })?;
    let words = |line| split_words(line).map(|words| words.into_iter().map(str::to_owned).collect());
    Ok((1..).zip(text.lines()).filter_map(|(number, line)| Some((number, words(line)?))).collect())
}

/// Parses a stamp in seconds, later than `before`.
fn stamp(path: &Path, line: u64, text: &str, before: Option<i64>) -> Result<i64, FrameFileError> {
    stamp_in(path, line, text, NameUnit::S, before)
}

/// Parses a stamp in a unit, later than `before`.
fn stamp_in(
    path: &Path,
    line: u64,
    text: &str,
    unit: NameUnit,
    before: Option<i64>,
) -> Result<i64, FrameFileError> {
    let in_seconds = if unit == NameUnit::S {
        " in seconds; of another unit give a .csv with the column t_ms, t_us or t_ns"
    } else {
        ""
    };
    let stamp_ns = nanoseconds(text, unit)
        .ok_or_else(|| row_error(path, Some(line), format!("`{text}` is no time{in_seconds}")))?;
    if before.is_some_and(|before| stamp_ns <= before) {
        return Err(row_error(
            path,
            Some(line),
            "is not later than the row before; sort by time and leave doubles out",
        ));
    }
    Ok(stamp_ns)
}

/// Path of a picture that a table names, relative to its folder. The file must exist.
fn picture(path: &Path, line: u64, name: &str) -> Result<PathBuf, FrameFileError> {
    let file = path.parent().unwrap_or(Path::new("")).join(name);
    if name.is_empty() || !file.is_file() {
        return Err(row_error(
            path,
            Some(line),
            format!("there is no picture `{}`; paths are relative to this table", file.display()),
        ));
    }
    Ok(file)
}

/// Parses a time exactly, digit by digit, as an f64 cannot hold Unix time in nanoseconds.
fn nanoseconds(text: &str, unit: NameUnit) -> Option<i64> {
    let decimals = match unit {
        NameUnit::S => 9,
        NameUnit::Ms => 6,
        NameUnit::Us => 3,
        NameUnit::Ns => 0,
    };
    let (sign, digits) = text.strip_prefix('-').map_or((1, text), |rest| (-1, rest));
    let (whole, part) = digits.split_once('.').unwrap_or((digits, ""));
    let all_digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || !all_digits(whole) || !all_digits(part) {
        return None;
    }
    let whole: i64 = whole.parse().ok()?;
    // Fractions of a nanosecond are cut off.
    let part: String = part.chars().chain(std::iter::repeat('0')).take(decimals).collect();
    let part: i64 = if part.is_empty() { 0 } else { part.parse().ok()? };
    whole.checked_mul(10_i64.pow(decimals as u32))?.checked_add(part).map(|ns| sign * ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_exact_to_the_nanosecond() {
        assert_eq!(nanoseconds("1305031452.791720", NameUnit::S), Some(1_305_031_452_791_720_000));
        assert_eq!(nanoseconds("1403715282262142976", NameUnit::Ns), Some(1_403_715_282_262_142_976));
        assert_eq!(nanoseconds("-1.5", NameUnit::Ms), Some(-1_500_000));
        assert_eq!(nanoseconds("2.00000000019", NameUnit::Us), Some(2_000));
        for text in ["", ".", "1e9", "a", "1.2.3", "--1", "99999999999999999999"] {
            assert_eq!(nanoseconds(text, NameUnit::S), None, "{text}");
        }
    }
}
