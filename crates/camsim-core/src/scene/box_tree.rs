//! A tree of boxes over many small things, for what is near to or overlaps something.

use super::Aabb;

/// Things of a leaf, at most.
const LEAF: usize = 4;

/// Boxes within boxes: what a point is near to, or a box overlaps, is found without a look at everything.
#[derive(Debug, Default)]
pub struct BoxTree {
    nodes: Vec<Node>,
    /// The things, ordered so that those of a leaf follow each other.
    things: Vec<u32>,
}

#[derive(Debug)]
struct Node {
    bounds: Aabb,
    /// Of a leaf the place of its first thing, else its second child; the first child follows its parent.
    next: u32,
    /// Things of a leaf, else 0.
    count: u32,
}

impl BoxTree {
    /// Over things that are known by their place in `boxes`. Empty boxes are left out.
    pub fn new(boxes: &[Aabb]) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            things: (0..boxes.len() as u32).filter(|&i| !boxes[i as usize].is_empty()).collect(),
        };
        let mut things = std::mem::take(&mut tree.things);
        if !things.is_empty() {
            tree.build(boxes, &mut things, 0);
        }
        tree.things = things;
        tree
    }

    fn build(&mut self, boxes: &[Aabb], things: &mut [u32], first: u32) {
        let here = self.nodes.len();
        self.nodes.push(Node { bounds: around(boxes, things), next: first, count: things.len() as u32 });
        if things.len() <= LEAF {
            return;
        }
        let (left, right) = halves(boxes, things);
        let middle = left.len() as u32;
        self.build(boxes, left, first);
        self.nodes[here].count = 0;
        self.nodes[here].next = self.nodes.len() as u32;
        self.build(boxes, right, first + middle);
    }

    /// The things of all leaves whose boxes overlap `bounds` or touch it, in no order.
    pub fn overlapping(&self, bounds: &Aabb) -> Vec<u32> {
        let mut found = Vec::new();
        let mut stack: Vec<usize> = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at];
            if node.bounds.min.cmpgt(bounds.max).any() || node.bounds.max.cmplt(bounds.min).any() {
                continue;
            }
            if node.count > 0 {
                found.extend_from_slice(&self.things[node.next as usize..(node.next + node.count) as usize]);
            } else {
                stack.extend([at + 1, node.next as usize]);
            }
        }
        found
    }

    /// The smallest of what `measure` says of the leaves' boxes, infinite without any. `None` leaves out a
    /// box and all in it; a box must not be farther than those in it.
    pub fn nearest_box_m(&self, measure: impl Fn(&Aabb) -> Option<f64>) -> f64 {
        self.nearest(&measure, |node| measure(&node.bounds).unwrap_or(f64::INFINITY))
    }

    /// The same with what `of_thing` says of the things themselves.
    pub fn nearest_thing_m(
        &self,
        measure: impl Fn(&Aabb) -> Option<f64>,
        of_thing: impl Fn(u32) -> f64,
    ) -> f64 {
        let things = |node: &Node| &self.things[node.next as usize..(node.next + node.count) as usize];
        self.nearest(&measure, |node| {
            things(node).iter().map(|&thing| of_thing(thing)).fold(f64::INFINITY, f64::min)
        })
    }

    fn nearest(&self, measure: &impl Fn(&Aabb) -> Option<f64>, of_leaf: impl Fn(&Node) -> f64) -> f64 {
        let mut nearest = f64::INFINITY;
        let far = |at: usize| measure(&self.nodes[at].bounds).map(|distance| (distance, at));
        let mut stack: Vec<(f64, usize)> = self.nodes.first().and_then(|_| far(0)).into_iter().collect();
        while let Some((distance, at)) = stack.pop() {
            // Written so that a NaN distance goes nowhere.
            if distance < nearest {
                let node = &self.nodes[at];
                if node.count > 0 {
                    nearest = nearest.min(of_leaf(node));
                } else {
                    let children = [far(at + 1), far(node.next as usize)];
                    let swap = matches!(children, [Some(a), Some(b)] if a.0 < b.0);
                    // The nearer one last, so that it comes off first.
                    stack.extend(
                        if swap { [children[1], children[0]] } else { children }.into_iter().flatten(),
                    );
                }
            }
        }
        nearest
    }
}

/// The box around some things' boxes.
pub(super) fn around(boxes: &[Aabb], things: &[u32]) -> Aabb {
    things.iter().fold(Aabb::EMPTY, |all, &thing| all.union(&boxes[thing as usize]))
}

/// Things before and from the middle one on, along the longest side of the box around their centres.
pub(super) fn halves<'a>(boxes: &[Aabb], things: &'a mut [u32]) -> (&'a mut [u32], &'a mut [u32]) {
    let centre = |thing: u32| boxes[thing as usize].centre();
    let mut centres = Aabb::EMPTY;
    things.iter().for_each(|&thing| centres.include(centre(thing)));
    let sides = centres.max - centres.min;
    let axis =
        [1, 2].into_iter().fold(0, |longest, axis| if sides[axis] > sides[longest] { axis } else { longest });
    let middle = things.len() / 2;
    if things.len() > 1 {
        things.select_nth_unstable_by(middle, |&a, &b| centre(a)[axis].total_cmp(&centre(b)[axis]));
    }
    things.split_at_mut(middle)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Boxes of up to 2 m, thrown over 40 m by a fixed rule.
    fn boxes(count: u32) -> Vec<Aabb> {
        let part = |k: u32, step: f64| (f64::from(k) * step).fract();
        (0..count)
            .map(|k| {
                let min = 40.0 * DVec3::new(part(k, 0.618_034), part(k, 0.754_878), part(k, 0.569_840));
                Aabb { min, max: min + 2.0 * DVec3::new(part(k, 0.31), part(k, 0.47), part(k, 0.83)) }
            })
            .collect()
    }

    #[test]
    fn the_tree_finds_what_a_look_at_everything_finds() {
        for count in [0, 1, 4, 5, 300] {
            let boxes = boxes(count);
            let tree = BoxTree::new(&boxes);
            for k in 0..200 {
                let angle = 0.1 * f64::from(k);
                let origin =
                    DVec3::new(20.0 + 30.0 * angle.cos(), 20.0 + 30.0 * angle.sin(), 0.2 * f64::from(k));
                // A leaf's box holds up to four: not farther than the nearest, and nothing nearer than the
                // leaf.
                let nearest = boxes.iter().map(|of| of.distance_m(origin)).fold(f64::INFINITY, f64::min);
                assert!(tree.nearest_box_m(|bounds| Some(bounds.distance_m(origin))) <= nearest);
                let of_thing = |thing: u32| boxes[thing as usize].distance_m(origin);
                assert_eq!(tree.nearest_thing_m(|bounds| Some(bounds.distance_m(origin)), of_thing), nearest);
                assert_eq!(tree.nearest_box_m(|_| None), f64::INFINITY);
            }
        }
    }
}
