//! Lines, separators and numbers of a text table.

/// How fields are separated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Separator {
    Comma,
    Semicolon,
    Space,
}

impl Separator {
    fn of(line: &str) -> Self {
        if line.contains(';') {
            Self::Semicolon
        } else if line.contains(',') {
            Self::Comma
        } else {
            Self::Space
        }
    }

    /// Fields of a line, trimmed. A separator at the end of the line opens no further field.
    pub(super) fn split(self, line: &str) -> Vec<&str> {
        let by = |separator: char| {
            let line = line.trim_end();
            line.strip_suffix(separator).unwrap_or(line).split(separator).map(str::trim).collect()
        };
        match self {
            Self::Comma => by(','),
            Self::Semicolon => by(';'),
            Self::Space => line.split_whitespace().collect(),
        }
    }
}

/// One line of data.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line<'a> {
    pub(super) number: usize,
    pub(super) text: &'a str,
}

/// A line that may name columns.
#[derive(Clone, Debug)]
pub(super) struct HeaderLine<'a> {
    pub(super) number: usize,
    pub(super) names: Vec<&'a str>,
    /// A comment may be prose; a line that is none has to be a header.
    pub(super) is_comment: bool,
}

/// The lines of a file, sorted into data and possible headers.
#[derive(Clone, Debug)]
pub(super) struct Table<'a> {
    /// Lines before the data that may name columns, in the file's order.
    pub(super) headers: Vec<HeaderLine<'a>>,
    pub(super) rows: Vec<Line<'a>>,
    pub(super) separator: Separator,
}

impl<'a> Table<'a> {
    pub(super) fn new(content: &'a str) -> Self {
        let content = content.strip_prefix('\u{feff}').unwrap_or(content);
        let mut headers = Vec::new();
        let mut rows = Vec::new();
        for (index, line) in content.lines().enumerate() {
            let (number, text) = (index + 1, line.trim());
            if text.is_empty() {
                continue;
            }
            let comment = text.strip_prefix(['#', '%']);
            let is_header = rows.is_empty() && (comment.is_some() || !starts_with_number(text));
            if is_header {
                let names = comment.unwrap_or(text).trim_start_matches(['#', '%']).trim();
                headers.push(HeaderLine { number, names: Separator::of(names).split(names), is_comment: comment.is_some() });
            } else if comment.is_none() {
                rows.push(Line { number, text });
            }
        }
        let separator = rows.first().map_or(Separator::Comma, |row: &Line<'_>| Separator::of(row.text));
        Self { headers, rows, separator }
    }

    pub(super) fn fields(&self, row: &Line<'a>) -> Vec<&'a str> {
        self.separator.split(row.text)
    }

    /// Up to `count` rows, evenly over the file.
    pub(super) fn sample(&self, count: usize) -> impl Iterator<Item = &Line<'a>> {
        self.rows.iter().step_by(self.rows.len().div_ceil(count).max(1))
    }
}

/// Whether the first field is a number or missing: then the line is data.
fn starts_with_number(line: &str) -> bool {
    Separator::of(line).split(line).first().is_some_and(|field| number(field).is_some())
}

/// A field's value: `None` if it is no number, NaN if it is empty.
pub(super) fn number(field: &str) -> Option<f64> {
    if field.is_empty() { Some(f64::NAN) } else { field.parse().ok() }
}

/// Unit of a time column, as the number of decimal places of a nanosecond in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TimeUnit {
    Seconds = 9,
    Milliseconds = 6,
    Microseconds = 3,
    Nanoseconds = 0,
}

/// Nanoseconds of a time field: exact for decimals, because seconds since 1970 in f64 are only good to 0.2 us.
/// `None` if it is no number, `Some(None)` if it is not finite or beyond i64 (292 years).
pub(super) fn time_ns(field: &str, unit: TimeUnit) -> Option<Option<i64>> {
    let value = number(field)?;
    if !value.is_finite() {
        return Some(None);
    }
    Some(decimal_ns(field, unit as u32).or_else(|| {
        let ns = value * 10_f64.powi(unit as i32);
        // 2^63 is exact in f64.
        (ns.abs() < 9_223_372_036_854_775_808.0).then_some(ns.round() as i64)
    }))
}

/// Decimals without exponent, rounded to the nanosecond; `None` for anything else and on overflow.
fn decimal_ns(field: &str, places: u32) -> Option<i64> {
    let (negative, digits) = match field.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, field.strip_prefix('+').unwrap_or(field)),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let mut ns: i64 = 0;
    for digit in whole.bytes() {
        ns = ns.checked_mul(10)?.checked_add(value_of(digit)?)?;
    }
    let mut fraction = fraction.bytes();
    for _ in 0..places {
        let digit = fraction.next().map_or(Some(0), value_of)?;
        ns = ns.checked_mul(10)?.checked_add(digit)?;
    }
    if let Some(next) = fraction.next() {
        ns = ns.checked_add(i64::from(value_of(next)? >= 5))?;
    }
    fraction.all(|digit| digit.is_ascii_digit()).then_some(if negative { -ns } else { ns })
}

fn value_of(digit: u8) -> Option<i64> {
    digit.is_ascii_digit().then(|| i64::from(digit - b'0'))
}
