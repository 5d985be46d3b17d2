//! Records of a validated map by their indices, the parts of lumps that they name, and walks through the tree.

use crate::Bsp;
use crate::bytes::{Fields, Record};
use crate::flags::{content_flags, surface_flags};
use crate::ids::{BrushId, Child, LeafId, NodeId, PlaneId, ShaderId, SurfaceId};
use crate::lumps::{Brush, BrushSide, DrawVert, Leaf, Model, Node, Plane, ShaderRef};
use crate::surface::Surface;
use glam::Vec3;
use std::ops::Range;
use std::sync::LazyLock;

/// A checked (first, count) pair as a range.
pub(crate) fn span(first: i32, count: i32) -> Range<usize> {
    let first = usize::try_from(first).unwrap_or(0);
    first..first.saturating_add(usize::try_from(count).unwrap_or(0))
}

/// The part of a lump that a checked (first, count) pair names; empty in release builds if it leads out of the lump.
fn part<T>(lump: &[T], first: i32, count: i32) -> &[T] {
    let part = lump.get(span(first, count));
    debug_assert!(part.is_some(), "{first} + {count} of {}", lump.len());
    part.unwrap_or_default()
}

macro_rules! records {
    ($($accessor:ident, $id:ident: $record:ident in $list:ident;)+) => {
        /// Records by their index. For a map that was changed by hand and not validated, an index outside its lump fails an
        /// assertion in debug builds; in release builds it names a record whose fields are all zero.
        impl Bsp { $(
            #[doc = concat!("The record of [`Bsp::", stringify!($list), "`] under an index of this map.")]
            pub fn $accessor(&self, id: $id) -> &$record {
                static ZEROS: LazyLock<$record> =
                    LazyLock::new(|| $record::decode(Fields::new(&[])));
                self.$list.get(id.index()).unwrap_or_else(|| {
                    debug_assert!(false, "{id:?} of {}", self.$list.len());
                    &ZEROS
                })
            }
        )+ }
    };
}

records! {
    shader, ShaderId: ShaderRef in shaders;
    plane, PlaneId: Plane in planes;
    node, NodeId: Node in nodes;
    leaf, LeafId: Leaf in leafs;
    surface, SurfaceId: Surface in surfaces;
    brush, BrushId: Brush in brushes;
}

impl Bsp {
    /// The leaf that contains a point. Points on a plane belong to its back, as in the engine.
    /// Ends after as many steps as there are nodes, whatever they say; leaf 0 for a map without nodes.
    pub fn leaf_at(&self, p: Vec3) -> LeafId {
        let mut at = NodeId::ROOT;
        for _ in 0..self.nodes.len() {
            let node = self.node(at);
            let [front, back] = node.children;
            let in_front = self.plane(node.plane).distance(p) > 0.0;
            match if in_front { front } else { back } {
                Child::Node(next) => at = next,
                Child::Leaf(leaf) => return leaf,
            }
        }
        LeafId(0)
    }

    /// Cluster of the leaf that contains a point; -1 outside and in solid space.
    pub fn cluster_at(&self, p: Vec3) -> i32 {
        // A map that was never parsed or built has no leafs.
        let leaf = self.leafs.get(self.leaf_at(p).index());
        leaf.map_or(-1, |leaf| leaf.cluster)
    }

    /// Whether a point lies inside of something solid that is seen from outside: in a solid brush of the world with a
    /// drawn side. Detail brushes do not make solid leafs, so [`Bsp::cluster_at`] cannot decide this. `margin`: how far
    /// inside, id units.
    pub fn is_in_drawn_brush(&self, p: Vec3, margin: f32) -> bool {
        let solid = |b: &Brush| self.shader(b.shader).content_flags & content_flags::SOLID != 0;
        let drawn =
            |s: &BrushSide| self.shader(s.shader).surface_flags & surface_flags::NODRAW == 0;
        let behind = |s: &BrushSide| self.plane(s.plane).distance(p) < -margin;
        let leaf = self.leafs.get(self.leaf_at(p).index());
        let brushes = leaf.map_or(&[][..], |leaf| self.leaf_brush_ids(leaf));
        brushes.iter().map(|&id| self.brush(id)).any(|brush| {
            let sides = self.sides_of(brush);
            solid(brush) && !sides.is_empty() && sides.iter().all(behind) && sides.iter().any(drawn)
        })
    }

    /// The leafs that can be reached from the root, each once, front before back. Compilers
    /// also write leafs that cannot: a dummy leaf 0, and one per brush model whose surfaces would
    /// wrongly land in cluster 0.
    pub fn tree_leafs(&self) -> Vec<LeafId> {
        let mut found = Vec::new();
        let mut seen = vec![false; self.nodes.len()];
        let mut listed = vec![false; self.leafs.len()];
        let is_first = |list: &mut Vec<bool>, at: usize| {
            list.get_mut(at)
                .is_some_and(|seen| !std::mem::replace(seen, true))
        };
        let mut pending = vec![Child::Node(NodeId::ROOT)];
        while let Some(at) = pending.pop() {
            match at {
                Child::Leaf(leaf) if is_first(&mut listed, leaf.index()) => found.push(leaf),
                Child::Node(node) if is_first(&mut seen, node.index()) => {
                    let [front, back] = self.node(node).children;
                    pending.extend([back, front]);
                }
                // A leaf may be the child of several nodes.
                Child::Leaf(_) | Child::Node(_) => {}
            }
        }
        found
    }

    /// For each cluster the surfaces that its leafs in the tree list, ascending, each once. A few maps
    /// have world surfaces that no leaf lists (they are never drawn by the engine).
    pub fn cluster_surfaces(&self) -> Vec<Vec<SurfaceId>> {
        let mut lists = vec![Vec::new(); self.num_clusters()];
        for leaf in self.tree_leafs().into_iter().map(|id| self.leaf(id)) {
            // A leaf in solid space has no cluster.
            if let Some(list) = leaf.cluster_index().and_then(|c| lists.get_mut(c)) {
                list.extend_from_slice(self.leaf_surface_ids(leaf));
            }
        }
        for list in &mut lists {
            list.sort_unstable();
            list.dedup();
        }
        lists
    }

    /// The surfaces that a leaf lists.
    pub fn leaf_surface_ids(&self, leaf: &Leaf) -> &[SurfaceId] {
        part(
            &self.leaf_surfaces,
            leaf.first_leaf_surface,
            leaf.num_leaf_surfaces,
        )
    }

    /// The brushes that a leaf lists.
    pub fn leaf_brush_ids(&self, leaf: &Leaf) -> &[BrushId] {
        part(
            &self.leaf_brushes,
            leaf.first_leaf_brush,
            leaf.num_leaf_brushes,
        )
    }

    /// The vertices, or control points, of a surface.
    pub fn surface_vertices(&self, surface: &Surface) -> &[DrawVert] {
        part(&self.vertices, surface.first_vert, surface.num_verts)
    }

    /// The triangle corners of a surface, relative to [`Bsp::surface_vertices`], clockwise seen from the
    /// front.
    pub fn surface_indices(&self, surface: &Surface) -> &[i32] {
        part(&self.indices, surface.first_index, surface.num_indices)
    }

    /// The triangles of a surface other than a patch or a flare: [`Bsp::surface_indices`] three by three, each an index of
    /// [`Bsp::surface_vertices`].
    pub fn surface_triangles(&self, surface: &Surface) -> impl Iterator<Item = [u32; 3]> + Clone {
        let (triangles, _) = self.surface_indices(surface).as_chunks::<3>();
        triangles
            .iter()
            .map(|corners| corners.map(i32::cast_unsigned))
    }

    /// The surfaces of a model, as a range of [`Bsp::surfaces`].
    pub fn model_surfaces(&self, model: &Model) -> Range<usize> {
        span(model.first_surface, model.num_surfaces)
    }

    /// The sides of a brush.
    pub fn sides_of(&self, brush: &Brush) -> &[BrushSide] {
        part(&self.brush_sides, brush.first_side, brush.num_sides)
    }

    /// The surfaces of a model.
    pub fn surfaces_of(&self, model: &Model) -> &[Surface] {
        part(&self.surfaces, model.first_surface, model.num_surfaces)
    }

    /// The brushes of a model.
    pub fn brushes_of(&self, model: &Model) -> &[Brush] {
        part(&self.brushes, model.first_brush, model.num_brushes)
    }
}

#[cfg(test)]
mod tests {
    use super::ShaderId;
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
        // Nor do invisible or non-solid brushes count.
        assert!(!inside(200.0, 0.0) && !inside(300.0, 0.0) && !inside(160.0, 0.0));
        assert!(inside(119.0, 0.5) && !inside(119.0, 1.5));
        assert!(!inside(121.0, 0.0) && !inside(121.0, -0.5) && inside(121.0, -1.5));
    }

    #[test]
    #[cfg_attr(debug_assertions, should_panic(expected = "ShaderId(-1) of 1"))]
    fn an_index_that_was_not_validated_names_a_record_of_zeros() {
        let bsp = MapBuilder::new().build();
        assert_eq!(bsp.shader(ShaderId::from_raw(0)).name, "noshader");
        assert_eq!(bsp.shader(ShaderId::from_raw(-1)).name, "");
    }
}
