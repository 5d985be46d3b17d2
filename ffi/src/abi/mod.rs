//! What engines of the family share at the C boundary: structures of scenes and answers, and types of functions. The
//! tables of one engine are in its folder. All layouts were measured with a C compiler on the engines' own headers
//! (x86_64).

pub mod functions;
pub mod layout;

use layout::abi_struct;
use std::ffi::{c_char, c_float, c_int, c_uchar};

/// `qboolean`: a C enum, 0 or 1. Not a Rust enum, because the engine may pass any int.
pub type QBool = c_int;

/// Value of a `qboolean`, or of the one-byte `bool` of engines in C++, which leaves the upper bytes of its register
/// undefined.
pub fn is_true(value: QBool) -> bool {
    value.to_le_bytes()[0] != 0
}

/// `vec3_t` inside a structure.
pub type Vec3C = [c_float; 3];

/// `cbufExec_t`: runs when the engine next executes its command buffer.
pub const EXEC_APPEND: c_int = 2;
/// `cbufExec_t`: runs next, before what the buffer holds.
pub const EXEC_INSERT: c_int = 1;
/// `stereoFrame_t` of the first eye.
pub const STEREO_LEFT: c_int = 1;
/// `stereoFrame_t` of the second eye.
pub const STEREO_RIGHT: c_int = 2;
/// Number of `refEntityType_t` values.
#[cfg(test)]
pub const RT_MAX_REF_ENTITY_TYPE: c_int = 8;
/// `CIN_*` bits for a video of a material: looped, without sound.
pub const CIN_MATERIAL: c_int = 2 | 8 | 16;

abi_struct! {
    const STRUCTURES;

    /// An entity to draw.
    #[derive(Debug)]
    pub struct refEntity_t = 140 {
        0 4 reType: c_int,
        4 4 renderfx: c_int,
        8 4 hModel: c_int,
        12 12 lightingOrigin: Vec3C,
        24 4 shadowPlane: c_float,
        28 36 axis: [Vec3C; 3],
        64 4 nonNormalizedAxes: QBool,
        68 12 origin: Vec3C,
        80 4 frame: c_int,
        84 12 oldorigin: Vec3C,
        96 4 oldframe: c_int,
        100 4 backlerp: c_float,
        104 4 skinNum: c_int,
        108 4 customSkin: c_int,
        112 4 customShader: c_int,
        116 4 shaderRGBA: [c_uchar; 4],
        120 8 shaderTexCoord: [c_float; 2],
        128 4 shaderTime: c_float,
        132 4 radius: c_float,
        136 4 rotation: c_float,
    }

    /// A view to draw.
    #[derive(Debug)]
    pub struct refdef_t = 368 {
        0 4 x: c_int,
        4 4 y: c_int,
        8 4 width: c_int,
        12 4 height: c_int,
        16 4 fov_x: c_float,
        20 4 fov_y: c_float,
        24 12 vieworg: Vec3C,
        36 36 viewaxis: [Vec3C; 3],
        72 4 time: c_int,
        76 4 rdflags: c_int,
        80 32 areamask: [c_uchar; 32],
        112 256 text: [[c_uchar; 32]; 8],
    }

    /// A corner of a polygon.
    #[derive(Debug, Default, PartialEq)]
    pub struct polyVert_t = 24 {
        0 12 xyz: Vec3C,
        12 8 st: [c_float; 2],
        20 4 modulate: [c_uchar; 4],
    }

    /// Properties of the renderer for the engine, the user interface and the game.
    #[derive(Debug)]
    pub struct glconfig_t = 11332 {
        0 1024 renderer_string: [c_char; 1024],
        1024 1024 vendor_string: [c_char; 1024],
        2048 1024 version_string: [c_char; 1024],
        3072 8192 extensions_string: [c_char; 8192],
        11264 4 maxTextureSize: c_int,
        11268 4 numTextureUnits: c_int,
        11272 4 colorBits: c_int,
        11276 4 depthBits: c_int,
        11280 4 stencilBits: c_int,
        11284 4 driverType: c_int,
        11288 4 hardwareType: c_int,
        11292 4 deviceSupportsGamma: QBool,
        11296 4 textureCompression: c_int,
        11300 4 textureEnvAddAvailable: QBool,
        11304 4 vidWidth: c_int,
        11308 4 vidHeight: c_int,
        11312 4 windowAspect: c_float,
        11316 4 displayFrequency: c_int,
        11320 4 isFullscreen: QBool,
        11324 4 stereoEnabled: QBool,
        11328 4 smpActive: QBool,
    }

    /// Position and axes of a model's tag.
    #[derive(Debug, Default, PartialEq)]
    pub struct orientation_t = 48 {
        0 12 origin: Vec3C,
        12 36 axis: [Vec3C; 3],
    }

    /// A piece of a decal.
    #[derive(Debug, Default, PartialEq)]
    pub struct markFragment_t = 8 {
        0 4 firstPoint: c_int,
        4 4 numPoints: c_int,
    }

    /// A glyph of a font.
    #[derive(Debug)]
    pub struct glyphInfo_t = 80 {
        0 4 height: c_int,
        4 4 top: c_int,
        8 4 bottom: c_int,
        12 4 pitch: c_int,
        16 4 xSkip: c_int,
        20 4 imageWidth: c_int,
        24 4 imageHeight: c_int,
        28 4 s: c_float,
        32 4 t: c_float,
        36 4 s2: c_float,
        40 4 t2: c_float,
        44 4 glyph: c_int,
        48 32 shaderName: [c_char; 32],
    }

    /// A font.
    #[derive(Debug)]
    pub struct fontInfo_t = 20548 {
        0 20480 glyphs: [glyphInfo_t; 256],
        20480 4 glyphScale: c_float,
        20484 64 name: [c_char; 64],
    }
}

impl Default for refEntity_t {
    /// A white model at the origin, unturned.
    fn default() -> Self {
        Self {
            reType: 0,
            renderfx: 0,
            hModel: 0,
            lightingOrigin: [0.0; 3],
            shadowPlane: 0.0,
            axis: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
            nonNormalizedAxes: 0,
            origin: [0.0; 3],
            frame: 0,
            oldorigin: [0.0; 3],
            oldframe: 0,
            backlerp: 0.0,
            skinNum: 0,
            customSkin: 0,
            customShader: 0,
            shaderRGBA: [255; 4],
            shaderTexCoord: [0.0; 2],
            shaderTime: 0.0,
            radius: 0.0,
            rotation: 0.0,
        }
    }
}
