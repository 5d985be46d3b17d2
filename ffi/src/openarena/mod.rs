//! The front end for OpenArena's own engine.

pub mod abi;

use crate::abi::Vec3C;
use crate::engine::{self, Engine, FrontEnd, Table, renderer_made_window, variable_layout};
use crate::exports::exports;
use crate::{lifecycle, scene};
use abi::{cvar_t, refexport_t, refimport_t};
use relight::Precedence;
use std::ffi::{c_int, c_void};
use std::ptr;

/// OpenArena's engine.
pub(crate) static FRONT_END: FrontEnd = FrontEnd {
    name: "openarena",
    files: &[],
    marker: None,
    recognizes: Some(|engine| engine.cvar_text(c"version").starts_with("OpenArena")),
    services: size_of::<refimport_t>() / size_of::<usize>(),
    called: 34,
    install,
    exports: || ptr::from_ref(&EXPORTS).cast(),
    functions: size_of::<refexport_t>() / size_of::<usize>(),
    opengl: &["openarena1", "opengl1"],
    libraries: &["renderer_NAME_ARCH", "renderer_NAME"],
    folders: &[],
    base_game: c"com_basegame",
    defaults: &[
        ("r_detailFade", "1"),
        ("r_fullscreen", "1"),
        ("r_mode", "-2"),
        ("r_textureMode", "GL_LINEAR_MIPMAP_NEAREST"),
        ("r_specMode", "1"),
    ],
    owned: &[],
    scripts: &[],
    precedence: Precedence::First,
};

/// Result of every `GetRefAPI`; the engine copies it.
static EXPORTS: refexport_t = exports!(refexport_t {
    Shutdown: lifecycle::shutdown,
    BeginRegistration: lifecycle::begin_registration,
    AddRefEntityToScene: scene::add_ref_entity,
    LFX_ParticleEffect: particle_effect,
});

/// `re.LFX_ParticleEffect`: effects of OpenArena 3, which this renderer does not draw.
///
/// # Safety
/// None: the pointers are not used, and the call always returns.
unsafe extern "C" fn particle_effect(_: c_int, _: *const Vec3C, _: *const Vec3C) {}

unsafe fn install(imports: *const c_void) -> Engine {
    // SAFETY: this engine's table by the contract of `FrontEnd::install`. It lies on the engine's stack: it is copied.
    let from = unsafe { imports.cast::<refimport_t>().read_unaligned() };
    let table = Table {
        front_end: Some(&FRONT_END),
        variable: variable_layout!(cvar_t),
        ..renderer_made_window!(from)
    };
    // SAFETY: the contract of `FrontEnd::install` is that of `engine::install`.
    unsafe { engine::install(table) }
}
