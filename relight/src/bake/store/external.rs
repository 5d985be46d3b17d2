//! Pages beside a map, as images.
//!
//! Two ways, as q3map2 has them. *Numbered* (`-external`): the map has no pages, and its surfaces keep their numbers; engines
//! that know them, as DarkPlaces does, load `maps/NAME/lm_0000.tga` and so on; others light by vertex. *Scripted* (`q3map_lightmapSize`): each material and page gets a script of its own that shows the image, which
//! every engine of the family loads.

use super::script::with_image;
use super::tga::encode;
use super::{GameFile, StoreError, check, lightmap, map_name, set_pages};
use crate::bake::page::Page;
use crate::files::GameFiles;
use crate::materials::Materials;
use crate::overbright::MAP_OVERBRIGHT_BITS;
use image::ImageEncoder;
use q3bsp::{Bsp, ShaderId, ShaderRef, SurfaceKind, lightmap_index};
use std::collections::{BTreeMap, BTreeSet};
use support::hash::Hash;

/// Quality of JPEG images, of 100.
const JPEG: u8 = 95;

/// Longest game path, bytes.
const LONGEST: usize = 63;

/// Path of a page's image.
fn path(map: &str, page: usize) -> Result<String, StoreError> {
    let path = format!("maps/{}/lm_{page:04}.tga", map_name(map));
    match path.len() <= LONGEST {
        true => Ok(path),
        false => Err(StoreError::Path(path)),
    }
}

/// Pages as numbered images. The map keeps the numbers of its surfaces and has no pages.
///
/// # Errors
/// [`StoreError`]; the map is as it was.
pub fn numbered(bsp: &mut Bsp, map: &str, pages: &[Page]) -> Result<Vec<GameFile>, StoreError> {
    check(bsp, pages)?;
    let files = pages.iter().enumerate().map(|(number, page)| {
        Ok(GameFile {
            path: path(map, number)?,
            bytes: encode(&lightmap(page)),
        })
    });
    let files = files.collect::<Result<Vec<_>, _>>()?;
    set_pages(bsp, Vec::new());
    Ok(files)
}

/// Pages as images that scripts name. Surfaces get materials of their own, one for each material and page, in the script
/// `scripts/relit_NAME.shader`. The images have the light as it is displayed, after the shift of the overbright bits, since
/// engines shift only pages in maps. `taken`: paths of images that other surfaces show.
///
/// # Errors
/// [`StoreError`]; the map is as it was.
pub fn scripted(
    bsp: &mut Bsp,
    map: &str,
    pages: &[Page],
    (files, materials): (&dyn GameFiles, &Materials),
    taken: &BTreeSet<String>,
) -> Result<Vec<GameFile>, StoreError> {
    check(bsp, pages)?;
    let mut out = Vec::with_capacity(pages.len() + 1);
    let mut number = 0;
    for page in pages {
        let mut place = path(map, number)?;
        while taken.contains(&place.to_ascii_lowercase()) {
            number += 1;
            place = path(map, number)?;
        }
        number += 1;
        out.push(GameFile {
            path: place,
            bytes: encode(&lightmap(&as_shown(page))),
        });
    }
    let name = map_name(map);
    let mut text =
        format!("// Materials of {name} with lightmaps beside the map, written by relight bake.\n");
    let mut made: BTreeMap<(ShaderId, i32), ShaderId> = BTreeMap::new();
    let mut known: BTreeSet<String> = BTreeSet::new();
    for surface in bsp.surfaces.iter_mut().filter(|s| s.lightmap >= 0) {
        let page = std::mem::replace(&mut surface.lightmap, lightmap_index::BY_VERTEX);
        if !matches!(surface.kind, SurfaceKind::Planar | SurfaceKind::Patch) {
            continue; // engines ignore its page
        }
        let key = (surface.shader, page);
        let shader = match made.get(&key) {
            Some(shader) => *shader,
            None => {
                let Some(old) = bsp.shaders.get(surface.shader.index()).cloned() else {
                    continue;
                };
                let image = usize::try_from(page).ok().and_then(|page| out.get(page));
                let Some(image) = image.map(|file| file.path.as_str()) else {
                    continue;
                };
                let body = with_image(files, materials, &old.name, image);
                let new = script_name(name, &old.name, &body);
                if known.insert(new.clone()) {
                    text += &format!("\n// {}\n{new}\n{body}", old.name);
                }
                let mut stored = ShaderRef::new(&new, old.surface_flags, old.content_flags);
                stored.raw_flags = old.raw_flags;
                let id = ShaderId::from_raw(i32::try_from(bsp.shaders.len()).unwrap_or(i32::MAX));
                bsp.shaders.push(stored);
                made.insert(key, id);
                id
            }
        };
        surface.shader = shader;
    }
    set_pages(bsp, Vec::new());
    out.push(GameFile {
        path: format!("scripts/relit_{name}.shader"),
        bytes: text.into_bytes(),
    });
    Ok(out)
}

/// A page as engines show it, which shift only pages in maps.
fn as_shown(page: &Page) -> Page {
    let scale = (1 << MAP_OVERBRIGHT_BITS) as f32;
    Page {
        side: page.side,
        texels: page.texels.iter().map(|texel| *texel * scale).collect(),
    }
}

/// Pages as images at given game paths. Engines look for the name's extension first, then for others: the image has the
/// extension that is given, `.tga`, `.png` or `.jpg`. `None` for any other.
pub fn image_file(path: &str, page: &Page) -> Option<GameFile> {
    let page = lightmap(page);
    let side = u32::try_from(page.size()).ok()?;
    let (_, extension) = path.rsplit_once('.')?;
    let mut bytes = Vec::new();
    let rgb = image::ExtendedColorType::Rgb8;
    match extension.to_ascii_lowercase().as_str() {
        "tga" => bytes = encode(&page),
        "png" => image::codecs::png::PngEncoder::new(&mut bytes)
            .write_image(&page.0, side, side, rgb)
            .ok()?,
        "jpg" | "jpeg" => image::codecs::jpeg::JpegEncoder::new_with_quality(&mut bytes, JPEG)
            .write_image(&page.0, side, side, rgb)
            .ok()?,
        _ => return None,
    }
    Some(GameFile {
        path: path.to_owned(),
        bytes,
    })
}

/// The name of a material with another image: the map's, and a hash of the old name and the definition.
fn script_name(map: &str, old: &str, body: &str) -> String {
    let mut hash = Hash::new();
    hash.bytes(old.to_ascii_lowercase().as_bytes());
    hash.bytes(body.as_bytes());
    let hash = format!("/{:032X}", hash.finish());
    let mut name = map.to_owned();
    while name.len() + hash.len() > LONGEST {
        name.pop();
    }
    name + &hash
}

#[cfg(test)]
mod tests {
    use super::super::tests::room;
    use super::*;
    use crate::external_lightmaps;
    use crate::files::MemoryFiles;
    use crate::load::Options;
    use crate::world::RelitWorld;
    use glam::Vec3;
    use q3bsp::Lightmap;

    fn pages(bsp: &Bsp) -> Vec<Page> {
        let mut pages = vec![Page::blank(128); bsp.lightmaps.len()];
        for (number, page) in pages.iter_mut().enumerate() {
            page.texels.fill(Vec3::splat(0.1 + 0.1 * number as f32));
        }
        pages
    }

    fn folder(written: Vec<GameFile>) -> MemoryFiles {
        let mut files = MemoryFiles::new();
        for file in written {
            files.insert(&file.path, file.bytes).unwrap();
        }
        files
    }

    #[test]
    fn numbered_pages_are_read_back() {
        let mut bsp = room();
        let pages = pages(&bsp);
        let before: Vec<i32> = bsp.surfaces.iter().map(|s| s.lightmap).collect();
        let files = folder(numbered(&mut bsp, "maps/room.bsp", &pages).unwrap());
        let mut read = Bsp::parse(&bsp.write()).unwrap();
        assert!(read.lightmaps.is_empty());
        assert_eq!(
            external_lightmaps(&mut read, &files, "maps/room.bsp"),
            Ok(pages.len())
        );
        let after: Vec<i32> = read.surfaces.iter().map(|s| s.lightmap).collect();
        assert_eq!(before, after);
        assert_eq!(read.lightmaps[0].texel(3, 3), [26; 3]);
    }

    #[test]
    fn scripted_pages_are_the_main_light_of_their_surfaces() {
        let mut bsp = room();
        let pages = pages(&bsp);
        let before: Vec<i32> = bsp.surfaces.iter().map(|s| s.lightmap).collect();
        let none = MemoryFiles::new();
        let (materials, _) = Materials::load(&none);
        let taken = BTreeSet::from(["maps/room/lm_0000.tga".to_owned()]);
        let game: (&dyn GameFiles, &Materials) = (&none, &materials);
        let written = scripted(&mut bsp, "maps/room.bsp", &pages, game, &taken).unwrap();
        assert_eq!(written[0].path, "maps/room/lm_0001.tga");
        let mut files = folder(written);
        let wall = encode(&Lightmap(vec![200; 12].into()));
        files.insert("textures/wall.tga", wall).unwrap();
        let read = Bsp::parse(&bsp.write()).unwrap();
        let (materials, _) = Materials::load(&files);
        let options = Options {
            calibrate: None,
            ..Options::default()
        };
        let world = RelitWorld::from_bsp(&files, &materials, "maps/room.bsp", read, options);
        for (surface, page) in world.surfaces.iter().zip(before) {
            let found = world.page(surface.light_page as usize).unwrap();
            // shifted by two bits
            let value = (4.0 * (0.1 + 0.1 * page as f32) * 255.0).min(255.0).round() as u8;
            assert_eq!(found.texel(0, 0), [value; 3]);
        }
    }

    #[test]
    fn images_keep_the_extension_that_scripts_name() {
        let page = Page {
            side: 2,
            texels: vec![Vec3::splat(0.5); 4],
        };
        for (path, within) in [("maps/m/a.tga", 0), ("b.png", 0), ("c.JPG", 2)] {
            let file = image_file(path, &page).unwrap();
            let extension = path.rsplit_once('.').unwrap().1.to_ascii_lowercase();
            let read = crate::image::decode("lm", &extension, &file.bytes).unwrap();
            assert!(
                read.pixels().all(|p| p[0].abs_diff(128) <= within),
                "{path}"
            );
        }
        assert!(image_file("a.dds", &page).is_none());
    }

    #[test]
    fn names_fit_the_lump() {
        let name = script_name(&"m".repeat(60), "textures/a", "{\n}\n");
        assert_eq!(name.len(), LONGEST);
        assert!(matches!(path(&"m".repeat(60), 0), Err(StoreError::Path(_))));
        assert_ne!(name, script_name(&"m".repeat(60), "textures/b", "{\n}\n"));
    }
}
