//! Tests whether a ray passes through the solid of a map.
//!
//! Compilers drop surfaces that no player can see: behind panels, under curves, outside the hull. A ray from
//! there meets no triangle on its way through a wall. The BSP tree still marks the wall: its leafs belong to no
//! cluster.

use glam::Vec3;
use q3bsp::{Bsp, Child, NodeId};

/// Length of solid that a ray may pass through and count as free, id units: surfaces lie on the boundary of solid,
/// and the receivers' offset and rounding decide the side. No wall is as thin.
const SLACK: f32 = 1.0;

/// Whether a segment passes through solid. Never for a map without a PVS, whose leafs carry no cluster.
pub(super) fn through_solid(bsp: &Bsp, from: Vec3, to: Vec3) -> bool {
    if bsp.visibility.is_none() || bsp.nodes.is_empty() {
        return false;
    }
    let length = from.distance(to);
    if !length.is_finite() || length <= SLACK {
        return false;
    }
    let mut solid = 0.0f32;
    // intervals of the segment, as parts of it, with the node or leaf that they lie in
    let mut pending = vec![(Child::Node(NodeId::ROOT), 0.0f32, 1.0f32)];
    while let Some((child, start, end)) = pending.pop() {
        let node = match child {
            Child::Node(node) => bsp.node(node),
            Child::Leaf(leaf) => {
                if bsp.leaf(leaf).cluster < 0 {
                    solid += (end - start) * length;
                    if solid > SLACK {
                        return true;
                    }
                }
                continue;
            }
        };
        let plane = bsp.plane(node.plane);
        let distance = |part: f32| plane.normal.dot(from.lerp(to, part)) - plane.dist;
        let (a, b) = (distance(start), distance(end));
        let [front, back] = node.children;
        match (a >= 0.0, b >= 0.0) {
            (true, true) => pending.push((front, start, end)),
            (false, false) => pending.push((back, start, end)),
            (starts_in_front, _) => {
                let middle = start + (end - start) * (a / (a - b)).clamp(0.0, 1.0);
                let (near, far) = if starts_in_front {
                    (front, back)
                } else {
                    (back, front)
                };
                pending.push((near, start, middle));
                pending.push((far, middle, end));
            }
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;
    use q3bsp::builder::MapBuilder;

    #[test]
    fn walls_between_rooms_are_solid_and_doors_are_not() {
        let mut map = MapBuilder::new();
        for x in [0.0, 128.0] {
            map.add_cell(Vec3::new(x, 0.0, 0.0), Vec3::new(x + 100.0, 100.0, 100.0));
        }
        map.set_sees(0, 1, true);
        let bsp = map.build();
        let at = |x: f32| Vec3::new(x, 50.0, 50.0);
        assert!(!through_solid(&bsp, at(5.0), at(95.0)));
        assert!(through_solid(&bsp, at(50.0), at(150.0)));
        assert!(through_solid(&bsp, at(150.0), at(50.0)));
        // a point that lies just inside of a wall
        assert!(!through_solid(&bsp, at(50.0), at(100.5)));
        assert!(!through_solid(&bsp, at(50.0), at(f32::NAN)));
    }
}
