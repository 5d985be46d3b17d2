//! Console variables that are not settings of the renderer (those are [`ROWS`](renderer_vk::settings::ROWS)): for the
//! window, for captures, and those of the engine's own renderer that have no effect here. Names, defaults and flags are
//! those of the engine's own renderer, for menus, configurations and mods; only the last three rows are ours.

use renderer_vk::settings::flags::{ARCHIVE, CHEAT, LATCH, NONE, ROM};
use renderer_vk::settings::{Kind, Spec, kept};

macro_rules! cvars {
    ($( $id:ident: $kind:ident = $name:literal, $default:literal, $flags:expr, $range:expr, $help:literal; )*) => {
        /// A row of [`TABLE`].
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[allow(missing_docs)] // each row has a help text
        #[allow(dead_code)] // some exist only for menus and configurations
        pub enum Cvar { $( $id ),* }

        /// Variables that the front end reads or sets, in the order of [`Cvar`].
        pub static TABLE: &[Spec] = &[$( Spec {
            name: $name,
            kind: Kind::$kind,
            default: $default,
            flags: $flags,
            range: $range,
            help: $help,
        } ),*];
    };
}

macro_rules! unused {
    ($( $name:literal, $default:literal, $flags:expr, $help:literal; )*) => {
        /// Variables without effect: they select features of OpenGL.
        pub static UNUSED: &[Spec] = &[$( Spec {
            name: $name,
            kind: Kind::Text,
            default: $default,
            flags: $flags,
            range: None,
            help: concat!($help, " Kept for old configurations and menus; has no effect here."),
        } ),*];
    };
}

#[rustfmt::skip] // one row, one line
cvars! {
    Mode: Whole = "r_mode", "3", ARCHIVE | LATCH, None, "Video mode: -2 desktop, -1 r_customwidth x r_customheight, 0 to 11 see modelist.";
    Fullscreen: Whole = "r_fullscreen", "0", ARCHIVE, None, "1 fills the screen. Switches at once.";
    Noborder: Whole = "r_noborder", "0", ARCHIVE | LATCH, None, "1 makes a window without a frame.";
    CustomWidth: Whole = "r_customwidth", "1600", ARCHIVE | LATCH, None, "Width in pixels of r_mode -1.";
    CustomHeight: Whole = "r_customheight", "1024", ARCHIVE | LATCH, None, "Height in pixels of r_mode -1.";
    CustomPixelAspect: Number = "r_customPixelAspect", "1", ARCHIVE | LATCH, None, "Width of a pixel over its height in r_mode -1.";
    CenterWindow: Whole = "r_centerWindow", "0", ARCHIVE | LATCH, None, "1 opens the window in the middle of the screen.";
    AllowResize: Whole = "r_allowResize", "0", ARCHIVE | LATCH, None, "1 makes the window resizable with the mouse.";
    AvailableModes: Text = "r_availableModes", "", ROM, None, "Sizes that the display offers, set by the renderer.";
    SdlDriver: Text = "r_sdlDriver", "", ROM, None, "Video driver that SDL uses, set by the renderer.";
    DisplayRefresh: Whole = "r_displayRefresh", "0", LATCH, kept(0.0, 200.0), "Refresh rate in Hz asked for in full screen; 0 leaves it to the display.";
    StereoEnabled: Whole = "r_stereoEnabled", "0", ARCHIVE | LATCH, None, "Quad-buffered stereo. Windows of Vulkan have one picture for both eyes: has no effect here.";
    IgnoreHwGamma: Whole = "r_ignorehwgamma", "0", ARCHIVE | LATCH, None, "1 bakes r_gamma into textures instead of applying it to the picture.";
    InGameVideo: Whole = "r_inGameVideo", "1", ARCHIVE, None, "0 keeps videos on walls still.";
    AviMotionJpegQuality: Whole = "r_aviMotionJpegQuality", "90", ARCHIVE, None, "JPEG quality of recorded video, 1 to 100.";
    ScreenshotJpegQuality: Whole = "r_screenshotJpegQuality", "90", ARCHIVE, None, "JPEG quality of screenshotJPEG, 1 to 100.";
    MaxPolys: Whole = "r_maxpolys", "600", NONE, None, "Polygons in a frame. There is no limit here; kept for old configurations.";
    MaxPolyVerts: Whole = "r_maxpolyverts", "3000", NONE, None, "Polygon corners in a frame. There is no limit here; kept for old configurations.";
    DebugSurface: Whole = "r_debugSurface", "0", CHEAT, None, "1 shows collision surfaces that traces hit, higher values the bots' navigation areas. In the classic look.";
    Device: Text = "r_device", "", ARCHIVE | LATCH, None, "Part of the Vulkan device's name, or its number; empty or -1 takes the best.";
    VkValidation: Whole = "r_vkValidation", "0", LATCH, kept(0.0, 1.0), "1 loads the Vulkan validation layer and prints what it finds.";
    Headless: Whole = "r_headless", "0", LATCH, kept(0.0, 1.0), "1 renders without a window, for tests.";
}

#[rustfmt::skip] // one row, one line
unused! {
    "r_colorbits", "0", ARCHIVE | LATCH, "Colour depth.";
    "r_depthbits", "0", ARCHIVE | LATCH, "Depth buffer precision.";
    "r_stencilbits", "8", ARCHIVE | LATCH, "Stencil buffer precision.";
    "r_texturebits", "0", ARCHIVE | LATCH, "Texture colour depth.";
    "r_drawBuffer", "GL_BACK", CHEAT, "Buffer to draw to.";
    "r_allowSoftwareGL", "0", LATCH, "Software drivers.";
    "r_allowExtensions", "1", ARCHIVE | LATCH, "OpenGL extensions.";
    "r_ext_compressed_textures", "0", ARCHIVE | LATCH, "Compressed textures.";
    "r_ext_multitexture", "1", ARCHIVE | LATCH, "Several textures in one pass.";
    "r_ext_compiled_vertex_array", "1", ARCHIVE | LATCH, "OpenGL compiled vertex arrays.";
    "r_ext_texture_env_add", "1", ARCHIVE | LATCH, "OpenGL additive texture mode.";
    "r_finish", "0", ARCHIVE, "Wait for OpenGL each frame.";
    "r_primitives", "0", ARCHIVE, "OpenGL drawing method.";
    "r_ignoreFastPath", "1", ARCHIVE | LATCH, "OpenGL fast path.";
    "r_ignoreGLErrors", "1", ARCHIVE, "OpenGL error checks.";
    "com_altivec", "1", ARCHIVE, "PowerPC vector instructions.";
    "r_saveFontData", "0", NONE, "Writes rendered fonts.";
    "r_logFile", "0", CHEAT, "Logs OpenGL calls.";
    "r_verbose", "0", CHEAT, "Verbose loading.";
    "r_ignore", "1", CHEAT, "Spare.";
}
