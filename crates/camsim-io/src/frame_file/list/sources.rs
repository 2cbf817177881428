//! Names with a *, lists and tables, read.

use std::path::{Path, PathBuf};

use super::{Entry, key};
use crate::frame_file::{
    FrameFileError, NameUnit,
    columns::{Column, column},
    poses::words_of,
};

/// A picture with its time.
pub(super) struct Item {
    pub(super) path: PathBuf,
    /// What stands for the * in its name.
    pub(super) star: String,
    pub(super) stamp_ns: Option<i64>,
}

fn row(path: &Path, line: Option<u64>, message: impl Into<String>) -> FrameFileError {
    FrameFileError::Poses { path: path.into(), line, message: message.into() }
}

/// The folder of a pattern, and its name before and after the *.
pub(super) fn pattern_of(path: &Path) -> Result<(PathBuf, [String; 2]), String> {
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

/// Every file that a pattern names: by number where all are numbers, else by name.
pub(super) fn read_pattern(
    pattern: &Path,
    unit: Option<NameUnit>,
    frame_path: &Path,
    name: &'static str,
) -> Result<Vec<Item>, FrameFileError> {
    let fail = |message: String| key(frame_path, name, message);
    let (folder, [before, after]) = pattern_of(pattern).map_err(fail)?;
    // An empty folder name is the working directory.
    let place: &Path = if folder.as_os_str().is_empty() { Path::new(".") } else { &folder };
    let unreadable = |error: std::io::Error| fail(format!("{} cannot be read: {error}", folder.display()));
    let mut items = Vec::new();
    for file in std::fs::read_dir(place).map_err(unreadable)? {
        let file = file.map_err(unreadable)?.file_name().to_string_lossy().into_owned();
        let star = file.strip_prefix(&before).and_then(|rest| rest.strip_suffix(&after));
        // What begins with a dot is hidden, and may be a file that is just being written.
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
        items.push(Item { path: folder.join(&file), star: star.to_owned(), stamp_ns });
    }
    if items.is_empty() {
        return Err(fail(format!("no file is called {}", pattern.display())));
    }
    items.sort_by(|a, b| a.star.cmp(&b.star));
    if items.iter().all(|item| nanoseconds(&item.star, NameUnit::Ns).is_some()) {
        // Large counts overflow as seconds; their whole part then decides.
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

/// `time file` a line; times ascend.
pub(super) fn read_list(path: &Path) -> Result<Vec<Item>, FrameFileError> {
    let mut items: Vec<Item> = Vec::new();
    for (line, words) in lines(path)? {
        let [time, file] = &words[..] else {
            return Err(row(path, Some(line), "is not `time file`: correct it or leave it out"));
        };
        let stamp_ns = stamp(path, line, time, items.last().and_then(|item| item.stamp_ns))?;
        items.push(Item { path: picture(path, line, file)?, star: String::new(), stamp_ns: Some(stamp_ns) });
    }
    if items.is_empty() { Err(row(path, None, "names no picture")) } else { Ok(items) }
}

/// `frames.csv`, or a text of `time color` or `time color time depth`; with what there is to say about it.
pub(super) fn read_table(path: &Path) -> Result<(Vec<Entry>, Vec<String>), FrameFileError> {
    let of_text = path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("txt"));
    let (entries, notes) = if of_text { (read_associations(path)?, Vec::new()) } else { read_csv(path)? };
    if entries.is_empty() { Err(row(path, None, "names no frame")) } else { Ok((entries, notes)) }
}

fn read_associations(path: &Path) -> Result<Vec<Entry>, FrameFileError> {
    let mut entries: Vec<Entry> = Vec::new();
    for (line, words) in lines(path)? {
        let (time, color, depth) = match &words[..] {
            [time, color] => (time, color, None),
            [time, color, _, depth] => (time, color, Some(depth)),
            _ => {
                return Err(row(
                    path,
                    Some(line),
                    "is neither `time color` nor `time color time depth`: correct it or leave it out",
                ));
            }
        };
        let stamp_ns = stamp(path, line, time, entries.last().and_then(|entry| entry.stamp_ns))?;
        let depth = depth.map(|depth| picture(path, line, depth)).transpose()?;
        entries.push(Entry { color: picture(path, line, color)?, depth, stamp_ns: Some(stamp_ns) });
    }
    Ok(entries)
}

/// Where the time is in a row of `frames.csv`, and its unit.
fn time_of(header: &csv::StringRecord) -> Result<Option<(usize, NameUnit)>, String> {
    // camsim's own tables say it as exactly as they can, whatever else they say.
    if let Some(at) =
        header.iter().position(|cell| cell.trim_start_matches('\u{feff}').eq_ignore_ascii_case("stamp_ns"))
    {
        return Ok(Some((at, NameUnit::Ns)));
    }
    let is_time = |name: &str| name.trim_start_matches('\u{feff}').to_lowercase().starts_with('t');
    let times = header.iter().enumerate().filter(|(_, cell)| match column(cell) {
        Column::Time(_) => true,
        Column::WrongUnit => is_time(cell),
        _ => false,
    });
    let times: Vec<(usize, &str)> = times.collect();
    match times[..] {
        [] => Ok(None),
        [(at, cell)] => match column(cell) {
            Column::Time(Some(unit)) => {
                let known =
                    [(1.0, NameUnit::S), (1e-3, NameUnit::Ms), (1e-6, NameUnit::Us), (1e-9, NameUnit::Ns)];
                let known = known.into_iter().find(|(factor, _)| *factor == unit.factor);
                known
                    .map(|(_, unit)| Some((at, unit)))
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

fn read_csv(path: &Path) -> Result<(Vec<Entry>, Vec<String>), FrameFileError> {
    let mut reader =
        csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_path(path).map_err(
            |error| row(path, None, format!("cannot be read: {error}; paths are relative to FRAME.toml")),
        )?;
    let header = reader.headers().map_err(|error| row(path, Some(1), error.to_string()))?.clone();
    let place = |names: &[&str]| {
        names.iter().find_map(|name| {
            header.iter().position(|cell| cell.trim_start_matches('\u{feff}').eq_ignore_ascii_case(name))
        })
    };
    let Some(color_at) = place(&["color", "color_exr", "color_png"]) else {
        return Err(row(
            path,
            Some(1),
            "the header names no column color; the columns are t_s (or stamp_ns, t_ms, t_us, t_ns), color, \
                depth",
        ));
    };
    let depth_at = place(&["depth"]);
    let time_at = time_of(&header).map_err(|message| row(path, Some(1), message))?;
    let twice = |name: &str| {
        header.iter().filter(|cell| cell.trim_start_matches('\u{feff}').eq_ignore_ascii_case(name)).count()
            > 1
    };
    if let Some(name) =
        ["color", "color_exr", "color_png", "depth", "stamp_ns"].into_iter().find(|name| twice(name))
    {
        return Err(row(path, Some(1), format!("the header names two columns {name}: leave one out")));
    }
    // camsim's own tables tell more than is needed here.
    let is_own = place(&["frame"]).is_some() && place(&["stamp_ns"]).is_some();
    let read = [Some(color_at), depth_at, time_at.map(|(at, _)| at), place(&["frame"])];
    let unread: Vec<&str> = header
        .iter()
        .enumerate()
        .filter(|(at, _)| !is_own && !read.contains(&Some(*at)))
        .map(|(_, cell)| cell)
        .collect();
    let notes = match unread[..] {
        [] => Vec::new(),
        _ => vec![format!(
            "{}: the columns {} are not read: frames are of t_s, color and depth",
            path.display(),
            unread.join(", ")
        )],
    };
    let mut entries: Vec<Entry> = Vec::new();
    for record in reader.records() {
        let record = record
            .map_err(|error| row(path, error.position().map(csv::Position::line), error.to_string()))?;
        let line = record.position().map_or(0, csv::Position::line);
        let cell = |at: usize| record.get(at).unwrap_or_default();
        let before = entries.last().and_then(|entry| entry.stamp_ns);
        let stamp_ns = time_at.map(|(at, unit)| stamp_in(path, line, cell(at), unit, before)).transpose()?;
        let depth = depth_at.map(|at| picture(path, line, cell(at))).transpose()?;
        entries.push(Entry { color: picture(path, line, cell(color_at))?, depth, stamp_ns });
    }
    Ok((entries, notes))
}

/// Words of the lines that are no comments, with the line's number.
fn lines(path: &Path) -> Result<Vec<(u64, Vec<String>)>, FrameFileError> {
    let text = std::fs::read_to_string(path).map_err(|error| {
        row(path, None, format!("cannot be read as text: {error}; paths are relative to FRAME.toml"))
    })?;
    let words = |line| words_of(line).map(|words| words.into_iter().map(str::to_owned).collect());
    Ok((1..).zip(text.lines()).filter_map(|(number, line)| Some((number, words(line)?))).collect())
}

fn stamp(path: &Path, line: u64, text: &str, before: Option<i64>) -> Result<i64, FrameFileError> {
    stamp_in(path, line, text, NameUnit::S, before)
}

/// Later than the row before.
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
        .ok_or_else(|| row(path, Some(line), format!("`{text}` is no time{in_seconds}")))?;
    if before.is_some_and(|before| stamp_ns <= before) {
        return Err(row(
            path,
            Some(line),
            "is not later than the row before; sort by time and leave doubles out",
        ));
    }
    Ok(stamp_ns)
}

/// A file of a table, from the table's folder; it must be there before the work begins.
fn picture(path: &Path, line: u64, name: &str) -> Result<PathBuf, FrameFileError> {
    let file = path.parent().unwrap_or(Path::new("")).join(name);
    if name.is_empty() || !file.is_file() {
        return Err(row(
            path,
            Some(line),
            format!("there is no picture `{}`; paths are relative to this table", file.display()),
        ));
    }
    Ok(file)
}

/// Exactly, digit by digit: a Unix time has more than an f64 holds.
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
    // Below a nanosecond nothing is kept.
    let part: String = part.chars().chain(std::iter::repeat('0')).take(decimals).collect();
    let part: i64 = if part.is_empty() { 0 } else { part.parse().ok()? };
    whole.checked_mul(10_i64.pow(decimals as u32))?.checked_add(part).map(|ns| sign * ns)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_to_the_nanosecond() {
        assert_eq!(nanoseconds("1305031452.791720", NameUnit::S), Some(1_305_031_452_791_720_000));
        assert_eq!(nanoseconds("1403715282262142976", NameUnit::Ns), Some(1_403_715_282_262_142_976));
        assert_eq!(nanoseconds("-1.5", NameUnit::Ms), Some(-1_500_000));
        assert_eq!(nanoseconds("2.00000000019", NameUnit::Us), Some(2_000));
        for text in ["", ".", "1e9", "a", "1.2.3", "--1", "99999999999999999999"] {
            assert_eq!(nanoseconds(text, NameUnit::S), None, "{text}");
        }
    }
}
