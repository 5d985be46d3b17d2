//! The public renderer: construction, registration, and the scenes of a frame.

mod held;
mod kept_pipelines;
mod output;
mod pace;
mod pictures;
mod queries;
mod registration;
mod still;

use std::sync::Arc;
use std::time::Instant;

use glam::Vec3;

use crate::api::{DynamicLight, FreeCamera, Look, PolyVert, RefDef, RefEntity, UiFrame, rdflags};
use crate::assets::Assets;
use crate::error::Error;
use crate::frame::Item;
use crate::gpu::{
    ColorMask, Device, DeviceInfo, DeviceOptions, Encoding, FrameRing, SurfaceSource, Swapchain,
    SwapchainDesc, Window, give_back_freed_memory,
};
use crate::pacing::Pacer;
use crate::raster::{DrawList, Flares, HybridSurfaces, Overlay, Present, Raster, UiTextures};
use crate::scene::{GatherInput, Scene};
use crate::settings::{Anaglyph, HdrChoice, Settings};
use crate::stereo::Eye;
use crate::targets::FrameTargets;
use crate::trace::TraceLook;
use crate::trace::ahead::compile_ahead;
use crate::trace::hybrid::HybridLook;
use crate::trace::pass_set::PassSet;
use crate::trace::tracer::Tracer;
use crate::world::{EntityTokens, Marker, World, WorldOptions};

use held::HeldViews;
pub(crate) use kept_pipelines::KeptPipelines;
use output::milliseconds;
pub use output::{CpuTimes, FrameStats};
use still::StillRequest;

/// Frames that CPU and GPU work at together: GPU times of a frame are known this many frames later.
pub const FRAMES_IN_FLIGHT: usize = 2;

/// Options for making a renderer.
pub struct RendererOptions {
    /// Width of the picture, pixels.
    pub width: u32,
    /// Height of the picture, pixels.
    pub height: u32,
    /// The window to present to; `None` renders without one.
    pub window: Option<Window>,
    /// Enables Vulkan's validation layer.
    pub validation: bool,
    /// Part of the name of the preferred device.
    pub device: Option<String>,
    /// Wait for vertical blank.
    pub vsync: bool,
    /// Output of more than white, where the window offers it. Without a window it is made all the same, for
    /// [`read_presented`](Renderer::read_presented).
    pub hdr: HdrChoice,
    /// File of the driver's pipeline cache between starts; `None` stores nothing.
    pub pipeline_cache: Option<std::path::PathBuf>,
}

impl RendererOptions {
    /// Options without a window, for any device, without a pipeline cache. Sizes in pixels.
    pub fn headless(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            window: None,
            validation: false,
            device: None,
            vsync: false,
            hdr: HdrChoice::Off,
            pipeline_cache: None,
        }
    }
}

/// The renderer: one device, at most one window, and the game's registration.
pub struct Renderer {
    // fields are dropped in this order: objects of the device before the device
    still: StillRequest,
    trace: Option<TraceLook>,
    hybrid: Option<HybridLook>,
    /// The hybrid look cannot be made, as the log states.
    lacks_hybrid: bool,
    /// Pipelines of the traced look, made at its first use.
    trace_passes: Option<Arc<PassSet>>,
    world: Option<World>,
    scene: Scene,
    /// Held views of `rt_pause`.
    held: HeldViews,
    assets: Option<Assets>,
    list: DrawList,
    raster: Raster,
    hybrid_surfaces: HybridSurfaces,
    flares: Flares,
    ui: UiTextures,
    present: Option<Present>,
    targets: FrameTargets,
    swapchain: Option<Swapchain>,
    /// Encoding of the window.
    encoding: Encoding,
    ring: FrameRing,
    device: Device,
    /// What the surface needs; dropped after the device.
    _window: Option<Box<dyn std::any::Any>>,
    kept_pipelines: KeptPipelines,

    settings: Settings,
    /// Rays of traced views are counted.
    counts_rays: bool,
    marker: Marker,
    /// Queued items, with the colour channels of each.
    queue: Vec<(Item, ColorMask)>,
    eye: Eye,
    /// `r_anaglyphMode` of the newest frame.
    shown_anaglyph: Anaglyph,
    /// Time spent on gathering views since the last frame, milliseconds.
    gather_ms: f32,
    overlay: Overlay,
    spare_overlays: Vec<Overlay>,
    overlay_time: f32,
    color_2d: u32,
    entity_tokens: EntityTokens,
    calibrations: Option<relight::CalibrationCache>,
    /// The window is minimised.
    hidden: bool,
    pacer: Pacer,
    /// Frames end when the display shows them; otherwise, when they are drawn.
    paced_by_display: bool,
    /// The last wait for the display timed out, and no frame has been shown since.
    wait_timed_out: bool,
    hides_overlay: bool,
}

/// Finds a device without making a window; returns its name and features.
///
/// # Errors
/// There is no Vulkan, or no suitable device; the message has the reason.
pub fn probe(device: Option<&str>) -> Result<DeviceInfo, Error> {
    let options = device_options(device, false);
    Ok(Device::new(&options, SurfaceSource::Headless)?
        .info()
        .clone())
}

/// Options with which the renderer loads a map, for other loads of the same map.
pub fn map_options(settings: &Settings) -> relight::Options<'static> {
    WorldOptions::new(settings).relight()
}

impl Renderer {
    /// Makes the device, the swapchain if there is a window, and the frame's images. No game data is read.
    ///
    /// # Errors
    /// There is no Vulkan or no suitable device, or the device is out of memory.
    pub fn new(options: RendererOptions) -> Result<Self, Error> {
        Self::on(options, false)
    }

    /// The same with all optional device features disabled, to test the code for devices without them.
    ///
    /// # Errors
    /// Those of [`new`](Self::new).
    pub fn with_required_only(options: RendererOptions) -> Result<Self, Error> {
        Self::on(options, true)
    }

    fn on(options: RendererOptions, required_only: bool) -> Result<Self, Error> {
        let (kept_pipelines, pipeline_cache) = KeptPipelines::read(options.pipeline_cache);
        let device_options = DeviceOptions {
            pipeline_cache,
            required_only,
            ..device_options(options.device.as_deref(), options.validation)
        };
        let mut owner = None;
        let (device, swapchain) = match options.window {
            Some(mut window) => {
                owner = window.take_owner();
                let device = window.source(|source| Device::new(&device_options, source))?;
                let swapchain = Swapchain::new(
                    &device,
                    SwapchainDesc {
                        width: options.width,
                        height: options.height,
                        vsync: options.vsync,
                        wide: wide_encodings(options.hdr),
                    },
                )?;
                (device, Some(swapchain))
            }
            None => (Device::new(&device_options, SurfaceSource::Headless)?, None),
        };
        let encoding = match &swapchain {
            Some(swapchain) => swapchain.encoding(),
            None => (wide_encodings(options.hdr).first().copied()).unwrap_or(Encoding::Srgb),
        };
        if options.hdr != HdrChoice::Off && encoding == Encoding::Srgb {
            log::warn!(
                "rt_hdr: this display or its driver offers no HDR here; the picture is as without rt_hdr"
            );
        }
        device.measure(!device.info().software);
        let targets = FrameTargets::new(&device, options.width, options.height)?;
        let present = match &swapchain {
            Some(swapchain) => Some(Present::new(&device, swapchain.format())?),
            None => None,
        };
        Ok(Self {
            still: StillRequest::default(),
            trace: None,
            hybrid: None,
            lacks_hybrid: false,
            trace_passes: None,
            world: None,
            scene: Scene::default(),
            held: HeldViews::default(),
            assets: None,
            list: DrawList::new(!device.info().software),
            raster: Raster::new(&device),
            hybrid_surfaces: HybridSurfaces::new(&device),
            flares: Flares::new(&device),
            ui: UiTextures::default(),
            present,
            targets,
            swapchain,
            encoding,
            ring: FrameRing::new(&device, FRAMES_IN_FLIGHT)?,
            device,
            _window: owner,
            kept_pipelines,
            settings: Settings::default(),
            marker: Marker::default(),
            queue: Vec::new(),
            counts_rays: false,
            eye: Eye::Both,
            shown_anaglyph: Anaglyph::None,
            gather_ms: 0.0,
            overlay: Overlay::default(),
            spare_overlays: Vec::new(),
            overlay_time: 0.0,
            color_2d: u32::MAX,
            entity_tokens: EntityTokens::default(),
            calibrations: None,
            hidden: false,
            pacer: Pacer::default(),
            paced_by_display: false,
            wait_timed_out: false,
            hides_overlay: false,
        })
    }

    /// The device in use.
    pub fn device_info(&self) -> &DeviceInfo {
        self.device.info()
    }

    /// Number of descriptors written so far; a frame that equals the last one writes none.
    pub fn descriptor_writes(&self) -> u64 {
        self.device.descriptor_writes()
    }

    /// Number of pipelines compiled so far; frames that draw only registered materials in the expected ways add none.
    pub fn compiled_pipelines(&self) -> u64 {
        self.device.compiled_pipelines()
    }

    /// Number of pipelines that exist; those that only earlier maps used are dropped at the next registration.
    pub fn live_pipelines(&self) -> u64 {
        self.device.live_pipelines()
    }

    /// Messages of the validation layer so far.
    pub fn validation_messages(&self) -> Vec<String> {
        self.device.validation_messages()
    }

    /// GPU milliseconds of each pass of the newest finished frame.
    ///
    /// On a software device, passes are timed from the first call on.
    pub fn timings(&self) -> Vec<(String, f32)> {
        self.device.measure(true);
        self.device.timings()
    }

    /// [Serial number](FrameStats::serial) of the frame that [`timings`](Self::timings) is of; 0: of none.
    pub fn timed_frame(&self) -> u64 {
        self.device.timed_frame()
    }

    /// Waits for the oldest frame that the GPU works at, whose timings are then known.
    ///
    /// # Errors
    /// The device is lost or out of memory.
    pub fn wait_for_oldest(&mut self) -> Result<(), Error> {
        self.flush(false).map(drop)
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

    /// Sets whether the window is minimised: frames are then drawn but not presented, because the window system may
    /// delay a hidden window's frames.
    pub fn set_hidden(&mut self, hidden: bool) {
        self.hidden = hidden;
    }

    /// Size of the picture, pixels.
    pub fn size(&self) -> (u32, u32) {
        let color = self.targets.color();
        (color.width(), color.height())
    }

    /// Settings for subsequent calls. Latched ones take effect at the next
    /// [`begin_registration`](Self::begin_registration).
    pub fn set_settings(&mut self, settings: &Settings) {
        if self.settings != *settings {
            self.settings.clone_from(settings);
            if !(settings.rt == Look::Traced && settings.rt_pause) {
                self.held.release();
            }
            if let Some(hybrid) = self.hybrid.as_mut().filter(|_| settings.rt != Look::Hybrid) {
                hybrid.drop_images();
            }
            if let Some(assets) = &mut self.assets {
                assets.set_settings(settings);
            }
            self.raster
                .set_offset(settings.offset_factor, settings.offset_units);
        }
    }

    /// Drops all entities, polygons and lights added since the last view.
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

    /// Queues a view of everything added since the last one.
    ///
    /// # Errors
    /// [`Error::NoWorld`]: the view shows the world, but no map is loaded. Also an entity of a kind that cannot be
    /// drawn.
    pub fn render_scene(&mut self, def: &RefDef) -> Result<(), Error> {
        let wants_world = def.flags & rdflags::NO_WORLD_MODEL == 0;
        self.look_for_ends()?;
        if self.settings.no_refresh {
            self.scene.clear();
            return Ok(());
        }
        if wants_world && self.world.is_none() {
            return Err(Error::NoWorld);
        }
        self.queue_overlay();
        if self.hides_overlay && !wants_world {
            // a model in a menu or in the game's display
            self.scene.clear();
            return Ok(());
        }
        let look = def.look.unwrap_or(self.settings.rt);
        let traced = look == Look::Traced && wants_world && self.ready_to_trace()?;
        let hybrid = look == Look::Hybrid && wants_world && self.ready_for_hybrid();
        let mask = self.eye.mask(self.settings.anaglyph);
        let pause = self.settings.rt_pause && traced;
        if pause && let Some(mut view) = self.held.next(def) {
            // both eyes share a held view
            view.view = view.view.with_stereo(self.eye.stereo(&self.settings));
            self.scene.clear();
            self.keep_for_still(&view);
            self.queue.push((Item::Traced(Box::new(view)), mask));
            return Ok(());
        }
        let Some(assets) = &mut self.assets else {
            return Err(Error::NotRegistered);
        };
        let begin = Instant::now();
        let input = GatherInput::new(self.world.as_ref(), assets, &self.settings);
        let item = if traced {
            Item::Traced(Box::new(self.scene.gather_traced(&input, def)?))
        } else if hybrid {
            let (views, traversed) = self.scene.gather_hybrid(&input, def)?;
            Item::Hybrid(views, Box::new(traversed))
        } else {
            Item::Classic(self.scene.gather_classic(&input, def)?)
        };
        self.gather_ms += milliseconds(begin, Instant::now());
        if let Item::Traced(view) = &item {
            if pause {
                self.held.hold(view);
            }
            self.keep_for_still(view);
        }
        self.queue.push((item, mask));
        Ok(())
    }

    /// Adds a polygon of the engine's collision debugging to the last queued view, unless that is traced. The lowest
    /// three bits of `color` are red, green and blue.
    pub fn add_debug_polygon(&mut self, color: u32, corners: &[Vec3]) {
        if let Some((Item::Classic(scenes) | Item::Hybrid(scenes, _), _)) = self.queue.last_mut()
            && let Some(view) = scenes.last_mut()
        {
            view.look.debug.add(color, corners, view.view.origin);
        }
    }

    /// Queues a user interface, drawn over everything queued so far. Nothing is drawn before the first registration.
    ///
    /// # Errors
    /// The device has no memory for a texture.
    pub fn draw_ui(&mut self, frame: UiFrame) -> Result<(), Error> {
        let meshes = self.ui.take(&self.device, frame)?;
        self.queue_overlay();
        self.queue.push((Item::Ui(meshes), ColorMask::ALL));
        Ok(())
    }

    /// Sets a camera for the views that `rt_pause` holds; `None`: their own.
    pub fn set_free_camera(&mut self, camera: Option<FreeCamera>) {
        self.held.camera = camera;
    }

    /// Leaves out 2D pictures and models outside of the world, such as a game's display of health and ammunition.
    pub fn hide_overlay(&mut self, hide: bool) {
        self.hides_overlay = hide;
    }

    /// Sets the folder that caches light calibrations of maps, so that the traced look starts without calibrating
    /// again.
    pub fn keep_calibrations(&mut self, folder: Option<std::path::PathBuf>) {
        self.calibrations = folder.map(relight::CalibrationCache::new);
    }

    /// Makes the traced look at its first use; `false` without a map.
    fn ready_to_trace(&mut self) -> Result<bool, Error> {
        if let (Some(world), Some(assets)) = (&mut self.world, &mut self.assets) {
            let settings = &self.settings;
            let lit = world.light_by(settings.rt_lights, assets, self.calibrations.as_ref());
            // files of materials may have changed
            if assets.materials.has_normals() {
                world.need_mapped_vertices(&self.device)?;
            }
            let made = lit || self.trace.is_none();
            if made {
                let passes = pass_set(&self.device, settings, &mut self.trace_passes);
                let cells = settings.rt_grid_cells;
                self.trace = Some(TraceLook::new(passes, cells, world, assets)?);
            }
            if let (Some(passes), Some(look)) = (&self.trace_passes, &self.trace) {
                // in each frame, because settings and materials may have changed
                compile_ahead(passes, settings, look.needs(world, assets))?;
            }
            if made {
                give_back_freed_memory();
            }
        }
        Ok(self.trace.is_some())
    }

    /// Makes the hybrid look at its first use; `false` without a map, or if the device lacks memory or the driver refuses
    /// its shaders.
    fn ready_for_hybrid(&mut self) -> bool {
        let (Some(world), Some(assets)) = (&self.world, &self.assets) else {
            return false;
        };
        if self.hybrid.is_none() && !self.lacks_hybrid {
            let passes = pass_set(&self.device, &self.settings, &mut self.trace_passes);
            match HybridLook::new(passes, self.settings.rt_grid_cells, world, assets) {
                Ok(made) => self.hybrid = Some(made),
                Err(e) => {
                    log::warn!(
                        "r_rt 2 is not possible here ({e}); the classic look is drawn. Set r_rt 0"
                    );
                    self.lacks_hybrid = true;
                }
            }
        }
        self.hybrid.is_some()
    }
}

/// The pipelines of the tracer that the settings choose, made if they are missing.
fn pass_set<'a>(
    device: &Device,
    settings: &Settings,
    kept: &'a mut Option<Arc<PassSet>>,
) -> &'a Arc<PassSet> {
    let tracer = Tracer::of(device.info(), settings.rt_tracer);
    let same = kept.take().filter(|p| p.tracer() == tracer);
    let new = || Arc::new(PassSet::new(device, tracer));
    kept.insert(same.unwrap_or_else(new))
}

impl Drop for Renderer {
    fn drop(&mut self) {
        self.kept_pipelines.write(&self.device);
    }
}

/// The encodings for a choice, the best first. HDR10 needs half the memory of scRGB.
fn wide_encodings(choice: HdrChoice) -> &'static [Encoding] {
    match choice {
        HdrChoice::Off => &[],
        HdrChoice::Any => &[Encoding::Hdr10, Encoding::ScRgb],
        HdrChoice::Hdr10 => &[Encoding::Hdr10],
        HdrChoice::ScRgb => &[Encoding::ScRgb],
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
