//! The tables of services, one for each engine.

use std::ffi::c_int;
use std::ptr;

use super::super::abi::{openarena, quake3e, refimport_t, tremulous};
use super::super::{quake3e as own, tremulous as trem};
use super::*;

/// Whose services the renderer is offered, all under one version number.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tables {
    /// 40 services.
    #[default]
    Ioquake3,
    /// The same with four more at the end.
    WorldOfPadman,
    /// 39: without `Cvar_SetDescription`, and variables without a description.
    OpenArena,
    /// 56, most of them elsewhere, some for a window that the engine makes.
    Quake3e,
    /// The same with numbers in place of the last services.
    Quake3eCutOff,
    /// 38: without `ftol` and `Sys_SetEnv`, in C++.
    Tremulous,
}

impl Tables {
    /// The variable `version`.
    pub(in super::super) fn version(self) -> &'static str {
        match self {
            Tables::Ioquake3 => "ioq3 1.36",
            Tables::WorldOfPadman => "wop 1.36",
            Tables::OpenArena => "OpenArena 0.8.8 oa2020",
            Tables::Quake3e | Tables::Quake3eCutOff => "Q3 1.32e",
            Tables::Tremulous => "tremulous",
        }
    }

    /// What `Shutdown` gets when the window is to be closed.
    pub(in super::super) fn close_code(self) -> c_int {
        match self {
            Tables::Quake3e | Tables::Quake3eCutOff => 2,
            _ => 1,
        }
    }
}

/// A service that a renderer of this table must not call: ends the process.
extern "C" fn wrong_service() {
    panic!("a service of an unknown table was called");
}

/// The words of a table.
fn words_of<T, const N: usize>(table: T) -> [usize; 64] {
    const { assert!(size_of::<T>() == N * size_of::<usize>() && N <= 64) };
    let mut words = [0; 64];
    // SAFETY: a structure of optional function pointers alone, as large as `N` words.
    unsafe { ptr::copy_nonoverlapping((&raw const table).cast(), words.as_mut_ptr(), N) };
    words
}

/// The words of the table that `GetRefAPI` gets, with zeros behind them.
pub(in super::super) fn words(tables: Tables) -> [usize; 64] {
    let wrong = (wrong_service as *const ()).expose_provenance();
    match tables {
        Tables::Ioquake3 => words_of::<_, 40>(ioquake3_table()),
        Tables::WorldOfPadman => {
            let mut words = words_of::<_, 40>(ioquake3_table());
            words[40..44].fill(wrong);
            words
        }
        Tables::OpenArena => words_of::<_, 39>(openarena_table()),
        Tables::Quake3e => words_of::<_, 56>(quake3e_table()),
        Tables::Tremulous => words_of::<_, 38>(tremulous_table()),
        Tables::Quake3eCutOff => {
            let mut words = words_of::<_, 56>(quake3e_table());
            words[50..56].fill(1);
            words
        }
    }
}

/// A table with the services that the engines have in common, and others.
macro_rules! table {
    ($table:ident { $($field:ident: $function:expr),* $(,)? }) => {
        $table {
            $($field: Some($function),)*
            Printf: Some(stand_in_printf),
            Error: Some(stand_in_raise),
            Milliseconds: Some(milliseconds),
            Hunk_FreeTempMemory: Some(hunk_free_temporary),
            Free: Some(zone_free),
            Cvar_Get: Some(cvar_get),
            Cvar_Set: Some(cvar_set),
            Cvar_SetValue: Some(cvar_set_value),
            Cvar_VariableIntegerValue: Some(cvar_variable_integer_value),
            Cmd_AddCommand: Some(cmd_add_command),
            Cmd_RemoveCommand: Some(cmd_remove_command),
            Cmd_Argc: Some(cmd_argc),
            Cmd_Argv: Some(cmd_argv),
            Cmd_ExecuteText: Some(cmd_execute_text),
            CM_ClusterPVS: Some(cm_cluster_pvs),
            CM_DrawDebugSurface: Some(cm_draw_debug_surface),
            FS_FreeFile: Some(fs_free_file),
            FS_ListFiles: Some(fs_list_files),
            FS_FreeFileList: Some(fs_free_file_list),
            FS_WriteFile: Some(fs_write_file),
            CIN_UploadCinematic: Some(cin_upload),
            CIN_PlayCinematic: Some(cin_play),
            CIN_RunCinematic: Some(cin_run),
            CL_WriteAVIVideoFrame: Some(write_video_frame),
            Sys_LowPhysicalMemory: Some(low_physical_memory),
        }
    };
}

/// [`table`] with what engines have whose renderer makes the window.
macro_rules! renderer_made_window {
    ($table:ident { $($field:ident: $function:expr),* $(,)? }) => {
        table!($table {
            $($field: $function,)*
            Hunk_Alloc: hunk_alloc,
            Hunk_AllocateTempMemory: hunk_allocate_temporary,
            Malloc: zone_malloc,
            Cvar_CheckRange: cvar_check_range,
            FS_FileIsInPAK: fs_file_is_in_pak,
            FS_ReadFile: fs_read_file,
            IN_Init: input_init,
            IN_Shutdown: nothing,
            IN_Restart: nothing,
            Sys_GLimpSafeInit: nothing,
            Sys_GLimpInit: nothing,
        })
    };
}

fn ioquake3_table() -> refimport_t {
    renderer_made_window!(refimport_t {
        Cvar_SetDescription: cvar_set_description,
        FS_FileExists: fs_file_exists,
        ftol: ftol,
        Sys_SetEnv: set_environment,
    })
}

fn openarena_table() -> openarena::refimport_t {
    use openarena::refimport_t;
    renderer_made_window!(refimport_t {
        FS_FileExists: fs_file_exists,
        ftol: ftol,
        Sys_SetEnv: set_environment,
    })
}

fn tremulous_table() -> tremulous::refimport_t {
    use tremulous::refimport_t;
    renderer_made_window!(refimport_t {
        Cvar_SetDescription: trem::set_description,
        FS_FileExists: trem::file_exists,
    })
}

fn quake3e_table() -> quake3e::refimport_t {
    use quake3e::refimport_t;
    table!(refimport_t {
        FS_FileExists: fs_file_exists,
        Microseconds: own::microseconds,
        Hunk_Alloc: own::hunk_alloc,
        Hunk_AllocateTempMemory: own::hunk_allocate_temporary,
        Malloc: own::zone_malloc,
        FreeAll: own::free_all,
        Cvar_CheckRange: own::cvar_check_range,
        Cvar_SetDescription: cvar_set_description,
        Cvar_SetGroup: own::cvar_set_group,
        Cvar_CheckGroup: own::cvar_check_group,
        Cvar_ResetGroup: own::cvar_reset_group,
        Cvar_VariableStringBuffer: own::cvar_variable_string_buffer,
        Cvar_VariableString: own::cvar_variable_string,
        FS_ReadFile: own::fs_read_file,
        CL_SaveJPGToBuffer: own::save_jpeg_to_buffer,
        CL_SaveJPG: own::save_jpeg,
        CL_LoadJPG: own::load_jpeg,
        CL_IsMinimized: own::is_minimized,
        CL_SetScaling: own::set_scaling,
        Sys_SetClipboardBitmap: own::set_clipboard,
        Com_RealTime: own::real_time,
        GLimp_InitGamma: own::opengl_config,
        GLimp_SetGamma: own::set_gamma,
        GLimp_Init: own::opengl_config,
        GLimp_Shutdown: own::opengl_shutdown,
        GLimp_EndFrame: own::opengl_end_frame,
        GL_GetProcAddress: own::opengl_function,
        VKimp_Init: own::open_window,
        VKimp_Shutdown: own::close_window,
        VK_GetInstanceProcAddr: own::instance_function,
        VK_CreateSurface: own::create_surface,
    })
}
