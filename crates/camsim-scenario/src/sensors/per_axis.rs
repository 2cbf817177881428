//! A number for all three axes, or one for each.

use serde::{Deserialize, Deserializer, Serialize, Serializer};

/// Values of the axes x, y, z. Written as one number if they are equal.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PerAxis(pub [f64; 3]);

impl PerAxis {
    /// The same value for all axes.
    #[must_use]
    pub const fn all(value: f64) -> Self {
        Self([value; 3])
    }

    /// The largest value.
    #[must_use]
    pub fn largest(self) -> f64 {
        self.0.into_iter().fold(f64::MIN, f64::max)
    }
}

impl Serialize for PerAxis {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let [x, y, z] = self.0;
        if x == y && y == z { serializer.serialize_f64(x) } else { self.0.serialize(serializer) }
    }
}

#[derive(Deserialize)]
#[serde(untagged)]
enum OneOrThree {
    One(f64),
    Three([f64; 3]),
}

impl<'de> Deserialize<'de> for PerAxis {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(match OneOrThree::deserialize(deserializer)? {
            OneOrThree::One(value) => Self::all(value),
            OneOrThree::Three(values) => Self(values),
        })
    }
}
