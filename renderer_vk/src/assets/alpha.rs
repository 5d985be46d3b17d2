//! Alpha ranges of texture regions, for the classification of alpha-tested triangles.

use glam::{IVec2, Vec2};
use relight::image::Image;

/// Maximum number of cells along a side.
const CELLS: u32 = 64;
/// A triangle that covers more cells than this counts as covering the whole image.
const REACH: i64 = 1 << 14;

/// The smallest and the greatest alpha of an image in each cell of a grid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AlphaGrid {
    width: u32,
    height: u32,
    cells: Vec<(u8, u8)>,
    whole: (u8, u8),
    /// Number of texels of each alpha.
    counts: Box<[u32; 256]>,
}

impl AlphaGrid {
    /// The grid of an image; `None` if it is opaque everywhere.
    pub fn of(image: &Image) -> Option<Self> {
        let texels = image.rgba.as_chunks::<4>().0;
        if image.width == 0 || image.height == 0 || texels.iter().all(|t| t[3] == u8::MAX) {
            return None;
        }
        let (width, height) = (image.width.min(CELLS), image.height.min(CELLS));
        let mut cells = vec![(u8::MAX, 0u8); width as usize * height as usize];
        for (y, row) in texels.chunks(image.width as usize).enumerate() {
            for (x, texel) in row.iter().enumerate() {
                let cell = |at: usize, cells: u32, size: u32| {
                    (at as u64 * u64::from(cells) / u64::from(size)) as usize
                };
                let (i, j) = (cell(x, width, image.width), cell(y, height, image.height));
                if let Some((low, high)) = cells.get_mut(j * width as usize + i) {
                    *low = (*low).min(texel[3]);
                    *high = (*high).max(texel[3]);
                }
            }
        }
        let whole = cells.iter().fold((u8::MAX, 0), join);
        let mut counts = Box::new([0; 256]);
        for texel in texels {
            if let Some(count) = counts.get_mut(usize::from(texel[3])) {
                *count += 1;
            }
        }
        Some(Self {
            counts,
            width,
            height,
            cells,
            whole,
        })
    }

    /// The smallest and the greatest alpha of a bilinear lookup at texture coordinates within a triangle. Conservative,
    /// except where a smaller mip level includes texels outside of the triangle.
    #[allow(clippy::cast_precision_loss, clippy::cast_possible_truncation)] // cells of a grid
    pub fn range(&self, corners: [Vec2; 3], clamped: bool) -> (u8, u8) {
        let size = Vec2::new(self.width as f32, self.height as f32);
        let corners = corners.map(|st| st * size);
        let low = corners.iter().copied().fold(Vec2::INFINITY, Vec2::min);
        let high = corners.iter().copied().fold(Vec2::NEG_INFINITY, Vec2::max);
        let far = 1.0e6;
        if !(low.is_finite() && high.is_finite() && low.abs().max(high.abs()).max_element() < far) {
            return self.whole;
        }
        // a cell is at least one texel wide, so that the filter reaches at most one cell further
        let first = low.floor().as_ivec2() - 1;
        let last = high.floor().as_ivec2() + 1;
        let span = last - first + 1;
        if i64::from(span.x) * i64::from(span.y) > REACH {
            return self.whole;
        }
        let mut range = (u8::MAX, 0);
        for y in first.y..=last.y {
            for x in first.x..=last.x {
                if meets(corners, IVec2::new(x, y)) {
                    range = join(range, &self.cell(x, y, clamped));
                }
            }
        }
        range
    }

    /// Part of the image whose alpha passes a test.
    #[allow(clippy::cast_precision_loss)] // texels of an image
    pub fn share(&self, passes: impl Fn(u8) -> bool) -> f32 {
        let counted = (0..=u8::MAX).zip(self.counts.iter());
        let passing = counted.filter(|(alpha, _)| passes(*alpha));
        let passing: u32 = passing.map(|(_, count)| count).sum();
        passing as f32 / self.counts.iter().sum::<u32>().max(1) as f32
    }

    fn cell(&self, x: i32, y: i32, clamped: bool) -> (u8, u8) {
        let place = |at: i32, size: u32| {
            let size = i32::try_from(size).unwrap_or(1).max(1);
            let at = if clamped {
                at.clamp(0, size - 1)
            } else {
                at.rem_euclid(size)
            };
            usize::try_from(at).unwrap_or(0)
        };
        let index = place(y, self.height) * self.width as usize + place(x, self.width);
        self.cells.get(index).copied().unwrap_or(self.whole)
    }
}

fn join(a: (u8, u8), b: &(u8, u8)) -> (u8, u8) {
    (a.0.min(b.0), a.1.max(b.1))
}

/// Whether a triangle comes within one cell's width of a cell, by the separating axis test.
fn meets(corners: [Vec2; 3], cell: IVec2) -> bool {
    const HALF: f32 = 1.5;
    let middle = cell.as_vec2() + 0.5;
    let [a, b, c] = corners.map(|p| p - middle);
    let apart = |axis: Vec2| {
        let reach = HALF * (axis.x.abs() + axis.y.abs());
        let at = [a.dot(axis), b.dot(axis), c.dot(axis)];
        let (low, high) = (at[0].min(at[1]).min(at[2]), at[0].max(at[1]).max(at[2]));
        low > reach || high < -reach
    };
    ![
        Vec2::X,
        Vec2::Y,
        (b - a).perp(),
        (c - b).perp(),
        (a - c).perp(),
    ]
    .into_iter()
    .any(apart)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Left half solid, right half transparent.
    fn halves(size: u32) -> AlphaGrid {
        let rgba = (0..size * size)
            .flat_map(|i| [0, 0, 0, if i % size < size / 2 { 255 } else { 0 }])
            .collect();
        AlphaGrid::of(&Image {
            width: size,
            height: size,
            has_alpha: true,
            rgba,
        })
        .expect("transparent")
    }

    #[test]
    fn ranges_are_those_under_the_triangle() {
        for size in [16, 64, 256] {
            let grid = halves(size);
            let at = |x: f32, y: f32| {
                grid.range([(x, y), (x + 0.2, y), (x, y + 0.2)].map(Vec2::from), false)
            };
            assert_eq!(at(0.15, 0.3), (255, 255), "{size}");
            assert_eq!(at(0.65, 0.3), (0, 0), "{size}");
            assert_eq!(at(0.4, 0.3), (0, 255), "{size}");
            // the image repeats, and its edges are adjacent
            assert_eq!(at(-3.85, 9.3), (255, 255), "{size}");
            assert_eq!(at(0.9, 0.3), (0, 255), "{size}");
            // the slanted side does not reach the solid half
            let slanted = [(0.95, 0.0), (0.7, 1.0), (0.95, 1.0)].map(Vec2::from);
            assert_eq!(grid.range(slanted, true), (0, 0), "{size}");
        }
    }

    #[test]
    fn the_share_that_passes_is_counted() {
        let grid = halves(64);
        assert_eq!(grid.share(|alpha| alpha >= 128), 0.5);
        assert_eq!(grid.share(|_| true), 1.0);
    }

    #[test]
    fn nothing_to_classify_in_opaque_images_and_wild_coordinates() {
        let opaque = Image {
            width: 2,
            height: 1,
            has_alpha: true,
            rgba: vec![9, 9, 9, 255, 1, 2, 3, 255],
        };
        assert_eq!(AlphaGrid::of(&opaque), None);
        let grid = halves(16);
        for wild in [f32::NAN, f32::INFINITY, 1.0e30, 5000.0] {
            let corners = [Vec2::ZERO, Vec2::splat(wild), Vec2::new(wild, 0.0)];
            assert_eq!(grid.range(corners, false), (0, 255));
        }
    }
}
