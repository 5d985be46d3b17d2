//! The front end for GrangerHub's Tremulous. Its game data were not at hand: it was tried with the stand-in engine alone.

pub mod abi;

use crate::boundary::entry;
use crate::engine::{self, Engine, FrontEnd, Table, renderer_made_window, variable_layout};
use crate::exports::exports;
use crate::session::with_renderer;
use crate::{lifecycle, scene};
use abi::{cvar_t, glconfig_t, refexport_t, refimport_t};
use relight::Precedence;
use std::ffi::{c_float, c_void};
use std::mem::MaybeUninit;
use std::ptr;

/// GrangerHub's Tremulous.
pub(crate) static FRONT_END: FrontEnd = FrontEnd {
    name: "tremulous",
    files: &[],
    marker: None,
    recognizes: Some(|engine| engine.cvar_text(c"version") == "tremulous"),
    services: size_of::<refimport_t>() / size_of::<usize>(),
    called: 35,
    install,
    exports: || ptr::from_ref(&EXPORTS).cast(),
    functions: size_of::<refexport_t>() / size_of::<usize>(),
    opengl: &["opengl1", "opengl2"],
    libraries: &["renderer_NAME"],
    folders: &[],
    base_game: c"fs_basegame",
    defaults: &[("r_mode", "-2"), ("r_znear", "1")],
    owned: &[],
    scripts: &[],
    precedence: Precedence::First,
};

/// Result of every `GetRefAPI`; the engine copies it.
static EXPORTS: refexport_t = exports!(refexport_t {
    Shutdown: lifecycle::shutdown,
    BeginRegistration: begin_registration,
    AddRefEntityToScene: scene::add_ref_entity,
    SetClipRegion: set_clip_region,
});

/// `re.BeginRegistration`.
///
/// # Safety
/// That of [`lifecycle::begin_registration`], with room for this engine's structure.
unsafe extern "C" fn begin_registration(out: *mut glconfig_t) {
    let mut shared = MaybeUninit::<crate::abi::glconfig_t>::zeroed();
    // SAFETY: room for the structure, which outlives the call; nothing here has a destructor, in case of an error.
    unsafe { lifecycle::begin_registration(shared.as_mut_ptr()) };
    if out.is_null() {
        return;
    }
    // SAFETY: `shared` is numbers and characters alone, for which zero is a value, and its first 11316 bytes are those of
    // the engine's structure, for which there is room by this function's contract.
    unsafe {
        let shared = shared.assume_init();
        out.write_unaligned(glconfig_t {
            common: ptr::from_ref(&shared).cast::<[u8; 11316]>().read(),
            displayAspect: shared.windowAspect,
            displayFrequency: shared.displayFrequency,
            isFullscreen: shared.isFullscreen,
            stereoEnabled: shared.stereoEnabled,
            textureFilterAnisotropic: 1,
            maxAnisotropy: 16,
        });
    }
}

/// `re.SetClipRegion`.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract). `region` must be null or point at four floats, which may have any
/// value.
unsafe extern "C" fn set_clip_region(region: *const [c_float; 4]) {
    entry(|| {
        // SAFETY: not null, so it is four floats by this function's contract.
        let region = (!region.is_null()).then(|| unsafe { region.read_unaligned() });
        with_renderer(|_, front| {
            front.clip_region = region;
            Ok(())
        })
    });
}

unsafe fn install(imports: *const c_void) -> Engine {
    // SAFETY: this engine's table by the contract of `FrontEnd::install`. It lies on the engine's stack: it is copied.
    let from = unsafe { imports.cast::<refimport_t>().read_unaligned() };
    let table = Table {
        front_end: Some(&FRONT_END),
        variable: variable_layout!(cvar_t),
        cvar_set_description: from.Cvar_SetDescription,
        ..renderer_made_window!(from)
    };
    // SAFETY: the contract of `FrontEnd::install` is that of `engine::install`.
    unsafe { engine::install(table) }
}
