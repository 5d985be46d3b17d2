//! What Tremulous does otherwise than ioquake3: `bool`s of one byte, its own `glconfig_t`, a clip region.

use std::ffi::{c_char, c_int, c_void};
use std::mem::{MaybeUninit, offset_of};

use super::abi::{cvar_t, glconfig_t, tremulous};
use super::imports::{self, text};
use super::{Engine, Raised, call};

/// The functions of a renderer for Tremulous.
///
/// # Panics
/// With another engine's tables.
fn exports() -> tremulous::refexport_t {
    imports::with(|s| s.tremulous)
        .flatten()
        .expect("Tremulous' tables")
}

/// `FS_FileExists`: the upper bytes of the register hold something else.
pub(super) extern "C" fn file_exists(name: *const c_char) -> c_int {
    let name = text(name);
    let exists = imports::with(|s| s.files.exists_at_home(&name)).unwrap_or(false);
    c_int::from(exists) | 0x5A00
}

/// `Cvar_SetDescription`: in a variable, the place of ioquake3's member is `next`.
pub(super) extern "C" fn set_description(cvar: *mut c_void, description: *const c_char) {
    let cvar = cvar.cast::<cvar_t>();
    let description = text(description);
    let known = imports::with(|s| s.cvars.set_description(cvar, &description));
    if known == Some(true) {
        // SAFETY: one of our own variables.
        unsafe { (*cvar).description = cvar.cast() };
    }
}

/// `BeginRegistration` into ioquake3's structure.
///
/// # Safety
/// The renderer's library must be loaded, and `out` have room.
pub(super) unsafe extern "C" fn begin_registration(out: *mut glconfig_t) {
    const SHARED: usize = offset_of!(tremulous::glconfig_t, displayAspect);
    let begin = exports().BeginRegistration;
    let mut config = MaybeUninit::<tremulous::glconfig_t>::zeroed();
    // SAFETY: room for the structure, which is numbers alone, for which zero is a value; the first bytes of both
    // structures are equal, and the caller has room for his.
    unsafe {
        begin(config.as_mut_ptr());
        let config = config.assume_init();
        out.cast::<u8>()
            .copy_from_nonoverlapping((&raw const config.common).cast(), SHARED);
        (*out).displayFrequency = config.displayFrequency;
        (*out).isFullscreen = config.isFullscreen;
        (*out).stereoEnabled = config.stereoEnabled;
        if config.displayAspect != (*out).windowAspect || config.maxAnisotropy < 1 {
            imports::violation("the end of Tremulous' glconfig_t is wrong".to_owned());
        }
    }
}

impl Engine {
    /// Tremulous': clips later pictures to left, top, right, bottom.
    pub fn set_clip_region(&mut self, region: Option<[f32; 4]>) -> Result<(), Raised> {
        let set = exports().SetClipRegion;
        let region = region.as_ref().map_or(std::ptr::null(), |r| &raw const *r);
        // SAFETY: null or four numbers; the library is loaded.
        call(move || unsafe { set(region) })
    }
}
