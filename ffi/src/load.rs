//! `GetRefAPI`: recognizes the engine, resets the state and returns the functions for it.

use crate::engine::{self, Table};
use crate::{fallback, lifecycle, logging, recognize, session, system, window};
use std::ffi::{c_int, c_void};
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::ptr;

/// `REF_API_VERSION` of the supported engines. Other engines use the same number with other tables.
const API_VERSION: c_int = 8;

/// `GetRefAPI`: resets all state for the engine of `imports` and returns our functions, or null if the engine has
/// another version of the interface or unknown tables. Without usable Vulkan it returns the functions of the engine's
/// own OpenGL renderer.
///
/// # Safety
/// `imports` must be null or point at the import table of an engine, whose first entry is `Printf`, and whose functions
/// must be callable until the process ends. The call must come from the engine's main thread while none of our
/// functions runs.
pub unsafe fn get_ref_api(api_version: c_int, imports: *const c_void) -> *const c_void {
    // SAFETY: null or an engine's table by this function's contract.
    let Some(printf) = (unsafe { recognize::printf(imports) }) else {
        // Nothing is lost without a reader.
        let _ = writeln!(
            std::io::stderr(),
            "Relight: GetRefAPI got no table of services"
        );
        return ptr::null();
    };
    let only_print = Table {
        printf: Some(printf),
        ..Table::EMPTY
    };
    // SAFETY: an engine calls this on its main thread, with none of our functions running.
    let engine = unsafe { engine::install(only_print) };
    let refused = if api_version == API_VERSION {
        // SAFETY: the table of an engine with our version number.
        unsafe { recognize::recognize(imports) }.err()
    } else {
        Some(format!(
            "Relight supports version {API_VERSION} of the renderer interface, this engine has version {api_version}"
        ))
    };
    if let Some(line) = refused {
        // SAFETY: as above. The table of a candidate may be installed.
        unsafe { engine::install(only_print) };
        engine.say(&format!("{line}\n"));
        return ptr::null();
    }
    let exports = engine
        .front_end()
        .map_or(ptr::null(), |front| (front.exports)());
    logging::install();
    system::pin();
    let prepared = catch_unwind(AssertUnwindSafe(|| {
        if session::is_kept() {
            return Ok(());
        }
        session::reset();
        // A window that an abandoned renderer left open.
        window::mark_stale();
        lifecycle::probe(engine)
    }));
    let problem = match prepared {
        Ok(Ok(())) => return exports,
        Ok(Err(problem)) => problem,
        Err(_) => format!("looking for Vulkan failed{}", logging::take_panic_place()),
    };
    engine.say(&format!("Relight needs Vulkan 1.2: {problem}\n"));
    // SAFETY: the engine's import table, which it keeps until this call returns; renderers copy it.
    let substitute = unsafe { fallback::load(engine, api_version, imports) };
    // Without any renderer, our functions: `BeginRegistration` reports the missing item and ends the game.
    substitute.unwrap_or(exports)
}
