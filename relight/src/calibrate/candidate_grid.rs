//! Grid of candidate positions over open space.
//!
//! The grid covers the space near samples only. Some maps stand in a box tens of times their own size; a grid over
//! the whole box would be too coarse.

use super::samples::Sample;
use crate::world::RelitWorld;
use glam::{IVec3, Vec3};
use std::collections::HashMap;
use support::Aabb;

/// Smallest grid spacing, id units.
const SPACING: f32 = 64.0;

/// Side of the blocks in which samples are counted, id units.
const BLOCK: f32 = 256.0;

/// Largest coordinate of a sample that is counted, id units: far beyond any engine's limit, and block indices
/// cannot overflow.
const FARTHEST: f32 = 1.0e6;

/// Smallest part of all samples in a block and its neighbours for the block to get candidates.
const LEAST_PART: f32 = 1.0 / 1500.0;

/// Largest number of nodes tested for each candidate: bounds the work for maps of any size.
const NODES_PER_CANDIDATE: f32 = 60.0;

/// The blocks of space that have samples nearby.
pub(super) struct MeasuredSpace {
    /// Blocks, sorted.
    blocks: Vec<IVec3>,
    /// Bounds of the samples.
    bounds: Aabb,
}

impl MeasuredSpace {
    /// The space near these samples.
    pub fn new(samples: &[Sample]) -> MeasuredSpace {
        let mut counts: HashMap<IVec3, f32> = HashMap::new();
        let mut bounds = Aabb::EMPTY;
        let near = |s: &&Sample| s.position.abs().max_element() < FARTHEST;
        for sample in samples.iter().filter(near) {
            bounds = bounds.with(sample.position);
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
        MeasuredSpace { blocks, bounds }
    }

    /// Whether a position has samples nearby.
    pub fn holds(&self, at: Vec3) -> bool {
        let block = block_of(at).to_array();
        self.blocks
            .binary_search_by_key(&block, IVec3::to_array)
            .is_ok()
    }

    /// Grid nodes that are `open`, as fine as `most` allows, and the grid spacing, id units.
    pub fn grid(
        &self,
        world: &RelitWorld,
        most: usize,
        open: impl Fn(Vec3) -> bool,
    ) -> (Vec<Vec3>, f32) {
        let most = most.max(1);
        // The volume gives a first guess; the count of open nodes corrects it.
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
        let extent = self.bounds.size();
        let counts = (extent / spacing).floor().max(Vec3::ZERO);
        let origin = self.bounds.mins + (extent - counts * spacing) * 0.5;
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
    fn a_distant_box_does_not_coarsen_the_grid() {
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
        // Three blocks a side more than the floor, 4 nodes along the side of a block.
        let blocks = 5.0 * 5.0 * 3.0;
        assert!(
            (nodes.len() as f32 / (blocks * 64.0) - 1.0).abs() < 0.15,
            "{}",
            nodes.len()
        );
    }
}
