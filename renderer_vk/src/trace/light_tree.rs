//! A binary tree over lights, from which shaders draw a light by random descent (`shaders/trace/light_tree.glsl`).
//!
//! Estevez and Kulla, Importance Sampling of Many Lights with Adaptive Tree Splitting, HPG 2018: each node bounds its
//! lights by a box, by a cone of the directions that their surfaces face, and by the sum of their powers; it is split
//! where the surface area orientation heuristic (section 4.4) is least. Lights that move keep the topology of the tree,
//! whose bounds are refitted each frame (Moreau, Pharr, Clarberg, Dynamic Many-Light Sampling for Real-Time Ray Tracing,
//! HPG 2019).

use std::f32::consts::{FRAC_PI_2, PI};

use glam::{Quat, Vec3};
use shaders::trace_types as t;
use shaders::trace_types::constants as c;
use support::Aabb;

use super::light_tables::luminance;

/// Candidates of a split along an axis, plus one.
const BINS: usize = 12;

/// Added to the angles of cones, so that rounding excludes no direction; radians.
const ANGLE_MARGIN: f32 = 1.0e-3;

/// Smallest sine squared between two directions that have an axis of rotation.
const PARALLEL: f32 = 1.0e-12;

/// From where, in which directions and how strongly lights emit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Bounds of the emitting surfaces.
    bounds: Aabb,
    /// Middle of the cone of their normals.
    axis: Vec3,
    /// Half angle of the cone. Light leaves a surface up to a right angle from its normal.
    spread: f32,
    /// Luminance of the radiant intensity along the normal, over pi.
    power: f32,
}

impl Emission {
    /// No light.
    pub const NOTHING: Self = Self {
        bounds: Aabb::EMPTY,
        axis: Vec3::Z,
        spread: 0.0,
        power: 0.0,
    };

    /// Of a triangle; nothing if it is not finite.
    pub fn of_triangle(light: &t::TriangleLight) -> Self {
        let [a, b, c] = light.corners;
        let face = (b - a).cross(c - a);
        let two_sided = light.flags & c::LIGHT_TWO_SIDED != 0;
        Self::checked(Self {
            bounds: Aabb::of(light.corners),
            axis: face.normalize_or(Vec3::Z),
            spread: if two_sided { PI } else { 0.0 },
            power: 0.5 * face.length() * luminance(light.radiance) / PI,
        })
    }

    /// Of a sphere, spots included: they count as if they emitted in all directions.
    pub fn of_sphere(light: &t::SphereLight) -> Self {
        let line = light.axis * light.half_length;
        let ends = Aabb::of([light.origin - line, light.origin + line]);
        Self::checked(Self {
            bounds: ends.grown(Vec3::splat(light.radius)),
            axis: Vec3::Z,
            spread: PI,
            power: luminance(light.radiance) * light.radius * light.radius,
        })
    }

    fn checked(self) -> Self {
        let is_usable = self.bounds.is_finite() && self.power.is_finite() && self.power > 0.0;
        if is_usable { self } else { Self::NOTHING }
    }

    /// Of both. Lights without power widen nothing.
    fn with(self, other: Self) -> Self {
        if other.power <= 0.0 {
            return self;
        }
        if self.power <= 0.0 {
            return other;
        }
        let (wide, narrow) = if self.spread >= other.spread {
            (self, other)
        } else {
            (other, self)
        };
        let (axis, spread) = cone_of_both(wide, narrow);
        Self {
            bounds: self.bounds.union(other.bounds),
            axis,
            spread,
            power: self.power + other.power,
        }
    }

    /// Cost of the lights as one node: power times surface area times the solid angle that the cosine-weighted
    /// directions of the cone fill (Estevez and Kulla 2018, section 4.4).
    fn cost(&self) -> f32 {
        if self.power <= 0.0 {
            return 0.0;
        }
        let (inner, outer) = (self.spread, (self.spread + FRAC_PI_2).min(PI));
        let fringe =
            2.0 * outer * inner.sin() - (inner - 2.0 * outer).cos() - 2.0 * inner * inner.sin()
                + inner.cos();
        let angle = 2.0 * PI * (1.0 - inner.cos()) + FRAC_PI_2 * fringe;
        // lights in one point have no area
        self.power * angle * self.bounds.half_area().max(1.0e-6)
    }
}

/// Axis and half angle of the smallest cone that contains those of both; the first is not the narrower one.
fn cone_of_both(wide: Emission, narrow: Emission) -> (Vec3, f32) {
    let between = wide.axis.dot(narrow.axis).clamp(-1.0, 1.0).acos();
    if (between + narrow.spread).min(PI) <= wide.spread {
        return (wide.axis, wide.spread);
    }
    let spread = (wide.spread + between + narrow.spread) * 0.5;
    let turn = wide.axis.cross(narrow.axis);
    if spread >= PI || turn.length_squared() < PARALLEL {
        return (wide.axis, PI);
    }
    let turned = Quat::from_axis_angle(turn.normalize(), spread - wide.spread) * wide.axis;
    (turned.normalize_or(wide.axis), spread)
}

/// A node. Children follow their parent.
#[derive(Clone, Copy, Debug)]
struct Node {
    emission: Emission,
    /// First of two children; 0: a leaf.
    first: u32,
    /// Number of a leaf's light.
    light: u32,
}

impl Node {
    fn of_shader(&self) -> t::LightTreeNode {
        let Emission {
            bounds,
            axis,
            spread,
            power,
        } = self.emission;
        let empty = power <= 0.0;
        t::LightTreeNode {
            centre: if empty { Vec3::ZERO } else { bounds.centre() },
            radius: if empty {
                0.0
            } else {
                bounds.size().length() * 0.5
            },
            axis,
            cos_spread: (spread + ANGLE_MARGIN).min(PI).cos(),
            power,
            first: self.first,
            light: self.light,
        }
    }
}

/// A tree over lights, on the CPU.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    nodes: Vec<Node>,
    /// Node of each light.
    leafs: Vec<u32>,
}

/// Lights that are still to be split: their node, and their range of the order.
struct Work {
    node: usize,
    from: usize,
    to: usize,
}

impl LightTree {
    /// Builds the tree over lights, each with its number.
    pub fn new(lights: &[(u32, Emission)]) -> Self {
        let mut tree = Self {
            nodes: Vec::with_capacity(2 * lights.len()),
            leafs: vec![0; lights.len()],
        };
        if lights.is_empty() {
            return tree;
        }
        let mut order: Vec<usize> = (0..lights.len()).collect();
        let mut open = vec![Work {
            node: tree.push(),
            from: 0,
            to: lights.len(),
        }];
        // deeper than a thread's stack if the lights are placed so
        while let Some(Work { node, from, to }) = open.pop() {
            let Some(part) = order.get_mut(from..to) else {
                continue;
            };
            if let &mut [index] = part {
                tree.set_leaf(node, index, lights);
                continue;
            }
            let middle = from + split(part, lights);
            let (left, right) = (tree.push(), tree.push());
            if let Some(parent) = tree.nodes.get_mut(node) {
                parent.first = u32::try_from(left).unwrap_or(0);
            }
            open.push(Work {
                node: left,
                from,
                to: middle,
            });
            open.push(Work {
                node: right,
                from: middle,
                to,
            });
        }
        tree.join();
        tree
    }

    fn push(&mut self) -> usize {
        self.nodes.push(Node {
            emission: Emission::NOTHING,
            first: 0,
            light: 0,
        });
        self.nodes.len() - 1
    }

    fn set_leaf(&mut self, node: usize, index: usize, lights: &[(u32, Emission)]) {
        let light = lights.get(index);
        let places = self.nodes.get_mut(node).zip(self.leafs.get_mut(index));
        if let (Some((place, leaf)), Some(&(light, emission))) = (places, light) {
            (place.light, place.emission) = (light, emission);
            *leaf = u32::try_from(node).unwrap_or(0);
        }
    }

    /// Bounds of the inner nodes from those of the leafs.
    fn join(&mut self) {
        for index in (0..self.nodes.len()).rev() {
            let first = self.nodes.get(index).map_or(0, |node| node.first) as usize;
            if first == 0 {
                continue;
            }
            let child = |at: usize| self.nodes.get(at).map_or(Emission::NOTHING, |n| n.emission);
            let both = child(first).with(child(first + 1));
            if let Some(node) = self.nodes.get_mut(index) {
                node.emission = both;
            }
        }
    }

    /// The tree with the same topology for the present state of its lights: index among the lights of
    /// [`new`](Self::new), number, emission. Other lights emit nothing.
    #[must_use]
    pub fn refitted(&self, present: impl IntoIterator<Item = (usize, u32, Emission)>) -> Self {
        let mut tree = self.clone();
        for &leaf in &self.leafs {
            if let Some(node) = tree.nodes.get_mut(leaf as usize) {
                node.emission = Emission::NOTHING;
            }
        }
        for (index, light, emission) in present {
            let leaf = self.leafs.get(index).copied();
            if let Some(node) = leaf.and_then(|leaf| tree.nodes.get_mut(leaf as usize)) {
                (node.light, node.emission) = (light, emission);
            }
        }
        tree.join();
        tree
    }

    /// The nodes as shaders read them; the first is the root.
    pub fn shader_nodes(&self) -> Vec<t::LightTreeNode> {
        self.nodes.iter().map(Node::of_shader).collect()
    }
}

/// Orders lights into two parts; returns the number of those in the first, at least 1 and less than all.
fn split(part: &mut [usize], lights: &[(u32, Emission)]) -> usize {
    let emission = |index: usize| lights.get(index).map_or(Emission::NOTHING, |l| l.1);
    let centre = |index: usize| {
        let light = emission(index);
        if light.power > 0.0 {
            light.bounds.centre()
        } else {
            Vec3::ZERO
        }
    };
    let half = part.len() / 2;
    let all = part
        .iter()
        .fold(Emission::NOTHING, |sum, &i| sum.with(emission(i)));
    let centres = Aabb::of(part.iter().map(|&i| centre(i)));
    let size = centres.size();
    let longest = all.bounds.size().max_element();
    let bin = |index: usize, axis: usize| {
        let at = (centre(index)[axis] - centres.mins[axis]) / size[axis];
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // saturates
        ((at * BINS as f32) as usize).min(BINS - 1)
    };
    // cost, axis, first bin of the second part
    let mut best: Option<(f32, usize, usize)> = None;
    for axis in (0..3).filter(|&axis| size[axis] > 0.0) {
        let mut bins = [(Emission::NOTHING, 0usize); BINS];
        for &index in part.iter() {
            if let Some((sum, count)) = bins.get_mut(bin(index, axis)) {
                *sum = sum.with(emission(index));
                *count += 1;
            }
        }
        // long boxes are cut across
        let regular = longest / all.bounds.size()[axis].max(1.0e-6);
        for first in 1..BINS {
            let (low, high) = bins.split_at(first);
            let side = |bins: &[(Emission, usize)]| {
                bins.iter()
                    .fold((Emission::NOTHING, 0), |(sum, count), (e, n)| {
                        (sum.with(*e), count + n)
                    })
            };
            let ((below, few), (above, many)) = (side(low), side(high));
            let cost = regular * (below.cost() + above.cost());
            let is_least = best.is_none_or(|(least, ..)| cost < least);
            if few > 0 && many > 0 && cost.is_finite() && is_least {
                best = Some((cost, axis, first));
            }
        }
    }
    let Some((_, axis, first)) = best else {
        return half;
    };
    // stable, so that the tree depends on the order of the lights alone
    part.sort_by_key(|&index| bin(index, axis) >= first);
    part.partition_point(|&index| bin(index, axis) < first)
}

#[cfg(test)]
#[path = "light_tree_tests.rs"]
mod tests;
