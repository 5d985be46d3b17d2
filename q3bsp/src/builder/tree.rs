//! The models, the tree and the leafs of a map under construction.

use super::{Cell, MapBuilder, int, last, whole};
use crate::ids::{BrushId, Child, LeafId, NodeId, SurfaceId};
use crate::lumps::{Leaf, Model, Node};
use crate::surface::SurfaceKind;
use glam::Vec3;

impl MapBuilder {
    pub(super) fn build_models(&mut self) {
        let ends = self.model_starts.iter().skip(1).copied();
        let end = (self.bsp.surfaces.len(), self.bsp.brushes.len());
        let spans: Vec<_> = self
            .model_starts
            .iter()
            .copied()
            .zip(ends.chain([end]))
            .collect();
        for (at, ((first_surface, first_brush), (end_surface, end_brush))) in
            spans.into_iter().enumerate()
        {
            let surfaces = self
                .bsp
                .surfaces
                .get(first_surface..end_surface)
                .unwrap_or(&[]);
            let mut points: Vec<Vec3> = surfaces
                .iter()
                .flat_map(|s| self.bsp.surface_vertices(s))
                .map(|v| v.finite().position)
                .collect();
            if at == 0 {
                points.extend(self.cells.iter().flat_map(|cell| [cell.mins, cell.maxs]));
            }
            let (mins, maxs) = match points.split_first() {
                None => (Vec3::ZERO, Vec3::ZERO),
                Some((&first, rest)) => rest.iter().fold((first, first), |(mins, maxs), &p| {
                    (mins.min(p), maxs.max(p))
                }),
            };
            self.bsp.models.push(Model {
                mins,
                maxs,
                first_surface: int(first_surface),
                num_surfaces: int(end_surface - first_surface),
                first_brush: int(first_brush),
                num_brushes: int(end_brush - first_brush),
            });
        }
    }

    /// Splits `region` by the faces of cells until each part is one cell or solid.
    pub(super) fn build_node(&mut self, cells: &[Cell], region: Cell) -> Child {
        for cell in cells {
            for axis in 0..3 {
                for at in [cell.mins[axis], cell.maxs[axis]] {
                    if at > region.mins[axis] && at < region.maxs[axis] {
                        return self.split(cells, region, axis, at);
                    }
                }
            }
        }
        Child::Leaf(self.push_leaf(cells.first().map(|cell| Cell {
            cluster: cell.cluster,
            ..region
        })))
    }

    fn split(&mut self, cells: &[Cell], region: Cell, axis: usize, at: f32) -> Child {
        let mut normal = Vec3::ZERO;
        normal[axis] = 1.0;
        let plane = self.plane(normal, at);
        let node = self.bsp.nodes.len();
        self.bsp.nodes.push(Node {
            plane,
            children: [Child::Node(NodeId::ROOT); 2],
            mins: whole(region.mins),
            maxs: whole(region.maxs),
        });
        let (mut front, mut back) = (region, region);
        front.mins[axis] = at;
        back.maxs[axis] = at;
        let in_front: Vec<Cell> = cells
            .iter()
            .filter(|c| c.maxs[axis] > at)
            .copied()
            .collect();
        let behind: Vec<Cell> = cells
            .iter()
            .filter(|c| c.mins[axis] < at)
            .copied()
            .collect();
        let children = [
            self.build_node(&in_front, front),
            self.build_node(&behind, back),
        ];
        if let Some(node) = self.bsp.nodes.get_mut(node) {
            node.children = children;
        }
        Child::Node(NodeId(int(node)))
    }

    /// Adds a leaf with the world's surfaces and brushes that touch it; `None` makes an empty one.
    /// Leafs outside all cells are solid and list nothing.
    pub(super) fn push_leaf(&mut self, cell: Option<Cell>) -> LeafId {
        let dummy = self.bsp.leafs.is_empty();
        let first_leaf_surface = int(self.bsp.leaf_surfaces.len());
        let first_leaf_brush = int(self.bsp.leaf_brushes.len());
        if let Some(cell) = cell {
            let overlaps = |mins: Vec3, maxs: Vec3| {
                mins.cmple(cell.maxs + 1.0).all() && maxs.cmpge(cell.mins - 1.0).all()
            };
            // The world's surfaces and brushes are the first.
            let world = self.bsp.models.first().copied();
            let (surfaces, brushes) =
                world.map_or((0, 0), |world| (world.num_surfaces, world.num_brushes));
            let mut listed = Vec::new();
            for id in (0..surfaces).map(SurfaceId) {
                let surface = self.bsp.surface(id);
                let points = self
                    .bsp
                    .surface_vertices(surface)
                    .iter()
                    .map(|v| v.finite().position);
                let (mins, maxs) = if surface.kind == SurfaceKind::Flare {
                    (surface.lightmap_origin, surface.lightmap_origin)
                } else {
                    points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| {
                        (a.min(p), b.max(p))
                    })
                };
                if overlaps(mins, maxs) {
                    listed.push(id);
                }
            }
            self.bsp.leaf_surfaces.extend(listed);
            let mut listed = Vec::new();
            for id in (0..brushes).map(BrushId) {
                let sides = self.bsp.sides_of(self.bsp.brush(id));
                let outside = sides.iter().any(|side| {
                    let plane = self.bsp.plane(side.plane);
                    let lowest = Vec3::select(plane.normal.cmpgt(Vec3::ZERO), cell.mins, cell.maxs);
                    plane.distance(lowest) > 1.0
                });
                if !outside {
                    listed.push(id);
                }
            }
            self.bsp.leaf_brushes.extend(listed);
        }
        let bounds = cell.map_or((Vec3::ZERO, Vec3::ZERO), |cell| (cell.mins, cell.maxs));
        let unused = if dummy { 0 } else { -1 };
        self.bsp.leafs.push(Leaf {
            cluster: cell.map_or(unused, |cell| cell.cluster),
            area: if cell.is_some() { 0 } else { unused },
            mins: whole(bounds.0),
            maxs: whole(bounds.1),
            first_leaf_surface,
            num_leaf_surfaces: int(self.bsp.leaf_surfaces.len()) - first_leaf_surface,
            first_leaf_brush,
            num_leaf_brushes: int(self.bsp.leaf_brushes.len()) - first_leaf_brush,
        });
        LeafId(last(&self.bsp.leafs))
    }
}
