//! Lights that end: compilers leave out what a light adds less than a step of light to.
//!
//! Where a light ends hangs on its strength, which is what is looked for. So besides what a column gives, what its lights
//! give one by one is kept, heaped by how much that is, and the column is put together anew from what has not ended.

use super::columns::Column;

/// What lights that give about the same give to a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Piece {
    /// The sample.
    pub sample: u32,
    /// Light without shadows that one of them gives, for strength 1.
    pub unshadowed: f32,
    /// Light that arrives from all of them, for strength 1.
    pub given: f32,
}

impl Column {
    /// Lets each of its lights end where, at the strength that it has, it gives no more than `cutoff`.
    pub fn apply_cutoff(&mut self, cutoff: f32) {
        if self.pieces.is_empty() {
            return;
        }
        let strength = self.strength.max_element();
        // What is not lit yet has not ended anywhere.
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

/// Rows of one light as pieces.
pub(super) fn pieces_of(rows: &[(u32, f32)]) -> Vec<Piece> {
    let piece = |&(sample, given): &(u32, f32)| Piece {
        sample,
        unshadowed: given,
        given,
    };
    rows.iter().map(piece).collect()
}

/// What the compiler's lights of a group that give about the same give to a sample, for strength 1.
pub(super) struct ContributionBucket {
    /// The group.
    pub group: u32,
    /// Power of two of what one of them gives without shadows; of skies, which do not end, all the same.
    size: i32,
    /// How many.
    pub count: f32,
    /// Light of all of them without shadows.
    pub unshadowed: f32,
    /// Light that arrives.
    pub given: f32,
}

/// What one of the compiler's lights gives to a sample, of a group and for strength 1.
#[derive(Clone, Copy, Default)]
pub(super) struct Contribution {
    /// Which one of the group: of a triangle its number, of all quads of a sprite that of its surface.
    pub number: u32,
    /// The group.
    pub group: u32,
    /// It is a sky, which does not end.
    pub sky: bool,
    /// Light without shadows.
    pub unshadowed: f32,
    /// Light that arrives.
    pub arrives: f32,
}

impl Contribution {
    /// Joins those of its group that give about as much.
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
