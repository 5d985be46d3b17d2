//! Registration: models, materials, fonts, the map.

use std::sync::Arc;

use glam::{Mat4, Vec3};
use relight::GameFiles;
use shaders::types::constants::NO_TEXTURE;

use super::Renderer;
use crate::api::DynamicLight;
use crate::assets::{Assets, LoadedFont};
use crate::error::Error;
use crate::gpu::{ColorMask, give_back_freed_memory};
use crate::raster::{self, ViewParameters};
use crate::scene::Scene;
use crate::settings::Settings;
use crate::world::{EntityTokens, World};

impl Renderer {
    /// Begins a registration: drops all models, textures, materials and the map, and reads the scripts through `files`.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn begin_registration(
        &mut self,
        files: Arc<dyn GameFiles>,
        settings: &Settings,
    ) -> Result<(), Error> {
        self.show_finished()?;
        self.shutdown_registration();
        self.settings = settings.clone();
        let (scripts, diagnostics) = relight::Materials::load(&*files);
        for diagnostic in diagnostics {
            log::debug!("{diagnostic}");
        }
        for fault in scripts.faults_of_files() {
            log::warn!("{fault}");
        }
        self.assets = Some(Assets::new(
            &self.device,
            files,
            Arc::new(scripts),
            settings,
        )?);
        Ok(())
    }

    /// Begins a registration, and keeps scripts and images: only files below `maps/` may differ from those of the
    /// registration before.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn renew_registration(
        &mut self,
        files: Arc<dyn GameFiles>,
        settings: &Settings,
    ) -> Result<(), Error> {
        self.show_finished()?;
        let Some(mut assets) = self.assets.take() else {
            return self.begin_registration(files, settings);
        };
        self.shutdown_registration();
        self.settings = settings.clone();
        assets.renew(files, settings);
        self.assets = Some(assets);
        Ok(())
    }

    /// Ends a registration: compiles the pipelines of the registered materials.
    pub fn end_registration(&mut self) {
        // pipelines that are missing after a failure are compiled at first use
        if let Err(e) = self.warm_up() {
            log::warn!("pipelines could not be compiled in advance: {e}");
        }
        self.kept_pipelines.write(&self.device);
        give_back_freed_memory();
    }

    /// Draws all registered materials once, invisibly.
    fn warm_up(&mut self) -> Result<(), Error> {
        let format = self.picture_format();
        self.targets.fit(&self.device, &self.settings, format)?;
        let Some(assets) = &mut self.assets else {
            return Ok(());
        };
        assets.prepare_frame(&self.settings)?;
        let target = raster::Target {
            color: self.targets.drawn(),
            depth: self.targets.depth(),
            mask: ColorMask::ALL,
        };
        let stages = raster::StageContext {
            materials: &assets.materials,
            samplers: &assets.samplers,
            identity_light: self.settings.identity_light(),
            light_spot: assets.textures.dynamic_light(),
            pixel_lights: raster::PixelLights::new(&self.settings),
            mapping: raster::SurfaceMapping::new(&self.settings),
            only_texture: None,
            traced_shadows: false,
        };
        let surfaces = self.world.iter().flat_map(|world| &world.surfaces);
        let mut pages = surfaces.map(|surface| surface.lightmap);
        let fogs = self.world.as_ref().filter(|world| !world.fogs.is_empty());
        let world = raster::ExpectedWorld {
            lightmap: pages.find(|&page| page != NO_TEXTURE).unwrap_or(NO_TEXTURE),
            fog: fogs.is_some(),
        };
        self.list.clear();
        self.list.add_expected(stages, world);
        let parameters = ViewParameters {
            world_to_clip: Mat4::IDENTITY,
            near_world_to_clip: None,
            clip_plane: [0.0; 4],
            origin: Vec3::ZERO,
            forward: Vec3::Z,
            identity_light: self.settings.identity_light(),
            materials: assets.materials.addresses(),
            static_vertices: 0,
            mapped_vertices: 0,
            dynamic_vertices: None,
            fogs: fogs.map_or(0, |world| world.fog_buffer.address()),
            instances: &[raster::expected_instance()],
            lights: &[DynamicLight::default()],
            light_backs: true,
            viewport: [0, 0, 1, 1],
            part: None,
            clear_depth: true,
            clear_color: None,
            shadows: None,
        };
        self.raster
            .warm_up(target.kind(), &mut self.list, &parameters)?;
        Ok(())
    }

    /// Drops all models, textures, materials and the map. Repeated calls have no effect.
    pub fn shutdown_registration(&mut self) {
        self.queue.clear();
        self.overlay.clear();
        self.scene = Scene::default();
        self.held.release();
        self.still.cancel();
        self.trace = None;
        self.hybrid = None;
        self.lacks_hybrid = false;
        self.world = None;
        self.assets = None;
        self.entity_tokens = EntityTokens::default();
    }

    /// Handle of a material by name; `mip` is false for 2D pictures. 0: it is unusable, and the default material is
    /// drawn.
    pub fn register_shader(&mut self, name: &str, mip: bool) -> i32 {
        self.assets
            .as_mut()
            .map_or(0, |assets| assets.register_shader(name, mip))
    }

    /// Handle of a model by file name, or `*n` for the map's brush models. 0: it is unusable.
    pub fn register_model(&mut self, name: &str) -> i32 {
        // loading takes long, and the finished picture shows its progress
        if let Err(e) = self.show_finished() {
            log::warn!("{e}");
        }
        self.assets
            .as_mut()
            .map_or(0, |assets| assets.register_model(name))
    }

    /// Handle of a `.skin` file or of a skin of one material. 0: the default skin.
    pub fn register_skin(&mut self, name: &str) -> i32 {
        self.assets
            .as_mut()
            .map_or(0, |assets| assets.register_skin(name))
    }

    /// The stored font of a size in points (0: 12), with its glyphs' materials registered.
    pub fn register_font(&mut self, point_size: i32) -> Option<LoadedFont> {
        self.assets.as_mut()?.register_font(point_size)
    }

    /// Loads a map (`maps/NAME.bsp`).
    ///
    /// # Errors
    /// The file is missing or damaged, or a map is loaded already; the message names file and position.
    pub fn load_world(&mut self, name: &str) -> Result<(), Error> {
        self.show_finished()?;
        let Some(assets) = &mut self.assets else {
            return Err(Error::NotRegistered);
        };
        if self.world.is_some() {
            return Err(Error::WorldTwice { name: name.into() });
        }
        let world = World::load(&self.device, assets, name, &self.settings)?;
        self.world = Some(world);
        self.entity_tokens = EntityTokens::default();
        Ok(())
    }

    /// Replaces material `old` by `new`; equal names cancel.
    pub fn remap_shader(&mut self, old: &str, new: &str, time_offset: Option<f32>) {
        if let Some(assets) = &mut self.assets {
            assets.remap_shader(old, new, time_offset);
        }
    }
}
