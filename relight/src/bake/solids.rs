//! Brushes that a point may lie in, by cells of space.
//!
//! A leaf of the tree may list hundreds of detail brushes, and a bake asks for millions of points.

use glam::{IVec3, Vec3};
use q3bsp::{Brush, BrushSide, Bsp, content_flags, surface_flags};
use std::collections::HashMap;
use support::Aabb;
use support::slice::{part, span};

/// Side of a cell, id units.
const CELL: f32 = 128.0;

/// Most cells of one brush; larger ones are tested at every point.
const MOST_CELLS: usize = 1 << 15;

/// Solid brushes of the world with a drawn side.
pub(super) struct Solids<'a> {
    bsp: &'a Bsp,
    cells: HashMap<IVec3, Vec<u32>>,
    everywhere: Vec<u32>,
}

impl<'a> Solids<'a> {
    /// Those of a map.
    pub fn of(bsp: &'a Bsp) -> Solids<'a> {
        let mut solids = Solids {
            bsp,
            cells: HashMap::new(),
            everywhere: Vec::new(),
        };
        let world = bsp.models.first();
        let range = world.map_or(0..0, |m| {
            span(m.first_brush.max(0) as u32, m.num_brushes.max(0) as u32)
        });
        for (index, brush) in (range.start as u32..).zip(part(&bsp.brushes, range)) {
            let drawn = |side: &BrushSide| {
                bsp.shader(side.shader).surface_flags & surface_flags::NODRAW == 0
            };
            let solid = bsp.shader(brush.shader).content_flags & content_flags::SOLID != 0;
            if solid && bsp.sides_of(brush).iter().any(drawn) {
                solids.add(index, bounds(bsp, brush));
            }
        }
        solids
    }

    fn add(&mut self, brush: u32, bounds: Aabb) {
        let (low, high) = (cell(bounds.mins), cell(bounds.maxs));
        let size = (high - low).as_dvec3() + 1.0;
        let count = size.x * size.y * size.z;
        if !(bounds.is_finite() && count <= MOST_CELLS as f64) {
            self.everywhere.push(brush);
            return;
        }
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                for x in low.x..=high.x {
                    let list = self.cells.entry(IVec3::new(x, y, z)).or_default();
                    list.push(brush);
                }
            }
        }
    }

    /// Whether a point lies in one of the brushes, at least this deep; with a negative depth also as far outside.
    pub fn hold(&self, point: Vec3, depth: f32) -> bool {
        let near = self.cells.get(&cell(point)).map_or(&[][..], Vec::as_slice);
        near.iter().chain(&self.everywhere).any(|&index| {
            let brush = self.bsp.brushes.get(index as usize);
            brush.is_some_and(|brush| {
                let sides = self.bsp.sides_of(brush);
                let behind = |side: &BrushSide| self.bsp.plane(side.plane).distance(point) < -depth;
                sides.iter().all(behind)
            })
        })
    }
}

fn cell(point: Vec3) -> IVec3 {
    (point / CELL).floor().as_ivec3()
}

/// Bounds of a brush by its axial sides, a little larger; infinite where it has none.
fn bounds(bsp: &Bsp, brush: &Brush) -> Aabb {
    let mut bounds = Aabb {
        mins: Vec3::NEG_INFINITY,
        maxs: Vec3::INFINITY,
    };
    for side in bsp.sides_of(brush) {
        let plane = bsp.plane(side.plane);
        for axis in 0..3 {
            if plane.normal[axis] == 1.0 {
                bounds.maxs[axis] = bounds.maxs[axis].min(plane.dist);
            } else if plane.normal[axis] == -1.0 {
                bounds.mins[axis] = bounds.mins[axis].max(-plane.dist);
            }
        }
    }
    bounds.grown(Vec3::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;
    use q3bsp::builder::MapBuilder;
    use support::random::Random;

    #[test]
    fn points_are_in_the_brushes_that_the_tree_lists() {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/wall", 0, content_flags::SOLID);
        let clip = map.add_shader("t/clip", surface_flags::NODRAW, content_flags::SOLID);
        let mut random = Random::new(3);
        map.add_room(wall, Vec3::splat(-600.0), Vec3::splat(600.0));
        for k in 0..40 {
            let at = random.signed_point() * 500.0;
            let size = Vec3::splat(4.0 + random.uniform() * 200.0);
            let shader = if k % 4 == 0 { clip } else { wall };
            map.add_box_brush(shader, at, at + size);
        }
        let bsp = map.build();
        let solids = Solids::of(&bsp);
        let mut inside = 0;
        for _ in 0..4000 {
            let point = random.signed_point() * 599.0;
            for depth in [-0.5, 0.5] {
                let held = solids.hold(point, depth);
                assert_eq!(held, bsp.is_in_drawn_brush(point, depth), "{point} {depth}");
                inside += usize::from(held);
            }
        }
        assert!(inside > 100, "{inside}");
    }
}
