//! The parameters that the passes of a view read.

use glam::Vec3;
use shaders::trace_types::constants as t;
use shaders::trace_types::{
    AntialiasView, FlareView, MotionView, PortalRecord, PostView, TraceView, TransportView,
};
use shaders::types::{SunDisc, constants::NO_TEXTURE};

use super::super::indirect::is_subsampled;
use super::{DARK_ADAPTATION, LIGHT_ADAPTATION, TracedView, ViewTracer, is_lit};
use crate::gpu::{Error, Image, Recorder};
use crate::raster::FlareTest;
use crate::scene::{SUN_SIZE, ViewScene, perpendicular};
use crate::settings::Settings;
use crate::trace::accel::AccelOutput;
use crate::trace::beyond_sky::Beyond;
use crate::trace::layer_boxes::in_sight;
use crate::trace::targets::Targets;

/// What the parts of the traced look have prepared for a view.
pub(super) struct Prepared<'a> {
    /// The images that the view is traced to.
    pub targets: &'a Targets,
    /// What rays are traced against.
    pub accel: AccelOutput,
    /// Number of frames that the accumulated sum holds before this one.
    pub accumulated: u32,
    /// Portals and mirrors that rays go through.
    pub portals: &'a [PortalRecord],
    /// Where everything was in the last frame.
    pub motion: MotionView,
    /// How samples of several frames become a picture.
    pub antialias: AntialiasView,
    /// What comes after tracing, and the ray counters.
    pub post: PostView,
    /// Storage image of the rays of each pixel, or `NO_IMAGE`.
    pub image_rays: u32,
}

impl ViewTracer {
    /// All parameters of a view's passes.
    pub(super) fn params(
        &self,
        rec: &mut Recorder,
        traced: &TracedView<'_>,
        prepared: &Prepared<'_>,
    ) -> Result<TraceView, Error> {
        let TracedView {
            scene: view,
            map,
            materials,
            settings,
            target,
        } = *traced;
        let &Prepared { targets, accel, .. } = prepared;
        let camera = &view.view;
        let lights = map.map_or(&self.no_lights, |m| m.lights);
        let flares = map.map_or_else(FlareTest::default, |m| m.flares);
        let [last_eye, last_forward, last_left, last_up] = self.history.unwrap_or([Vec3::ZERO; 4]);
        let [eye, forward, left, up] = camera_frame(view);
        Ok(TraceView {
            geometries: accel.geometries,
            instances: accel.instances,
            fogs: map.map_or(0, |m| m.geometry.fogs.address()),
            portals: rec.arena().push(prepared.portals)?,
            skies: map.map_or(0, |m| m.geometry.skies.address()),
            exposure: self.exposure_state.address(),
            texels: targets.texels.address(),
            bvh_nodes: accel.nodes,
            bvh_instances: accel.placed,
            flares: FlareView {
                flares: flares.flares,
                states: flares.states,
            },
            materials: materials.buffers(),
            post: prepared.post,
            image_rays: prepared.image_rays,
            motion: prepared.motion,
            antialias: prepared.antialias,
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
            flags: self.flags(settings, accel.first_person),
            seed: if settings.rt_accumulate {
                prepared.accumulated
            } else {
                self.frame
            },
            accumulated: prepared.accumulated,
            time: view.time,
            pixel_spread: pixel_spread(camera.tan_y, targets.height),
            ambient: lights.ambient * settings.rt_light_scale.max(0.0),
            transport: transport(rec, traced, eye)?,
            eye_absorption: map.map_or(Vec3::ZERO, |m| {
                m.geometry.surroundings.absorption(camera.origin)
            }),
            eye_shift: camera.stereo.slope / camera.tan_x,
            channels: self.channels,
            fog_count: map.map_or(0, |m| m.geometry.fog_count),
            portal_count: u32::try_from(prepared.portals.len()).unwrap_or(u32::MAX),
            flare_count: flares.count,
            sun: sun_disc(view),
            fog: self.fog.view(&targets.direct[0], &targets.composite),
            max_depth: settings.rt_max_depth,
            bounces: settings.rt_bounces.min(2),
            image_position: targets.position.storage_index(),
            image_surface: targets.surface.storage_index(),
            image_shown: targets.shown.storage_index(),
            image_other: targets.other.storage_index(),
            image_direct: targets.direct[0].storage_index(),
            image_indirect: targets.indirect.storage_index(),
            image_composite: targets.composite.storage_index(),
            image_accumulation: targets
                .accumulation
                .as_ref()
                .map_or(0, Image::storage_index),
            image_motion: targets.motion.storage_index(),
            image_target: target.storage_index(),
            exposure_bias: settings.rt_exposure,
            exposure_base: self.map_exposure.scale.log2(),
            exposure_middle: self.map_exposure.middle,
            exposure_blend: self.exposure_blend(view, settings, LIGHT_ADAPTATION),
            exposure_blend_dark: self.exposure_blend(view, settings, DARK_ADAPTATION),
            target_width: target.width(),
            target_height: target.height(),
            sky_sampler: materials.sky_sampler(),
            sky_distance: camera.sky_distance(),
            last_eye,
            last_forward,
            last_left,
            last_up,
            padding: 0,
            denoise: (self.denoiser).view(self.frame.wrapping_sub(1), &targets.texels),
        })
    }

    /// The bits `VIEW_*` of a view. `first_person`: there is something that only the eye sees.
    fn flags(&self, settings: &Settings, first_person: bool) -> u32 {
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
        set(t::VIEW_FAST_SKY, settings.fast_sky);
        set(t::VIEW_FULLBRIGHT, !is_lit);
        set(t::VIEW_DENOISE, self.denoiser.is_on());
        set(t::VIEW_SUBSAMPLED_BOUNCE, is_subsampled(settings));
        set(t::VIEW_HISTORY, self.history.is_some());
        flags
    }
}

/// The boxes that rays are held against: translucent layers, what lies behind skies, and surfaces that colour light.
fn transport(
    rec: &mut Recorder,
    traced: &TracedView<'_>,
    eye: Vec3,
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
        // rays start beside the eye
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
    let beyond = Beyond::of(view, eye, lens, geometry, materials);
    Ok(TransportView {
        filters: geometry.map_or(0, |g| g.surroundings.filters()),
        filter_count: geometry.map_or(0, |g| g.surroundings.filter_count()),
        layers,
        layer_count,
        beyond: rec.arena().push(&beyond.boxes)?,
        beyond_surfaces: rec.arena().push(&beyond.surfaces)?,
        beyond_count: u32::try_from(beyond.boxes.len()).unwrap_or(u32::MAX),
        beyond_surface_count: u32::try_from(32 * beyond.surfaces.len()).unwrap_or(u32::MAX),
    })
}

/// Eye, forward, and left and up scaled by the tangents of the half angles.
pub(super) fn camera_frame(view: &ViewScene) -> [Vec3; 4] {
    let camera = &view.view;
    let [forward, left, up] = camera.axis;
    [
        camera.origin + left * camera.stereo.offset(),
        forward,
        left * camera.tan_x,
        up * camera.tan_y,
    ]
}

/// The sun's picture where it is to be seen.
fn sun_disc(view: &ViewScene) -> SunDisc {
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
