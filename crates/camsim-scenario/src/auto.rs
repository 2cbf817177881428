//! Values that may also be a keyword: `"auto"`, `"field"`, `"first"`.

use serde::{Deserialize, Deserializer, Serialize, Serializer, de};

/// A value, or `"auto"`: then the planner chooses, and `camsim explain` prints its choice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Auto<T> {
    /// The planner chooses.
    #[default]
    Auto,
    /// The given value.
    Value(T),
}

impl<T: Copy> Auto<T> {
    /// The given value, or `None` for `auto`.
    pub fn value(self) -> Option<T> {
        match self {
            Self::Auto => None,
            Self::Value(value) => Some(value),
        }
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum WordOr<T> {
    Value(T),
    Word(String),
}

impl<T: Serialize> Serialize for Auto<T> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Auto => serializer.serialize_str("auto"),
            Self::Value(value) => value.serialize(serializer),
        }
    }
}

impl<'de, T: Deserialize<'de>> Deserialize<'de> for Auto<T> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match WordOr::<T>::deserialize(deserializer) {
            Ok(WordOr::Value(value)) => Ok(Self::Value(value)),
            Ok(WordOr::Word(word)) if word == "auto" => Ok(Self::Auto),
            Ok(WordOr::Word(word)) => {
                Err(de::Error::custom(format!("`{word}` is neither \"auto\" nor a legal value here")))
            }
            Err(_) => Err(de::Error::custom("expected \"auto\" or a value of this key's type")),
        }
    }
}

/// Milliseconds between the two fields of an interlaced frame, or `"field"` for half a frame period.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FieldOr {
    /// 500 / fps.
    Field,
    /// Milliseconds.
    Ms(f64),
}

impl Serialize for FieldOr {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Field => serializer.serialize_str("field"),
            Self::Ms(ms) => serializer.serialize_f64(*ms),
        }
    }
}

impl<'de> Deserialize<'de> for FieldOr {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        match WordOr::<f64>::deserialize(deserializer) {
            Ok(WordOr::Value(ms)) => Ok(Self::Ms(ms)),
            Ok(WordOr::Word(word)) if word == "field" => Ok(Self::Field),
            _ => Err(de::Error::custom("expected milliseconds or \"field\" (= 500/fps)")),
        }
    }
}

/// A fixed keyword as the unit variant of an untagged enum.
macro_rules! word {
    ($module:ident, $word:literal, $expected:literal) => {
        pub(super) mod $module {
            use serde::{Deserialize, Deserializer, Serializer, de};

            pub fn serialize<S: Serializer>(serializer: S) -> Result<S::Ok, S::Error> {
                serializer.serialize_str($word)
            }

            pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<(), D::Error> {
                if String::deserialize(deserializer)? == $word {
                    Ok(())
                } else {
                    Err(de::Error::custom($expected))
                }
            }
        }
    };
}

word!(first, "first", "expected \"first\" or [lat_deg, lon_deg, height_m]");
word!(origin, "origin", "expected \"origin\" or [north_m, east_m, down_m]");
