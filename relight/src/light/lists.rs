//! Light lists from the PVS: the lights that may reach each cluster.
//!
//! A light is in a cluster's list when a cluster that the light lies in sees the cluster or is seen from it
//! (compilers write asymmetric matrices, and light travels both ways), unless the whole cluster lies behind a
//! one-sided light.

use super::sight::{ClusterSet, Sight, furthest_in_front};
use super::{LightLists, PointLight, TriangleLight};
use crate::world::WorldSurface;
use glam::Vec3;
use q3bsp::Bsp;
use std::collections::HashMap;
use support::Aabb;

/// Distance that a cluster must reach in front of a light's plane, id units: leaf bounds are integers, and a
/// light's own plane bounds the leafs that it lights.
const PLANE_SLACK: f32 = 0.125;

/// Margin around the bounds of a surface that no leaf lists, id units.
const SEARCH_MARGIN: f32 = 2.0;

/// Clusters of a map, indexed for visibility queries.
pub(crate) struct Clusters {
    sight: Sight,
    /// Bounds of the leafs of every cluster; `EMPTY` for clusters without a leaf in the tree.
    bounds: Vec<Aabb>,
    /// Clusters whose leafs list a surface.
    of_surface: Vec<Vec<u32>>,
}

impl Clusters {
    pub fn new(bsp: &Bsp) -> Self {
        let sight = Sight::new(bsp);
        let count = sight.count();
        let mut bounds = vec![Aabb::EMPTY; count];
        let mut of_surface = vec![Vec::new(); bsp.surfaces.len()];
        for leaf in bsp.tree_leafs().into_iter().map(|id| bsp.leaf(id)) {
            let Some(cluster) = leaf.cluster_index() else {
                // Solid space has no cluster.
                continue;
            };
            if let Some(bounds) = bounds.get_mut(cluster) {
                let corner = |c: [i32; 3]| Vec3::from_array(c.map(|v| v as f32));
                *bounds = bounds.union(Aabb::new(corner(leaf.mins), corner(leaf.maxs)));
            }
            for &surface in bsp.leaf_surface_ids(leaf) {
                let clusters: Option<&mut Vec<u32>> = of_surface.get_mut(surface.index());
                if let Some(clusters) = clusters
                    && clusters.last() != Some(&(cluster as u32))
                {
                    clusters.push(cluster as u32);
                }
            }
        }
        Self {
            sight,
            bounds,
            of_surface,
        }
    }

    /// Clusters that a triangle light lies in: those that its bounds touch; of a world surface only clusters that
    /// list it. (World surfaces that no leaf lists, and brush models, use their bounds alone.)
    fn clusters_of(&self, light: &TriangleLight, listed: &ClusterSet) -> ClusterSet {
        let margin = Vec3::splat(SEARCH_MARGIN);
        let mut at = self.sight.touching(Aabb::of(light.vertices).grown(margin));
        if !listed.is_empty() {
            at.keep(listed);
            if at.is_empty() {
                return listed.clone();
            }
        }
        at
    }

    /// Clusters whose leafs list a world surface; empty for surfaces of brush models.
    fn listing(&self, index: usize, surfaces: &[WorldSurface]) -> ClusterSet {
        let mut at = ClusterSet::none(self.sight.count());
        if surfaces.get(index).is_some_and(|s| s.model == 0) {
            for &cluster in self.of_surface.get(index).into_iter().flatten() {
                at.insert(cluster as usize);
            }
        }
        at
    }

    /// Whether a part of a cluster may lie on an emitting side of a light.
    fn faces(&self, light: &TriangleLight, cluster: usize) -> bool {
        let Some(bounds) = self.bounds.get(cluster).filter(|_| !light.two_sided) else {
            return true;
        };
        let normal = light.normal();
        let dist = normal.dot(light.vertices[0]);
        furthest_in_front(*bounds, normal, dist) > PLANE_SLACK
    }

    /// For each cluster, whether it can see a surface that `is_sky`. Empty (unknown) if there is no such surface or
    /// one belongs to a brush model.
    fn sky(&self, surfaces: &[WorldSurface], is_sky: impl Fn(&WorldSurface) -> bool) -> Vec<bool> {
        let mut at = ClusterSet::none(self.sight.count());
        for (index, surface) in surfaces.iter().enumerate() {
            if surface.num_indices == 0 || !is_sky(surface) {
                continue;
            }
            let listing = self.listing(index, surfaces);
            if listing.is_empty() {
                return Vec::new();
            }
            at.merge(&listing);
        }
        if at.is_empty() {
            return Vec::new();
        }
        let lit = self.sight.lit_from(&at);
        (0..self.sight.count()).map(|c| lit.contains(c)).collect()
    }

    /// Light lists. `facing`: without lights that face away from the cluster; `is_sky`: whether a surface is sky.
    pub fn lists(
        &self,
        lights: &[TriangleLight],
        points: &[PointLight],
        surfaces: &[WorldSurface],
        facing: bool,
        is_sky: impl Fn(&WorldSurface) -> bool,
    ) -> LightLists {
        let mut rows: Vec<Vec<u32>> = vec![Vec::new(); self.sight.count()];
        let mut listed: Option<(u32, ClusterSet)> = None;
        let mut known: HashMap<ClusterSet, ClusterSet> = HashMap::new();
        for (entry, light) in (0u32..).zip(lights) {
            let (surface, listing) = match listed.take() {
                Some((surface, listing)) if surface == light.surface => (surface, listing),
                _ => (
                    light.surface,
                    self.listing(light.surface as usize, surfaces),
                ),
            };
            let at = self.clusters_of(light, &listing);
            listed = Some((surface, listing));
            let lit = known
                .entry(at)
                .or_insert_with_key(|at| self.sight.lit_from(at));
            for cluster in lit.iter().filter(|&c| !facing || self.faces(light, c)) {
                if let Some(row) = rows.get_mut(cluster) {
                    row.push(entry);
                }
            }
        }
        for (entry, point) in (lights.len() as u32..).zip(points) {
            let margin = Vec3::splat(SEARCH_MARGIN.max(point.radius));
            let at = self.sight.touching(Aabb::of([point.origin]).grown(margin));
            for cluster in self.sight.lit_from(&at).iter() {
                if let Some(row) = rows.get_mut(cluster) {
                    row.push(entry);
                }
            }
        }
        let total = (lights.len() + points.len()) as u32;
        rows.push((0..total).collect());
        let mut lists = LightLists {
            offsets: vec![0],
            lights: Vec::new(),
            triangle_lights: lights.len() as u32,
            sky: self.sky(surfaces, is_sky),
            shares: Vec::new(),
        };
        for row in rows {
            lists.lights.extend(row);
            lists.offsets.push(lists.lights.len() as u32);
        }
        lists
    }
}

#[cfg(test)]
mod tests {
    use super::super::LightRef;
    use super::*;

    #[test]
    fn rows_are_found_by_cluster() {
        let lists = LightLists {
            offsets: vec![0, 1, 3, 5],
            lights: vec![0, 0, 1, 0, 1],
            triangle_lights: 1,
            sky: vec![true, false],
            shares: Vec::new(),
        };
        assert!(lists.sees_sky(0) && !lists.sees_sky(1) && lists.sees_sky(-1));
        assert_eq!(lists.clusters(), 2);
        assert_eq!(lists.row(0), [0]);
        assert_eq!(lists.row(1), [0, 1]);
        assert_eq!(lists.row(-1), [0, 1]);
        assert_eq!(lists.row(2), [0, 1]);
        assert_eq!(lists.mean_length(), 1.5);
        assert_eq!(lists.longest(), 2);
        assert_eq!(lists.light(0), LightRef::Triangle(0));
        assert_eq!(lists.light(1), LightRef::Point(0));
        assert!(LightLists::default().row(0).is_empty());
    }
}
