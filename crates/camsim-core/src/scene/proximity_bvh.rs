//! Bounding volume hierarchy for proximity and overlap queries.

use super::Aabb;

/// Most items of a leaf.
const LEAF: usize = 4;

/// Bounding volume hierarchy over boxes, which finds the items near a point or overlapping a box.
#[derive(Debug, Default)]
pub struct ProximityBvh {
    nodes: Vec<ProximityNode>,
    /// Indices of the items; those of a leaf are consecutive.
    items: Vec<u32>,
}

#[derive(Debug)]
struct ProximityNode {
    bounds: Aabb,
    /// Of a leaf the position of its first item, else the second child. The first child follows its parent.
    next: u32,
    /// Number of items of a leaf, else 0.
    count: u32,
}

impl ProximityBvh {
    /// Builds the tree over `boxes`, whose indices identify the items. Empty boxes are skipped.
    pub fn new(boxes: &[Aabb]) -> Self {
        let mut tree = Self {
            nodes: Vec::new(),
            items: (0..boxes.len() as u32).filter(|&i| !boxes[i as usize].is_empty()).collect(),
        };
        let mut items = std::mem::take(&mut tree.items);
        if !items.is_empty() {
            tree.build(boxes, &mut items, 0);
        }
        tree.items = items;
        tree
    }

    fn build(&mut self, boxes: &[Aabb], items: &mut [u32], first: u32) {
        let here = self.nodes.len();
        self.nodes.push(ProximityNode {
            bounds: union_of(boxes, items),
            next: first,
            count: items.len() as u32,
        });
        if items.len() <= LEAF {
            return;
        }
        let (left, right) = median_split(boxes, items);
        let middle = left.len() as u32;
        self.build(boxes, left, first);
        self.nodes[here].count = 0;
        self.nodes[here].next = self.nodes.len() as u32;
        self.build(boxes, right, first + middle);
    }

    /// Items of all leaves whose boxes overlap or touch `bounds`, in no particular order.
    pub fn overlapping(&self, bounds: &Aabb) -> Vec<u32> {
        let mut overlapping = Vec::new();
        let mut stack: Vec<usize> = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(at) = stack.pop() {
            let node = &self.nodes[at];
            if node.bounds.min.cmpgt(bounds.max).any() || node.bounds.max.cmplt(bounds.min).any() {
                continue;
            }
            if node.count > 0 {
                overlapping
                    .extend_from_slice(&self.items[node.next as usize..(node.next + node.count) as usize]);
            } else {
                stack.extend([at + 1, node.next as usize]);
            }
        }
        overlapping
    }

    /// Smallest value of `measure` over the boxes of the leaves; infinite without any. `None` prunes a box
    /// with all its contents. A box must not measure more than the boxes in it.
    pub fn nearest_box_m(&self, measure: impl Fn(&Aabb) -> Option<f64>) -> f64 {
        self.nearest(&measure, |node| measure(&node.bounds).unwrap_or(f64::INFINITY))
    }

    /// Smallest value of `item_distance` over the items, pruned by `measure` of the boxes.
    pub fn nearest_item_m(
        &self,
        measure: impl Fn(&Aabb) -> Option<f64>,
        item_distance: impl Fn(u32) -> f64,
    ) -> f64 {
        let items = |node: &ProximityNode| &self.items[node.next as usize..(node.next + node.count) as usize];
        self.nearest(&measure, |node| {
            items(node).iter().map(|&item| item_distance(item)).fold(f64::INFINITY, f64::min)
        })
    }

    fn nearest(
        &self,
        measure: &impl Fn(&Aabb) -> Option<f64>,
        of_leaf: impl Fn(&ProximityNode) -> f64,
    ) -> f64 {
        let mut nearest = f64::INFINITY;
        let far = |at: usize| measure(&self.nodes[at].bounds).map(|distance| (distance, at));
        let mut stack: Vec<(f64, usize)> = self.nodes.first().and_then(|_| far(0)).into_iter().collect();
        while let Some((distance, at)) = stack.pop() {
            // The comparison is false for a NaN distance.
            if distance < nearest {
                let node = &self.nodes[at];
                if node.count > 0 {
                    nearest = nearest.min(of_leaf(node));
                } else {
                    let children = [far(at + 1), far(node.next as usize)];
                    let swap = matches!(children, [Some(a), Some(b)] if a.0 < b.0);
                    // The nearer child is pushed last, so it is popped first.
                    stack.extend(
                        if swap { [children[1], children[0]] } else { children }.into_iter().flatten(),
                    );
                }
            }
        }
        nearest
    }
}

/// Union of the boxes of some items.
pub(super) fn union_of(boxes: &[Aabb], items: &[u32]) -> Aabb {
    items.iter().fold(Aabb::EMPTY, |all, &item| all.union(&boxes[item as usize]))
}

/// Splits items at the median along the longest side of the box around their centres.
pub(super) fn median_split<'a>(boxes: &[Aabb], items: &'a mut [u32]) -> (&'a mut [u32], &'a mut [u32]) {
    let centre = |item: u32| boxes[item as usize].centre();
    let mut centres = Aabb::EMPTY;
    items.iter().for_each(|&item| centres.include(centre(item)));
    let sides = centres.max - centres.min;
    let axis =
        [1, 2].into_iter().fold(0, |longest, axis| if sides[axis] > sides[longest] { axis } else { longest });
    let middle = items.len() / 2;
    if items.len() > 1 {
        items.select_nth_unstable_by(middle, |&a, &b| centre(a)[axis].total_cmp(&centre(b)[axis]));
    }
    items.split_at_mut(middle)
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    /// Boxes of up to 2 m, spread over 40 m by a fixed rule.
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
    fn queries_match_a_search_of_all_items() {
        for count in [0, 1, 4, 5, 300] {
            let boxes = boxes(count);
            let tree = ProximityBvh::new(&boxes);
            for k in 0..200 {
                let angle = 0.1 * f64::from(k);
                let origin =
                    DVec3::new(20.0 + 30.0 * angle.cos(), 20.0 + 30.0 * angle.sin(), 0.2 * f64::from(k));
                // The box of a leaf holds up to four items: it is not farther than the nearest item, and no
                // item is nearer than its leaf.
                let nearest = boxes.iter().map(|of| of.distance_m(origin)).fold(f64::INFINITY, f64::min);
                assert!(tree.nearest_box_m(|bounds| Some(bounds.distance_m(origin))) <= nearest);
                let item_distance = |item: u32| boxes[item as usize].distance_m(origin);
                assert_eq!(
                    tree.nearest_item_m(|bounds| Some(bounds.distance_m(origin)), item_distance),
                    nearest
                );
                assert_eq!(tree.nearest_box_m(|_| None), f64::INFINITY);
            }
        }
    }
}
