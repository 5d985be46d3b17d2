//! The light cutoff: compilers leave out a light where it adds less than one step of light.
//!
//! The distance of the cutoff depends on the strength, which the fit is looking for. So a column also keeps its
//! contributions without a cutoff, bucketed by the contribution of a single light, and its rows are rebuilt for the
//! current strength.

use super::columns::Column;

/// Contribution to a sample of lights with about the same contribution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// The sample.
    pub sample: u32,
    /// Unshadowed irradiance over π of one of them, for strength 1.
    pub unshadowed: f32,
    /// Irradiance over π that arrives from all of them, for strength 1.
    pub given: f32,
}

impl Column {
    /// Rebuilds the rows from the lights whose contribution at the current strength exceeds `cutoff`.
    pub fn apply_cutoff(&mut self, cutoff: f32) {
        if self.pieces.is_empty() {
            return;
        }
        let strength = self.strength.max_element();
        // At strength 0 nothing is cut off.
        let cutoff = if strength > 0.0 {
            cutoff / strength
        } else {
            0.0
        };
        if cutoff == 0.0 && self.rows.len() == self.pieces.len() {
            return;
        }
        self.rows.clear();
        for piece in self.pieces.iter().filter(|p| p.unshadowed > cutoff) {
            match self.rows.last_mut() {
                Some((last, sum)) if *last == piece.sample => *sum += piece.given,
                _ => self.rows.push((piece.sample, piece.given)),
            }
        }
    }
}

/// Pieces of a single light.
pub(super) fn pieces_of(rows: &[(u32, f32)]) -> Vec<Piece> {
    let piece = |&(sample, given): &(u32, f32)| Piece {
        sample,
        unshadowed: given,
        given,
    };
    rows.iter().map(piece).collect()
}

/// Lights of a group with about the same contribution to a sample, for strength 1.
pub(super) struct ContributionBucket {
    /// The group.
    pub group: u32,
    /// Power of two of the unshadowed contribution of one light; the same for all of a sky, which has no cutoff.
    size: i32,
    /// Number of lights.
    pub count: f32,
    /// Unshadowed irradiance over π of all of them.
    pub unshadowed: f32,
    /// Irradiance over π that arrives.
    pub given: f32,
}

/// Contribution of one of the compiler's lights to a sample, for strength 1.
#[derive(Clone, Copy, Default)]
pub(super) struct Contribution {
    /// Identity within the group: a triangle's index, or the surface of all quads of a sprite.
    pub number: u32,
    /// The group.
    pub group: u32,
    /// Whether it is sky, which has no cutoff.
    pub sky: bool,
    /// Unshadowed irradiance over π.
    pub unshadowed: f32,
    /// Irradiance over π that arrives.
    pub arrives: f32,
}

impl Contribution {
    /// Adds the light to the bucket of its group and size.
    pub fn add_to(self, buckets: &mut Vec<ContributionBucket>) {
        if self.arrives <= 0.0 {
            return;
        }
        let size_basis = if self.sky {
            f32::INFINITY
        } else {
            self.unshadowed
        };
        let size = size_basis.log2().clamp(-120.0, 120.0) as i32;
        let same = |h: &&mut ContributionBucket| h.group == self.group && h.size == size;
        match buckets.iter_mut().find(same) {
            Some(bucket) => {
                bucket.count += 1.0;
                bucket.unshadowed += size_basis;
                bucket.given += self.arrives;
            }
            None => buckets.push(ContributionBucket {
                group: self.group,
                size,
                count: 1.0,
                unshadowed: size_basis,
                given: self.arrives,
            }),
        }
    }
}
