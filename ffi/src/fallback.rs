//! Fallback for machines without usable Vulkan: loads the engine's own OpenGL renderer.
//!
//! The engine calls `GetRefAPI` before any window exists, and tries no other library once ours is loaded. Therefore the
//! other renderer is loaded there, and its functions are returned instead of ours.

use crate::abi::functions::Shutdown;
use crate::engine::{Engine, FrontEnd, MainThread};
use crate::system;
use libloading::Library;
use std::cell::UnsafeCell;
use std::ffi::{c_int, c_void};
use std::path::PathBuf;
use std::sync::{Mutex, PoisonError};

type GetRefApi = unsafe extern "C" fn(c_int, *const c_void) -> *const c_void;

/// The substitute's table, with our `Shutdown` as the first entry: the engine reads it. Larger than any engine's.
static EXPORTS: MainThread<[usize; 64]> = MainThread(UnsafeCell::new([0; 64]));

/// The substitute renderer.
struct Substitute {
    /// Closed after the engine's last `Shutdown`, as the engine would do.
    _library: Library,
    shutdown: Shutdown,
}

static SUBSTITUTE: Mutex<Option<Substitute>> = Mutex::new(None);

fn substitute() -> std::sync::MutexGuard<'static, Option<Substitute>> {
    SUBSTITUTE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The architecture, as these engines spell it in file names.
fn engine_architecture() -> &'static str {
    match std::env::consts::ARCH {
        "aarch64" => "arm64",
        other => other,
    }
}

/// File names to try, best first.
fn file_names(front: &FrontEnd) -> Vec<String> {
    let (arch, suffix) = (engine_architecture(), std::env::consts::DLL_SUFFIX);
    let file =
        |name: &str, pattern: &str| pattern.replace("NAME", name).replace("ARCH", arch) + suffix;
    let names = front.opengl.iter();
    names
        .flat_map(|name| {
            front
                .libraries
                .iter()
                .map(move |pattern| file(name, pattern))
        })
        .collect()
}

/// Folders to search, in order, each once.
fn folders(front: &FrontEnd) -> Vec<PathBuf> {
    let folder_of = |file: PathBuf| file.parent().map(PathBuf::from);
    let own = system::own_file().and_then(folder_of);
    let program = std::env::args_os().next().map(PathBuf::from);
    let mut list: Vec<PathBuf> = Vec::new();
    // On Windows anyone may create these folders.
    let installed = front.folders.iter().filter(|_| cfg!(unix));
    let installed = installed.map(PathBuf::from);
    for folder in [own, program.and_then(folder_of)]
        .into_iter()
        .flatten()
        .chain(installed)
    {
        if !list.contains(&folder) {
            list.push(folder);
        }
    }
    list
}

/// Loads another renderer and returns its table, with `Shutdown` replaced by ours.
///
/// # Safety
/// `table` must be the engine's import table, the argument of `GetRefAPI`, and this the engine's main thread.
pub unsafe fn load(
    engine: Engine,
    api_version: c_int,
    table: *const c_void,
) -> Option<*const c_void> {
    let front = engine.front_end()?;
    // SAFETY: `table` is the engine's import table by this function's contract.
    unsafe { load_from(&folders(front), front, engine, api_version, table) }
}

/// [`load`] from given folders.
///
/// # Safety
/// `table` must be the engine's import table, the argument of `GetRefAPI`, or valid for the renderers in `folders`.
unsafe fn load_from(
    folders: &[PathBuf],
    front: &FrontEnd,
    engine: Engine,
    api_version: c_int,
    table: *const c_void,
) -> Option<*const c_void> {
    // A substitute that was never shut down must not be loaded twice.
    drop(substitute().take());
    for folder in folders {
        for name in file_names(front) {
            let path = folder.join(name);
            if !path.is_file() {
                continue;
            }
            // SAFETY: a renderer of the engine; its initialisers are safe at load time.
            let library = match unsafe { Library::new(&path) } {
                Ok(library) => library,
                Err(error) => {
                    engine.say(&format!("{}: {error}\n", path.display()));
                    continue;
                }
            };
            // SAFETY: only its presence is tested.
            if unsafe { library.get::<*const u8>(crate::MARK) }.is_ok() {
                continue;
            }
            // SAFETY: the symbol has this signature in every renderer of this engine.
            let Ok(get_ref_api) =
                (unsafe { library.get::<GetRefApi>(b"GetRefAPI\0") }).map(|symbol| *symbol)
            else {
                continue;
            };
            // SAFETY: `table` is valid for this renderer by this function's contract; it copies the table.
            let exports = unsafe { get_ref_api(api_version, table) };
            if exports.is_null() {
                continue;
            }
            engine.say(&format!("Relight: using {} instead\n", path.display()));
            // SAFETY: not null, so it is the renderer's static table, which is valid as long as its library is loaded; its first
            // entry is `Shutdown`.
            let theirs = unsafe { exports.cast::<Shutdown>().read_unaligned() };
            *substitute() = Some(Substitute {
                _library: library,
                shutdown: theirs,
            });
            let ours = EXPORTS.0.get().cast::<usize>();
            // SAFETY: both tables have that many entries; ours is static, and used on this thread only.
            unsafe {
                ours.copy_from_nonoverlapping(exports.cast(), front.functions.min(64));
                ours.cast::<Shutdown>().write(shutdown);
            }
            return Some(ours.cast_const().cast());
        }
    }
    None
}

/// `Shutdown` of the substitute. Closes its library after the last `Shutdown`: the engine unloads only ours, and the
/// substitute must be loaded anew next time.
///
/// # Safety
/// The [call contract](crate::boundary#call-contract), except that no Rust code with destructors runs: the substitute
/// may end in the engine's `Error`, which crosses this frame while it owns nothing. Any number but 0 ends the
/// substitute; none of its functions may be called afterwards.
unsafe extern "C" fn shutdown(destroy_window: c_int) {
    let function = substitute().as_ref().map(|substitute| substitute.shutdown);
    if let Some(function) = function {
        // SAFETY: the substitute's own `Shutdown`; its library is closed below at the earliest.
        unsafe { function(destroy_window) };
    }
    if destroy_window != 0 {
        let done = substitute().take();
        drop(done);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::front_ends::FRONT_ENDS;

    #[test]
    fn all_spellings_of_the_best_renderer_come_first() {
        for front in FRONT_ENDS {
            assert!(front.functions <= 64, "{}", front.name);
            assert_eq!(
                file_names(front).len(),
                front.opengl.len() * front.libraries.len()
            );
        }
        let names = file_names(FRONT_ENDS[0]);
        assert_eq!(names.len(), 4);
        assert!(
            names[0].starts_with("renderer_opengl1_") && names[1].starts_with("renderer_opengl1.")
        );
        assert!(names[2].starts_with("renderer_opengl2_"));
    }

    #[cfg(unix)]
    #[test]
    fn a_substitute_is_shut_down_through_us_and_then_unloaded() {
        use crate::boundary_tests::TestEngine;
        use crate::c_tests::{compile, scratch, source};
        use libloading::os::unix::{Library as UnixLibrary, RTLD_NOW};
        use std::os::unix::ffi::OsStrExt;

        let Some(_engine) = TestEngine::start("fallback") else {
            return;
        };
        let engine = crate::engine::current().unwrap();
        let folder = scratch("substitute");
        let library = folder.join(&file_names(FRONT_ENDS[0])[0]);
        let report = folder.join("report");
        let arguments = ["-shared", "-fPIC", "-Wall"];
        let Some(()) = compile(&source("test_renderer.c"), &library, &arguments) else {
            return;
        };
        let path = std::ffi::CString::new(report.as_os_str().as_bytes()).unwrap();
        // The test renderer reads a path where a real one would read the engine's print function.
        let mut table = [std::ptr::null::<std::ffi::c_char>(); 40];
        table[0] = path.as_ptr();
        let load = |version| {
            let folders = [folder.join("nowhere"), folder.clone()];
            // SAFETY: the test renderer reads only its first entry, as a path.
            unsafe {
                load_from(
                    &folders,
                    FRONT_ENDS[0],
                    engine,
                    version,
                    table.as_ptr().cast(),
                )
            }
        };
        let loaded = || {
            const NOLOAD: c_int = 4;
            // SAFETY: with NOLOAD no code runs.
            unsafe { UnixLibrary::open(Some(&library), RTLD_NOW | NOLOAD) }.is_ok()
        };
        assert!(load(7).is_none(), "it refuses other versions");
        assert!(!loaded());
        for _ in 0..2 {
            // SAFETY: the table's first entry.
            let exports: Shutdown = unsafe { load(8).unwrap().cast::<Shutdown>().read() };
            // SAFETY: `shutdown` of a substitute that calls no service of the engine: it returns.
            unsafe { exports(0) };
            assert!(loaded());
            // SAFETY: `shutdown`, which returns here; no function of the substitute is called afterwards.
            unsafe { exports(1) };
            assert!(!loaded(), "its statics must not outlive it");
        }
        assert_eq!(std::fs::read_to_string(&report).unwrap(), "0\n1\n0\n1\n");
        std::fs::remove_dir_all(&folder).unwrap();
    }

    #[test]
    fn our_own_folder_is_searched_first() {
        let folders = folders(FRONT_ENDS[0]);
        let own = system::own_file().unwrap();
        assert_eq!(folders.first().map(PathBuf::as_path), own.parent());
        let installed = PathBuf::from(FRONT_ENDS[0].folders[0]);
        assert_eq!(folders.contains(&installed), cfg!(unix));
    }
}
