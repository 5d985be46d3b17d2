//! The renderer as a front end sees it.

use std::sync::Arc;
use std::time::Instant;

use glam::{Vec2, Vec3};
use relight::{GameFiles, overbright};

use crate::api::{
    DynamicLight, MarkFragment, Orientation, Picture, PointLighting, PolyVert, RefDef, RefEntity,
    rdflags,
};
use crate::assets::{Assets, ImageSource, LoadedFont};
use crate::error::Error;
use crate::frame::{FrameContext, Item};
use crate::gpu::{
    ColorMask, Device, DeviceInfo, DeviceOptions, FrameRing, Recorder, SurfaceSource, Swapchain,
    SwapchainDesc, Window,
};
use crate::raster::{self, DrawList, Flares, Overlay, Picture2d, Present, Raster};
use crate::scene::{Look, Scene, Statistics};
use crate::settings::Settings;
use crate::stereo::Eye;
use crate::targets::FrameTargets;
use crate::trace::TraceLook;
use crate::world::{EntityTokens, World, mark_fragments};

/// How to make a renderer.
pub struct RendererOptions {
    /// Width of the picture, pixels.
    pub width: u32,
    /// Height of the picture, pixels.
    pub height: u32,
    /// The window to present to; `None` renders without one.
    pub window: Option<Window>,
    /// Vulkan's validation layer.
    pub validation: bool,
    /// Part of the name of the device to prefer.
    pub device: Option<String>,
    /// Wait for the display's refresh.
    pub vsync: bool,
}

/// Counts of one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameStats {
    /// 3D views drawn.
    pub views: u32,
    /// Draw calls of the classic look and the overlay.
    pub draws: u32,
    /// What the views of the classic look show; counted only with `r_speeds`.
    pub scene: Statistics,
    /// Milliseconds of the CPU on the frame.
    pub cpu: CpuTimes,
}

/// Where the calling thread's time went in a frame, milliseconds.
#[derive(Clone, Copy, Debug, Default)]
pub struct CpuTimes {
    /// Finding out what the views show.
    pub gather: f32,
    /// Waiting for an earlier frame; with two in flight the one before the last.
    pub wait: f32,
    /// Recording commands, with the upload of what moves.
    pub record: f32,
    /// Handing them to the driver, and the picture to the window.
    pub submit: f32,
}

fn milliseconds(from: Instant, to: Instant) -> f32 {
    to.duration_since(from).as_secs_f32() * 1000.0
}

/// The renderer: one device, one window or none, and what the game has registered.
pub struct Renderer {
    // dropped in this order: what the device owns comes before it
    trace: Option<TraceLook>,
    world: Option<World>,
    scene: Scene,
    assets: Option<Assets>,
    list: DrawList,
    raster: Raster,
    flares: Flares,
    present: Option<Present>,
    targets: FrameTargets,
    swapchain: Option<Swapchain>,
    ring: FrameRing,
    device: Device,

    settings: Settings,
    /// The last frame's picture is not shown yet.
    unshown: bool,
    /// With the channels that each is drawn in.
    queue: Vec<(Item, ColorMask)>,
    eye: Eye,
    /// `r_anaglyphMode` of the newest frame.
    shown_anaglyph: u32,
    /// Milliseconds spent on gathering views since the last frame.
    gather_ms: f32,
    overlay: Overlay,
    spare_overlays: Vec<Overlay>,
    overlay_time: f32,
    color_2d: u32,
    entity_tokens: EntityTokens,
    calibrations: Option<relight::CalibrationCache>,
    /// The window is not on the screen.
    hidden: bool,
}

/// Looks for a device without making a window: what it is called and what it can do.
///
/// # Errors
/// There is no Vulkan, or no device that fits; the message says which.
pub fn probe(device: Option<&str>) -> Result<DeviceInfo, Error> {
    let options = device_options(device, false);
    Ok(Device::new(&options, SurfaceSource::Headless)?
        .info()
        .clone())
}

impl Renderer {
    /// Makes the device, the swapchain if there is a window, and the frame's images. No game data is read.
    ///
    /// # Errors
    /// There is no Vulkan, no device that fits, or it is out of memory.
    pub fn new(options: RendererOptions) -> Result<Self, Error> {
        let device_options = device_options(options.device.as_deref(), options.validation);
        let (device, swapchain) = match options.window {
            Some(window) => {
                let device = window.source(|source| Device::new(&device_options, source))?;
                let swapchain = Swapchain::new(
                    &device,
                    SwapchainDesc {
                        width: options.width,
                        height: options.height,
                        vsync: options.vsync,
                    },
                )?;
                (device, Some(swapchain))
            }
            None => (Device::new(&device_options, SurfaceSource::Headless)?, None),
        };
        device.measure(!device.info().software);
        let targets = FrameTargets::new(&device, options.width, options.height)?;
        let present = match &swapchain {
            Some(swapchain) => Some(Present::new(&device, swapchain.format())?),
            None => None,
        };
        Ok(Self {
            trace: None,
            world: None,
            scene: Scene::default(),
            assets: None,
            list: DrawList::default(),
            raster: Raster::new(&device),
            flares: Flares::new(&device),
            present,
            targets,
            swapchain,
            ring: FrameRing::new(&device, 2)?,
            device,
            settings: Settings::default(),
            queue: Vec::new(),
            unshown: false,
            eye: Eye::Both,
            shown_anaglyph: 0,
            gather_ms: 0.0,
            overlay: Overlay::default(),
            spare_overlays: Vec::new(),
            overlay_time: 0.0,
            color_2d: u32::MAX,
            entity_tokens: EntityTokens::default(),
            calibrations: None,
            hidden: false,
        })
    }

    /// The device in use.
    pub fn device_info(&self) -> &DeviceInfo {
        self.device.info()
    }

    /// What the validation layer has said so far.
    pub fn validation_messages(&self) -> Vec<String> {
        self.device.validation_messages()
    }

    /// GPU milliseconds of each pass of the newest finished frame.
    ///
    /// On a software device passes are timed once this was called.
    pub fn timings(&self) -> Vec<(String, f32)> {
        self.device.measure(true);
        self.device.timings()
    }

    /// Changes the size of the picture.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn resize(&mut self, width: u32, height: u32) -> Result<(), Error> {
        if (width, height) == self.size() {
            return Ok(());
        }
        self.targets = FrameTargets::new(&self.device, width, height)?;
        if let Some(swapchain) = &mut self.swapchain {
            swapchain.resize(width, height, self.settings.swap_interval != 0);
        }
        Ok(())
    }

    /// Tells whether the window is off the screen (minimised): frames are drawn but not shown, because the window
    /// system may keep a hidden window's frames waiting.
    pub fn set_hidden(&mut self, hidden: bool) {
        self.hidden = hidden;
    }

    /// Size of the picture, pixels.
    pub fn size(&self) -> (u32, u32) {
        let color = self.targets.color();
        (color.width(), color.height())
    }

    // --- registration ---------------------------------------------------------------------------------------------

    /// Starts afresh: forgets every model, texture, material and the map, and reads the scripts through `files`.
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
        self.assets = Some(Assets::new(
            &self.device,
            files,
            Arc::new(scripts),
            settings,
        )?);
        Ok(())
    }

    /// The game has registered everything: makes the pipelines that it will draw with.
    pub fn end_registration(&mut self) {
        let fits = self.targets.fit(&self.device, &self.settings);
        let Some(assets) = &self.assets else { return };
        let target = raster::Target {
            color: self.targets.drawn(),
            depth: self.targets.depth(),
            mask: ColorMask::ALL,
        };
        let stages = raster::StageContext {
            materials: &assets.materials,
            samplers: &assets.samplers,
            identity_light: self.settings.identity_light(),
            only_texture: None,
        };
        // what is not made now is made when it is drawn
        let made = self.raster.expect_materials(target.kind(), stages);
        if let Err(e) = fits.and(made.map_err(Error::from)) {
            log::warn!("pipelines are not made ahead: {e}");
        }
    }

    /// Forgets every model, texture, material and the map. May be called again and again.
    pub fn shutdown_registration(&mut self) {
        self.queue.clear();
        self.overlay.clear();
        self.scene = Scene::default();
        self.trace = None;
        self.world = None;
        self.assets = None;
        self.entity_tokens = EntityTokens::default();
    }

    /// Handle of a material by name; `mip` is false for 2D art. 0: there is none, the default is drawn.
    pub fn register_shader(&mut self, name: &str, mip: bool) -> i32 {
        self.assets
            .as_mut()
            .map_or(0, |assets| assets.register_shader(name, mip))
    }

    /// Handle of a model by file name, or `*n` for the map's inline models. 0: there is none.
    pub fn register_model(&mut self, name: &str) -> i32 {
        // loading takes a while after the picture that tells of it
        if let Err(e) = self.show_finished() {
            log::warn!("{e}");
        }
        self.assets
            .as_mut()
            .map_or(0, |assets| assets.register_model(name))
    }

    /// Handle of a `.skin` file or of a skin of one material. 0: the default.
    pub fn register_skin(&mut self, name: &str) -> i32 {
        self.assets
            .as_mut()
            .map_or(0, |assets| assets.register_skin(name))
    }

    /// A pre-rendered font of a size in points (0: 12), with its glyphs' materials registered.
    pub fn register_font(&mut self, point_size: i32) -> Option<LoadedFont> {
        self.assets.as_mut()?.register_font(point_size)
    }

    /// Loads a map (`maps/NAME.bsp`).
    ///
    /// # Errors
    /// The file is missing or broken, or a map is loaded already; the message names file and place.
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

    /// Draws `new` wherever `old` would be; `old` = `new` takes that back.
    pub fn remap_shader(&mut self, old: &str, new: &str, time_offset: Option<f32>) {
        if let Some(assets) = &mut self.assets {
            assets.remap_shader(old, new, time_offset);
        }
    }

    // --- the scene ------------------------------------------------------------------------------------------------

    /// Settings for what follows. What is latched counts at the next [`begin_registration`](Self::begin_registration).
    pub fn set_settings(&mut self, settings: &Settings) {
        if self.settings != *settings {
            self.settings.clone_from(settings);
            if let Some(assets) = &mut self.assets {
                assets.set_settings(settings);
            }
            self.raster
                .set_offset(settings.offset_factor, settings.offset_units);
        }
    }

    /// Forgets what was added since the last view.
    pub fn clear_scene(&mut self) {
        self.scene.clear();
    }

    /// Adds an entity to the next view.
    pub fn add_entity(&mut self, entity: &RefEntity) {
        self.scene.add_entity(entity);
    }

    /// Adds polygons of `verts_per_poly` corners each.
    pub fn add_poly(&mut self, shader: i32, verts: &[PolyVert], verts_per_poly: usize) {
        self.scene.add_poly(shader, verts, verts_per_poly);
    }

    /// Adds a dynamic light.
    pub fn add_light(&mut self, light: DynamicLight) {
        self.scene.add_light(light);
    }

    /// Queues a view of what was added.
    ///
    /// # Errors
    /// [`Error::NoWorld`]: there is no map, and the view wants one. An entity has a kind that cannot be drawn.
    pub fn render_scene(&mut self, def: &RefDef) -> Result<(), Error> {
        let wants_world = def.flags & rdflags::NO_WORLD_MODEL == 0;
        if self.settings.no_refresh {
            self.scene.clear();
            return Ok(());
        }
        if wants_world && self.world.is_none() {
            return Err(Error::NoWorld);
        }
        self.queue_overlay();
        let look = if self.settings.rt && wants_world && self.ready_to_trace()? {
            Look::Traced
        } else {
            Look::Classic
        };
        let Some(assets) = &mut self.assets else {
            return Err(Error::NotRegistered);
        };
        let begin = Instant::now();
        let mut scenes =
            self.scene
                .gather(self.world.as_ref(), assets, &self.settings, def, look)?;
        self.gather_ms += milliseconds(begin, Instant::now());
        let item = match look {
            Look::Classic => Item::Classic(scenes),
            Look::Traced => match scenes.pop() {
                Some(scene) => Item::Traced(Box::new(scene)),
                None => return Ok(()),
            },
        };
        self.queue
            .push((item, self.eye.mask(self.settings.anaglyph)));
        Ok(())
    }

    /// Keeps what is found about maps' lights in a folder, so that the traced look is ready at once the next time.
    pub fn keep_calibrations(&mut self, folder: Option<std::path::PathBuf>) {
        self.calibrations = folder.map(relight::CalibrationCache::new);
    }

    /// Makes the traced look when it is first asked for; `false` while there is no map.
    fn ready_to_trace(&mut self) -> Result<bool, Error> {
        if self.trace.is_none()
            && let (Some(world), Some(assets)) = (&mut self.world, &mut self.assets)
        {
            world.calibrate(assets, self.calibrations.as_ref());
            self.trace = Some(TraceLook::new(&self.device, world, assets)?);
        }
        Ok(self.trace.is_some())
    }

    // --- 2D ---------------------------------------------------------------------------------------------------------

    /// Colour of the pictures that follow; `None` is white. Values become bytes as the engine makes them.
    pub fn set_color(&mut self, rgba: Option<[f32; 4]>) {
        self.color_2d = rgba.map_or(u32::MAX, |rgba| {
            // truncated and wrapped, not clamped
            u32::from_le_bytes(rgba.map(|c| (c * 255.0) as i32 as u8))
        });
    }

    /// Draws a material in a rectangle of window pixels.
    #[allow(clippy::too_many_arguments)]
    pub fn stretch_pic(
        &mut self,
        x: f32,
        y: f32,
        w: f32,
        h: f32,
        s1: f32,
        t1: f32,
        s2: f32,
        t2: f32,
        shader: i32,
    ) {
        let Some(assets) = &self.assets else { return };
        let material = assets.materials.resolve(assets.material_of_handle(shader));
        self.overlay.add(
            material,
            &Picture2d {
                position: Vec2::new(x, y),
                size: Vec2::new(w, h),
                st1: Vec2::new(s1, t1),
                st2: Vec2::new(s2, t2),
                color: self.color_2d,
            },
        );
    }

    /// Draws RGBA8 pixels, stretched to a rectangle of the window.
    ///
    /// # Errors
    /// The picture's size is not a power of two, or the data is too short.
    #[allow(clippy::too_many_arguments)]
    pub fn stretch_raw(
        &mut self,
        x: i32,
        y: i32,
        w: i32,
        h: i32,
        cols: u32,
        rows: u32,
        rgba: &[u8],
        client: usize,
        dirty: bool,
    ) -> Result<(), Error> {
        if !cols.is_power_of_two() || !rows.is_power_of_two() {
            return Err(Error::NotPowerOfTwo { cols, rows });
        }
        self.upload_cinematic(cols, rows, rgba, client, dirty)?;
        let Some(texture) = (self.assets.as_mut()).map(|a| a.textures.queue_scratch(client)) else {
            return Ok(());
        };
        let grey = (self.settings.identity_light() * 255.0) as u8;
        let half = Vec2::new(0.5 / cols as f32, 0.5 / rows as f32);
        self.overlay.add_texture(
            texture,
            &Picture2d {
                position: Vec2::new(x as f32, y as f32),
                size: Vec2::new(w as f32, h as f32),
                st1: half,
                st2: Vec2::ONE - half,
                color: u32::from_le_bytes([grey, grey, grey, 255]),
            },
        );
        Ok(())
    }

    /// Replaces the picture of a cinematic.
    ///
    /// # Errors
    /// The data is shorter than the size says, or the device is out of memory.
    pub fn upload_cinematic(
        &mut self,
        cols: u32,
        rows: u32,
        rgba: &[u8],
        client: usize,
        dirty: bool,
    ) -> Result<(), Error> {
        match &mut self.assets {
            Some(assets) => Ok(assets.update_scratch(client, cols, rows, rgba, dirty)?),
            None => Ok(()),
        }
    }

    // --- the frame --------------------------------------------------------------------------------------------------

    /// Starts a frame; `time_ms` is the time that 2D materials see.
    pub fn begin_frame(&mut self, time_ms: i32) {
        self.set_eye(Eye::Both);
        self.overlay_time = time_ms as f32 * 0.001;
    }

    /// Says whose picture the calls that follow are for, after [`begin_frame`](Self::begin_frame). A frame begins with
    /// both eyes'. The traced look has one picture: with `rt` this is without effect.
    pub fn set_eye(&mut self, eye: Eye) {
        let eye = if self.settings.rt { Eye::Both } else { eye };
        self.queue_overlay();
        self.eye = eye;
        self.scene.set_eye(eye);
    }

    fn queue_overlay(&mut self) {
        if !self.overlay.is_empty() {
            let empty = self.spare_overlays.pop().unwrap_or_default();
            let overlay = std::mem::replace(&mut self.overlay, empty);
            let mask = self.eye.mask(self.settings.anaglyph);
            self.queue
                .push((Item::Overlay(overlay, self.overlay_time), mask));
        }
    }

    /// Draws what is queued, and shows it.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn end_frame(&mut self) -> Result<FrameStats, Error> {
        if self.settings.skip_back_end {
            self.queue_overlay();
            self.recycle_queue();
            self.scene.end_frame();
            return Ok(FrameStats::default());
        }
        let stats = self.flush(true)?;
        if let Some(assets) = &mut self.assets {
            assets.textures.end_frame();
        }
        self.scene.end_frame();
        self.flares.end_frame();
        Ok(stats)
    }

    /// Forgets what is queued; its memory is used again.
    fn recycle_queue(&mut self) {
        for (item, _) in self.queue.drain(..) {
            match item {
                Item::Overlay(mut overlay, _) => {
                    overlay.clear();
                    self.spare_overlays.push(overlay);
                }
                Item::Classic(scenes) => self.scene.recycle(scenes),
                Item::Traced(scene) => self.scene.recycle([*scene]),
            }
        }
    }

    /// `r_showImages`: covers the picture with all images.
    fn queue_image_sheet(&mut self) {
        if let (1.., Some(assets)) = (self.settings.show_images, &self.assets) {
            let proportional = self.settings.show_images == 2;
            let (size, textures) = (self.size(), &assets.textures);
            let white = ImageSource::white(textures);
            raster::image_sheet(
                &mut self.overlay,
                size,
                proportional,
                white,
                textures.images(),
            );
        }
    }

    fn flush(&mut self, show: bool) -> Result<FrameStats, Error> {
        self.queue_image_sheet();
        self.queue_overlay();
        self.targets.fit(&self.device, &self.settings)?;
        let mut stats = FrameStats::default();
        let show = show && !self.hidden && self.swapchain.is_some();
        let later = show && self.device.info().software;
        if later {
            self.show_finished()?;
        }
        let begin = Instant::now();
        let mut recorder = self.ring.begin()?;
        let ready = Instant::now();
        // channels that no eye draws keep what was there
        if self.shown_anaglyph != self.settings.anaglyph {
            self.shown_anaglyph = self.settings.anaglyph;
            self.targets.clear(&mut recorder)?;
        }
        if let Some(assets) = &mut self.assets {
            assets.prepare_frame(&self.settings)?;
            let mut context = FrameContext {
                color: self.targets.color(),
                drawn: self.targets.drawn(),
                depth: self.targets.depth(),
                mask: ColorMask::ALL,
                assets,
                world: self.world.as_ref(),
                settings: &self.settings,
                raster: &mut self.raster,
                flares: &mut self.flares,
                trace: self.trace.as_mut(),
                list: &mut self.list,
            };
            for (item, mask) in &self.queue {
                context.mask = *mask;
                context.record(&mut recorder, item)?;
                if let Item::Classic(scenes) = item {
                    for scene in scenes {
                        stats.scene.add(&scene.statistics);
                    }
                }
                stats.views += u32::from(!matches!(item, Item::Overlay(..)));
                stats.draws += context.list.calls.len() as u32;
            }
        }
        if !self.queue.is_empty() {
            self.targets.resolve(&mut recorder)?;
        }
        self.recycle_queue();
        let recorded = Instant::now();
        if later || !show {
            self.ring.end(recorder)?;
            self.unshown |= later;
        } else {
            self.show(recorder)?;
        }
        stats.cpu = CpuTimes {
            gather: std::mem::take(&mut self.gather_ms),
            wait: milliseconds(begin, ready),
            record: milliseconds(ready, recorded),
            submit: milliseconds(recorded, Instant::now()),
        };
        Ok(stats)
    }

    /// Shows the picture that a software device still worked on when its frame ended. Such a device works in the
    /// game's own time, and presenting waits for it: so the picture is shown when the next one begins, and meanwhile
    /// the game goes on.
    fn show_finished(&mut self) -> Result<(), Error> {
        if std::mem::take(&mut self.unshown) {
            let recorder = self.ring.begin()?;
            self.show(recorder)?;
        }
        Ok(())
    }

    /// Ends a frame with the picture on its way to the window.
    fn show(&mut self, mut recorder: Recorder) -> Result<(), Error> {
        match &mut self.swapchain {
            Some(swapchain) => {
                if let Some(target) = swapchain.acquire(&mut recorder)? {
                    // a new format comes with a new swapchain
                    if self
                        .present
                        .as_ref()
                        .is_none_or(|p| p.format() != target.format())
                    {
                        self.present = Some(Present::new(&self.device, target.format())?);
                    }
                    if let Some(present) = &self.present {
                        let bits = self.settings.effective_overbright_bits();
                        present.record(
                            &mut recorder,
                            self.targets.color(),
                            &target,
                            self.settings.display_gamma(),
                            bits,
                            swapchain.copies(),
                        )?;
                    }
                }
                self.ring.end_present(recorder, swapchain)?;
            }
            None => self.ring.end(recorder)?,
        }
        Ok(())
    }

    /// The picture as it stands after everything queued so far, as the display shows it.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn read_pixels(&mut self) -> Result<Picture, Error> {
        self.flush(false)?;
        let (width, height) = self.size();
        let rgba = self.device.read_image(self.targets.color())?;
        let table = overbright::gamma_table(
            self.settings.display_gamma(),
            self.settings.effective_overbright_bits(),
        );
        let rgb = rgba
            .chunks_exact(4)
            .flat_map(|p| [p[0], p[1], p[2]])
            .map(|v| table[usize::from(v)])
            .collect();
        Ok(Picture { width, height, rgb })
    }

    // --- queries ----------------------------------------------------------------------------------------------------

    /// Light of the map's grid at a point; `None` without a map or grid.
    pub fn light_for_point(&self, point: Vec3) -> Option<PointLighting> {
        let light = self.world.as_ref()?.grid_light(point, &self.settings)?;
        Some(PointLighting {
            ambient: light.ambient,
            directed: light.directed,
            direction: light.direction,
        })
    }

    /// The pieces of the map that a decal's polygon covers, projected along `projection`.
    pub fn mark_fragments(
        &self,
        points: &[Vec3],
        projection: Vec3,
        max_points: usize,
        max_fragments: usize,
    ) -> (Vec<Vec3>, Vec<MarkFragment>) {
        match (&self.world, &self.assets) {
            (Some(world), Some(assets)) => {
                let meshes = self.settings.marks_on_triangle_meshes;
                mark_fragments(
                    world,
                    &assets.materials,
                    points,
                    projection,
                    max_points,
                    max_fragments,
                    meshes,
                )
            }
            _ => (Vec::new(), Vec::new()),
        }
    }

    /// Where a model's tag is between two frames (`frac` weighs the end frame); `None`: no such model or tag.
    pub fn lerp_tag(
        &self,
        model: i32,
        start: i32,
        end: i32,
        frac: f32,
        name: &str,
    ) -> Option<Orientation> {
        self.assets
            .as_ref()?
            .models
            .lerp_tag(model, start, end, frac, name)
    }

    /// Bounds of a model's first frame, or of an inline model.
    pub fn model_bounds(&self, model: i32) -> (Vec3, Vec3) {
        match &self.assets {
            Some(assets) => assets.models.bounds(model),
            None => (Vec3::ZERO, Vec3::ZERO),
        }
    }

    /// Cluster of the leaf at a point; -1: none.
    pub fn leaf_cluster(&self, point: Vec3) -> i32 {
        self.world
            .as_ref()
            .map_or(-1, |world| world.relit.bsp.cluster_at(point))
    }

    /// Whether the map's visibility lets cluster `a` see cluster `b`.
    pub fn cluster_sees(&self, a: i32, b: i32) -> bool {
        self.world
            .as_ref()
            .is_none_or(|world| world.relit.bsp.cluster_sees(a, b))
    }

    /// The next token of the map's entity text; `None` at the end, after which it starts over.
    pub fn entity_token(&mut self) -> Option<String> {
        self.entity_tokens
            .next(&self.world.as_ref()?.relit.bsp.entities)
    }

    /// Name of the loaded map, as it was asked for.
    pub fn world_name(&self) -> Option<&str> {
        self.world.as_ref().map(|world| world.relit.name.as_str())
    }

    /// The map, for tools.
    pub fn world(&self) -> Option<&World> {
        self.world.as_ref()
    }

    /// The `videoMap` files of registered materials with the client number that
    /// [`upload_cinematic`](Self::upload_cinematic) takes their pictures under.
    pub fn videos(&self) -> Vec<(String, usize)> {
        self.assets.as_ref().map_or_else(Vec::new, |a| {
            a.materials
                .videos()
                .map(|(name, client)| (name.to_owned(), client))
                .collect()
        })
    }

    /// Says that a video of [`videos`](Self::videos) cannot be played: the stages that show it, and those above them,
    /// are not drawn.
    pub fn drop_video(&mut self, client: usize) {
        if let Some(assets) = &mut self.assets {
            assets.materials.drop_video(client);
        }
    }

    /// One line for each image.
    pub fn image_list(&self) -> Vec<String> {
        self.assets
            .as_ref()
            .map_or_else(Vec::new, |a| a.textures.list())
    }

    /// One line for each material; in drawing order if `sorted`.
    pub fn shader_list(&self, sorted: bool) -> Vec<String> {
        self.assets
            .as_ref()
            .map_or_else(Vec::new, |a| a.materials.list(sorted))
    }

    /// One line for each skin and each of its surfaces.
    pub fn skin_list(&self) -> Vec<String> {
        self.assets
            .as_ref()
            .map_or_else(Vec::new, |a| a.skins.list(&a.materials))
    }

    /// One line for each model.
    pub fn model_list(&self) -> Vec<String> {
        self.assets
            .as_ref()
            .map_or_else(Vec::new, |a| a.models.list())
    }
}

fn device_options(prefer: Option<&str>, validation: bool) -> DeviceOptions {
    DeviceOptions {
        app_name: "Relight".into(),
        validation,
        prefer: prefer.map(str::to_owned),
        ..DeviceOptions::default()
    }
}
