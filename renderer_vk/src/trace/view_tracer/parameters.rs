//! Parameters of a view's passes.

use glam::Vec3;
use shaders::trace_types::constants as t;
use shaders::trace_types::{
    AntialiasView, CameraView, ExposureView, FeedbackView, FlareView, ImageView, MotionView,
    PortalRecord, PostView, SceneView, TargetView, TraceView, TransportView,
};
use shaders::types::{SunDisc, constants::NO_TEXTURE};

use super::super::indirect::{self, is_subsampled};
use super::{TracedMap, TracedView, ViewTracer};
use crate::gpu::{Error, Image, Recorder};
use crate::raster::{FlareTest, WIDE_FORMAT};
use crate::scene::{SUN_SIZE, TracedScene, View, perpendicular};
use crate::settings::{MOST_BOUNCES, Settings};
use crate::stereo::Stereo;
use crate::trace::accel::AccelOutput;
use crate::trace::beyond_sky::Beyond;
use crate::trace::layer_boxes::in_sight;
use crate::trace::light_selection::is_lit;
use crate::trace::targets::Targets;

/// Data that the parts of the traced look have prepared for a view.
pub(super) struct Prepared<'a> {
    /// The images that the view is traced to.
    pub targets: &'a Targets,
    /// Acceleration structures.
    pub accel: AccelOutput,
    /// Number of frames in the accumulated mean before this one.
    pub accumulated: u32,
    /// Portals and mirrors that primary rays pass.
    pub portals: &'a [PortalRecord],
    /// Positions of the last frame.
    pub motion: MotionView,
    /// Where rays count the bodies that they meet.
    pub feedback: FeedbackView,
    /// Parameters of temporal antialiasing and upscaling.
    pub antialias: AntialiasView,
    /// Parameters of the passes after tracing, and the ray counters.
    pub post: PostView,
}

/// Time constants of adaptation to a brighter and to a darker view, seconds: after this time 1/e of the difference is
/// left. Values of cones and rods (Krawczyk, Myszkowski and Seidel, Perceptual Effects in Real-time Tone Mapping, SCCG
/// 2005, section 3.2).
const LIGHT_ADAPTATION: f32 = 0.1;
const DARK_ADAPTATION: f32 = 0.4;

impl ViewTracer {
    /// All parameters of a view's passes.
    pub(super) fn params(
        &self,
        rec: &mut Recorder,
        traced: &TracedView<'_>,
        prepared: &Prepared<'_>,
    ) -> Result<TraceView, Error> {
        let &TracedView {
            scene, settings, ..
        } = traced;
        let &Prepared {
            targets,
            accel,
            accumulated,
            ..
        } = prepared;
        let lights = traced.map.map_or(&self.no_lights, |m| m.lights);
        let flares = traced.map.map_or_else(FlareTest::default, |m| m.flares);
        Ok(TraceView {
            scratch: targets.scratch.address(),
            blue_noise: self.blue_noise.address(),
            materials: traced.materials.buffers(),
            scene: scene_view(rec, traced, prepared)?,
            lights: lights.of_view(rec, scene, settings)?,
            transport: self.transport(rec, traced)?,
            photons: (traced.map)
                .map(|m| self.photons.view(&m.geometry.bodies, accumulated))
                .unwrap_or_default(),
            reservoirs: self.reservoirs.view(lights.lasting()),
            vertex_light: self.vertex_light.view(),
            motion: prepared.motion,
            denoise: (self.denoiser).view(
                self.frame.wrapping_sub(1),
                targets,
                self.other_eye.as_ref(),
            ),
            feedback: prepared.feedback,
            flares: FlareView {
                flares: flares.flares,
                states: flares.states,
                count: flares.count,
                ..FlareView::default()
            },
            exposure: self.exposure_view(traced),
            post: prepared.post,
            antialias: prepared.antialias,
            fog: self.fog.view(&targets.direct[0], &targets.fog),
            images: self.image_view(targets),
            screen: self.screen.view(settings, &targets.direct[0]),
            target: self.target_view(traced),
            camera: camera_view(traced, targets.height),
            // The first view has no predecessor.
            last_camera: self.history.unwrap_or_default(),
            width: targets.width,
            height: targets.height,
            flags: self.flags(settings, targets, accel.first_person),
            seed: if settings.rt_accumulate {
                accumulated.wrapping_add(settings.rt_first_frame)
            } else {
                self.frame
            },
            accumulated,
        })
    }

    /// Samples of bounced light that a history needs. Whether dynamic lights have changed is known before a ray finds it:
    /// then every cell gathers, so that their bounced light does not lag.
    fn bounce_samples(&self, view: &TracedScene, settings: &Settings) -> f32 {
        let (lights, flashlight) = &self.dynamic_lights;
        if *lights == view.dlights && *flashlight == flashlight_camera(view, settings) {
            settings.rt_bounce_adaptive as f32
        } else {
            f32::MAX
        }
    }

    /// Weight of the new value in automatic exposure in this frame, for an adaptation time of `seconds`.
    fn exposure_blend(&self, view: &TracedScene, settings: &Settings, seconds: f32) -> f32 {
        // in reference mode frames must not depend on earlier ones: exposure adapts at once
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

    /// Boxes that rays are tested against: around translucent layers, geometry behind skies, and surfaces that filter
    /// light.
    fn transport(
        &self,
        rec: &mut Recorder,
        traced: &TracedView<'_>,
    ) -> Result<TransportView, Error> {
        let TracedView {
            scene: view,
            map,
            materials,
            settings,
            ..
        } = *traced;
        let geometry = map.map(|m| m.geometry);
        let boxes = in_sight(view, geometry, materials);
        let (layers, layer_count) = if settings.rt_dof {
            // rays start away from the camera
            (0, u32::MAX)
        } else {
            let count = u32::try_from(boxes.len()).unwrap_or(u32::MAX);
            (rec.arena().push(&boxes)?, count)
        };
        let lens = if settings.rt_dof {
            settings.rt_aperture
        } else {
            0.0
        };
        let camera = camera_frame(view).origin;
        let beyond = Beyond::of(view, camera, lens, geometry, materials);
        let (mirror_reach, mirror_clusters) = geometry.map_or((0, 0), |g| g.mirrors.reach());
        let [mirrors, mirror_of_surface] = geometry.map_or([0; 2], |g| g.mirrors.addresses());
        Ok(TransportView {
            mirrors,
            mirror_of_surface,
            mirror_reach,
            mirror_count: map.map_or(0, |m| mirror_count(&m, view, settings)),
            mirror_clusters,
            mirroring_layers: u32::from(
                settings.rt_accumulate && geometry.is_some_and(|g| g.mirrors.has_layers()),
            ),
            specular_albedo: self.specular_table.address(),
            specular_bounces: indirect::specular_bounces(settings, materials.has_metal()),
            specular_estimator: self.specular_estimator,
            bounce_samples: self.bounce_samples(view, settings),
            foveation: settings.rt_foveation,
            roulette: u32::from(settings.rt_bounce_roulette),
            ambient: settings.rt_bounce_ambient,
            ambient_fall: settings.rt_bounce_ambient_fall,
            cut_outs: geometry.map_or(0, |g| g.cut_outs.address()),
            cut_out_rays: settings.rt_cutouts,
            padding: 0,
            filters: geometry.map_or(0, |g| g.surroundings.filters()),
            filter_count: geometry.map_or(0, |g| g.surroundings.filter_count()),
            layers,
            layer_count,
            beyond: rec.arena().push(&beyond.boxes)?,
            beyond_surfaces: rec.arena().push(&beyond.surfaces)?,
            beyond_count: u32::try_from(beyond.boxes.len()).unwrap_or(u32::MAX),
            beyond_surface_count: u32::try_from(32 * beyond.surfaces.len()).unwrap_or(u32::MAX),
            max_depth: settings.rt_max_depth,
            bounces: settings.rt_bounces.min(MOST_BOUNCES),
        })
    }

    fn exposure_view(&self, traced: &TracedView<'_>) -> ExposureView {
        let TracedView {
            scene, settings, ..
        } = *traced;
        ExposureView {
            state: self.exposure_state.address(),
            bias: settings.rt_exposure,
            base: self.map_exposure.scale.log2(),
            usual: self.map_exposure.middle,
            blend: self.exposure_blend(scene, settings, LIGHT_ADAPTATION),
            blend_dark: self.exposure_blend(scene, settings, DARK_ADAPTATION),
            padding: 0,
        }
    }

    fn target_view(&self, traced: &TracedView<'_>) -> TargetView {
        let [x, y, ..] = traced.scene.view.viewport;
        TargetView {
            image: traced.target.storage_index(),
            x,
            y,
            width: traced.target.width(),
            height: traced.target.height(),
            channels: self.channels,
            peak: match traced.target.format() == WIDE_FORMAT {
                true => (traced.settings.hdr_peak / traced.settings.hdr_white).max(1.01),
                false => 1.0,
            },
            padding: 0,
        }
    }

    /// The bits `VIEW_*` of a view. `first_person`: some geometry is visible to camera rays alone.
    fn flags(&self, settings: &Settings, targets: &Targets, first_person: bool) -> u32 {
        let mut flags = 0;
        let mut set = |bit: u32, on: bool| flags |= if on { bit } else { 0 };
        set(
            t::VIEW_JITTER,
            settings.rt_accumulate && settings.rt_antialiasing,
        );
        set(t::VIEW_ACCUMULATE, settings.rt_accumulate);
        set(t::VIEW_FIRST_PERSON, first_person);
        let is_lit = is_lit(settings);
        set(t::VIEW_AUTO_EXPOSURE, settings.rt_auto_exposure && is_lit);
        set(t::VIEW_EXPOSURE_RESET, !self.exposure_started);
        set(t::VIEW_FAST_SKY, settings.hides_sky());
        set(t::VIEW_FULLBRIGHT, !is_lit);
        set(t::VIEW_DENOISE, self.denoiser.is_on());
        set(
            t::VIEW_SUBSAMPLED_BOUNCE,
            is_subsampled(settings, targets.specular.is_some()),
        );
        set(t::VIEW_HISTORY, self.history.is_some());
        set(t::VIEW_RELIEF, settings.parallax_mapping > 1);
        flags
    }

    /// Bindless indices of the images. Where `Targets` lacks one, an image serves that nothing else uses meanwhile; in
    /// reference mode `other` is not read.
    fn image_view(&self, targets: &Targets) -> ImageView {
        let other = (targets.other.as_ref())
            .or(self.antialias.other())
            .unwrap_or(&targets.shown);
        let indirect = (targets.indirect.as_ref())
            .or(self.denoiser.indirect())
            .unwrap_or(&targets.direct[0]);
        ImageView {
            position: targets.position.storage_index(),
            distance_tail: targets.distance_tail.storage_index(),
            surface: targets.surface.storage_index(),
            shown: targets.shown.storage_index(),
            other: other.storage_index(),
            direct: targets.direct[0].storage_index(),
            indirect: indirect.storage_index(),
            specular: (targets.specular.as_ref()).map_or(t::NO_IMAGE, Image::storage_index),
            specular_light: (targets.specular_light.as_ref()).map_or(0, Image::storage_index),
            fresh_specular: (targets.specular_history.as_ref())
                .map_or(t::NO_IMAGE, |[fresh, _]| fresh.storage_index()),
            last_specular: (targets.specular_history.as_ref())
                .filter(|_| targets.has_specular_history)
                .map_or(t::NO_IMAGE, |[_, last]| last.storage_index()),
            composite: targets.composite.storage_index(),
            accumulation: (targets.accumulation.as_ref()).map_or(0, Image::storage_index),
            motion: targets.motion.storage_index(),
        }
    }
}

/// Geometry and materials.
fn scene_view(
    rec: &mut Recorder,
    traced: &TracedView<'_>,
    prepared: &Prepared<'_>,
) -> Result<SceneView, Error> {
    let &Prepared { accel, portals, .. } = prepared;
    let geometry = traced.map.map(|m| m.geometry);
    Ok(SceneView {
        geometries: accel.geometries,
        instances: accel.instances,
        fogs: geometry.map_or(0, |g| g.fogs.address()),
        portals: rec.arena().push(portals)?,
        skies: geometry.map_or(0, |g| g.skies.address()),
        mapped_vertices: geometry.map_or(0, |g| g.mapped_vertices),
        nodes: accel.top.nodes,
        placed: accel.top.placed,
        top_level: accel.top.scene,
        fog_count: geometry.map_or(0, |g| g.fog_count),
        portal_count: u32::try_from(portals.len()).unwrap_or(u32::MAX),
        time: traced.scene.time,
        sky_sampler: traced.materials.sky_sampler(),
        sky_distance: traced.scene.view.sky_distance(),
        sun: sun_disc(traced.scene),
    })
}

/// The camera of a view that is traced with `height` rows of pixels.
fn camera_view(traced: &TracedView<'_>, height: u32) -> CameraView {
    let camera = &traced.scene.view;
    CameraView {
        absorption: traced.map.map_or(Vec3::ZERO, |m| {
            m.geometry.surroundings.absorption(camera.origin)
        }),
        pixel_spread: pixel_spread(camera.tan_y, height),
        near: camera.near,
        stereo_shift: camera.stereo.slope / camera.tan_x,
        ..camera_frame(traced.scene)
    }
}

/// Number of flat mirrors across which light is sampled.
fn mirror_count(map: &TracedMap<'_>, view: &TracedScene, settings: &Settings) -> u32 {
    // later bounces and portals lead out of sight
    let shows_its_sight = settings.rt_bounces < 2 && view.look.portals.is_empty();
    let camera = camera_frame(view).origin;
    let cluster = shows_its_sight.then(|| map.lights.sight.cluster_at(camera));
    (map.geometry.mirrors).count(settings.rt_accumulate, cluster.flatten())
}

/// The camera of a view, as two frames must share it to show equal directions.
pub(super) fn camera_frame(view: &TracedScene) -> CameraView {
    stereo_camera(&view.view, view.view.stereo)
}

/// The camera that the flashlight moves with, if it is on.
pub(super) fn flashlight_camera(view: &TracedScene, settings: &Settings) -> Option<CameraView> {
    settings.rt_flashlight.then(|| camera_frame(view))
}

/// The same with another stereo offset.
pub(super) fn stereo_camera(camera: &View, stereo: Stereo) -> CameraView {
    let [forward, left, up] = camera.axis;
    CameraView {
        origin: camera.origin + left * stereo.offset(),
        forward,
        left: left * camera.tan_x,
        up: up * camera.tan_y,
        ..CameraView::default()
    }
}

/// The sun's disc, if it is visible.
fn sun_disc(view: &TracedScene) -> SunDisc {
    view.sun.map_or(
        SunDisc {
            material: NO_TEXTURE,
            ..SunDisc::default()
        },
        |sun| SunDisc {
            direction: sun.direction,
            material: sun.material,
            left: perpendicular(sun.direction),
            size: SUN_SIZE,
        },
    )
}

/// Width of a pixel's cone at distance 1.
#[allow(clippy::cast_precision_loss)] // a height in pixels
fn pixel_spread(tan_y: f32, height: u32) -> f32 {
    2.0 * tan_y / height.max(1) as f32
}

pub(super) fn portal_record(portal: &crate::scene::Portal) -> PortalRecord {
    PortalRecord {
        plane: portal.plane.to_array(),
        mirror: u32::from(portal.mirror),
        surface_origin: portal.surface_origin,
        surface_axis: portal.surface_axis,
        camera_origin: portal.camera_origin,
        camera_axis: portal.camera_axis,
    }
}
