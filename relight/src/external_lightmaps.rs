//! Lightmaps that lie beside a map instead of in it.
//!
//! Source: q3map2 (`-external`) names them `maps/NAME/lm_0000.tga` and counts up; engines that read them take surfaces'
//! page numbers for these numbers.

use crate::files::GameFiles;
use crate::image;
use q3bsp::{Bsp, Lightmap, Lump};

/// Most pages that are looked for.
const MOST: usize = 10_000;

/// Takes the lightmaps beside a map into it, where it has none of its own, and gives surfaces their pages back. `map`:
/// its game path. Returns how many there are. The map then holds more than its file: [`Bsp::write`] is not to
/// write it.
///
/// # Errors
/// A page that cannot be read, is not square or has another size than the first; the map is as it was.
pub fn external_lightmaps(
    bsp: &mut Bsp,
    files: &dyn GameFiles,
    map: &str,
) -> Result<usize, String> {
    if !bsp.lightmaps.is_empty() {
        return Ok(0);
    }
    let stem = image::split_extension(map).map_or(map, |(stem, _)| stem);
    let mut pages: Vec<Lightmap> = Vec::new();
    for number in 0..MOST {
        let path = format!("{stem}/lm_{number:04}");
        let Some((picture, path)) = image::load(files, &path).map_err(|e| e.to_string())? else {
            break; // the numbers have no gaps
        };
        let same = pages
            .first()
            .is_none_or(|first| first.size() == picture.width as usize);
        if picture.width != picture.height || !same {
            return Err(format!(
                "{path}: {} by {} texels; lightmaps are square and of one size",
                picture.width, picture.height
            ));
        }
        let texels = picture.pixels().flat_map(|[r, g, b, _]| [r, g, b]);
        pages.push(Lightmap(texels.collect()));
    }
    let count = pages.len();
    if count == 0 {
        return Ok(0);
    }
    bsp.lightmaps = pages;
    // Reading the map took numbers without a page away.
    let surfaces = &mut bsp.surfaces;
    bsp.warnings.retain(|warning| {
        let page = i32::try_from(warning.value).ok().filter(|page| {
            usize::try_from(*page).is_ok_and(|page| page < count)
                && warning.lump == Lump::Surfaces
                && warning.field == "lightmapNum"
        });
        let surface = warning
            .element
            .and_then(|element| surfaces.get_mut(element));
        match (page, surface) {
            (Some(page), Some(surface)) => {
                surface.lightmap = page;
                false
            }
            _ => true,
        }
    });
    Ok(count)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::MemoryFiles;
    use crate::image::tests::rgb_tga;
    use glam::Vec3;
    use q3bsp::builder::MapBuilder;

    fn map() -> Bsp {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/wall", 0, 1);
        map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
        let mut bsp = map.build();
        for (surface, page) in bsp.surfaces.iter_mut().zip([0, 1, 7]) {
            surface.lightmap = page;
        }
        bsp.lightmaps.clear();
        Bsp::parse(&bsp.write()).unwrap()
    }

    #[test]
    fn surfaces_get_their_pages_back() {
        let mut files = MemoryFiles::new();
        for (number, value) in [(0, 10), (1, 20)] {
            let path = format!("maps/room/lm_{number:04}.tga");
            files.insert(&path, rgb_tga(4, 4, &[value; 48])).unwrap();
        }
        let mut bsp = map();
        assert_eq!(bsp.surfaces[1].lightmap, -3);
        let found = external_lightmaps(&mut bsp, &files, "maps/room.bsp");
        assert_eq!(found, Ok(2));
        let pages: Vec<i32> = bsp.surfaces.iter().take(3).map(|s| s.lightmap).collect();
        assert_eq!(pages, [0, 1, -3]);
        assert_eq!(bsp.lightmaps[1].0[..3], [20; 3]);
        assert_eq!(bsp.warnings.len(), 1);
    }

    #[test]
    fn pages_of_other_sizes_are_refused_and_nothing_changes() {
        let mut files = MemoryFiles::new();
        files
            .insert("maps/room/lm_0000.tga", rgb_tga(4, 4, &[1; 48]))
            .unwrap();
        files
            .insert("maps/room/lm_0001.tga", rgb_tga(2, 2, &[1; 12]))
            .unwrap();
        let mut bsp = map();
        assert!(external_lightmaps(&mut bsp, &files, "maps/room.bsp").is_err());
        assert!(bsp.lightmaps.is_empty());
    }
}
