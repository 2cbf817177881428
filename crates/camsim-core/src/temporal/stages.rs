//! What the path of an exposure is made of.

use serde::Serialize;

/// Where the key frame's depth is looked up that the nodes of an exposure take.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NodeDepths {
    /// At mid-exposure, for all.
    Mid,
    /// At both ends; what is between takes what lies between. The second look-up begins with what the first
    /// has found, and so takes one iteration less.
    Ends,
    /// At mid-exposure and, beginning with what that has found, at both ends; what is between takes the
    /// parabola through them.
    Three,
    /// In each, beginning with what the one before has found.
    Each,
}

impl NodeDepths {
    /// All of them, in the order of their time.
    pub const ALL: [Self; 4] = [Self::Mid, Self::Ends, Self::Three, Self::Each];
}

/// The curve that joins the nodes of an exposure: one polynomial of time through each so many of them, the
/// last of which is the next one's first. With h from node to node it misses a path p by at most `h^2 |p''| /
/// 8`, `h^3 |p'''| / 15.6` or `h^5 |p'''''| / 33`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PathStage {
    /// Two nodes.
    Straight,
    /// Three.
    Parabola,
    /// Five.
    Quartic,
}

impl PathStage {
    /// All of them, in the order of their degree.
    pub const ALL: [Self; 3] = [Self::Straight, Self::Parabola, Self::Quartic];

    /// Steps from node to node along one polynomial: its degree.
    #[must_use]
    pub fn steps(self) -> u32 {
        match self {
            Self::Straight => 1,
            Self::Parabola => 2,
            Self::Quartic => 4,
        }
    }
}
