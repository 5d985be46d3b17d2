//! A uniform grid over the map that shortens the tree walk from a point to its cell of lights: each grid box stores the
//! deepest node that the walks of all its points pass.

use glam::{UVec3, Vec3};
use shaders::trace_types::BspNode;
use support::slice::part_mut;

/// Approximate maximum number of grid boxes: 1 MB.
const MOST_BOXES: f32 = 262_144.0;
/// Least edge of a grid box, units: rooms are larger.
const LEAST_SIDE: f32 = 32.0;
/// Points closer to a plane than this, units, count as on both sides, because shaders round differently.
const MARGIN: f32 = 0.25;

/// The grid over a map's tree.
#[derive(Default)]
pub struct CellGrid {
    /// Smallest corner.
    pub origin: Vec3,
    /// Boxes per unit of length.
    pub scale: f32,
    /// Boxes along each axis; zero: the grid is empty.
    pub size: UVec3,
    /// First node of the walk for each box, x fastest: a node, or `-1 - leaf`.
    pub starts: Vec<i32>,
}

impl CellGrid {
    /// The grid between two corners; empty if they span no volume or the tree has no node.
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // bounded by MOST_BOXES
    pub fn new(nodes: &[BspNode], low: Vec3, high: Vec3) -> Self {
        let extent = high - low;
        if nodes.is_empty() || !extent.is_finite() || extent.min_element() <= 0.0 {
            return Self::default();
        }
        let side = (extent.element_product() / MOST_BOXES).cbrt();
        // for flat or long maps too, rounding up adds at most one layer of boxes
        let side = side.max(extent.max_element() / MOST_BOXES.sqrt());
        let side = side.max(LEAST_SIDE);
        let size = (extent / side).ceil().max(Vec3::ONE).as_uvec3();
        let mut fill = Fill {
            nodes,
            origin: low,
            side,
            size: size.to_array().map(|n| n as usize),
            starts: vec![0; size.to_array().map(|n| n as usize).iter().product()],
        };
        fill.boxes(UVec3::ZERO, size, 0);
        Self {
            origin: low,
            scale: side.recip(),
            size,
            starts: fill.starts,
        }
    }
}

/// A grid during its construction.
struct Fill<'a> {
    nodes: &'a [BspNode],
    origin: Vec3,
    side: f32,
    size: [usize; 3],
    starts: Vec<i32>,
}

impl Fill<'_> {
    /// Fills the boxes from `low` to `high` (excluded); the walks of all their points pass `start`.
    fn boxes(&mut self, low: UVec3, high: UVec3, start: i32) {
        let start = self.descend(low, high, start);
        let count = high - low;
        if start < 0 || count == UVec3::ONE {
            let [width, height, _] = self.size;
            for z in low.z as usize..high.z as usize {
                for y in low.y as usize..high.y as usize {
                    let row = (z * height + y) * width;
                    let row = row + low.x as usize..row + high.x as usize;
                    part_mut(&mut self.starts, row).fill(start);
                }
            }
            return;
        }
        // halve the longest side
        let axis = count.max_position();
        let (mut low_end, mut high_start) = (high, low);
        low_end[axis] = low[axis] + count[axis] / 2;
        high_start[axis] = low_end[axis];
        self.boxes(low, low_end, start);
        self.boxes(high_start, high, start);
    }

    /// The deepest node, from `start` on, that the walks of all points of a block of boxes pass.
    fn descend(&self, low: UVec3, high: UVec3, start: i32) -> i32 {
        let half = (high - low).as_vec3() * (self.side * 0.5);
        let centre = self.origin + low.as_vec3() * self.side + half;
        let mut index = start;
        // no path is longer than the number of nodes; the bound also ends cyclic trees
        for _ in 0..=self.nodes.len() {
            let Some(node) = usize::try_from(index).ok().and_then(|i| self.nodes.get(i)) else {
                break; // a leaf
            };
            let [x, y, z, distance] = node.plane;
            let normal = Vec3::new(x, y, z);
            let middle = normal.dot(centre) - distance;
            let reach = normal.abs().dot(half) + MARGIN;
            if middle.abs() < reach || !middle.is_finite() {
                break;
            }
            index = node.children[usize::from(middle < 0.0)];
        }
        index
    }
}

#[cfg(test)]
mod tests {
    use testkit::Random;

    use super::*;

    /// Walks from a start node, as the shader does.
    fn leaf_from(nodes: &[BspNode], point: Vec3, start: i32) -> i32 {
        let mut index = start;
        while index >= 0 {
            let node = nodes[index as usize];
            let [x, y, z, distance] = node.plane;
            let front = Vec3::new(x, y, z).dot(point) >= distance;
            index = node.children[usize::from(!front)];
        }
        index
    }

    #[test]
    fn a_walk_from_the_grid_ends_where_one_from_the_root_does() {
        let node = |plane, children| BspNode { plane, children };
        let nodes = [
            node([1.0, 0.0, 0.0, 100.0], [1, 2]),
            node([0.6, 0.8, 0.0, 300.0], [-1, -2]),
            node([0.0, 0.0, 1.0, -50.0], [-3, -4]),
        ];
        let low = Vec3::new(-400.0, -300.0, -200.0);
        let extent = Vec3::new(1000.0, 700.0, 333.0);
        let grid = CellGrid::new(&nodes, low, low + extent);
        assert_eq!(grid.starts.len() as u32, grid.size.element_product());
        // most boxes store a leaf; boxes across a plane store a node
        assert!(grid.starts.iter().filter(|s| **s < 0).count() * 2 > grid.starts.len());
        assert!(grid.starts.iter().any(|s| *s > 0));
        let mut random = Random::new(1);
        for _ in 0..20_000 {
            let point =
                low + Vec3::new(random.uniform(), random.uniform(), random.uniform()) * extent;
            let at = ((point - grid.origin) * grid.scale).as_uvec3();
            let index = (at.z * grid.size.y + at.y) * grid.size.x + at.x;
            let start = grid.starts[index as usize];
            assert_eq!(leaf_from(&nodes, point, start), leaf_from(&nodes, point, 0));
        }
    }

    #[test]
    fn a_space_without_volume_has_no_grid() {
        let nodes = [BspNode::default()];
        for high in [Vec3::ZERO, Vec3::new(1.0, 1.0, f32::NAN), -Vec3::ONE] {
            assert_eq!(CellGrid::new(&nodes, Vec3::ZERO, high).size, UVec3::ZERO);
        }
        assert!(CellGrid::new(&[], Vec3::ZERO, Vec3::ONE).starts.is_empty());
    }
}
