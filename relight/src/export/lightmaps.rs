//! All lightmap pages that are used, in one image.

use super::ExportError;
use crate::image::Image;
use crate::world::{RelitWorld, WorldSurface};
use glam::Vec2;
use std::collections::BTreeMap;

/// Texels around each page that repeat its edge, so that filtering never reaches another page.
const GUTTER: usize = 2;

/// Lightmap pages side by side.
#[derive(Debug, Clone, PartialEq)]
pub struct Atlas {
    /// For each page that is used, its place: row by row.
    cells: BTreeMap<i32, usize>,
    columns: usize,
    /// Texels per side of a page.
    side: usize,
}

impl Atlas {
    /// The pages that drawn surfaces use; `None` when none does.
    pub fn new(world: &RelitWorld) -> Option<Atlas> {
        let used = world
            .surfaces
            .iter()
            .filter(|s| s.num_indices > 0)
            .map(|s| s.light_page)
            .filter(|&page| page_of(world, page).is_some());
        let mut cells: BTreeMap<i32, usize> = used.map(|page| (page, 0)).collect();
        for (place, cell) in cells.values_mut().enumerate() {
            *cell = place;
        }
        let side = cells
            .keys()
            .filter_map(|&page| page_of(world, page))
            .map(q3bsp::Lightmap::size)
            .max()
            .filter(|&side| side > 0)?;
        Some(Atlas {
            columns: cells.len().isqrt() + usize::from(cells.len().isqrt().pow(2) < cells.len()),
            cells,
            side,
        })
    }

    fn size(&self) -> (usize, usize) {
        let cell = self.side + 2 * GUTTER;
        (
            self.columns * cell,
            self.cells.len().div_ceil(self.columns.max(1)) * cell,
        )
    }

    /// Coordinates in the atlas of coordinates in a surface's page; 0 for surfaces without.
    pub fn place(&self, surface: &WorldSurface, page: Vec2) -> Vec2 {
        let Some(&cell) = self.cells.get(&surface.light_page) else {
            return Vec2::ZERO;
        };
        let step = self.side + 2 * GUTTER;
        let corner = Vec2::new(
            (cell % self.columns * step + GUTTER) as f32,
            (cell / self.columns * step + GUTTER) as f32,
        );
        let (width, height) = self.size();
        (corner + page.clamp(Vec2::ZERO, Vec2::ONE) * self.side as f32)
            / Vec2::new(width as f32, height as f32)
    }

    /// The atlas as an image, over-bright shift applied.
    ///
    /// # Errors
    /// [`ExportError`] when it is too large to be an image.
    pub fn image(&self, world: &RelitWorld) -> Result<Image, ExportError> {
        let (width, height) = self.size();
        let step = self.side + 2 * GUTTER;
        let mut rgba = vec![255; width * height * 4];
        for (&page, &cell) in &self.cells {
            let Some(texels) = usize::try_from(page).ok().and_then(|p| world.lightmap(p)) else {
                debug_assert!(false, "no page {page}");
                continue;
            };
            let texels = texels.as_chunks::<3>().0;
            let (left, top) = (cell % self.columns * step, cell / self.columns * step);
            for y in 0..step {
                let from = y.saturating_sub(GUTTER).min(self.side - 1) * self.side;
                for x in 0..step {
                    let at = from + x.saturating_sub(GUTTER).min(self.side - 1);
                    let to = ((top + y) * width + left + x) * 4;
                    if let (Some(texel), Some(pixel)) = (texels.get(at), rgba.get_mut(to..to + 3)) {
                        pixel.copy_from_slice(texel);
                    }
                }
            }
        }
        u32::try_from(width)
            .ok()
            .zip(u32::try_from(height).ok())
            .and_then(|(width, height)| Image::from_rgba(width, height, rgba))
            .ok_or(ExportError::TooLarge {
                what: "number of lightmap texels",
                found: (width * height) as u64,
                limit: crate::image::MAX_PIXELS,
            })
    }
}

fn page_of(world: &RelitWorld, page: i32) -> Option<&q3bsp::Lightmap> {
    world.page(usize::try_from(page).ok()?)
}
