//! Visibility between clusters, independent of the map, for queries about moving objects in every frame.

use glam::{Vec3, Vec4};
use q3bsp::{Bsp, Child, Leaf, Node, NodeId};
use support::Aabb;

/// A set of clusters.
#[derive(Debug, Clone, Default, PartialEq, Eq, Hash)]
pub struct ClusterSet(Vec<u64>);

impl ClusterSet {
    /// The empty set for a map of `count` clusters.
    pub fn none(count: usize) -> Self {
        Self(vec![0; count.div_ceil(64)])
    }

    /// The set of all clusters of a map.
    pub fn all(count: usize) -> Self {
        let mut bits = Self::none(count);
        (0..count).for_each(|i| bits.insert(i));
        bits
    }

    /// Adds a cluster; indices beyond the map's are ignored.
    pub fn insert(&mut self, bit: usize) {
        if let Some(word) = self.0.get_mut(bit / 64) {
            *word |= 1 << (bit % 64);
        }
    }

    /// Whether a cluster is in it.
    pub fn contains(&self, bit: usize) -> bool {
        self.0
            .get(bit / 64)
            .is_some_and(|word| word >> (bit % 64) & 1 == 1)
    }

    /// Union with another set.
    pub fn merge(&mut self, other: &Self) {
        for (word, more) in self.0.iter_mut().zip(&other.0) {
            *word |= more;
        }
    }

    /// Intersection with another set.
    pub fn keep(&mut self, other: &Self) {
        for (word, kept) in self.0.iter_mut().zip(&other.0) {
            *word &= kept;
        }
    }

    /// Whether it contains no cluster.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(|&word| word == 0)
    }

    /// Its clusters, ascending.
    pub fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().enumerate().flat_map(|(at, &word)| {
            let mut rest = word;
            std::iter::from_fn(move || {
                let bit = (rest != 0).then(|| rest.trailing_zeros() as usize)?;
                rest &= rest - 1;
                Some(at * 64 + bit)
            })
        })
    }
}

/// The largest distance of a point of a box from a plane, positive in front.
pub(super) fn furthest_in_front(bounds: Aabb, normal: Vec3, dist: f32) -> f32 {
    bounds.farthest(normal).dot(normal) - dist
}

/// Cluster lookup and visibility of a map.
#[derive(Debug, Clone, Default)]
pub struct Sight {
    /// Number of clusters; 0 for a map without a visibility matrix, where all positions are mutually visible.
    count: usize,
    /// For every cluster those that it sees or is seen from: compilers write matrices that are not symmetric, and
    /// light travels both ways.
    sees: Vec<ClusterSet>,
    /// Plane and children of each node.
    nodes: Vec<(Vec4, [Child; 2])>,
    /// Cluster of each leaf; `None` in solid space.
    leaf_clusters: Vec<Option<usize>>,
}

impl Sight {
    /// The clusters of a map.
    pub fn new(bsp: &Bsp) -> Self {
        let count = bsp.visibility.as_ref().map_or(0, |v| v.clusters);
        let mut sees = vec![ClusterSet::none(count); count];
        if let Some(visibility) = &bsp.visibility {
            for from in 0..count {
                for to in visibility.visible_from(from) {
                    for (a, b) in [(from, to), (to, from)] {
                        if let Some(bits) = sees.get_mut(a) {
                            bits.insert(b);
                        }
                    }
                }
            }
        }
        let node = |node: &Node| {
            let plane = bsp.plane(node.plane);
            (plane.normal.extend(plane.dist), node.children)
        };
        Self {
            count,
            sees,
            nodes: bsp.nodes.iter().map(node).collect(),
            leaf_clusters: bsp.leafs.iter().map(Leaf::cluster_index).collect(),
        }
    }

    /// Number of clusters.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Cluster of a point; `None` in solid.
    pub fn cluster_at(&self, point: Vec3) -> Option<usize> {
        // A map without nodes has no clusters.
        let mut at = self.nodes.first()?;
        // No way down is longer than the number of nodes.
        for _ in 0..self.nodes.len() {
            let &(plane, [front, back]) = at;
            let in_front = plane.truncate().dot(point) >= plane.w;
            match if in_front { front } else { back } {
                Child::Node(node) => at = self.nodes.get(node.index())?,
                Child::Leaf(leaf) => {
                    let cluster = *self.leaf_clusters.get(leaf.index())?;
                    return cluster.filter(|c| *c < self.count);
                }
            }
        }
        None
    }

    /// Clusters of the leafs that intersect a box, world space.
    pub fn touching(&self, bounds: Aabb) -> ClusterSet {
        let mut at = ClusterSet::none(self.count);
        if self.nodes.is_empty() {
            return at;
        }
        let mut stack = vec![Child::Node(NodeId::ROOT)];
        while let Some(child) = stack.pop() {
            let node = match child {
                Child::Node(node) => self.nodes.get(node.index()),
                Child::Leaf(leaf) => {
                    // A leaf in solid space has no cluster.
                    if let Some(&Some(cluster)) = self.leaf_clusters.get(leaf.index()) {
                        at.insert(cluster);
                    }
                    continue;
                }
            };
            let Some(&(plane, children)) = node else {
                debug_assert!(false, "{child:?} of {}", self.nodes.len());
                continue;
            };
            let (normal, dist) = (plane.truncate(), plane.w);
            if furthest_in_front(bounds, normal, dist) >= 0.0 {
                stack.push(children[0]);
            }
            if furthest_in_front(bounds, -normal, -dist) >= 0.0 {
                stack.push(children[1]);
            }
        }
        at
    }

    /// Clusters that see one of the given clusters or are seen from it; all when none is given.
    pub fn lit_from(&self, at: &ClusterSet) -> ClusterSet {
        if at.is_empty() {
            return ClusterSet::all(self.count);
        }
        let mut lit = ClusterSet::none(self.count);
        for cluster in at.iter() {
            if let Some(sees) = self.sees.get(cluster) {
                lit.merge(sees);
            }
        }
        lit
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_is_in_the_cluster_of_its_leaf() {
        // leafs: 0 in solid, 1 above in cluster 0, 2 below in cluster 5, which does not exist
        let mut sight = Sight {
            count: 2,
            sees: vec![ClusterSet::all(2); 2],
            nodes: vec![
                (Vec4::new(0.0, 0.0, 1.0, 8.0), [-2, 1].map(Child::from_raw)),
                (Vec4::new(1.0, 0.0, 0.0, 0.0), [-1, -3].map(Child::from_raw)),
            ],
            leaf_clusters: vec![None, Some(0), Some(5)],
        };
        assert_eq!(sight.cluster_at(Vec3::Z * 9.0), Some(0));
        assert_eq!(sight.cluster_at(Vec3::X), None);
        assert_eq!(sight.cluster_at(-Vec3::X), None);
        sight.nodes[1].1 = [Child::from_raw(1); 2];
        assert_eq!(sight.cluster_at(Vec3::X), None, "a tree in circles ends");
        assert_eq!(Sight::default().cluster_at(Vec3::ZERO), None);
    }

    #[test]
    fn sets_iterate_what_was_inserted() {
        let mut bits = ClusterSet::none(200);
        for bit in [0, 63, 64, 130, 199, 400] {
            bits.insert(bit);
        }
        assert_eq!(bits.iter().collect::<Vec<_>>(), [0, 63, 64, 130, 199]);
        assert!(bits.contains(63) && !bits.contains(62) && !bits.contains(400));
        assert_eq!(ClusterSet::all(70).iter().count(), 70);
        assert!(ClusterSet::none(3).is_empty() && !bits.is_empty());
    }
}
