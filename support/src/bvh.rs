//! Bounding volume hierarchies: binary, split by the surface area heuristic over bins (Wald, On fast Construction of
//! SAH-based Bounding Volume Hierarchies, 2007), and up to four descendants of a node for a walk that tests four boxes
//! at once (Dammertz et al., Shallow Bounding Volume Hierarchies for Fast SIMD Ray Tracing of Incoherent Rays, 2008).

use crate::aabb::Aabb;
use crate::simd4::WIDE;
use crate::slice::{item, part, part_mut, span};

/// Bins on an axis.
const BINS: usize = 16;
/// Depth from which nodes are split into halves of equal count, which ends after at most 32 more levels.
const COST_DEPTH: u32 = 15;
/// Levels of nodes of the deepest hierarchy.
pub const MAX_DEPTH: u32 = COST_DEPTH + 33;

/// When entries become a leaf.
#[derive(Clone, Copy, Debug)]
pub struct LeafRule {
    /// Entries of a leaf at most.
    pub most: usize,
    /// Cost of testing the boxes of a split, in tests of entries. With `f32::MAX`, entries that fit into one leaf are
    /// not split.
    pub split_cost: f32,
}

/// A child of a node: a leaf or a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Child {
    /// The box around all of its entries.
    pub bounds: Aabb,
    /// Of a leaf the first of its entries in [`Hierarchy::order`], otherwise the node's index.
    pub first: u32,
    /// Entries of a leaf; 0: a node.
    pub count: u32,
}

impl Child {
    /// No child: the root has no parent.
    const ABSENT: Self = Self {
        bounds: Aabb::EMPTY,
        first: 0,
        count: 0,
    };

    fn is_absent(&self) -> bool {
        self.first == 0 && self.count == 0
    }

    /// Whether it is a node.
    pub fn is_node(&self) -> bool {
        self.count == 0
    }
}

/// A node; only the root may lack its second child.
type Node = [Child; 2];

/// A hierarchy over numbered entries.
#[derive(Clone, Debug, Default)]
pub struct Hierarchy {
    /// The first is the root, children come behind their parents. Empty for no entries.
    nodes: Vec<Node>,
    /// The entries in the order of the leafs.
    order: Vec<u32>,
}

/// Up to four descendants that together hold all entries of a node. They are kept without heap memory, because animated
/// models are widened in each frame.
pub struct WideChildren {
    list: [Child; WIDE],
    count: usize,
}

impl WideChildren {
    fn extend(&mut self, children: impl Iterator<Item = Child>) {
        for child in children {
            if let Some(slot) = self.list.get_mut(self.count) {
                *slot = child;
                self.count += 1;
            }
        }
    }
}

impl std::ops::Deref for WideChildren {
    type Target = [Child];

    fn deref(&self) -> &[Child] {
        part(&self.list, ..self.count)
    }
}

/// A range of entries that becomes the child of a node.
struct Task {
    first: usize,
    count: usize,
    bounds: Aabb,
    depth: u32,
    /// Node and side of the child; `None` for the root.
    parent: Option<(usize, usize)>,
}

fn index(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

impl Hierarchy {
    /// Builds a hierarchy over boxes. Boxes that are empty or not finite are left out: nothing can hit them.
    pub fn new(boxes: &[Aabb], leaf: LeafRule) -> Self {
        let mut order: Vec<u32> = (0u32..)
            .zip(boxes)
            .filter(|(_, b)| b.is_finite() && !b.is_empty())
            .map(|(i, _)| i)
            .collect();
        if order.is_empty() {
            return Self::default();
        }
        let mut nodes: Vec<Node> = Vec::with_capacity(order.len());
        let mut tasks = vec![Task {
            first: 0,
            count: order.len(),
            bounds: union_of(&order, boxes),
            depth: 0,
            parent: None,
        }];
        while let Some(task) = tasks.pop() {
            let entries = part_mut(&mut order, task.first..task.first + task.count);
            let left = split(entries, boxes, &task, leaf);
            // the root is a node even if all entries fit into one leaf
            if left.is_none() && task.parent.is_some() {
                attach(&mut nodes, &task, index(task.first), index(task.count));
                continue;
            }
            let node = nodes.len();
            nodes.push([Child::ABSENT; 2]);
            attach(&mut nodes, &task, index(node), 0);
            let left = left.unwrap_or(task.count);
            let mut first = task.first;
            for (side, count) in [left, task.count - left].into_iter().enumerate() {
                if count > 0 {
                    let members = part(&order, first..first + count);
                    tasks.push(Task {
                        first,
                        count,
                        bounds: union_of(members, boxes),
                        depth: task.depth + 1,
                        parent: Some((node, side)),
                    });
                }
                first += count;
            }
        }
        Self { nodes, order }
    }

    /// Fits the boxes to entries that have moved; each entry stays in its leaf. `boxes`: of the entries that the
    /// hierarchy was built from, all finite. Returns the box of everything.
    pub fn refit(&mut self, boxes: &[Aabb]) -> Aabb {
        // children come behind their parents
        for index in (0..self.nodes.len()).rev() {
            for side in 0..2 {
                let child = self.nodes[index][side];
                let bounds = if child.is_node() {
                    self.node_bounds(child.first)
                } else {
                    union_of(self.entries(&child), boxes)
                };
                if !child.is_absent() {
                    self.nodes[index][side].bounds = bounds;
                }
            }
        }
        self.bounds()
    }

    /// Whether it has no entries.
    pub fn is_empty(&self) -> bool {
        self.nodes.is_empty()
    }

    /// Number of binary nodes.
    pub fn node_count(&self) -> usize {
        self.nodes.len()
    }

    /// The entries in the order of the leafs.
    pub fn order(&self) -> &[u32] {
        &self.order
    }

    /// The entries of a leaf.
    pub fn entries(&self, leaf: &Child) -> &[u32] {
        part(&self.order, span(leaf.first, leaf.count))
    }

    /// The box of everything.
    pub fn bounds(&self) -> Aabb {
        self.node_bounds(0)
    }

    fn node_bounds(&self, node: u32) -> Aabb {
        let node = self.nodes.get(node as usize);
        node.map_or(Aabb::EMPTY, |[a, b]| a.bounds.union(b.bounds))
    }

    /// Expected cost of a ray that meets the box of everything, in tests of boxes and entries: by the surface area
    /// heuristic the areas of the children times their tests, over the area of the whole.
    pub fn cost(&self) -> f32 {
        let whole = self.bounds().half_area();
        let sum: f32 = (self.nodes.iter().flatten())
            .map(|child| child.bounds.half_area() * child.count.max(1) as f32)
            .sum();
        if whole > 0.0 { sum / whole } else { 0.0 }
    }

    /// Levels of nodes from each node downwards, itself included.
    pub fn heights(&self) -> Vec<u32> {
        let mut heights = vec![1u32; self.nodes.len()];
        // children come behind their parents
        for index in (0..self.nodes.len()).rev() {
            let below = self.children(index).filter(Child::is_node);
            let below = below.filter_map(|c| heights.get(c.first as usize)).max();
            let height = 1 + below.copied().unwrap_or(0);
            if let Some(slot) = heights.get_mut(index) {
                *slot = height;
            }
        }
        heights
    }

    fn children(&self, node: usize) -> impl Iterator<Item = Child> + '_ {
        let children = self.nodes.get(node).into_iter().flatten();
        children.copied().filter(|child| !child.is_absent())
    }

    /// The children of a node; the node with the largest surface among them is replaced by its own children until
    /// there are `most` (at most four).
    pub fn wide_children(&self, node: usize, most: usize) -> WideChildren {
        let mut found = WideChildren {
            list: [Child::ABSENT; WIDE],
            count: 0,
        };
        found.extend(self.children(node));
        while found.count < most.min(WIDE) {
            let area = |c: &Child| c.bounds.half_area();
            let nodes = found.iter().enumerate().filter(|(_, c)| c.is_node());
            let Some((largest, _)) = nodes.max_by(|a, b| area(a.1).total_cmp(&area(b.1))) else {
                break; // leaves alone
            };
            let opened = found.list[largest];
            found.count -= 1;
            found.list[largest] = found.list[found.count];
            found.extend(self.children(opened.first as usize));
        }
        found
    }
}

/// The box of an entry.
fn box_of(entry: u32, boxes: &[Aabb]) -> Aabb {
    item(boxes, entry as usize)
}

fn union_of(entries: &[u32], boxes: &[Aabb]) -> Aabb {
    let boxes = entries.iter().map(|&i| box_of(i, boxes));
    boxes.fold(Aabb::EMPTY, Aabb::union)
}

fn attach(nodes: &mut [Node], task: &Task, first: u32, count: u32) {
    if let Some((parent, side)) = task.parent
        && let Some(child) = nodes.get_mut(parent).and_then(|node| node.get_mut(side))
    {
        let bounds = task.bounds;
        *child = Child {
            bounds,
            first,
            count,
        };
    }
}

/// Reorders entries into two parts and returns the length of the first; both parts have entries. `None`: they become
/// one leaf.
fn split(entries: &mut [u32], boxes: &[Aabb], task: &Task, leaf: LeafRule) -> Option<usize> {
    let half = entries.len() / 2;
    if half == 0 {
        return None;
    }
    let fits = entries.len() <= leaf.most.max(1);
    let centre = |i: u32| box_of(i, boxes).centre();
    let centres = Aabb::of(entries.iter().map(|&i| centre(i)));
    if task.depth < COST_DEPTH
        && let Some((cost, axis, cut)) = cheapest(entries, boxes, centres)
    {
        let area = task.bounds.half_area();
        if fits && cost + area * leaf.split_cost >= area * entries.len() as f32 {
            return None;
        }
        let mut left = 0;
        for i in 0..entries.len() {
            if centre(entries[i])[axis] < cut {
                entries.swap(i, left);
                left += 1;
            }
        }
        if left > 0 && left < entries.len() {
            return Some(left);
        }
    }
    if fits {
        return None;
    }
    // at the median of the widest axis
    let widest = centres.size().max_position();
    entries.select_nth_unstable_by(half, |&a, &b| {
        let by_centre = centre(a)[widest].total_cmp(&centre(b)[widest]);
        by_centre.then(a.cmp(&b))
    });
    Some(half)
}

/// Cost (areas times entries), axis and coordinate of the cheapest split between bins.
fn cheapest(entries: &[u32], boxes: &[Aabb], centres: Aabb) -> Option<(f32, usize, f32)> {
    let mut best: Option<(f32, usize, f32)> = None;
    // few entries need few bins
    let used = BINS.min(2 * entries.len());
    for axis in 0..3 {
        let (low, size) = (centres.mins[axis], centres.size()[axis]);
        if size <= 0.0 {
            continue;
        }
        let mut bins = [(Aabb::EMPTY, 0usize); BINS];
        let bin_of = |x: f32| (((x - low) / size * used as f32) as usize).min(used - 1);
        for &i in entries {
            let bounds = box_of(i, boxes);
            let bin = &mut bins[bin_of(bounds.centre()[axis])];
            *bin = (bin.0.union(bounds), bin.1 + 1);
        }
        // cost of everything to the right of each cut
        let mut right = [0.0; BINS];
        let (mut bounds, mut count) = (Aabb::EMPTY, 0);
        for i in (1..used).rev() {
            bounds = bounds.union(bins[i].0);
            count += bins[i].1;
            right[i] = bounds.half_area() * count as f32;
        }
        let (mut bounds, mut count) = (Aabb::EMPTY, 0);
        for i in 1..used {
            bounds = bounds.union(bins[i - 1].0);
            count += bins[i - 1].1;
            if count == 0 || count == entries.len() {
                continue;
            }
            let cost = bounds.half_area() * count as f32 + right[i];
            if best.is_none_or(|b| cost < b.0) {
                best = Some((cost, axis, low + size * i as f32 / used as f32));
            }
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;
    use glam::Vec3;

    const RULES: [LeafRule; 3] = [
        LeafRule {
            most: 1,
            split_cost: 0.7,
        },
        LeafRule {
            most: 4,
            split_cost: 0.7,
        },
        LeafRule {
            most: 4,
            split_cost: f32::MAX,
        },
    ];

    /// Checks that each entry is in one leaf, that leafs keep the rule, and that boxes contain what is in them.
    fn check(boxes: &[Aabb], hierarchy: &Hierarchy, rule: LeafRule) {
        let mut seen = vec![0; boxes.len()];
        let mut stack = vec![(0usize, 1u32)];
        while let Some((node, depth)) = stack.pop() {
            assert!(depth <= MAX_DEPTH);
            for child in hierarchy.children(node) {
                assert!(child.count as usize <= rule.most);
                if child.is_node() {
                    let below = hierarchy.node_bounds(child.first);
                    assert_eq!(below, child.bounds);
                    stack.push((child.first as usize, depth + 1));
                }
                for &entry in hierarchy.entries(&child) {
                    seen[entry as usize] += 1;
                    let entry = boxes[entry as usize];
                    assert_eq!(child.bounds.union(entry), child.bounds);
                }
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
    }

    fn random_boxes(seed: u64, count: usize, size: f32) -> Vec<Aabb> {
        let mut random = Random::new(seed);
        (0..count)
            .map(|_| {
                let at = random.signed_point() * 100.0;
                Aabb::of([at, at + random.signed_point() * size])
            })
            .collect()
    }

    #[test]
    fn every_entry_is_in_one_leaf() {
        for count in [1usize, 2, 4, 5, 33, 1000] {
            for size in [0.0, 3.0, 300.0] {
                let boxes = random_boxes(count as u64, count, size);
                for rule in RULES {
                    check(&boxes, &Hierarchy::new(&boxes, rule), rule);
                }
            }
        }
        assert!(Hierarchy::new(&[], RULES[0]).is_empty());
    }

    #[test]
    fn entries_that_fit_are_split_only_if_it_is_cheaper() {
        // four points far apart: with a cost of 0.7 a ray should test them one by one
        let boxes: Vec<Aabb> = random_boxes(3, 4, 0.1);
        let leafs = |rule| {
            let hierarchy = Hierarchy::new(&boxes, rule);
            let leafs = hierarchy.nodes.iter().flatten().filter(|c| c.count > 0);
            leafs.count()
        };
        assert_eq!(RULES.map(leafs), [4, 4, 1]);
    }

    #[test]
    fn no_arrangement_is_deeper_than_stated() {
        // each box twice as far as the last, and all in one place: the worst cases of splits by cost
        let at = |p: Vec3| Aabb::new(p, p);
        let spread: Vec<Aabb> = (0..4000).map(|i| at(Vec3::X * 1.02f32.powi(i))).collect();
        let same = vec![at(Vec3::ONE); 5000];
        for rule in RULES {
            check(&spread, &Hierarchy::new(&spread, rule), rule);
            check(&same, &Hierarchy::new(&same, rule), rule);
        }
    }

    #[test]
    fn boxes_that_nothing_can_hit_are_left_out() {
        let good = Aabb::new(Vec3::ZERO, Vec3::ONE);
        for bad in [
            Aabb::EMPTY,
            Aabb::new(Vec3::ZERO, Vec3::INFINITY),
            Aabb::new(Vec3::NEG_INFINITY, Vec3::ZERO),
            Aabb::new(Vec3::NAN, Vec3::ONE),
            Aabb::new(Vec3::ONE, Vec3::ZERO),
        ] {
            assert!(Hierarchy::new(&[bad], RULES[1]).is_empty(), "{bad:?}");
            let hierarchy = Hierarchy::new(&[bad, good], RULES[1]);
            assert_eq!(hierarchy.order(), [1], "{bad:?}");
            assert_eq!(hierarchy.bounds(), good, "{bad:?}");
        }
    }

    #[test]
    fn a_refitted_hierarchy_holds_moved_entries() {
        for rule in RULES {
            for count in [1, 2, 50, 700] {
                let moved = random_boxes(6, count, 20.0);
                let mut hierarchy = Hierarchy::new(&random_boxes(5, count, 20.0), rule);
                assert_eq!(
                    hierarchy.refit(&moved),
                    moved.iter().fold(Aabb::EMPTY, |b, &m| b.union(m))
                );
                check(&moved, &hierarchy, rule);
                let fresh = Hierarchy::new(&moved, rule);
                assert!(count < 50 || hierarchy.cost() > fresh.cost());
            }
        }
    }

    #[test]
    fn wide_children_hold_all_entries_of_a_node() {
        let boxes = random_boxes(8, 300, 10.0);
        for most in [2, 3, 4, 9] {
            let hierarchy = Hierarchy::new(&boxes, RULES[1]);
            let mut seen = vec![0; boxes.len()];
            let mut stack = vec![0];
            while let Some(node) = stack.pop() {
                let children = hierarchy.wide_children(node, most);
                assert!(children.len() <= most.min(WIDE));
                let nodes = children.iter().filter(|c| c.is_node());
                assert!(nodes.count() == 0 || children.len() == most.min(WIDE));
                for child in children.iter() {
                    stack.extend(child.is_node().then_some(child.first as usize));
                    let entries = hierarchy.entries(child).iter();
                    entries.for_each(|&entry| seen[entry as usize] += 1);
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{most}");
        }
    }
}
