//! The structures of the ABI of Debian's ioquake3 (1.36+u20221123, upstream 70d07d91) and of ioquake3's HEAD, which has
//! the same layouts. The scene structures are equal in all Quake III engines.

use super::layout::abi_struct;
use std::ffi::{c_char, c_float, c_int, c_long, c_uchar, c_void};

/// `REF_API_VERSION` of the engines that this front end supports. Other engines use the same number with other tables.
pub const API_VERSION: c_int = 8;

/// `qboolean`: a C enum, 0 or 1. Not a Rust enum, because the engine may pass any int.
pub type QBool = c_int;
/// `vec3_t` inside a structure.
pub type Vec3C = [c_float; 3];

/// `cbufExec_t`: runs when the engine next executes its command buffer.
pub const EXEC_APPEND: c_int = 2;
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
    /// An entity to draw.
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
    pub struct polyVert_t = 24 {
        0 12 xyz: Vec3C,
        12 8 st: [c_float; 2],
        20 4 modulate: [c_uchar; 4],
    }

    /// Properties of the renderer for the engine, the user interface and the game.
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
    pub struct orientation_t = 48 {
        0 12 origin: Vec3C,
        12 36 axis: [Vec3C; 3],
    }

    /// A piece of a decal.
    pub struct markFragment_t = 8 {
        0 4 firstPoint: c_int,
        4 4 numPoints: c_int,
    }

    /// A glyph of a font.
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
    pub struct fontInfo_t = 20548 {
        0 20480 glyphs: [glyphInfo_t; 256],
        20480 4 glyphScale: c_float,
        20484 64 name: [c_char; 64],
    }

    /// A console variable. The engine owns it; the renderer reads it, and clears `modified` of its own variables.
    pub struct cvar_t = 120 {
        0 8 name: *mut c_char,
        8 8 string: *mut c_char,
        16 8 resetString: *mut c_char,
        24 8 latchedString: *mut c_char,
        32 4 flags: c_int,
        36 4 modified: QBool,
        40 4 modificationCount: c_int,
        44 4 value: c_float,
        48 4 integer: c_int,
        52 4 validate: QBool,
        56 4 integral: QBool,
        60 4 min: c_float,
        64 4 max: c_float,
        72 8 description: *mut c_char,
        80 8 next: *mut cvar_t,
        88 8 prev: *mut cvar_t,
        96 8 hashNext: *mut cvar_t,
        104 8 hashPrev: *mut cvar_t,
        112 4 hashIndex: c_int,
    }

    /// The engine's functions. Entries may be null.
    pub struct refimport_t = 320 {
        0 8 Printf: Option<unsafe extern "C" fn(c_int, *const c_char, ...)>,
        8 8 Error: Option<unsafe extern "C" fn(c_int, *const c_char, ...)>,
        16 8 Milliseconds: Option<unsafe extern "C" fn() -> c_int>,
        24 8 Hunk_Alloc: Option<unsafe extern "C" fn(c_int, c_int) -> *mut c_void>,
        32 8 Hunk_AllocateTempMemory: Option<unsafe extern "C" fn(c_int) -> *mut c_void>,
        40 8 Hunk_FreeTempMemory: Option<unsafe extern "C" fn(*mut c_void)>,
        48 8 Malloc: Option<unsafe extern "C" fn(c_int) -> *mut c_void>,
        56 8 Free: Option<unsafe extern "C" fn(*mut c_void)>,
        64 8 Cvar_Get: Option<unsafe extern "C" fn(*const c_char, *const c_char, c_int) -> *mut cvar_t>,
        72 8 Cvar_Set: Option<unsafe extern "C" fn(*const c_char, *const c_char)>,
        80 8 Cvar_SetValue: Option<unsafe extern "C" fn(*const c_char, c_float)>,
        88 8 Cvar_CheckRange: Option<unsafe extern "C" fn(*mut cvar_t, c_float, c_float, QBool)>,
        96 8 Cvar_SetDescription: Option<unsafe extern "C" fn(*mut cvar_t, *const c_char)>,
        104 8 Cvar_VariableIntegerValue: Option<unsafe extern "C" fn(*const c_char) -> c_int>,
        112 8 Cmd_AddCommand: Option<unsafe extern "C" fn(*const c_char, Option<unsafe extern "C" fn()>)>,
        120 8 Cmd_RemoveCommand: Option<unsafe extern "C" fn(*const c_char)>,
        128 8 Cmd_Argc: Option<unsafe extern "C" fn() -> c_int>,
        136 8 Cmd_Argv: Option<unsafe extern "C" fn(c_int) -> *mut c_char>,
        144 8 Cmd_ExecuteText: Option<unsafe extern "C" fn(c_int, *const c_char)>,
        152 8 CM_ClusterPVS: Option<unsafe extern "C" fn(c_int) -> *mut c_uchar>,
        160 8 CM_DrawDebugSurface: Option<unsafe extern "C" fn(Option<unsafe extern "C" fn(c_int, c_int, *mut c_float)>)>,
        168 8 FS_FileIsInPAK: Option<unsafe extern "C" fn(*const c_char, *mut c_int) -> c_int>,
        176 8 FS_ReadFile: Option<unsafe extern "C" fn(*const c_char, *mut *mut c_void) -> c_long>,
        184 8 FS_FreeFile: Option<unsafe extern "C" fn(*mut c_void)>,
        192 8 FS_ListFiles: Option<unsafe extern "C" fn(*const c_char, *const c_char, *mut c_int) -> *mut *mut c_char>,
        200 8 FS_FreeFileList: Option<unsafe extern "C" fn(*mut *mut c_char)>,
        208 8 FS_WriteFile: Option<unsafe extern "C" fn(*const c_char, *const c_void, c_int)>,
        216 8 FS_FileExists: Option<unsafe extern "C" fn(*const c_char) -> QBool>,
        224 8 CIN_UploadCinematic: Option<unsafe extern "C" fn(c_int)>,
        232 8 CIN_PlayCinematic: Option<unsafe extern "C" fn(*const c_char, c_int, c_int, c_int, c_int, c_int) -> c_int>,
        240 8 CIN_RunCinematic: Option<unsafe extern "C" fn(c_int) -> c_int>,
        248 8 CL_WriteAVIVideoFrame: Option<unsafe extern "C" fn(*const c_uchar, c_int)>,
        256 8 IN_Init: Option<unsafe extern "C" fn(*mut c_void)>,
        264 8 IN_Shutdown: Option<unsafe extern "C" fn()>,
        272 8 IN_Restart: Option<unsafe extern "C" fn()>,
        280 8 ftol: Option<unsafe extern "C" fn(c_float) -> c_long>,
        288 8 Sys_SetEnv: Option<unsafe extern "C" fn(*const c_char, *const c_char)>,
        296 8 Sys_GLimpSafeInit: Option<unsafe extern "C" fn()>,
        304 8 Sys_GLimpInit: Option<unsafe extern "C" fn()>,
        312 8 Sys_LowPhysicalMemory: Option<unsafe extern "C" fn() -> QBool>,
    }

    /// The renderer's functions.
    pub struct refexport_t = 240 {
        0 8 Shutdown: unsafe extern "C" fn(QBool),
        8 8 BeginRegistration: unsafe extern "C" fn(*mut glconfig_t),
        16 8 RegisterModel: unsafe extern "C" fn(*const c_char) -> c_int,
        24 8 RegisterSkin: unsafe extern "C" fn(*const c_char) -> c_int,
        32 8 RegisterShader: unsafe extern "C" fn(*const c_char) -> c_int,
        40 8 RegisterShaderNoMip: unsafe extern "C" fn(*const c_char) -> c_int,
        48 8 LoadWorld: unsafe extern "C" fn(*const c_char),
        56 8 SetWorldVisData: unsafe extern "C" fn(*const c_uchar),
        64 8 EndRegistration: unsafe extern "C" fn(),
        72 8 ClearScene: unsafe extern "C" fn(),
        80 8 AddRefEntityToScene: unsafe extern "C" fn(*const refEntity_t),
        88 8 AddPolyToScene: unsafe extern "C" fn(c_int, c_int, *const polyVert_t, c_int),
        96 8 LightForPoint: unsafe extern "C" fn(*const Vec3C, *mut Vec3C, *mut Vec3C, *mut Vec3C) -> c_int,
        104 8 AddLightToScene: unsafe extern "C" fn(*const Vec3C, c_float, c_float, c_float, c_float),
        112 8 AddAdditiveLightToScene: unsafe extern "C" fn(*const Vec3C, c_float, c_float, c_float, c_float),
        120 8 RenderScene: unsafe extern "C" fn(*const refdef_t),
        128 8 SetColor: unsafe extern "C" fn(*const [c_float; 4]),
        136 8 DrawStretchPic: unsafe extern "C" fn(c_float, c_float, c_float, c_float, c_float, c_float, c_float, c_float, c_int),
        144 8 DrawStretchRaw: unsafe extern "C" fn(c_int, c_int, c_int, c_int, c_int, c_int, *const c_uchar, c_int, QBool),
        152 8 UploadCinematic: unsafe extern "C" fn(c_int, c_int, c_int, c_int, *const c_uchar, c_int, QBool),
        160 8 BeginFrame: unsafe extern "C" fn(c_int),
        168 8 EndFrame: unsafe extern "C" fn(*mut c_int, *mut c_int),
        176 8 MarkFragments: unsafe extern "C" fn(c_int, *const Vec3C, *const Vec3C, c_int, *mut Vec3C, c_int, *mut markFragment_t) -> c_int,
        184 8 LerpTag: unsafe extern "C" fn(*mut orientation_t, c_int, c_int, c_int, c_float, *const c_char) -> c_int,
        192 8 ModelBounds: unsafe extern "C" fn(c_int, *mut Vec3C, *mut Vec3C),
        200 8 RegisterFont: unsafe extern "C" fn(*const c_char, c_int, *mut fontInfo_t),
        208 8 RemapShader: unsafe extern "C" fn(*const c_char, *const c_char, *const c_char),
        216 8 GetEntityToken: unsafe extern "C" fn(*mut c_char, c_int) -> QBool,
        224 8 inPVS: unsafe extern "C" fn(*const Vec3C, *const Vec3C) -> QBool,
        232 8 TakeVideoFrame: unsafe extern "C" fn(c_int, c_int, *mut c_uchar, *mut c_uchar, QBool),
    }
}
