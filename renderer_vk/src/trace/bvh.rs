//! Bounding volume hierarchies for the compute tracer: binary, split by the surface area heuristic over bins (Wald, On
//! fast Construction of SAH-based Bounding Volume Hierarchies, 2007). Rays walk them in a wider form (`wide_bvh`).

use glam::Vec3;
use shaders::trace_types::{BvhNode, BvhTriangle};

use super::wide_bvh::widen;

/// Triangles of a leaf that are no longer split.
pub const LEAF: usize = 4;
/// Bins on an axis.
const BINS: usize = 16;
/// What testing the boxes of a split costs, in tests of triangles.
const SPLIT_COST: f32 = 0.7;
/// Depth at which splitting by cost gives way to splitting in halves, which ends after at most 32 more levels: no
/// hierarchy is deeper than the shader's stack (`BVH_STACK`).
const COST_DEPTH: u32 = 15;

/// Where the box of a child lies that is not there.
const ABSENT: Vec3 = Vec3::splat(3.0e38);

/// An axis-aligned box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub low: Vec3,
    /// Largest corner.
    pub high: Vec3,
}

impl Aabb {
    /// Holds nothing.
    pub const EMPTY: Self = Self {
        low: Vec3::INFINITY,
        high: Vec3::NEG_INFINITY,
    };

    /// With a point added.
    #[must_use]
    pub fn with(self, p: Vec3) -> Self {
        Self {
            low: self.low.min(p),
            high: self.high.max(p),
        }
    }

    /// Of both.
    #[must_use]
    pub fn union(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
        }
    }

    /// The eight corners.
    pub fn corners(self) -> [Vec3; 8] {
        std::array::from_fn(|i| {
            let pick = |bit: usize, low: f32, high: f32| if i & bit == 0 { low } else { high };
            Vec3::new(
                pick(1, self.low.x, self.high.x),
                pick(2, self.low.y, self.high.y),
                pick(4, self.low.z, self.high.z),
            )
        })
    }

    /// Half of its surface.
    pub fn half_area(self) -> f32 {
        let size = (self.high - self.low).max(Vec3::ZERO);
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    fn middle(self) -> Vec3 {
        (self.low + self.high) * 0.5
    }
}

/// The boxes of two children.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BinaryNode {
    /// Smallest corners; a child that is not there is a point beyond everything.
    pub low: [Vec3; 2],
    /// Largest corners.
    pub high: [Vec3; 2],
    /// Of a leaf the first of its entries, otherwise the child's node.
    pub first: [u32; 2],
    /// Entries of a leaf; 0: a node.
    pub count: [u32; 2],
}

impl BinaryNode {
    /// The box of a child that is there.
    pub fn child(&self, side: usize) -> Option<Aabb> {
        let (&low, &high) = (self.low.get(side)?, self.high.get(side)?);
        (low != ABSENT).then_some(Aabb { low, high })
    }
}

/// A hierarchy over numbered entries.
#[derive(Clone, Debug, Default)]
pub struct Hierarchy {
    /// Nodes; the first is the root, children come behind their parents. Empty for no entries.
    pub nodes: Vec<BinaryNode>,
    /// The entries in the order of the leafs.
    pub order: Vec<u32>,
}

/// A range of entries that becomes the child of a node.
struct Task {
    first: usize,
    count: usize,
    bounds: Aabb,
    depth: u32,
    /// Node and side that wait for it; the root's parent is none.
    parent: Option<(usize, usize)>,
}

fn index(n: usize) -> u32 {
    u32::try_from(n).unwrap_or(u32::MAX)
}

impl Hierarchy {
    /// Fits the boxes to entries that have moved; which entry is in which leaf stays. `boxes`: of the entries that the
    /// hierarchy was built from, all finite. Returns the box of everything.
    pub fn refit(&mut self, boxes: &[Aabb]) -> Aabb {
        let of = |i: u32| boxes.get(i as usize).copied().unwrap_or(Aabb::EMPTY);
        // children come behind their parents
        for index in (0..self.nodes.len()).rev() {
            let Some(mut node) = self.nodes.get(index).copied() else {
                break;
            };
            for side in 0..2 {
                if node.low[side] == ABSENT {
                    continue;
                }
                let first = node.first[side] as usize;
                let fitted = if node.count[side] == 0 {
                    self.nodes.get(first).map_or(Aabb::EMPTY, bounds_of)
                } else {
                    let entries = self.order.get(first..first + node.count[side] as usize);
                    let entries = entries.unwrap_or_default().iter();
                    entries.fold(Aabb::EMPTY, |b, &i| b.union(of(i)))
                };
                node.low[side] = fitted.low;
                node.high[side] = fitted.high;
            }
            if let Some(slot) = self.nodes.get_mut(index) {
                *slot = node;
            }
        }
        self.bounds()
    }

    /// The box of everything.
    pub fn bounds(&self) -> Aabb {
        self.nodes.first().map_or(Aabb::EMPTY, bounds_of)
    }

    /// What a ray that meets the whole costs, in boxes and entries tested: the areas of the parts over that of the whole
    /// (the surface area heuristic).
    pub fn cost(&self) -> f32 {
        let whole = self.bounds().half_area();
        let mut sum = 0.0;
        for node in &self.nodes {
            for side in 0..2 {
                if let Some(part) = node.child(side) {
                    #[allow(clippy::cast_precision_loss)] // a few entries
                    let tests = node.count[side].max(1) as f32;
                    sum += part.half_area() * tests;
                }
            }
        }
        if whole > 0.0 { sum / whole } else { 0.0 }
    }
}

/// The box around both children of a node.
fn bounds_of(node: &BinaryNode) -> Aabb {
    (0..2)
        .filter_map(|side| node.child(side))
        .fold(Aabb::EMPTY, Aabb::union)
}

/// Builds a hierarchy over boxes. Boxes that are not finite are left out: nothing can hit them. `leaf`: entries that a
/// leaf holds at most.
pub fn build(boxes: &[Aabb], leaf: usize) -> Hierarchy {
    let leaf = leaf.max(1);
    let usable = |b: &Aabb| b.low.is_finite() && b.high.is_finite() && b.low.cmple(b.high).all();
    let mut order: Vec<u32> = (0u32..)
        .zip(boxes)
        .filter(|(_, b)| usable(b))
        .map(|(i, _)| i)
        .collect();
    if order.is_empty() {
        return Hierarchy::default();
    }
    let of = |i: u32| boxes.get(i as usize).copied().unwrap_or(Aabb::EMPTY);
    let bounds = order.iter().fold(Aabb::EMPTY, |b, &i| b.union(of(i)));
    let mut nodes: Vec<BinaryNode> = Vec::with_capacity(order.len());
    let mut tasks = vec![Task {
        first: 0,
        count: order.len(),
        bounds,
        depth: 0,
        parent: None,
    }];
    while let Some(task) = tasks.pop() {
        let entries = order
            .get_mut(task.first..task.first + task.count)
            .unwrap_or_default();
        let parts = split(entries, &of, &task, leaf);
        // the root is always a node, be it of one leaf alone
        if parts.is_none() && task.parent.is_some() {
            attach(&mut nodes, &task, index(task.first), index(task.count));
            continue;
        }
        let node = nodes.len();
        nodes.push(BinaryNode {
            // a child that is not there is a point that no ray comes to
            low: [ABSENT; 2],
            high: [ABSENT; 2],
            first: [0; 2],
            count: [1; 2],
        });
        attach(&mut nodes, &task, index(node), 0);
        let left = parts.unwrap_or(task.count);
        let mut first = task.first;
        for (side, count) in [left, task.count - left].into_iter().enumerate() {
            if count > 0 {
                let members = order.get(first..first + count).unwrap_or_default();
                tasks.push(Task {
                    first,
                    count,
                    bounds: members.iter().fold(Aabb::EMPTY, |b, &i| b.union(of(i))),
                    depth: task.depth + 1,
                    parent: Some((node, side)),
                });
            }
            first += count;
        }
    }
    Hierarchy { nodes, order }
}

fn attach(nodes: &mut [BinaryNode], task: &Task, first: u32, count: u32) {
    if let Some((parent, side)) = task.parent
        && let Some(node) = nodes.get_mut(parent)
    {
        node.low[side] = task.bounds.low;
        node.high[side] = task.bounds.high;
        node.first[side] = first;
        node.count[side] = count;
    }
}

/// Reorders entries into two parts and returns the length of the first; both parts have entries. `None`: they are to be
/// one leaf.
fn split(
    entries: &mut [u32],
    of: &impl Fn(u32) -> Aabb,
    task: &Task,
    leaf: usize,
) -> Option<usize> {
    let half = entries.len() / 2;
    if half == 0 {
        return None;
    }
    let fits = entries.len() <= leaf;
    let middles = entries
        .iter()
        .fold(Aabb::EMPTY, |b, &i| b.with(of(i).middle()));
    let size = middles.high - middles.low;
    let widest = size.max_position();
    if task.depth < COST_DEPTH
        && let Some((cost, axis, cut)) = cheapest(entries, of, middles)
    {
        #[allow(clippy::cast_precision_loss)] // a few entries
        let as_leaf = task.bounds.half_area() * entries.len() as f32;
        if fits && cost + task.bounds.half_area() * SPLIT_COST >= as_leaf {
            return None;
        }
        let mut left = 0;
        for i in 0..entries.len() {
            if of(entries[i]).middle()[axis] < cut {
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
    // by the middle entry of the widest axis
    entries.select_nth_unstable_by(half, |&a, &b| {
        of(a).middle()[widest]
            .total_cmp(&of(b).middle()[widest])
            .then(a.cmp(&b))
    });
    Some(half)
}

/// Cost (areas times entries), axis and place of the cheapest split between bins.
fn cheapest(
    entries: &[u32],
    of: &impl Fn(u32) -> Aabb,
    middles: Aabb,
) -> Option<(f32, usize, f32)> {
    let mut best: Option<(f32, usize, f32)> = None;
    // few entries need few of them
    let used = BINS.min(2 * entries.len());
    for axis in 0..3 {
        let (low, size) = (middles.low[axis], middles.high[axis] - middles.low[axis]);
        if size <= 0.0 {
            continue;
        }
        let mut bins = [(Aabb::EMPTY, 0usize); BINS];
        #[allow(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss
        )]
        let bin_of = |x: f32| (((x - low) / size * used as f32) as usize).min(used - 1);
        for &i in entries {
            let bounds = of(i);
            let bin = &mut bins[bin_of(bounds.middle()[axis])];
            *bin = (bin.0.union(bounds), bin.1 + 1);
        }
        // cost of everything to the right of each cut
        let mut right = [0.0; BINS];
        let (mut bounds, mut count) = (Aabb::EMPTY, 0);
        for i in (1..used).rev() {
            bounds = bounds.union(bins[i].0);
            count += bins[i].1;
            #[allow(clippy::cast_precision_loss)]
            let entries = count as f32;
            right[i] = if count > 0 {
                bounds.half_area() * entries
            } else {
                0.0
            };
        }
        let (mut bounds, mut count) = (Aabb::EMPTY, 0);
        for i in 1..used {
            bounds = bounds.union(bins[i - 1].0);
            count += bins[i - 1].1;
            if count == 0 || count == entries.len() {
                continue;
            }
            #[allow(clippy::cast_precision_loss)]
            let cost = bounds.half_area() * count as f32 + right[i];
            #[allow(clippy::cast_precision_loss)]
            let cut = low + size * i as f32 / used as f32;
            if best.is_none_or(|b| cost < b.0) {
                best = Some((cost, axis, cut));
            }
        }
    }
    best
}

/// The box of a triangle.
pub fn box_of(corners: &[Vec3; 3]) -> Aabb {
    corners.iter().fold(Aabb::EMPTY, |b, &p| b.with(p))
}

/// The triangles of a hierarchy in the order of its leafs.
pub fn ordered(hierarchy: &Hierarchy, corners: &[[Vec3; 3]]) -> Vec<BvhTriangle> {
    let triangle = |&primitive: &u32| {
        let [a, b, c] = *corners.get(primitive as usize)?;
        Some(BvhTriangle {
            a,
            b,
            c,
            primitive,
            part: 0,
            padding: 0,
        })
    };
    hierarchy.order.iter().filter_map(triangle).collect()
}

/// A hierarchy over triangles, with the triangles in the order of its leafs.
#[derive(Clone, Debug)]
pub struct TriangleHierarchy {
    /// Nodes.
    pub nodes: Vec<BvhNode>,
    /// Triangles.
    pub triangles: Vec<BvhTriangle>,
    /// Of all triangles.
    pub bounds: Aabb,
}

/// Builds a hierarchy over triangles given by their corners; `None` if there is none that a ray can hit.
pub fn build_triangles(corners: &[[Vec3; 3]]) -> Option<TriangleHierarchy> {
    let boxes: Vec<Aabb> = corners.iter().map(box_of).collect();
    let hierarchy = build(&boxes, LEAF);
    let triangles = ordered(&hierarchy, corners);
    let bounds = hierarchy.bounds();
    (!triangles.is_empty()).then_some(TriangleHierarchy {
        nodes: widen(&hierarchy),
        triangles,
        bounds,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Depth of the deepest node, and how often each entry occurs in a leaf whose box holds it.
    fn check(boxes: &[Aabb], hierarchy: &Hierarchy) -> u32 {
        let mut seen = vec![0; boxes.len()];
        let mut deepest = 0;
        let mut stack = vec![(0usize, 1u32)];
        while let Some((node, depth)) = stack.pop() {
            deepest = deepest.max(depth);
            let node = hierarchy.nodes[node];
            for side in 0..2 {
                if node.low[side] == ABSENT {
                    continue;
                }
                if node.count[side] == 0 {
                    stack.push((node.first[side] as usize, depth + 1));
                }
                for i in 0..node.count[side] {
                    let entry = hierarchy.order[(node.first[side] + i) as usize] as usize;
                    seen[entry] += 1;
                    assert!(node.low[side].cmple(boxes[entry].low).all());
                    assert!(node.high[side].cmpge(boxes[entry].high).all());
                }
            }
        }
        assert!(seen.iter().all(|&n| n == 1));
        deepest
    }

    #[test]
    fn every_entry_is_in_one_leaf() {
        for n in [1usize, 2, 4, 5, 33, 1000] {
            let boxes: Vec<Aabb> = (0..n)
                .map(|i| {
                    let p = Vec3::new(
                        (i * 37 % 101) as f32,
                        (i * 53 % 89) as f32,
                        (i * 71 % 97) as f32,
                    );
                    Aabb {
                        low: p,
                        high: p + 3.0,
                    }
                })
                .collect();
            check(&boxes, &build(&boxes, LEAF));
        }
        assert!(build(&[], LEAF).nodes.is_empty());
    }

    #[test]
    fn no_arrangement_is_deeper_than_the_stack() {
        // each box twice as far as the last, and all in one place: what splitting by cost likes least
        let spread: Vec<Aabb> = (0..4000)
            .map(|i| {
                let p = Vec3::X * 1.02f32.powi(i);
                Aabb { low: p, high: p }
            })
            .collect();
        assert!(check(&spread, &build(&spread, LEAF)) <= 48);
        let same = vec![
            Aabb {
                low: Vec3::ONE,
                high: Vec3::ONE
            };
            5000
        ];
        assert!(check(&same, &build(&same, LEAF)) <= 48);
    }

    #[test]
    fn what_is_not_finite_is_left_out() {
        let good = [Vec3::ZERO, Vec3::X, Vec3::Y];
        for corner in 0..3 {
            for value in [f32::INFINITY, f32::NEG_INFINITY] {
                let mut far = good;
                far[corner] = Vec3::splat(value);
                assert!(build_triangles(&[far]).is_none(), "{far:?}");
                let found = build_triangles(&[far, good]).unwrap();
                let primitives: Vec<u32> = found.triangles.iter().map(|t| t.primitive).collect();
                assert_eq!(primitives, [1], "{far:?}");
                assert_eq!(found.bounds, box_of(&good), "{far:?}");
            }
        }
    }

    #[test]
    fn a_triangle_without_a_place_does_not_hide_the_one_beside_it() {
        let good = [Vec3::ONE, Vec3::ONE + Vec3::X, Vec3::ONE + Vec3::Y];
        for corner in 0..3 {
            let mut bad = good;
            bad[corner].x = f32::NAN;
            let found = build_triangles(&[bad, good]).unwrap();
            let hits = found.triangles.iter().filter(|t| t.primitive == 1);
            assert_eq!(hits.count(), 1, "{bad:?}");
            assert_eq!(found.bounds, box_of(&good), "{bad:?}");
        }
    }
}
