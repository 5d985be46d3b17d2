//! A bounding volume hierarchy over surfaces, with up to four children a node.

use glam::Vec3;
use support::Aabb;
use support::bvh::{Hierarchy, LeafRule};
use support::slice;

use super::Facet;

/// Most surfaces of a leaf, and the cost of testing the boxes of a split in tests of surfaces.
const LEAF_RULE: LeafRule = LeafRule {
    most: 4,
    split_cost: 1.0,
};

/// Children of a node.
const WIDE: usize = 4;

/// Padding of boxes against rounding, id units.
const PAD: f32 = 1.0e-3;

/// A ray.
#[derive(Clone, Copy, Debug)]
pub struct CurveRay {
    /// Its start.
    pub origin: Vec3,
    /// Unit vector.
    pub direction: Vec3,
    /// Two unit vectors across it.
    pub(super) across: [Vec3; 2],
    inverse: Vec3,
}

impl CurveRay {
    /// A ray from a point in a direction, which need not be a unit vector.
    pub fn new(origin: Vec3, direction: Vec3) -> Self {
        let direction = direction.normalize_or(Vec3::Z);
        let (x, y) = direction.any_orthonormal_pair();
        Self {
            origin,
            direction,
            across: [x, y],
            inverse: direction
                .recip()
                .clamp(Vec3::splat(-1e30), Vec3::splat(1e30)),
        }
    }

    /// Where the ray enters a box, unless that is behind `limit` or nowhere.
    fn enters(&self, bounds: &Aabb, limit: f32) -> Option<f32> {
        let low = (bounds.mins - self.origin) * self.inverse;
        let high = (bounds.maxs - self.origin) * self.inverse;
        let near = low.min(high).max_element().max(0.0);
        let far = low.max(high).min_element().min(limit);
        (near <= far).then_some(near)
    }
}

/// The nearest hit of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfaceHit {
    /// Distance, id units.
    pub t: f32,
    /// Unit normal of the surface on its front.
    pub face: Vec3,
    /// The normal that is shaded: of a triangle interpolated.
    pub normal: Vec3,
}

/// A surface that rays hit.
pub trait Shape: Sync {
    /// A box around it.
    fn bounds(&self) -> Aabb;
    /// Its nearest hit before `limit`, from either side.
    fn nearest(&self, ray: &CurveRay, limit: f32) -> Option<SurfaceHit>;
}

impl Shape for Facet {
    fn bounds(&self) -> Aabb {
        Aabb::of(self.corners)
    }

    /// Möller and Trumbore, Fast, Minimum Storage Ray/Triangle Intersection, 1997.
    fn nearest(&self, ray: &CurveRay, limit: f32) -> Option<SurfaceHit> {
        let [a, b, c] = self.corners;
        let (e1, e2) = (b - a, c - a);
        let p = ray.direction.cross(e2);
        let inverse = 1.0 / e1.dot(p);
        let s = ray.origin - a;
        let u = s.dot(p) * inverse;
        let q = s.cross(e1);
        let v = ray.direction.dot(q) * inverse;
        let t = e2.dot(q) * inverse;
        if !(u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= 0.0 && t < limit) {
            return None;
        }
        let face = e2.cross(e1).normalize_or_zero();
        let [na, nb, nc] = self.normals;
        Some(SurfaceHit {
            t,
            face,
            normal: (na * (1.0 - u - v) + nb * u + nc * v).normalize_or(face),
        })
    }
}

/// A node: boxes of its children, and which nodes or surfaces they are.
struct Node {
    bounds: [Aabb; WIDE],
    /// Index of the node, or of the first surface.
    first: [u32; WIDE],
    /// Number of surfaces; 0: a node.
    count: [u32; WIDE],
    children: usize,
}

/// Surfaces in a hierarchy.
pub struct Tree<S> {
    nodes: Vec<Node>,
    shapes: Vec<S>,
}

impl<S: Shape + Copy> Tree<S> {
    /// Builds the hierarchy. Surfaces with numbers that are not finite are left out.
    pub fn new(shapes: &[S]) -> Self {
        let boxes: Vec<Aabb> = (shapes.iter())
            .map(|shape| shape.bounds().grown(Vec3::splat(PAD)))
            .collect();
        let hierarchy = Hierarchy::new(&boxes, LEAF_RULE);
        let order = hierarchy.order().iter();
        let mut tree = Self {
            nodes: Vec::new(),
            shapes: order
                .filter_map(|&i| shapes.get(i as usize).copied())
                .collect(),
        };
        if !hierarchy.is_empty() {
            tree.add(&hierarchy, 0);
        }
        tree
    }

    fn add(&mut self, hierarchy: &Hierarchy, node: u32) -> u32 {
        let children = hierarchy.wide_children(node as usize, WIDE);
        let index = self.nodes.len();
        let mut made = Node {
            bounds: [Aabb::EMPTY; WIDE],
            first: [0; WIDE],
            count: [0; WIDE],
            children: children.len().min(WIDE),
        };
        for (slot, child) in children.iter().enumerate().take(WIDE) {
            made.bounds[slot] = child.bounds;
            made.first[slot] = child.first;
            made.count[slot] = child.count;
        }
        let inner = (0..made.children).filter(|&slot| made.count[slot] == 0);
        let inner: Vec<usize> = inner.collect();
        self.nodes.push(made);
        for slot in inner {
            let below = self.nodes.get(index).map_or(0, |node| node.first[slot]);
            let below = self.add(hierarchy, below);
            if let Some(node) = self.nodes.get_mut(index) {
                node.first[slot] = below;
            }
        }
        u32::try_from(index).unwrap_or(u32::MAX)
    }

    /// Number of surfaces.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.shapes.is_empty()
    }

    /// Bytes of nodes and surfaces.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.shapes.as_slice())
    }

    /// The nearest hit before `limit`.
    pub fn nearest(&self, ray: &CurveRay, limit: f32) -> Option<SurfaceHit> {
        let mut best: Option<SurfaceHit> = None;
        let mut stack = vec![(0.0f32, 0u32)];
        while let Some((near, at)) = stack.pop() {
            let limit_now = |best: &Option<SurfaceHit>| best.map_or(limit, |hit| hit.t);
            if near > limit_now(&best) {
                continue;
            }
            let Some(node) = self.nodes.get(at as usize) else {
                continue;
            };
            let from = stack.len();
            for slot in 0..node.children {
                let Some(near) = ray.enters(&node.bounds[slot], limit_now(&best)) else {
                    continue;
                };
                if node.count[slot] == 0 {
                    stack.push((near, node.first[slot]));
                    continue;
                }
                for shape in slice::part(
                    &self.shapes,
                    slice::span(node.first[slot], node.count[slot]),
                ) {
                    best = shape.nearest(ray, limit_now(&best)).or(best);
                }
            }
            // the nearest of them last, which is taken first
            let added = stack.get_mut(from..).unwrap_or_default();
            added.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
        }
        best
    }
}
