//! Lines, separators, quotes and numbers of a text table.

use std::collections::BTreeMap;

use super::time;

/// Lines looked at to tell the separator and the number of columns.
const SAMPLE_LINES: usize = 32;

/// How fields are separated.
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

    /// The one by which most fields of these lines are numbers or times.
    fn of(lines: &[&str]) -> Self {
        let mut fields = Vec::new();
        let mut best = (0, Self::Space);
        // Of equal ones the first stands, which is the one that people don't use within numbers.
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

    /// Fields of a line, trimmed and without their quotes.
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

    fn split_quoted<'a>(self, line: &'a str, fields: &mut Vec<&'a str>) {
        let is_end = |c: char| if self == Self::Space { c.is_whitespace() } else { c == self.character() };
        let mut rest = line;
        loop {
            let blank = |c: char| c.is_whitespace() && c != self.character();
            rest = if self == Self::Space { rest.trim_start() } else { rest.trim_start_matches(blank) };
            if self == Self::Space && rest.is_empty() {
                return;
            }
            // A quote that nothing closes is a character like others.
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
                Some(at) => rest = &after[at + after[at..].chars().next().map_or(1, char::len_utf8)..],
                None => return,
            }
        }
    }
}

/// Where the text before a closing quote ends; two quotes are one that belongs to the text.
fn closing_quote(text: &str) -> Option<usize> {
    let mut from = 0;
    loop {
        let at = from + text[from..].find('"')?;
        if !text[at + 1..].starts_with('"') {
            return Some(at);
        }
        from = at + 2;
    }
}

/// One line of data.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    pub(super) number: usize,
    pub(super) text: &'a str,
}

/// A line that may name columns.
#[derive(Clone, Copy, Debug)]
pub(super) struct HeaderLine<'a> {
    pub(super) number: usize,
    pub(super) text: &'a str,
    /// A comment may be prose; a line that is none has to be a header, or units below one.
    pub(super) is_comment: bool,
}

/// The lines of a file, sorted into data and possible headers.
#[derive(Clone, Debug)]
pub(super) struct Table<'a> {
    /// Lines before the data that may name columns, in the file's order.
    pub(super) headers: Vec<HeaderLine<'a>>,
    pub(super) rows: Vec<Line<'a>>,
    pub(super) separator: Separator,
    /// Commas, not points, begin the decimals.
    pub(super) has_decimal_commas: bool,
    /// Columns that are not empty throughout, by a sample of the rows of the usual number of fields.
    pub(super) columns: usize,
    /// Fields of these rows, empty ones too.
    pub(super) width: usize,
}

impl<'a> Table<'a> {
    pub(super) fn new(content: &'a str) -> Self {
        // Lines of old end in a carriage return alone.
        let is_old = !content.contains('\n');
        let texts: Box<dyn Iterator<Item = &'a str>> =
            if is_old { Box::new(content.split('\r')) } else { Box::new(content.lines()) };
        // Not tabs: one at the beginning of a line is an empty field.
        let lines: Vec<Line<'a>> = texts
            .enumerate()
            .map(|(index, text)| Line { number: index + 1, text: text.trim_matches([' ', '\r']) })
            .filter(|line| !line.text.trim().is_empty())
            .collect();
        let is_comment = |line: &Line<'_>| line.text.starts_with(['#', '%']);
        let body: Vec<&str> = lines.iter().filter(|line| !is_comment(line)).map(|line| line.text).collect();
        let sample: Vec<&str> =
            body.iter().copied().step_by(body.len().div_ceil(SAMPLE_LINES).max(1)).collect();
        // Where a header is half of the sample, it shall not decide.
        let last = body.last().into_iter().copied();
        let separator = Separator::of(&sample.into_iter().chain(last).collect::<Vec<_>>());

        let mut headers = Vec::new();
        let mut rows = Vec::new();
        let mut fields = Vec::new();
        for line in lines {
            let comment = is_comment(&line);
            if rows.is_empty() && (comment || is_header(line.text, separator, &mut fields)) {
                let text = if comment { line.text.trim_start_matches(['#', '%']).trim() } else { line.text };
                headers.push(HeaderLine { number: line.number, text, is_comment: comment });
            } else if !comment {
                rows.push(line);
            }
        }
        let mut table = Self { headers, rows, separator, has_decimal_commas: false, columns: 0, width: 0 };
        let (mut commas, mut points) = (0, 0);
        // Rows of each number of fields, and how many of them are not empty throughout.
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
        // Most rows are right; a field too many in some of them is found when they are read.
        if let Some((&width, &(_, columns))) = widths.iter().max_by_key(|(_, (rows, _))| *rows) {
            (table.columns, table.width) = (columns, width);
        }
        table.has_decimal_commas = separator != Separator::Comma && commas > 0 && points == 0;
        table
    }

    pub(super) fn fields(&self, row: &Line<'a>) -> Vec<&'a str> {
        let mut fields = Vec::new();
        self.separator.split(row.text, &mut fields);
        fields
    }

    /// Names of a header line, as many as the rows have columns if any way of splitting gives that.
    pub(super) fn names(&self, text: &'a str) -> Vec<&'a str> {
        let mut names = Vec::new();
        let mut split = |separator: Separator| {
            separator.split(text, &mut names);
            if separator == Separator::Space {
                with_brackets(&names, text)
            } else {
                without_last_blank(&names)
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

    /// Whether so many names can be those of the columns.
    pub(super) fn fits(&self, names: usize) -> bool {
        (self.columns..=self.width).contains(&names)
    }

    pub(super) fn number(&self, field: &str) -> Option<f64> {
        number(field, self.has_decimal_commas)
    }

    /// Up to `count` rows, evenly over the file.
    pub(super) fn sample(&self, count: usize) -> impl Iterator<Item = &Line<'a>> {
        self.rows.iter().step_by(self.rows.len().div_ceil(count).max(1))
    }
}

/// `time [s]` is one name where blanks separate.
fn with_brackets<'a>(names: &[&'a str], text: &'a str) -> Vec<&'a str> {
    let mut joined: Vec<&'a str> = Vec::with_capacity(names.len());
    for name in names {
        match joined.last_mut() {
            Some(last) if name.starts_with(['[', '(']) => {
                // Both are parts of `text`.
                let from = last.as_ptr() as usize - text.as_ptr() as usize;
                let to = name.as_ptr() as usize - text.as_ptr() as usize + name.len();
                *last = &text[from..to];
            }
            _ => joined.push(name),
        }
    }
    joined
}

fn without_last_blank<'a>(names: &[&'a str]) -> Vec<&'a str> {
    let end = names.iter().rposition(|name| !name.is_empty()).map_or(0, |last| last + 1);
    names[..end].to_vec()
}

/// Whether a line has words and no values.
fn is_header<'a>(line: &'a str, separator: Separator, fields: &mut Vec<&'a str>) -> bool {
    separator.split(line, fields);
    let is_word = |field: &str| !is_missing(field) && !is_value(field, separator != Separator::Comma);
    fields.iter().any(|field| is_word(field))
        && fields.iter().all(|field| is_word(field) || is_missing(field))
}

/// A number or a time that is there.
fn is_value(field: &str, may_have_decimal_comma: bool) -> bool {
    !is_missing(field)
        && (number(field, false).is_some()
            || (may_have_decimal_comma && number(field, true).is_some())
            || time::is_time(field))
}

/// What loggers write where they have no value.
pub(super) fn is_missing(field: &str) -> bool {
    const WORDS: [&str; 8] = ["na", "n/a", "#n/a", "nan", "null", "none", "nil", "-nan"];
    field.is_empty()
        || field.bytes().all(|byte| byte == b'-')
        || WORDS.iter().any(|word| field.eq_ignore_ascii_case(word))
}

/// A field's value: `None` if it is no number, NaN if it is missing.
pub(super) fn number(field: &str, has_decimal_comma: bool) -> Option<f64> {
    // Rust also reads `infinity`; a column of that name is none of numbers.
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
