//! Where lost lights are looked for first: the nodes of a grid over open space.
//!
//! The grid lies where measurements are. Some maps stand in the middle of a box tens of times as wide as themselves; a grid over
//! all of that would be too coarse for the map itself.

use super::samples::Sample;
use crate::world::RelitWorld;
use glam::{IVec3, Vec3};
use std::collections::HashMap;

/// Grid spacing to begin with, id units.
const SPACING: f32 = 64.0;

/// Side of the blocks that measurements are counted in, id units.
const BLOCK: f32 = 256.0;

/// Nothing that is measured farther from the middle is looked at, id units: engines end long before, and counting blocks
/// must not overflow.
const FARTHEST: f32 = 1.0e6;

/// The part of all measurements that lies in a block or in those around it, at least, where lights are looked for.
const LEAST_PART: f32 = 1.0 / 1500.0;

/// Nodes that are looked at for each candidate, about, at most: so much work for maps of any size.
const NODES_PER_CANDIDATE: f32 = 60.0;

/// The part of space that a map's measurements tell of.
pub(super) struct MeasuredSpace {
    /// Blocks, in order.
    blocks: Vec<IVec3>,
    mins: Vec3,
    maxs: Vec3,
}

impl MeasuredSpace {
    /// Where these are.
    pub fn new(samples: &[Sample]) -> MeasuredSpace {
        let mut counts: HashMap<IVec3, f32> = HashMap::new();
        let (mut mins, mut maxs) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let near = |s: &&Sample| s.position.abs().max_element() < FARTHEST;
        for sample in samples.iter().filter(near) {
            mins = mins.min(sample.position);
            maxs = maxs.max(sample.position);
            for k in 0..27 {
                let around = IVec3::new(k % 3, k / 3 % 3, k / 9) - 1;
                *counts
                    .entry(block_of(sample.position) + around)
                    .or_default() += 1.0;
            }
        }
        let least = (samples.len() as f32 * LEAST_PART).max(2.0);
        let mut blocks: Vec<IVec3> = counts
            .into_iter()
            .filter(|(_, count)| *count >= least)
            .map(|(block, _)| block)
            .collect();
        blocks.sort_by_key(IVec3::to_array);
        MeasuredSpace { blocks, mins, maxs }
    }

    /// Whether measurements are near a place.
    pub fn holds(&self, at: Vec3) -> bool {
        let block = block_of(at).to_array();
        self.blocks
            .binary_search_by_key(&block, IVec3::to_array)
            .is_ok()
    }

    /// Nodes of a grid over the parts of it that are `open`, as fine as `most` allows, and the grid's spacing.
    pub fn grid(
        &self,
        world: &RelitWorld,
        most: usize,
        open: impl Fn(Vec3) -> bool,
    ) -> (Vec<Vec3>, f32) {
        let most = most.max(1);
        // A first guess from the volume, then what is open decides.
        let volume = self.blocks.len() as f32 * BLOCK.powi(3);
        let mut spacing = (volume / (NODES_PER_CANDIDATE * most as f32))
            .cbrt()
            .max(SPACING);
        loop {
            let mut places = self.nodes(spacing);
            places.retain(|&at| world.bsp.cluster_at(at) >= 0);
            if places.len() <= most {
                places.retain(|&at| open(at));
                return (places, spacing);
            }
            spacing *= (places.len() as f32 / most as f32).cbrt().max(1.03);
        }
    }

    fn nodes(&self, spacing: f32) -> Vec<Vec3> {
        let extent = self.maxs - self.mins;
        let counts = (extent / spacing).floor().max(Vec3::ZERO);
        let origin = self.mins + (extent - counts * spacing) * 0.5;
        let mut places = Vec::new();
        for block in &self.blocks {
            let from = block.as_vec3() * BLOCK - origin;
            let first = (from / spacing).ceil().max(Vec3::ZERO).as_ivec3();
            let end = ((from + BLOCK) / spacing).ceil().min(counts + 1.0);
            let end = end.as_ivec3();
            for z in first.z..end.z {
                for y in first.y..end.y {
                    for x in first.x..end.x {
                        places.push(origin + IVec3::new(x, y, z).as_vec3() * spacing);
                    }
                }
            }
        }
        places
    }
}

fn block_of(at: Vec3) -> IVec3 {
    (at / BLOCK).floor().as_ivec3()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::samples::tests::sample_at_place;

    #[test]
    fn a_box_far_around_does_not_make_the_grid_coarse() {
        let on_floor = (0..1600).map(|k| Vec3::new((k % 40) as f32, (k / 40) as f32, 0.0) * 16.0);
        let far = [-9000.0, 9000.0, -3.0e38, 3.0e38].map(Vec3::splat);
        let samples: Vec<_> = on_floor.chain(far).map(sample_at_place).collect();
        let measured = MeasuredSpace::new(&samples);
        assert!(measured.holds(Vec3::new(320.0, 320.0, 100.0)));
        assert!(!measured.holds(far[0]) && !measured.holds(Vec3::new(3000.0, 3000.0, 0.0)));
        let nodes = measured.nodes(64.0);
        assert!(nodes.iter().all(|&at| measured.holds(at)));
        let mut distinct = nodes.clone();
        distinct.sort_by_key(|at| at.to_array().map(f32::to_bits));
        distinct.dedup();
        assert_eq!(distinct.len(), nodes.len());
        // A cube of three blocks a side more than the floor's, at 4 nodes a block's side.
        let blocks = 5.0 * 5.0 * 3.0;
        assert!(
            (nodes.len() as f32 / (blocks * 64.0) - 1.0).abs() < 0.15,
            "{}",
            nodes.len()
        );
    }
}
