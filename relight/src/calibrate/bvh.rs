//! Shadow rays on the CPU: a bounding volume hierarchy over the triangles that stop light.
//!
//! Source: Möller and Trumbore 1997 for the triangle, the slab test for boxes, Wald 2007 for splits by
//! the surface area heuristic over bins along the longest
//! axis.

use crate::world::Holes;
use glam::{Vec2, Vec3, Vec3A};
use std::sync::Arc;

/// Triangles of a leaf.
const LEAF: usize = 4;

/// Depth of the stack of a walk. Halves of halves: 2^64 triangles fit.
const STACK: usize = 96;

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
    /// Place of the triangle in the tree.
    index: u32,
    /// Barycentric coordinates of the second and third corner.
    at: [f32; 2],
}

#[derive(Clone, Copy)]
struct Triangle {
    a: Vec3A,
    e1: Vec3A,
    e2: Vec3A,
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

#[derive(Clone, Copy)]
struct Node {
    mins: Vec3A,
    maxs: Vec3A,
    /// Leaf: first triangle. Inner node: its right child; the left one follows the node.
    first: u32,
    /// Triangles of a leaf; 0 for inner nodes.
    count: u16,
    /// Axis of the split; the left child lies lower on it.
    axis: u16,
}

/// Triangles that stop light, sorted into boxes.
pub(crate) struct Occluders {
    nodes: Vec<Node>,
    triangles: Vec<Triangle>,
    cut_outs: Vec<CutOut>,
}

impl Occluders {
    /// Builds the tree over (corners, is sky, tag).
    pub fn new(input: impl Iterator<Item = ([Vec3; 3], bool, u32)>) -> Occluders {
        let mut triangles: Vec<(Triangle, Vec3A)> = input
            .filter(|(corners, ..)| corners.iter().all(|c| c.is_finite()))
            .map(|(corners, sky, tag)| {
                let [a, b, c] = corners.map(Vec3A::from);
                let triangle = Triangle {
                    a,
                    e1: b - a,
                    e2: c - a,
                    sky,
                    tag,
                    cut_out: u32::MAX,
                };
                (triangle, a.min(b).min(c) + a.max(b).max(c))
            })
            .collect();
        let mut nodes = Vec::with_capacity(triangles.len());
        if !triangles.is_empty() {
            build(&mut nodes, &mut triangles, 0);
        }
        Occluders {
            nodes,
            triangles: triangles.into_iter().map(|(t, _)| t).collect(),
            cut_outs: Vec::new(),
        }
    }

    /// Cuts holes: `cut_out` tells of a triangle's tag whether it has some.
    pub fn cut(mut self, cut_out: impl Fn(u32) -> Option<CutOut>) -> Occluders {
        for triangle in self.triangles.iter_mut().filter(|t| !t.sky) {
            if let Some(found) = cut_out(triangle.tag) {
                triangle.cut_out = self.cut_outs.len() as u32;
                self.cut_outs.push(found);
            }
        }
        self
    }

    /// Where a ray meets a triangle, unless it is a hole there. Of what is drawn from both sides both are fronts.
    fn meet(&self, triangle: &Triangle, from: Vec3A, ray: Vec3A, limit: f32) -> Option<Hit> {
        let mut hit = meet(triangle, from, ray, limit)?;
        if let Some(CutOut { st, holes }) = self.cut_outs.get(triangle.cut_out as usize) {
            let [a, b, c] = *st;
            let [u, v] = hit.at;
            if !holes.is_solid(a + (b - a) * u + (c - a) * v) {
                return None;
            }
            if holes.two_sided && !hit.front {
                hit.front = true;
                hit.normal = -hit.normal;
            }
        }
        Some(hit)
    }

    /// Whether some triangle is sky.
    pub fn any_sky(&self) -> bool {
        self.triangles.iter().any(|t| t.sky)
    }

    /// Whether something lies on the way. `through_sky`: sky does not count.
    pub fn blocked(&self, from: Vec3, to: Vec3, through_sky: bool) -> bool {
        self.walk(from, to - from, 0.9999, true, |sky| !(through_sky && sky))
            .is_some()
    }

    /// As [`blocked`](Self::blocked) where sky counts; `last` is what stopped an earlier ray: it is asked first, for
    /// rays from about one place to another are often stopped by the same triangle.
    pub fn blocked_again(&self, from: Vec3, to: Vec3, last: &mut Option<u32>) -> bool {
        let ray = to - from;
        let known = last.and_then(|index| self.triangles.get(index as usize));
        if known.is_some_and(|t| {
            let hit = self.meet(t, from.into(), ray.into(), 0.9999);
            hit.is_some()
        }) {
            return true;
        }
        match self.walk(from, ray, 0.9999, true, |_| true) {
            Some(hit) => {
                *last = Some(hit.index);
                true
            }
            None => false,
        }
    }

    /// The nearest hit before `limit` lengths of `ray`.
    pub fn nearest(&self, from: Vec3, ray: Vec3, limit: f32) -> Option<Hit> {
        self.walk(from, ray, limit, false, |_| true)
    }

    /// Walks the tree for hits on triangles that count (told whether they are sky): the first one met when `any`
    /// will do, else the nearest.
    fn walk(
        &self,
        from: Vec3,
        ray: Vec3,
        mut limit: f32,
        any: bool,
        counts: impl Fn(bool) -> bool,
    ) -> Option<Hit> {
        let (from, ray) = (Vec3A::from(from), Vec3A::from(ray));
        let inverse = ray.recip();
        let down = ray.cmplt(Vec3A::ZERO).bitmask();
        let mut nearest = None;
        let mut stack = [0u32; STACK];
        let mut depth = 0;
        let mut at = 0u32;
        loop {
            let node = self.nodes.get(at as usize)?;
            if enters(node, from, inverse, limit) {
                if node.count == 0 {
                    let (near, far) = if down >> node.axis & 1 == 0 {
                        (at + 1, node.first)
                    } else {
                        (node.first, at + 1)
                    };
                    if let Some(slot) = stack.get_mut(depth) {
                        *slot = far;
                        depth += 1;
                    }
                    at = near;
                    continue;
                }
                let first = node.first as usize;
                let range = first..first + usize::from(node.count);
                for (triangle, index) in self
                    .triangles
                    .get(range)
                    .unwrap_or_default()
                    .iter()
                    .zip(node.first..)
                {
                    if counts(triangle.sky)
                        && let Some(hit) = self.meet(triangle, from, ray, limit)
                    {
                        let hit = Hit { index, ..hit };
                        if any {
                            return Some(hit);
                        }
                        limit = hit.t;
                        nearest = Some(hit);
                    }
                }
            }
            if depth == 0 {
                return nearest;
            }
            depth -= 1;
            at = stack.get(depth).copied().unwrap_or(0);
        }
    }
}

/// Whether a ray comes into a box before `limit`. NaN (a ray along a face of the box) counts as inside.
fn enters(node: &Node, from: Vec3A, inverse: Vec3A, limit: f32) -> bool {
    let a = (node.mins - from) * inverse;
    let b = (node.maxs - from) * inverse;
    let near = a.min(b).max_element();
    let far = a.max(b).min_element();
    !(near > far || far < 0.0 || near > limit)
}

/// Where a ray meets a triangle, from either side.
fn meet(triangle: &Triangle, from: Vec3A, ray: Vec3A, limit: f32) -> Option<Hit> {
    let p = ray.cross(triangle.e2);
    let determinant = triangle.e1.dot(p);
    if determinant == 0.0 {
        return None;
    }
    let inverse = 1.0 / determinant;
    let s = from - triangle.a;
    let u = s.dot(p) * inverse;
    if !(0.0..=1.0).contains(&u) {
        return None;
    }
    let q = s.cross(triangle.e1);
    let v = ray.dot(q) * inverse;
    let t = triangle.e2.dot(q) * inverse;
    (v >= 0.0 && u + v <= 1.0 && t > 1e-5 && t < limit).then_some(Hit {
        t,
        sky: triangle.sky,
        // The determinant is positive against the counter-clockwise side.
        front: determinant < 0.0,
        tag: triangle.tag,
        // Clockwise corners: the front is the other way.
        normal: triangle.e2.cross(triangle.e1).normalize_or_zero().into(),
        index: 0,
        at: [u, v],
    })
}

/// Bins of the surface area heuristic.
const BINS: usize = 12;

#[derive(Clone, Copy)]
struct Bounds {
    mins: Vec3A,
    maxs: Vec3A,
    count: usize,
}

impl Bounds {
    const EMPTY: Bounds = Bounds {
        mins: Vec3A::INFINITY,
        maxs: Vec3A::NEG_INFINITY,
        count: 0,
    };

    fn add(&mut self, triangle: &Triangle) {
        for corner in [
            triangle.a,
            triangle.a + triangle.e1,
            triangle.a + triangle.e2,
        ] {
            self.mins = self.mins.min(corner);
            self.maxs = self.maxs.max(corner);
        }
        self.count += 1;
    }

    fn merge(&mut self, other: &Bounds) {
        self.mins = self.mins.min(other.mins);
        self.maxs = self.maxs.max(other.maxs);
        self.count += other.count;
    }

    /// Half the surface, times the triangles: what a walk may cost here.
    fn cost(&self) -> f32 {
        let size = (self.maxs - self.mins).max(Vec3A::ZERO);
        (size.x * size.y + size.y * size.z + size.z * size.x) * self.count as f32
    }
}

/// Appends the tree over `triangles`, the first of which has index `base`.
fn build(nodes: &mut Vec<Node>, triangles: &mut [(Triangle, Vec3A)], base: u32) {
    let mut bounds = Bounds::EMPTY;
    let (mut low, mut high) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    for (triangle, centre) in triangles.iter() {
        bounds.add(triangle);
        low = low.min(*centre);
        high = high.max(*centre);
    }
    let axis = (high - low).max_position();
    let at = nodes.len();
    let leaf = triangles.len() <= LEAF;
    nodes.push(Node {
        mins: bounds.mins,
        maxs: bounds.maxs,
        first: base,
        count: if leaf { triangles.len() as u16 } else { 0 },
        axis: axis as u16,
    });
    if leaf {
        return;
    }
    let split = divide(triangles, axis, low[axis], high[axis]);
    let (left, right) = triangles.split_at_mut(split);
    build(nodes, left, base);
    let second = nodes.len() as u32;
    if let Some(node) = nodes.get_mut(at) {
        node.first = second;
    }
    build(nodes, right, base + split as u32);
}

/// Puts the triangles of the cheaper left side first; returns how many these are: not none and not all.
fn divide(triangles: &mut [(Triangle, Vec3A)], axis: usize, low: f32, high: f32) -> usize {
    let scale = BINS as f32 / (high - low).max(f32::MIN_POSITIVE);
    let bin = |centre: &Vec3A| (((centre[axis] - low) * scale) as usize).min(BINS - 1);
    let mut bins = [Bounds::EMPTY; BINS];
    for (triangle, centre) in triangles.iter() {
        if let Some(bin) = bins.get_mut(bin(centre)) {
            bin.add(triangle);
        }
    }
    let mut costs = [0.0f32; BINS];
    let mut sum = Bounds::EMPTY;
    for (cost, bin) in costs.iter_mut().zip(&bins) {
        sum.merge(bin);
        *cost = if sum.count > 0 { sum.cost() } else { 0.0 };
    }
    sum = Bounds::EMPTY;
    let mut best = (f32::INFINITY, 0);
    for (i, bin) in bins.iter().enumerate().skip(1).rev() {
        sum.merge(bin);
        let right = if sum.count > 0 { sum.cost() } else { 0.0 };
        let cost = costs.get(i - 1).copied().unwrap_or(0.0) + right;
        if cost < best.0 && sum.count > 0 && sum.count < triangles.len() {
            best = (cost, i);
        }
    }
    let mut split = 0;
    for i in 0..triangles.len() {
        if triangles.get(i).is_some_and(|(_, c)| bin(c) < best.1) {
            triangles.swap(i, split);
            split += 1;
        }
    }
    // All in one place, or so lopsided that the tree would be deep: then the median.
    let least = (triangles.len() / 64).max(1);
    if split < least || triangles.len() - split < least {
        split = triangles.len() / 2;
        triangles.select_nth_unstable_by(split, |a, b| a.1[axis].total_cmp(&b.1[axis]));
    }
    split
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    #[test]
    fn agrees_with_trying_every_triangle() {
        let mut random = Random::new(7);
        let mut point =
            |scale: f32| (Vec3::new(random.next(), random.next(), random.next()) - 0.5) * scale;
        let input: Vec<([Vec3; 3], bool, u32)> = (0..500)
            .map(|tag| {
                let at = point(100.0);
                let corners = [at, at + point(20.0), at + point(20.0)];
                (corners, tag % 5 == 0, tag)
            })
            .collect();
        let tree = Occluders::new(input.iter().copied());
        let mut found = 0;
        for _ in 0..500 {
            let (from, to) = (point(150.0), point(150.0));
            let tried = |sky: bool| {
                input
                    .iter()
                    .filter(|(.., s)| sky || *s % 5 != 0)
                    .filter_map(|&(corners, sky, tag)| {
                        let [a, b, c] = corners.map(Vec3A::from);
                        let triangle = Triangle {
                            a,
                            e1: b - a,
                            e2: c - a,
                            sky,
                            tag,
                            cut_out: u32::MAX,
                        };
                        meet(&triangle, from.into(), (to - from).into(), 0.9999)
                    })
                    .min_by(|a, b| a.t.total_cmp(&b.t))
            };
            // Which place in the tree it has is the tree's own affair.
            let nearest = tree.nearest(from, to - from, 0.9999);
            let nearest = nearest.map(|hit| Hit { index: 0, ..hit });
            assert_eq!(nearest, tried(true));
            assert_eq!(tree.blocked(from, to, false), tried(true).is_some());
            assert_eq!(tree.blocked(from, to, true), tried(false).is_some());
            found += usize::from(tried(true).is_some());
        }
        assert!(found > 50, "{found}");
        assert!(!Occluders::new(std::iter::empty()).blocked(Vec3::ZERO, Vec3::ONE, false));
    }

    #[test]
    fn light_passes_holes() {
        // Texture coordinates are places; the right half of the picture is a hole.
        let corners = [Vec3::ZERO, Vec3::Y * 4.0, Vec3::X * 4.0];
        let script = "t\n{\ncull none\n{\nmap a\nalphaFunc GE128\n}\n}\n";
        let shader = shaderscript::parse_script("test", script.as_bytes());
        let mut rgba = vec![255; 16];
        (rgba[7], rgba[15]) = (0, 0);
        let picture = crate::image::Image::from_rgba(2, 2, rgba).unwrap();
        for two_sided in [true, false] {
            let holes =
                Holes::of(&shader.shaders[0], two_sided, |_| Some(picture.clone())).unwrap();
            let holes = Arc::new(holes);
            let tree = Occluders::new(std::iter::once((corners, false, 7))).cut(|tag| {
                (tag == 7).then(|| CutOut {
                    st: corners.map(|c| c.truncate()),
                    holes: Arc::clone(&holes),
                })
            });
            let through = |x: f32| {
                let (above, below) = (Vec3::new(x, 0.3, 1.0), Vec3::new(x, 0.3, -1.0));
                let mut last = Some(0);
                let open = !tree.blocked(above, below, false);
                assert_eq!(open, !tree.blocked_again(above, below, &mut last));
                open
            };
            assert_eq!(
                [0.2, 0.7, 1.2, 1.7].map(through),
                [false, true, false, true]
            );
            let under = tree
                .nearest(Vec3::new(0.2, 0.3, -1.0), Vec3::Z, 9.0)
                .unwrap();
            assert_eq!(under.front, two_sided);
            assert!(!two_sided || under.normal.z < -0.9);
        }
    }

    #[test]
    fn fronts_are_clockwise() {
        // Seen from +z, x to the right, y up: clockwise.
        let corners = [Vec3::ZERO, Vec3::Y, Vec3::X];
        let tree = Occluders::new(std::iter::once((corners, false, 3)));
        let hit = tree.nearest(Vec3::new(0.2, 0.2, 5.0), Vec3::NEG_Z, 10.0);
        assert!(hit.is_some_and(|h| h.front && h.tag == 3 && (h.t - 5.0).abs() < 1e-5));
        let hit = tree.nearest(Vec3::new(0.2, 0.2, -5.0), Vec3::Z, 10.0);
        assert!(hit.is_some_and(|h| !h.front));
    }
}
