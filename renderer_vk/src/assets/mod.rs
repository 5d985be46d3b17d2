//! Assets that the game registers: images, materials, models, skins and fonts, as handles to data on the GPU.

mod alpha;
mod bind;
pub mod compile;
mod dielectric;
mod finish;
mod flags;
mod fonts;
mod light_stage;
mod lit_texture;
mod material;
mod material_buffers;
mod materials;
mod model_load;
mod models;
pub mod prepare;
mod skins;
mod source;
mod textures;
mod unlit;

use std::sync::Arc;

use relight::GameFiles;

#[cfg(test)]
pub use finish::is_glossy;
pub use fonts::LoadedFont;
pub use lit_texture::TextureLight;
pub use material::{Combine, LightmapClass, Material, NO_DYNAMIC_LIGHT, RasterPass};
pub use materials::{MaterialSettings, Materials};
pub use models::{IqmModel, Md3Lod, MdrModel, Model, Models};
pub use prepare::TextureSettings;
pub(crate) use prepare::{desaturate, grey};
pub use skins::Skins;
pub use source::{ImageFlags, ImageSource};
pub use textures::{Samplers, Textures};

use crate::gpu::{self, Device};
use crate::settings::{Settings, TextureMode};

/// All assets registered since the last `BeginRegistration`.
pub struct Assets {
    /// The device that holds them.
    pub device: Device,
    /// Images.
    pub textures: Textures,
    /// Materials.
    pub materials: Materials,
    /// Models.
    pub models: Models,
    /// Skins.
    pub skins: Skins,
    /// Samplers of the current texture mode.
    pub samplers: Samplers,
    /// The game's scripts.
    pub scripts: Arc<relight::Materials>,
    fonts: Vec<LoadedFont>,
    texture_mode: TextureMode,
    anisotropy: f32,
}

impl Assets {
    /// The built-in images and materials only. `scripts`: those of the game.
    ///
    /// # Errors
    /// The device has no memory or no free descriptors for the built-in images and the samplers.
    pub fn new(
        device: &Device,
        files: Arc<dyn GameFiles>,
        scripts: Arc<relight::Materials>,
        settings: &Settings,
    ) -> Result<Self, gpu::Error> {
        let samplers = Samplers::new(device, settings.texture_mode, settings.anisotropy())?;
        let texture_settings = TextureSettings::new(settings, MAX_TEXTURE_SIZE);
        let mut textures = Textures::new(device, files, texture_settings)?;
        let materials = Materials::new(
            Arc::clone(&scripts),
            MaterialSettings::new(settings),
            &mut textures,
        );
        Ok(Self {
            device: device.clone(),
            textures,
            materials,
            models: Models::default(),
            skins: Skins::default(),
            samplers,
            scripts,
            fonts: Vec::new(),
            texture_mode: settings.texture_mode,
            anisotropy: settings.anisotropy(),
        })
    }

    /// Begins another registration with the scripts and [images](Textures::renew) that are loaded.
    pub fn renew(&mut self, files: Arc<dyn GameFiles>, settings: &Settings) {
        self.textures.renew(files);
        self.materials = Materials::new(
            Arc::clone(&self.scripts),
            MaterialSettings::new(settings),
            &mut self.textures,
        );
        self.models = Models::default();
        self.skins = Skins::default();
        self.fonts.clear();
    }

    /// Settings for assets that are loaded from now on. Between `BeginRegistration` and the map, a game may change a
    /// setting that players can change only with a restart.
    pub fn set_settings(&mut self, settings: &Settings) {
        self.textures
            .set_settings(TextureSettings::new(settings, MAX_TEXTURE_SIZE));
        self.materials.set_settings(MaterialSettings::new(settings));
    }

    /// Registers an image or material for the game; 0 if it is unusable. `mip`: with mip levels, repeated.
    pub fn register_shader(&mut self, name: &str, mip: bool) -> i32 {
        let index = self
            .materials
            .find(&mut self.textures, name, LightmapClass::TwoD, mip);
        if self.materials.get(index).defaulted {
            return 0;
        }
        i32::try_from(index).unwrap_or(0)
    }

    /// Registers a model; 0 if it is unusable.
    pub fn register_model(&mut self, name: &str) -> i32 {
        let files = Arc::clone(self.textures.files());
        self.models
            .register(&*files, &mut self.materials, &mut self.textures, name)
    }

    /// Registers a skin; 0 if it is unusable.
    pub fn register_skin(&mut self, name: &str) -> i32 {
        let files = Arc::clone(self.textures.files());
        self.skins
            .register(&*files, &mut self.materials, &mut self.textures, name)
    }

    /// The material index of a handle from the game; the default material for an invalid handle.
    pub fn material_of_handle(&self, handle: i32) -> u32 {
        self.materials.of_handle(handle)
    }

    /// `RemapShader`.
    pub fn remap_shader(&mut self, old: &str, new: &str, time_offset: Option<f32>) {
        self.materials
            .remap(&mut self.textures, old, new, time_offset);
    }

    /// Uploads new pixels of a cinematic, see [`Textures::update_scratch`].
    ///
    /// # Errors
    /// The device has no memory for a texture of another size, or for the upload.
    pub fn update_scratch(
        &mut self,
        client: usize,
        width: u32,
        height: u32,
        rgba: &[u8],
        dirty: bool,
    ) -> Result<(), gpu::Error> {
        let changed = self
            .textures
            .update_scratch(client, width, height, rgba, dirty)?;
        if let Some((_, new)) = changed {
            self.materials.replace_scratch(client, new);
        }
        Ok(())
    }

    /// Call once a frame, before recording: applies a changed texture mode and uploads changed materials.
    ///
    /// # Errors
    /// The device has no memory for the uploads, or no free descriptors for samplers.
    pub fn prepare_frame(&mut self, settings: &Settings) -> Result<(), gpu::Error> {
        if settings.texture_mode != self.texture_mode {
            self.texture_mode = settings.texture_mode;
            self.samplers = Samplers::new(&self.device, self.texture_mode, self.anisotropy)?;
            self.materials.invalidate();
        }
        self.materials.upload(&self.device, &self.samplers)
    }
}

/// Maximum side of a texture: every Vulkan device supports it.
const MAX_TEXTURE_SIZE: u32 = 4096;

#[cfg(test)]
mod tests;
