//! From console variables to the renderer's settings.

use super::{Cvar, Cvars};
use crate::engine::Engine;
use renderer_vk::{LightSelection, MapLightChoice, Settings, TracerChoice, is_texture_mode};

/// What is decided when the window is opened, whatever the settings become: the engine's own renderer looks at them
/// there and no more.
#[derive(Clone, Copy, Debug, Default)]
pub struct WindowFacts {
    /// It fills the screen.
    pub fullscreen: bool,
    /// `r_gamma` works on the finished picture, not on textures (`r_ignorehwgamma 0`).
    pub gamma: bool,
}

/// A count: negative is 0.
fn count(cvars: &Cvars, cvar: Cvar) -> u32 {
    u32::try_from(cvars.integer(cvar)).unwrap_or(0)
}

/// `rt_lightSelection`: 0 uniform, 1 resampled.
fn light_selection(value: i32) -> LightSelection {
    match value {
        0 => LightSelection::Uniform,
        _ => LightSelection::Resampled,
    }
}

/// `rt_tracer`, whatever its case; `None` for anything that is no tracer's name.
fn tracer(name: &str) -> Option<TracerChoice> {
    let names = [
        ("auto", TracerChoice::Auto),
        ("pipeline", TracerChoice::Pipeline),
        ("query", TracerChoice::Query),
        ("compute", TracerChoice::Compute),
    ];
    let found = names.iter().find(|(n, _)| n.eq_ignore_ascii_case(name));
    found.map(|&(_, choice)| choice)
}

/// `rt_lights`, whatever its case: anything but `prior` is `calibrated`.
fn map_lights(name: &str) -> MapLightChoice {
    if name.eq_ignore_ascii_case("prior") {
        MapLightChoice::Prior
    } else {
        MapLightChoice::Calibrated
    }
}

/// Reads what counts from registration on, `rt_tracer`, and what is read later only when it changed. A name that is none is told and taken for `auto`.
pub fn apply_at_registration(cvars: &Cvars, settings: &mut Settings) {
    let name = cvars.string(Cvar::RtTracer);
    settings.rt_tracer = tracer(&name).unwrap_or_else(|| {
        log::warn!("rt_tracer {name}: not one of auto, pipeline, query, compute; auto is used");
        TracerChoice::Auto
    });
    settings.rt_lights = map_lights(&cvars.string(Cvar::RtLights));
    apply_color_tables(cvars, settings);
}

/// Reads what the engine's own renderer makes tables of when it starts and when `r_gamma` changes: games set these
/// variables, too, and mean the next start.
fn apply_color_tables(cvars: &Cvars, settings: &mut Settings) {
    settings.gamma = cvars.value(Cvar::Gamma).clamp(0.5, 3.0);
    settings.intensity = cvars.value(Cvar::Intensity).max(1.0);
    settings.overbright_bits = count(cvars, Cvar::OverBrightBits);
}

/// Reads every other setting. Cheap: the variables are the engine's memory; text is copied when it changed.
///
/// What depends on the window is as it was when the window was opened.
pub fn apply(cvars: &Cvars, window: WindowFacts, settings: &mut Settings) {
    let (value, flag, integer) = (|c| cvars.value(c), |c| cvars.flag(c), |c| cvars.integer(c));

    settings.rt = flag(Cvar::RayTrace);
    settings.rt_print_perf_stats = flag(Cvar::RtPrintPerfStats);
    settings.rt_illumination = flag(Cvar::RtIllumination);
    settings.rt_cull_lights = flag(Cvar::RtCullLights);
    settings.rt_num_random_dl = count(cvars, Cvar::RtNumRandomDL);
    settings.rt_light_selection = light_selection(integer(Cvar::RtLightSelection));
    settings.rt_candidates = count(cvars, Cvar::RtCandidates).max(1);
    settings.rt_pause = flag(Cvar::RtPause);
    settings.rt_accumulate = flag(Cvar::RtAccumulate);
    settings.rt_antialiasing = flag(Cvar::RtAntialiasing);
    settings.rt_soft_shadows = flag(Cvar::RtSoftShadows);
    settings.rt_dof = flag(Cvar::RtDof);
    settings.rt_aperture = value(Cvar::RtAperture).max(0.0);
    settings.rt_focal_length = value(Cvar::RtFocalLength).max(1.0);
    settings.rt_denoiser = count(cvars, Cvar::RtDenoiser).min(2);
    settings.rt_taa = flag(Cvar::RtTaa);
    settings.rt_scale = value(Cvar::RtScale).clamp(0.25, 1.0);
    settings.rt_max_depth = count(cvars, Cvar::RtMaxDepth);
    settings.rt_bounces = count(cvars, Cvar::RtBounces).min(2);
    settings.rt_bloom = value(Cvar::RtBloom).clamp(0.0, 1.0);
    settings.rt_flashlight = flag(Cvar::RtFlashlight);
    settings.rt_debug = count(cvars, Cvar::RtDebug);
    settings.rt_exposure = value(Cvar::RtExposure);
    settings.rt_auto_exposure = flag(Cvar::RtAutoExposure);
    settings.rt_light_scale = value(Cvar::RtLightScale).max(0.0);
    settings.rt_dlight_scale = value(Cvar::RtDlightScale).max(0.0);

    settings.picmip = count(cvars, Cvar::PicMip).min(16);
    settings.round_images_down = flag(Cvar::RoundImagesDown);
    settings.simple_mip_maps = flag(Cvar::SimpleMipMaps);
    settings.detail_textures = flag(Cvar::DetailTextures);
    settings.greyscale = value(Cvar::Greyscale).clamp(0.0, 1.0);
    settings.color_mip_levels = flag(Cvar::ColorMipLevels);
    settings.single_shader = flag(Cvar::SingleShader);
    settings.print_shaders = flag(Cvar::PrintShaders);
    settings.lightmap_heat = integer(Cvar::Lightmap) == 2;
    settings.anisotropy = if flag(Cvar::ExtTextureFilterAnisotropic) {
        value(Cvar::ExtMaxAnisotropy).max(1.0)
    } else {
        0.0
    };
    if cvars.modified(Cvar::RtLights) {
        settings.rt_lights = map_lights(&cvars.string(Cvar::RtLights));
        cvars.seen(Cvar::RtLights);
    }
    if cvars.modified(Cvar::TextureMode) {
        let mode = cvars.string(Cvar::TextureMode);
        if is_texture_mode(&mode) {
            settings.texture_mode = mode;
        } else {
            log::info!("bad filter name");
        }
        cvars.seen(Cvar::TextureMode);
    }
    settings.map_overbright_bits = count(cvars, Cvar::MapOverBrightBits);
    settings.ignore_hw_gamma = !window.gamma;
    settings.fullscreen = window.fullscreen;
    settings.vertex_light = flag(Cvar::VertexLight);
    settings.ui_fullscreen = flag(Cvar::UiFullscreen);
    settings.fullbright = flag(Cvar::FullBright);
    settings.subdivisions = value(Cvar::Subdivisions);

    if cvars.modified(Cvar::Gamma) {
        apply_color_tables(cvars, settings);
        cvars.seen(Cvar::Gamma);
    }
    settings.swap_interval = integer(Cvar::SwapInterval);
    settings.lod_bias = integer(Cvar::LodBias);
    settings.lod_scale = value(Cvar::LodScale);
    settings.lod_curve_error = value(Cvar::LodCurveError);
    settings.znear = value(Cvar::ZNear).max(0.001);
    settings.fast_sky = flag(Cvar::FastSky);
    settings.draw_sun = flag(Cvar::DrawSun);
    settings.dynamic_light = flag(Cvar::DynamicLight);
    settings.flares = flag(Cvar::Flares);
    settings.flare_size = value(Cvar::FlareSize);
    settings.flare_fade = value(Cvar::FlareFade);
    settings.flare_coefficient = value(Cvar::FlareCoeff);
    settings.shadows = integer(Cvar::Shadows);
    settings.multisample = count(cvars, Cvar::ExtMultisample);
    settings.anaglyph = count(cvars, Cvar::AnaglyphMode);
    settings.stereo_separation = value(Cvar::StereoSeparation);
    settings.convergence = value(Cvar::ZProj);
    settings.draw_world = flag(Cvar::DrawWorld);
    settings.draw_entities = flag(Cvar::DrawEntities);
    settings.no_vis = flag(Cvar::NoVis);
    settings.lock_pvs = flag(Cvar::LockPvs);
    settings.no_cull = flag(Cvar::NoCull);
    settings.no_curves = flag(Cvar::NoCurves);
    // r_fastsky 1 takes the portals away as well, any higher value keeps them.
    settings.no_portals = flag(Cvar::NoPortals) || integer(Cvar::FastSky) == 1;
    settings.portal_only = flag(Cvar::PortalOnly);
    settings.no_refresh = flag(Cvar::NoRefresh);
    settings.skip_back_end = flag(Cvar::SkipBackEnd);
    settings.face_plane_cull = flag(Cvar::FacePlaneCull);
    settings.debug_sort = integer(Cvar::DebugSort);
    settings.show_cluster = integer(Cvar::Showcluster);
    settings.debug_light = flag(Cvar::Debuglight);
    settings.no_bind = flag(Cvar::Nobind);
    settings.show_normals = flag(Cvar::Shownormals);
    settings.show_sky = flag(Cvar::Showsky);
    settings.show_images = integer(Cvar::ShowImages);
    settings.dlight_backs = flag(Cvar::DlightBacks);
    settings.clear = flag(Cvar::Clear);
    settings.show_tris = flag(Cvar::ShowTris);
    settings.lightmap = flag(Cvar::Lightmap);
    settings.measure_overdraw = flag(Cvar::MeasureOverdraw);
    settings.speeds = integer(Cvar::Speeds);
    settings.ambient_scale = value(Cvar::AmbientScale);
    settings.directed_scale = value(Cvar::DirectedScale);
    settings.rail_width = value(Cvar::RailWidth);
    settings.rail_core_width = value(Cvar::RailCoreWidth);
    settings.rail_segment_length = value(Cvar::RailSegmentLength);
    settings.marks_on_triangle_meshes = flag(Cvar::MarksOnTriangleMeshes);
    settings.offset_factor = value(Cvar::OffsetFactor);
    settings.offset_units = value(Cvar::OffsetUnits);
}

/// Writes limits back to variables that menus show: `r_gamma` within 0.5 and 3, `r_intensity` at least 1.
pub fn write_back_clamps(engine: Engine, cvars: &Cvars) {
    if cvars.value(Cvar::Gamma) < 0.5 {
        cvars.set(engine, Cvar::Gamma, "0.5");
    } else if cvars.value(Cvar::Gamma) > 3.0 {
        cvars.set(engine, Cvar::Gamma, "3");
    }
    if cvars.value(Cvar::Intensity) < 1.0 {
        cvars.set(engine, Cvar::Intensity, "1");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_selection_takes_its_documented_numbers() {
        assert_eq!(light_selection(0), LightSelection::Uniform);
        assert_eq!(light_selection(1), LightSelection::Resampled);
    }

    #[test]
    fn tracers_go_by_their_documented_names() {
        assert_eq!(tracer("auto"), Some(TracerChoice::Auto));
        assert_eq!(tracer("Pipeline"), Some(TracerChoice::Pipeline));
        assert_eq!(tracer("query"), Some(TracerChoice::Query));
        assert_eq!(tracer("COMPUTE"), Some(TracerChoice::Compute));
        assert_eq!(tracer(""), None);
        assert_eq!(tracer("gpu"), None);
    }
}
