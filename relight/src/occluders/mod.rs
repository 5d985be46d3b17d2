//! Shadow rays on the CPU: a bounding volume hierarchy over the triangles that stop light, with four children a
//! node and four triangles a leaf, tested four at a time.
//!
//! Source: Möller and Trumbore 1997 for triangles, the slab test for boxes, Dammertz et al. 2008 for four-wide
//! hierarchies.

mod of_world;
#[cfg(test)]
mod tests;

use crate::world::Holes;
use glam::{Vec2, Vec3, Vec4};
use std::sync::Arc;
use support::Aabb;
use support::bvh::{Hierarchy, LeafRule};
use support::simd4::{Four, WIDE, at, cross, dot, four, lanes, splat, sub};
use support::slice;

/// A leaf tests up to four triangles at once: fewer cost the same.
const LEAF_RULE: LeafRule = LeafRule {
    most: WIDE,
    split_cost: f32::MAX,
};

/// Padding of boxes: relative to their coordinates, and at least this, id units. Hits of rays along a face lie inside.
const PAD: f32 = 1e-6;

/// Entries of the traversal stack without a heap allocation: enough for most maps.
const STACK: usize = 48;

/// Set in references to leaves; the other bits are the index.
const LEAF: u32 = 1 << 31;

/// Nearest hit of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// Distance in lengths of the ray's direction.
    pub t: f32,
    /// Whether it is sky.
    pub sky: bool,
    /// Whether the ray met the front (maps wind fronts clockwise).
    pub front: bool,
    /// What the triangle was tagged with.
    pub tag: u32,
    /// Unit normal of its front.
    pub normal: Vec3,
}

/// Properties of a triangle.
#[derive(Clone, Copy)]
struct Kind {
    sky: bool,
    tag: u32,
    /// Index of its [`CutOut`]; `u32::MAX` for triangles without holes.
    cut_out: u32,
}

/// A triangle and its properties.
type Triangle = ([Vec3; 3], Kind);

/// A triangle of a material with holes.
pub(crate) struct CutOut {
    /// Texture coordinates of its corners.
    pub st: [Vec2; 3],
    /// Where its material is there.
    pub holes: Arc<Holes>,
}

/// Bounds of a node's children.
struct Node {
    /// Their least and their largest coordinates, an axis at a time.
    planes: [[Vec4; 2]; 3],
    /// Nodes, or leaves (with [`LEAF`]).
    children: [u32; WIDE],
    /// Which of them are there, a bit for each.
    there: u32,
}

/// Up to four triangles; empty lanes have no area and are never hit.
struct Leaf {
    a: Four,
    e1: Four,
    e2: Four,
    kinds: [Kind; WIDE],
}

/// Triangles that stop light, in a bounding volume hierarchy.
pub(crate) struct Occluders {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    cut_outs: Vec<CutOut>,
}

/// Bound on reciprocals of ray directions: finite operands give a number, not NaN, for axis-parallel rays.
const STEEPEST: Vec3 = Vec3::splat(1e30);

/// A ray in four equal lanes.
struct Ray {
    from: Four,
    direction: Four,
    inverse: Four,
    /// For each axis, which of a box's planes it meets first.
    first: [usize; 3],
}

impl Ray {
    fn new(from: Vec3, direction: Vec3) -> Ray {
        let inverse = direction.recip().clamp(-STEEPEST, STEEPEST);
        Ray {
            from: splat(from),
            direction: splat(direction),
            inverse: splat(inverse),
            first: inverse.to_array().map(|i| usize::from(i < 0.0)),
        }
    }
}

/// Intersections of a ray with a leaf's triangles.
struct LeafHits {
    /// Those of the triangles that it meets, a bit for each.
    mask: u32,
    t: Vec4,
    u: Vec4,
    v: Vec4,
    determinant: Vec4,
}

impl Occluders {
    /// Builds the hierarchy from (corners, is sky, tag).
    pub fn new(input: impl Iterator<Item = ([Vec3; 3], bool, u32)>) -> Occluders {
        let triangles: Vec<Triangle> = input
            .filter(|(corners, ..)| corners.iter().all(|c| c.is_finite()))
            .map(|(corners, sky, tag)| {
                let cut_out = u32::MAX;
                (corners, Kind { sky, tag, cut_out })
            })
            .collect();
        let boxes: Vec<Aabb> = triangles.iter().map(padded_box).collect();
        let hierarchy = Hierarchy::new(&boxes, LEAF_RULE);
        let mut occluders = Occluders {
            nodes: Vec::new(),
            leaves: Vec::new(),
            cut_outs: Vec::new(),
        };
        if !hierarchy.is_empty() {
            occluders.add(&hierarchy, 0, &triangles);
        }
        occluders
    }

    /// Adds a node of the hierarchy in its wide form, and all below it; returns its index.
    fn add(&mut self, hierarchy: &Hierarchy, node: u32, triangles: &[Triangle]) -> u32 {
        let children = hierarchy.wide_children(node as usize, WIDE);
        let mins = four(children.iter().map(|c| c.bounds.mins));
        let maxs = four(children.iter().map(|c| c.bounds.maxs));
        let mut references = [0; WIDE];
        let index = self.nodes.len();
        self.nodes.push(Node {
            planes: [0, 1, 2].map(|k| [mins[k], maxs[k]]),
            children: references,
            there: (1 << children.len()) - 1,
        });
        for (reference, child) in references.iter_mut().zip(children.iter()) {
            *reference = if child.is_node() {
                self.add(hierarchy, child.first, triangles)
            } else {
                let entries = hierarchy.entries(child).iter();
                let entries = entries.filter_map(|&entry| triangles.get(entry as usize));
                self.leaves.push(Leaf::new(&entries.collect::<Vec<_>>()));
                (self.leaves.len() - 1) as u32 | LEAF
            };
        }
        if let Some(node) = self.nodes.get_mut(index) {
            node.children = references;
        }
        index as u32
    }

    /// Adds holes: `cut_out` returns those of a triangle's tag.
    pub fn cut(mut self, cut_out: impl Fn(u32) -> Option<CutOut>) -> Occluders {
        let kinds = self.leaves.iter_mut().flat_map(|leaf| &mut leaf.kinds);
        for kind in kinds.filter(|kind| !kind.sky) {
            if let Some(found) = cut_out(kind.tag) {
                kind.cut_out = self.cut_outs.len() as u32;
                self.cut_outs.push(found);
            }
        }
        self
    }

    /// A triangle's holes, if it has any, and whether the hit is in one.
    fn holes(&self, kind: Kind, hits: &LeafHits, lane: usize) -> Option<(&CutOut, bool)> {
        let cut_out = self.cut_outs.get(kind.cut_out as usize)?;
        let [a, b, c] = cut_out.st;
        let st = a + (b - a) * hits.u[lane] + (c - a) * hits.v[lane];
        Some((cut_out, !cut_out.holes.is_solid(st)))
    }

    /// The hit of a leaf's triangle, unless it is in a hole. Two-sided materials have two fronts.
    fn hit(&self, leaf: &Leaf, hits: &LeafHits, lane: usize) -> Option<Hit> {
        let kind = *leaf.kinds.get(lane)?;
        // The determinant is positive against the counter-clockwise side.
        let mut front = hits.determinant[lane] < 0.0;
        // Corners are clockwise: the front is the opposite side.
        let mut normal = at(&leaf.e2, lane)
            .cross(at(&leaf.e1, lane))
            .normalize_or_zero();
        if let Some((cut_out, hole)) = self.holes(kind, hits, lane) {
            if hole {
                return None;
            }
            if cut_out.holes.two_sided && !front {
                (front, normal) = (true, -normal);
            }
        }
        Some(Hit {
            t: hits.t[lane],
            sky: kind.sky,
            front,
            tag: kind.tag,
            normal,
        })
    }

    /// Whether a leaf stops a ray.
    fn blocks(&self, leaf: u32, ray: &Ray, through_sky: bool) -> bool {
        let Some(leaf) = slice::get(&self.leaves, leaf as usize) else {
            return false;
        };
        let hits = leaf.intersect(ray, SHORT);
        lanes(hits.mask).any(|lane| {
            let blocks = |kind: &Kind| {
                let hole = self.holes(*kind, &hits, lane);
                !(through_sky && kind.sky || hole.is_some_and(|(_, hole)| hole))
            };
            leaf.kinds.get(lane).is_some_and(blocks)
        })
    }

    /// Whether any triangle is sky.
    pub fn any_sky(&self) -> bool {
        let mut kinds = self.leaves.iter().flat_map(|leaf| &leaf.kinds);
        kinds.any(|kind| kind.sky)
    }

    /// Whether a segment is blocked. `through_sky`: sky does not block.
    pub fn blocked(&self, from: Vec3, to: Vec3, through_sky: bool) -> bool {
        let ray = Ray::new(from, to - from);
        self.blocking_leaf(&ray, through_sky).is_some()
    }

    /// [`blocked`](Self::blocked) with sky blocking; `last`, the occluder of an earlier ray, is tested first: rays
    /// between similar points are often stopped by the same triangle.
    pub fn blocked_hinted(&self, from: Vec3, to: Vec3, last: &mut Option<u32>) -> bool {
        let ray = Ray::new(from, to - from);
        if last.is_some_and(|leaf| self.blocks(leaf, &ray, false)) {
            return true;
        }
        let blocking_leaf = self.blocking_leaf(&ray, false);
        *last = blocking_leaf.or(*last);
        blocking_leaf.is_some()
    }

    /// Any leaf that stops a ray, not necessarily the nearest.
    fn blocking_leaf(&self, ray: &Ray, through_sky: bool) -> Option<u32> {
        let mut stack = [0; STACK];
        let mut depth = 0;
        let mut more = Vec::new();
        let mut next = (!self.nodes.is_empty()).then_some(0);
        while let Some(at) = next {
            if at & LEAF == 0 {
                let node = slice::get(&self.nodes, at as usize)?;
                let (mask, _) = node.enters(ray, SHORT);
                for lane in lanes(mask) {
                    match stack.get_mut(depth) {
                        Some(slot) => {
                            *slot = node.children[lane];
                            depth += 1;
                        }
                        None => more.push(node.children[lane]),
                    }
                }
            } else if self.blocks(at & !LEAF, ray, through_sky) {
                return Some(at & !LEAF);
            }
            next = more.pop().or_else(|| {
                depth = depth.checked_sub(1)?;
                stack.get(depth).copied()
            });
        }
        None
    }

    /// The nearest hit before `limit` lengths of `ray`. Of hits at the same distance a front comes before a back, then
    /// the lowest tag: the result does not depend on the hierarchy.
    pub fn nearest(&self, from: Vec3, ray: Vec3, limit: f32) -> Option<Hit> {
        let ray = Ray::new(from, ray);
        let mut nearest: Option<Hit> = None;
        self.walk(&ray, limit, |index, limit| {
            let Some(leaf) = slice::get(&self.leaves, index as usize) else {
                return false;
            };
            let hits = leaf.intersect(&ray, limit.next_up());
            for hit in lanes(hits.mask).filter_map(|lane| self.hit(leaf, &hits, lane)) {
                let rank = |hit: &Hit| (hit.t, !hit.front, hit.tag);
                let is_nearer = match &nearest {
                    Some(nearest) => rank(&hit) < rank(nearest),
                    None => hit.t < *limit,
                };
                if is_nearer {
                    *limit = hit.t;
                    nearest = Some(hit);
                }
            }
            false
        });
        nearest
    }

    /// Visits leaves along a ray before `limit`, roughly front to back, until `leaf` returns true; returns whether
    /// it did. `leaf` may lower the limit.
    fn walk(&self, ray: &Ray, mut limit: f32, mut leaf: impl FnMut(u32, &mut f32) -> bool) -> bool {
        let mut stack = Stack::new();
        let mut next = (!self.nodes.is_empty()).then_some(0);
        while let Some(at) = next.take().or_else(|| stack.pop(limit * BEYOND)) {
            if at & LEAF != 0 {
                if leaf(at & !LEAF, &mut limit) {
                    return true;
                }
                continue;
            }
            let Some(node) = slice::get(&self.nodes, at as usize) else {
                continue;
            };
            let (mask, near) = node.enters(ray, limit * BEYOND);
            let near = near.to_array();
            let from = stack.depth;
            for lane in lanes(mask) {
                stack.push(node.children[lane], near[lane], from);
            }
        }
        false
    }
}

/// Factor of a limit up to which boxes are entered: distances of boxes and of triangles are rounded differently.
const BEYOND: f32 = 1.00001;

/// Part of a segment that is tested: at its end the target itself would be hit.
const SHORT: f32 = 0.9999;

/// Traversal stack.
struct Stack {
    /// References, and where on the ray their boxes begin.
    entries: [(u32, f32); STACK],
    depth: usize,
    /// What does not fit.
    more: Vec<(u32, f32)>,
}

impl Stack {
    fn new() -> Stack {
        Stack {
            entries: [(0, 0.0); STACK],
            depth: 0,
            more: Vec::new(),
        }
    }

    /// Pushes a child. Of the entries above `from`, which are of its node, the nearest stays on top.
    fn push(&mut self, reference: u32, near: f32, from: usize) {
        let Some(slot) = self.entries.get_mut(self.depth) else {
            self.more.push((reference, near));
            return;
        };
        *slot = (reference, near);
        let mut at = self.depth;
        self.depth += 1;
        while at > from && self.entries[at - 1].1 < near {
            self.entries.swap(at - 1, at);
            at -= 1;
        }
    }

    /// Pops the next entry that begins before the limit.
    fn pop(&mut self, limit: f32) -> Option<u32> {
        loop {
            let (reference, near) = match self.more.pop() {
                Some(entry) => entry,
                None => {
                    self.depth = self.depth.checked_sub(1)?;
                    *self.entries.get(self.depth)?
                }
            };
            if near <= limit {
                return Some(reference);
            }
        }
    }
}

impl Node {
    /// Children whose boxes a ray enters before `limit`, one bit each, and the entry distances.
    fn enters(&self, ray: &Ray, limit: f32) -> (u32, Vec4) {
        let mut near = Vec4::ZERO;
        let mut far = Vec4::splat(limit);
        for k in 0..3 {
            let first = ray.first[k] & 1;
            let planes = &self.planes[k];
            near = near.max((planes[first] - ray.from[k]) * ray.inverse[k]);
            far = far.min((planes[1 - first] - ray.from[k]) * ray.inverse[k]);
        }
        (near.cmple(far).bitmask() & self.there, near)
    }
}

/// Padded box of a triangle as the intersection test computes its corners: one corner plus edges.
fn padded_box(([a, b, c], _): &Triangle) -> Aabb {
    let bounds = Aabb::of([*a, *a + (*b - *a), *a + (*c - *a)]);
    let pad = bounds.mins.abs().max(bounds.maxs.abs()) * PAD;
    bounds.grown(pad.max(Vec3::splat(PAD)))
}

impl Leaf {
    fn new(triangles: &[&Triangle]) -> Leaf {
        let none = Kind {
            sky: false,
            tag: u32::MAX,
            cut_out: u32::MAX,
        };
        let kind = |i: usize| triangles.get(i).map_or(none, |(_, kind)| *kind);
        let corners = || triangles.iter().map(|(corners, _)| *corners);
        Leaf {
            a: four(corners().map(|[a, ..]| a)),
            e1: four(corners().map(|[a, b, _]| b - a)),
            e2: four(corners().map(|[a, _, c]| c - a)),
            kinds: [kind(0), kind(1), kind(2), kind(3)],
        }
    }

    /// Intersections with the triangles, from either side.
    fn intersect(&self, ray: &Ray, limit: f32) -> LeafHits {
        let p = cross(&ray.direction, &self.e2);
        let determinant = dot(&self.e1, &p);
        let inverse = 1.0 / determinant;
        let s = sub(&ray.from, &self.a);
        let u = dot(&s, &p) * inverse;
        let q = cross(&s, &self.e1);
        let v = dot(&ray.direction, &q) * inverse;
        let t = dot(&self.e2, &q) * inverse;
        let inside = u.cmpge(Vec4::ZERO)
            & u.cmple(Vec4::ONE)
            & v.cmpge(Vec4::ZERO)
            & (u + v).cmple(Vec4::ONE)
            & t.cmpgt(Vec4::splat(1e-5))
            & t.cmplt(Vec4::splat(limit))
            & determinant.cmpne(Vec4::ZERO);
        LeafHits {
            mask: inside.bitmask(),
            t,
            u,
            v,
            determinant,
        }
    }
}
