//! The structures of Debian's ioquake3 that cross to a renderer, written down a second time, from the engine's
//! side: a slip in the library's own copy shows as a disagreement here.

#![allow(missing_docs)] // the engine's fields, under its names
#![allow(non_snake_case, non_camel_case_types)]

use std::ffi::{c_char, c_int, c_long, c_uchar, c_void};

/// The version that `GetRefAPI` is called with.
pub const REF_API_VERSION: c_int = 8;

pub const ERR_FATAL: c_int = 0;
pub const ERR_DROP: c_int = 1;

pub const CVAR_ARCHIVE: c_int = 0x1;
pub const CVAR_INIT: c_int = 0x10;
pub const CVAR_LATCH: c_int = 0x20;
pub const CVAR_ROM: c_int = 0x40;
pub const CVAR_USER_CREATED: c_int = 0x80;
pub const CVAR_CHEAT: c_int = 0x200;

/// A live console variable.
#[repr(C)]
#[derive(Debug)]
pub struct cvar_t {
    pub name: *mut c_char,
    pub string: *mut c_char,
    pub resetString: *mut c_char,
    pub latchedString: *mut c_char,
    pub flags: c_int,
    pub modified: c_int,
    pub modificationCount: c_int,
    pub value: f32,
    pub integer: c_int,
    pub validate: c_int,
    pub integral: c_int,
    pub min: f32,
    pub max: f32,
    pub description: *mut c_char,
    pub next: *mut cvar_t,
    pub prev: *mut cvar_t,
    pub hashNext: *mut cvar_t,
    pub hashPrev: *mut cvar_t,
    pub hashIndex: c_int,
}

/// Properties that the renderer reports.
#[repr(C)]
#[derive(Clone)]
pub struct glconfig_t {
    pub renderer_string: [c_char; 1024],
    pub vendor_string: [c_char; 1024],
    pub version_string: [c_char; 1024],
    pub extensions_string: [c_char; 8192],
    pub maxTextureSize: c_int,
    pub numTextureUnits: c_int,
    pub colorBits: c_int,
    pub depthBits: c_int,
    pub stencilBits: c_int,
    pub driverType: c_int,
    pub hardwareType: c_int,
    pub deviceSupportsGamma: c_int,
    pub textureCompression: c_int,
    pub textureEnvAddAvailable: c_int,
    pub vidWidth: c_int,
    pub vidHeight: c_int,
    pub windowAspect: f32,
    pub displayFrequency: c_int,
    pub isFullscreen: c_int,
    pub stereoEnabled: c_int,
    pub smpActive: c_int,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct refEntity_t {
    pub reType: c_int,
    pub renderfx: c_int,
    pub hModel: c_int,
    pub lightingOrigin: [f32; 3],
    pub shadowPlane: f32,
    pub axis: [[f32; 3]; 3],
    pub nonNormalizedAxes: c_int,
    pub origin: [f32; 3],
    pub frame: c_int,
    pub oldorigin: [f32; 3],
    pub oldframe: c_int,
    pub backlerp: f32,
    pub skinNum: c_int,
    pub customSkin: c_int,
    pub customShader: c_int,
    pub shaderRGBA: [c_uchar; 4],
    pub shaderTexCoord: [f32; 2],
    pub shaderTime: f32,
    pub radius: f32,
    pub rotation: f32,
}

impl Default for refEntity_t {
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

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct refdef_t {
    pub x: c_int,
    pub y: c_int,
    pub width: c_int,
    pub height: c_int,
    pub fov_x: f32,
    pub fov_y: f32,
    pub vieworg: [f32; 3],
    pub viewaxis: [[f32; 3]; 3],
    pub time: c_int,
    pub rdflags: c_int,
    pub areamask: [c_uchar; 32],
    pub text: [[c_char; 32]; 8],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default)]
pub struct polyVert_t {
    pub xyz: [f32; 3],
    pub st: [f32; 2],
    pub modulate: [c_uchar; 4],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct orientation_t {
    pub origin: [f32; 3],
    pub axis: [[f32; 3]; 3],
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct markFragment_t {
    pub firstPoint: c_int,
    pub numPoints: c_int,
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct glyphInfo_t {
    pub height: c_int,
    pub top: c_int,
    pub bottom: c_int,
    pub pitch: c_int,
    pub xSkip: c_int,
    pub imageWidth: c_int,
    pub imageHeight: c_int,
    pub s: f32,
    pub t: f32,
    pub s2: f32,
    pub t2: f32,
    pub glyph: c_int,
    pub shaderName: [c_char; 32],
}

#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct fontInfo_t {
    pub glyphs: [glyphInfo_t; 256],
    pub glyphScale: f32,
    pub name: [c_char; 64],
}

/// What the engine offers.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct refimport_t {
    pub Printf: unsafe extern "C" fn(c_int, *const c_char, ...),
    pub Error: unsafe extern "C" fn(c_int, *const c_char, ...),
    pub Milliseconds: extern "C" fn() -> c_int,
    pub Hunk_Alloc: extern "C" fn(c_int, c_int) -> *mut c_void,
    pub Hunk_AllocateTempMemory: extern "C" fn(c_int) -> *mut c_void,
    pub Hunk_FreeTempMemory: extern "C" fn(*mut c_void),
    pub Malloc: extern "C" fn(c_int) -> *mut c_void,
    pub Free: extern "C" fn(*mut c_void),
    pub Cvar_Get: extern "C" fn(*const c_char, *const c_char, c_int) -> *mut cvar_t,
    pub Cvar_Set: extern "C" fn(*const c_char, *const c_char),
    pub Cvar_SetValue: extern "C" fn(*const c_char, f32),
    pub Cvar_CheckRange: extern "C" fn(*mut cvar_t, f32, f32, c_int),
    pub Cvar_SetDescription: extern "C" fn(*mut cvar_t, *const c_char),
    pub Cvar_VariableIntegerValue: extern "C" fn(*const c_char) -> c_int,
    pub Cmd_AddCommand: extern "C" fn(*const c_char, Option<extern "C" fn()>),
    pub Cmd_RemoveCommand: extern "C" fn(*const c_char),
    pub Cmd_Argc: extern "C" fn() -> c_int,
    pub Cmd_Argv: extern "C" fn(c_int) -> *mut c_char,
    pub Cmd_ExecuteText: extern "C" fn(c_int, *const c_char),
    pub CM_ClusterPVS: extern "C" fn(c_int) -> *mut c_uchar,
    pub CM_DrawDebugSurface: extern "C" fn(Option<extern "C" fn(c_int, c_int, *mut f32)>),
    pub FS_FileIsInPAK: extern "C" fn(*const c_char, *mut c_int) -> c_int,
    pub FS_ReadFile: extern "C" fn(*const c_char, *mut *mut c_void) -> c_long,
    pub FS_FreeFile: extern "C" fn(*mut c_void),
    pub FS_ListFiles: extern "C" fn(*const c_char, *const c_char, *mut c_int) -> *mut *mut c_char,
    pub FS_FreeFileList: extern "C" fn(*mut *mut c_char),
    pub FS_WriteFile: extern "C" fn(*const c_char, *const c_void, c_int),
    pub FS_FileExists: extern "C" fn(*const c_char) -> c_int,
    pub CIN_UploadCinematic: extern "C" fn(c_int),
    pub CIN_PlayCinematic: extern "C" fn(*const c_char, c_int, c_int, c_int, c_int, c_int) -> c_int,
    pub CIN_RunCinematic: extern "C" fn(c_int) -> c_int,
    pub CL_WriteAVIVideoFrame: extern "C" fn(*const c_uchar, c_int),
    pub IN_Init: extern "C" fn(*mut c_void),
    pub IN_Shutdown: extern "C" fn(),
    pub IN_Restart: extern "C" fn(),
    pub ftol: extern "C" fn(f32) -> c_long,
    pub Sys_SetEnv: extern "C" fn(*const c_char, *const c_char),
    pub Sys_GLimpSafeInit: extern "C" fn(),
    pub Sys_GLimpInit: extern "C" fn(),
    pub Sys_LowPhysicalMemory: extern "C" fn() -> c_int,
}

/// What the renderer offers.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct refexport_t {
    pub Shutdown: unsafe extern "C" fn(c_int),
    pub BeginRegistration: unsafe extern "C" fn(*mut glconfig_t),
    pub RegisterModel: unsafe extern "C" fn(*const c_char) -> c_int,
    pub RegisterSkin: unsafe extern "C" fn(*const c_char) -> c_int,
    pub RegisterShader: unsafe extern "C" fn(*const c_char) -> c_int,
    pub RegisterShaderNoMip: unsafe extern "C" fn(*const c_char) -> c_int,
    pub LoadWorld: unsafe extern "C" fn(*const c_char),
    pub SetWorldVisData: unsafe extern "C" fn(*const c_uchar),
    pub EndRegistration: unsafe extern "C" fn(),
    pub ClearScene: unsafe extern "C" fn(),
    pub AddRefEntityToScene: unsafe extern "C" fn(*const refEntity_t),
    pub AddPolyToScene: unsafe extern "C" fn(c_int, c_int, *const polyVert_t, c_int),
    pub LightForPoint: unsafe extern "C" fn(*mut f32, *mut f32, *mut f32, *mut f32) -> c_int,
    pub AddLightToScene: unsafe extern "C" fn(*const f32, f32, f32, f32, f32),
    pub AddAdditiveLightToScene: unsafe extern "C" fn(*const f32, f32, f32, f32, f32),
    pub RenderScene: unsafe extern "C" fn(*const refdef_t),
    pub SetColor: unsafe extern "C" fn(*const f32),
    pub DrawStretchPic: unsafe extern "C" fn(f32, f32, f32, f32, f32, f32, f32, f32, c_int),
    pub DrawStretchRaw: unsafe extern "C" fn(
        c_int,
        c_int,
        c_int,
        c_int,
        c_int,
        c_int,
        *const c_uchar,
        c_int,
        c_int,
    ),
    pub UploadCinematic:
        unsafe extern "C" fn(c_int, c_int, c_int, c_int, *const c_uchar, c_int, c_int),
    pub BeginFrame: unsafe extern "C" fn(c_int),
    pub EndFrame: unsafe extern "C" fn(*mut c_int, *mut c_int),
    pub MarkFragments: unsafe extern "C" fn(
        c_int,
        *const [f32; 3],
        *const f32,
        c_int,
        *mut f32,
        c_int,
        *mut markFragment_t,
    ) -> c_int,
    pub LerpTag:
        unsafe extern "C" fn(*mut orientation_t, c_int, c_int, c_int, f32, *const c_char) -> c_int,
    pub ModelBounds: unsafe extern "C" fn(c_int, *mut f32, *mut f32),
    pub RegisterFont: unsafe extern "C" fn(*const c_char, c_int, *mut fontInfo_t),
    pub RemapShader: unsafe extern "C" fn(*const c_char, *const c_char, *const c_char),
    pub GetEntityToken: unsafe extern "C" fn(*mut c_char, c_int) -> c_int,
    pub inPVS: unsafe extern "C" fn(*const f32, *const f32) -> c_int,
    pub TakeVideoFrame: unsafe extern "C" fn(c_int, c_int, *mut c_uchar, *mut c_uchar, c_int),
}

/// `GetRefAPI` itself.
pub type GetRefAPI = unsafe extern "C" fn(c_int, *mut refimport_t) -> *mut refexport_t;

const _: () = {
    assert!(size_of::<cvar_t>() == 120);
    assert!(size_of::<glconfig_t>() == 11332);
    assert!(size_of::<refEntity_t>() == 140);
    assert!(size_of::<refdef_t>() == 368);
    assert!(size_of::<polyVert_t>() == 24);
    assert!(size_of::<orientation_t>() == 48);
    assert!(size_of::<glyphInfo_t>() == 80);
    assert!(size_of::<fontInfo_t>() == 20548);
    assert!(size_of::<refimport_t>() == 320);
    assert!(size_of::<refexport_t>() == 240);
};
