//! Builds a bounding volume hierarchy with two children a node.
//!
//! Source: Wald 2007 for binned splits by the surface area heuristic along the longest axis.

use super::{Kind, WIDE};
use glam::{Vec3, Vec3A};

/// Bins of the surface area heuristic.
const BINS: usize = 12;

/// Reciprocal of the smallest part of a node's triangles on one side: smaller parts make deep trees.
const LOPSIDED: usize = 64;

/// Padding of boxes: relative to their coordinates, and at least this, id units.
const PAD: f32 = 1e-6;

/// A triangle and its properties.
pub(super) type Input = ([Vec3; 3], Kind);

/// A node.
pub(super) struct Binary {
    pub bounds: Bounds,
    /// Its children, or the triangles of a leaf.
    pub halves: Result<Box<[Binary; 2]>, Vec<Input>>,
}

/// The hierarchy of some triangles; `None` for none.
pub(super) fn build(triangles: Vec<Input>) -> Option<Binary> {
    let placed = |input: Input| {
        let bounds = Bounds::of(&input);
        (input, bounds, bounds.mins + bounds.maxs)
    };
    let mut triangles: Vec<Placed> = triangles.into_iter().map(placed).collect();
    (!triangles.is_empty()).then(|| node(&mut triangles))
}

/// A triangle, its bounds, and twice its centroid.
type Placed = (Input, Bounds, Vec3A);

/// Axis-aligned bounds.
#[derive(Clone, Copy)]
pub(super) struct Bounds {
    pub mins: Vec3A,
    pub maxs: Vec3A,
    count: usize,
}

impl Bounds {
    const EMPTY: Bounds = Bounds {
        mins: Vec3A::INFINITY,
        maxs: Vec3A::NEG_INFINITY,
        count: 0,
    };

    /// Bounds of a triangle as the intersection test computes its corners: one corner plus edges.
    fn of(([a, b, c], _): &Input) -> Bounds {
        let [a, b, c] = [*a, *a + (*b - *a), *a + (*c - *a)].map(Vec3A::from);
        Bounds {
            mins: a.min(b).min(c),
            maxs: a.max(b).max(c),
            count: 1,
        }
    }

    fn merge(&mut self, other: &Bounds) {
        self.mins = self.mins.min(other.mins);
        self.maxs = self.maxs.max(other.maxs);
        self.count += other.count;
    }

    /// Padded corners: hits of rays along a face lie inside.
    pub fn padded(&self) -> (Vec3, Vec3) {
        let pad = (self.mins.abs().max(self.maxs.abs()) * PAD).max(Vec3A::splat(PAD));
        ((self.mins - pad).into(), (self.maxs + pad).into())
    }

    /// Half the surface area.
    pub fn area(&self) -> f32 {
        let size = (self.maxs - self.mins).max(Vec3A::ZERO);
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    /// Expected cost of traversal.
    fn cost(&self) -> f32 {
        match self.count {
            0 => 0.0,
            count => self.area() * count as f32,
        }
    }
}

fn node(triangles: &mut [Placed]) -> Binary {
    let mut bounds = Bounds::EMPTY;
    let (mut low, mut high) = (Vec3A::INFINITY, Vec3A::NEG_INFINITY);
    for (_, own, centre) in triangles.iter() {
        bounds.merge(own);
        low = low.min(*centre);
        high = high.max(*centre);
    }
    let halves = if triangles.len() <= WIDE {
        Err(triangles.iter().map(|(input, ..)| *input).collect())
    } else {
        let axis = (high - low).max_position();
        let split = divide(triangles, axis, low[axis], high[axis]);
        let (left, right) = triangles.split_at_mut(split);
        Ok(Box::new([node(left), node(right)]))
    };
    Binary { bounds, halves }
}

/// Partitions triangles so that those of the cheaper split's left side come first; returns their number, neither
/// none nor all.
fn divide(triangles: &mut [Placed], axis: usize, low: f32, high: f32) -> usize {
    let scale = BINS as f32 / (high - low).max(f32::MIN_POSITIVE);
    let bin = |centre: &Vec3A| (((centre[axis] - low) * scale) as usize).min(BINS - 1);
    let mut bins = [Bounds::EMPTY; BINS];
    for (_, own, centre) in triangles.iter() {
        if let Some(bin) = bins.get_mut(bin(centre)) {
            bin.merge(own);
        }
    }
    let mut costs = [0.0f32; BINS];
    let mut sum = Bounds::EMPTY;
    for (cost, bin) in costs.iter_mut().zip(&bins) {
        sum.merge(bin);
        *cost = sum.cost();
    }
    sum = Bounds::EMPTY;
    let mut best = (f32::INFINITY, 0);
    for (i, bin) in bins.iter().enumerate().skip(1).rev() {
        sum.merge(bin);
        let cost = costs.get(i - 1).copied().unwrap_or(0.0) + sum.cost();
        if cost < best.0 && sum.count > 0 && sum.count < triangles.len() {
            best = (cost, i);
        }
    }
    let mut split = 0;
    for i in 0..triangles.len() {
        if triangles.get(i).is_some_and(|(.., c)| bin(c) < best.1) {
            triangles.swap(i, split);
            split += 1;
        }
    }
    // All at one place, or so unbalanced that the tree would be deep: split at the median.
    let least = (triangles.len() / LOPSIDED).max(1);
    if split < least || triangles.len() - split < least {
        split = triangles.len() / 2;
        triangles.select_nth_unstable_by(split, |a, b| a.2[axis].total_cmp(&b.2[axis]));
    }
    split
}
