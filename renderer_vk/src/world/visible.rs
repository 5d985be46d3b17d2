//! Which surfaces of the world a view can see.
//!
//! Source: engine behaviour: the leafs of the clusters in the eye's row of the visibility lump whose area is not
//! hidden, their ancestors, the frustum against the nodes' boxes, and each surface of what is left once.

use glam::{Vec3, Vec4};
use q3bsp::Bsp;
use support::Aabb;

use super::WorldData;

/// A child of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Child {
    Node(u32),
    Leaf(u32),
    /// Leads nowhere: out of range, or to a node that has another parent already.
    Nothing,
}

/// Children still to be visited, newest first. Memory is taken only for deep trees.
struct Pending {
    near: [Child; 64],
    count: usize,
    rest: Vec<Child>,
}

impl Default for Pending {
    fn default() -> Self {
        Self {
            near: [Child::Nothing; 64],
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
    parent: u32,
    plane: u32,
}

#[derive(Clone, Debug)]
struct TreeLeaf {
    cluster: i32,
    area: i32,
    bounds: Aabb,
    /// `NO_PARENT` for leafs that the tree does not reach.
    parent: u32,
}

const NO_PARENT: u32 = u32::MAX;

/// The BSP tree with parents, every node at most once.
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
    /// The tree of a map; what could be reached twice is reached once.
    pub fn new(bsp: &Bsp) -> Self {
        let mut tree = Self {
            nodes: bsp
                .nodes
                .iter()
                .map(|node| TreeNode {
                    children: [Child::Nothing; 2],
                    bounds: bounds_of(node.mins, node.maxs),
                    parent: NO_PARENT,
                    plane: u32::try_from(node.plane).unwrap_or(0),
                })
                .collect(),
            leafs: bsp
                .leafs
                .iter()
                .map(|leaf| TreeLeaf {
                    cluster: leaf.cluster,
                    area: leaf.area,
                    bounds: bounds_of(leaf.mins, leaf.maxs),
                    parent: NO_PARENT,
                })
                .collect(),
        };
        let mut seen = vec![false; tree.nodes.len()];
        if let Some(root) = seen.first_mut() {
            *root = true;
        }
        let mut pending = vec![0u32];
        while let Some(at) = pending.pop() {
            let Some(stored) = bsp.nodes.get(at as usize) else {
                continue;
            };
            let children = stored.children.map(|child| match u32::try_from(child) {
                Ok(node) => match seen.get_mut(node as usize) {
                    Some(seen) if !*seen => {
                        *seen = true;
                        pending.push(node);
                        if let Some(node) = tree.nodes.get_mut(node as usize) {
                            node.parent = at;
                        }
                        Child::Node(node)
                    }
                    _ => Child::Nothing,
                },
                Err(_) => {
                    let leaf = u32::try_from(-1 - i64::from(child)).unwrap_or(u32::MAX);
                    match tree.leafs.get_mut(leaf as usize) {
                        Some(found) => {
                            found.parent = at;
                            Child::Leaf(leaf)
                        }
                        None => Child::Nothing,
                    }
                }
            });
            if let Some(node) = tree.nodes.get_mut(at as usize) {
                node.children = children;
            }
        }
        tree
    }

    /// Calls `visit` for every leaf that the box touches, front children first.
    pub fn leafs_in_box(&self, bsp: &Bsp, bounds: &Aabb, mut visit: impl FnMut(u32)) {
        let mut pending = Pending::default();
        pending.push(self.root());
        while let Some(child) = pending.pop() {
            match child {
                Child::Nothing => {}
                Child::Leaf(leaf) => visit(leaf),
                Child::Node(index) => {
                    let Some(node) = self.nodes.get(index as usize) else {
                        continue;
                    };
                    let side = bsp
                        .planes
                        .get(node.plane as usize)
                        .map_or(Side::BOTH, |p| Side::of(bounds, p.normal, p.dist));
                    if side.back {
                        pending.push(node.children[1]);
                    }
                    if side.front {
                        pending.push(node.children[0]);
                    }
                }
            }
        }
    }

    fn root(&self) -> Child {
        if !self.nodes.is_empty() {
            Child::Node(0)
        } else if !self.leafs.is_empty() {
            Child::Leaf(0)
        } else {
            Child::Nothing
        }
    }
}

/// On which sides of a plane a box has points.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Side {
    pub front: bool,
    pub back: bool,
}

impl Side {
    const BOTH: Self = Self {
        front: true,
        back: true,
    };

    /// A box that only touches the plane counts as in front.
    pub fn of(bounds: &Aabb, normal: Vec3, dist: f32) -> Self {
        Self {
            front: normal.dot(bounds.farthest(normal)) >= dist,
            back: normal.dot(bounds.nearest(normal)) < dist,
        }
    }
}

/// Whether a box lies wholly outside one of the planes (`xyz.p >= w` is inside).
pub(crate) fn outside(bounds: &Aabb, planes: &[Vec4]) -> bool {
    planes.iter().any(|plane| {
        let normal = plane.truncate();
        normal.dot(bounds.farthest(normal)) < plane.w
    })
}

/// What is asked of [`VisibleSet::gather`].
#[derive(Clone, Copy, Debug)]
pub struct VisibleQuery<'a> {
    /// Point whose cluster decides.
    pub pvs_origin: Vec3,
    /// A set bit hides that area.
    pub area_mask: &'a [u8; 32],
    /// Planes pointing inwards; empty for everything around.
    pub frustum: &'a [Vec4],
    /// Surfaces outside of the frustum are left out.
    pub culls: bool,
    /// Everything is potentially visible (`r_novis`).
    pub no_vis: bool,
    /// The clusters of the last call stay (`r_lockpvs`); everything, if there was none.
    pub locked: bool,
    /// A change finds the visible part anew; other than 0 its cluster is logged (`r_showcluster`).
    pub show_cluster: i32,
}

/// The potentially visible part of the world, kept from frame to frame.
#[derive(Clone, Debug, Default)]
pub struct VisibleSet {
    /// Visible surfaces of the world (model 0), in the engine's order, each once.
    pub surfaces: Vec<u32>,
    /// Bounds of the visible leafs in the frustum; `Aabb::EMPTY` when there are none.
    pub bounds: Aabb,
    /// Leafs in sight of the last call.
    pub leafs: u32,
    marked_for: Option<(i32, [u8; 32], bool, i32)>,
    node_marks: Vec<bool>,
    leaf_marks: Vec<bool>,
    surface_stamps: Vec<u32>,
    stamp: u32,
    pending: Vec<Child>,
}

impl VisibleSet {
    /// Cluster that the last call was for; `None` before the first.
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
        self.pending.push(tree.root());
        while let Some(child) = self.pending.pop() {
            match child {
                Child::Nothing => {}
                Child::Node(index) => {
                    let marked = self.node_marks.get(index as usize) == Some(&true);
                    let Some(node) = tree.nodes.get(index as usize).filter(|_| marked) else {
                        continue;
                    };
                    if culled(&node.bounds) {
                        continue;
                    }
                    self.pending.push(node.children[1]);
                    self.pending.push(node.children[0]);
                }
                Child::Leaf(index) => {
                    let marked = self.leaf_marks.get(index as usize) == Some(&true);
                    let Some(leaf) = tree.leafs.get(index as usize).filter(|_| marked) else {
                        continue;
                    };
                    if !outside(&leaf.bounds, query.frustum) {
                        self.bounds = self.bounds.with(leaf.bounds.mins).with(leaf.bounds.maxs);
                    }
                    if !culled(&leaf.bounds) {
                        self.leafs += 1;
                        self.add_leaf(world, index);
                    }
                }
            }
        }
    }

    fn add_leaf(&mut self, world: &WorldData, leaf: u32) {
        let bsp = &world.relit.bsp;
        let Some(leaf) = bsp.leafs.get(leaf as usize) else {
            return;
        };
        for &surface in bsp.leaf_surface_indices(leaf) {
            let Ok(surface) = u32::try_from(surface) else {
                continue;
            };
            let Some(stamp) = self.surface_stamps.get_mut(surface as usize) else {
                continue;
            };
            if *stamp != self.stamp {
                *stamp = self.stamp;
                self.surfaces.push(surface);
            }
        }
    }

    /// Marks the leafs of the eye's potentially visible set and their ancestors.
    fn mark(&mut self, world: &WorldData, query: &VisibleQuery<'_>) {
        let tree = &world.tree;
        let bsp = &world.relit.bsp;
        if query.locked {
            // before anything was found, nothing is known to be out of sight
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
            let leaf = bsp.leafs.get(bsp.leaf_at(query.pvs_origin));
            let area = leaf.map_or(-1, |leaf| leaf.area);
            log::info!("cluster:{cluster}  area:{area}");
        }
        self.marked_for = Some(wanted);
        self.node_marks.clear();
        self.node_marks.resize(tree.nodes.len(), false);
        self.leaf_marks.clear();
        self.leaf_marks.resize(tree.leafs.len(), false);
        let everything = query.no_vis || cluster < 0;
        for (leaf, mark) in tree.leafs.iter().zip(&mut self.leaf_marks) {
            // leafs without cluster are solid; they list no surfaces
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
            while let Some(mark) = self.node_marks.get_mut(at as usize) {
                if std::mem::replace(mark, true) {
                    break;
                }
                at = tree.nodes.get(at as usize).map_or(NO_PARENT, |n| n.parent);
            }
        }
    }
}
