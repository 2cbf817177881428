//! Methods for the exposure path: where its depths are looked up, and by which curve its nodes are joined.

use serde::Serialize;

/// Nodes of an exposure at which the depth of the key frame is looked up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum NodeDepths {
    /// At mid-exposure; all nodes use that depth.
    Mid,
    /// At both ends; the other nodes interpolate linearly. The second look-up starts from the result of the
    /// first and needs one iteration less.
    Ends,
    /// At mid-exposure and then, starting from that result, at both ends; the other nodes use the parabola
    /// through the three.
    Three,
    /// At every node, each starting from the result of the one before.
    Each,
}

impl NodeDepths {
    /// All variants, in the order of cost.
    pub const ALL: [Self; 4] = [Self::Mid, Self::Ends, Self::Three, Self::Each];
}

/// The curve that joins the nodes of an exposure: polynomials of time, each of which starts at the last node
/// of the one before. With the step h between nodes, the deviation from a path p is at most `h^2 |p''| / 8`
/// (straight), `h^3 |p'''| / 15.6` (parabola) or `h^5 |p'''''| / 33` (quartic).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum PathStage {
    /// Straight lines through two nodes.
    Straight,
    /// Parabolas through three nodes.
    Parabola,
    /// Quartic polynomials through five nodes.
    Quartic,
}

impl PathStage {
    /// All variants, in the order of their degree.
    pub const ALL: [Self; 3] = [Self::Straight, Self::Parabola, Self::Quartic];

    /// Steps between nodes along one polynomial, which is its degree.
    #[must_use]
    pub fn steps(self) -> u32 {
        match self {
            Self::Straight => 1,
            Self::Parabola => 2,
            Self::Quartic => 4,
        }
    }
}
