//! Types of values.

use std::{borrow::Cow, collections::BTreeMap, fmt, path::PathBuf};

use super::{Field, ValueKind, Word};

/// A type of values of keys.
pub trait Value {
    /// The values that it takes.
    const KIND: ValueKind;
    /// Those of a list of it.
    const LIST: ValueKind = panic!("lists of this are no value");
    /// Those of it, or the word `auto`.
    const OR_AUTO: ValueKind = panic!("this may not be \"auto\"");
    /// Keys of a table.
    const FIELDS: &'static [Field] = &[];
    /// Description of a table.
    const ABOUT: &'static str = "";
    /// Words, with descriptions.
    const WORDS: &'static [Word] = &[];
    /// Whether it may be absent.
    const IS_OPTIONAL: bool = false;

    /// The value as it would be written.
    fn leaf(&self) -> Leaf<'_>;
}

/// A struct whose fields are keys.
pub trait Table {
    /// Its keys with their values, in order.
    fn values(&self) -> Vec<(&'static Field, Leaf<'_>)>;
}

/// A value of a key.
#[derive(Clone)]
pub enum Leaf<'a> {
    /// Nothing is written.
    Absent,
    /// `true` or `false`.
    Flag(bool),
    /// A number.
    Number(f64),
    /// A whole number.
    Whole(u64),
    /// A text, word or path.
    Text(Cow<'a, str>),
    /// A list of values.
    List(Vec<Leaf<'a>>),
    /// Names with values.
    Named(Vec<(&'a str, Leaf<'a>)>),
    /// A table.
    Table(&'a dyn Table),
    /// A list of tables.
    Tables(Vec<&'a dyn Table>),
}

impl<'a> Leaf<'a> {
    /// A list of values, or of tables.
    pub fn list<T: Value>(values: &'a [T]) -> Self {
        let leaves: Vec<Self> = values.iter().map(T::leaf).collect();
        if T::KIND != ValueKind::Table {
            return Self::List(leaves);
        }
        let table = |leaf| if let Self::Table(table) = leaf { Some(table) } else { None };
        Self::Tables(leaves.into_iter().filter_map(table).collect())
    }

    /// The numbers in it; none in a table.
    #[must_use]
    pub fn numbers(&self) -> Vec<f64> {
        match self {
            Self::Number(value) => vec![*value],
            Self::Whole(value) => vec![*value as f64],
            Self::List(values) => values.iter().flat_map(Self::numbers).collect(),
            Self::Named(values) => values.iter().flat_map(|(_, value)| value.numbers()).collect(),
            _ => Vec::new(),
        }
    }
}

/// As TOML, but for tables, which are `{}`.
impl fmt::Display for Leaf<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Absent => Ok(()),
            Self::Flag(value) => write!(f, "{value}"),
            Self::Number(value) => write!(f, "{value:?}"),
            Self::Whole(value) => write!(f, "{value}"),
            Self::Text(value) => write!(f, "{value:?}"),
            Self::List(values) => {
                let texts: Vec<String> = values.iter().map(ToString::to_string).collect();
                write!(f, "[{}]", texts.join(", "))
            }
            Self::Named(values) => {
                let text = |(name, value): &(&str, Leaf<'_>)| format!("{name} = {value}");
                write!(f, "{{ {} }}", values.iter().map(text).collect::<Vec<_>>().join(", "))
            }
            Self::Table(_) | Self::Tables(_) => write!(f, "{{}}"),
        }
    }
}

impl fmt::Debug for Leaf<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

const AUTO: &[&str] = &["auto"];

impl Value for f64 {
    const KIND: ValueKind = ValueKind::Number;
    const LIST: ValueKind = ValueKind::NumberList;
    const OR_AUTO: ValueKind = ValueKind::NumberOr(AUTO);

    fn leaf(&self) -> Leaf<'_> {
        Leaf::Number(*self)
    }
}

/// Whole numbers, each type with its kind.
macro_rules! whole {
    ($($type:ty: $kind:expr;)*) => {$(
        impl Value for $type {
            const KIND: ValueKind = $kind;
            const LIST: ValueKind = ValueKind::WholeList;
            const OR_AUTO: ValueKind = ValueKind::CountOr(u32::MAX, AUTO);

            fn leaf(&self) -> Leaf<'_> {
                Leaf::Whole(u64::from(*self))
            }
        }
    )*};
}

whole! {
    u8: ValueKind::Within(0, u8::MAX as u32);
    u16: ValueKind::Within(0, u16::MAX as u32);
    u32: ValueKind::Within(0, u32::MAX);
    u64: ValueKind::Whole;
}

impl Value for bool {
    const KIND: ValueKind = ValueKind::Flag;

    fn leaf(&self) -> Leaf<'_> {
        Leaf::Flag(*self)
    }
}

impl Value for String {
    const KIND: ValueKind = ValueKind::Text;
    const LIST: ValueKind = ValueKind::Texts;

    fn leaf(&self) -> Leaf<'_> {
        Leaf::Text(self.as_str().into())
    }
}

impl Value for PathBuf {
    const KIND: ValueKind = ValueKind::Path;

    fn leaf(&self) -> Leaf<'_> {
        Leaf::Text(self.to_string_lossy())
    }
}

impl<const N: usize> Value for [f64; N] {
    const KIND: ValueKind = ValueKind::Numbers(N);
    const LIST: ValueKind = ValueKind::Points(N);

    fn leaf(&self) -> Leaf<'_> {
        Leaf::list(self)
    }
}

impl<const N: usize> Value for [u32; N] {
    const KIND: ValueKind = ValueKind::Counts(N, u32::MAX);

    fn leaf(&self) -> Leaf<'_> {
        Leaf::list(self)
    }
}

impl<T: Value> Value for Option<T> {
    const KIND: ValueKind = T::KIND;
    const FIELDS: &'static [Field] = T::FIELDS;
    const ABOUT: &'static str = T::ABOUT;
    const WORDS: &'static [Word] = T::WORDS;
    const IS_OPTIONAL: bool = true;

    fn leaf(&self) -> Leaf<'_> {
        self.as_ref().map_or(Leaf::Absent, T::leaf)
    }
}

impl<T: Value> Value for Vec<T> {
    const KIND: ValueKind = T::LIST;
    const FIELDS: &'static [Field] = T::FIELDS;
    const ABOUT: &'static str = T::ABOUT;
    const WORDS: &'static [Word] = T::WORDS;

    fn leaf(&self) -> Leaf<'_> {
        Leaf::list(self)
    }
}

impl Value for BTreeMap<String, u16> {
    const KIND: ValueKind = ValueKind::Numbered(0, u16::MAX as u32);

    fn leaf(&self) -> Leaf<'_> {
        Leaf::Named(self.iter().map(|(name, value)| (name.as_str(), value.leaf())).collect())
    }
}
