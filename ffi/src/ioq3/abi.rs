//! The tables of Debian's ioquake3 (1.36+u20221123, upstream 70d07d91) and of ioquake3's HEAD, which has the same layouts.

use crate::abi::QBool;
use crate::abi::functions::*;
use crate::abi::layout::{abi_struct, function_table};
use std::ffi::{c_char, c_float, c_int};

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
}

function_table! {
    const TABLES;

    /// The engine's functions. Entries may be null.
    optional refimport_t = 320 {
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
        280 ftol,
        288 Sys_SetEnv,
        296 Sys_GLimpSafeInit,
        304 Sys_GLimpInit,
        312 Sys_LowPhysicalMemory,
    }

    /// The renderer's functions.
    required refexport_t = 240 {
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
        136 DrawStretchPic,
        144 DrawStretchRaw,
        152 UploadCinematic,
        160 BeginFrame,
        168 EndFrame,
        176 MarkFragments,
        184 LerpTag,
        192 ModelBounds,
        200 RegisterFont,
        208 RemapShader,
        216 GetEntityToken,
        224 inPVS,
        232 TakeVideoFrame,
    }
}
