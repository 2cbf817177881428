//! Delimited text tables: lines, separators, quotes, headers, numbers.

use std::collections::BTreeMap;

use camsim_core::flight_log::Note;

use super::{error::LogProblem, preamble, tagged_lines, time_fields};

/// Lines that are sampled to detect the separator.
const SAMPLE_LINES: usize = 32;
/// Comments among and below the data that are looked at.
const MAX_LATER_COMMENTS: usize = 100;

/// Separator of fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    Semicolon,
    Tab,
    Comma,
    Space,
}

impl Separator {
    const ALL: [Self; 4] = [Self::Semicolon, Self::Tab, Self::Comma, Self::Space];

    fn character(self) -> char {
        match self {
            Self::Semicolon => ';',
            Self::Tab => '\t',
            Self::Comma => ',',
            Self::Space => ' ',
        }
    }

    /// The separator that splits lines into the most numbers and times.
    fn detect(lines: &[&str]) -> Self {
        let mut fields = Vec::new();
        let mut best = (0, Self::Space);
        // Of equal scores the first in `ALL` wins, which is the least likely within numbers.
        for separator in Self::ALL.into_iter().rev() {
            let mut score = 0;
            for line in lines {
                separator.split(line, &mut fields);
                score += fields.iter().filter(|field| is_value(field, separator != Self::Comma)).count();
            }
            if score > 0 && score >= best.0 {
                best = (score, separator);
            }
        }
        best.1
    }

    /// Splits a line into fields, trimmed and without their quotes.
    pub(super) fn split<'a>(self, line: &'a str, fields: &mut Vec<&'a str>) {
        fields.clear();
        if line.contains('"') {
            return self.split_quoted(line, fields);
        }
        match self {
            Self::Space => fields.extend(line.split_whitespace()),
            _ => fields.extend(line.split(self.character()).map(str::trim)),
        }
    }

    /// The field of a column of a line; empty where the line is too short.
    fn field(self, line: &str, column: usize) -> &str {
        let field = match self {
            _ if line.contains('"') => {
                let mut fields = Vec::new();
                self.split_quoted(line, &mut fields);
                fields.get(column).copied()
            }
            Self::Space => line.split_whitespace().nth(column),
            _ => line.split(self.character()).nth(column).map(str::trim),
        };
        field.unwrap_or("")
    }

    fn split_quoted<'a>(self, line: &'a str, fields: &mut Vec<&'a str>) {
        let is_end = |c: char| if self == Self::Space { c.is_whitespace() } else { c == self.character() };
        let mut rest = line;
        loop {
            let blank = |c: char| c.is_whitespace() && c != self.character();
            rest = if self == Self::Space { rest.trim_start() } else { rest.trim_start_matches(blank) };
            if self == Self::Space && rest.is_empty() {
                return;
            }
            // A quote without a closing one is an ordinary character.
            let quoted = rest
                .strip_prefix('"')
                .and_then(|inner| closing_quote(inner).map(|end| (&inner[..end], &inner[end + 1..])));
            let after = match quoted {
                Some((field, after)) => {
                    fields.push(field.trim());
                    after
                }
                None => {
                    let end = rest.find(is_end).unwrap_or(rest.len());
                    fields.push(rest[..end].trim());
                    &rest[end..]
                }
            };
            match after.find(is_end) {
                Some(end) => rest = &after[end + after[end..].chars().next().map_or(1, char::len_utf8)..],
                None => return,
            }
        }
    }
}

/// Byte offset of the closing quote. Two quotes in a row are an escaped quote.
fn closing_quote(text: &str) -> Option<usize> {
    let mut start = 0;
    loop {
        let quote = start + text[start..].find('"')?;
        if !text[quote + 1..].starts_with('"') {
            return Some(quote);
        }
        start = quote + 2;
    }
}

/// One line of data.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    /// Number in the file, from 1.
    pub(super) number: usize,
    /// Text without surrounding blanks.
    pub(super) text: &'a str,
}

/// A line that may name columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeaderLine<'a> {
    /// Number in the file, from 1.
    pub(super) number: usize,
    /// Text without the mark of a comment.
    pub(super) text: &'a str,
    /// Whether it may be prose: a comment, or a line of a preamble. Any other line below the names must state
    /// units.
    pub(super) is_comment: bool,
}

/// The lines of a file, sorted into data and possible headers.
#[derive(Clone, Debug)]
pub(super) struct Table<'a> {
    /// Lines before the data that may name columns, in the file's order.
    pub(super) headers: Vec<HeaderLine<'a>>,
    /// Comments among and below the data.
    pub(super) later_comments: Vec<HeaderLine<'a>>,
    /// Notes about lines that are not read.
    pub(super) notes: Vec<Note>,
    /// Lines of data, in the file's order.
    pub(super) rows: Vec<Line<'a>>,
    /// Separator of fields.
    pub(super) separator: Separator,
    /// Whether numbers have decimal commas, not points.
    pub(super) has_decimal_commas: bool,
    /// Number of columns without the empty ones at the end, in sampled rows of the most frequent width.
    pub(super) columns: usize,
    /// Number of fields of these rows, empty ones included.
    pub(super) width: usize,
}

impl<'a> Table<'a> {
    /// The table of a text that has rows.
    ///
    /// # Errors
    /// There are no rows of data.
    pub(super) fn with_rows(content: &'a str) -> Result<Self, LogProblem> {
        let table = Self::new(content);
        let lines = table.headers.len();
        // One comment or two are a file without data, not data behind marks.
        if table.rows.is_empty() && lines > 2 && table.headers.iter().all(|line| line.is_comment) {
            return Err(LogProblem::Content(format!(
                "all {lines} lines begin with # or %, so all are comments: remove these marks from the lines \
                    of data"
            )));
        }
        if table.rows.is_empty() { Err(LogProblem::Empty) } else { Ok(table) }
    }

    /// Detects separator, headers, width and decimal commas of a text.
    // Long because each step needs the results of the one before.
    fn new(content: &'a str) -> Self {
        // Files of classic Mac OS end lines with a carriage return alone.
        let has_cr_only = !content.contains('\n');
        let texts: Box<dyn Iterator<Item = &'a str>> =
            if has_cr_only { Box::new(content.split('\r')) } else { Box::new(content.lines()) };
        // Tabs are not trimmed: one at the start of a line marks an empty field.
        let lines: Vec<Line<'a>> = texts
            .enumerate()
            .map(|(index, text)| Line { number: index + 1, text: text.trim_matches([' ', '\r']) })
            .filter(|line| !line.text.trim().is_empty())
            .collect();
        let (lines, tagged_headers, notes) = tagged_lines::untag(lines);
        let is_comment = |line: &Line<'_>| line.text.starts_with(['#', '%']);
        let body: Vec<&str> = lines.iter().filter(|line| !is_comment(line)).map(|line| line.text).collect();
        let sample: Vec<&str> =
            body.iter().copied().step_by(body.len().div_ceil(SAMPLE_LINES).max(1)).collect();
        // The last line is added so that a header is less than half of a small sample.
        let last = body.last().into_iter().copied();
        let separator = Separator::detect(&sample.into_iter().chain(last).collect::<Vec<_>>());

        let mut headers = tagged_headers;
        let mut later_comments = Vec::new();
        let mut rows = Vec::new();
        let mut fields = Vec::new();
        let preamble_lines = preamble::length(&lines, separator);
        for (index, line) in lines.into_iter().enumerate() {
            let line_is_comment = is_comment(&line);
            let text =
                if line_is_comment { line.text.trim_start_matches(['#', '%']).trim() } else { line.text };
            let is_prose = line_is_comment || index < preamble_lines;
            let header = HeaderLine { number: line.number, text, is_comment: is_prose };
            if rows.is_empty() && (is_prose || is_header(line.text, separator, &mut fields)) {
                headers.push(header);
            } else if !line_is_comment {
                rows.push(line);
            } else if later_comments.len() < MAX_LATER_COMMENTS {
                later_comments.push(header);
            }
        }
        let mut table = Self {
            headers,
            later_comments,
            notes,
            rows,
            separator,
            has_decimal_commas: false,
            columns: 0,
            width: 0,
        };
        let (mut commas, mut points) = (0, 0);
        // For each number of fields: the number of rows, and of columns up to the last that is not empty.
        let mut widths: BTreeMap<usize, (usize, usize)> = BTreeMap::new();
        for row in table.sample(500) {
            separator.split(row.text, &mut fields);
            let used = fields.iter().rposition(|field| !field.is_empty()).map_or(0, |last| last + 1);
            let (rows, columns) = widths.entry(fields.len()).or_default();
            *rows += 1;
            *columns = used.max(*columns);
            commas += fields
                .iter()
                .filter(|field| number(field, false).is_none() && number(field, true).is_some())
                .count();
            points +=
                fields.iter().filter(|field| field.contains('.') && number(field, false).is_some()).count();
        }
        // The most frequent width counts. Rows with surplus fields are refused when they are parsed.
        if let Some((&width, &(_, columns))) = widths.iter().max_by_key(|(_, (rows, _))| *rows) {
            (table.columns, table.width) = (columns, width);
        }
        table.has_decimal_commas = separator != Separator::Comma && commas > 0 && points == 0;
        table
    }

    /// The fields of a row.
    pub(super) fn fields(&self, row: &Line<'a>) -> Vec<&'a str> {
        let mut fields = Vec::new();
        self.separator.split(row.text, &mut fields);
        fields
    }

    /// The field of a row; empty where the row is too short.
    pub(super) fn field(&self, row: &Line<'a>, column: usize) -> &'a str {
        self.separator.field(row.text, column)
    }

    /// The fields of a column.
    pub(super) fn column(&self, column: usize) -> impl Iterator<Item = &'a str> + Clone {
        self.rows.iter().map(move |row| self.field(row, column))
    }

    /// Splits a header line into names, by the separator of the rows or by another one that gives as many
    /// names as there are columns.
    pub(super) fn names(&self, text: &'a str) -> Vec<&'a str> {
        let mut names = Vec::new();
        let mut split = |separator: Separator| {
            separator.split(text, &mut names);
            if separator == Separator::Space {
                join_bracketed_units(&names, text)
            } else {
                without_trailing_empty(&names)
            }
        };
        let first = split(self.separator);
        if self.fits(first.len()) {
            return first;
        }
        let others = Separator::ALL
            .into_iter()
            .filter(|&separator| separator != self.separator && text.contains(separator.character()));
        others.map(split).find(|names| self.fits(names.len())).unwrap_or(first)
    }

    /// The fields of a line that has one for each of `count` columns, by the separator of the rows or by
    /// another one. Empty ones at the end may be missing.
    pub(super) fn cells(&self, text: &'a str, count: usize) -> Option<Vec<&'a str>> {
        let mut fields = Vec::new();
        [self.separator].into_iter().chain(Separator::ALL).find_map(|separator| {
            separator.split(text, &mut fields);
            let filled = without_trailing_empty(&fields).len();
            let is_short = separator == Separator::Space && fields.len() < count;
            let fits = (2..=count).contains(&filled) && !is_short;
            fits.then(|| fields.iter().copied().chain(std::iter::repeat("")).take(count).collect())
        })
    }

    /// Whether the number of names matches the number of columns.
    pub(super) fn fits(&self, names: usize) -> bool {
        (self.columns..=self.width).contains(&names)
    }

    /// Parses a number of this table, as the function [`number`] does.
    pub(super) fn number(&self, field: &str) -> Option<f64> {
        number(field, self.has_decimal_commas)
    }

    /// The first number of a column.
    pub(super) fn first_number(&self, column: usize) -> Option<f64> {
        self.column(column).filter_map(|field| self.number(field)).find(|value| value.is_finite())
    }

    /// The table of those rows that are kept.
    pub(super) fn with_rows_kept(mut self, keeps: &[bool]) -> Self {
        let mut keeps = keeps.iter();
        self.rows.retain(|_| keeps.next() != Some(&false));
        self
    }

    /// Up to `count` rows, evenly spaced over the file.
    pub(super) fn sample(&self, count: usize) -> impl Iterator<Item = &Line<'a>> {
        self.rows.iter().step_by(self.rows.len().div_ceil(count).max(1))
    }
}

/// Joins names and units that blanks separate: `time [s]` is one name.
fn join_bracketed_units<'a>(names: &[&'a str], text: &'a str) -> Vec<&'a str> {
    let mut joined: Vec<&'a str> = Vec::with_capacity(names.len());
    for name in names {
        match joined.last_mut() {
            Some(last) if name.starts_with(['[', '(']) => {
                // Both are slices of `text`.
                let start = last.as_ptr() as usize - text.as_ptr() as usize;
                let end = name.as_ptr() as usize - text.as_ptr() as usize + name.len();
                *last = &text[start..end];
            }
            _ => joined.push(name),
        }
    }
    joined
}

/// Names without the empty ones at the end.
fn without_trailing_empty<'a>(names: &[&'a str]) -> Vec<&'a str> {
    let end = names.iter().rposition(|name| !name.is_empty()).map_or(0, |last| last + 1);
    names[..end].to_vec()
}

/// Whether a line has words, and neither numbers nor times.
pub(super) fn is_header<'a>(line: &'a str, separator: Separator, fields: &mut Vec<&'a str>) -> bool {
    separator.split(line, fields);
    let is_word = |field: &str| !is_missing(field) && !is_value(field, separator != Separator::Comma);
    fields.iter().any(|field| is_word(field))
        && fields.iter().all(|field| is_word(field) || is_missing(field))
}

/// Whether a field is a number or a time, and not missing.
pub(super) fn is_value(field: &str, may_have_decimal_comma: bool) -> bool {
    !is_missing(field)
        && (number(field, false).is_some()
            || (may_have_decimal_comma && number(field, true).is_some())
            || time_fields::is_time(field))
}

/// Whether a field holds one of the marks that loggers write for a missing value.
pub(super) fn is_missing(field: &str) -> bool {
    const WORDS: [&str; 8] = ["na", "n/a", "#n/a", "nan", "null", "none", "nil", "-nan"];
    field.is_empty()
        || field.bytes().all(|byte| byte == b'-')
        || WORDS.iter().any(|word| field.eq_ignore_ascii_case(word))
}

/// Parses a number: `None` if the field is no number, NaN if it is missing.
pub(super) fn number(field: &str, has_decimal_comma: bool) -> Option<f64> {
    // Rust also parses words as `nan` and `infinity`; the first character limits that to `inf` and its like.
    let may_be_number =
        field.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '+' | '.' | 'i' | 'I'));
    if may_be_number
        && !has_decimal_comma
        && let Ok(value) = field.parse()
    {
        return Some(value);
    }
    if is_missing(field) {
        return Some(f64::NAN);
    }
    if !has_decimal_comma || field.contains('.') || field.matches(',').count() > 1 {
        return None;
    }
    field.replace(',', ".").parse().ok().filter(|_| field.bytes().any(|byte| byte.is_ascii_digit()))
}
