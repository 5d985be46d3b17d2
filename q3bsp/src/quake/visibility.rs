//! Run-length coded visibility to a matrix.

use super::QuakeMap;
use crate::Visibility;
use crate::error::{Lump, Warning};
use crate::format::Format;

/// Most bytes of a matrix: 46,000 clusters. A map with more is taken as without visibility.
const MAX_BYTES: usize = 256 << 20;

/// Decodes one row: a byte that is not 0 stands for itself, a 0 for as many as the next byte counts. `false` when the
/// data ends before the row does.
fn decode_row(mut data: &[u8], row: &mut [u8]) -> bool {
    let mut at = 0;
    while at < row.len() {
        match data {
            [0, count, rest @ ..] => {
                // A run of no length would not end.
                at += usize::from(*count).max(1);
                data = rest;
            }
            [byte, rest @ ..] if *byte != 0 => {
                if let Some(slot) = row.get_mut(at) {
                    *slot = *byte;
                }
                at += 1;
                data = rest;
            }
            _ => return false,
        }
    }
    true
}

fn warning(field: &'static str, value: i64, action: &'static str) -> Warning {
    Warning {
        lump: Lump::Visibility,
        element: None,
        field: field.into(),
        value,
        action: action.into(),
    }
}

impl QuakeMap {
    /// Number of clusters: leafs from 1 on in Quake, stored in Quake II.
    pub(super) fn clusters(&self) -> usize {
        match self.format {
            Format::Quake2 | Format::Qbism => self.stored_clusters().unwrap_or(0),
            _ => {
                let stored = self.models.first().map_or(0, |world| world.visible_leafs);
                let most = self.leafs.len().saturating_sub(1);
                usize::try_from(stored).unwrap_or(0).min(most)
            }
        }
    }

    fn stored_clusters(&self) -> Option<usize> {
        let count = i32::from_le_bytes(*self.visibility.first_chunk::<4>()?);
        usize::try_from(count).ok()
    }

    /// Where the row of a cluster begins in the lump; `None` if the cluster sees all clusters.
    fn row_start(&self, cluster: usize) -> Option<usize> {
        let offset = match self.format {
            Format::Quake2 | Format::Qbism => {
                let at = 4 + cluster.checked_mul(8)?;
                i32::from_le_bytes(*self.visibility.get(at..)?.first_chunk::<4>()?)
            }
            _ => self.leafs.get(cluster + 1)?.visibility,
        };
        usize::try_from(offset).ok()
    }

    /// The matrix, `None` when there is none or it is damaged, and what is odd about it.
    pub(super) fn decode_visibility(&self) -> (Option<Visibility>, Option<Warning>) {
        let clusters = self.clusters();
        if self.visibility.is_empty() || clusters == 0 {
            return (None, None);
        }
        let ignored = "the lump is ignored: everything sees everything";
        let count = clusters as i64;
        let stride = clusters.div_ceil(64) * 8;
        if clusters.checked_mul(stride).is_none_or(|size| size > MAX_BYTES)
            // A row takes two bytes for each 255 of its own, so that a file cannot ask for much more than its size.
            || self.format.is_quake2() && self.visibility.len() < 4 + clusters * 8
        {
            return (None, Some(warning("number of clusters", count, ignored)));
        }
        let mut visibility = Visibility::new(clusters);
        let mut broken = 0;
        for (cluster, row) in visibility.rows.chunks_exact_mut(stride).enumerate() {
            let (row, _) = row.split_at_mut(clusters.div_ceil(8).min(stride));
            let data = self
                .row_start(cluster)
                .and_then(|at| self.visibility.get(at..));
            let complete = match data {
                Some(data) => decode_row(data, row),
                None => {
                    row.fill(255);
                    true
                }
            };
            if !complete {
                row.fill(255);
                broken += 1;
            }
        }
        let odd = (broken > 0).then(|| {
            let action = "which see everything";
            warning(
                "number of rows that end before their clusters do",
                broken,
                action,
            )
        });
        (Some(visibility), odd)
    }
}

#[cfg(test)]
mod tests {
    use super::decode_row;

    #[test]
    fn rows_are_run_length_coded() {
        let mut row = [0; 6];
        assert!(decode_row(&[5, 0, 3, 7, 0, 1], &mut row));
        assert_eq!(row, [5, 0, 0, 0, 7, 0]);
        assert!(!decode_row(&[5, 0], &mut [0; 6]));
        assert!(decode_row(&[0, 200], &mut [0; 6]));
        assert!(!decode_row(&[0, 0, 0, 0], &mut [0; 6]));
    }
}
