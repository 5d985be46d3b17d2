//! Visible surfaces of the world for a view.
//!
//! Source: engine behaviour: the leafs of the clusters in the camera cluster's row of the visibility lump whose area is
//! not hidden, their ancestors, the frustum against the nodes' boxes, and each surface of the remaining leafs once.

use glam::{Vec3, Vec4};
use q3bsp::{Bsp, Child, LeafId, NodeId};
use support::Aabb;

use super::WorldData;

/// Stack of children to visit, newest first; it allocates memory only for deep trees.
struct Pending {
    near: [Child; 64],
    count: usize,
    rest: Vec<Child>,
}

impl Default for Pending {
    fn default() -> Self {
        Self {
            near: [Child::Node(NodeId::ROOT); 64],
            count: 0,
            rest: Vec::new(),
        }
    }
}

impl Pending {
    fn push(&mut self, child: Child) {
        match self.near.get_mut(self.count) {
            Some(place) => {
                *place = child;
                self.count += 1;
            }
            None => self.rest.push(child),
        }
    }

    fn pop(&mut self) -> Option<Child> {
        if let Some(child) = self.rest.pop() {
            return Some(child);
        }
        self.count = self.count.checked_sub(1)?;
        self.near.get(self.count).copied()
    }
}

#[derive(Clone, Debug)]
struct TreeNode {
    children: [Child; 2],
    bounds: Aabb,
    parent: Option<NodeId>,
}

#[derive(Clone, Debug)]
struct TreeLeaf {
    cluster: i32,
    area: i32,
    bounds: Aabb,
    /// `None` for leafs that no node refers to.
    parent: Option<NodeId>,
}

/// The BSP tree with parents.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    nodes: Vec<TreeNode>,
    leafs: Vec<TreeLeaf>,
}

fn bounds_of(mins: [i32; 3], maxs: [i32; 3]) -> Aabb {
    let to = |v: [i32; 3]| Vec3::from_array(v.map(|c| c as f32));
    Aabb::new(to(mins), to(maxs))
}

impl Tree {
    /// The tree of a map. Of several nodes that refer to the same leaf, one is its parent.
    pub fn new(bsp: &Bsp) -> Self {
        let mut tree = Self {
            nodes: bsp
                .nodes
                .iter()
                .map(|node| TreeNode {
                    children: node.children,
                    bounds: bounds_of(node.mins, node.maxs),
                    parent: None,
                })
                .collect(),
            leafs: bsp
                .leafs
                .iter()
                .map(|leaf| TreeLeaf {
                    cluster: leaf.cluster,
                    area: leaf.area,
                    bounds: bounds_of(leaf.mins, leaf.maxs),
                    parent: None,
                })
                .collect(),
        };
        let mut pending = Vec::from_iter(tree.root());
        while let Some(child) = pending.pop() {
            let Child::Node(at) = child else {
                continue; // a leaf has no children
            };
            for child in bsp.node(at).children {
                let parent = match child {
                    Child::Node(node) => tree.nodes.get_mut(node.index()).map(|n| &mut n.parent),
                    Child::Leaf(leaf) => tree.leafs.get_mut(leaf.index()).map(|l| &mut l.parent),
                };
                if let Some(parent) = parent {
                    *parent = Some(at);
                }
                pending.push(child);
            }
        }
        tree
    }

    /// Calls `visit` for every leaf that the box touches, front children first.
    pub fn leafs_in_box(&self, bsp: &Bsp, bounds: &Aabb, mut visit: impl FnMut(LeafId)) {
        let mut pending = Pending::default();
        if let Some(root) = self.root() {
            pending.push(root);
        }
        while let Some(child) = pending.pop() {
            match child {
                Child::Leaf(leaf) => visit(leaf),
                Child::Node(node) => {
                    let node = bsp.node(node);
                    let plane = bsp.plane(node.plane);
                    let side = Side::of(bounds, plane.normal, plane.dist);
                    let [front, back] = node.children;
                    if side.back {
                        pending.push(back);
                    }
                    if side.front {
                        pending.push(front);
                    }
                }
            }
        }
    }

    /// The root; `None` for an empty tree.
    fn root(&self) -> Option<Child> {
        (!self.nodes.is_empty()).then_some(Child::Node(NodeId::ROOT))
    }
}

/// The sides of a plane that a box reaches.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Side {
    pub front: bool,
    pub back: bool,
}

impl Side {
    /// A box that only touches the plane is in front.
    pub fn of(bounds: &Aabb, normal: Vec3, dist: f32) -> Self {
        Self {
            front: normal.dot(bounds.farthest(normal)) >= dist,
            back: normal.dot(bounds.nearest(normal)) < dist,
        }
    }
}

/// Whether a box lies wholly outside of one of the planes (`xyz.p >= w` is inside).
pub(crate) fn outside(bounds: &Aabb, planes: &[Vec4]) -> bool {
    planes.iter().any(|plane| {
        let normal = plane.truncate();
        normal.dot(bounds.farthest(normal)) < plane.w
    })
}

/// Input of [`VisibleSet::gather`].
#[derive(Clone, Copy, Debug)]
pub struct VisibleQuery<'a> {
    /// Point whose cluster selects the potentially visible set.
    pub pvs_origin: Vec3,
    /// A set bit hides that area.
    pub area_mask: &'a [u8; 32],
    /// Planes that face inwards; empty for views in all directions.
    pub frustum: &'a [Vec4],
    /// Surfaces outside of the frustum are omitted.
    pub culls: bool,
    /// Everything is potentially visible (`r_novis`).
    pub no_vis: bool,
    /// The clusters of the last call are kept (`r_lockpvs`); without a last call all are visible.
    pub locked: bool,
    /// A change recomputes the visible set; unless 0, the cluster is logged (`r_showcluster`).
    pub show_cluster: i32,
}

/// The potentially visible part of the world; its memory is reused between frames.
#[derive(Clone, Debug, Default)]
pub struct VisibleSet {
    /// Visible surfaces of the world (model 0), in the engine's order, each once.
    pub surfaces: Vec<u32>,
    /// Bounds of the visible leafs in the frustum; `Aabb::EMPTY` if there are none.
    pub bounds: Aabb,
    /// Number of visible leafs in the last call.
    pub leafs: u32,
    marked_for: Option<(i32, [u8; 32], bool, i32)>,
    node_marks: Vec<bool>,
    leaf_marks: Vec<bool>,
    surface_stamps: Vec<u32>,
    stamp: u32,
    pending: Vec<Child>,
}

impl VisibleSet {
    /// Cluster of the last call; `None` before the first.
    pub fn cluster(&self) -> Option<i32> {
        self.marked_for.map(|(cluster, ..)| cluster)
    }

    /// Finds the visible surfaces.
    pub fn gather(&mut self, world: &WorldData, query: &VisibleQuery<'_>) {
        let tree = &world.tree;
        self.mark(world, query);
        self.surfaces.clear();
        self.bounds = Aabb::EMPTY;
        self.leafs = 0;
        self.surface_stamps.resize(world.surfaces.len(), 0);
        self.stamp = self.stamp.wrapping_add(1);
        if self.stamp == 0 {
            self.surface_stamps.fill(0);
            self.stamp = 1;
        }
        let culled = |bounds: &Aabb| query.culls && outside(bounds, query.frustum);
        self.pending.clear();
        self.pending.extend(tree.root());
        while let Some(child) = self.pending.pop() {
            match child {
                Child::Node(id) => {
                    let marked = self.node_marks.get(id.index()) == Some(&true);
                    let Some(node) = tree.nodes.get(id.index()).filter(|_| marked) else {
                        // Not in the potentially visible set.
                        continue;
                    };
                    if culled(&node.bounds) {
                        continue;
                    }
                    self.pending.push(node.children[1]);
                    self.pending.push(node.children[0]);
                }
                Child::Leaf(id) => {
                    let marked = self.leaf_marks.get(id.index()) == Some(&true);
                    let Some(leaf) = tree.leafs.get(id.index()).filter(|_| marked) else {
                        // Not in the potentially visible set.
                        continue;
                    };
                    if !outside(&leaf.bounds, query.frustum) {
                        self.bounds = self.bounds.with(leaf.bounds.mins).with(leaf.bounds.maxs);
                    }
                    if !culled(&leaf.bounds) {
                        self.leafs += 1;
                        self.add_leaf(world, id);
                    }
                }
            }
        }
    }

    fn add_leaf(&mut self, world: &WorldData, leaf: LeafId) {
        let bsp = &world.relit.bsp;
        for &surface in bsp.leaf_surface_ids(bsp.leaf(leaf)) {
            if let Some(stamp) = self.surface_stamps.get_mut(surface.index())
                && *stamp != self.stamp
            {
                *stamp = self.stamp;
                self.surfaces.push(surface.index() as u32);
            }
        }
    }

    /// Marks the leafs of the camera's potentially visible set and their ancestors.
    fn mark(&mut self, world: &WorldData, query: &VisibleQuery<'_>) {
        let tree = &world.tree;
        let bsp = &world.relit.bsp;
        if query.locked {
            // before the first call everything counts as visible
            if self.marked_for.is_none() {
                self.node_marks.clear();
                self.node_marks.resize(tree.nodes.len(), true);
                self.leaf_marks.clear();
                self.leaf_marks.resize(tree.leafs.len(), true);
            }
            return;
        }
        let cluster = bsp.cluster_at(query.pvs_origin);
        let wanted = (cluster, *query.area_mask, query.no_vis, query.show_cluster);
        if self.marked_for == Some(wanted) {
            return;
        }
        if query.show_cluster != 0 {
            let area = bsp.leaf(bsp.leaf_at(query.pvs_origin)).area;
            log::info!("cluster:{cluster}  area:{area}");
        }
        self.marked_for = Some(wanted);
        self.node_marks.clear();
        self.node_marks.resize(tree.nodes.len(), false);
        self.leaf_marks.clear();
        self.leaf_marks.resize(tree.leafs.len(), false);
        let everything = query.no_vis || cluster < 0;
        for (leaf, mark) in tree.leafs.iter().zip(&mut self.leaf_marks) {
            // leafs without a cluster are solid and list no surfaces
            if leaf.cluster < 0 && !everything {
                continue;
            }
            if !everything {
                if !bsp.cluster_sees(cluster, leaf.cluster) {
                    continue;
                }
                let hidden = usize::try_from(leaf.area)
                    .ok()
                    .and_then(|area| Some(query.area_mask.get(area / 8)? & (1 << (area % 8)) != 0));
                if hidden.unwrap_or(false) {
                    continue;
                }
            }
            *mark = true;
            let mut at = leaf.parent;
            while let Some(node) = at
                && let Some(mark) = self.node_marks.get_mut(node.index())
                && !std::mem::replace(mark, true)
            {
                at = tree.nodes.get(node.index()).and_then(|n| n.parent);
            }
        }
    }
}
