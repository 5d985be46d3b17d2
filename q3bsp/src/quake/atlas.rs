//! The lightmaps of faces put together on pages.

use crate::lumps::Lightmap;

/// Texels per side of the pages made.
pub(super) const PAGE: usize = 512;

/// Pages that fill from the top in rows of charts.
pub(super) struct Atlas {
    pages: Vec<Vec<u8>>,
    /// Texels that may still be placed.
    left: usize,
    x: usize,
    y: usize,
    row_height: usize,
}

impl Atlas {
    /// An atlas for the charts of a lighting lump of so many bytes. Charts may share bytes, but not without end: a
    /// small file could ask for any number of pages.
    pub(super) fn new(lighting_bytes: usize) -> Atlas {
        Atlas {
            pages: Vec::new(),
            left: lighting_bytes.saturating_mul(4).saturating_add(PAGE * PAGE),
            x: 0,
            y: 0,
            row_height: 0,
        }
    }

    /// Puts a chart of `width` × `height` RGB texels on a page; `None` when it does not fit any, or too much
    /// was placed already.
    pub(super) fn add(
        &mut self,
        width: usize,
        height: usize,
        texel: impl Fn(usize) -> [u8; 3],
    ) -> Option<(usize, usize, usize)> {
        if width > PAGE || height > PAGE || width == 0 || height == 0 {
            return None;
        }
        self.left = self.left.checked_sub(width * height)?;
        if self.x + width > PAGE {
            self.x = 0;
            self.y += self.row_height;
            self.row_height = 0;
        }
        if self.pages.is_empty() || self.y + height > PAGE {
            self.pages.push(vec![0; PAGE * PAGE * 3]);
            (self.x, self.y, self.row_height) = (0, 0, 0);
        }
        let (x, y) = (self.x, self.y);
        let page = self.pages.len() - 1;
        let texels = self.pages.last_mut()?;
        for row in 0..height {
            let start = ((y + row) * PAGE + x) * 3;
            let line = texels.get_mut(start..start + width * 3)?;
            for (column, to) in line.as_chunks_mut::<3>().0.iter_mut().enumerate() {
                *to = texel(row * width + column);
            }
        }
        self.x += width;
        self.row_height = self.row_height.max(height);
        Some((page, x, y))
    }

    pub(super) fn pages(self) -> Vec<Lightmap> {
        self.pages
            .into_iter()
            .map(|page| Lightmap(page.into()))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn charts_do_not_overlap() {
        let mut atlas = Atlas::new(1 << 20);
        let mut placed = Vec::new();
        for n in 0..700usize {
            let (w, h) = (1 + n * 7 % 40, 1 + n * 11 % 33);
            let at = atlas.add(w, h, |_| [1 + (n % 250) as u8; 3]).unwrap();
            placed.push((at, w, h, 1 + (n % 250) as u8));
        }
        let pages = atlas.pages();
        assert!(pages.len() > 1);
        for ((page, x, y), w, h, value) in placed {
            for (column, row) in [(0, 0), (w - 1, 0), (0, h - 1), (w - 1, h - 1)] {
                assert_eq!(pages[page].texel(x + column, y + row), [value; 3]);
            }
        }
        assert_eq!(Atlas::new(1 << 20).add(513, 1, |_| [0; 3]), None);
    }
}
