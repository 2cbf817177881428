//! Tables whose lines begin with a tag, as FlySight 2 writes them: `$COL,GNSS,time,...` names the columns of
//! the rows `$GNSS,...`, `$UNIT,GNSS,...` their units.

use camsim_core::flight_log::Note;

use super::{
    header::HeaderColumns,
    text_table::{HeaderLine, Line},
};

/// The rows of the tag that has a time and a position, without the tag, and the lines that name its columns
/// and units. Lines of a table without tags are returned as they are.
pub(super) fn untag<'a>(lines: Vec<Line<'a>>) -> (Vec<Line<'a>>, Vec<HeaderLine<'a>>, Vec<Note>) {
    let column_lines: Vec<(&Line<'a>, &'a str, &'a str)> = lines
        .iter()
        .filter_map(|line| {
            let (tag, names) = line.text.strip_prefix("$COL,")?.split_once(',')?;
            Some((line, tag, names))
        })
        .collect();
    let names_position = |names: &str| {
        let names: Vec<&str> = names.split(',').map(str::trim).collect();
        HeaderColumns::parse(&names).has_time_and_position()
    };
    let chosen = column_lines
        .iter()
        .find(|(_, _, names)| names_position(names))
        .or(column_lines.first())
        .map(|&(line, tag, names)| (line.number, tag, names));
    let Some((number, tag, names)) = chosen else { return (lines, Vec::new(), Vec::new()) };
    let header = |number, text| HeaderLine { number, text, is_comment: false };
    let mut headers = vec![header(number, names)];
    let mut rows = Vec::new();
    let mut others = 0;
    for line in lines {
        let after_tag = |text: &'a str| text.strip_prefix(tag).and_then(|rest| rest.strip_prefix(','));
        if let Some(units) = line.text.strip_prefix("$UNIT,").and_then(after_tag) {
            headers.push(header(line.number, units));
        } else if let Some(fields) = line.text.strip_prefix('$').and_then(after_tag) {
            rows.push(Line { number: line.number, text: fields });
        } else if !["$COL,", "$UNIT,", "$VAR,", "$FLYS,", "$DATA"]
            .iter()
            .any(|tag| line.text.starts_with(tag))
        {
            others += 1;
        }
    }
    let note = Note::information(format!(
        "the {} lines `${tag}` are read, {others} lines of other kinds are not",
        rows.len()
    ));
    (rows, headers, vec![note])
}
