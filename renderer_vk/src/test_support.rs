//! Textures without a GPU, and maps loaded with them, for tests.

use std::collections::HashMap;
use std::sync::Arc;

use glam::{Vec3, Vec4};
use relight::image::{self, Image};
use relight::materials::finish::SurfaceMap;
use relight::{GameFiles, MemoryFiles, RelitWorld, SearchPath};
use shaders::types::Vertex;

use crate::assets::{ImageFlags, ImageSource, MaterialSettings, Materials, Models, Skins};
use crate::gpu;
use crate::scene::GatherInput;
use crate::settings::Settings;
use crate::world::{LightmapSink, WorldData, WorldOptions};

/// Assigns an index to every existing image.
pub struct FakeTextures {
    files: Arc<dyn GameFiles>,
    by_name: HashMap<String, Option<u32>>,
    next: u32,
    /// Flags of each image's first request.
    pub flags: HashMap<String, ImageFlags>,
    /// Number of lightmap pages made.
    pub lightmaps: usize,
}

/// A vertex at a place.
pub fn vertex(x: f32, y: f32, z: f32) -> Vertex {
    Vertex {
        position: Vec3::new(x, y, z),
        ..Vertex::default()
    }
}

pub const WHITE: u32 = 1;
pub const DEFAULT_IMAGE: u32 = 2;

impl FakeTextures {
    pub fn new(files: Arc<dyn GameFiles>) -> Self {
        Self {
            files,
            by_name: HashMap::from([("*default".into(), Some(DEFAULT_IMAGE))]),
            next: 10,
            flags: HashMap::new(),
            lightmaps: 0,
        }
    }

    /// Index of an image that was requested before.
    pub fn index(&self, name: &str) -> Option<u32> {
        self.by_name.get(name).copied().flatten()
    }
}

impl ImageSource for FakeTextures {
    fn image(&mut self, name: &str, flags: ImageFlags) -> Option<(u32, ImageFlags)> {
        if let Some(known) = self.by_name.get(name) {
            return known.map(|index| (index, self.flags.get(name).copied().unwrap_or(flags)));
        }
        let found = image::find(&*self.files, name).map(|_| {
            self.next += 1;
            self.next
        });
        self.flags.insert(name.into(), flags);
        self.by_name.insert(name.into(), found);
        found.map(|index| (index, flags))
    }

    fn surface_map(&mut self, map: &SurfaceMap) -> Option<u32> {
        map.load(&*self.files).ok().flatten()?;
        let next = self.next + 1;
        let index = *self.by_name.entry(map.to_string()).or_insert(Some(next));
        self.next = next;
        index
    }

    fn exists(&self, name: &str) -> bool {
        image::find(&*self.files, name).is_some()
    }

    fn white(&self) -> u32 {
        WHITE
    }

    fn default_image(&self) -> u32 {
        DEFAULT_IMAGE
    }

    fn scratch(&mut self, client: usize) -> u32 {
        5000 + u32::try_from(client).unwrap()
    }

    fn lightmap(&self, page: usize) -> Option<u32> {
        (page < self.lightmaps).then(|| 1001 + u32::try_from(page).unwrap())
    }

    /// Grey, but for images of numbers, whose meaning depends on their mean.
    fn mean(&self, texture: u32) -> Vec4 {
        let named = self.by_name.iter().find(|(_, i)| **i == Some(texture));
        if let Some((name, _)) = named
            && self.flags.get(name).is_some_and(|flags| flags.data)
            && let Ok(Some((picture, _))) = image::load(&*self.files, name)
        {
            return picture.mean_linear().extend(1.0);
        }
        if texture == WHITE {
            Vec4::ONE
        } else {
            Vec4::new(0.5, 0.5, 0.5, 1.0)
        }
    }
}

impl LightmapSink for FakeTextures {
    fn lightmap(&mut self, _: &str, _: &Image) -> Result<u32, gpu::Error> {
        self.lightmaps += 1;
        Ok(1000 + u32::try_from(self.lightmaps).unwrap())
    }
}

/// A registration without a GPU.
pub struct Registration {
    pub files: Arc<dyn GameFiles>,
    pub scripts: Arc<relight::Materials>,
    pub textures: FakeTextures,
    pub materials: Materials,
    pub models: Models,
    pub skins: Skins,
    pub settings: Settings,
}

impl Registration {
    pub fn new(files: impl GameFiles + 'static) -> Self {
        Self::with(files, Settings::default())
    }

    pub fn with(files: impl GameFiles + 'static, settings: Settings) -> Self {
        let files: Arc<dyn GameFiles> = Arc::new(files);
        let scripts = Arc::new(relight::Materials::load(&*files).0);
        let mut textures = FakeTextures::new(Arc::clone(&files));
        let materials = Materials::new(
            Arc::clone(&scripts),
            MaterialSettings::new(&settings),
            &mut textures,
        );
        Self {
            files,
            scripts,
            textures,
            materials,
            models: Models::default(),
            skins: Skins::default(),
            settings,
        }
    }

    /// Files with these contents.
    pub fn from_entries(entries: &[(&str, &[u8])]) -> Self {
        let mut files = MemoryFiles::new();
        for (name, bytes) in entries {
            files.insert(name, *bytes).unwrap();
        }
        Self::new(files)
    }

    /// Loads a map from these files.
    pub fn load(&mut self, map: &str) -> WorldData {
        let options = WorldOptions::new(&self.settings);
        let relit = RelitWorld::load(&*self.files, &self.scripts, map, options.relight()).unwrap();
        self.finish(relit, &options)
    }

    /// Loads a map built in memory.
    pub fn build(&mut self, bsp: q3bsp::Bsp) -> WorldData {
        let options = WorldOptions::new(&self.settings);
        let relit = RelitWorld::from_bsp(
            &*self.files,
            &self.scripts,
            "maps/test.bsp",
            bsp,
            options.relight(),
        );
        self.finish(relit, &options)
    }

    fn finish(&mut self, relit: RelitWorld, options: &WorldOptions) -> WorldData {
        let mut failure = None;
        let world = WorldData::new(
            relit,
            &mut self.materials,
            &mut self.textures,
            options,
            &mut failure,
        );
        assert!(failure.is_none());
        let bounds: Vec<_> = world
            .models
            .iter()
            .map(|m| (m.bounds.mins, m.bounds.maxs))
            .collect();
        self.models.register_inline(&bounds);
        world
    }

    pub fn model(&mut self, name: &str) -> i32 {
        self.models
            .register(&*self.files, &mut self.materials, &mut self.textures, name)
    }

    pub fn input<'a>(&'a self, world: Option<&'a WorldData>) -> GatherInput<'a> {
        GatherInput {
            traced_shadows: false,
            world,
            materials: &self.materials,
            models: &self.models,
            skins: &self.skins,
            settings: &self.settings,
        }
    }
}

/// A 24-bit TGA of one pixel.
pub const PIXEL: &[u8] = &[
    0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1, 0, 1, 0, 24, 0, 10, 20, 30,
];

/// The files of OpenArena's packs; without them `None`, with a report of a skipped test.
pub fn openarena() -> Option<SearchPath> {
    Some(SearchPath::open(&[testkit::folder()?]).unwrap())
}
