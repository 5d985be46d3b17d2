//! Recognizes the loading engine before any of its services but `Printf` is called.
//!
//! Many engines have the same version number with different tables, and the same entry of another table is another
//! function: where one engine gets a variable, another frees memory. The tests, in this order:
//! 1. [`VARIABLE`] in the environment names the front end and overrides the rest;
//! 2. the name of this library's file: some engines load only names that no other engine uses;
//! 3. text in the executable's file that is specific to one family of engines;
//! 4. what remains has `Cvar_Get` and the first members of a variable in the same places: each front end tests a
//!    property of its engine ([`FrontEnd::recognizes`]).
//!
//! In 2 to 4 the entries of the table must be functions or null, no functions may follow far beyond its end, the
//! services without which nothing can be drawn must be there, and the text and the number of a variable must agree. A
//! test whose data cannot be read (an unreadable file, on Unix no `/proc`) is skipped.

use crate::abi::functions::Printf;
use crate::cvars;
use crate::engine::{Engine, FrontEnd};
use crate::front_ends::{FRONT_ENDS, UNSUPPORTED};
use crate::system;
use std::ffi::c_void;
use std::ops::Range;
use std::sync::OnceLock;

/// Environment variable: name of a front end to use for any engine.
const VARIABLE: &str = "RELIGHT_ENGINE";

/// Number of functions beyond a table's end from which it is not this engine's. Engines whose tables begin with another
/// engine's have up to four more. A word after a table on the stack is rarely a function's address, and never eight in a
/// row.
const TOO_MANY: usize = 12;

/// Advice for engines that are not known.
const OPENGL: &str = "opengl1";

/// An engine that a file's name or text belongs to.
#[derive(Clone, Copy, Debug)]
enum Found {
    Supported(&'static FrontEnd),
    /// Its name, and `cl_renderer` of its OpenGL renderer.
    Other(&'static str, &'static str),
}

/// Recognizes the engine and installs its services; otherwise a line that names what was found, and what to do.
///
/// # Safety
/// `imports` must point at the import table of an engine with our version number, whose functions must be callable until
/// the process ends. The call must come from the engine's main thread while none of our functions runs.
pub unsafe fn recognize(imports: *const c_void) -> Result<Engine, String> {
    // An unset variable counts as empty.
    let wanted = std::env::var(VARIABLE).unwrap_or_default();
    if !wanted.is_empty() {
        let opengl = match by_file_name().or_else(executable) {
            Some(Found::Supported(front)) => front.opengl[0],
            Some(Found::Other(_, opengl)) => opengl,
            None => OPENGL,
        };
        let unknown = || refusal(&format!("{VARIABLE} is {wanted}"), opengl);
        let front = named(&wanted).ok_or_else(unknown)?;
        // SAFETY: the player says that it is this engine's table; the rest is this function's contract.
        return Ok(unsafe { (front.install)(imports) });
    }
    let code = code();
    match by_file_name().or_else(executable) {
        Some(Found::Supported(front)) => match odd_table(front, imports, &code) {
            Some(odd) => Err(refusal(
                &format!("it looks like {}, but {odd}", front.name),
                front.opengl[0],
            )),
            None => {
                // SAFETY: this engine's table by its file, and it has as many functions; the rest is our contract.
                let engine = unsafe { (front.install)(imports) };
                let odd = odd_services(engine, &code);
                odd.map_or(Ok(engine), |odd| {
                    let found = format!("it looks like {}, but {odd}", front.name);
                    Err(refusal(&found, front.opengl[0]))
                })
            }
        },
        Some(Found::Other(name, opengl)) => Err(refusal(&format!("it is {name}"), opengl)),
        // SAFETY: this function's contract; the engine is none of those with another place for `Cvar_Get`.
        None => unsafe { by_properties(imports, &code) },
    }
}

/// Tests the properties of engines without a file name or a marker of their own.
///
/// # Safety
/// That of [`recognize`].
unsafe fn by_properties(imports: *const c_void, code: &[Range<usize>]) -> Result<Engine, String> {
    let mut found = None;
    for front in FRONT_ENDS {
        let Some(recognizes) = front.recognizes else {
            continue;
        };
        if let Some(odd) = odd_table(front, imports, code) {
            found.get_or_insert(odd);
            continue;
        }
        // SAFETY: the tables of these engines are equal in the entries that `recognizes` calls.
        let engine = unsafe { (front.install)(imports) };
        if let Some(odd) = odd_services(engine, code) {
            found.get_or_insert(odd);
            continue;
        }
        if recognizes(engine) {
            return Ok(engine);
        }
        found.get_or_insert_with(|| {
            let version = engine.cvar_text(c"version");
            format!("its version is \"{version}\"")
        });
    }
    Err(refusal(&found.unwrap_or_default(), OPENGL))
}

/// The line for an engine that is not supported.
fn refusal(found: &str, opengl: &str) -> String {
    let names: Vec<_> = FRONT_ENDS.iter().map(|front| front.name).collect();
    format!(
        "Relight supports {} and engines with their tables; this engine has others ({found}). Start it with \
         \"+set cl_renderer {opengl}\" to play without Relight; if it does have the tables of one of them, set the \
         environment variable {VARIABLE} to that name",
        names.join(", ")
    )
}

/// The front end of a name, in any case.
fn named(name: &str) -> Option<&'static FrontEnd> {
    let mut all = FRONT_ENDS.iter();
    all.find(|front| front.name.eq_ignore_ascii_case(name))
        .copied()
}

/// The engine that loads renderers of this library's file name.
fn by_file_name() -> Option<Found> {
    let file = system::own_file()?;
    loads(&file.file_name()?.to_string_lossy())
}

/// The engine that alone loads renderers of such a file name.
fn loads(name: &str) -> Option<Found> {
    let mut all = FRONT_ENDS.iter();
    let front = all.find(|front| front.files.iter().any(|start| name.starts_with(start)))?;
    Some(Found::Supported(front))
}

/// The engine whose text the running program's file contains. Searched once.
fn executable() -> Option<Found> {
    static FOUND: OnceLock<Option<Found>> = OnceLock::new();
    *FOUND.get_or_init(|| {
        let file = std::env::current_exe().ok()?;
        marked(&std::fs::read(file).ok()?)
    })
}

/// The engine whose text a program's bytes contain.
fn marked(bytes: &[u8]) -> Option<Found> {
    let contains = |backwards: &str| {
        let marker: Vec<u8> = backwards.bytes().rev().collect();
        let first = marker.first();
        bytes
            .windows(marker.len())
            .any(|text| text.first() == first && text == marker)
    };
    let mut fronts = FRONT_ENDS.iter();
    let supported = fronts.find(|front| front.marker.is_some_and(contains));
    let mut others = UNSUPPORTED.iter();
    supported.map(|front| Found::Supported(front)).or_else(|| {
        let other = others.find(|other| contains(other.marker))?;
        Some(Found::Other(other.name, other.opengl))
    })
}

/// Description of the first entry of a table, or word after it, that differs from the engine's. `None` also if the
/// process's code is not known.
fn odd_table(front: &FrontEnd, imports: *const c_void, code: &[Range<usize>]) -> Option<String> {
    if code.is_empty() {
        return None;
    }
    // Through the kernel: a shorter table of another engine may be at the end of the stack.
    let words = words_at(imports.addr(), front.services + TOO_MANY);
    odd_words(front, &words, code)
}

/// [`odd_table`] of the words of a table and those after it.
fn odd_words(front: &FrontEnd, words: &[usize], code: &[Range<usize>]) -> Option<String> {
    let is_function = |word: usize| code.iter().any(|range| range.contains(&word));
    for (number, &word) in words.iter().take(front.called).enumerate() {
        // null entries are allowed; callers test for them
        if word != 0 && !is_function(word) {
            return Some(format!("service {number} of its table is no function"));
        }
    }
    let first = words.iter().position(|&word| !is_function(word));
    let functions = first.unwrap_or(words.len());
    let services = front.services;
    (functions >= services + TOO_MANY).then(|| {
        format!(
            "its table has {functions} services or more, that of {} {services}",
            front.name
        )
    })
}

/// Description of a service that is absent, or of a variable that the engine's code cannot have made.
fn odd_services(engine: Engine, code: &[Range<usize>]) -> Option<String> {
    if let Some(name) = engine.missing_service() {
        return Some(format!("its table has no {name}"));
    }
    let spec = &renderer_vk::settings::row("r_rt")?.spec;
    let agrees =
        cvars::get(engine, spec).is_some_and(|variable| engine.cvar_is_consistent(variable));
    (!agrees && !code.is_empty()).then(|| "its variables have another layout".to_owned())
}

/// `Printf`, the first service of every table; `None` if there is no table at this address.
///
/// # Safety
/// `imports` must be null or point at the import table of an engine.
pub unsafe fn printf(imports: *const c_void) -> Option<Printf> {
    let code = code();
    let is_function = |word: &usize| code.iter().any(|range| range.contains(word));
    let known = imports.is_null() || !code.is_empty();
    if known && !words_at(imports.addr(), 1).first().is_some_and(is_function) {
        return None;
    }
    // SAFETY: not null, so an engine's table by this function's contract, whose first entry has this type in all engines.
    unsafe { imports.cast::<Option<Printf>>().read_unaligned() }
}

/// Address ranges of the process that hold code; empty if its memory cannot be inspected.
fn code() -> Vec<Range<usize>> {
    let mut code = system::code();
    if words_at(code.as_ptr().addr(), 1).is_empty() {
        code.clear();
    }
    code
}

/// The words at an address, as far as they are readable.
fn words_at(address: usize, count: usize) -> Vec<usize> {
    let mut bytes = vec![0; count * size_of::<usize>()];
    let read = system::read_memory(address, &mut bytes);
    let (words, _) = bytes.get(..read).unwrap_or_default().as_chunks();
    words.iter().copied().map(usize::from_ne_bytes).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn forwards(backwards: &str) -> String {
        backwards.chars().rev().collect()
    }

    fn name(found: Option<Found>) -> Option<&'static str> {
        found.map(|found| match found {
            Found::Supported(front) => front.name,
            Found::Other(name, _) => name,
        })
    }

    #[test]
    fn executables_are_recognized_by_their_text() {
        let supported = FRONT_ENDS.iter().map(|front| (front.name, front.marker));
        let others = UNSUPPORTED
            .iter()
            .map(|other| (other.name, Some(other.marker)));
        let marks: Vec<_> = supported
            .chain(others)
            .filter_map(|(n, m)| Some((n, forwards(m?))))
            .collect();
        assert_eq!(marks.len(), 4);
        assert_eq!(marks[1].1, ["renderer", "sp", "%s"].join("_"));
        for (expected, text) in marks {
            let image = [b"\x7fELF\0", text.as_bytes(), b"\0cl_renderer\0"].concat();
            assert_eq!(name(marked(&image)), Some(expected));
            assert!(marked(text.as_bytes()).is_some(), "at the very end");
            let cut = &image[..5 + text.len() - 1];
            assert!(marked(cut).is_none(), "{text} is cut off");
        }
        for known in [
            "",
            "ioq3 1.36\0renderer_%s_x86_64.so\0",
            "wop\0renderer_%s_x86_64.so\0trap_R_AddAdditiveLightToScene\0",
        ] {
            assert!(marked(known.as_bytes()).is_none(), "{known}");
        }
    }

    #[test]
    fn files_and_names_select_a_front_end() {
        assert_eq!(name(loads("quake3e_vk_x86_64.so")), Some("quake3e"));
        assert_eq!(name(loads("renderer_vk_x86_64.so")), None);
        assert_eq!(named("IOQuake3").map(|front| front.name), Some("ioquake3"));
        assert!(named("").is_none() && named("doom").is_none());
        let mut names: Vec<_> = FRONT_ENDS.iter().map(|front| front.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), FRONT_ENDS.len());
    }

    #[test]
    fn this_program_holds_no_marker() {
        assert!(executable().is_none());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn debians_engine_matches_no_other_engine() {
        let path = "/usr/lib/ioquake3/ioquake3";
        match std::fs::read(path) {
            Ok(bytes) => assert!(marked(&bytes).is_none()),
            Err(error) => testkit::skip(format!("{path}: {error}")),
        }
    }

    #[test]
    fn tables_are_as_long_as_the_engines_or_a_little_longer() {
        let code = [0x1000..0x2000, 0x5000..0x5001];
        for front in FRONT_ENDS {
            let table = vec![0x1800; front.services];
            let odd = |beyond: &[usize]| odd_words(front, &[&table[..], beyond].concat(), &code);
            assert_eq!(odd(&[]), None);
            assert_eq!(odd(&[0x2000, 0x1000]), None, "the stack");
            // four more services
            assert_eq!(odd(&[0x1000, 0x1fff, 0x5000, 0x1000, 7]), None);
            let found = odd(&[0x1800; TOO_MANY]);
            let number = format!("{} services", front.services + TOO_MANY);
            assert!(found.is_some_and(|found| found.contains(&number)));
        }
    }

    #[test]
    fn called_entries_must_be_functions_or_null() {
        let code = std::slice::from_ref(&(0x1000..0x2000));
        let front = FRONT_ENDS[0];
        for (at, word, fine) in [
            (8, 0, true),
            (8, 0x2000, false),
            (front.called - 1, 1, false),
            (front.called, 1, true),
            (front.services - 1, usize::MAX, true),
        ] {
            let mut table = vec![0x1000; front.services];
            table[at] = word;
            assert_eq!(
                odd_words(front, &table, code).is_none(),
                fine,
                "{at} {word}"
            );
        }
    }
}
