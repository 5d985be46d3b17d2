//! The traced look: its state from frame to frame and the order of its passes.

mod content;
mod parameters;

use glam::Vec3;
use shaders::trace_types::constants as t;
use shaders::trace_types::{AntialiasView, PortalRecord, PostView};

use super::accel::Accel;
use super::antialias::{Antialias, traced_size};
use super::bloom::Bloom;
use super::counters::{COUNTED, RayCounters};
use super::debug::DebugView;
use super::denoise::Denoiser;
use super::fog::LitFog;
use super::geometry::StaticGeometry;
use super::indirect::IndirectLight;
use super::input::{MaterialTable, Tracer};
use super::lights::MapLights;
use super::motion::Motion;
use super::passes::{
    Choose, Composite, Direct, Exposure, EyeRays, FlareRays, OtherSide, PlainPrimary, Primary,
    ToneMap,
};
use super::targets::Targets;
use crate::at_once::{Late, Make, make_all};
use crate::gpu::{Access, Buffer, BufferUsage, Device, Error, Image, Recorder};
use crate::raster::FlareTest;
use crate::scene::ViewScene;
use crate::settings::Settings;
use crate::world::outside;
use content::content_hash;
use parameters::{camera_frame, portal_record};

/// The map that a view shows.
#[derive(Clone, Copy)]
pub struct TracedMap<'a> {
    /// Its geometry.
    pub geometry: &'a StaticGeometry,
    /// Its lights.
    pub lights: &'a MapLights,
    /// Flares of the view that rays are to test.
    pub flares: FlareTest,
}

/// Draws views by tracing rays.
pub struct ViewTracer {
    pub(super) device: Device,
    pub(super) accel: Accel,
    eye_rays: EyeRays,
    primary: (PlainPrimary, Primary),
    /// The same with lit fog, made when there is some.
    fog_primary: Option<(PlainPrimary, Primary)>,
    other_side: OtherSide,
    fog: LitFog,
    choose: Choose,
    /// Of one chosen light a pixel.
    chosen_direct: Direct,
    suns: Direct,
    /// Of any number of lights, made when it is asked for.
    direct: Option<Direct>,
    indirect: IndirectLight,
    /// Made when a view has flares.
    flare_rays: Option<FlareRays>,
    tracer: Tracer,
    pub(super) denoiser: Denoiser,
    composite: Composite,
    antialias: Antialias,
    exposure: Exposure,
    tone_map: ToneMap,
    motion: Motion,
    bloom: Bloom,
    debug: DebugView,
    counters: RayCounters,
    /// Channels of the target that are written: 1 red, 2 green, 4 blue.
    pub(super) channels: u32,
    /// Rays are counted.
    pub(super) count_rays: bool,
    pub(super) targets: Option<Targets>,
    exposure_state: Buffer,
    exposure_started: bool,
    /// At which the map looks as bright as the engine shows it.
    pub(super) map_exposure: relight::exposure::Exposure,
    no_lights: MapLights,
    frame: u32,
    last_time: f32,
    /// Camera of the last frame whose light the denoiser can go on from.
    history: Option<[Vec3; 4]>,
    /// Hash of everything that the accumulated frames show, and how many there are.
    accumulated: (u64, u32),
}

/// Seconds after which the eye has adapted to a brighter and to a darker view but for 1/e of the difference: those of
/// cones and rods (Krawczyk, Myszkowski and Seidel, Perceptual Effects in Real-time Tone Mapping, SCCG 2005, section 3.2).
const LIGHT_ADAPTATION: f32 = 0.1;
const DARK_ADAPTATION: f32 = 0.4;

impl ViewTracer {
    /// Compiles the pipelines and makes what stays from frame to frame. `has_fog`: the map has some; where this is not
    /// known, its pipelines are made when it comes into sight.
    ///
    /// # Errors
    /// The device refuses a pipeline, or is out of memory.
    pub fn new(device: &Device, tracer: Tracer, has_fog: bool) -> Result<Self, Error> {
        // drivers compile for a long time where they have not done it before
        let eye_rays = Late::new(|| EyeRays::new(device, tracer));
        let plain = Late::new(|| PlainPrimary::new(device));
        let primary = Late::new(|| Primary::new(device, tracer));
        let other_side = Late::new(|| OtherSide::new(device, tracer));
        let choose = Late::new(|| Choose::new(device));
        let chosen_direct = Late::new(|| Direct::of_chosen(device, tracer));
        let suns = Late::new(|| Direct::of_suns(device, tracer));
        let fog_plain = Late::new(|| PlainPrimary::with_lit_fog(device));
        let fog_primary = Late::new(|| Primary::with_lit_fog(device, tracer));
        let fog = Late::new(|| LitFog::new(device, tracer, has_fog));
        let indirect = Late::new(|| IndirectLight::new(device, tracer, has_fog));
        let denoiser = Late::new(|| Denoiser::new(device));
        let composite = Late::new(|| Composite::new(device));
        let antialias = Late::new(|| Antialias::new(device));
        let exposure = Late::new(|| Exposure::new(device));
        let tone_map = Late::new(|| ToneMap::new(device));
        // those that take longest first
        let mut things: Vec<&dyn Make> = Vec::new();
        if has_fog {
            things.extend([&fog_primary as &dyn Make, &fog_plain]);
        }
        things.extend([
            &primary as &dyn Make,
            &other_side,
            &indirect,
            &denoiser,
            &plain,
            &fog,
            &chosen_direct,
            &suns,
            &eye_rays,
            &choose,
            &antialias,
            &composite,
            &exposure,
            &tone_map,
        ]);
        make_all(&things);
        Ok(Self {
            device: device.clone(),
            accel: Accel::new(device, tracer),
            eye_rays: eye_rays.take()?,
            primary: (plain.take()?, primary.take()?),
            fog_primary: if has_fog {
                Some((fog_plain.take()?, fog_primary.take()?))
            } else {
                None
            },
            other_side: other_side.take()?,
            fog: fog.take()?,
            choose: choose.take()?,
            chosen_direct: chosen_direct.take()?,
            suns: suns.take()?,
            direct: None,
            indirect: indirect.take()?,
            flare_rays: None,
            tracer,
            denoiser: denoiser.take()?,
            composite: composite.take()?,
            antialias: antialias.take()?,
            exposure: exposure.take()?,
            tone_map: tone_map.take()?,
            motion: Motion::default(),
            bloom: Bloom::default(),
            debug: DebugView::default(),
            counters: RayCounters::default(),
            channels: 7,
            count_rays: false,
            targets: None,
            // zeros: the first frame counts into the histogram before any pass has emptied it
            exposure_state: Buffer::with_data(
                device,
                "trace exposure",
                BufferUsage::STORAGE,
                &[0u8; Exposure::STATE_SIZE as usize],
            )?,
            exposure_started: false,
            map_exposure: relight::exposure::Exposure::usual(1.0),
            no_lights: MapLights::none(device)?,
            frame: 0,
            last_time: 0.0,
            history: None,
            accumulated: (0, 0),
        })
    }

    /// How many frames the picture is the mean of; 1 outside of reference mode.
    pub fn accumulated_frames(&self) -> u32 {
        self.accumulated.1.max(1)
    }

    /// The linear picture of the last view, before exposure: RGBA, floats of 32 bits while frames are accumulated and of
    /// 16 bits otherwise.
    pub fn hdr(&self) -> Option<&Image> {
        let targets = self.targets.as_ref()?;
        Some(self.antialias.picture().unwrap_or(targets.picture()))
    }

    /// Rays of each of [`COUNTED`]'s passes in the newest finished frame; `None` while they
    /// are not counted.
    pub fn rays(&self) -> Option<[u64; COUNTED.len()]> {
        self.counters.rays()
    }

    /// Forgets what was accumulated and lets exposure start anew: the map has changed.
    pub fn reset(&mut self) {
        self.accumulated = (0, 0);
        self.history = None;
        self.motion = Motion::default();
        self.antialias.reset();
        self.fog.reset();
        self.exposure_started = false;
    }

    /// Records all passes of a view into its rectangle of `target` (RGBA8, usable as storage image). A view without
    /// area is left out.
    ///
    /// # Errors
    /// Out of memory, or a lost device.
    pub fn record_view(
        &mut self,
        rec: &mut Recorder,
        view: &ViewScene,
        map: Option<TracedMap<'_>>,
        materials: &dyn MaterialTable,
        settings: &Settings,
        target: &Image,
    ) -> Result<(), Error> {
        let [x, y, width, height] = view.view.viewport;
        let (Ok(width), Ok(height)) = (u32::try_from(width), u32::try_from(height)) else {
            return Ok(());
        };
        // what lies outside of the target is not traced, unless the view begins to its left or above
        let room = |size: u32, start: i32| {
            i64::from(size) - i64::from(start.min(0)) - i64::from(start.max(0))
        };
        if width == 0
            || height == 0
            || room(target.width(), x) <= 0
            || room(target.height(), y) <= 0
        {
            return Ok(());
        }
        let output = [width, height];
        let size = traced_size(settings, output);
        if self
            .targets
            .as_ref()
            .is_none_or(|t| [t.width, t.height] != size)
        {
            self.targets = Some(Targets::new(&self.device, size[0], size[1])?);
            self.history = None;
            self.accumulated = (0, 0);
        }
        if let Some(targets) = &mut self.targets {
            targets.fit(&self.device, settings.rt_accumulate)?;
        }
        let denoiser = if settings.rt_accumulate {
            0
        } else {
            settings.rt_denoiser
        };
        self.denoiser
            .prepare(denoiser, size, self.history.is_some())?;
        let map = map.filter(|_| view.has_world);
        let has_fog = map.is_some_and(|m| fog_in_sight(&m, view));
        let goes_on = self.history.is_some();
        self.fog
            .prepare(has_fog && is_lit(settings), denoiser > 0, size, goes_on)?;
        if self.fog.is_on() && self.fog_primary.is_none() {
            self.fog_primary = Some((
                PlainPrimary::with_lit_fog(&self.device)?,
                Primary::with_lit_fog(&self.device, self.tracer)?,
            ));
        }
        let accumulated = self.accumulated_before(view, materials, settings);
        let accel = self
            .accel
            .record(rec, view, map.map(|m| m.geometry), materials)?;
        let portals: Vec<PortalRecord> = if settings.no_portals {
            Vec::new()
        } else {
            view.portals.iter().map(portal_record).collect()
        };
        let mut motion = self.motion.record(rec, view, &portals, accel.vertices)?;
        motion.still &= u32::from(self.history == Some(camera_frame(view)));
        let show_rays = settings.rt_debug == t::DEBUG_RAYS;
        let counting = (self.counters).begin(rec, size, self.count_rays, show_rays)?;
        let antialias = match &self.targets {
            Some(targets) => self.antialias.prepare(
                &self.device,
                settings,
                output,
                targets.picture(),
                self.history.is_some(),
            )?,
            None => AntialiasView::default(),
        };
        let mut params = self.params(
            rec,
            view,
            map,
            materials,
            settings,
            target,
            accel,
            accumulated,
            &portals,
            motion,
            antialias,
        )?;
        params.post = PostView {
            counters: counting.address,
            bloom: self
                .bloom
                .prepare(&self.device, output, settings.rt_bloom)?,
            bloom_strength: settings.rt_bloom.clamp(0.0, 1.0),
            debug: settings.rt_debug,
        };
        params.image_rays = counting.image;
        let address = rec.arena().push(&[params])?;

        if let Some(targets) = &mut self.targets {
            targets.indirect_is_black &= settings.rt_bounces == 0;
        }
        self.eye_rays.record(rec, address, size)?;
        let fog_primary = self.fog_primary.as_ref().filter(|_| self.fog.is_on());
        let (plain, primary) = fog_primary.unwrap_or(&self.primary);
        plain.record(rec, address, size)?;
        primary.record(rec, address, size)?;
        if !settings.rt_accumulate {
            self.other_side.record(rec, address, size)?;
        }
        if params.flare_count > 0 {
            let flare_rays = match &mut self.flare_rays {
                Some(made) => made,
                none => none.insert(FlareRays::new(&self.device, self.tracer)?),
            };
            flare_rays.record(rec, address, [params.flare_count, 1])?;
        }
        self.denoiser.choose_gradient_samples(rec, address)?;
        if is_lit(settings)
            && params.lights.selection == t::SELECT_RESAMPLED
            && params.lights.samples == 1
        {
            self.choose.record(rec, address, size)?;
            self.chosen_direct
                .record_chosen(rec, "trace_direct", address, size)?;
            if params.lights.sun_count > 0 {
                self.suns.record_chosen(rec, "trace_suns", address, size)?;
            }
        } else {
            let direct = match &mut self.direct {
                Some(made) => made,
                none => none.insert(Direct::new(&self.device, self.tracer)?),
            };
            direct.record(rec, address, size)?;
        }
        if settings.rt_bounces == 0 {
            self.darken_indirect(rec)?;
        } else {
            let has_fog = params.fog_count > 0;
            self.indirect
                .record(rec, address, size, settings, has_fog)?;
        }
        self.fog.record(rec, address)?;
        self.counters.end(rec)?;
        if let Some(targets) = &self.targets {
            self.denoiser
                .filter(rec, address, &targets.texels, settings.rt_bounces > 0)?;
        }
        self.composite.record(rec, address, size)?;
        self.antialias.record(rec, address)?;
        self.exposure.record(rec, address, output)?;
        self.bloom.record(rec, address)?;
        self.tone_map.record(rec, address, output)?;
        if settings.rt_debug > 0 {
            self.debug.record(&self.device, rec, address, output)?;
        }
        self.frame = self.frame.wrapping_add(1);
        self.last_time = view.time;
        self.history = (!settings.rt_accumulate).then(|| camera_frame(view));
        self.denoiser.advance();
        self.fog.advance();
        if let Some(targets) = &mut self.targets {
            targets.advance();
        }
        self.antialias.advance();
        self.exposure_started = true;
        Ok(())
    }

    /// Bounced light becomes black, where it is not.
    fn darken_indirect(&mut self, rec: &mut Recorder) -> Result<(), Error> {
        if let Some(targets) = &mut self.targets
            && !targets.indirect_is_black
        {
            let mut pass = rec.pass("trace_no_indirect", Access::TRANSFER, Access::TRANSFER)?;
            pass.clear_image(&targets.indirect, [0.0; 4]);
            targets.indirect_is_black = true;
        }
        Ok(())
    }

    /// How far automatic exposure moves to its aim in this frame, when the eye adapts within `seconds`.
    fn exposure_blend(&self, view: &ViewScene, settings: &Settings, seconds: f32) -> f32 {
        // the picture settles at once where frames must not depend on those before them
        if settings.rt_accumulate || !self.exposure_started {
            return 1.0;
        }
        let passed = view.time - self.last_time;
        let passed = if passed > 0.0 {
            passed.min(1.0)
        } else {
            1.0 / 60.0
        };
        1.0 - (-passed / seconds).exp()
    }

    /// Number of frames that the accumulated sum holds before this one; 0 if anything that shows has changed.
    fn accumulated_before(
        &mut self,
        view: &ViewScene,
        materials: &dyn MaterialTable,
        settings: &Settings,
    ) -> u32 {
        if !settings.rt_accumulate {
            self.accumulated = (0, 0);
            return 0;
        }
        let key = content_hash(view, materials, settings);
        let before = if self.accumulated.0 == key {
            self.accumulated.1
        } else {
            0
        };
        self.accumulated = (key, before.saturating_add(1));
        before
    }
}

/// Whether a view may see into fog: straight on, or by a portal wherever that leads. In what glass and shiny surfaces
/// reflect while no fog lies in the view itself, fog has its constant colour alone.
fn fog_in_sight(map: &TracedMap<'_>, view: &ViewScene) -> bool {
    let frustum = view.view.frustum();
    let may_see = map.lights.fogs_seen_from(view.view.origin);
    let mut boxes = map.geometry.fog_boxes.iter().enumerate();
    boxes.any(|(i, fog)| !view.portals.is_empty() || (may_see(i) && !outside(fog, &frustum)))
}

/// Whether surfaces show light; otherwise they show their own colour.
fn is_lit(settings: &Settings) -> bool {
    settings.rt_illumination && !settings.fullbright
}
