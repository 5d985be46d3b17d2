//! The traced look: its state between frames and the order of its passes.

mod content;
mod parameters;

use std::sync::Arc;

use shaders::trace_types::constants as t;
use shaders::trace_types::{CameraView, PortalRecord, PostView, TraceView};

use super::accel::Accel;
use super::antialias::{self, Antialias, traced_size};
use super::bloom::Bloom;
use super::blue_noise::BlueNoise;
use super::counters::RayCounters;
use super::denoise::{self, Denoiser, OtherEye};
use super::feedback::Feedback;
use super::first_hits::FirstHits;
use super::fog::LitFog;
use super::frame_passes::{FrameFacts, FramePasses};
use super::geometry::StaticGeometry;
use super::indirect;
use super::input::MaterialTable;
use super::light_selection::{self, is_lit, reuses_samples, uses_tree};
use super::lights::MapLights;
use super::motion::Motion;
use super::pass_set::PassSet;
use super::passes::{COUNTERS, Pass};
use super::photons::{self, Photons};
use super::pixel_times::PixelTimes;
use super::reservoirs::Reservoirs;
use super::screen::LastScreen;
use super::specular::SpecularTable;
use super::targets::{OwnImages, Targets};
use super::vertex_light::VertexLight;
use crate::api::DynamicLight;
use crate::gpu::{Buffer, BufferUsage, Device, Error, Image, Recorder};
use crate::raster::FlareTest;
use crate::scene::TracedScene;
use crate::settings::{DebugOutput, DenoiserChoice, Settings};
use crate::statistics::MovingCost;
use crate::stereo::Stereo;
use crate::world::outside;
use content::content_hash;
use parameters::{Prepared, camera_frame, flashlight_camera, portal_record, stereo_camera};

/// The map that a view shows.
#[derive(Clone, Copy)]
pub struct TracedMap<'a> {
    /// Its geometry.
    pub geometry: &'a StaticGeometry,
    /// Its lights.
    pub lights: &'a MapLights,
    /// Flares of the view whose visibility rays test.
    pub flares: FlareTest,
}

/// A view, with its inputs and target.
#[derive(Clone, Copy)]
pub struct TracedView<'a> {
    /// What the view shows.
    pub scene: &'a TracedScene,
    /// The map, if one is loaded; `None` for views without the world.
    pub map: Option<TracedMap<'a>>,
    /// Materials of all geometry.
    pub materials: &'a dyn MaterialTable,
    /// Settings of the frame.
    pub settings: &'a Settings,
    /// The image that the view's rectangle is in: RGBA8, usable as storage image.
    pub target: &'a Image,
}

/// Number of 32-bit values that automatic exposure keeps between frames: the exposure and the histogram.
const EXPOSURE_STATE: usize = 1 + t::EXPOSURE_BINS as usize;

/// Draws views by tracing rays.
pub struct ViewTracer {
    pub(super) device: Device,
    pub(super) accel: Accel,
    passes: Arc<PassSet>,
    first_hits: FirstHits,
    fog: LitFog,
    pub(super) denoiser: Denoiser,
    pub(super) antialias: Antialias,
    motion: Motion,
    pub(super) feedback: Feedback,
    bloom: Bloom,
    blue_noise: BlueNoise,
    screen: LastScreen,
    pub(super) photons: Photons,
    reservoirs: Reservoirs,
    vertex_light: VertexLight,
    counters: RayCounters,
    pixel_times: PixelTimes,
    specular_table: SpecularTable,
    /// Estimator of specular light (`SPECULAR_*`).
    pub(super) specular_estimator: u32,
    /// Colour channels of the target that are written: 1 red, 2 green, 4 blue.
    pub(super) channels: u32,
    /// Rays are counted.
    pub(super) count_rays: bool,
    pub(super) targets: Option<Targets>,
    exposure_state: Buffer,
    exposure_started: bool,
    /// Exposure at which the map is as bright as the engine shows it.
    pub(super) map_exposure: relight::exposure::Exposure,
    no_lights: MapLights,
    frame: u32,
    last_time: f32,
    /// Camera of the last frame, if its light is valid history.
    pub(super) history: Option<CameraView>,
    /// Dynamic lights of the last frame, and the camera that its flashlight was at.
    dynamic_lights: (Vec<DynamicLight>, Option<CameraView>),
    /// Light of the other eye, drawn before in this frame.
    pub(super) other_eye: Option<OtherEye>,
    /// Hash of the content of the accumulated frames, and their number.
    accumulated: (u64, u32),
    /// Number of next frames that join the mean whatever their content.
    joining: u32,
}

/// Number of frames that a given mean counts as: a frame of radiance 60000, the largest, changes it by less than 1e-4.
const WHOLE_WEIGHT: u32 = 1 << 30;

impl ViewTracer {
    /// Makes the state that persists between frames.
    ///
    /// # Errors
    /// The device is out of memory.
    pub fn new(passes: &Arc<PassSet>) -> Result<Self, Error> {
        let device = passes.device();
        Ok(Self {
            device: device.clone(),
            passes: Arc::clone(passes),
            accel: Accel::new(device, passes.tracer()),
            first_hits: FirstHits::default(),
            fog: LitFog::new(device),
            denoiser: Denoiser::new(device)?,
            antialias: Antialias::new(device)?,
            motion: Motion::default(),
            feedback: Feedback::default(),
            bloom: Bloom::default(),
            blue_noise: BlueNoise::default(),
            screen: LastScreen::default(),
            photons: Photons::default(),
            reservoirs: Reservoirs::default(),
            vertex_light: VertexLight::default(),
            counters: RayCounters::default(),
            pixel_times: PixelTimes::default(),
            specular_table: SpecularTable::default(),
            specular_estimator: t::SPECULAR_BOTH,
            channels: 7,
            count_rays: false,
            targets: None,
            // zeros: the first frame adds to the histogram before a pass has cleared it
            exposure_state: Buffer::with_data(
                device,
                "trace exposure",
                BufferUsage::STORAGE,
                &[0u32; EXPOSURE_STATE],
            )?,
            exposure_started: false,
            map_exposure: relight::exposure::Exposure::usual(1.0),
            no_lights: MapLights::none(device)?,
            frame: 0,
            last_time: 0.0,
            history: None,
            dynamic_lights: (Vec::new(), None),
            other_eye: None,
            accumulated: (0, 0),
            joining: 0,
        })
    }

    /// Number of frames in the mean picture; 1 outside of reference mode.
    pub fn accumulated_frames(&self) -> u32 {
        self.accumulated.1.max(1)
    }

    /// The linear picture of the last view, before exposure: RGBA, 32-bit floats in reference mode, 16-bit floats
    /// otherwise.
    pub fn hdr(&self) -> Option<&Image> {
        let targets = self.targets.as_ref()?;
        Some(self.antialias.picture().unwrap_or(targets.picture()))
    }

    /// Cost of the acceleration structures of moving bodies, summed over frames.
    pub fn moving_cost(&self) -> MovingCost {
        self.accel.cost().with_feedback(self.feedback.cost)
    }

    /// Rays of each counter (`COUNT_*`) in the newest finished frame; `None` while rays are not counted.
    pub fn rays(&self) -> Option<[u64; COUNTERS]> {
        self.counters.rays()
    }

    /// Replaces the mean of the accumulated frames by these texels, of the traced size; false if there is no mean.
    /// Later frames of the same content leave it as it is.
    ///
    /// # Errors
    /// A wrong number of texels, or no memory to upload them.
    pub fn replace_mean(&mut self, texels: &[[f32; 4]]) -> Result<bool, Error> {
        let mean = self.targets.as_ref().and_then(|t| t.accumulation.as_ref());
        let Some(mean) = mean.filter(|_| self.accumulated.1 > 0) else {
            return Ok(false);
        };
        (self.device).upload_image(mean, 0, 0, bytemuck::cast_slice(texels))?;
        self.accumulated.1 = WHOLE_WEIGHT;
        Ok(true)
    }

    /// Lets the next `frames` accumulated frames join the mean whatever they show.
    pub fn join_frames(&mut self, frames: u32) {
        self.joining = frames;
    }

    /// The light of the last frame for the other eye, if that frame showed this view from its own eye's place.
    pub fn for_other_eye(&self, view: &TracedScene, settings: &Settings) -> Option<OtherEye> {
        let camera = &view.view;
        let opposite = Stereo {
            slope: -camera.stereo.slope,
            ..camera.stereo
        };
        let drawn = stereo_camera(camera, opposite);
        let same = settings.rt_share_eyes && self.history == Some(drawn);
        let light = self
            .denoiser
            .light()
            .filter(|_| same && self.last_time == view.time);
        light.map(|light| light.converging(camera.stereo.distance))
    }

    /// Discards accumulated frames and light samples: lights have changed.
    pub fn forget_accumulated(&mut self) {
        self.accumulated = (0, 0);
        self.vertex_light.forget();
        self.reservoirs.forget();
    }

    /// Discards accumulated frames and restarts exposure, after a change of map.
    #[cfg(test)]
    pub fn reset(&mut self) {
        self.accumulated = (0, 0);
        self.history = None;
        self.motion = Motion::default();
        self.feedback.forget();
        self.antialias.reset();
        self.fog.reset();
        self.exposure_started = false;
    }

    /// Records all passes of a view into its rectangle of the target. Omits a view without area.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn record_view(&mut self, rec: &mut Recorder, view: TracedView<'_>) -> Result<(), Error> {
        let Some(output) = size_in(view.target, view.scene.view.viewport) else {
            return Ok(());
        };
        let view = TracedView {
            map: view.map.filter(|_| view.scene.has_world),
            ..view
        };
        let mut targets = self.take_targets(traced_size(view.settings, output))?;
        let recorded = self.record_to(&mut targets, rec, &view, output);
        self.targets = Some(targets);
        recorded
    }

    /// Takes the images of a size in pixels; drops images of another size, with their history.
    fn take_targets(&mut self, size: [u32; 2]) -> Result<Targets, Error> {
        let fits = |t: &mut Targets| [t.width, t.height] == size;
        if let Some(targets) = self.targets.take_if(fits) {
            return Ok(targets);
        }
        let targets = Targets::new(&self.device, size[0], size[1])?;
        self.targets = None;
        self.history = None;
        self.accumulated = (0, 0);
        Ok(targets)
    }

    fn record_to(
        &mut self,
        targets: &mut Targets,
        rec: &mut Recorder,
        view: &TracedView<'_>,
        output: [u32; 2],
    ) -> Result<(), Error> {
        let settings = view.settings;
        let has_gloss = has_gloss(view.materials, settings);
        targets.fit(&self.device, own_images(settings, output, has_gloss))?;
        if has_gloss {
            self.specular_table.make(&self.device)?;
        }
        if settings.rt_blue_noise {
            self.blue_noise.make(&self.device)?;
        }
        let params = self.prepare(targets, rec, view, output)?;
        targets.indirect_is_black &= settings.rt_bounces == 0;
        let has_heights = settings.parallax_mapping > 0 && view.materials.has_heights();
        self.record_passes(targets, rec, settings, output, &params, has_heights)?;
        self.frame = self.frame.wrapping_add(1);
        self.last_time = view.scene.time;
        self.history = (!settings.rt_accumulate).then(|| camera_frame(view.scene));
        (self.dynamic_lights.0).clone_from(&view.scene.dlights);
        self.dynamic_lights.1 = flashlight_camera(view.scene, settings);
        self.denoiser.advance();
        self.reservoirs.advance();
        self.fog.advance();
        targets.advance();
        self.antialias.advance();
        self.screen.advance();
        self.exposure_started = true;
        Ok(())
    }

    /// Prepares all inputs of a view's passes, for a picture of the size `output`.
    fn prepare(
        &mut self,
        targets: &Targets,
        rec: &mut Recorder,
        view: &TracedView<'_>,
        output: [u32; 2],
    ) -> Result<TraceView, Error> {
        let TracedView {
            scene,
            map,
            materials,
            settings,
            ..
        } = *view;
        let size = [targets.width, targets.height];
        let goes_on = self.history.is_some();
        let denoiser = denoise::in_use(settings);
        let reuses = reuses_samples(settings);
        let gradients = settings.rt_gradients && !reuses;
        (self.denoiser).prepare(denoiser, size, goes_on, gradients)?;
        (self.denoiser).prepare_cells(indirect::is_adaptive(settings), size)?;
        let lasting = reuses && !settings.rt_accumulate;
        (self.reservoirs).prepare(&self.device, reuses, lasting, size, goes_on)?;
        let has_fog = map.is_some_and(|m| fog_in_sight(&m, scene));
        self.fog.prepare(
            has_fog && is_lit(settings),
            denoiser != DenoiserChoice::None,
            size,
            goes_on,
        )?;
        let has_bodies = map.is_some_and(|m| !m.geometry.bodies.is_empty());
        let caustics = has_bodies && is_lit(settings) && photons::in_use(settings);
        self.photons.prepare(&self.device, caustics)?;
        (self.screen).prepare(&self.device, settings, size, goes_on)?;
        let lit = map.map(|m| (m.geometry, m.lights));
        (self.vertex_light).prepare(&self.device, settings, lit)?;
        let accumulated = self.accumulated_before(scene, materials, settings);
        let matches = self.motion.matches(scene);
        (self.feedback).begin(rec, scene, settings, size[0] * size[1], &matches)?;
        let map_geometry = map.map(|m| m.geometry);
        let (accel, feedback) = (&mut self.accel, &mut self.feedback);
        let accel = accel.record_fed(rec, scene, map_geometry, materials, feedback)?;
        let feedback = self.feedback.count(rec)?;
        (self.first_hits).prepare(&self.device, settings, size, map_geometry)?;
        let portals: Vec<PortalRecord> = if settings.hides_portals() {
            Vec::new()
        } else {
            scene.look.portals.iter().map(portal_record).collect()
        };
        let camera_rests = self.history == Some(camera_frame(scene));
        let vertices = accel.vertices;
        let (motion, known) = (&mut self.motion, (matches, vertices));
        let motion = motion.record(rec, scene, &portals, known, targets, camera_rests)?;
        let show_rays = settings.rt_debug == DebugOutput::Rays;
        let counting = (self.counters).begin(rec, size, self.count_rays, show_rays)?;
        let timing = self.pixel_times.begin(rec, size, settings.rt_debug)?;
        let antialias =
            (self.antialias).prepare(&self.device, settings, output, targets, goes_on)?;
        let post = PostView {
            counters: counting.address,
            time_sums: timing.sums,
            bloom: self
                .bloom
                .prepare(&self.device, output, settings.rt_bloom)?,
            bloom_strength: settings.rt_bloom,
            debug: settings.rt_debug as u32,
            image_rays: counting.image,
            image_time: timing.image,
            time_turn: timing.turn,
            padding: 0,
        };
        let prepared = Prepared {
            targets,
            accel,
            accumulated,
            portals: &portals,
            motion,
            feedback,
            antialias,
            post,
        };
        self.params(rec, view, &prepared)
    }

    /// Records the passes in their order. `output`: size of the picture.
    fn record_passes(
        &mut self,
        targets: &mut Targets,
        rec: &mut Recorder,
        settings: &Settings,
        output: [u32; 2],
        params: &TraceView,
        has_heights: bool,
    ) -> Result<(), Error> {
        let address = rec.arena().push(std::slice::from_ref(params))?;
        let mut facts = self.facts(targets, settings, output, params);
        facts.heights = facts.gloss && has_heights;
        let passes = &mut FramePasses::new(&self.passes, rec, address, facts);
        if self.first_hits.is_on() {
            let drawn = self.accel.drawn();
            (self.first_hits).record(passes, drawn, params)?;
        } else {
            passes.run(Pass::PrimaryRays)?;
        }
        passes.run(Pass::PrimarySimple)?;
        passes.run(Pass::Primary)?;
        if !settings.rt_accumulate {
            passes.run_numbered(Pass::OtherSide, 1, 0)?;
        }
        self.screen.keep_surfaces(passes)?;
        if facts.flares > 0 {
            passes.run(Pass::FlareRays)?;
        }
        self.photons.record(passes)?;
        self.denoiser.reproject_gradients(passes)?;
        if self.reservoirs.is_on() {
            self.reservoirs.record(passes)?;
        } else {
            light_selection::record(passes, settings, params)?;
        }
        self.vertex_light.record(passes)?;
        if facts.bounces {
            indirect::record(passes, &params.transport, settings.rt_samples)?;
        } else {
            indirect::clear(targets, passes)?;
        }
        if facts.gloss {
            indirect::record_specular(passes, &params.transport)?;
        }
        self.denoiser.filter(passes, &targets.scratch)?;
        indirect::filter_specular(passes)?;
        // after the denoiser, which is the last to read the positions that the filtered light overwrites
        self.fog.record(passes, &targets.fog)?;
        self.counters.end(passes.rec)?;
        self.feedback.end(passes.rec)?;
        passes.run(Pass::Composite)?;
        self.screen.keep_light(passes)?;
        self.antialias.record(passes)?;
        self.counters.end(passes.rec)?;
        passes.run(Pass::Histogram)?;
        passes.run(Pass::Exposure)?;
        self.bloom.record(passes)?;
        passes.run(Pass::ToneMap)?;
        if settings.rt_debug != DebugOutput::None {
            passes.run(Pass::Debug)?;
        }
        Ok(())
    }

    /// Facts that select sizes and variants of the passes.
    fn facts(
        &self,
        targets: &Targets,
        settings: &Settings,
        output: [u32; 2],
        params: &TraceView,
    ) -> FrameFacts {
        FrameFacts {
            traced: [targets.width, targets.height],
            output,
            fog_cells: self.fog.cells(),
            flares: params.flares.count,
            photons: params.photons.count,
            subsampled: indirect::is_subsampled(settings, targets.specular.is_some()),
            map_fog: params.scene.fog_count > 0,
            bounces: settings.rt_bounces > 0,
            gloss: targets.specular.is_some(),
            heights: false,
            timed: self.pixel_times.are_shown(),
            blue_noise: settings.rt_blue_noise,
            screen: self.screen.is_known(),
            adaptive: indirect::is_adaptive(settings),
            roulette: settings.rt_bounce_roulette,
            light_tree: uses_tree(settings),
            shared_eyes: params.denoise.other_eye != 0,
            ambient: indirect::adds_ambient(settings),
            more_samples: antialias::traces_more(settings),
            smooth_maximum: antialias::smooths_maximum(settings),
            feedback: self.feedback.is_on(),
            vertex_light: self.vertex_light.is_on(),
            vertices: self.vertex_light.sizes(),
            cut_outs: settings.rt_cutouts > 0,
        }
    }

    /// Number of frames in the accumulated mean before this one; 0 if any visible content has changed.
    fn accumulated_before(
        &mut self,
        view: &TracedScene,
        materials: &dyn MaterialTable,
        settings: &Settings,
    ) -> u32 {
        if !settings.rt_accumulate {
            self.accumulated = (0, 0);
            return 0;
        }
        let key = content_hash(view, materials, settings);
        let joins = self.joining > 0;
        self.joining = self.joining.saturating_sub(1);
        let before = if joins || self.accumulated.0 == key {
            self.accumulated.1
        } else {
            0
        };
        self.accumulated = (key, before.saturating_add(1));
        before
    }
}

/// The images of `Targets` that cannot share memory with others: a debug output shows them after those were written.
/// `output`: size of the picture.
fn own_images(settings: &Settings, output: [u32; 2], specular: bool) -> OwnImages {
    let shows_steps = settings.rt_debug != DebugOutput::None;
    let resolves = antialias::resolves(settings, output);
    OwnImages {
        accumulation: settings.rt_accumulate,
        other: !settings.rt_accumulate && (shows_steps || !resolves),
        indirect: denoise::in_use(settings) != DenoiserChoice::ASvgf,
        specular,
        specular_history: specular && indirect::is_subsampled(settings, true),
        composite: shows_steps,
        fog: shows_steps,
    }
}

/// Width and height of a viewport; `None` if it lies outside of the target.
fn size_in(target: &Image, viewport: [i32; 4]) -> Option<[u32; 2]> {
    let [x, y, width, height] = viewport;
    let (width, height) = (u32::try_from(width).ok()?, u32::try_from(height).ok()?);
    // a view that begins right of or below the target is not traced
    let room =
        |size: u32, start: i32| i64::from(size) - i64::from(start.min(0)) - i64::from(start.max(0));
    let seen =
        width > 0 && height > 0 && room(target.width(), x) > 0 && room(target.height(), y) > 0;
    seen.then_some([width, height])
}

/// Whether a view may see fog, directly or through any portal. Fog that is visible only in reflections and refractions
/// has its constant colour.
fn fog_in_sight(map: &TracedMap<'_>, view: &TracedScene) -> bool {
    let frustum = view.view.frustum();
    let may_see = map.lights.fogs_seen_from(view.view.origin);
    let mut boxes = map.geometry.fog_boxes.iter().enumerate();
    boxes.any(|(i, fog)| !view.look.portals.is_empty() || (may_see(i) && !outside(fog, &frustum)))
}

/// Whether rough surfaces and normal maps are in use. Frosted glass is clear in live frames.
fn has_gloss(materials: &dyn MaterialTable, settings: &Settings) -> bool {
    settings.rt_specular && is_lit(settings) && materials.has_gloss(settings.rt_accumulate)
}
