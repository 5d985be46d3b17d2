//! Light lists: the lights that may reach each cluster, in compressed rows.

use support::slice::part;

/// Lights of each cluster, in compressed rows.
///
/// Row `c` holds the lights of cluster `c`; one more row holds all lights, for points outside every cluster. An
/// entry below the number of triangle lights is the index of one; the others are point lights: see
/// [`LightLists::light`]. Entries of a row ascend. Suns are in no list: they reach every place from which the sky
/// is visible.
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
    /// For each entry of `lights` what it gives to its row's cluster; empty before [`sweep`](crate::light::sweep()).
    pub shares: Vec<LightShare>,
}

/// Light of a list entry in its cluster.
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

/// The light of an entry of [`LightLists`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LightRef {
    /// Index into [`RelitWorld::lights`](crate::RelitWorld::lights).
    Triangle(u32),
    /// Index into [`RelitWorld::point_lights`](crate::RelitWorld::point_lights).
    Point(u32),
}

impl LightLists {
    /// Share of each entry of a [`row`](Self::row); empty before the sweep.
    pub fn shares(&self, cluster: i32) -> &[LightShare] {
        let range = self.range(cluster);
        self.shares.get(range).unwrap_or_default()
    }

    /// Number of clusters; their rows come first.
    pub fn clusters(&self) -> usize {
        self.offsets.len().saturating_sub(2)
    }

    /// The entries for a cluster, as [`q3bsp::Bsp::cluster_at`] gives it; all lights for -1 and for clusters
    /// that do not exist.
    pub fn row(&self, cluster: i32) -> &[u32] {
        part(&self.lights, self.range(cluster))
    }

    /// Appends the row of all lights from `old`, with unknown shares.
    pub(crate) fn end_with_all(&mut self, old: &LightLists) {
        let all = old.row(-1);
        self.lights.extend(all);
        let unknown = std::iter::repeat_n(LightShare::UNKNOWN, all.len());
        self.shares.extend(unknown);
        self.offsets.push(self.lights.len() as u32);
    }

    /// Range of a row in `lights`.
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

    /// Whether a cluster can see a cluster with a sky surface, so that skies and suns may light it. True where this
    /// is unknown.
    pub fn sees_sky(&self, cluster: i32) -> bool {
        let known = usize::try_from(cluster).ok().and_then(|c| self.sky.get(c));
        known.copied().unwrap_or(true)
    }

    /// The light of an entry.
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
