//! The form in which rays walk our hierarchies: up to four children to a node, their boxes rounded outwards to a grid of
//! the node's own, so that a node is 64 bytes and a walk takes half as many steps as in a binary hierarchy (after Ylitie,
//! Karras and Laine, Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs, HPG 2017; there with eight
//! children, here with fewer, because a walk without hardware for it tests them all).

use shaders::trace_types::BvhNode;
use shaders::trace_types::constants::{BVH_COUNT_SHIFT, BVH_FIRST, BVH_LEAF, BVH_NONE, BVH_STACK};

use super::bvh::{Aabb, Hierarchy};

/// Children of a node.
const WIDTH: usize = 4;
/// Steps of a node's grid that its children span; the others are margins.
const STEPS: f32 = 252.0;
/// Part of a coordinate that a step is at least: a few times what a 32-bit float can tell apart.
const FINEST: f32 = 1.0e-6;
/// Part of a step that boxes are widened by before they are rounded outwards, for the shader's own rounding.
const MARGIN: f32 = 0.01;

/// A child: of a binary node, and of the wide node to be.
#[derive(Clone, Copy)]
struct Child {
    bounds: Aabb,
    first: u32,
    /// 0: a node.
    count: u32,
}

/// The children of a wide node, without memory of their own: animated models are widened in each frame.
struct Children {
    list: [Child; WIDTH],
    count: usize,
}

impl Children {
    /// Those of a binary node, of which the largest are replaced by their own until there are `most`.
    fn of(hierarchy: &Hierarchy, node: usize, most: usize) -> Self {
        let none = Child {
            bounds: Aabb::EMPTY,
            first: 0,
            count: 0,
        };
        let mut found = Self {
            list: [none; WIDTH],
            count: 0,
        };
        found.extend(children(hierarchy, node));
        while found.count < most.min(WIDTH) {
            let area = |c: &Child| c.bounds.half_area();
            let nodes = (found.as_slice().iter().enumerate()).filter(|(_, c)| c.count == 0);
            let Some((largest, _)) = nodes.max_by(|a, b| area(a.1).total_cmp(&area(b.1))) else {
                break;
            };
            let opened = found.list[largest];
            found.count -= 1;
            found.list[largest] = found.list[found.count];
            found.extend(children(hierarchy, opened.first as usize));
        }
        found
    }

    fn extend(&mut self, children: impl Iterator<Item = Child>) {
        for child in children {
            if let Some(slot) = self.list.get_mut(self.count) {
                *slot = child;
                self.count += 1;
            }
        }
    }

    fn as_slice(&self) -> &[Child] {
        self.list.get(..self.count).unwrap_or_default()
    }
}

/// A node to be made.
struct Task {
    /// Binary node whose children it begins with.
    node: usize,
    /// Index of the wide node.
    index: usize,
    /// Entries that a walk from here on may keep for later.
    room: u32,
}

/// The wide form of a hierarchy: entries keep their places, nodes do not. Empty for an empty one.
pub fn widen(hierarchy: &Hierarchy) -> Vec<BvhNode> {
    if hierarchy.nodes.is_empty() {
        return Vec::new();
    }
    let heights = heights(hierarchy);
    let height = |node: usize| heights.get(node).copied().unwrap_or(0);
    let mut wide: Vec<BvhNode> = vec![BvhNode::default()];
    let mut tasks = vec![Task {
        node: 0,
        index: 0,
        room: BVH_STACK,
    }];
    while let Some(task) = tasks.pop() {
        // a walk keeps all children but one, and must have room for one more on each level below
        let spare = task.room.saturating_sub(height(task.node)) as usize;
        let children = Children::of(hierarchy, task.node, WIDTH.min(spare + 2));
        let children = children.as_slice();
        let mut node = quantize(children);
        let kept = u32::try_from(children.len().saturating_sub(1)).unwrap_or(0);
        for (child, slot) in children.iter().zip(&mut node.children) {
            *slot = if child.count > 0 {
                BVH_LEAF | (child.count - 1) << BVH_COUNT_SHIFT | child.first & BVH_FIRST
            } else {
                let index = wide.len();
                wide.push(BvhNode::default());
                tasks.push(Task {
                    node: child.first as usize,
                    index,
                    room: task.room.saturating_sub(kept),
                });
                u32::try_from(index).unwrap_or(BVH_NONE)
            };
        }
        if let Some(slot) = wide.get_mut(task.index) {
            *slot = node;
        }
    }
    wide
}

/// Levels of nodes below each node, itself included.
fn heights(hierarchy: &Hierarchy) -> Vec<u32> {
    let mut heights = vec![1u32; hierarchy.nodes.len()];
    // children come behind their parents
    for index in (0..hierarchy.nodes.len()).rev() {
        let below = children(hierarchy, index)
            .filter(|c| c.count == 0)
            .filter_map(|c| heights.get(c.first as usize))
            .max();
        let height = 1 + below.copied().unwrap_or(0);
        if let Some(slot) = heights.get_mut(index) {
            *slot = height;
        }
    }
    heights
}

fn children(hierarchy: &Hierarchy, node: usize) -> impl Iterator<Item = Child> + '_ {
    let node = hierarchy.nodes.get(node);
    (0..2).filter_map(move |side| {
        let node = node?;
        Some(Child {
            bounds: node.child(side)?,
            first: *node.first.get(side)?,
            count: *node.count.get(side)?,
        })
    })
}

/// The grid of a node and its children's boxes on it.
fn quantize(children: &[Child]) -> BvhNode {
    let bounds = (children.iter()).fold(Aabb::EMPTY, |b, c| b.union(c.bounds));
    let mut node = BvhNode {
        children: [BVH_NONE; WIDTH],
        ..BvhNode::default()
    };
    for axis in 0..3 {
        let (low, high) = (bounds.low[axis], bounds.high[axis]);
        let finest = low.abs().max(high.abs()).max(1.0) * FINEST;
        let step = ((high - low) / STEPS).max(finest);
        let origin = low - step;
        node.origin[axis] = origin;
        node.step[axis] = step;
        let steps = 1.0 / step;
        for (i, child) in children.iter().take(WIDTH).enumerate() {
            let place = |x: f32| (x - origin) * steps;
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            // 0 to 255, and none where it is no number
            let floor = |x: f32| u32::from(x as u8);
            let low = floor(place(child.bounds.low[axis]) - MARGIN);
            // what lies on a step gets one more than it needs
            let high = (floor(place(child.bounds.high[axis]) + MARGIN) + 1).min(255);
            node.low[axis] |= low << (8 * i);
            node.high[axis] |= high << (8 * i);
        }
    }
    node
}

#[cfg(test)]
mod tests {
    use glam::Vec3;
    use testkit::Random;

    use super::super::bvh::{LEAF, build, build_triangles};
    use super::*;

    fn boxes(seed: u64, count: usize, spread: f32, size: f32) -> Vec<Aabb> {
        let mut random = Random::new(seed);
        let mut point = |scale: f32| random.signed_point() * scale;
        (0..count)
            .map(|_| {
                let low = point(spread) + Vec3::new(300.0, -8000.0, 0.0);
                let high = low + point(size).abs();
                Aabb { low, high }
            })
            .collect()
    }

    fn child_box(node: &BvhNode, child: usize) -> Aabb {
        let side = |bytes: [u32; 3]| {
            let q = bytes.map(|b| ((b >> (8 * child)) & 255) as f32);
            node.origin + Vec3::from(q) * node.step
        };
        Aabb {
            low: side(node.low),
            high: side(node.high),
        }
    }

    /// Walks everything below a node; what a walk that keeps all children but one has kept at most.
    fn check(
        wide: &[BvhNode],
        order: &[u32],
        boxes: &[Aabb],
        node: usize,
        seen: &mut [u32],
    ) -> u32 {
        let node = &wide[node];
        let used: Vec<usize> = (0..WIDTH)
            .filter(|&c| node.children[c] != BVH_NONE)
            .collect();
        let mut deepest = 0;
        for &child in &used {
            let around = child_box(node, child);
            let word = node.children[child];
            if word & BVH_LEAF == 0 {
                let below = &wide[word as usize];
                for c in 0..WIDTH {
                    if below.children[c] != BVH_NONE {
                        // each is rounded on its own grid
                        let part = child_box(below, c);
                        let slack = below.step * 2.0 + 0.01;
                        assert!((part.low + slack).cmpge(around.low).all());
                        assert!((part.high - slack).cmple(around.high).all());
                    }
                }
                deepest = deepest.max(check(wide, order, boxes, word as usize, seen));
            } else {
                let first = (word & BVH_FIRST) as usize;
                let count = (word >> BVH_COUNT_SHIFT & 7) as usize + 1;
                for &entry in &order[first..first + count] {
                    seen[entry as usize] += 1;
                    assert!(around.low.cmple(boxes[entry as usize].low).all());
                    assert!(around.high.cmpge(boxes[entry as usize].high).all());
                }
            }
        }
        deepest + used.len() as u32 - 1
    }

    #[test]
    fn every_entry_lies_in_the_box_of_its_leaf() {
        for (seed, count, spread, size) in [
            (1, 1, 100.0, 10.0),
            (2, 2, 100.0, 0.0),
            (3, 5, 1000.0, 1.0),
            (4, 1000, 4000.0, 30.0),
            (5, 3000, 0.001, 0.001),
            (6, 300, 60000.0, 60000.0),
        ] {
            let boxes = boxes(seed, count, spread, size);
            for leaf in [1, LEAF] {
                let hierarchy = build(&boxes, leaf);
                let wide = widen(&hierarchy);
                let mut seen = vec![0; boxes.len()];
                let kept = check(&wide, &hierarchy.order, &boxes, 0, &mut seen);
                assert!(kept <= BVH_STACK, "{kept}");
                assert!(seen.iter().all(|&n| n == 1));
            }
        }
        assert!(widen(&build(&[], 1)).is_empty());
    }

    #[test]
    fn a_chain_of_nodes_needs_no_more_than_the_stack() {
        // each box twice as far as the last: what makes the deepest hierarchies
        let spread: Vec<Aabb> = (0..4000)
            .map(|i| {
                let p = Vec3::X * 1.02f32.powi(i);
                Aabb { low: p, high: p }
            })
            .collect();
        let hierarchy = build(&spread, 1);
        let mut seen = vec![0; spread.len()];
        let kept = check(&widen(&hierarchy), &hierarchy.order, &spread, 0, &mut seen);
        assert!(kept <= BVH_STACK, "{kept}");
    }

    /// Distance to a triangle (Moller and Trumbore, 1997).
    fn hit(origin: Vec3, direction: Vec3, t: &[Vec3; 3]) -> Option<f32> {
        let (ab, ac) = (t[1] - t[0], t[2] - t[0]);
        let p = direction.cross(ac);
        let inverse = ab.dot(p).recip();
        let s = origin - t[0];
        let u = s.dot(p) * inverse;
        let q = s.cross(ab);
        let v = direction.dot(q) * inverse;
        let distance = ac.dot(q) * inverse;
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some(distance)
    }

    fn walk(
        hierarchy: &Hierarchy,
        corners: &[[Vec3; 3]],
        origin: Vec3,
        direction: Vec3,
    ) -> Option<f32> {
        let wide = widen(hierarchy);
        let mut stack: Vec<u32> = if wide.is_empty() { vec![] } else { vec![0] };
        let mut nearest: Option<f32> = None;
        while let Some(word) = stack.pop() {
            if word & BVH_LEAF != 0 {
                let first = (word & BVH_FIRST) as usize;
                let count = (word >> BVH_COUNT_SHIFT & 7) as usize + 1;
                for &entry in &hierarchy.order[first..first + count] {
                    let found = hit(origin, direction, &corners[entry as usize]);
                    nearest = [nearest, found].into_iter().flatten().reduce(f32::min);
                }
                continue;
            }
            let node = &wide[word as usize];
            for child in 0..WIDTH {
                if node.children[child] == BVH_NONE {
                    continue;
                }
                let around = child_box(node, child);
                let a = (around.low - origin) / direction;
                let b = (around.high - origin) / direction;
                let enter = a.min(b).max_element().max(0.0);
                if enter <= a.max(b).min_element() {
                    stack.push(node.children[child]);
                }
            }
        }
        nearest
    }

    #[test]
    fn a_fitted_hierarchy_is_hit_where_a_fresh_one_is() {
        let mut random = Random::new(11);
        for round in 0..20 {
            let count = 1 + round * 13;
            let mut point = |scale: f32| random.signed_point() * scale;
            let mut corners: Vec<[Vec3; 3]> = (0..count)
                .map(|_| {
                    let middle = point(50.0);
                    [0; 3].map(|_| middle + point(12.0))
                })
                .collect();
            let boxes = |corners: &[[Vec3; 3]]| -> Vec<Aabb> {
                corners.iter().map(super::super::bvh::box_of).collect()
            };
            let mut fitted = build(&boxes(&corners), LEAF);
            for triangle in &mut corners {
                let moved = point(30.0);
                *triangle = triangle.map(|p| p * 1.3 + moved);
            }
            let bounds = fitted.refit(&boxes(&corners));
            let fresh = build(&boxes(&corners), LEAF);
            assert_eq!(bounds, fresh.bounds());
            assert!(fitted.cost() >= fresh.cost() * 0.8);
            let mut hits = 0;
            for _ in 0..200 {
                let (origin, to) = (point(120.0), point(30.0));
                let direction = (to - origin).normalize();
                let all = (corners.iter()).filter_map(|t| hit(origin, direction, t));
                let nearest = all.reduce(f32::min);
                assert_eq!(walk(&fitted, &corners, origin, direction), nearest);
                assert_eq!(walk(&fresh, &corners, origin, direction), nearest);
                hits += usize::from(nearest.is_some());
            }
            assert!(count < 20 || hits > 5, "{hits}");
        }
        assert!(build_triangles(&[]).is_none());
    }
}
