//! Baked light in a map's lumps.

use super::page::Page;
use super::store::deluxe::{DirectionSpace, direction_texel};
use super::{Baked, BakedPage, Encoding};
use crate::overbright::MAP_OVERBRIGHT_BITS;
use crate::world::{RelitWorld, WorldSurface};
use glam::{Vec2, Vec3};
use q3bsp::{Bsp, Lightmap, SurfaceKind};
use std::collections::HashMap;
use support::parallel;
use support::slice::item;

/// What was changed in a map beside its pages.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Stored {
    /// Vertices.
    pub vertices: usize,
    /// Points of the light grid.
    pub grid: usize,
}

impl Baked {
    /// Pages of stored light for a map, one for each that it has. Texels that no surface shows stay as they are.
    pub fn pages(&self, world: &RelitWorld, bsp: &Bsp, encoding: Encoding) -> Vec<Page> {
        let of_number: HashMap<usize, &BakedPage> =
            self.pages.iter().map(|page| (page.number, page)).collect();
        parallel::map(&bsp.lightmaps, |number, before| {
            let mut page = as_it_was(before);
            let Some(baked) = of_number.get(&number) else {
                return page;
            };
            let texels = page.texels.iter_mut();
            for ((texel, light), &owner) in texels.zip(&baked.light).zip(&baked.owners) {
                if owner != u32::MAX {
                    *texel = encoding.stored(light.value, scale_of(world, owner));
                }
            }
            page
        })
    }

    /// Pages of directions to the light, for a map with these pages; see
    /// [`store::deluxe`](super::store::deluxe).
    pub fn directions(&self, bsp: &Bsp, space: DirectionSpace) -> Vec<Page> {
        let blank = |page: &Lightmap| Page {
            side: page.size(),
            texels: vec![direction_texel(Vec3::ZERO, Vec3::Z, space); page.size() * page.size()],
        };
        let mut pages: Vec<Page> = bsp.lightmaps.iter().map(blank).collect();
        for baked in &self.pages {
            let Some(page) = pages.get_mut(baked.number) else {
                continue;
            };
            let texels = page.texels.iter_mut().zip(&baked.normals);
            for (((texel, &normal), light), &owner) in texels.zip(&baked.light).zip(&baked.owners) {
                if owner != u32::MAX {
                    *texel = direction_texel(light.towards, normal, space);
                }
            }
        }
        pages
    }

    /// Pages that scripts name, with the game paths of their images, which [`pages`](Self::pages) does not have. Their values
    /// are as engines show them where the world is calibrated; else as the compiler stores them, so that authors scale them by
    /// `q3map_lightmapBrightness`.
    pub fn images(&self, world: &RelitWorld, encoding: Encoding) -> Vec<(String, Page)> {
        let scale = match world.calibration.is_some() {
            true => (1 << MAP_OVERBRIGHT_BITS) as f32,
            false => 1.0,
        };
        let image = |baked: &BakedPage| {
            let at = baked.number.checked_sub(world.bsp.lightmaps.len())?;
            let path = world.files_of_pages.get(at)?.clone();
            let mut page = as_it_was(world.page(baked.number)?);
            let texels = page.texels.iter_mut();
            for ((texel, light), &owner) in texels.zip(&baked.light).zip(&baked.owners) {
                if owner != u32::MAX {
                    *texel = encoding.stored(light.value, scale_of(world, owner)) * scale;
                }
            }
            Some((path, page))
        };
        self.pages.iter().filter_map(image).collect()
    }

    /// Writes the light of vertices and of the grid into a map: the one of the world, or one with the same surfaces and
    /// vertices. Everything that is no light stays as it is.
    pub fn store_beside_pages(
        &self,
        world: &RelitWorld,
        bsp: &mut Bsp,
        encoding: Encoding,
    ) -> Stored {
        let mut stored = Stored::default();
        let sources: HashMap<usize, &BakedPage> =
            self.pages.iter().map(|page| (page.number, page)).collect();
        for &(vertex, surface, light) in &self.vertices {
            let bytes = encoding.bytes(light, scale_of(world, surface));
            stored.vertices += usize::from(set_color(bsp, vertex, bytes));
        }
        for surface in 0..world.surfaces.len() {
            stored.vertices += color_by_page(world, bsp, surface, &sources, encoding);
        }
        if let Some(grid) = &self.grid {
            bsp.light_grid.clone_from(grid);
            stored.grid = grid.len();
        }
        stored
    }
}

/// A page with the values that it has.
fn as_it_was(page: &Lightmap) -> Page {
    Page {
        side: page.size(),
        texels: (page.0.as_chunks::<3>().0.iter())
            .map(|texel| Vec3::from_array(texel.map(f32::from)) / 255.0)
            .collect(),
    }
}

/// Factor of a surface's material before light is stored.
fn scale_of(world: &RelitWorld, surface: u32) -> f32 {
    let surface = world.surfaces.get(surface as usize);
    let material = surface.and_then(|surface| world.material_of(surface));
    material.map_or(1.0, crate::WorldMaterial::stored_scale)
}

/// Sets the colour of a vertex; its alpha stays.
fn set_color(bsp: &mut Bsp, vertex: u32, [r, g, b]: [u8; 3]) -> bool {
    let Some(vertex) = bsp.vertices.get_mut(vertex as usize) else {
        return false;
    };
    let [.., alpha] = vertex.color;
    vertex.color = [r, g, b, alpha];
    true
}

/// Gives the vertices of a lightmapped surface the light of their texels, which engines show with `r_vertexLight`.
fn color_by_page(
    world: &RelitWorld,
    bsp: &mut Bsp,
    surface: usize,
    pages: &HashMap<usize, &BakedPage>,
    encoding: Encoding,
) -> usize {
    let shown = |surface: &&WorldSurface| {
        matches!(surface.kind, SurfaceKind::Planar | SurfaceKind::Patch) && surface.num_indices > 0
    };
    let Some(own) = world.surfaces.get(surface).filter(shown) else {
        return 0;
    };
    let page = usize::try_from(own.light_page).ok();
    let (Some(page), Some(stored)) = (
        page.and_then(|page| pages.get(&page)),
        bsp.surfaces.get(surface).copied(),
    ) else {
        return 0;
    };
    let scale = scale_of(world, surface as u32);
    let places: Vec<(u32, Option<Vec3>)> = (stored.first_vert.max(0) as u32..)
        .zip(bsp.surface_vertices(&stored))
        .map(|(index, vertex)| (index, near(page, vertex.finite().lightmap)))
        .collect();
    let mut changed = 0;
    for (vertex, light) in places {
        if let Some(light) = light {
            changed += usize::from(set_color(bsp, vertex, encoding.bytes(light, scale)));
        }
    }
    changed
}

/// Light of the texel at a place in a page (0 to 1), or of the nearest lit texel beside it.
fn near(page: &BakedPage, at: Vec2) -> Option<Vec3> {
    let place = at * page.side as f32;
    let texel = place.floor();
    let mut best: Option<(f32, Vec3)> = None;
    for dy in -1..=1 {
        for dx in -1..=1 {
            let at = texel + Vec2::new(dx as f32, dy as f32);
            let inside = at.min_element() >= 0.0 && at.max_element() < page.side as f32;
            if !inside {
                continue;
            }
            let index = at.y as usize * page.side + at.x as usize;
            let distance = (at + 0.5 - place).length_squared();
            let lit = page.owners.get(index).is_some_and(|o| *o != u32::MAX);
            if lit && best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, item(&page.light, index).value));
            }
        }
    }
    best.map(|(_, light)| light)
}

#[cfg(test)]
mod tests {
    use super::super::layout::{LayoutOptions, LightmapUse, make};
    use super::super::{BakeOptions, Rays, bake};
    use crate::files::MemoryFiles;
    use crate::image::tests::rgb_tga;
    use crate::load::Options;
    use crate::materials::Materials;
    use crate::world::RelitWorld;
    use glam::{Vec2, Vec3};
    use q3bsp::builder::MapBuilder;

    const IMAGE: &str = "maps/m/lm_0007.tga";

    #[test]
    fn images_that_scripts_name_get_light_and_charts() {
        let mut map = MapBuilder::new();
        let wall = map.add_shader("t/wall", 0, 1);
        map.add_room(wall, Vec3::splat(-128.0), Vec3::splat(128.0));
        map.add_entity(&[
            ("classname", "light"),
            ("light", "200"),
            ("origin", "0 0 0"),
        ]);
        let mut bsp = map.build();
        bsp.surfaces.iter_mut().for_each(|s| s.lightmap = -3);
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        for (vertex, (s, t)) in bsp.vertices.iter_mut().zip(corners.into_iter().cycle()) {
            vertex.lightmap = Vec2::new(s, t);
        }
        let mut files = MemoryFiles::new();
        let script = format!(
            "t/wall\n{{\n{{\nmap {IMAGE}\ntcGen lightmap\n}}\n{{\nmap t/wall.tga\nblendFunc filter\n}}\n}}\n"
        );
        files
            .insert("scripts/a.shader", script.into_bytes())
            .unwrap();
        files.insert(IMAGE, rgb_tga(16, 16, &[9; 768])).unwrap();
        let wall = rgb_tga(1, 1, &[9; 3]);
        files.insert("t/wall.tga", wall).unwrap();
        let (materials, _) = Materials::load(&files);
        let options = Options {
            calibrate: None,
            ..Options::default()
        };
        let mut world =
            RelitWorld::from_bsp(&files, &materials, "maps/m.bsp", bsp.clone(), options);
        world.take_compiled_lights(&files);
        let options = BakeOptions {
            pattern: 1,
            samples: 0,
            bounces: 0,
            ..BakeOptions::of(&world)
        };
        let baked = bake(&world, &mut Rays::new(&world), &options, &mut |_, _| ()).unwrap();
        let images = baked.images(&world, options.encoding);
        let [(path, page)] = &images[..] else {
            panic!("{} images", images.len())
        };
        assert_eq!((path.as_str(), page.side), (IMAGE, 16));
        assert!(page.texels.iter().all(|texel| texel.x > 12.0 / 255.0));
        // six walls with the density that they have on the image
        let material = |_: &str| LightmapUse {
            image: Some(16),
            shows_page: false,
            ..LightmapUse::default()
        };
        let laid = make(&mut bsp, &LayoutOptions::external(&material)).unwrap();
        assert_eq!(laid.charts, 6);
        assert!(bsp.surfaces.iter().all(|s| s.lightmap >= 0));
    }
}
