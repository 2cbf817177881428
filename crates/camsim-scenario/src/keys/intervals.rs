//! Legal intervals of numbers.

use std::fmt;

use super::{Field, Leaf, Table, join};

/// A number as messages have it: `4e12` rather than all its digits.
struct Short(f64);

impl fmt::Display for Short {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.0.abs() >= 1e6 { write!(f, "{:e}", self.0) } else { write!(f, "{}", self.0) }
    }
}

/// An end of a legal interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum End {
    /// Any finite number.
    None,
    /// This number is legal.
    Closed(f64),
    /// This number is not legal.
    Open(f64),
}

impl End {
    /// The end as a whole number.
    pub(super) const fn whole(self, otherwise: u32) -> u32 {
        match self {
            Self::Closed(value) | Self::Open(value) => value as u32,
            Self::None => otherwise,
        }
    }

    /// The number at the end.
    #[must_use]
    pub const fn value(self) -> Option<f64> {
        match self {
            Self::Closed(value) | Self::Open(value) => Some(value),
            Self::None => None,
        }
    }

    /// Whether a number is inside, given how far.
    fn admits(self, inside: impl Fn(f64) -> f64) -> bool {
        match self {
            Self::None => true,
            Self::Closed(end) => inside(end) >= 0.0,
            Self::Open(end) => inside(end) > 0.0,
        }
    }
}

impl Field {
    fn admits(&self, number: f64) -> bool {
        number.is_finite()
            && self.low.admits(|low| number - low)
            && self.high.admits(|high| high - number)
            && (self.only.is_empty() || self.only.iter().any(|&legal| f64::from(legal) == number))
    }

    /// The key with what is wrong with its value.
    fn violation(&self, key: String, leaf: &Leaf<'_>) -> Option<(String, String)> {
        if leaf.numbers().into_iter().all(|number| self.admits(number)) {
            return None;
        }
        let advice = if self.hint.is_empty() { String::new() } else { format!("; {}", self.hint) };
        let value = if let Leaf::Number(value) = leaf { value.to_string() } else { leaf.to_string() };
        Some((key, format!("must be {}, not {value}{advice}", self.interval())))
    }

    /// What each number must be: `a finite number above 0`.
    #[must_use]
    pub fn interval(&self) -> String {
        if let [others @ .., last] = self.only {
            let others: Vec<String> = others.iter().map(u32::to_string).collect();
            return format!("{} or {last}", others.join(", "));
        }
        let short = |end: End| end.value().map_or(Short(0.0), Short);
        let (low, high) = (short(self.low), short(self.high));
        match (self.low, self.high) {
            (End::None, End::None) => "finite".to_owned(),
            (End::Open(_), End::None) => format!("a finite number above {low}"),
            (End::Closed(_), End::None) => format!("a finite number, {low} or more"),
            (End::None, End::Open(_)) => format!("a finite number below {high}"),
            (End::None, End::Closed(_)) => format!("a finite number, {high} or less"),
            (End::Closed(_), End::Closed(_)) => format!("{low} to {high}"),
            (End::Open(_), End::Closed(_)) => format!("above {low} and at most {high}"),
            (End::Closed(_), End::Open(_)) => format!("{low} or more and below {high}"),
            (End::Open(_), End::Open(_)) => format!("above {low} and below {high}"),
        }
    }
}

/// Numbers outside of their legal intervals: the key, with indices of lists of tables, and what is wrong.
#[must_use]
pub fn violations(table: &dyn Table) -> Vec<(String, String)> {
    let mut found = Vec::new();
    check(table, "", &mut found);
    found
}

fn check(table: &dyn Table, prefix: &str, found: &mut Vec<(String, String)>) {
    for (field, leaf) in table.values() {
        let key = join(prefix, field.name);
        match leaf {
            Leaf::Table(table) => check(table, &key, found),
            Leaf::Tables(tables) => {
                for (index, table) in tables.into_iter().enumerate() {
                    check(table, &join(&key, &index.to_string()), found);
                }
            }
            Leaf::Named(values) => {
                let each = values.into_iter();
                found.extend(each.filter_map(|(name, leaf)| field.violation(join(&key, name), &leaf)));
            }
            leaf => found.extend(field.violation(key, &leaf)),
        }
    }
}
