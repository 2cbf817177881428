//! Fields that hold times.

use super::text;

/// Decimal places that a number of a time column keeps, whatever its unit.
const PLACES: u32 = 12;
const PER_UNIT: i128 = 1_000_000_000_000;
const DAY_NS: i128 = 86_400_000_000_000;

/// What the fields of a time column look like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Numbers in some unit.
    Number,
    /// `10:00:59.5`: the time of a day.
    Clock,
    /// `2023-05-01T10:00:59.5Z`.
    DateTime,
}

impl Kind {
    pub(super) fn of(field: &str) -> Option<Self> {
        if text::is_missing(field) {
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

pub(super) fn is_time(field: &str) -> bool {
    clock_ns(field).is_some() || date_time_ns(field).is_some() || date_ns(field).is_some()
}

/// A number of a time column, in 1e-12 of its unit: exact for decimals, because seconds since 1970 in f64 are
/// only good to 0.2 us. `None` if it is no number, `Some(None)` if it is not finite or beyond all use.
pub(super) fn number(field: &str, has_decimal_comma: bool) -> Option<Option<i128>> {
    let value = text::number(field, has_decimal_comma)?;
    if !value.is_finite() {
        return Some(None);
    }
    let exact = if has_decimal_comma { decimal(&field.replace(',', ".")) } else { decimal(field) };
    Some(exact.or_else(|| (value.abs() < 1e25).then(|| (value * PER_UNIT as f64).round() as i128)))
}

/// Nanoseconds of such a number; `None` beyond i64 (292 years).
pub(super) fn to_ns(value: i128, unit_ns: f64) -> Option<i64> {
    let product = value.checked_mul(unit_ns as i128)?;
    let half = if product < 0 { -PER_UNIT / 2 } else { PER_UNIT / 2 };
    i64::try_from((product.checked_add(half)?) / PER_UNIT).ok()
}

/// As a number of units.
pub(super) fn to_units(value: i128) -> f64 {
    value as f64 / PER_UNIT as f64
}

pub(super) fn is_whole(value: i128) -> bool {
    value % PER_UNIT == 0
}

/// Decimals without exponent, rounded; `None` for anything else.
fn decimal(field: &str) -> Option<i128> {
    let (negative, digits) = match field.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, field.strip_prefix('+').unwrap_or(field)),
    };
    let (whole, fraction) = digits.split_once('.').unwrap_or((digits, ""));
    let mut value: i128 = 0;
    for digit in whole.bytes() {
        value = value.checked_mul(10)?.checked_add(value_of(digit)?)?;
    }
    let mut fraction = fraction.bytes();
    for _ in 0..PLACES {
        let digit = fraction.next().map_or(Some(0), value_of)?;
        value = value.checked_mul(10)?.checked_add(digit)?;
    }
    if let Some(next) = fraction.next() {
        value = value.checked_add(i128::from(value_of(next)? >= 5))?;
    }
    fraction.all(|digit| digit.is_ascii_digit()).then_some(if negative { -value } else { value })
}

fn value_of(digit: u8) -> Option<i128> {
    digit.is_ascii_digit().then(|| i128::from(digit - b'0'))
}

/// Nanoseconds of the day of `h:m:s` or `h:m:s.f`, also with AM or PM.
pub(super) fn clock_ns(field: &str) -> Option<i128> {
    let field = field.trim();
    // ISO 8601 also has `10:00:59,5`.
    let lower = field.to_ascii_lowercase().replace(',', ".");
    let (digits, half) = match (lower.strip_suffix("am"), lower.strip_suffix("pm")) {
        (Some(rest), _) => (rest.trim_end(), Some(0)),
        (_, Some(rest)) => (rest.trim_end(), Some(12)),
        _ => (lower.trim_end_matches('z'), None),
    };
    let mut parts = digits.split(':');
    let hours = whole(parts.next()?, 2)?;
    let minutes = whole(parts.next()?, 2)?;
    // `12:34` may be hours and minutes, or minutes and seconds.
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

/// Nanoseconds since 1970 of `2023-05-01T10:00:59.5Z`; a blank for the T, an offset for the Z, `/` for `-`
/// are right too. Without an offset it is taken as UTC: only differences count.
pub(super) fn date_time_ns(field: &str) -> Option<i128> {
    let field = field.trim();
    let (date, rest) = field.split_once(['T', 't', ' ', '_'])?;
    let day = date_ns(date)?;
    let rest = rest.trim();
    let (clock, offset) = match rest.rfind(['+', '-']) {
        Some(at) => (&rest[..at], offset_ns(&rest[at..])?),
        None => (rest.trim_end_matches(" UTC").trim_end_matches(" GMT"), 0),
    };
    Some(day + clock_ns(clock)? - offset)
}

fn offset_ns(text: &str) -> Option<i128> {
    let (sign, digits) =
        if let Some(rest) = text.strip_prefix('-') { (-1, rest) } else { (1, text.strip_prefix('+')?) };
    let (hours, minutes) = match digits.split_once(':') {
        Some((hours, minutes)) => (whole(hours, 2)?, whole(minutes, 2)?),
        None if digits.len() == 4 => (whole(digits.get(..2)?, 2)?, whole(digits.get(2..)?, 2)?),
        None => (whole(digits, 2)?, 0),
    };
    (hours <= 14 && minutes <= 59).then_some(sign * (hours * 60 + minutes) * 60_000_000_000)
}

/// Nanoseconds since 1970 at the beginning of `2023-05-01`, also with slashes or dots. Day and month first
/// are not guessed.
pub(super) fn date_ns(field: &str) -> Option<i128> {
    let separator = ['-', '/', '.'].into_iter().find(|&c| field.matches(c).count() == 2)?;
    let mut parts = field.split(separator);
    let (year, month, day) = (parts.next()?, whole(parts.next()?, 2)?, whole(parts.next()?, 2)?);
    if year.len() != 4 || !(1..=12).contains(&month) || !(1..=31).contains(&day) {
        return None;
    }
    Some(days_from_1970(whole(year, 4)?, month, day) * DAY_NS)
}

/// Days of the Gregorian calendar: years begin in March here, so that the leap day is their last.
fn days_from_1970(year: i128, month: i128, day: i128) -> i128 {
    let year = if month <= 2 { year - 1 } else { year };
    let month = (month + 9) % 12;
    let leap_days = year.div_euclid(4) - year.div_euclid(100) + year.div_euclid(400);
    365 * year + leap_days + (153 * month + 2) / 5 + day - 1 - 719_468
}

fn whole(text: &str, most_digits: usize) -> Option<i128> {
    ((1..=most_digits).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_digit()))
        .then(|| text.parse().ok())?
}

/// Seconds with decimals, in 1e-12 s.
fn seconds(text: &str) -> Option<i128> {
    let digits = text.split('.').next()?;
    ((1..=2).contains(&digits.len()) && text.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.'))
        .then(|| decimal(text))?
}
