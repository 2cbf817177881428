//! Parsing of times: numbers, clock times, and dates with times.

use super::text_table;

/// Decimal places that are kept of a number in a time column, whatever its unit.
const DECIMAL_PLACES: u32 = 12;
/// Fixed-point steps per unit: 10 to the power of [`DECIMAL_PLACES`].
const PER_UNIT: i128 = 1_000_000_000_000;
const DAY_NS: i128 = 86_400_000_000_000;

/// Format of the fields of a time column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TimeFormat {
    /// Numbers in some unit.
    Number,
    /// Clock times of a day, as `10:00:59.5`.
    Clock,
    /// Dates with times, as `2023-05-01T10:00:59.5Z`.
    DateTime,
}

/// What the times of a table are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Clock {
    pub(super) format: TimeFormat,
    /// Whether dates have been added to clock times.
    pub(super) has_dates: bool,
}

impl TimeFormat {
    /// The format of a field; `None` if the field is empty.
    pub(super) fn detect(field: &str) -> Option<Self> {
        if text_table::is_missing(field) {
            None
        } else if date_time_ns(field).is_some() {
            Some(Self::DateTime)
        } else if clock_ns(field).is_some() {
            Some(Self::Clock)
        } else {
            Some(Self::Number)
        }
    }
}

/// Whether a field is a clock time, a date, or both.
pub(super) fn is_time(field: &str) -> bool {
    clock_ns(field).is_some() || date_time_ns(field).is_some() || date_ns(field).is_some()
}

/// Parses a number of a time column, as a multiple of 1e-12 of its unit. Decimals are exact: an f64 resolves
/// seconds since 1970 to 0.2 us only. `None` if it is no number, `Some(None)` if it is not finite or 1e25 and
/// more.
pub(super) fn fixed_point(field: &str, has_decimal_comma: bool) -> Option<Option<i128>> {
    let value = text_table::number(field, has_decimal_comma)?;
    if !value.is_finite() {
        return Some(None);
    }
    let exact = if has_decimal_comma { decimal(&field.replace(',', ".")) } else { decimal(field) };
    Some(exact.or_else(|| (value.abs() < 1e25).then(|| (value * PER_UNIT as f64).round() as i128)))
}

/// Nanoseconds of a number from [`fixed_point`]; `None` beyond the range of i64 (292 years).
pub(super) fn to_ns(value: i128, unit_ns: f64) -> Option<i64> {
    let product = value.checked_mul(unit_ns as i128)?;
    let half = if product < 0 { -PER_UNIT / 2 } else { PER_UNIT / 2 };
    i64::try_from((product.checked_add(half)?) / PER_UNIT).ok()
}

/// A number from [`fixed_point`], in its unit.
pub(super) fn to_units(value: i128) -> f64 {
    value as f64 / PER_UNIT as f64
}

/// Whether a number from [`fixed_point`] is an integer.
pub(super) fn is_integer(value: i128) -> bool {
    value % PER_UNIT == 0
}

/// Parses a decimal without exponent as fixed point, rounded; `None` for anything else.
fn decimal(field: &str) -> Option<i128> {
    let (negative, digits) = match field.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, field.strip_prefix('+').unwrap_or(field)),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let mut value: i128 = 0;
    for digit in whole.bytes() {
        value = value.checked_mul(10)?.checked_add(digit_value(digit)?)?;
    }
    let mut fraction = fraction.bytes();
    for _ in 0..DECIMAL_PLACES {
        let digit = fraction.next().map_or(Some(0), digit_value)?;
        value = value.checked_mul(10)?.checked_add(digit)?;
    }
    if let Some(next) = fraction.next() {
        value = value.checked_add(i128::from(digit_value(next)? >= 5))?;
    }
    fraction.all(|digit| digit.is_ascii_digit()).then_some(if negative { -value } else { value })
}

fn digit_value(digit: u8) -> Option<i128> {
    digit.is_ascii_digit().then(|| i128::from(digit - b'0'))
}

/// Parses `h:m:s` or `h:m:s.f`, also with AM or PM, as nanoseconds since midnight.
pub(super) fn clock_ns(field: &str) -> Option<i128> {
    let field = field.trim();
    // ISO 8601 also allows a decimal comma: `10:00:59,5`.
    let lower = field.to_ascii_lowercase().replace(',', ".");
    let (digits, half) = match (lower.strip_suffix("am"), lower.strip_suffix("pm")) {
        (Some(rest), _) => (rest.trim_end(), Some(0)),
        (_, Some(rest)) => (rest.trim_end(), Some(12)),
        _ => (lower.trim_end_matches('z'), None),
    };
    let mut parts = digits.split(':');
    let hours = unsigned(parts.next()?, 2)?;
    let minutes = unsigned(parts.next()?, 2)?;
    // Seconds are required: `12:34` may be hours and minutes, or minutes and seconds.
    let seconds = seconds(parts.next()?)?;
    if parts.next().is_some() || minutes > 59 || seconds >= 61 * PER_UNIT {
        return None;
    }
    let hours = match half {
        Some(offset) if (1..=12).contains(&hours) => hours % 12 + offset,
        None if hours < 24 => hours,
        _ => return None,
    };
    Some((hours * 3600 + minutes * 60) * 1_000_000_000 + seconds / 1000)
}

/// Parses `2023-05-01T10:00:59.5Z` as nanoseconds since 1970. A blank for the T, an offset for the Z, and `/`
/// for `-` are allowed. Without an offset UTC is assumed, as only differences matter.
pub(super) fn date_time_ns(field: &str) -> Option<i128> {
    let field = field.trim();
    let (date, rest) = field.split_once(['T', 't', ' ', '_'])?;
    let day = date_ns(date)?;
    let rest = rest.trim();
    let (clock, offset) = match rest.rfind(['+', '-']) {
        Some(sign) => (&rest[..sign], offset_ns(&rest[sign..])?),
        None => (rest.trim_end_matches(" UTC").trim_end_matches(" GMT"), 0),
    };
    Some(day + clock_ns(clock)? - offset)
}

/// Parses an offset from UTC (`+01:30`, `-0500`, `+02`) as nanoseconds.
fn offset_ns(text: &str) -> Option<i128> {
    let (sign, digits) =
        if let Some(rest) = text.strip_prefix('-') { (-1, rest) } else { (1, text.strip_prefix('+')?) };
    let (hours, minutes) = match digits.split_once(':') {
        Some((hours, minutes)) => (unsigned(hours, 2)?, unsigned(minutes, 2)?),
        None if digits.len() == 4 => (unsigned(digits.get(..2)?, 2)?, unsigned(digits.get(2..)?, 2)?),
        None => (unsigned(digits, 2)?, 0),
    };
    (hours <= 14 && minutes <= 59).then_some(sign * (hours * 60 + minutes) * 60_000_000_000)
}

/// Parses `2023-05-01`, also with slashes, dots or colons (photos), `20230501`, `01.05.2023` and, where a number
/// above 12 says which one is the day, `5/13/2023`; as nanoseconds from 1970 to the start of that day. Other
/// dates that begin with day or month are ambiguous, and `None`.
pub(super) fn date_ns(field: &str) -> Option<i128> {
    let (year, month, day) = if field.len() == 8 && !field.contains(['-', '/', '.', ':']) {
        (field.get(..4)?, field.get(4..6)?, field.get(6..)?)
    } else {
        let separator = ['-', '/', '.', ':'].into_iter().find(|&c| field.matches(c).count() == 2)?;
        let mut parts = field.split(separator);
        let parts = (parts.next()?, parts.next()?, parts.next()?);
        if parts.0.len() == 4 { parts } else { year_last(parts, separator)? }
    };
    let (month, day) = (unsigned(month, 2)?, unsigned(day, 2)?);
    if year.len() != 4 || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    Some(days_from_1970(unsigned(year, 4)?, month, day) * DAY_NS)
}

/// Year, month and day of a date that ends with the year; `None` where day and month are ambiguous.
fn year_last<'a>(
    (first, second, year): (&'a str, &'a str, &'a str),
    separator: char,
) -> Option<(&'a str, &'a str, &'a str)> {
    let (a, b) = (unsigned(first, 2)?, unsigned(second, 2)?);
    match separator {
        '.' => Some((year, second, first)),
        '-' | '/' if a > 12 || a == b => Some((year, second, first)),
        '-' | '/' if b > 12 => Some((year, first, second)),
        _ => None,
    }
}

/// Days from 1970-01-01 in the Gregorian calendar. Years begin in March here, so that a leap day is the last
/// day of its year.
fn days_from_1970(year: i128, month: i128, day: i128) -> i128 {
    let year = if month <= 2 { year - 1 } else { year };
    let month = (month + 9) % 12;
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    365 * year + leap_days + (153 * month + 2) / 5 + day - 1 - 719_468
}

/// Parses an unsigned integer of at most `max_digits` digits.
fn unsigned(text: &str, max_digits: usize) -> Option<i128> {
    ((1..=max_digits).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit()))
        .then(|| text.parse().ok())?
}

/// Parses seconds with decimals, as a multiple of 1e-12 s.
fn seconds(text: &str) -> Option<i128> {
    let digits = text.split('.').next()?;
    ((1..=2).contains(&digits.len()) && text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.'))
        .then(|| decimal(text))?
}
