//! Every console variable that this renderer knows: the ones of the engine's own renderer, with its names, defaults and
//! flags, so that menus, configurations and mods find what they expect; then ours.

use super::Range;
use crate::engine::cvar_flags::{ARCHIVE, CHEAT, LATCH, NONE, ROM, TEMP};
use std::ffi::{CStr, c_int};

/// How a cvar is registered.
#[derive(Debug)]
pub struct Spec {
    /// As the engine spells it.
    pub name: &'static CStr,
    /// Value of a player who never touched it.
    pub default: &'static CStr,
    /// `CVAR_*` bits.
    pub flags: c_int,
    /// What the engine keeps it within, if anything.
    pub range: Option<Range>,
    /// Shown by the console.
    pub description: &'static CStr,
}

const fn range(min: f32, max: f32, integral: bool) -> Option<Range> {
    Some(Range { min, max, integral })
}

macro_rules! cvars {
    ($( $id:ident = $name:literal, $default:literal, $flags:expr, $range:expr, $description:literal; )*) => {
        /// A row of [`TABLE`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)] // each row says what it is
        #[allow(dead_code)] // some exist for menus and configurations alone
        pub enum Cvar { $( $id ),* }

        /// All cvars, in the order of [`Cvar`].
        pub static TABLE: &[Spec] = &[
            $( Spec { name: $name, default: $default, flags: $flags, range: $range, description: $description } ),*
        ];
    };
}

#[rustfmt::skip] // one row, one line
cvars! {
    Mode = c"r_mode", c"3", ARCHIVE | LATCH, None, c"Video mode: -2 desktop, -1 r_customwidth x r_customheight, 0 to 11 see modelist.";
    Fullscreen = c"r_fullscreen", c"0", ARCHIVE, None, c"1 fills the screen. Switches at once.";
    Noborder = c"r_noborder", c"0", ARCHIVE | LATCH, None, c"1 makes a window without a frame.";
    CustomWidth = c"r_customwidth", c"1600", ARCHIVE | LATCH, None, c"Width in pixels of r_mode -1.";
    CustomHeight = c"r_customheight", c"1024", ARCHIVE | LATCH, None, c"Height in pixels of r_mode -1.";
    CustomPixelAspect = c"r_customPixelAspect", c"1", ARCHIVE | LATCH, None, c"Width of a pixel over its height in r_mode -1.";
    CenterWindow = c"r_centerWindow", c"0", ARCHIVE | LATCH, None, c"1 opens the window in the middle of the screen.";
    AllowResize = c"r_allowResize", c"0", ARCHIVE | LATCH, None, c"1 lets the window be resized with the mouse.";
    AvailableModes = c"r_availableModes", c"", ROM, None, c"Sizes that the display offers, set by the renderer.";
    SdlDriver = c"r_sdlDriver", c"", ROM, None, c"Video driver that SDL uses, set by the renderer.";
    DisplayRefresh = c"r_displayRefresh", c"0", LATCH, range(0.0, 200.0, true), c"Refresh rate in Hz asked for in full screen; 0 leaves it to the display.";
    SwapInterval = c"r_swapInterval", c"0", ARCHIVE | LATCH, None, c"1 waits for the display's vertical retrace.";
    Colorbits = c"r_colorbits", c"0", ARCHIVE | LATCH, None, c"Colour depth. Kept for old configurations and menus; has no effect here.";
    Depthbits = c"r_depthbits", c"0", ARCHIVE | LATCH, None, c"Depth buffer precision. Kept for old configurations and menus; has no effect here.";
    Stencilbits = c"r_stencilbits", c"8", ARCHIVE | LATCH, None, c"Stencil buffer precision. Kept for old configurations and menus; has no effect here.";
    Texturebits = c"r_texturebits", c"0", ARCHIVE | LATCH, None, c"Texture colour depth. Kept for old configurations and menus; has no effect here.";
    ExtMultisample = c"r_ext_multisample", c"0", ARCHIVE | LATCH, range(0.0, 4.0, true), c"Samples of a pixel, for smooth edges; the next number that the device has. The traced look has none.";
    StereoEnabled = c"r_stereoEnabled", c"0", ARCHIVE | LATCH, None, c"Quad-buffered stereo. Windows of Vulkan have one picture for both eyes: has no effect here.";
    AnaglyphMode = c"r_anaglyphMode", c"0", ARCHIVE, None, c"Stereo through coloured glasses: 1 red-cyan, 2 red-blue, 3 red-green, 4 green-magenta; 5 to 8 the same, eyes swapped.";
    StereoSeparation = c"r_stereoSeparation", c"64", ARCHIVE, None, c"Convergence distance over the distance of an eye from the middle; negative swaps the eyes.";
    ZProj = c"r_zproj", c"64", ARCHIVE, None, c"Distance at which both eyes' pictures meet.";
    ZNear = c"r_znear", c"4", CHEAT, range(0.001, 200.0, false), c"Distance of the near plane in units.";
    DrawBuffer = c"r_drawBuffer", c"GL_BACK", CHEAT, None, c"Buffer to draw to. Kept for old configurations and menus; has no effect here.";
    AllowSoftwareGL = c"r_allowSoftwareGL", c"0", LATCH, None, c"Software drivers. Kept for old configurations and menus; has no effect here.";
    AllowExtensions = c"r_allowExtensions", c"1", ARCHIVE | LATCH, None, c"OpenGL extensions. Kept for old configurations and menus; has no effect here.";
    ExtCompressedTextures = c"r_ext_compressed_textures", c"0", ARCHIVE | LATCH, None, c"Compressed textures. Kept for old configurations and menus; has no effect here.";
    ExtMultitexture = c"r_ext_multitexture", c"1", ARCHIVE | LATCH, None, c"Several textures in one pass. Kept for old configurations and menus; has no effect here.";
    ExtCompiledVertexArray = c"r_ext_compiled_vertex_array", c"1", ARCHIVE | LATCH, None, c"OpenGL compiled vertex arrays. Kept for old configurations and menus; has no effect here.";
    ExtTextureEnvAdd = c"r_ext_texture_env_add", c"1", ARCHIVE | LATCH, None, c"OpenGL additive texture mode. Kept for old configurations and menus; has no effect here.";
    ExtTextureFilterAnisotropic = c"r_ext_texture_filter_anisotropic", c"0", ARCHIVE | LATCH, None, c"1 samples textures anisotropically.";
    ExtMaxAnisotropy = c"r_ext_max_anisotropy", c"2", ARCHIVE | LATCH, None, c"Highest degree of anisotropic sampling.";
    TextureMode = c"r_textureMode", c"GL_LINEAR_MIPMAP_LINEAR", ARCHIVE, None, c"Texture filter under its OpenGL name, GL_NEAREST to GL_LINEAR_MIPMAP_LINEAR.";
    PicMip = c"r_picmip", c"1", ARCHIVE | LATCH, range(0.0, 16.0, true), c"How often textures are halved when they are loaded.";
    RoundImagesDown = c"r_roundImagesDown", c"1", ARCHIVE | LATCH, None, c"1 shrinks textures of odd sizes to a power of two, 0 enlarges them.";
    ColorMipLevels = c"r_colorMipLevels", c"0", LATCH, None, c"1 tints smaller mip levels red, green and blue in turn.";
    SimpleMipMaps = c"r_simpleMipMaps", c"1", ARCHIVE | LATCH, None, c"1 averages 2x2 pixels for mip levels, 0 filters wider.";
    DetailTextures = c"r_detailtextures", c"1", ARCHIVE | LATCH, None, c"0 leaves detail stages of materials out.";
    Intensity = c"r_intensity", c"1", LATCH, None, c"Multiplies textures; 1 or more.";
    Gamma = c"r_gamma", c"1", ARCHIVE, None, c"Brightness of the display, 0.5 to 3.";
    OverBrightBits = c"r_overBrightBits", c"1", ARCHIVE | LATCH, None, c"Doublings of light beyond white in the classic look, in full screen.";
    MapOverBrightBits = c"r_mapOverBrightBits", c"2", LATCH, None, c"Doublings that the map's lightmaps are meant to get in the classic look.";
    IgnoreHwGamma = c"r_ignorehwgamma", c"0", ARCHIVE | LATCH, None, c"1 bakes r_gamma into textures instead of applying it to the picture.";
    Greyscale = c"r_greyscale", c"0", ARCHIVE | LATCH, range(0.0, 1.0, false), c"0 coloured to 1 grey: takes colour out of textures and light.";
    VertexLight = c"r_vertexLight", c"0", ARCHIVE | LATCH, None, c"1 lights the classic look by vertex colours instead of lightmaps.";
    FullBright = c"r_fullbright", c"0", LATCH | CHEAT, None, c"1 draws the classic look without lightmaps.";
    Lightmap = c"r_lightmap", c"0", NONE, None, c"1 shows lightmaps alone in the classic look; 2, when a map is loaded, as colours by brightness.";
    SingleShader = c"r_singleShader", c"0", LATCH | CHEAT, None, c"1 shows the default material on every surface of the map but the sky.";
    Subdivisions = c"r_subdivisions", c"4", ARCHIVE | LATCH, None, c"Largest deviation of curved surfaces in units; smaller is smoother.";
    LodCurveError = c"r_lodCurveError", c"250", ARCHIVE | CHEAT, None, c"Distance scale of the detail of curved surfaces in the classic look.";
    LodBias = c"r_lodbias", c"0", ARCHIVE, None, c"Added to the level of detail of models; higher is coarser.";
    LodScale = c"r_lodscale", c"5", CHEAT, None, c"Scales the level of detail of models by their size on screen.";
    Flares = c"r_flares", c"0", ARCHIVE, None, c"1 draws light flares.";
    FlareSize = c"r_flareSize", c"40", CHEAT, None, c"Size of far flares, of a window 640 pixels wide.";
    FlareFade = c"r_flareFade", c"7", CHEAT, None, c"How often in a second a flare could appear or go.";
    FlareCoeff = c"r_flareCoeff", c"150", CHEAT, None, c"How bright flares stay with distance.";
    FastSky = c"r_fastsky", c"0", ARCHIVE, None, c"1 draws no sky and no portals, 2 keeps the portals.";
    DrawSun = c"r_drawSun", c"0", ARCHIVE, None, c"1 draws the sun's disc in the sky.";
    DynamicLight = c"r_dynamiclight", c"1", ARCHIVE, None, c"0 ignores lights of explosions, missiles and items.";
    DlightBacks = c"r_dlightBacks", c"1", ARCHIVE, None, c"0 keeps dynamic light off faces turned away from it.";
    InGameVideo = c"r_inGameVideo", c"1", ARCHIVE, None, c"0 keeps videos on walls still.";
    Finish = c"r_finish", c"0", ARCHIVE, None, c"Wait for OpenGL each frame. Kept for old configurations and menus; has no effect here.";
    FacePlaneCull = c"r_facePlaneCull", c"1", ARCHIVE, None, c"0 draws flat surfaces that are turned away from the eye too; they are not seen.";
    RailWidth = c"r_railWidth", c"16", ARCHIVE, None, c"Diameter of the rings of a rail trail.";
    RailCoreWidth = c"r_railCoreWidth", c"6", ARCHIVE, None, c"Half width of the core of a rail trail.";
    RailSegmentLength = c"r_railSegmentLength", c"32", ARCHIVE, None, c"Distance between the rings of a rail trail.";
    AmbientScale = c"r_ambientScale", c"0.6", CHEAT, None, c"Multiplies the ambient light of models in the classic look.";
    DirectedScale = c"r_directedScale", c"1", CHEAT, None, c"Multiplies the directed light of models in the classic look.";
    MarksOnTriangleMeshes = c"r_marksOnTriangleMeshes", c"0", ARCHIVE, None, c"1 lets bullet marks stick to detail meshes of the map.";
    AviMotionJpegQuality = c"r_aviMotionJpegQuality", c"90", ARCHIVE, None, c"JPEG quality of recorded video, 1 to 100.";
    ScreenshotJpegQuality = c"r_screenshotJpegQuality", c"90", ARCHIVE, None, c"JPEG quality of screenshotJPEG, 1 to 100.";
    MaxPolys = c"r_maxpolys", c"600", NONE, None, c"Polygons in a frame. There is no limit here; kept for old configurations.";
    MaxPolyVerts = c"r_maxpolyverts", c"3000", NONE, None, c"Polygon corners in a frame. There is no limit here; kept for old configurations.";
    Shadows = c"cg_shadows", c"1", NONE, None, c"Shadows of models in the classic look: 0 none, 1 spot, 2 volumes, 3 planar.";
    UiFullscreen = c"r_uifullscreen", c"0", NONE, None, c"Set by the engine while a menu covers the game.";
    Primitives = c"r_primitives", c"0", ARCHIVE, None, c"OpenGL drawing method. Kept for old configurations and menus; has no effect here.";
    IgnoreFastPath = c"r_ignoreFastPath", c"1", ARCHIVE | LATCH, None, c"OpenGL fast path. Kept for old configurations and menus; has no effect here.";
    IgnoreGLErrors = c"r_ignoreGLErrors", c"1", ARCHIVE, None, c"OpenGL error checks. Kept for old configurations and menus; has no effect here.";
    ComAltivec = c"com_altivec", c"1", ARCHIVE, None, c"PowerPC vector instructions. Kept for old configurations and menus; has no effect here.";
    OffsetFactor = c"r_offsetfactor", c"-1", CHEAT, None, c"Depth offset of decals by their slope in the classic look.";
    OffsetUnits = c"r_offsetunits", c"-2", CHEAT, None, c"Constant depth offset of decals in the classic look.";
    SaveFontData = c"r_saveFontData", c"0", NONE, None, c"Writes rendered fonts. Kept for old configurations and menus; has no effect here.";
    PrintShaders = c"r_printShaders", c"0", NONE, None, c"1 prints the name of each script that is used when it is registered.";
    NoCurves = c"r_nocurves", c"0", CHEAT, None, c"1 draws no curved surfaces.";
    DrawWorld = c"r_drawworld", c"1", CHEAT, None, c"0 draws no map.";
    DrawEntities = c"r_drawentities", c"1", CHEAT, None, c"0 draws no entities.";
    PortalOnly = c"r_portalOnly", c"0", CHEAT, None, c"1 draws what a portal or mirror in sight shows, and nothing before it.";
    NoPortals = c"r_noportals", c"0", CHEAT, None, c"1 draws no portals and mirrors.";
    SkipBackEnd = c"r_skipBackEnd", c"0", CHEAT, None, c"1 draws nothing and takes no pictures.";
    NoRefresh = c"r_norefresh", c"0", CHEAT, None, c"1 leaves out 3D views.";
    MeasureOverdraw = c"r_measureOverdraw", c"0", CHEAT, None, c"1 counts how often a pixel is drawn in the classic look: the last number of r_speeds 1.";
    Nobind = c"r_nobind", c"0", CHEAT, None, c"1 draws everything with one texture, the spot of dynamic lights.";
    ShowTris = c"r_showtris", c"0", CHEAT, None, c"1 shows triangle edges in the classic look.";
    Shownormals = c"r_shownormals", c"0", CHEAT, None, c"1 shows the normals of vertices in the classic look.";
    Showsky = c"r_showsky", c"0", CHEAT, None, c"1 draws the sky before everything.";
    Clear = c"r_clear", c"0", CHEAT, None, c"1 clears the picture to pink each frame.";
    ShowImages = c"r_showImages", c"0", TEMP, None, c"1 shows all images on a grid, 2 in proportion to their sizes.";
    Debuglight = c"r_debuglight", c"0", TEMP, None, c"1 prints the light on the first-person weapon.";
    DebugSort = c"r_debugSort", c"0", CHEAT, None, c"Leaves out materials of a greater sort value; 0 draws all.";
    DebugSurface = c"r_debugSurface", c"0", CHEAT, None, c"1 shows collision surfaces that traces hit, higher values what bots know of the map. In the classic look.";
    LogFile = c"r_logFile", c"0", CHEAT, None, c"Logs OpenGL calls. Kept for old configurations and menus; has no effect here.";
    Speeds = c"r_speeds", c"0", CHEAT, None, c"1 to 6 print counts of each frame: surfaces, culling, cluster, dynamic lights, far plane, flares.";
    LockPvs = c"r_lockpvs", c"0", CHEAT, None, c"1 keeps the visible part of the map as it is.";
    NoVis = c"r_novis", c"0", CHEAT, None, c"1 ignores the map's visibility.";
    NoCull = c"r_nocull", c"0", CHEAT, None, c"1 draws what is out of view as well.";
    Showcluster = c"r_showcluster", c"0", CHEAT, None, c"1 prints the cluster and area of the eye when they change.";
    Verbose = c"r_verbose", c"0", CHEAT, None, c"Verbose loading. Kept for old configurations and menus; has no effect here.";
    Ignore = c"r_ignore", c"1", CHEAT, None, c"Spare. Kept for old configurations and menus; has no effect here.";
    // ours
    RayTrace = c"r_rt", c"0", ARCHIVE, range(0.0, 1.0, true), c"1 traces light with rays, 0 draws the classic look. Switches at once.";
    RtTracer = c"rt_tracer", c"auto", ARCHIVE | LATCH, None, c"What follows the rays: auto, pipeline, query or compute. A device without it gets what auto picks.";
    RtLights = c"rt_lights", c"calibrated", ARCHIVE, None, c"Lights of the map: calibrated, fitted to the light that its compiler stored, or prior, as its directives say. Switches at once.";
    RtPrintPerfStats = c"rt_printPerfStats", c"0", ARCHIVE, range(0.0, 1.0, true), c"1 prints times, rays and memory of the traced look each second.";
    RtIllumination = c"rt_illumination", c"1", ARCHIVE, range(0.0, 1.0, true), c"0 shows surfaces in their own colour, without light.";
    RtCullLights = c"rt_cullLights", c"1", ARCHIVE, range(0.0, 1.0, true), c"0 asks every light of the map at every point instead of those that may reach it. Same picture, slower.";
    RtNumRandomDL = c"rt_numRandomDL", c"1", ARCHIVE, range(0.0, 64.0, true), c"Lights picked at random for each pixel and frame, each with a shadow ray; 0 asks all that may reach the point.";
    RtLightSelection = c"rt_lightSelection", c"1", ARCHIVE, range(0.0, 1.0, true), c"How a random light is picked: 0 uniformly, 1 resampled by importance. Same picture in the mean.";
    RtCandidates = c"rt_candidates", c"8", ARCHIVE, range(1.0, 64.0, true), c"Lights looked at for each pick with rt_lightSelection 1.";
    RtPause = c"rt_pause", c"0", NONE, range(0.0, 1.0, true), c"1 keeps what the traced look shows still: view, entities and time. The game goes on.";
    RtAccumulate = c"rt_accumulate", c"0", ARCHIVE, range(0.0, 1.0, true), c"1 averages frames, unfiltered, for as long as nothing moves, towards the exact picture. With rt_pause 1 also in a running game.";
    RtAntialiasing = c"rt_antialiasing", c"1", ARCHIVE, range(0.0, 1.0, true), c"1 moves the traced points within their pixels from frame to frame, for smooth edges.";
    RtSoftShadows = c"rt_softshadows", c"1", ARCHIVE, range(0.0, 1.0, true), c"0 takes each light at its middle: sharp shadows.";
    RtDof = c"rt_dof", c"0", ARCHIVE, range(0.0, 1.0, true), c"1 gives the camera a lens: what is out of focus is blurred.";
    RtAperture = c"rt_aperture", c"4", ARCHIVE, range(0.0, 256.0, false), c"Diameter of the lens of rt_dof in units.";
    RtFocalLength = c"rt_focallength", c"256", ARCHIVE, range(1.0, 65536.0, false), c"Distance in units that is sharp with rt_dof.";
    RtDenoiser = c"rt_denoiser", c"1", ARCHIVE, range(0.0, 2.0, true), c"Filter for traced light: 0 none, 1 A-SVGF, 2 a cheaper sparse filter.";
    RtTaa = c"rt_taa", c"1", ARCHIVE, range(0.0, 1.0, true), c"1 smooths edges over time.";
    RtScale = c"rt_scale", c"1", ARCHIVE, range(0.25, 1.0, false), c"Width and height of the traced picture over those of the window.";
    RtMaxDepth = c"rt_maxDepth", c"4", ARCHIVE, range(0.0, 16.0, true), c"Mirrors and panes of glass that a view ray may pass.";
    RtBounces = c"rt_bounces", c"1", ARCHIVE, range(0.0, 2.0, true), c"Bounces of light from surface to surface.";
    RtExposure = c"rt_exposure", c"0", ARCHIVE, range(-16.0, 16.0, false), c"Exposure in stops, added to the automatic one.";
    RtAutoExposure = c"rt_autoExposure", c"1", ARCHIVE, range(0.0, 1.0, true), c"1 adapts the exposure to the picture.";
    RtBloom = c"rt_bloom", c"0.05", ARCHIVE, range(0.0, 1.0, false), c"Part of the light that spreads around bright things; 0 none.";
    RtFlashlight = c"rt_flashlight", c"0", ARCHIVE, range(0.0, 1.0, true), c"1 carries a lamp at the eye.";
    RtLightScale = c"rt_lightScale", c"1", ARCHIVE, range(0.0, 100.0, false), c"Multiplies every light of the map when it is traced.";
    RtDlightScale = c"rt_dlightScale", c"1", ARCHIVE, range(0.0, 100.0, false), c"Multiplies lights of explosions, missiles and items when they are traced.";
    RtDebug = c"rt_debug", c"0", NONE, range(0.0, 11.0, true), c"Shows a step of the traced look in place of the picture: 1 albedo, 2 normals, 3 depth, 4 motion, 5 clusters, 6 lights per pixel, 7 samples, 8 variance, 9 gradients, 10 rays per pixel, 11 reflections.";
    Device = c"r_device", c"", ARCHIVE | LATCH, None, c"Part of the name of the Vulkan device to use; empty takes the best.";
    VkValidation = c"r_vkValidation", c"0", LATCH, range(0.0, 1.0, true), c"1 loads the Vulkan validation layer and prints what it finds.";
    Headless = c"r_headless", c"0", LATCH, range(0.0, 1.0, true), c"1 renders without a window, for tests.";
}
