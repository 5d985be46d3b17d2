//! The tables of OpenArena's engine (513c538f). Its `refEntity_t` has 36 bytes more at the end, for the eyes of models,
//! which game code for other engines does not hand over: they are not read.

use crate::abi::functions::*;
use crate::abi::layout::{abi_struct, function_table};
use crate::abi::{QBool, Vec3C};
use std::ffi::{c_char, c_float, c_int};

/// Draws an effect of OpenArena 3 at a place, in a direction.
#[allow(non_camel_case_types)] // the engine's name
pub type LFX_ParticleEffect = unsafe extern "C" fn(c_int, *const Vec3C, *const Vec3C);

abi_struct! {
    const STRUCTURES;

    /// A console variable. The engine owns it; the renderer reads it, and clears `modified` of its own variables.
    pub struct cvar_t = 112 {
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
        72 8 next: *mut cvar_t,
        80 8 prev: *mut cvar_t,
        88 8 hashNext: *mut cvar_t,
        96 8 hashPrev: *mut cvar_t,
        104 4 hashIndex: c_int,
    }
}

function_table! {
    const TABLES;

    /// The engine's functions. Entries may be null.
    optional refimport_t = 312 {
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
        96 Cvar_VariableIntegerValue,
        104 Cmd_AddCommand,
        112 Cmd_RemoveCommand,
        120 Cmd_Argc,
        128 Cmd_Argv,
        136 Cmd_ExecuteText,
        144 CM_ClusterPVS,
        152 CM_DrawDebugSurface,
        160 FS_FileIsInPAK,
        168 FS_ReadFile,
        176 FS_FreeFile,
        184 FS_ListFiles,
        192 FS_FreeFileList,
        200 FS_WriteFile,
        208 FS_FileExists,
        216 CIN_UploadCinematic,
        224 CIN_PlayCinematic,
        232 CIN_RunCinematic,
        240 CL_WriteAVIVideoFrame,
        248 IN_Init,
        256 IN_Shutdown,
        264 IN_Restart,
        272 ftol,
        280 Sys_SetEnv,
        288 Sys_GLimpSafeInit,
        296 Sys_GLimpInit,
        304 Sys_LowPhysicalMemory,
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
        128 LFX_ParticleEffect,
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
    }
}
