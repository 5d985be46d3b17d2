//! Which lights can matter in which cluster: exact lists from the potentially visible sets.
//!
//! A light is in a cluster's list when one of the clusters that it lies in can see that cluster,
//! or be seen from it (compilers write matrices that are not symmetric, and light travels both ways), unless
//! the whole cluster lies behind a one-sided light.

use super::sight::{ClusterSet, Sight, furthest_in_front};
use super::{PointLight, TriangleLight};
use crate::world::WorldSurface;
use glam::Vec3;
use q3bsp::Bsp;
use std::collections::HashMap;

/// Lights per cluster, in compressed rows.
///
/// Row `c` holds the lights of cluster `c`; one more row at the end holds all lights, for points outside of
/// every cluster. An entry below the number of triangle lights is an index of one of them; the others are
/// point lights: see [`LightLists::light`]. Entries of a row ascend. Suns are in no list: they matter
/// wherever the sky can be seen.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct LightLists {
    /// Start of every row in `lights`, and the end of the last: clusters + 2 values.
    pub offsets: Vec<u32>,
    /// The rows.
    pub lights: Vec<u32>,
    /// Number of triangle lights: entries from here on are point lights.
    pub triangle_lights: u32,
    /// For each cluster whether suns can reach it: see [`LightLists::sees_sky`].
    pub sky: Vec<bool>,
    /// For each entry of `lights` what it gives to its row's cluster; empty before [`sweep`](super::sweep()).
    pub shares: Vec<LightShare>,
}

/// What a light gives to a cluster.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LightShare {
    /// Light without shadows: mean irradiance / π, luminance. 0: not known.
    pub bare: f32,
    /// About which part of that arrives, above 0.
    pub visible: f32,
}

impl LightShare {
    /// Nothing is known.
    pub const UNKNOWN: LightShare = LightShare {
        bare: 0.0,
        visible: 1.0,
    };
}

/// What an entry of [`LightLists`] stands for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LightRef {
    /// Index into [`RelitWorld::lights`](crate::RelitWorld::lights).
    Triangle(u32),
    /// Index into [`RelitWorld::point_lights`](crate::RelitWorld::point_lights).
    Point(u32),
}

impl LightLists {
    /// What each entry of a [`row`](Self::row) gives to its cluster; empty where nothing is known.
    pub fn shares(&self, cluster: i32) -> &[LightShare] {
        let range = self.range(cluster);
        self.shares.get(range).unwrap_or_default()
    }

    /// Number of clusters; their rows come first.
    pub fn clusters(&self) -> usize {
        self.offsets.len().saturating_sub(2)
    }

    /// The entries for a cluster, as [`Bsp::cluster_at`] gives it; all lights for -1 and for clusters
    /// that do not exist.
    pub fn row(&self, cluster: i32) -> &[u32] {
        self.lights.get(self.range(cluster)).unwrap_or_default()
    }

    /// Appends the last row, of all lights, as `old` has it: nothing is known of what they give to a point in no
    /// cluster.
    pub(super) fn end_with_all(&mut self, old: &LightLists) {
        let all = old.row(-1);
        self.lights.extend(all);
        let unknown = std::iter::repeat_n(LightShare::UNKNOWN, all.len());
        self.shares.extend(unknown);
        self.offsets.push(self.lights.len() as u32);
    }

    /// Where a row is in `lights`.
    fn range(&self, cluster: i32) -> std::ops::Range<usize> {
        let row = usize::try_from(cluster)
            .ok()
            .filter(|&c| c < self.clusters())
            .unwrap_or(self.clusters());
        match self.offsets.get(row..row + 2) {
            Some(&[start, end]) => start as usize..end as usize,
            _ => 0..0,
        }
    }

    /// Whether light from the sky, and so that of suns, can come to a cluster: whether it can see a cluster with a
    /// surface of sky in it. True for clusters that nothing is known of.
    pub fn sees_sky(&self, cluster: i32) -> bool {
        let known = usize::try_from(cluster).ok().and_then(|c| self.sky.get(c));
        known.copied().unwrap_or(true)
    }

    /// What an entry stands for.
    pub fn light(&self, entry: u32) -> LightRef {
        match entry.checked_sub(self.triangle_lights) {
            None => LightRef::Triangle(entry),
            Some(point) => LightRef::Point(point),
        }
    }

    /// Mean number of lights over the clusters; of the list of all lights for a map without clusters.
    pub fn mean_length(&self) -> f64 {
        let clusters = self.clusters();
        match clusters {
            0 => self.lights.len() as f64,
            _ => f64::from(self.offsets.get(clusters).copied().unwrap_or(0)) / clusters as f64,
        }
    }

    /// Longest of the clusters' lists.
    pub fn longest(&self) -> usize {
        let lengths = self.offsets.windows(2).map(|w| (w[1] - w[0]) as usize);
        match self.clusters() {
            0 => self.lights.len(),
            clusters => lengths.take(clusters).max().unwrap_or(0),
        }
    }
}

/// Bounds of a cluster: those of its leafs.
#[derive(Clone, Copy)]
struct Bounds {
    mins: Vec3,
    maxs: Vec3,
}

impl Bounds {
    const EMPTY: Bounds = Bounds {
        mins: Vec3::INFINITY,
        maxs: Vec3::NEG_INFINITY,
    };
}

/// How far in front of a light's plane a cluster must reach to be lit, id units: leaf bounds are whole
/// numbers, and a light's own plane bounds the leafs that it lights.
const PLANE_SLACK: f32 = 0.125;

/// How far around something its clusters are looked for when leafs do not list it, id units.
const SEARCH_MARGIN: f32 = 2.0;

/// Clusters of a map, prepared for asking what sees what.
pub(crate) struct Clusters {
    sight: Sight,
    /// Bounds of the leafs of every cluster; `EMPTY` for clusters without a leaf in the tree.
    bounds: Vec<Bounds>,
    /// Clusters whose leafs list a surface.
    of_surface: Vec<Vec<u32>>,
}

impl Clusters {
    pub fn new(bsp: &Bsp) -> Self {
        let leafs = bsp.tree_leafs();
        let leafs = || leafs.iter().filter_map(|&i| bsp.leafs.get(i));
        let sight = Sight::new(bsp);
        let count = sight.count();
        let mut bounds = vec![Bounds::EMPTY; count];
        let mut of_surface = vec![Vec::new(); bsp.surfaces.len()];
        for leaf in leafs() {
            let Ok(cluster) = usize::try_from(leaf.cluster) else {
                continue;
            };
            if let Some(bounds) = bounds.get_mut(cluster) {
                let corner = |c: [i32; 3]| Vec3::from_array(c.map(|v| v as f32));
                bounds.mins = bounds.mins.min(corner(leaf.mins));
                bounds.maxs = bounds.maxs.max(corner(leaf.maxs));
            }
            for &surface in bsp.leaf_surface_indices(leaf) {
                let clusters: Option<&mut Vec<u32>> = usize::try_from(surface)
                    .ok()
                    .and_then(|s| of_surface.get_mut(s));
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

    /// Clusters that a triangle light lies in: those that its bounds touch, of a world surface only such as list
    /// it. (The few world surfaces that no leaf lists, and those of brush models, are where their bounds are.)
    fn clusters_of(&self, light: &TriangleLight, listed: &ClusterSet) -> ClusterSet {
        let margin = Vec3::splat(SEARCH_MARGIN);
        let [a, b, c] = light.vertices;
        let mut at = self
            .sight
            .touching(a.min(b).min(c) - margin, a.max(b).max(c) + margin);
        if !listed.is_empty() {
            at.keep(listed);
            if at.is_empty() {
                return listed.clone();
            }
        }
        at
    }

    /// Clusters whose leafs list a world surface; none for surfaces of brush models.
    fn listing(&self, index: usize, surfaces: &[WorldSurface]) -> ClusterSet {
        let mut at = ClusterSet::none(self.sight.count());
        if surfaces.get(index).is_some_and(|s| s.model == 0) {
            for &cluster in self.of_surface.get(index).into_iter().flatten() {
                at.insert(cluster as usize);
            }
        }
        at
    }

    /// Whether some of a cluster may lie on an emitting side of a light.
    fn faces(&self, light: &TriangleLight, cluster: usize) -> bool {
        let Some(bounds) = self.bounds.get(cluster).filter(|_| !light.two_sided) else {
            return true;
        };
        let normal = light.normal();
        let dist = normal.dot(light.vertices[0]);
        furthest_in_front(bounds.mins, bounds.maxs, normal, dist) > PLANE_SLACK
    }

    /// For each cluster whether it can see a surface that `is_sky`. Where no surface is, or one belongs to a brush
    /// model, nothing can be said: the answer is empty.
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

    /// The lists of a map's lights. `facing`: less what lies behind a light's plane; `is_sky` tells surfaces of sky.
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
            let at = self
                .sight
                .touching(point.origin - margin, point.origin + margin);
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
