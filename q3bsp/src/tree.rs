//! Walking the tree, and slices that a validated map can hand out without a check.

use crate::flags::{content_flags, surface_flags};
use crate::lumps::{Brush, BrushSide, DrawVert, Leaf, Model, ShaderRef};
use crate::surface::Surface;
use crate::{Bsp, Plane};
use glam::Vec3;
use std::ops::Range;

/// A checked (first, count) pair as a range.
pub(crate) fn span(first: i32, count: i32) -> Range<usize> {
    let first = usize::try_from(first).unwrap_or(0);
    first..first.saturating_add(usize::try_from(count).unwrap_or(0))
}

impl Bsp {
    /// Index of the leaf that contains a point. Points on a plane belong to its back, as in the engine.
    /// Ends after as many steps as there are nodes, whatever they say; 0 for a map without nodes.
    pub fn leaf_at(&self, p: Vec3) -> usize {
        let mut at = 0i32;
        for _ in 0..=self.nodes.len() {
            let Some(node) = usize::try_from(at).ok().and_then(|at| self.nodes.get(at)) else {
                return 0;
            };
            let plane = usize::try_from(node.plane)
                .ok()
                .and_then(|plane| self.planes.get(plane));
            let in_front = plane.is_some_and(|plane: &Plane| plane.distance(p) > 0.0);
            let [front, back] = node.children;
            at = if in_front { front } else { back };
            if at < 0 {
                return usize::try_from(-1 - at).unwrap_or(0);
            }
        }
        0
    }

    /// Cluster of the leaf that contains a point; -1 outside and in solid space.
    pub fn cluster_at(&self, p: Vec3) -> i32 {
        self.leafs
            .get(self.leaf_at(p))
            .map_or(-1, |leaf| leaf.cluster)
    }

    /// Whether a point lies inside of something solid that is seen from outside: in a solid brush of the world of which
    /// some side is drawn. Detail brushes do not make solid leafs, so [`Bsp::cluster_at`] does not tell. `margin`: how far
    /// inside, id units.
    pub fn is_in_drawn_brush(&self, p: Vec3, margin: f32) -> bool {
        let has = |shader: i32, is: fn(&ShaderRef) -> bool| {
            let shader = usize::try_from(shader).ok();
            shader.and_then(|s| self.shaders.get(s)).is_some_and(is)
        };
        let solid = |s: &ShaderRef| s.content_flags & content_flags::SOLID != 0;
        let drawn = |s: &ShaderRef| s.surface_flags & surface_flags::NODRAW == 0;
        let leaf = self.leafs.get(self.leaf_at(p));
        let brushes = leaf.map_or(&[][..], |leaf| self.leaf_brush_indices(leaf));
        let brushes = brushes.iter().filter_map(|&index| {
            let index = usize::try_from(index).ok()?;
            self.brushes.get(index)
        });
        brushes.filter(|b| has(b.shader, solid)).any(|brush| {
            let sides = self.sides_of(brush);
            let behind = |side: &BrushSide| {
                let plane = self.plane_of(side);
                plane.is_some_and(|plane| plane.distance(p) < -margin)
            };
            !sides.is_empty()
                && sides.iter().all(behind)
                && sides.iter().any(|side| has(side.shader, drawn))
        })
    }

    /// Indices of the leafs that can be reached from the root, each once, front before back. Compilers
    /// also write leafs that cannot: a dummy leaf 0, and one per brush model whose surfaces would
    /// wrongly land in cluster 0.
    pub fn tree_leafs(&self) -> Vec<usize> {
        let mut found = Vec::new();
        let mut seen = vec![false; self.nodes.len()];
        let mut listed = vec![false; self.leafs.len()];
        let mut pending = if self.nodes.is_empty() {
            vec![]
        } else {
            vec![0i32]
        };
        while let Some(at) = pending.pop() {
            match usize::try_from(at) {
                Err(_) => {
                    let leaf = usize::try_from(-1 - at).unwrap_or(0);
                    if let Some(listed) = listed.get_mut(leaf)
                        && !std::mem::replace(listed, true)
                    {
                        found.push(leaf);
                    }
                }
                Ok(at) => {
                    if let (Some(node), Some(seen)) = (self.nodes.get(at), seen.get_mut(at))
                        && !std::mem::replace(seen, true)
                    {
                        pending.push(node.children[1]);
                        pending.push(node.children[0]);
                    }
                }
            }
        }
        found
    }

    /// For each cluster the surfaces that its leafs in the tree list, ascending, each once. A few maps
    /// have world surfaces that no leaf lists (they are never drawn by the engine).
    pub fn cluster_surfaces(&self) -> Vec<Vec<u32>> {
        let mut lists = vec![Vec::new(); self.num_clusters()];
        for leaf in self
            .tree_leafs()
            .into_iter()
            .filter_map(|at| self.leafs.get(at))
        {
            let list = usize::try_from(leaf.cluster)
                .ok()
                .and_then(|c| lists.get_mut(c));
            if let Some(list) = list {
                let surfaces = self.leaf_surface_indices(leaf);
                list.extend(surfaces.iter().filter_map(|&s| u32::try_from(s).ok()));
            }
        }
        for list in &mut lists {
            list.sort_unstable();
            list.dedup();
        }
        lists
    }

    /// The surface indices that a leaf lists.
    pub fn leaf_surface_indices(&self, leaf: &Leaf) -> &[i32] {
        self.leaf_surfaces
            .get(span(leaf.first_leaf_surface, leaf.num_leaf_surfaces))
            .unwrap_or(&[])
    }

    /// The brush indices that a leaf lists.
    pub fn leaf_brush_indices(&self, leaf: &Leaf) -> &[i32] {
        self.leaf_brushes
            .get(span(leaf.first_leaf_brush, leaf.num_leaf_brushes))
            .unwrap_or(&[])
    }

    /// The vertices, or control points, of a surface.
    pub fn surface_vertices(&self, surface: &Surface) -> &[DrawVert] {
        self.vertices
            .get(span(surface.first_vert, surface.num_verts))
            .unwrap_or(&[])
    }

    /// The triangle corners of a surface, relative to [`Bsp::surface_vertices`], clockwise seen from the
    /// front.
    pub fn surface_indices(&self, surface: &Surface) -> &[i32] {
        self.indices
            .get(span(surface.first_index, surface.num_indices))
            .unwrap_or(&[])
    }

    /// The surfaces of a model, as a range of [`Bsp::surfaces`].
    pub fn model_surfaces(&self, model: &Model) -> Range<usize> {
        span(model.first_surface, model.num_surfaces)
    }

    /// The sides of a brush.
    pub fn sides_of(&self, brush: &Brush) -> &[BrushSide] {
        self.brush_sides
            .get(span(brush.first_side, brush.num_sides))
            .unwrap_or(&[])
    }

    /// The plane of a brush side.
    pub fn plane_of(&self, side: &BrushSide) -> Option<&Plane> {
        self.planes.get(usize::try_from(side.plane).ok()?)
    }
}

#[cfg(test)]
mod tests {
    use crate::builder::MapBuilder;
    use crate::{content_flags, surface_flags};
    use glam::Vec3;

    #[test]
    fn inside_is_what_no_one_sees() {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/wall", 0, content_flags::SOLID);
        let hull = map.add_shader("t/hull", surface_flags::NODRAW, content_flags::SOLID);
        let clip = map.add_shader("t/clip", 0, content_flags::PLAYERCLIP);
        map.add_room(wall, Vec3::ZERO, Vec3::splat(400.0));
        let at = |x: f32| Vec3::new(x, 200.0, 200.0);
        for (x, shader) in [(100.0, wall), (200.0, hull), (300.0, clip)] {
            map.add_box_brush(shader, at(x) - 20.0, at(x) + 20.0);
        }
        let bsp = map.build();
        let inside = |x: f32, margin: f32| bsp.is_in_drawn_brush(at(x), margin);
        assert!(bsp.cluster_at(at(100.0)) >= 0 && inside(100.0, 0.0));
        // Nor is what nobody can see, or nothing bumps into, something to be in.
        assert!(!inside(200.0, 0.0) && !inside(300.0, 0.0) && !inside(160.0, 0.0));
        assert!(inside(119.0, 0.5) && !inside(119.0, 1.5));
        assert!(!inside(121.0, 0.0) && !inside(121.0, -0.5) && inside(121.0, -1.5));
    }
}
