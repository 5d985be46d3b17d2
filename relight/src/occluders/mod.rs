//! Shadow rays on the CPU: a bounding volume hierarchy over the triangles that stop light, four children to a node and four
//! triangles to a leaf, so that a ray meets four at a time.
//!
//! Source: Möller and Trumbore 1997 for the triangle, the slab test for boxes, Dammertz et al. 2008 for four at a time.

mod build;
mod of_world;
#[cfg(test)]
mod tests;

use crate::world::Holes;
use build::Binary;
use glam::{Vec2, Vec3, Vec4};
use std::sync::Arc;
use support::simd4::{Four, WIDE, at, cross, dot, four, lanes, splat, sub};

/// Nodes of a walk that are kept without taking from the heap: more than maps need as a rule.
const STACK: usize = 48;

/// Set in references to leaves; the rest of them is the leaf's index.
const LEAF: u32 = 1 << 31;

/// What a ray found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Hit {
    /// Distance along the ray, in lengths of its direction.
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

/// What is known of a triangle beside its shape.
#[derive(Clone, Copy)]
struct Kind {
    sky: bool,
    tag: u32,
    /// Index of its [`CutOut`]; `u32::MAX` for triangles without holes.
    cut_out: u32,
}

/// A triangle with holes.
pub(crate) struct CutOut {
    /// Texture coordinates of its corners.
    pub st: [Vec2; 3],
    /// Where its material is there.
    pub holes: Arc<Holes>,
}

/// The boxes of a node's children.
struct Node {
    /// Their least and their largest coordinates, an axis at a time.
    planes: [[Vec4; 2]; 3],
    /// Nodes, or leaves (with [`LEAF`]).
    children: [u32; WIDE],
    /// Which of them are there, a bit for each.
    there: u32,
}

/// Triangles. Where there are fewer than four the rest have no area, so that nothing meets them.
struct Leaf {
    a: Four,
    e1: Four,
    e2: Four,
    kinds: [Kind; WIDE],
}

/// Triangles that stop light, sorted into boxes.
pub(crate) struct Occluders {
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
    cut_outs: Vec<CutOut>,
}

/// Largest part of a reciprocal: what is finite gives a number, not NaN, for a ray along an axis.
const STEEPEST: Vec3 = Vec3::splat(1e30);

/// A ray as four alike.
struct Ray {
    from: Four,
    way: Four,
    inverse: Four,
    /// For each axis, which of a box's planes it meets first.
    first: [usize; 3],
}

impl Ray {
    fn new(from: Vec3, way: Vec3) -> Ray {
        let inverse = way.recip().clamp(-STEEPEST, STEEPEST);
        Ray {
            from: splat(from),
            way: splat(way),
            inverse: splat(inverse),
            first: inverse.to_array().map(|i| usize::from(i < 0.0)),
        }
    }
}

/// Where a ray meets the planes of a leaf's triangles.
struct Meeting {
    /// Those of the triangles that it meets, a bit for each.
    mask: u32,
    t: Vec4,
    u: Vec4,
    v: Vec4,
    determinant: Vec4,
}

impl Occluders {
    /// Builds the tree over (corners, is sky, tag).
    pub fn new(input: impl Iterator<Item = ([Vec3; 3], bool, u32)>) -> Occluders {
        let kept: Vec<([Vec3; 3], Kind)> = input
            .filter(|(corners, ..)| corners.iter().all(|c| c.is_finite()))
            .map(|(corners, sky, tag)| {
                let cut_out = u32::MAX;
                (corners, Kind { sky, tag, cut_out })
            })
            .collect();
        let mut occluders = Occluders {
            nodes: Vec::new(),
            leaves: Vec::new(),
            cut_outs: Vec::new(),
        };
        if let Some(root) = build::build(kept) {
            // The root is a node even if all that there is is a leaf.
            occluders.add(vec![root]);
        }
        occluders
    }

    /// Adds a node with these children, taking up theirs in place of them as long as there is room; its index.
    fn add(&mut self, mut children: Vec<Binary>) -> u32 {
        while children.len() < WIDE {
            let inner = |(_, c): &(usize, &Binary)| c.halves.is_ok();
            let area = |(_, c): &(usize, &Binary)| c.bounds.area();
            let largest = (children.iter().enumerate().filter(inner))
                .max_by(|a, b| area(a).total_cmp(&area(b)))
                .map(|(i, _)| i);
            let Some(largest) = largest else {
                break;
            };
            let taken = children.swap_remove(largest);
            if let Ok(halves) = taken.halves {
                children.extend(*halves);
            }
        }
        let index = self.nodes.len();
        let boxes = || children.iter().map(|c| c.bounds.padded());
        let mins = four(boxes().map(|(mins, _)| mins));
        let maxs = four(boxes().map(|(_, maxs)| maxs));
        self.nodes.push(Node {
            planes: [0, 1, 2].map(|k| [mins[k], maxs[k]]),
            children: [0; WIDE],
            there: (1 << children.len()) - 1,
        });
        for (i, child) in children.into_iter().enumerate() {
            let reference = match child.halves {
                Ok(halves) => self.add((*halves).into()),
                Err(triangles) => {
                    self.leaves.push(Leaf::new(&triangles));
                    (self.leaves.len() - 1) as u32 | LEAF
                }
            };
            if let Some(slot) = self
                .nodes
                .get_mut(index)
                .and_then(|n| n.children.get_mut(i))
            {
                *slot = reference;
            }
        }
        index as u32
    }

    /// Cuts holes: `cut_out` tells of a triangle's tag whether it has some.
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

    /// The triangle's holes, if it has some, and whether one of them is where a ray meets it.
    fn holes(&self, kind: Kind, meeting: &Meeting, lane: usize) -> Option<(&CutOut, bool)> {
        let cut_out = self.cut_outs.get(kind.cut_out as usize)?;
        let [a, b, c] = cut_out.st;
        let st = a + (b - a) * meeting.u[lane] + (c - a) * meeting.v[lane];
        Some((cut_out, !cut_out.holes.is_solid(st)))
    }

    /// What a ray meets of a leaf's triangle, unless it is a hole there. Of what is drawn from both sides both are fronts.
    fn hit(&self, leaf: &Leaf, meeting: &Meeting, lane: usize) -> Option<Hit> {
        let kind = *leaf.kinds.get(lane)?;
        // The determinant is positive against the counter-clockwise side.
        let mut front = meeting.determinant[lane] < 0.0;
        // Clockwise corners: the front is the other way.
        let mut normal = at(&leaf.e2, lane)
            .cross(at(&leaf.e1, lane))
            .normalize_or_zero();
        if let Some((cut_out, hole)) = self.holes(kind, meeting, lane) {
            if hole {
                return None;
            }
            if cut_out.holes.two_sided && !front {
                (front, normal) = (true, -normal);
            }
        }
        Some(Hit {
            t: meeting.t[lane],
            sky: kind.sky,
            front,
            tag: kind.tag,
            normal,
        })
    }

    /// Whether a leaf stops a ray.
    fn stops(&self, leaf: u32, ray: &Ray, through_sky: bool) -> bool {
        let Some(leaf) = self.leaves.get(leaf as usize) else {
            return false;
        };
        let meeting = leaf.meet(ray, SHORT);
        lanes(meeting.mask).any(|lane| {
            let stops = |kind: &Kind| {
                let hole = self.holes(*kind, &meeting, lane);
                !(through_sky && kind.sky || hole.is_some_and(|(_, hole)| hole))
            };
            leaf.kinds.get(lane).is_some_and(stops)
        })
    }

    /// Whether some triangle is sky.
    pub fn any_sky(&self) -> bool {
        let mut kinds = self.leaves.iter().flat_map(|leaf| &leaf.kinds);
        kinds.any(|kind| kind.sky)
    }

    /// Whether something lies on the way. `through_sky`: sky does not count.
    pub fn blocked(&self, from: Vec3, to: Vec3, through_sky: bool) -> bool {
        let ray = Ray::new(from, to - from);
        self.stopper(&ray, through_sky).is_some()
    }

    /// As [`blocked`](Self::blocked) where sky counts; `last` is what stopped an earlier ray: it is asked first, for
    /// rays from about one place to another are often stopped by the same triangle.
    pub fn blocked_hinted(&self, from: Vec3, to: Vec3, last: &mut Option<u32>) -> bool {
        let ray = Ray::new(from, to - from);
        if last.is_some_and(|leaf| self.stops(leaf, &ray, false)) {
            return true;
        }
        let stopper = self.stopper(&ray, false);
        *last = stopper.or(*last);
        stopper.is_some()
    }

    /// A leaf that stops a ray. Which of them is all the same, so that none has to be the nearest.
    fn stopper(&self, ray: &Ray, through_sky: bool) -> Option<u32> {
        let mut stack = [0; STACK];
        let mut depth = 0;
        let mut more = Vec::new();
        let mut next = (!self.nodes.is_empty()).then_some(0);
        while let Some(at) = next {
            if at & LEAF == 0 {
                let node = self.nodes.get(at as usize)?;
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
            } else if self.stops(at & !LEAF, ray, through_sky) {
                return Some(at & !LEAF);
            }
            next = more.pop().or_else(|| {
                depth = depth.checked_sub(1)?;
                stack.get(depth).copied()
            });
        }
        None
    }

    /// The nearest hit before `limit` lengths of `ray`.
    pub fn nearest(&self, from: Vec3, ray: Vec3, limit: f32) -> Option<Hit> {
        let ray = Ray::new(from, ray);
        let mut nearest: Option<Hit> = None;
        self.walk(&ray, limit, |index, limit| {
            let Some(leaf) = self.leaves.get(index as usize) else {
                return false;
            };
            let meeting = leaf.meet(&ray, *limit);
            for lane in lanes(meeting.mask) {
                if meeting.t[lane] < *limit
                    && let Some(hit) = self.hit(leaf, &meeting, lane)
                {
                    *limit = hit.t;
                    nearest = Some(hit);
                }
            }
            false
        });
        nearest
    }

    /// Shows the leaves that a ray comes to before `limit`, near ones first, until `leaf` has seen enough (true) or all;
    /// whether it has. It may lower the limit.
    fn walk(&self, ray: &Ray, mut limit: f32, mut leaf: impl FnMut(u32, &mut f32) -> bool) -> bool {
        let mut stack = Stack::new();
        let mut next = (!self.nodes.is_empty()).then_some(0);
        while let Some(at) = next.take().or_else(|| stack.pop(limit)) {
            if at & LEAF != 0 {
                if leaf(at & !LEAF, &mut limit) {
                    return true;
                }
                continue;
            }
            let Some(node) = self.nodes.get(at as usize) else {
                continue;
            };
            let (mask, near) = node.enters(ray, limit);
            let near = near.to_array();
            let from = stack.depth;
            for lane in lanes(mask) {
                stack.push(node.children[lane], near[lane], from);
            }
        }
        false
    }
}

/// Part of the way to a place beyond which it is the place itself that is met.
const SHORT: f32 = 0.9999;

/// What a walk has still to see.
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

    /// Adds a child. Of those above `from`, which are its node's, the nearest stays on top.
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

    /// The next that begins before the limit.
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
    /// The children whose boxes a ray comes into before `limit`, a bit for each, and where.
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

impl Leaf {
    fn new(triangles: &[([Vec3; 3], Kind)]) -> Leaf {
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

    /// Where a ray meets the triangles, from either side.
    fn meet(&self, ray: &Ray, limit: f32) -> Meeting {
        let p = cross(&ray.way, &self.e2);
        let determinant = dot(&self.e1, &p);
        let inverse = 1.0 / determinant;
        let s = sub(&ray.from, &self.a);
        let u = dot(&s, &p) * inverse;
        let q = cross(&s, &self.e1);
        let v = dot(&ray.way, &q) * inverse;
        let t = dot(&self.e2, &q) * inverse;
        let inside = u.cmpge(Vec4::ZERO)
            & u.cmple(Vec4::ONE)
            & v.cmpge(Vec4::ZERO)
            & (u + v).cmple(Vec4::ONE)
            & t.cmpgt(Vec4::splat(1e-5))
            & t.cmplt(Vec4::splat(limit))
            & determinant.cmpne(Vec4::ZERO);
        Meeting {
            mask: inside.bitmask(),
            t,
            u,
            v,
            determinant,
        }
    }
}
