//! Potentially visible sets: which clusters can be seen from which.

use crate::Bsp;
use crate::error::{Lump, Warning};
use crate::lumps::Leaf;
use std::borrow::Cow;

/// Lump 16: a bit matrix. Not symmetric in most shipped maps.
#[derive(Clone, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(into = "Rows", try_from = "Rows"))]
pub struct Visibility {
    /// Number of clusters, which is the number of rows; at least 1.
    pub clusters: usize,
    /// Bytes per row, at least `clusters / 8` rounded up.
    pub bytes_per_cluster: usize,
    /// `clusters × bytes_per_cluster` bytes; bit `c & 7` of byte `c >> 3` in row `r` is set if `r` sees `c`.
    pub rows: Vec<u8>,
}

/// A serialized [`Visibility`]: one row of bits for each cluster.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
struct Rows {
    bytes_per_cluster: usize,
    rows: Vec<crate::serial::Bytes<Vec<u8>>>,
}

#[cfg(feature = "serde")]
impl From<Visibility> for Rows {
    fn from(visibility: Visibility) -> Rows {
        let row = |cluster| crate::serial::Bytes(visibility.row(cluster).to_vec());
        Rows {
            bytes_per_cluster: visibility.bytes_per_cluster,
            rows: (0..visibility.clusters).map(row).collect(),
        }
    }
}

#[cfg(feature = "serde")]
impl TryFrom<Rows> for Visibility {
    type Error = String;
    fn try_from(form: Rows) -> Result<Visibility, String> {
        let (clusters, bytes_per_cluster) = (form.rows.len(), form.bytes_per_cluster);
        let mut lengths = form.rows.iter().map(|row| row.0.len());
        if bytes_per_cluster < clusters.div_ceil(8) || lengths.any(|l| l != bytes_per_cluster) {
            return Err(format!(
                "expected rows of {bytes_per_cluster} bytes, one bit a cluster"
            ));
        }
        Ok(Visibility {
            clusters,
            bytes_per_cluster,
            rows: form.rows.into_iter().flat_map(|row| row.0).collect(),
        })
    }
}

impl Visibility {
    /// An all-dark matrix with rows rounded up to 8 bytes, as compilers write it, every cluster seeing
    /// itself.
    pub fn new(clusters: usize) -> Visibility {
        let bytes_per_cluster = clusters.div_ceil(64) * 8;
        let mut visibility = Visibility {
            clusters,
            bytes_per_cluster,
            rows: vec![0; clusters * bytes_per_cluster],
        };
        for cluster in 0..clusters {
            visibility.set(cluster, cluster, true);
        }
        visibility
    }

    /// Whether `a` sees `b`; true when one of them is not a cluster of this matrix.
    pub fn sees(&self, a: usize, b: usize) -> bool {
        if a >= self.clusters || b >= self.clusters {
            return true;
        }
        self.row(a)
            .get(b >> 3)
            .is_none_or(|byte| byte >> (b & 7) & 1 == 1)
    }

    /// Changes one bit; nothing when one of the clusters does not exist.
    pub fn set(&mut self, a: usize, b: usize, sees: bool) {
        if a < self.clusters
            && b < self.clusters
            && let Some(byte) = self.rows.get_mut(a * self.bytes_per_cluster + (b >> 3))
        {
            let bit = 1 << (b & 7);
            *byte = if sees { *byte | bit } else { *byte & !bit };
        }
    }

    /// The row of a cluster; empty when it does not exist.
    pub fn row(&self, cluster: usize) -> &[u8] {
        if cluster >= self.clusters {
            return &[];
        }
        let start = cluster * self.bytes_per_cluster;
        self.rows
            .get(start..start + self.bytes_per_cluster)
            .unwrap_or(&[])
    }

    /// The clusters that `cluster` sees, ascending.
    pub fn visible_from(&self, cluster: usize) -> impl Iterator<Item = usize> + '_ {
        self.row(cluster)
            .iter()
            .enumerate()
            .flat_map(|(at, &byte)| {
                (0..8)
                    .filter(move |bit| byte >> bit & 1 == 1)
                    .map(move |bit| at * 8 + bit)
            })
            .take_while(|&c| c < self.clusters)
    }

    /// Decodes the lump: the matrix if it is usable, the bytes that it does not cover, and what is odd.
    pub(crate) fn decode(data: &[u8]) -> (Option<Visibility>, &[u8], Option<Warning>) {
        let warn = |field, value: i64| {
            Some(Warning {
                lump: Lump::Visibility,
                element: None,
                field: Cow::Borrowed(field),
                value,
                action: Cow::Borrowed("the lump is ignored: everything sees everything"),
            })
        };
        if data.is_empty() {
            return (None, data, None);
        }
        let header = data.split_first_chunk::<4>().and_then(|(clusters, rest)| {
            let (stride, rows) = rest.split_first_chunk::<4>()?;
            Some((
                i32::from_le_bytes(*clusters),
                i32::from_le_bytes(*stride),
                rows,
            ))
        });
        let Some((clusters, stride, rows)) = header else {
            return (None, data, warn("length", data.len() as i64));
        };
        let (Ok(count), Ok(bytes_per_cluster)) =
            (usize::try_from(clusters), usize::try_from(stride))
        else {
            return (None, data, warn("number of clusters", i64::from(clusters)));
        };
        if count == 0 {
            return (None, data, warn("number of clusters", 0));
        }
        if bytes_per_cluster < count.div_ceil(8) {
            return (None, data, warn("bytes per cluster", i64::from(stride)));
        }
        match count
            .checked_mul(bytes_per_cluster)
            .and_then(|size| rows.split_at_checked(size))
        {
            None => (None, data, warn("length", data.len() as i64)),
            Some((rows, rest)) => (
                Some(Visibility {
                    clusters: count,
                    bytes_per_cluster,
                    rows: rows.to_vec(),
                }),
                rest,
                None,
            ),
        }
    }

    pub(crate) fn encode(&self, out: &mut Vec<u8>) {
        let int = |n: usize| i32::try_from(n).unwrap_or(i32::MAX).to_le_bytes();
        out.extend_from_slice(&int(self.clusters));
        out.extend_from_slice(&int(self.bytes_per_cluster));
        out.extend_from_slice(&self.rows);
    }
}

impl Bsp {
    /// Number of clusters: that of the visibility lump, or without one, one more than the largest
    /// cluster of a leaf. Every leaf's cluster is smaller.
    pub fn num_clusters(&self) -> usize {
        match &self.visibility {
            Some(visibility) => visibility.clusters,
            None => self
                .leafs
                .iter()
                .filter_map(Leaf::cluster_index)
                .max()
                .map_or(0, |largest| largest + 1),
        }
    }

    /// Whether cluster `a` may see cluster `b`. True when there is no visibility lump or when one of
    /// them is not a cluster (-1: outside or solid), as the engine treats a viewer there.
    pub fn cluster_sees(&self, a: i32, b: i32) -> bool {
        match (&self.visibility, usize::try_from(a), usize::try_from(b)) {
            (Some(visibility), Ok(a), Ok(b)) => visibility.sees(a, b),
            _ => true,
        }
    }
}
