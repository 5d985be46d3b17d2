//! The renderer's settings. A setting is a row of the table below, from which macros generate the field of [`Settings`]
//! and its default, the console variable of a front end, the key of accumulation, `docs/src/settings`, and the values of
//! the command line.

mod choices;
mod presets;
mod row;
mod value;

use std::hash::Hasher;

pub use choices::{
    Anaglyph, DebugOutput, DenoiserChoice, HdrChoice, HitFeedback, LightSelection, Look,
    LowLatency, MapLightChoice, ModelShadows, TextureMode, TracerChoice,
};
pub use presets::{PRESETS, Preset};
use row::written_back;
pub use row::{Accumulation, Kind, Range, Reading, Row, SettingError, Spec, flags, kept};
pub use value::Given;
use value::Value;

use Accumulation::{GoesOn, Restarts};
use Reading::{Frame, Start, With};
use flags::{ARCHIVE, CHEAT, LATCH, NONE, TEMP};

/// Most bounces of `rt_bounces`.
pub const MOST_BOUNCES: u32 = 16;

macro_rules! settings {
    (
        variables { $( $field:ident: $type:ty = $name:literal, $default:literal, $flags:expr, $range:expr, $reading:expr,
            $accumulation:expr, $help:literal; )* }
        others { $( $(#[$doc:meta])* $other:ident: $other_type:ty = $value:expr; )* }
    ) => {
        /// All settings.
        #[derive(Clone, Debug, PartialEq)]
        pub struct Settings {
            $( #[doc = concat!("`", $name, "`: ", $help)] pub $field: $type, )*
            $( $(#[$doc])* pub $other: $other_type, )*
        }

        /// The table of settings.
        pub static ROWS: &[Row] = &[$( Row {
            spec: Spec {
                name: $name,
                kind: <$type as Value>::KIND,
                default: $default,
                flags: $flags,
                range: $range,
                help: $help,
            },
            reading: $reading,
            accumulation: $accumulation,
            put: |settings, given| settings.$field.put(given),
            text: |settings| settings.$field.text(),
        } ),*];

        /// Defaults.
        impl Default for Settings {
            fn default() -> Self {
                Self {
                    $( $field: Value::default_of($default), )*
                    $( $other: $value, )*
                }
            }
        }

        impl Settings {
            /// Hashes the settings whose change restarts accumulation.
            pub fn accumulation_key(&self, hasher: &mut impl Hasher) {
                $( if $accumulation == Restarts {
                    hasher.write_u32(self.$field.bits());
                } )*
            }
        }
    };
}

// Columns: field, type, console variable, default, flags, limits, when it is read, effect of a change on accumulation,
// help with the unit.
#[rustfmt::skip] // one row, one line
settings! { variables {
    // the engine's settings, with their names, defaults and flags
    swap_interval: i32 = "r_swapInterval", "0", ARCHIVE | LATCH, None, Frame, GoesOn, "1 waits for the display's vertical retrace.";
    multisample: u32 = "r_ext_multisample", "0", ARCHIVE | LATCH, kept(0.0, 4.0), Frame, GoesOn, "Samples of a pixel, for smooth edges; the next number that the device has. The traced look has none.";
    anaglyph: Anaglyph = "r_anaglyphMode", "0", ARCHIVE, None, Frame, GoesOn, "Stereo through coloured glasses: 1 red-cyan, 2 red-blue, 3 red-green, 4 green-magenta; 5 to 8 the same, eyes swapped.";
    stereo_separation: f32 = "r_stereoSeparation", "64", ARCHIVE, None, Frame, GoesOn, "Convergence distance over the distance of an eye from the middle; negative swaps the eyes.";
    convergence: f32 = "r_zproj", "64", ARCHIVE, None, Frame, GoesOn, "Distance at which both eyes' pictures meet.";
    znear: f32 = "r_znear", "4", CHEAT, kept(0.001, 200.0), Frame, GoesOn, "Distance of the near plane in units.";
    anisotropic_filter: bool = "r_ext_texture_filter_anisotropic", "0", ARCHIVE | LATCH, None, Frame, GoesOn, "1 samples textures anisotropically.";
    max_anisotropy: f32 = "r_ext_max_anisotropy", "2", ARCHIVE | LATCH, None, Frame, GoesOn, "Highest degree of anisotropic sampling.";
    texture_mode: TextureMode = "r_textureMode", "GL_LINEAR_MIPMAP_LINEAR", ARCHIVE, None, With("r_textureMode"), Restarts, "Texture filter under its OpenGL name, GL_NEAREST to GL_LINEAR_MIPMAP_LINEAR.";
    picmip: u32 = "r_picmip", "1", ARCHIVE | LATCH, kept(0.0, 16.0), Frame, GoesOn, "How often textures are halved when they are loaded.";
    round_images_down: bool = "r_roundImagesDown", "1", ARCHIVE | LATCH, None, Frame, GoesOn, "1 shrinks textures of odd sizes to a power of two, 0 enlarges them.";
    color_mip_levels: bool = "r_colorMipLevels", "0", LATCH, None, Frame, GoesOn, "1 tints smaller mip levels red, green and blue in turn.";
    simple_mip_maps: bool = "r_simpleMipMaps", "1", ARCHIVE | LATCH, None, Frame, GoesOn, "1 averages 2x2 pixels for mip levels, 0 filters wider.";
    own_specular: bool = "r_specMode", "0", ARCHIVE, None, Frame, GoesOn, "alphaGen lightingSpecular on models: 0 reflects a light at (-960, 1980, 96), 1 the grid's light, as OpenArena's engine.";
    detail_textures: bool = "r_detailtextures", "1", ARCHIVE | LATCH, None, Frame, GoesOn, "0 leaves detail stages of materials out.";
    detail_fade: bool = "r_detailFade", "0", ARCHIVE | LATCH, None, Frame, GoesOn, "1 fades detail stages to grey, as OpenArena's engine does.";
    intensity: f32 = "r_intensity", "1", LATCH, written_back(1.0, f32::MAX), With("r_gamma"), GoesOn, "Multiplies textures; 1 or more.";
    gamma: f32 = "r_gamma", "1", ARCHIVE, written_back(0.5, 3.0), With("r_gamma"), GoesOn, "Brightness of the display, 0.5 to 3.";
    overbright_bits: u32 = "r_overBrightBits", "1", ARCHIVE | LATCH, None, With("r_gamma"), GoesOn, "Doublings of light beyond white in the classic look, in full screen.";
    map_overbright_bits: u32 = "r_mapOverBrightBits", "2", LATCH, None, Frame, GoesOn, "Doublings that the map's lightmaps are meant to get in the classic look.";
    greyscale: f32 = "r_greyscale", "0", ARCHIVE | LATCH, kept(0.0, 1.0), Frame, GoesOn, "0 coloured to 1 grey: takes colour out of textures and light.";
    vertex_light: bool = "r_vertexLight", "0", ARCHIVE | LATCH, None, Frame, GoesOn, "1 lights the classic look by vertex colours instead of lightmaps.";
    fullbright: bool = "r_fullbright", "0", LATCH | CHEAT, None, Frame, Restarts, "1 draws the classic look without lightmaps, the traced look without light.";
    lightmap: i32 = "r_lightmap", "0", NONE, None, Frame, GoesOn, "1 shows lightmaps alone in the classic look; 2, when a map is loaded, as colours by brightness.";
    single_shader: bool = "r_singleShader", "0", LATCH | CHEAT, None, Frame, GoesOn, "1 shows the default material on every surface of the map but the sky.";
    subdivisions: f32 = "r_subdivisions", "4", ARCHIVE | LATCH, None, Frame, GoesOn, "Largest deviation of curved surfaces in units; smaller is smoother.";
    lod_curve_error: f32 = "r_lodCurveError", "250", ARCHIVE | CHEAT, None, Frame, GoesOn, "Distance scale of the detail of curved surfaces in the classic look.";
    lod_bias: i32 = "r_lodbias", "0", ARCHIVE, None, Frame, GoesOn, "Added to the level of detail of models; higher is coarser.";
    lod_scale: f32 = "r_lodscale", "5", CHEAT, None, Frame, GoesOn, "Scales the level of detail of models by their size on screen.";
    flares: bool = "r_flares", "0", ARCHIVE, None, Frame, GoesOn, "1 draws light flares.";
    flare_size: f32 = "r_flareSize", "40", CHEAT, None, Frame, GoesOn, "Size of far flares, of a window 640 pixels wide.";
    flare_fade: f32 = "r_flareFade", "7", CHEAT, None, Frame, GoesOn, "How often in a second a flare could appear or go.";
    flare_coefficient: f32 = "r_flareCoeff", "150", CHEAT, None, Frame, GoesOn, "How bright flares stay with distance.";
    fast_sky: i32 = "r_fastsky", "0", ARCHIVE, None, Frame, Restarts, "1 draws no sky and no portals, 2 keeps the portals.";
    draw_sun: bool = "r_drawSun", "0", ARCHIVE, None, Frame, GoesOn, "1 draws the sun's disc in the sky.";
    dynamic_light: bool = "r_dynamiclight", "1", ARCHIVE, None, Frame, Restarts, "0 ignores lights of explosions, missiles and items.";
    dlight_backs: bool = "r_dlightBacks", "1", ARCHIVE, None, Frame, GoesOn, "0 keeps dynamic light off faces turned away from it.";
    dlight_mode: u32 = "r_dlightMode", "0", ARCHIVE, kept(0.0, 2.0), Frame, GoesOn, "Dynamic lights of the classic look: 0 spots as in Quake III, 1 per pixel as in Quake3e, 2 also on models.";
    dlight_scale: f32 = "r_dlightScale", "0.5", ARCHIVE, kept(0.1, 1.0), Frame, GoesOn, "Multiplies the radius of dynamic lights with r_dlightMode 1 and 2.";
    dlight_intensity: f32 = "r_dlightIntensity", "1", ARCHIVE, kept(0.1, 1.0), Frame, GoesOn, "Multiplies the colour of dynamic lights with r_dlightMode 1 and 2.";
    dlight_specular_power: f32 = "r_dlightSpecPower", "8", ARCHIVE, kept(1.0, 32.0), Frame, GoesOn, "Exponent of dynamic lights' highlights with r_dlightMode 1 and 2.";
    dlight_specular: f32 = "r_dlightSpecColor", "-0.25", ARCHIVE, kept(-1.0, 1.0), Frame, GoesOn, "Reflectance of these highlights; negative: factor of the surface's texture.";
    normal_mapping: bool = "r_normalMapping", "0", ARCHIVE | LATCH, None, Frame, GoesOn, "1 shows normal maps in the classic look.";
    specular_mapping: bool = "r_specularMapping", "0", ARCHIVE | LATCH, None, Frame, GoesOn, "1 shows highlights of rough surfaces in the classic look.";
    parallax_mapping: u32 = "r_parallaxMapping", "0", ARCHIVE | LATCH, None, Frame, Restarts, "1 shows normal maps' heights, 2 finer.";
    face_plane_cull: bool = "r_facePlaneCull", "1", ARCHIVE, None, Frame, GoesOn, "0 draws flat surfaces that face away from the camera, too; they stay invisible.";
    rail_width: f32 = "r_railWidth", "16", ARCHIVE, None, Frame, GoesOn, "Diameter of the rings of a rail trail.";
    rail_core_width: f32 = "r_railCoreWidth", "6", ARCHIVE, None, Frame, GoesOn, "Half width of the core of a rail trail.";
    rail_segment_length: f32 = "r_railSegmentLength", "32", ARCHIVE, None, Frame, GoesOn, "Distance between the rings of a rail trail.";
    ambient_scale: f32 = "r_ambientScale", "0.6", CHEAT, None, Frame, GoesOn, "Multiplies the ambient light of models in the classic look.";
    directed_scale: f32 = "r_directedScale", "1", CHEAT, None, Frame, GoesOn, "Multiplies the directed light of models in the classic look.";
    marks_on_triangle_meshes: bool = "r_marksOnTriangleMeshes", "0", ARCHIVE, None, Frame, GoesOn, "1 puts bullet marks on detail meshes of the map, too.";
    shadows: ModelShadows = "cg_shadows", "1", NONE, None, Frame, GoesOn, "Shadows of models in the classic look: 0 none, 1 spot, 2 volumes, 3 planar.";
    ui_fullscreen: bool = "r_uifullscreen", "0", NONE, None, Frame, GoesOn, "Set by the engine while a menu covers the game.";
    offset_factor: f32 = "r_offsetfactor", "-1", CHEAT, None, Frame, GoesOn, "Depth offset of decals by their slope in the classic look.";
    offset_units: f32 = "r_offsetunits", "-2", CHEAT, None, Frame, GoesOn, "Constant depth offset of decals in the classic look.";
    print_shaders: bool = "r_printShaders", "0", NONE, None, Frame, GoesOn, "1 prints the name of each script that is used when it is registered.";
    no_curves: bool = "r_nocurves", "0", CHEAT, None, Frame, GoesOn, "1 draws no curved surfaces.";
    draw_world: bool = "r_drawworld", "1", CHEAT, None, Frame, GoesOn, "0 draws no map.";
    draw_entities: bool = "r_drawentities", "1", CHEAT, None, Frame, GoesOn, "0 draws no entities.";
    portal_only: bool = "r_portalOnly", "0", CHEAT, None, Frame, GoesOn, "1 draws what a portal or mirror in sight shows, and nothing before it.";
    no_portals: bool = "r_noportals", "0", CHEAT, None, Frame, Restarts, "1 draws no portals and mirrors.";
    skip_back_end: bool = "r_skipBackEnd", "0", CHEAT, None, Frame, GoesOn, "1 draws nothing and takes no pictures.";
    no_refresh: bool = "r_norefresh", "0", CHEAT, None, Frame, GoesOn, "1 leaves out 3D views.";
    measure_overdraw: bool = "r_measureOverdraw", "0", CHEAT, None, Frame, GoesOn, "1 counts how often a pixel is drawn in the classic look: the last number of r_speeds 1.";
    no_bind: bool = "r_nobind", "0", CHEAT, None, Frame, GoesOn, "1 draws everything with one texture, the spot of dynamic lights.";
    show_tris: bool = "r_showtris", "0", CHEAT, None, Frame, GoesOn, "1 shows triangle edges in the classic look.";
    show_normals: bool = "r_shownormals", "0", CHEAT, None, Frame, GoesOn, "1 shows the normals of vertices in the classic look.";
    show_sky: bool = "r_showsky", "0", CHEAT, None, Frame, GoesOn, "1 draws the sky before everything.";
    clear: bool = "r_clear", "0", CHEAT, None, Frame, GoesOn, "1 clears the picture to pink each frame.";
    show_images: i32 = "r_showImages", "0", TEMP, None, Frame, GoesOn, "1 shows all images on a grid, 2 in proportion to their sizes.";
    debug_light: bool = "r_debuglight", "0", TEMP, None, Frame, GoesOn, "1 prints the light on the first-person weapon.";
    debug_sort: i32 = "r_debugSort", "0", CHEAT, None, Frame, GoesOn, "Leaves out materials of a greater sort value; 0 draws all.";
    speeds: i32 = "r_speeds", "0", CHEAT, None, Frame, GoesOn, "1 to 6 print counts of each frame: surfaces, culling, cluster, dynamic lights, far plane, flares.";
    lock_pvs: bool = "r_lockpvs", "0", CHEAT, None, Frame, GoesOn, "1 keeps the visible part of the map as it is.";
    no_vis: bool = "r_novis", "0", CHEAT, None, Frame, GoesOn, "1 ignores the map's visibility.";
    no_cull: bool = "r_nocull", "0", CHEAT, None, Frame, GoesOn, "1 draws what is out of view as well.";
    show_cluster: i32 = "r_showcluster", "0", CHEAT, None, Frame, GoesOn, "1 prints the cluster and area of the camera when they change.";
    // settings of this renderer
    rt: Look = "r_rt", "0", ARCHIVE, kept(0.0, 2.0), Frame, GoesOn, "0 draws the classic look, 1 traces light with rays, 2 adds traced shadows and reflections to 0. Switches at once.";
    low_latency: LowLatency = "r_lowLatency", "2", ARCHIVE, kept(0.0, 2.0), Frame, GoesOn, "Frames that may wait for GPU and display: 0 two, 1 one; 2 also keeps the engine until the GPU needs its next frame.";
    rt_tracer: TracerChoice = "rt_tracer", "auto", ARCHIVE | LATCH, None, Start, GoesOn, "What follows the rays: auto, pipeline, query, compute or grid. A device without it gets what auto picks.";
    rt_grid_cells: u32 = "rt_gridCells", "0", ARCHIVE | LATCH, kept(0.0, 256.0), Start, GoesOn, "Cells of rt_tracer grid along the map's longest side; 0 picks them.";
    rt_lights: MapLightChoice = "rt_lights", "calibrated", ARCHIVE, None, With("rt_lights"), Restarts, "Lights of the map: calibrated, fitted to the light that its compiler stored, or prior, as its directives say. Switches at once.";
    rt_print_perf_stats: bool = "rt_printPerfStats", "0", ARCHIVE, kept(0.0, 1.0), Frame, GoesOn, "1 prints times, rays and memory of the traced look each second.";
    rt_illumination: bool = "rt_illumination", "1", ARCHIVE, kept(0.0, 1.0), Frame, Restarts, "0 shows surfaces in their own colour, without light.";
    rt_cull_lights: bool = "rt_cullLights", "1", ARCHIVE, kept(0.0, 1.0), Frame, Restarts, "0 samples among all lights of the map, not those that may reach a point: same picture, slower.";
    rt_num_random_dl: u32 = "rt_numRandomDL", "1", ARCHIVE, kept(0.0, 64.0), Frame, Restarts, "Lights picked at random for each pixel and frame, each with a shadow ray; 0 samples all that may reach the point.";
    rt_samples: u32 = "rt_samples", "1", ARCHIVE, kept(1.0, 8.0), Frame, Restarts, "Samples of light in each frame, direct and bounced: more leave less noise and trace more rays.";
    rt_light_selection: LightSelection = "rt_lightSelection", "1", ARCHIVE, kept(0.0, 3.0), Frame, Restarts, "How a random light is picked: 0 uniformly, 1 resampled by importance, 2 the same from a tree, 3 the same with samples of other pixels and frames (ReSTIR). Same picture in the mean.";
    rt_blue_noise: bool = "rt_blueNoise", "0", ARCHIVE, kept(0.0, 1.0), Frame, Restarts, "1 spreads the noise of light evenly over the picture, as blue noise. Same picture in the mean.";
    rt_candidates: u32 = "rt_candidates", "8", ARCHIVE, kept(1.0, 64.0), Frame, Restarts, "Lights looked at for each pick; without effect with rt_lightSelection 0.";
    rt_pause: bool = "rt_pause", "0", NONE, kept(0.0, 1.0), Frame, GoesOn, "1 keeps what the traced look shows still: view, entities and time. The game goes on.";
    rt_accumulate: bool = "rt_accumulate", "0", ARCHIVE, kept(0.0, 1.0), Frame, GoesOn, "1 averages unfiltered frames while nothing moves, towards the exact picture; with rt_pause 1 also in a running game.";
    rt_antialiasing: bool = "rt_antialiasing", "1", ARCHIVE, kept(0.0, 1.0), Frame, Restarts, "1 moves the traced points within their pixels from frame to frame, for smooth edges.";
    rt_soft_shadows: bool = "rt_softshadows", "1", ARCHIVE, kept(0.0, 1.0), Frame, Restarts, "0 takes each light at its middle: sharp shadows.";
    rt_dof: bool = "rt_dof", "0", ARCHIVE, kept(0.0, 1.0), Frame, Restarts, "1 gives the camera a lens: what is out of focus is blurred.";
    rt_aperture: f32 = "rt_aperture", "4", ARCHIVE, kept(0.0, 256.0), Frame, Restarts, "Diameter of the lens of rt_dof in units.";
    rt_focal_length: f32 = "rt_focallength", "256", ARCHIVE, kept(1.0, 65536.0), Frame, Restarts, "Distance in units that is sharp with rt_dof.";
    rt_cutouts: u32 = "rt_cutouts", "0", ARCHIVE, kept(0.0, 3.0), Frame, Restarts, "What rays of bounces meet at surfaces with holes: 0 their holes, 1 none, 2 by chance none or no surface, 3 holes of a simple pattern.";
    rt_first_hits: bool = "rt_firstHits", "0", ARCHIVE, kept(0.0, 1.0), Frame, Restarts, "1 finds the first surface of each pixel by the rasterizer in place of rays; not with rt_dof, nor with smooth edges of rt_accumulate.";
    rt_denoiser: DenoiserChoice = "rt_denoiser", "1", ARCHIVE, kept(0.0, 2.0), Frame, GoesOn, "Filter for traced light: 0 none, 1 A-SVGF, 2 a cheaper sparse filter.";
    rt_taa: bool = "rt_taa", "1", ARCHIVE, kept(0.0, 1.0), Frame, GoesOn, "1 smooths edges over time.";
    rt_taa_rays: u32 = "rt_taaRays", "0", ARCHIVE, kept(0.0, 8.0), Frame, GoesOn, "More rays for each pixel without a history in rt_taa; 0 none.";
    rt_taa_maximum: f32 = "rt_taaMaximum", "0", ARCHIVE, kept(0.0, 0.98), Frame, GoesOn, "Smooths the greatest luminance of rt_taa's colour range over time: weight of the last frame's; 0 takes each frame's own.";
    rt_scale: f32 = "rt_scale", "1", ARCHIVE, kept(0.25, 1.0), Frame, GoesOn, "Width and height of the traced picture over those of the window.";
    rt_sharpness: f32 = "rt_sharpness", "0", ARCHIVE, kept(0.0, 1.0), Frame, GoesOn, "Sharpens the picture of rt_taa or rt_scale: 0 none, 1 most.";
    rt_max_depth: u32 = "rt_maxDepth", "4", ARCHIVE, kept(0.0, 16.0), Frame, Restarts, "Mirrors and panes of glass that a view ray may pass.";
    rt_specular: bool = "rt_specular", "1", ARCHIVE, None, Frame, Restarts, "1 shows roughness, metal and normal maps, 0 shows such surfaces as diffuse.";
    rt_caustics: bool = "rt_caustics", "0", ARCHIVE, kept(0.0, 1.0), Frame, Restarts, "1 refracts light in water and solid glass, by photons, with rt_accumulate.";
    rt_bounces: u32 = "rt_bounces", "1", ARCHIVE, kept(0.0, MOST_BOUNCES as f32), Frame, Restarts, "Bounces of light from surface to surface, matt or mirror. Few maps need more than 1.";
    rt_bounce_screen: u32 = "rt_bounceScreen", "0", ARCHIVE, kept(0.0, 256.0), Frame, GoesOn, "Steps of a bounce ray through the last frame's picture, whose light it takes where it hits; 0 only traces.";
    rt_bounce_thickness: f32 = "rt_bounceThickness", "2", ARCHIVE, kept(0.125, 64.0), Frame, GoesOn, "Thickness of surfaces for rt_bounceScreen, widths of a pixel.";
    rt_bounce_adaptive: u32 = "rt_bounceAdaptive", "16", ARCHIVE, kept(0.0, 28.0), Frame, GoesOn, "Frames after which a pixel at rest traces bounces seldom, with rt_denoiser 1; 0 always traces.";
    rt_foveation: f32 = "rt_foveation", "0", ARCHIVE, kept(0.0, 1.0), Frame, GoesOn, "Part of the samples of rt_bounceAdaptive that the corners of the picture save.";
    rt_share_eyes: bool = "rt_shareEyes", "0", ARCHIVE, kept(0.0, 1.0), Frame, GoesOn, "1 lets the second eye of r_anaglyphMode take bounced light from the first.";
    rt_bounce_roulette: bool = "rt_bounceRoulette", "0", ARCHIVE, kept(0.0, 1.0), Frame, Restarts, "1 ends paths of bounces where they have found light. Same picture in the mean.";
    rt_bounce_ambient: f32 = "rt_bounceAmbient", "0", ARCHIVE, kept(0.0, 4.0), Frame, Restarts, "Light of further bounces at the last one: this part of the map's light grid; 0 none.";
    rt_bounce_ambient_fall: f32 = "rt_bounceAmbientFall", "0", ARCHIVE, kept(0.0, 1.0), Frame, Restarts, "Exponential decrease of rt_bounceAmbient with the length of the last ray, 1/unit.";
    rt_hit_feedback: HitFeedback = "rt_hitFeedback", "0", ARCHIVE, kept(0.0, 2.0), Frame, GoesOn, "1 refits models that few rays meet seldom, and leaves them out where no ray passes; 2 only counts rays, for statistics.";
    rt_bounce_cache: u32 = "rt_bounceCache", "0", ARCHIVE, kept(0.0, 64.0), Frame, Restarts, "Light samples of each vertex of the map in each sweep when it is first shown; bounces that hit the map take their light. 0 none.";
    rt_exposure: f32 = "rt_exposure", "0", ARCHIVE, kept(-16.0, 16.0), Frame, GoesOn, "Exposure in stops, added to the automatic one.";
    rt_auto_exposure: bool = "rt_autoExposure", "1", ARCHIVE, kept(0.0, 1.0), Frame, GoesOn, "1 adapts the exposure to the picture.";
    rt_bloom: f32 = "rt_bloom", "0.05", ARCHIVE, kept(0.0, 1.0), Frame, GoesOn, "Part of the light that spreads around bright things; 0 none.";
    hdr: HdrChoice = "rt_hdr", "0", ARCHIVE | LATCH, kept(0.0, 3.0), Frame, GoesOn, "Output for displays that are brighter than white: 0 none, 1 what the display offers, 2 HDR10, 3 scRGB.";
    hdr_white: f32 = "rt_hdrWhite", "203", ARCHIVE, kept(80.0, 500.0), Frame, GoesOn, "Brightness of white with rt_hdr in cd/m2.";
    hdr_peak: f32 = "rt_hdrPeak", "800", ARCHIVE, kept(200.0, 10000.0), Frame, GoesOn, "Brightest light with rt_hdr in cd/m2: that of the display.";
    rt_flashlight: bool = "rt_flashlight", "0", ARCHIVE, kept(0.0, 1.0), Frame, Restarts, "1 carries a lamp at the camera.";
    rt_light_scale: f32 = "rt_lightScale", "1", ARCHIVE, kept(0.0, 100.0), Frame, Restarts, "Multiplies every light of the map when it is traced.";
    rt_dlight_scale: f32 = "rt_dlightScale", "1", ARCHIVE, kept(0.0, 100.0), Frame, Restarts, "Multiplies lights of explosions, missiles and items when they are traced.";
    rt_debug: DebugOutput = "rt_debug", "0", NONE, kept(0.0, 13.0), Frame, GoesOn, "Shows a step of the traced look: 1 albedo, 2 normals, 3 depth, 4 motion, 5 clusters, 6 lights per pixel, 7 samples, 8 variance, 9 gradients, 10 rays per pixel, 11 reflections, 12 time, 13 time of rays.";

} others {
    /// Temporal gradients of A-SVGF. Measurements compare with them off.
    rt_gradients: bool = true;
    /// Number of the first accumulated frame: its random numbers are those of this frame of a longer mean, so that several
    /// devices can share it.
    rt_first_frame: u32 = 0;
    /// Whether the window filled the screen when it was opened (`r_fullscreen`).
    fullscreen: bool = false;
    /// `r_ignorehwgamma` when the window was opened: gamma is applied to textures instead of to the finished picture.
    ignore_hw_gamma: bool = false;
} }

/// The row of a console variable; case is ignored.
pub fn row(name: &str) -> Option<&'static Row> {
    ROWS.iter()
        .find(|row| row.spec.name.eq_ignore_ascii_case(name))
}

impl Settings {
    /// Defaults with textures of full size, for pictures without a player: the engine's default of `r_picmip` halves
    /// textures.
    pub fn full_size() -> Self {
        Self {
            picmip: 0,
            ..Self::default()
        }
    }

    /// Degree of anisotropic sampling of textures; 0: none.
    pub fn anisotropy(&self) -> f32 {
        match self.anisotropic_filter {
            true => self.max_anisotropy.max(1.0),
            false => 0.0,
        }
    }

    /// Whether the classic look shows normal maps or highlights.
    pub fn shows_surface_mapping(&self) -> bool {
        self.normal_mapping || self.specular_mapping
    }

    /// Whether the sky is not drawn.
    pub fn hides_sky(&self) -> bool {
        self.fast_sky != 0
    }

    /// Whether portals and mirrors are not drawn.
    pub fn hides_portals(&self) -> bool {
        self.no_portals || self.fast_sky == 1
    }

    /// Effective overbright bits: only a full-screen window with a gamma ramp doubles displayed colours.
    pub fn effective_overbright_bits(&self) -> u32 {
        if self.ignore_hw_gamma || !self.fullscreen {
            0
        } else {
            self.overbright_bits.min(2)
        }
    }

    /// Gamma of presentation.
    pub fn display_gamma(&self) -> f32 {
        if self.ignore_hw_gamma {
            1.0
        } else {
            self.gamma
        }
    }

    /// Gamma of images at load.
    pub fn software_gamma(&self) -> f32 {
        if self.ignore_hw_gamma {
            self.gamma
        } else {
            1.0
        }
    }

    /// Brightness that shows as white; the engine calls it identity light.
    pub fn identity_light(&self) -> f32 {
        1.0 / (1 << self.effective_overbright_bits()) as f32
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::hash::DefaultHasher;

    fn key(settings: &Settings) -> u64 {
        let mut hasher = DefaultHasher::new();
        settings.accumulation_key(&mut hasher);
        hasher.finish()
    }

    #[test]
    fn the_key_changes_with_the_settings_that_restart_accumulation() {
        let default = Settings::default();
        for row in ROWS {
            let name = row.spec.name;
            let values: &[&str] = match row.spec.kind {
                Kind::Name(names) => names,
                _ => &["0", "1", "2"],
            };
            let changed = values.iter().find_map(|value| {
                let mut settings = default.clone();
                assert_eq!(row.put(&mut settings, &Given::parse(value)), Ok(()));
                (settings != default).then_some(settings)
            });
            let changed = changed.unwrap_or_else(|| panic!("{name} sets nothing"));
            let restarts = row.accumulation == Restarts;
            assert_eq!(key(&changed) != key(&default), restarts, "{name}");
        }
    }

    #[test]
    fn defaults_are_values_within_the_limits() {
        for row in ROWS {
            assert_eq!(row.check(row.spec.default), Ok(()));
            let mut settings = Settings::default();
            assert_eq!(
                row.put(&mut settings, &Given::parse(row.spec.default)),
                Ok(())
            );
            assert_eq!(settings, Settings::default(), "{}", row.spec.name);
        }
    }

    #[test]
    fn the_text_of_a_value_is_read_as_the_value() {
        for row in ROWS {
            let names = match row.spec.kind {
                Kind::Name(names) => names.to_vec(),
                _ => vec!["0", "1", "2", "0.5", "3"],
            };
            for value in names {
                let mut settings = Settings::default();
                assert_eq!(row.put(&mut settings, &Given::parse(value)), Ok(()));
                let text = row.text(&settings);
                let mut again = Settings::default();
                assert_eq!(row.put(&mut again, &Given::parse(&text)), Ok(()));
                assert_eq!(again, settings, "{} {value}: {text}", row.spec.name);
            }
        }
    }

    #[test]
    fn rows_that_are_read_together_name_a_row() {
        for row in ROWS {
            if let With(name) = row.reading {
                assert!(super::row(name).is_some(), "{name}");
            }
        }
    }

    #[test]
    fn numbers_are_brought_within_the_limits() {
        let mut settings = Settings::default();
        let mut put = |name, value| {
            let put = row(name).unwrap().put(&mut settings, &Given::parse(value));
            assert_eq!(put, Ok(()));
            settings.clone()
        };
        assert_eq!(put("rt_bloom", "7").rt_bloom, 1.0);
        assert_eq!(put("RT_BOUNCES", "-1").rt_bounces, 0);
        assert_eq!(put("rt_exposure", "inf").rt_exposure, 0.0);
        assert_eq!(put("r_gamma", "0").gamma, 0.5);
        assert_eq!(put("r_overBrightBits", "-3").overbright_bits, 0);
        assert_eq!(put("rt_denoiser", "9").rt_denoiser, DenoiserChoice::Sparse);
    }

    #[test]
    fn choices_have_their_documented_numbers_and_names() {
        let mut settings = Settings::default();
        let mut put = |name, value| {
            let put = row(name).unwrap().put(&mut settings, &Given::parse(value));
            (put.is_ok(), settings.clone())
        };
        let (_, uniform) = put("rt_lightSelection", "0");
        assert_eq!(uniform.rt_light_selection, LightSelection::Uniform);
        let (_, resampled) = put("rt_lightSelection", "1");
        assert_eq!(resampled.rt_light_selection, LightSelection::Resampled);
        assert_eq!(put("cg_shadows", "2").1.shadows, ModelShadows::Volumes);
        assert_eq!(put("cg_shadows", "-2").1.shadows, ModelShadows::None);
        assert_eq!(put("r_anaglyphMode", "5").1.anaglyph, Anaglyph::CyanRed);
        assert_eq!(put("r_anaglyphMode", "9").1.anaglyph, Anaglyph::None);
        assert_eq!(put("rt_debug", "11").1.rt_debug, DebugOutput::Specular);
        assert_eq!(put("rt_tracer", "Query").1.rt_tracer, TracerChoice::Query);
        let (known, kept) = put("rt_tracer", "gpu");
        assert!(!known && kept.rt_tracer == TracerChoice::Query);
        assert_eq!(put("rt_lights", "PRIOR").1.rt_lights, MapLightChoice::Prior);
        assert_eq!(put("rt_lights", "").1.rt_lights, MapLightChoice::Calibrated);
        let (known, nearest) = put("r_textureMode", "gl_nearest");
        assert!(known && nearest.texture_mode == TextureMode::Nearest);
        assert!(!put("r_textureMode", "nearest").0);
    }

    #[test]
    fn invalid_texts_are_refused_with_the_valid_values() {
        let refused = |name, text| row(name).unwrap().check(text).unwrap_err().to_string();
        assert_eq!(
            refused("rt_bounces", "17"),
            "rt_bounces 17: not a whole number from 0 to 16"
        );
        assert!(refused("rt_bounces", "1.5").contains("a whole number"));
        assert_eq!(
            refused("rt_scale", "inf"),
            "rt_scale inf: not a number from 0.25 to 1"
        );
        assert_eq!(
            refused("r_intensity", "0.5"),
            "r_intensity 0.5: not a number from 1 on"
        );
        assert_eq!(refused("r_zproj", "NaN"), "r_zproj NaN: not a number");
        assert_eq!(
            refused("rt_lights", "all"),
            "rt_lights all: not one of calibrated, prior"
        );
        assert_eq!(row("rt_tracer").unwrap().check("AUTO"), Ok(()));
        assert!(row("rt_none").is_none());
    }
}
