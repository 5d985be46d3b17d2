//! Types of the functions that engines and renderers exchange. An engine whose function has another type declares that
//! type in its own folder.

#![allow(non_camel_case_types, missing_docs)] // the engines' names

use super::{
    QBool, Vec3C, fontInfo_t, glconfig_t, markFragment_t, orientation_t, polyVert_t, refEntity_t,
    refdef_t,
};
use std::ffi::{c_char, c_float, c_int, c_long, c_uchar, c_void};

// Services of the engine.
pub type Printf = unsafe extern "C" fn(c_int, *const c_char, ...);
pub type Error = unsafe extern "C" fn(c_int, *const c_char, ...);
pub type Milliseconds = unsafe extern "C" fn() -> c_int;
pub type Hunk_Alloc = unsafe extern "C" fn(c_int, c_int) -> *mut c_void;
pub type Hunk_AllocateTempMemory = unsafe extern "C" fn(c_int) -> *mut c_void;
pub type Hunk_FreeTempMemory = unsafe extern "C" fn(*mut c_void);
pub type Malloc = unsafe extern "C" fn(c_int) -> *mut c_void;
pub type Free = unsafe extern "C" fn(*mut c_void);
pub type Cvar_Get = unsafe extern "C" fn(*const c_char, *const c_char, c_int) -> *mut c_void;
pub type Cvar_Set = unsafe extern "C" fn(*const c_char, *const c_char);
pub type Cvar_SetValue = unsafe extern "C" fn(*const c_char, c_float);
pub type Cvar_CheckRange = unsafe extern "C" fn(*mut c_void, c_float, c_float, QBool);
pub type Cvar_SetDescription = unsafe extern "C" fn(*mut c_void, *const c_char);
pub type Cvar_VariableIntegerValue = unsafe extern "C" fn(*const c_char) -> c_int;
pub type Cmd_AddCommand = unsafe extern "C" fn(*const c_char, Option<unsafe extern "C" fn()>);
pub type Cmd_RemoveCommand = unsafe extern "C" fn(*const c_char);
pub type Cmd_Argc = unsafe extern "C" fn() -> c_int;
pub type Cmd_Argv = unsafe extern "C" fn(c_int) -> *mut c_char;
pub type Cmd_ExecuteText = unsafe extern "C" fn(c_int, *const c_char);
pub type CM_ClusterPVS = unsafe extern "C" fn(c_int) -> *mut c_uchar;
pub type CM_DrawDebugSurface =
    unsafe extern "C" fn(Option<unsafe extern "C" fn(c_int, c_int, *mut c_float)>);
pub type FS_FileIsInPAK = unsafe extern "C" fn(*const c_char, *mut c_int) -> c_int;
pub type FS_ReadFile = unsafe extern "C" fn(*const c_char, *mut *mut c_void) -> c_long;
pub type FS_FreeFile = unsafe extern "C" fn(*mut c_void);
pub type FS_ListFiles =
    unsafe extern "C" fn(*const c_char, *const c_char, *mut c_int) -> *mut *mut c_char;
pub type FS_FreeFileList = unsafe extern "C" fn(*mut *mut c_char);
pub type FS_WriteFile = unsafe extern "C" fn(*const c_char, *const c_void, c_int);
pub type FS_FileExists = unsafe extern "C" fn(*const c_char) -> QBool;
pub type CIN_UploadCinematic = unsafe extern "C" fn(c_int);
pub type CIN_PlayCinematic =
    unsafe extern "C" fn(*const c_char, c_int, c_int, c_int, c_int, c_int) -> c_int;
pub type CIN_RunCinematic = unsafe extern "C" fn(c_int) -> c_int;
pub type CL_WriteAVIVideoFrame = unsafe extern "C" fn(*const c_uchar, c_int);
pub type IN_Init = unsafe extern "C" fn(*mut c_void);
pub type IN_Shutdown = unsafe extern "C" fn();
pub type IN_Restart = unsafe extern "C" fn();
pub type ftol = unsafe extern "C" fn(c_float) -> c_long;
pub type Sys_SetEnv = unsafe extern "C" fn(*const c_char, *const c_char);
pub type Sys_GLimpSafeInit = unsafe extern "C" fn();
pub type Sys_GLimpInit = unsafe extern "C" fn();
pub type Sys_LowPhysicalMemory = unsafe extern "C" fn() -> QBool;

// Functions of the renderer.
pub type Shutdown = unsafe extern "C" fn(QBool);
pub type BeginRegistration = unsafe extern "C" fn(*mut glconfig_t);
pub type RegisterModel = unsafe extern "C" fn(*const c_char) -> c_int;
pub type RegisterSkin = unsafe extern "C" fn(*const c_char) -> c_int;
pub type RegisterShader = unsafe extern "C" fn(*const c_char) -> c_int;
pub type RegisterShaderNoMip = unsafe extern "C" fn(*const c_char) -> c_int;
pub type LoadWorld = unsafe extern "C" fn(*const c_char);
pub type SetWorldVisData = unsafe extern "C" fn(*const c_uchar);
pub type EndRegistration = unsafe extern "C" fn();
pub type ClearScene = unsafe extern "C" fn();
pub type AddRefEntityToScene = unsafe extern "C" fn(*const refEntity_t);
pub type AddPolyToScene = unsafe extern "C" fn(c_int, c_int, *const polyVert_t, c_int);
pub type LightForPoint =
    unsafe extern "C" fn(*const Vec3C, *mut Vec3C, *mut Vec3C, *mut Vec3C) -> c_int;
pub type AddLightToScene = unsafe extern "C" fn(*const Vec3C, c_float, c_float, c_float, c_float);
pub type AddAdditiveLightToScene =
    unsafe extern "C" fn(*const Vec3C, c_float, c_float, c_float, c_float);
pub type RenderScene = unsafe extern "C" fn(*const refdef_t);
pub type SetColor = unsafe extern "C" fn(*const [c_float; 4]);
pub type DrawStretchPic = unsafe extern "C" fn(
    c_float,
    c_float,
    c_float,
    c_float,
    c_float,
    c_float,
    c_float,
    c_float,
    c_int,
);
pub type DrawStretchRaw =
    unsafe extern "C" fn(c_int, c_int, c_int, c_int, c_int, c_int, *const c_uchar, c_int, QBool);
pub type UploadCinematic =
    unsafe extern "C" fn(c_int, c_int, c_int, c_int, *const c_uchar, c_int, QBool);
pub type BeginFrame = unsafe extern "C" fn(c_int);
pub type EndFrame = unsafe extern "C" fn(*mut c_int, *mut c_int);
pub type MarkFragments = unsafe extern "C" fn(
    c_int,
    *const Vec3C,
    *const Vec3C,
    c_int,
    *mut Vec3C,
    c_int,
    *mut markFragment_t,
) -> c_int;
pub type LerpTag =
    unsafe extern "C" fn(*mut orientation_t, c_int, c_int, c_int, c_float, *const c_char) -> c_int;
pub type ModelBounds = unsafe extern "C" fn(c_int, *mut Vec3C, *mut Vec3C);
pub type RegisterFont = unsafe extern "C" fn(*const c_char, c_int, *mut fontInfo_t);
pub type RemapShader = unsafe extern "C" fn(*const c_char, *const c_char, *const c_char);
pub type GetEntityToken = unsafe extern "C" fn(*mut c_char, c_int) -> QBool;
pub type inPVS = unsafe extern "C" fn(*const Vec3C, *const Vec3C) -> QBool;
pub type TakeVideoFrame = unsafe extern "C" fn(c_int, c_int, *mut c_uchar, *mut c_uchar, QBool);
