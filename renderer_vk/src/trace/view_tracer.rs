//! The traced look: its state from frame to frame and the order of its passes.

use std::hash::{DefaultHasher, Hash, Hasher};

use glam::Vec3;
use shaders::trace_types::constants as t;
use shaders::trace_types::{
    AntialiasView, FlareView, MotionView, PortalRecord, PostView, TraceView, TransportView,
};

use super::accel::{Accel, AccelOutput};
use super::antialias::{Antialias, traced_size};
use super::bloom::Bloom;
use super::counters::{COUNTED, RayCounters};
use super::debug::DebugView;
use super::denoise::Denoiser;
use super::fog::LitFog;
use super::geometry::StaticGeometry;
use super::input::{MaterialTable, Tracer};
use super::layer_boxes::in_sight;
use super::lights::MapLights;
use super::motion::Motion;
use super::passes::{
    Choose, Composite, Direct, Exposure, EyeRays, Fill, FlareRays, Indirect, OtherSide, Primary,
    ToneMap,
};
use super::targets::Targets;
use crate::gpu::{Access, Buffer, BufferUsage, Device, Error, Image, Recorder};
use crate::raster::FlareTest;
use crate::scene::ViewScene;
use crate::settings::Settings;
use crate::world::outside;

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
    primary: Primary,
    /// The same with lit fog, made when there is some.
    fog_primary: Option<Primary>,
    other_side: OtherSide,
    fog: LitFog,
    choose: Choose,
    /// Of one chosen light a pixel, and of any number.
    chosen_direct: Direct,
    direct: Direct,
    indirect: Indirect,
    /// The same for maps with fog, made when there is one.
    fog_indirect: Option<Indirect>,
    fill: Fill,
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
    /// Stops at which the map looks as bright as the engine shows it.
    pub(super) exposure_base: f32,
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
    /// Compiles the pipelines and makes what stays from frame to frame.
    ///
    /// # Errors
    /// The device refuses a pipeline, or is out of memory.
    pub fn new(device: &Device, tracer: Tracer) -> Result<Self, Error> {
        Ok(Self {
            device: device.clone(),
            accel: Accel::new(device, tracer),
            eye_rays: EyeRays::new(device, tracer)?,
            primary: Primary::new(device, tracer)?,
            fog_primary: None,
            other_side: OtherSide::new(device, tracer)?,
            fog: LitFog::new(device, tracer),
            choose: Choose::new(device)?,
            chosen_direct: Direct::of_chosen(device, tracer)?,
            direct: Direct::new(device, tracer)?,
            indirect: Indirect::new(device, tracer)?,
            fog_indirect: None,
            fill: Fill::new(device)?,
            flare_rays: None,
            tracer,
            denoiser: Denoiser::new(device)?,
            composite: Composite::new(device)?,
            antialias: Antialias::new(device)?,
            exposure: Exposure::new(device)?,
            tone_map: ToneMap::new(device)?,
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
            exposure_base: 0.0,
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
            self.fog_primary = Some(Primary::with_lit_fog(&self.device, self.tracer)?);
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
            image_rays: counting.image,
            bloom: self
                .bloom
                .prepare(&self.device, output, settings.rt_bloom)?,
            bloom_strength: settings.rt_bloom.clamp(0.0, 1.0),
            debug: settings.rt_debug,
            exposure_blend_dark: self.exposure_blend(view, settings, DARK_ADAPTATION),
        };
        let address = rec.arena().push(&[params])?;

        if let Some(targets) = &mut self.targets {
            targets.indirect_is_black &= settings.rt_bounces == 0;
        }
        self.eye_rays.record(rec, address, size)?;
        let primary = self.fog_primary.as_ref().filter(|_| self.fog.is_on());
        primary
            .unwrap_or(&self.primary)
            .record(rec, address, size)?;
        if !settings.rt_accumulate {
            self.other_side.record(rec, address, size)?;
        }
        if params.flares.count > 0 {
            let flare_rays = match &mut self.flare_rays {
                Some(made) => made,
                none => none.insert(FlareRays::new(&self.device, self.tracer)?),
            };
            flare_rays.record(rec, address, [params.flares.count, 1])?;
        }
        self.denoiser.choose_gradient_samples(rec, address)?;
        if is_lit(settings)
            && params.lights.selection == t::SELECT_RESAMPLED
            && params.lights.samples == 1
        {
            self.choose.record(rec, address, size)?;
            self.chosen_direct.record(rec, address, size)?;
        } else {
            self.direct.record(rec, address, size)?;
        }
        if settings.rt_bounces == 0 {
            self.darken_indirect(rec)?;
        } else {
            let indirect = if params.fog_count == 0 {
                &self.indirect
            } else {
                match &mut self.fog_indirect {
                    Some(made) => made,
                    none => none.insert(Indirect::with_fog(&self.device, self.tracer)?),
                }
            };
            if sparse_bounce(settings) {
                let cells = [width.div_ceil(2), height.div_ceil(2)];
                indirect.record(rec, address, cells)?;
                self.fill.record(rec, address, cells)?;
            } else {
                indirect.record(rec, address, size)?;
            }
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

    #[allow(clippy::too_many_arguments)] // what a view depends on
    fn params(
        &self,
        rec: &mut Recorder,
        view: &ViewScene,
        map: Option<TracedMap<'_>>,
        materials: &dyn MaterialTable,
        settings: &Settings,
        target: &Image,
        accel: AccelOutput,
        accumulated: u32,
        portals: &[PortalRecord],
        motion: MotionView,
        antialias: AntialiasView,
    ) -> Result<TraceView, Error> {
        let Some(targets) = &self.targets else {
            return Ok(TraceView::default()); // made by the caller
        };
        let camera = &view.view;
        let lights = map.map_or(&self.no_lights, |m| m.lights);
        let flares = map.map_or_else(FlareTest::default, |m| m.flares);
        let mut flags = 0;
        let mut set = |bit: u32, on: bool| flags |= if on { bit } else { 0 };
        set(
            t::VIEW_JITTER,
            settings.rt_accumulate && settings.rt_antialiasing,
        );
        set(t::VIEW_ACCUMULATE, settings.rt_accumulate);
        set(t::VIEW_FIRST_PERSON, accel.first_person);
        let is_lit = is_lit(settings);
        set(t::VIEW_AUTO_EXPOSURE, settings.rt_auto_exposure && is_lit);
        set(t::VIEW_EXPOSURE_RESET, !self.exposure_started);
        set(t::VIEW_FAST_SKY, settings.fast_sky);
        set(t::VIEW_FULLBRIGHT, !is_lit);
        set(t::VIEW_DENOISE, self.denoiser.is_on());
        set(t::VIEW_SPARSE_BOUNCE, sparse_bounce(settings));
        set(t::VIEW_HISTORY, self.history.is_some());
        let [last_eye, last_forward, last_left, last_up] = self.history.unwrap_or([Vec3::ZERO; 4]);
        let [eye, forward, left, up] = camera_frame(view);
        let boxes = in_sight(view, map.map(|m| m.geometry), materials);
        let (layers, layer_count) = if settings.rt_dof {
            // rays start beside the eye
            (0, u32::MAX)
        } else {
            let count = u32::try_from(boxes.len()).unwrap_or(u32::MAX);
            (rec.arena().push(&boxes)?, count)
        };
        Ok(TraceView {
            geometries: accel.geometries,
            instances: accel.instances,
            fogs: map.map_or(0, |m| m.geometry.fogs.address()),
            portals: rec.arena().push(portals)?,
            skies: map.map_or(0, |m| m.geometry.skies.address()),
            exposure: self.exposure_state.address(),
            texels: targets.texels.address(),
            bvh_nodes: accel.nodes,
            bvh_instances: accel.placed,
            flares: FlareView {
                flares: flares.flares,
                states: flares.states,
                count: flares.count,
                padding: 0,
            },
            materials: materials.buffers(),
            post: PostView::default(), // filled in by the caller
            motion: MotionView {
                image: targets.motion.storage_index(),
                path: targets.path[0].storage_index(),
                last_path: targets.path[1].storage_index(),
                ..motion
            },
            antialias,
            lights: lights.of_view(rec, view, settings)?,
            eye,
            forward,
            left,
            up,
            width: targets.width,
            height: targets.height,
            target_x: camera.viewport[0],
            target_y: camera.viewport[1],
            scene: accel.scene,
            flags,
            seed: if settings.rt_accumulate {
                accumulated
            } else {
                self.frame
            },
            accumulated,
            time: view.time,
            pixel_spread: pixel_spread(camera.tan_y, targets.height),
            ambient: lights.ambient * settings.rt_light_scale.max(0.0),
            transport: TransportView {
                layers,
                layer_count,
                ..map.map_or_else(Default::default, |m| {
                    m.geometry.surroundings.view(camera.origin)
                })
            },
            eye_shift: camera.stereo.slope / camera.tan_x,
            channels: self.channels,
            fog_count: map.map_or(0, |m| m.geometry.fog_count),
            portal_count: u32::try_from(portals.len()).unwrap_or(u32::MAX),
            fog: self.fog.view(&targets.direct, &targets.composite),
            max_depth: settings.rt_max_depth,
            bounces: settings.rt_bounces.min(2),
            image_position: targets.position.storage_index(),
            image_surface: targets.surface.storage_index(),
            image_shown: targets.shown.storage_index(),
            image_other: targets.other.storage_index(),
            image_direct: targets.direct.storage_index(),
            image_indirect: targets.indirect.storage_index(),
            image_composite: targets.composite.storage_index(),
            image_accumulation: targets
                .accumulation
                .as_ref()
                .map_or(0, Image::storage_index),
            image_target: target.storage_index(),
            exposure_bias: settings.rt_exposure,
            exposure_base: self.exposure_base,
            exposure_blend: self.exposure_blend(view, settings, LIGHT_ADAPTATION),
            target_width: target.width(),
            target_height: target.height(),
            sky_sampler: materials.sky_sampler(),
            last_eye,
            last_forward,
            last_left,
            last_up,
            denoise: (self.denoiser).view(self.frame.wrapping_sub(1), &targets.texels),
        })
    }
}

/// Eye, forward, and left and up scaled by the tangents of the half angles.
fn camera_frame(view: &ViewScene) -> [Vec3; 4] {
    let camera = &view.view;
    let [forward, left, up] = camera.axis;
    [
        camera.origin + left * camera.stereo.offset(),
        forward,
        left * camera.tan_x,
        up * camera.tan_y,
    ]
}

/// Width of a pixel's cone at distance 1.
#[allow(clippy::cast_precision_loss)] // a height in pixels
fn pixel_spread(tan_y: f32, height: u32) -> f32 {
    2.0 * tan_y / height.max(1) as f32
}

fn portal_record(portal: &crate::scene::Portal) -> PortalRecord {
    PortalRecord {
        plane: portal.plane.to_array(),
        mirror: u32::from(portal.mirror),
        surface_origin: portal.surface_origin,
        surface_axis: portal.surface_axis,
        camera_origin: portal.camera_origin,
        camera_axis: portal.camera_axis,
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

/// Whether bounced light is gathered for a quarter of the pixels: in a picture that is denoised nobody can tell, and it is the
/// dearest pass. Reference mode and undenoised pictures get every pixel.
fn sparse_bounce(settings: &Settings) -> bool {
    !settings.rt_accumulate && settings.rt_denoiser > 0 && settings.rt_bounces > 0
}

/// A number that changes whenever the mean picture does: camera, everything in the scene, time, settings.
fn content_hash(view: &ViewScene, materials: &dyn MaterialTable, settings: &Settings) -> u64 {
    let mut hasher = DefaultHasher::new();
    let mut floats = |values: &[f32]| {
        for value in values {
            value.to_bits().hash(&mut hasher);
        }
    };
    let vector = |v: Vec3| [v.x, v.y, v.z];
    let camera = &view.view;
    floats(&vector(camera.origin));
    for axis in camera.axis {
        floats(&vector(axis));
    }
    floats(&[camera.tan_x, camera.tan_y, view.time]);
    floats(&[camera.stereo.slope, camera.stereo.distance]);
    floats(&[settings.rt_light_scale, settings.rt_dlight_scale]);
    for light in &view.dlights {
        floats(&vector(light.origin));
        floats(&vector(light.color));
        floats(&[light.radius]);
    }
    for portal in &view.portals {
        floats(&portal.plane.to_array());
        floats(&vector(portal.camera_origin));
        for axis in portal.camera_axis {
            floats(&vector(axis));
        }
    }
    camera.viewport.hash(&mut hasher);
    bytemuck::cast_slice::<_, u8>(&view.instances).hash(&mut hasher);
    for mesh in &view.meshes {
        let geometry = view.mesh_geometry(mesh);
        bytemuck::cast_slice::<_, u8>(geometry.vertices).hash(&mut hasher);
        // whether a mesh is kept from frame to frame is nothing that shows
        for triangle in geometry.triangles() {
            triangle.hash(&mut hasher);
        }
        (mesh.material, mesh.instance, mesh.fog).hash(&mut hasher);
    }
    for submodel in &view.submodels {
        (submodel.model, submodel.instance).hash(&mut hasher);
    }
    view.has_world.hash(&mut hasher);
    materials.generation().hash(&mut hasher);
    (
        settings.rt_max_depth,
        settings.rt_bounces,
        settings.fast_sky,
        settings.fullbright || !settings.rt_illumination,
    )
        .hash(&mut hasher);
    (settings.dynamic_light, settings.no_portals).hash(&mut hasher);
    (settings.rt_antialiasing, settings.rt_dof).hash(&mut hasher);
    let lens = [settings.rt_aperture, settings.rt_focal_length];
    lens.map(f32::to_bits).hash(&mut hasher);
    // estimators with the same mean could go on together, but a comparison wants them apart
    (
        settings.rt_cull_lights,
        settings.rt_soft_shadows,
        settings.rt_flashlight,
        settings.rt_light_selection as u32,
        settings.rt_num_random_dl,
        settings.rt_candidates,
    )
        .hash(&mut hasher);
    hasher.finish()
}
