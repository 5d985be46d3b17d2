//! Our hierarchies on the GPU: up to four children per node, whose boxes are rounded outwards to a grid of the node, so
//! that a node has 64 bytes and a traversal takes half the steps of a binary hierarchy (after Ylitie, Karras and Laine,
//! Efficient Incoherent Ray Traversal on GPUs Through Compressed Wide BVHs, HPG 2017, who use eight children; software
//! traversal tests all children of a node, and four cost less).

use glam::Vec3;
use shaders::trace_types::constants::{BVH_COUNT_SHIFT, BVH_FIRST, BVH_LEAF, BVH_NONE, BVH_STACK};
use shaders::trace_types::{BvhNode, BvhTriangle};
use support::Aabb;
use support::bvh::{Child, Hierarchy, LeafRule, MAX_DEPTH};
use support::simd4::WIDE;

/// Leaf rule for triangles: the box tests of a split cost as much as 0.7 triangle tests.
pub const TRIANGLES: LeafRule = LeafRule {
    most: 4,
    split_cost: 0.7,
};
/// Leaf rule for instances: testing an instance costs more than testing a node.
pub const INSTANCES: LeafRule = LeafRule {
    most: 1,
    split_cost: 0.7,
};

/// A traversal of a binary hierarchy pushes at most one child per level.
const _: () = assert!(MAX_DEPTH <= BVH_STACK);

/// Grid steps that the children of a node span; the other steps of 8 bits are margins.
const STEPS: f32 = 252.0;
/// Least step relative to the coordinate: a few times the relative precision of a 32-bit float.
const FINEST: f32 = 1.0e-6;
/// Part of a step by which boxes grow before they are rounded outwards; covers rounding in the shader.
const MARGIN: f32 = 0.01;

/// A wide node to be made.
struct Task {
    /// Binary node, root of the wide node.
    node: usize,
    /// Index of the wide node.
    index: usize,
    /// Free stack entries of a traversal at this node.
    room: u32,
}

/// Converts a hierarchy to its wide form: entries keep their order, nodes are renumbered. Empty for an empty hierarchy.
pub fn widen(hierarchy: &Hierarchy) -> Vec<BvhNode> {
    if hierarchy.is_empty() {
        return Vec::new();
    }
    let heights = hierarchy.heights();
    let height = |node: usize| heights.get(node).copied().unwrap_or(0);
    let mut wide: Vec<BvhNode> = vec![BvhNode::default()];
    let mut tasks = vec![Task {
        node: 0,
        index: 0,
        room: BVH_STACK,
    }];
    while let Some(task) = tasks.pop() {
        // a traversal pushes all children but one, and needs one more stack entry for each level below
        let spare = task.room.saturating_sub(height(task.node)) as usize;
        let children = hierarchy.wide_children(task.node, spare + 2);
        let mut node = quantize(&children);
        let kept = u32::try_from(children.len().saturating_sub(1)).unwrap_or(0);
        for (child, slot) in children.iter().zip(&mut node.children) {
            *slot = if !child.is_node() {
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

/// Computes the grid of a node and quantizes its children's boxes.
fn quantize(children: &[Child]) -> BvhNode {
    let bounds = (children.iter()).fold(Aabb::EMPTY, |b, c| b.union(c.bounds));
    let mut node = BvhNode {
        children: [BVH_NONE; WIDE],
        ..BvhNode::default()
    };
    for axis in 0..3 {
        let (low, high) = (bounds.mins[axis], bounds.maxs[axis]);
        let finest = low.abs().max(high.abs()).max(1.0) * FINEST;
        let step = ((high - low) / STEPS).max(finest);
        let origin = low - step;
        node.origin[axis] = origin;
        node.step[axis] = step;
        let steps = 1.0 / step;
        for (i, child) in children.iter().take(WIDE).enumerate() {
            let place = |x: f32| (x - origin) * steps;
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            // the cast clamps to 0..=255 and maps NaN to 0
            let floor = |x: f32| u32::from(x as u8);
            let low = floor(place(child.bounds.mins[axis]) - MARGIN);
            // a bound exactly on a step is rounded up one step further
            let high = (floor(place(child.bounds.maxs[axis]) + MARGIN) + 1).min(255);
            node.low[axis] |= low << (8 * i);
            node.high[axis] |= high << (8 * i);
        }
    }
    node
}

/// A triangle of the first geometry.
fn triangle([a, b, c]: [Vec3; 3], primitive: u32) -> BvhTriangle {
    BvhTriangle {
        a,
        b,
        c,
        primitive,
        part: 0,
        padding: 0,
    }
}

/// The triangles of a hierarchy in the order of its leafs.
pub fn ordered(hierarchy: &Hierarchy, corners: &[[Vec3; 3]]) -> Vec<BvhTriangle> {
    let of = |&number: &u32| Some(triangle(*corners.get(number as usize)?, number));
    hierarchy.order().iter().filter_map(of).collect()
}

/// The triangles in their own order.
pub fn unordered(corners: &[[Vec3; 3]]) -> Vec<BvhTriangle> {
    let numbered = (0..).zip(corners);
    numbered.map(|(number, &c)| triangle(c, number)).collect()
}

/// A hierarchy over triangles, with the triangles in leaf order.
#[derive(Clone, Debug)]
pub struct TriangleHierarchy {
    /// Nodes.
    pub nodes: Vec<BvhNode>,
    /// Triangles.
    pub triangles: Vec<BvhTriangle>,
    /// Box of all triangles.
    pub bounds: Aabb,
}

/// Builds a hierarchy over triangles, given by their corners; `None` if no triangle can be hit.
pub fn build_triangles(corners: &[[Vec3; 3]]) -> Option<TriangleHierarchy> {
    let boxes: Vec<Aabb> = corners.iter().map(|&c| Aabb::of(c)).collect();
    let hierarchy = Hierarchy::new(&boxes, TRIANGLES);
    let triangles = ordered(&hierarchy, corners);
    (!triangles.is_empty()).then(|| TriangleHierarchy {
        nodes: widen(&hierarchy),
        triangles,
        bounds: hierarchy.bounds(),
    })
}

#[cfg(test)]
mod tests {
    use testkit::Random;

    use super::*;

    fn boxes(seed: u64, count: usize, spread: f32, size: f32) -> Vec<Aabb> {
        let mut random = Random::new(seed);
        let mut point = |scale: f32| random.signed_point() * scale;
        (0..count)
            .map(|_| {
                let low = point(spread) + Vec3::new(300.0, -8000.0, 0.0);
                let high = low + point(size).abs();
                Aabb::new(low, high)
            })
            .collect()
    }

    fn child_box(node: &BvhNode, child: usize) -> Aabb {
        let side = |bytes: [u32; 3]| {
            let q = bytes.map(|b| ((b >> (8 * child)) & 255) as f32);
            node.origin + Vec3::from(q) * node.step
        };
        Aabb::new(side(node.low), side(node.high))
    }

    /// Checks the subtree of a node; returns the greatest number of stack entries that a traversal needs.
    fn check(
        wide: &[BvhNode],
        order: &[u32],
        boxes: &[Aabb],
        node: usize,
        seen: &mut [u32],
    ) -> u32 {
        let node = &wide[node];
        let used: Vec<usize> = (0..WIDE)
            .filter(|&c| node.children[c] != BVH_NONE)
            .collect();
        let mut deepest = 0;
        for &child in &used {
            let around = child_box(node, child);
            let word = node.children[child];
            if word & BVH_LEAF == 0 {
                let below = &wide[word as usize];
                for c in 0..WIDE {
                    if below.children[c] != BVH_NONE {
                        // each node has its own grid, so boxes are rounded anew at each level
                        let part = child_box(below, c);
                        let slack = below.step * 2.0 + 0.01;
                        assert!((part.mins + slack).cmpge(around.mins).all());
                        assert!((part.maxs - slack).cmple(around.maxs).all());
                    }
                }
                deepest = deepest.max(check(wide, order, boxes, word as usize, seen));
            } else {
                let first = (word & BVH_FIRST) as usize;
                let count = (word >> BVH_COUNT_SHIFT & 7) as usize + 1;
                for &entry in &order[first..first + count] {
                    seen[entry as usize] += 1;
                    assert!(around.mins.cmple(boxes[entry as usize].mins).all());
                    assert!(around.maxs.cmpge(boxes[entry as usize].maxs).all());
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
            for leaf in [INSTANCES, TRIANGLES] {
                let hierarchy = Hierarchy::new(&boxes, leaf);
                let wide = widen(&hierarchy);
                let mut seen = vec![0; boxes.len()];
                let kept = check(&wide, hierarchy.order(), &boxes, 0, &mut seen);
                assert!(kept <= BVH_STACK, "{kept}");
                assert!(seen.iter().all(|&n| n == 1));
            }
        }
        assert!(widen(&Hierarchy::default()).is_empty());
    }

    #[test]
    fn a_chain_of_nodes_needs_no_more_than_the_stack() {
        // each box at twice the distance of the last: the deepest hierarchies
        let spread: Vec<Aabb> = (0..4000)
            .map(|i| {
                let p = Vec3::X * 1.02f32.powi(i);
                Aabb::new(p, p)
            })
            .collect();
        let hierarchy = Hierarchy::new(&spread, INSTANCES);
        let mut seen = vec![0; spread.len()];
        let kept = check(&widen(&hierarchy), hierarchy.order(), &spread, 0, &mut seen);
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
                for &entry in &hierarchy.order()[first..first + count] {
                    let found = hit(origin, direction, &corners[entry as usize]);
                    nearest = [nearest, found].into_iter().flatten().reduce(f32::min);
                }
                continue;
            }
            let node = &wide[word as usize];
            for child in 0..WIDE {
                if node.children[child] == BVH_NONE {
                    continue;
                }
                let around = child_box(node, child);
                let a = (around.mins - origin) / direction;
                let b = (around.maxs - origin) / direction;
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
                corners.iter().map(|&c| Aabb::of(c)).collect()
            };
            let mut fitted = Hierarchy::new(&boxes(&corners), TRIANGLES);
            for triangle in &mut corners {
                let moved = point(30.0);
                *triangle = triangle.map(|p| p * 1.3 + moved);
            }
            let bounds = fitted.refit(&boxes(&corners));
            let fresh = Hierarchy::new(&boxes(&corners), TRIANGLES);
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

    #[test]
    fn non_finite_triangles_are_omitted() {
        let good = [Vec3::ZERO, Vec3::X, Vec3::Y];
        for corner in 0..3 {
            for value in [f32::INFINITY, f32::NEG_INFINITY] {
                let mut far = good;
                far[corner] = Vec3::splat(value);
                assert!(build_triangles(&[far]).is_none(), "{far:?}");
                let found = build_triangles(&[far, good]).unwrap();
                let primitives: Vec<u32> = found.triangles.iter().map(|t| t.primitive).collect();
                assert_eq!(primitives, [1], "{far:?}");
                assert_eq!(found.bounds, Aabb::of(good), "{far:?}");
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
            assert_eq!(found.bounds, Aabb::of(good), "{bad:?}");
        }
    }
}
