//! The images of a bake: those whose alpha cuts holes. Of all others it is enough that they exist.

use std::collections::HashSet;

use glam::Vec4;
use relight::RelitWorld;
use relight::image::Image;
use relight::materials::finish::SurfaceMap;
use shaderscript::Sky;

use crate::assets::{ImageFlags, ImageSource, Textures};
use crate::gpu;
use crate::world::LightmapSink;

/// Textures without the images that rays never read.
pub struct BakeImages<'a> {
    textures: &'a mut Textures,
    /// Images of stages without an alpha test, and sides of skies.
    unread: HashSet<String>,
}

impl<'a> BakeImages<'a> {
    /// Those of a world's materials.
    pub fn new(textures: &'a mut Textures, world: &RelitWorld) -> Self {
        let (mut unread, mut read) = (HashSet::new(), HashSet::new());
        for stage in (world.materials.iter()).flat_map(|m| &m.resolved.shader.stages) {
            let of_kind = match stage.alpha_func {
                Some(_) => &mut read,
                None => &mut unread,
            };
            of_kind.extend(stage.image.names().iter().cloned());
        }
        for material in &world.materials {
            let sky = material.resolved.shader.sky.as_ref();
            if let Some(outer) = sky.and_then(|sky| sky.outer.as_ref()) {
                unread.extend(Sky::SIDES.map(|side| format!("{outer}_{side}.tga")));
            }
        }
        unread.retain(|name| !read.contains(name));
        Self { textures, unread }
    }
}

impl ImageSource for BakeImages<'_> {
    fn image(&mut self, name: &str, flags: ImageFlags) -> Option<(u32, ImageFlags)> {
        if flags.data || !self.unread.contains(name) {
            return self.textures.image(name, flags);
        }
        let exists = self.textures.exists(name);
        exists.then(|| (self.textures.white(), flags))
    }

    fn surface_map(&mut self, map: &SurfaceMap) -> Option<u32> {
        self.textures.surface_map(map)
    }

    fn exists(&self, name: &str) -> bool {
        self.textures.exists(name)
    }

    fn white(&self) -> u32 {
        self.textures.white()
    }

    fn default_image(&self) -> u32 {
        self.textures.default_image()
    }

    fn scratch(&mut self, client: usize) -> u32 {
        self.textures.scratch(client)
    }

    fn lightmap(&self, page: usize) -> Option<u32> {
        ImageSource::lightmap(self.textures, page)
    }

    fn mean(&self, texture: u32) -> Vec4 {
        self.textures.mean(texture)
    }
}

impl LightmapSink for BakeImages<'_> {
    fn lightmap(&mut self, name: &str, page: &Image) -> Result<u32, gpu::Error> {
        self.textures.create_lightmap(name, page)
    }
}
