//! The tables of GrangerHub's Tremulous (cb4447dc), an engine in C++: its `bool`s have one byte.

#![allow(non_camel_case_types, missing_docs)] // the engine's names

use crate::abi::functions::*;
use crate::abi::layout::{abi_struct, function_table};
use std::ffi::{c_char, c_float, c_int};

pub type BeginRegistration = unsafe extern "C" fn(*mut glconfig_t);
/// Clips later 2D pictures: left, top, right, bottom, window pixels. Null and empty regions: no clipping.
pub type SetClipRegion = unsafe extern "C" fn(*const [c_float; 4]);

abi_struct! {
    const STRUCTURES;

    /// A console variable. The engine owns it; the renderer reads it, and clears `modified` of its own variables.
    pub struct cvar_t = 112 {
        0 8 name: *mut c_char,
        8 8 string: *mut c_char,
        16 8 resetString: *mut c_char,
        24 8 latchedString: *mut c_char,
        32 4 flags: c_int,
        36 1 modified: u8,
        40 4 modificationCount: c_int,
        44 4 value: c_float,
        48 4 integer: c_int,
        52 1 validate: u8,
        53 1 integral: u8,
        56 4 min: c_float,
        60 4 max: c_float,
        64 8 description: *mut c_char,
        72 8 next: *mut cvar_t,
        80 8 prev: *mut cvar_t,
        88 8 hashNext: *mut cvar_t,
        96 8 hashPrev: *mut cvar_t,
        104 4 hashIndex: c_int,
    }

    /// The renderer's properties: ioquake3's up to `windowAspect`.
    pub struct glconfig_t = 11340 {
        0 11316 common: [u8; 11316],
        11316 4 displayAspect: c_float,
        11320 4 displayFrequency: c_int,
        11324 4 isFullscreen: c_int,
        11328 4 stereoEnabled: c_int,
        11332 4 textureFilterAnisotropic: c_int,
        11336 4 maxAnisotropy: c_int,
    }
}

function_table! {
    const TABLES;

    /// The engine's functions. Entries may be null.
    optional refimport_t = 304 {
        0 Printf,
        8 Error,
        16 Milliseconds,
        24 Hunk_Alloc,
        32 Hunk_AllocateTempMemory,
        40 Hunk_FreeTempMemory,
        48 Malloc,
        56 Free,
        64 Cvar_Get,
        72 Cvar_Set,
        80 Cvar_SetValue,
        88 Cvar_CheckRange,
        96 Cvar_SetDescription,
        104 Cvar_VariableIntegerValue,
        112 Cmd_AddCommand,
        120 Cmd_RemoveCommand,
        128 Cmd_Argc,
        136 Cmd_Argv,
        144 Cmd_ExecuteText,
        152 CM_ClusterPVS,
        160 CM_DrawDebugSurface,
        168 FS_FileIsInPAK,
        176 FS_ReadFile,
        184 FS_FreeFile,
        192 FS_ListFiles,
        200 FS_FreeFileList,
        208 FS_WriteFile,
        216 FS_FileExists,
        224 CIN_UploadCinematic,
        232 CIN_PlayCinematic,
        240 CIN_RunCinematic,
        248 CL_WriteAVIVideoFrame,
        256 IN_Init,
        264 IN_Shutdown,
        272 IN_Restart,
        280 Sys_GLimpSafeInit,
        288 Sys_GLimpInit,
        296 Sys_LowPhysicalMemory,
    }

    /// The renderer's functions.
    required refexport_t = 248 {
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
        120 RenderScene,
        128 SetColor,
        136 SetClipRegion,
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
    }
}
