//! Which lights can matter in which cluster: exact lists from the potentially visible sets.
//!
//! A light is in a cluster's list when one of the clusters that it lies in can see that cluster,
//! or be seen from it (compilers write matrices that are not symmetric, and light travels both ways), unless
//! the whole cluster lies behind a one-sided light.

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
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LightLists {
    /// Start of every row in `lights`, and the end of the last: clusters + 2 values.
    pub offsets: Vec<u32>,
    /// The rows.
    pub lights: Vec<u32>,
    /// Number of triangle lights: entries from here on are point lights.
    pub triangle_lights: u32,
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
    /// Number of clusters; their rows come first.
    pub fn clusters(&self) -> usize {
        self.offsets.len().saturating_sub(2)
    }

    /// The entries for a cluster, as [`Bsp::cluster_at`] gives it; all lights for -1 and for clusters
    /// that do not exist.
    pub fn row(&self, cluster: i32) -> &[u32] {
        let row = usize::try_from(cluster)
            .ok()
            .filter(|&c| c < self.clusters())
            .unwrap_or(self.clusters());
        match self.offsets.get(row..row + 2) {
            Some(&[start, end]) => self
                .lights
                .get(start as usize..end as usize)
                .unwrap_or_default(),
            _ => &[],
        }
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

/// A set of clusters.
#[derive(Clone, PartialEq, Eq, Hash)]
struct Bits(Vec<u64>);

impl Bits {
    fn none(count: usize) -> Bits {
        Bits(vec![0; count.div_ceil(64)])
    }

    fn all(count: usize) -> Bits {
        let mut bits = Bits::none(count);
        (0..count).for_each(|i| bits.insert(i));
        bits
    }

    fn insert(&mut self, bit: usize) {
        if let Some(word) = self.0.get_mut(bit / 64) {
            *word |= 1 << (bit % 64);
        }
    }

    fn merge(&mut self, other: &Bits) {
        for (word, more) in self.0.iter_mut().zip(&other.0) {
            *word |= more;
        }
    }

    fn keep(&mut self, other: &Bits) {
        for (word, kept) in self.0.iter_mut().zip(&other.0) {
            *word &= kept;
        }
    }

    fn is_empty(&self) -> bool {
        self.0.iter().all(|&word| word == 0)
    }

    fn iter(&self) -> impl Iterator<Item = usize> + '_ {
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

    /// The largest distance of a point in the bounds from the plane, positive in front.
    fn furthest_in_front(&self, normal: Vec3, dist: f32) -> f32 {
        let corner = Vec3::select(normal.cmpge(Vec3::ZERO), self.maxs, self.mins);
        corner.dot(normal) - dist
    }
}

/// How far in front of a light's plane a cluster must reach to be lit, id units: leaf bounds are whole
/// numbers, and a light's own plane bounds the leafs that it lights.
const PLANE_SLACK: f32 = 0.125;

/// How far around something its clusters are looked for when leafs do not list it, id units.
const SEARCH_MARGIN: f32 = 2.0;

/// Clusters of a map, prepared for asking what sees what.
pub(crate) struct Clusters<'a> {
    bsp: &'a Bsp,
    count: usize,
    /// For every cluster those that it sees or is seen from.
    sees: Vec<Bits>,
    /// Bounds of the leafs of every cluster; `EMPTY` for clusters without a leaf in the tree.
    bounds: Vec<Bounds>,
    /// Clusters whose leafs list a surface.
    of_surface: Vec<Vec<u32>>,
}

impl<'a> Clusters<'a> {
    pub fn new(bsp: &'a Bsp) -> Self {
        let leafs = bsp.tree_leafs();
        let leafs = || leafs.iter().filter_map(|&i| bsp.leafs.get(i));
        // A map without a matrix is one where everything sees everything: no rows at all.
        let count = bsp.visibility.as_ref().map_or(0, |v| v.clusters);
        let mut sees = vec![Bits::none(count); count];
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
            bsp,
            count,
            sees,
            bounds,
            of_surface,
        }
    }

    /// Clusters of the leafs in the tree that touch a box.
    fn touching(&self, mins: Vec3, maxs: Vec3) -> Bits {
        let bounds = Bounds { mins, maxs };
        let mut at = Bits::none(self.count);
        // A damaged tree may share nodes or go in circles: no path needs more steps than there are nodes.
        let mut steps = self.bsp.nodes.len() * 2;
        let mut stack = vec![0i32];
        while let Some(child) = stack.pop() {
            let Ok(index) = usize::try_from(child) else {
                let leaf = usize::try_from(-1 - i64::from(child))
                    .ok()
                    .and_then(|l| self.bsp.leafs.get(l));
                if let Some(cluster) = leaf.and_then(|l| usize::try_from(l.cluster).ok()) {
                    at.insert(cluster);
                }
                continue;
            };
            let Some(node) = self.bsp.nodes.get(index) else {
                continue;
            };
            let plane = usize::try_from(node.plane)
                .ok()
                .and_then(|p| self.bsp.planes.get(p));
            let Some(plane) = plane else { continue };
            if steps == 0 {
                return Bits::none(self.count);
            }
            steps -= 1;
            if bounds.furthest_in_front(plane.normal, plane.dist) >= 0.0 {
                stack.push(node.children[0]);
            }
            if bounds.furthest_in_front(-plane.normal, -plane.dist) >= 0.0 {
                stack.push(node.children[1]);
            }
        }
        at
    }

    /// Clusters that see one of the given clusters or are seen from it; all when none is given.
    fn lit_from(&self, at: &Bits) -> Bits {
        if at.is_empty() {
            return Bits::all(self.count);
        }
        let mut lit = Bits::none(self.count);
        for cluster in at.iter() {
            if let Some(sees) = self.sees.get(cluster) {
                lit.merge(sees);
            }
        }
        lit
    }

    /// Clusters that a triangle light lies in: those that its bounds touch, of a world surface only such as list
    /// it. (The few world surfaces that no leaf lists, and those of brush models, are where their bounds are.)
    fn clusters_of(&self, light: &TriangleLight, listed: &Bits) -> Bits {
        let margin = Vec3::splat(SEARCH_MARGIN);
        let [a, b, c] = light.vertices;
        let mut at = self.touching(a.min(b).min(c) - margin, a.max(b).max(c) + margin);
        if !listed.is_empty() {
            at.keep(listed);
            if at.is_empty() {
                return listed.clone();
            }
        }
        at
    }

    /// Clusters whose leafs list a world surface; none for surfaces of brush models.
    fn listing(&self, index: usize, surfaces: &[WorldSurface]) -> Bits {
        let mut at = Bits::none(self.count);
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
        bounds.furthest_in_front(normal, normal.dot(light.vertices[0])) > PLANE_SLACK
    }

    /// The lists of a map's lights.
    pub fn lists(
        &self,
        lights: &[TriangleLight],
        points: &[PointLight],
        surfaces: &[WorldSurface],
    ) -> LightLists {
        let mut rows: Vec<Vec<u32>> = vec![Vec::new(); self.count];
        let mut listed: Option<(u32, Bits)> = None;
        let mut known: HashMap<Bits, Bits> = HashMap::new();
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
            let lit = known.entry(at).or_insert_with_key(|at| self.lit_from(at));
            for cluster in lit.iter().filter(|&c| self.faces(light, c)) {
                if let Some(row) = rows.get_mut(cluster) {
                    row.push(entry);
                }
            }
        }
        for (entry, point) in (lights.len() as u32..).zip(points) {
            let margin = Vec3::splat(SEARCH_MARGIN.max(point.radius));
            let at = self.touching(point.origin - margin, point.origin + margin);
            for cluster in self.lit_from(&at).iter() {
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
    fn bits_iterate_what_was_inserted() {
        let mut bits = Bits::none(200);
        for bit in [0, 63, 64, 130, 199] {
            bits.insert(bit);
        }
        assert_eq!(bits.iter().collect::<Vec<_>>(), [0, 63, 64, 130, 199]);
        assert_eq!(Bits::all(70).iter().count(), 70);
        assert!(Bits::none(3).is_empty() && !bits.is_empty());
    }

    #[test]
    fn rows_are_found_by_cluster() {
        let lists = LightLists {
            offsets: vec![0, 1, 3, 5],
            lights: vec![0, 0, 1, 0, 1],
            triangle_lights: 1,
        };
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
