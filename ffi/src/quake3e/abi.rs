//! The tables of Quake3e (f8372fd8), and of Quake3e-urt and urbanterror-slim, which have the same layouts.

#![allow(non_camel_case_types, missing_docs)] // the engine's names

use crate::abi::functions::*;
use crate::abi::layout::{abi_struct, function_table};
use crate::abi::{QBool, Vec3C, glconfig_t, refEntity_t};
use std::ffi::{c_char, c_float, c_int, c_uchar, c_void};

// Functions that other engines do not have, or have with other types.
pub type Microseconds = unsafe extern "C" fn() -> i64;
pub type Hunk_Alloc = unsafe extern "C" fn(usize, c_int) -> *mut c_void;
pub type Hunk_AllocateTempMemory = unsafe extern "C" fn(usize) -> *mut c_void;
pub type Malloc = unsafe extern "C" fn(usize) -> *mut c_void;
pub type FreeAll = unsafe extern "C" fn();
pub type Cvar_CheckRange = unsafe extern "C" fn(*mut c_void, *const c_char, *const c_char, c_int);
pub type Cvar_SetGroup = unsafe extern "C" fn(*mut c_void, c_int);
pub type Cvar_CheckGroup = unsafe extern "C" fn(c_int) -> c_int;
pub type Cvar_ResetGroup = unsafe extern "C" fn(c_int, QBool);
pub type Cvar_VariableStringBuffer = unsafe extern "C" fn(*const c_char, *mut c_char, c_int);
pub type Cvar_VariableString = unsafe extern "C" fn(*const c_char) -> *const c_char;
/// With `int`: the upper half of the result's register is undefined.
pub type FS_ReadFile = unsafe extern "C" fn(*const c_char, *mut *mut c_void) -> c_int;
pub type CL_SaveJPGToBuffer =
    unsafe extern "C" fn(*mut c_uchar, usize, c_int, c_int, c_int, *mut c_uchar, c_int) -> usize;
pub type CL_SaveJPG = unsafe extern "C" fn(*const c_char, c_int, c_int, c_int, *mut c_uchar, c_int);
pub type CL_LoadJPG =
    unsafe extern "C" fn(*const c_char, *mut *mut c_uchar, *mut c_int, *mut c_int);
pub type CL_IsMinimized = unsafe extern "C" fn() -> QBool;
/// Scale of the console, size of the frames of videos.
pub type CL_SetScaling = unsafe extern "C" fn(c_float, c_int, c_int);
pub type Sys_SetClipboardBitmap = unsafe extern "C" fn(*const c_uchar, c_int);
pub type Com_RealTime = unsafe extern "C" fn(*mut c_void) -> c_int;
pub type GLimp_InitGamma = unsafe extern "C" fn(*mut glconfig_t);
pub type GLimp_SetGamma = unsafe extern "C" fn(*mut c_uchar, *mut c_uchar, *mut c_uchar);
pub type GLimp_Init = unsafe extern "C" fn(*mut glconfig_t);
pub type GLimp_Shutdown = unsafe extern "C" fn(QBool);
pub type GLimp_EndFrame = unsafe extern "C" fn();
pub type GL_GetProcAddress = unsafe extern "C" fn(*const c_char) -> *mut c_void;
/// Opens the window, starts the input code, and keeps the pointer.
pub type VKimp_Init = unsafe extern "C" fn(*mut glconfig_t);
pub type VKimp_Shutdown = unsafe extern "C" fn(QBool);
pub type VK_GetInstanceProcAddr = unsafe extern "C" fn(*mut c_void, *const c_char) -> *mut c_void;
pub type VK_CreateSurface = unsafe extern "C" fn(*mut c_void, *mut u64) -> QBool;

/// With true, the entity's `shaderTime` is an integer, milliseconds.
pub type AddRefEntityToScene = unsafe extern "C" fn(*const refEntity_t, QBool);
/// Start and end of the light, radius, colour.
pub type AddLinearLightToScene =
    unsafe extern "C" fn(*const Vec3C, *const Vec3C, c_float, c_float, c_float, c_float);
pub type ThrottleBackend = unsafe extern "C" fn();
pub type FinishBloom = unsafe extern "C" fn();
pub type SetColorMappings = unsafe extern "C" fn();
pub type CanMinimize = unsafe extern "C" fn() -> QBool;
pub type GetConfig = unsafe extern "C" fn() -> *const glconfig_t;
pub type VertexLighting = unsafe extern "C" fn(QBool);
pub type SyncRender = unsafe extern "C" fn();

/// `cvarValidator_t` of numbers.
pub const CV_FLOAT: c_int = 1;
/// `cvarValidator_t` of whole numbers.
pub const CV_INTEGER: c_int = 2;

abi_struct! {
    const STRUCTURES;

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
        52 4 validator: c_int,
        56 8 mins: *mut c_char,
        64 8 maxs: *mut c_char,
        72 8 description: *mut c_char,
        80 8 next: *mut cvar_t,
        88 8 prev: *mut cvar_t,
        96 8 hashNext: *mut cvar_t,
        104 8 hashPrev: *mut cvar_t,
        112 4 hashIndex: c_int,
        116 4 group: c_int,
    }
}

function_table! {
    const TABLES;

    /// The engine's functions. Entries may be null.
    optional refimport_t = 448 {
        0 Printf,
        8 Error,
        16 Milliseconds,
        24 Microseconds,
        32 Hunk_Alloc,
        40 Hunk_AllocateTempMemory,
        48 Hunk_FreeTempMemory,
        56 Malloc,
        64 Free,
        72 FreeAll,
        80 Cvar_Get,
        88 Cvar_Set,
        96 Cvar_SetValue,
        104 Cvar_CheckRange,
        112 Cvar_SetDescription,
        120 Cvar_SetGroup,
        128 Cvar_CheckGroup,
        136 Cvar_ResetGroup,
        144 Cvar_VariableStringBuffer,
        152 Cvar_VariableString,
        160 Cvar_VariableIntegerValue,
        168 Cmd_AddCommand,
        176 Cmd_RemoveCommand,
        184 Cmd_Argc,
        192 Cmd_Argv,
        200 Cmd_ExecuteText,
        208 CM_ClusterPVS,
        216 CM_DrawDebugSurface,
        224 FS_ReadFile,
        232 FS_FreeFile,
        240 FS_ListFiles,
        248 FS_FreeFileList,
        256 FS_WriteFile,
        264 FS_FileExists,
        272 CIN_UploadCinematic,
        280 CIN_PlayCinematic,
        288 CIN_RunCinematic,
        296 CL_WriteAVIVideoFrame,
        304 CL_SaveJPGToBuffer,
        312 CL_SaveJPG,
        320 CL_LoadJPG,
        328 CL_IsMinimized,
        336 CL_SetScaling,
        344 Sys_SetClipboardBitmap,
        352 Sys_LowPhysicalMemory,
        360 Com_RealTime,
        368 GLimp_InitGamma,
        376 GLimp_SetGamma,
        384 GLimp_Init,
        392 GLimp_Shutdown,
        400 GLimp_EndFrame,
        408 GL_GetProcAddress,
        416 VKimp_Init,
        424 VKimp_Shutdown,
        432 VK_GetInstanceProcAddr,
        440 VK_CreateSurface,
    }

    /// The renderer's functions.
    required refexport_t = 304 {
        0 Shutdown,
        8 BeginRegistration,
        16 RegisterModel,
        24 RegisterSkin,
        32 RegisterShader,
        40 RegisterShaderNoMip,
        48 LoadWorld,
        56 SetWorldVisData,
        64 EndRegistration,
        72 ClearScene,
        80 AddRefEntityToScene,
        88 AddPolyToScene,
        96 LightForPoint,
        104 AddLightToScene,
        112 AddAdditiveLightToScene,
        120 AddLinearLightToScene,
        128 RenderScene,
        136 SetColor,
        144 DrawStretchPic,
        152 DrawStretchRaw,
        160 UploadCinematic,
        168 BeginFrame,
        176 EndFrame,
        184 MarkFragments,
        192 LerpTag,
        200 ModelBounds,
        208 RegisterFont,
        216 RemapShader,
        224 GetEntityToken,
        232 inPVS,
        240 TakeVideoFrame,
        248 ThrottleBackend,
        256 FinishBloom,
        264 SetColorMappings,
        272 CanMinimize,
        280 GetConfig,
        288 VertexLighting,
        296 SyncRender,
    }
}
