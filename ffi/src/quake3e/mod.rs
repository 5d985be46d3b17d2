//! The front end for Quake3e and its forks with the same tables.
//!
//! The engine makes the window and its Vulkan surface, keeps the window or the device over a `Shutdown` by its code,
//! and limits variables by texts. Its groups of variables have no other use than to ask whether any of a group has
//! changed; all variables are read in every frame anyway.

pub mod abi;
mod exports;

use crate::abi::{QBool, glconfig_t};
use crate::engine::{
    self, Engine, FrontEnd, MainThread, Table, WindowServices, common_services, variable_layout,
};
use abi::{CV_FLOAT, CV_INTEGER, cvar_t, refexport_t, refimport_t};
use exports::EXPORTS;
use relight::Precedence;
use std::cell::UnsafeCell;
use std::ffi::{c_char, c_float, c_long, c_void};
use std::io::Write;
use std::ptr;

/// Quake3e.
pub(crate) static FRONT_END: FrontEnd = FrontEnd {
    name: "quake3e",
    files: &["quake3e_", "quake3e-"],
    marker: Some("E3Q_enecSoTthgiLraeniLddA_R_part"),
    recognizes: None,
    services: size_of::<refimport_t>() / size_of::<usize>(),
    called: size_of::<refimport_t>() / size_of::<usize>(),
    install,
    exports: || ptr::from_ref(&EXPORTS).cast(),
    functions: size_of::<refexport_t>() / size_of::<usize>(),
    opengl: &["opengl", "opengl2"],
    libraries: &["quake3e_NAME_ARCH"],
    folders: &[],
    base_game: c"fs_basegame",
    defaults: &[
        ("r_dlightMode", "1"),
        ("r_flareFade", "10"),
        ("r_lodbias", "-2"),
        ("r_picmip", "0"),
        ("r_subdivisions", "1"),
        ("r_textureMode", "GL_LINEAR_MIPMAP_NEAREST"),
        ("r_ext_max_anisotropy", "8"),
        ("r_ext_texture_filter_anisotropic", "1"),
    ],
    owned: &[
        "r_allowSoftwareGL",
        "r_colorbits",
        "r_customheight",
        "r_customPixelAspect",
        "r_customwidth",
        "r_depthbits",
        "r_displayRefresh",
        "r_drawBuffer",
        "r_fullscreen",
        "r_inGameVideo",
        "r_mode",
        "r_noborder",
        "r_stencilbits",
        "r_stereoEnabled",
        "r_swapInterval",
    ],
    scripts: &[c".shaderx"],
    precedence: Precedence::Last,
};

/// The engine's table, for the services with other types than ioquake3's.
static IMPORTS: MainThread<Option<refimport_t>> = MainThread(UnsafeCell::new(None));

/// What `GetConfig` returns; the engine writes to it while the window is open.
// SAFETY: numbers and characters alone, for which zero is a value.
static CONFIG: MainThread<glconfig_t> = MainThread(UnsafeCell::new(unsafe { std::mem::zeroed() }));

/// One entry of the engine's table.
fn service<F>(pick: impl FnOnce(&refimport_t) -> Option<F>) -> Option<F> {
    // SAFETY: main thread only; the reference ends with this expression.
    unsafe { (*IMPORTS.0.get()).as_ref().and_then(pick) }
}

unsafe fn install(imports: *const c_void) -> Engine {
    // SAFETY: this engine's table by the contract of `FrontEnd::install`. It lies on the engine's stack: it is copied.
    let from = unsafe { imports.cast::<refimport_t>().read_unaligned() };
    // SAFETY: this runs on the main thread while no other call of ours runs, by the same contract.
    unsafe { *IMPORTS.0.get() = Some(from) };
    let window = match (
        from.VKimp_Init,
        from.VKimp_Shutdown,
        from.VK_GetInstanceProcAddr,
        from.VK_CreateSurface,
    ) {
        (Some(open), Some(close), Some(instance_function), Some(create_surface)) => {
            Some(WindowServices {
                open,
                close,
                instance_function,
                create_surface,
                is_minimized: from.CL_IsMinimized,
                config: CONFIG.0.get(),
            })
        }
        _ => None,
    };
    let table = Table {
        front_end: Some(&FRONT_END),
        variable: variable_layout!(cvar_t),
        cvar_check_range: from.Cvar_CheckRange.map(|_| check_range as _),
        cvar_set_description: from.Cvar_SetDescription,
        cvar_variable_string: from.Cvar_VariableString,
        fs_read_file: from.FS_ReadFile.map(|_| read_file as _),
        free_all: from.FreeAll,
        window,
        ..common_services!(from)
    };
    // SAFETY: the contract of `FrontEnd::install` is that of `engine::install`.
    unsafe { engine::install(table) }
}

/// `Cvar_CheckRange` with limits as texts.
///
/// # Safety
/// `cvar` must be a variable of the engine.
unsafe extern "C" fn check_range(cvar: *mut c_void, min: c_float, max: c_float, whole: QBool) {
    let kind = if whole == 0 { CV_FLOAT } else { CV_INTEGER };
    // On the stack, because the service may not return.
    let (mut low, mut high) = ([0u8; 64], [0u8; 64]);
    for (text, limit) in [(&mut low, min), (&mut high, max)] {
        // 50 characters at most; the rest stays zero
        let written = write!(text.get_mut(..63).unwrap_or_default(), "{limit}");
        debug_assert!(written.is_ok());
    }
    if let Some(f) = service(|t| t.Cvar_CheckRange) {
        // SAFETY: the engine's own variable; both texts are NUL-terminated, and the engine copies them.
        unsafe { f(cvar, low.as_ptr().cast(), high.as_ptr().cast(), kind) }
    }
}

/// `FS_ReadFile` with a result of the width of a register.
///
/// # Safety
/// As the engine's: a NUL-terminated name, null or a place for the address of the contents.
unsafe extern "C" fn read_file(name: *const c_char, buffer: *mut *mut c_void) -> c_long {
    // SAFETY: the arguments fulfil the engine's contract by this function's.
    service(|t| t.FS_ReadFile).map_or(-1, |f| unsafe { f(name, buffer) }.into())
}
