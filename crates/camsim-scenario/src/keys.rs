//! The facts of each key, from the field that holds it.
//!
//! ```
//! use camsim_scenario::keys::{Table, Value, ValueKind, keys_of, violations};
//!
//! /// A tripod.
//! #[derive(Table)]
//! struct Tripod {
//!     /// Height of its head.
//!     #[key(default = 1.5, unit = "m", above = 0.0, hint = "most have 1.5")]
//!     height_m: f64,
//! }
//!
//! let keys = keys_of::<Tripod>();
//! assert_eq!((keys[0].name.as_str(), keys[0].field.kind), ("height_m", ValueKind::Number));
//! let wrong = violations(&Tripod { height_m: 0.0 });
//! assert_eq!(wrong[0].1, "must be a finite number above 0, not 0; most have 1.5");
//! assert!(violations(&Tripod::default()).is_empty());
//! ```

use std::borrow::Cow;

pub use camsim_scenario_derive::{Table, Words};

mod intervals;
mod values;

pub use intervals::{End, violations};
pub use values::{Leaf, Table, Value};

/// Facts of a key.
#[derive(Clone, Copy, Debug)]
pub struct Field {
    /// Name within its table.
    pub name: &'static str,
    /// Description: its first sentence is a noun phrase.
    pub about: &'static str,
    /// The values that it takes.
    pub kind: ValueKind,
    /// Keys of a table, or of each table of a list.
    pub fields: &'static [Field],
    /// Descriptions of the words that it takes.
    pub words: &'static [Word],
    /// Whether it may be absent, which then means something else than any value.
    pub is_optional: bool,
    /// Whether its table needs it.
    pub is_required: bool,
    /// The default as TOML; empty where the key is absent by default.
    pub default: fn() -> String,
    /// Unit; `U` stands for that of the table that it is in.
    pub unit: &'static str,
    /// Change per point of drag in a number field.
    pub step: f64,
    /// Lower end of the legal interval of each number.
    pub low: End,
    /// Upper end of the legal interval of each number.
    pub high: End,
    /// The legal numbers within, in ascending order; empty where all are.
    pub only: &'static [u32],
    /// Advice where a number is outside.
    pub hint: &'static str,
    /// A value as TOML, where the key is absent by default.
    pub example: &'static str,
    /// Names of the elements of a list of fixed length.
    pub names: &'static [&'static str],
}

impl Field {
    /// The unit, within a table of a unit.
    #[must_use]
    pub fn unit_in(&self, table_unit: &str) -> Cow<'static, str> {
        match self.unit.strip_prefix('U') {
            Some(rest) => format!("{table_unit}{rest}").into(),
            None => self.unit.into(),
        }
    }

    /// The first sentence of the description.
    #[must_use]
    pub fn summary(&self) -> &'static str {
        self.about.split_inclusive(". ").next().unwrap_or_default().trim_end()
    }
}

/// A word that a key takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Word {
    /// As it is written.
    pub name: &'static str,
    /// Description.
    pub about: &'static str,
}

/// A key with its full name.
#[derive(Clone, Debug)]
pub struct Key {
    /// Dotted, without indices of lists.
    pub name: String,
    /// Its facts.
    pub field: &'static Field,
    /// Its unit.
    pub unit: Cow<'static, str>,
}

/// All keys of a table, in the order of its fields, those of tables below it behind their own. A table within the
/// table is no key, a list of tables is one.
#[must_use]
pub fn keys_of<T: Value>() -> Vec<Key> {
    let mut keys = Vec::new();
    add_keys(T::FIELDS, "", "", &mut keys);
    keys
}

fn add_keys(fields: &'static [Field], prefix: &str, table_unit: &str, keys: &mut Vec<Key>) {
    for field in fields {
        let name = join(prefix, field.name);
        if field.kind != ValueKind::Table {
            keys.push(Key { name: name.clone(), field, unit: field.unit_in(table_unit) });
        }
        add_keys(field.fields, &name, field.unit, keys);
    }
}

/// A dotted key; the parent is empty at the root.
#[must_use]
pub fn join(parent: &str, name: &str) -> String {
    if parent.is_empty() { name.to_owned() } else { format!("{parent}.{name}") }
}

/// The values that a key takes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ValueKind {
    /// A number.
    Number,
    /// A number, or one of these words.
    NumberOr(&'static [&'static str]),
    /// A whole number from 0, beyond 32 bits too.
    Whole,
    /// A whole number from the first to the last.
    Within(u32, u32),
    /// A whole number of at most 32 bits, or one of these words. The number here is the largest useful value,
    /// for the message; ranges are checked later.
    CountOr(u32, &'static [&'static str]),
    /// A list of this many numbers.
    Numbers(usize),
    /// `true` or `false`.
    Flag,
    /// A list of this many numbers, or this word.
    NumbersOr(usize, &'static str),
    /// A list of this many whole numbers of at most 32 bits. The second number is the largest useful value,
    /// for the message; ranges are checked later.
    Counts(usize, u32),
    /// A number, or a list of this many numbers.
    NumberOrNumbers(usize),
    /// A number, or a list of any number of numbers.
    NumberOrList,
    /// A list of any number of numbers.
    NumberList,
    /// A list of any number of whole numbers from 0.
    WholeList,
    /// A list of any number of lists of this many numbers.
    Points(usize),
    /// A path, resolved against the folder of the file that names it.
    Path,
    /// A path, or a list of paths.
    Paths,
    /// One of these words.
    Word(&'static [&'static str]),
    /// Any text.
    Text,
    /// A list of texts.
    Texts,
    /// A list of these words.
    Words(&'static [&'static str]),
    /// A table of names of the user's, each with a whole number from the first to the last.
    Numbered(u32, u32),
    /// One of these words or the path of a CSV table, or a list of them.
    WordsOrTables(&'static [&'static str]),
    /// A table, whose keys are listed below the same dotted name.
    Table,
    /// An array of tables, whose keys are listed below the same dotted name.
    Tables,
}

impl ValueKind {
    /// The kind with the limits of its whole numbers.
    #[must_use]
    pub const fn within(self, low: End, high: End) -> Self {
        match self {
            Self::Within(least, most) => Self::Within(low.whole(least), high.whole(most)),
            Self::Numbered(least, most) => Self::Numbered(low.whole(least), high.whole(most)),
            Self::CountOr(most, words) => Self::CountOr(high.whole(most), words),
            Self::Counts(count, most) => Self::Counts(count, high.whole(most)),
            other => other,
        }
    }

    /// Whether a text at a key of this kind is a path.
    #[must_use]
    pub fn is_path(self, text: &str) -> bool {
        match self {
            Self::Path | Self::Paths => true,
            Self::WordsOrTables(words) => !words.contains(&text),
            _ => false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triad.
    #[derive(Table)]
    struct Triad {
        /// Noise.
        #[key(unit = "U/sqrt(Hz)", min = 0.0)]
        noise: f64,
        #[key(required, min = 1, max = 9)]
        count: u16,
        #[key(default = 8, only = [8, 10, 12])]
        bits: u32,
    }

    /// Speeds.
    #[derive(Clone, Copy, Debug, Default, PartialEq, Words)]
    #[serde(rename_all = "lowercase")]
    enum Speed {
        /// Slow. As a snail.
        #[default]
        Slow,
        /// Fast.
        Fast,
    }

    #[derive(Table)]
    struct Root {
        #[key(unit = "rad/s")]
        gyro: Triad,
        speed: Speed,
        #[key(names = "x y", below = 2.0)]
        points: Vec<[f64; 2]>,
        all: Option<Vec<Triad>>,
    }

    #[test]
    fn keys_have_the_facts_of_their_fields() {
        let keys = keys_of::<Root>();
        let names: Vec<(&str, &str)> = keys.iter().map(|key| (key.name.as_str(), &*key.unit)).collect();
        let expected = [
            ("gyro.noise", "rad/s/sqrt(Hz)"),
            ("gyro.count", ""),
            ("gyro.bits", ""),
            ("speed", ""),
            ("points", ""),
            ("all", ""),
            ("all.noise", "/sqrt(Hz)"),
            ("all.count", ""),
            ("all.bits", ""),
        ];
        assert_eq!(names, expected);
        assert_eq!(keys[1].field.kind, ValueKind::Within(1, 9));
        assert_eq!((keys[2].field.kind, keys[2].field.only), (ValueKind::Within(8, 12), &[8, 10, 12][..]));
        let defaults: Vec<String> = keys.iter().map(|key| (key.field.default)()).collect();
        assert_eq!(defaults, ["0.0", "0", "8", "\"slow\"", "[]", "", "0.0", "0", "8"]);
        assert!(keys[1].field.is_required && !keys[1].field.is_optional && keys[5].field.is_optional);
        assert_eq!(keys[3].field.kind, ValueKind::Word(&["slow", "fast"]));
        assert_eq!(keys[3].field.words[0], Word { name: "slow", about: "Slow. As a snail." });
        assert_eq!((keys[4].field.kind, keys[4].field.names), (ValueKind::Points(2), &["x", "y"][..]));
        assert_eq!((keys[0].field.summary(), Speed::ALL.len(), Speed::Fast.name()), ("Noise.", 2, "fast"));
        assert_eq!(Root::ABOUT, "");
    }

    #[test]
    fn numbers_outside_are_found_at_their_keys() {
        let triad = |noise: f64| Triad { noise, count: 1, bits: 8 };
        let root = Root {
            gyro: Triad { bits: 9, ..triad(f64::NAN) },
            points: vec![[1.0, 2.0]],
            all: Some(vec![triad(1.0), triad(-1.0)]),
            ..Root::default()
        };
        let found = violations(&root);
        let keys: Vec<&str> = found.iter().map(|(key, _)| key.as_str()).collect();
        assert_eq!(keys, ["gyro.noise", "gyro.bits", "points", "all.1.noise"]);
        assert_eq!(found[1].1, "must be 8, 10 or 12, not 9");
    }
}
