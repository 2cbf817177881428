//! Methods for the exposure path: where its depths are looked up, and by which curve its nodes are joined.

use serde::Serialize;

use super::parabola_through;

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

    /// Gives `add` the number of each of `count` nodes in order, and its inverse depth in the key frame, 1/m. `look_up`
    /// finds that of a node, or of mid-exposure (`None`), and starts from the result of another if there is one.
    pub fn of_nodes(
        self,
        count: usize,
        look_up: impl Fn(Option<usize>, Option<f64>) -> f64,
        mut add: impl FnMut(usize, f64),
    ) {
        let Some(last) = count.checked_sub(1) else { return };
        let fraction = |node: usize| node as f64 / last.max(1) as f64;
        match self {
            Self::Mid => {
                let middle = look_up(None, None);
                (0..count).for_each(|node| add(node, middle));
            }
            Self::Ends => {
                let first = look_up(Some(0), None);
                let change = look_up(Some(last), Some(first)) - first;
                (0..count).for_each(|node| add(node, first + fraction(node) * change));
            }
            Self::Three => {
                let middle = look_up(None, None);
                let [begin, end] = [0, last].map(|node| look_up(Some(node), Some(middle)));
                let between = parabola_through([begin, middle, end]);
                (0..count).for_each(|node| add(node, between(fraction(node))));
            }
            Self::Each => {
                let mut before = None;
                for node in 0..count {
                    let found = look_up(Some(node), before);
                    before = Some(found);
                    add(node, found);
                }
            }
        }
    }
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
