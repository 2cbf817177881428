//! Values of types that TOML writes in several ways.

use super::{
    Auto, Binning, FieldOr, FileList, LoadedFile, Origin, PatternCentre, PerAxis, PerChannel, PointSource,
    keys::{Leaf, Value, ValueKind, Word},
};

impl<T: Value> Value for Auto<T> {
    const KIND: ValueKind = T::OR_AUTO;
    const WORDS: &'static [Word] = T::WORDS;

    fn leaf(&self) -> Leaf<'_> {
        match self {
            Self::Auto => Leaf::Text("auto".into()),
            Self::Value(value) => value.leaf(),
        }
    }
}

impl Value for FieldOr {
    const KIND: ValueKind = ValueKind::NumberOr(&["field"]);

    fn leaf(&self) -> Leaf<'_> {
        match self {
            Self::Field => Leaf::Text("field".into()),
            Self::Ms(ms) => ms.leaf(),
        }
    }
}

impl Value for Origin {
    const KIND: ValueKind = ValueKind::NumbersOr(3, "first");

    fn leaf(&self) -> Leaf<'_> {
        match self {
            Self::First => Leaf::Text("first".into()),
            Self::Geodetic(position) => position.leaf(),
        }
    }
}

impl Value for PatternCentre {
    const KIND: ValueKind = ValueKind::NumbersOr(3, "origin");

    fn leaf(&self) -> Leaf<'_> {
        match self {
            Self::Origin => Leaf::Text("origin".into()),
            Self::Ned(position) => position.leaf(),
        }
    }
}

impl Value for Binning {
    const KIND: ValueKind = ValueKind::NumberOrNumbers(2);

    fn leaf(&self) -> Leaf<'_> {
        match self {
            Self::Both(count) => count.leaf(),
            Self::Each(counts) => counts.leaf(),
        }
    }
}

impl Value for PerAxis {
    const KIND: ValueKind = ValueKind::NumberOrNumbers(3);

    fn leaf(&self) -> Leaf<'_> {
        match self.0 {
            [x, y, z] if x == y && y == z => Leaf::Number(x),
            _ => self.0.leaf(),
        }
    }
}

impl Value for PerChannel {
    const KIND: ValueKind = ValueKind::NumberOrList;

    fn leaf(&self) -> Leaf<'_> {
        match self {
            Self::One(value) => value.leaf(),
            Self::Each(values) => values.leaf(),
        }
    }
}

impl Value for FileList {
    const KIND: ValueKind = ValueKind::Paths;

    fn leaf(&self) -> Leaf<'_> {
        match self.paths() {
            [path] => path.leaf(),
            paths => Leaf::List(paths.iter().map(Value::leaf).collect()),
        }
    }
}

impl Value for PointSource {
    const KIND: ValueKind = ValueKind::WordsOrTables(&Self::WORDS);
    const LIST: ValueKind = Self::KIND;

    fn leaf(&self) -> Leaf<'_> {
        Leaf::Text(String::from(self.clone()).into())
    }
}

impl Value for LoadedFile {
    const KIND: ValueKind = ValueKind::Path;

    fn leaf(&self) -> Leaf<'_> {
        self.path.leaf()
    }
}
