//! Pages of light written where engines find them: in the map, or as images beside it; and packs that replace a map.

pub mod aas;
pub mod deluxe;
pub mod external;
pub mod pack;
mod script;
mod tga;

use super::page::{Page, light_bytes};
use q3bsp::{Bsp, Lightmap, Lump};

/// A file of a game folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GameFile {
    /// Game path.
    pub path: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
}

/// Reason why pages cannot be stored.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum StoreError {
    /// Pages of a size that the map's format does not have.
    #[error(
        "pages have {found} texels per side, those in a map of this format {wanted}: store them beside the map"
    )]
    Side {
        /// Texels per side of the pages.
        found: usize,
        /// Texels per side in the format.
        wanted: usize,
    },
    /// Not as many pages as the map has.
    #[error("{found} pages for a map of {wanted}")]
    Pages {
        /// Pages given.
        found: usize,
        /// Pages of the map.
        wanted: usize,
    },
    /// A path that engines cut off: they keep 63 bytes.
    #[error("{0}: longer than the 63 bytes of a game path")]
    Path(String),
}

/// Bytes of a page.
pub(super) fn lightmap(page: &Page) -> Lightmap {
    let bytes = page.texels.iter().flat_map(|texel| light_bytes(*texel));
    Lightmap(bytes.collect())
}

/// Checks that surfaces find the pages that they found in the map, and that all pages have one size.
fn check(bsp: &Bsp, pages: &[Page]) -> Result<(), StoreError> {
    let wanted = bsp.lightmaps.len();
    if wanted > pages.len() {
        let found = pages.len();
        return Err(StoreError::Pages { found, wanted });
    }
    let side = pages.first().map_or(0, |page| page.side);
    let odd = |page: &&Page| page.side != side || page.texels.len() != side * side;
    match pages.iter().find(odd) {
        Some(page) => Err(StoreError::Side {
            found: page.side,
            wanted: side,
        }),
        None => Ok(()),
    }
}

/// Puts pages into a map, by the numbers that its surfaces have.
///
/// # Errors
/// [`StoreError`]: pages of another size than the format's, or too few; the map is as it was.
pub fn internal(bsp: &mut Bsp, pages: &[Page]) -> Result<(), StoreError> {
    check(bsp, pages)?;
    let wanted = bsp.format.lightmap_size();
    if let Some(page) = pages.first().filter(|page| page.side != wanted) {
        return Err(StoreError::Side {
            found: page.side,
            wanted,
        });
    }
    set_pages(bsp, pages.iter().map(lightmap).collect());
    Ok(())
}

/// Replaces a map's pages, without what followed the last whole one.
fn set_pages(bsp: &mut Bsp, pages: Vec<Lightmap>) {
    if pages.len() != bsp.lightmaps.len()
        && let Some(trailing) = bsp.container.trailing.get_mut(Lump::Lightmaps.index())
    {
        trailing.clear();
    }
    bsp.lightmaps = pages;
}

/// The name of a map in the paths of its files: without folder and extension.
fn map_name(map: &str) -> &str {
    let file = map.rsplit(['/', '\\']).next().unwrap_or(map);
    file.rsplit_once('.').map_or(file, |(name, _)| name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bake::layout::{LayoutOptions, LightmapUse, make};
    use glam::Vec3;
    use q3bsp::builder::MapBuilder;

    pub(super) fn room() -> Bsp {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("textures/wall", 0, 1);
        map.add_room(wall, Vec3::ZERO, Vec3::splat(512.0));
        let mut bsp = map.build();
        bsp.surfaces.iter_mut().for_each(|s| s.lightmap = -3);
        let material = |_: &str| LightmapUse::default();
        make(&mut bsp, &LayoutOptions::internal(&material)).unwrap();
        bsp
    }

    #[test]
    fn pages_in_a_map_come_back() {
        let mut bsp = room();
        let mut pages = vec![Page::blank(128); bsp.lightmaps.len()];
        pages[0].texels[1] = Vec3::new(0.2, 0.4, 0.6);
        internal(&mut bsp, &pages).unwrap();
        let read = Bsp::parse(&bsp.write()).unwrap();
        assert_eq!(read.lightmaps[0].texel(1, 0), [51, 102, 153]);
        let large = vec![Page::blank(256); pages.len()];
        assert!(matches!(
            internal(&mut bsp, &large),
            Err(StoreError::Side { .. })
        ));
        assert!(matches!(
            internal(&mut bsp, &[]),
            Err(StoreError::Pages { .. })
        ));
    }

    #[test]
    fn names_of_maps_have_neither_folder_nor_extension() {
        assert_eq!(map_name("maps/oa_dm1.bsp"), "oa_dm1");
        assert_eq!(map_name("room"), "room");
    }
}
