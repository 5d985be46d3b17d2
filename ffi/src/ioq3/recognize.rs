//! Identifies the loading engine before any of its services but `Printf` is called.
//!
//! Ten engines have the same version number with seven different tables, and the same entry of another table is another
//! function: in Quake3e, `Cvar_Get` of ioquake3 is `Free`. The tests, in this order:
//! 1. [`VARIABLE`] in the environment overrides the rest;
//! 2. the executable's file contains text that is specific to one family of engines ([`OTHERS`]);
//! 3. an entry where ioquake3 has a function is no function, or functions continue far beyond ioquake3's table;
//! 4. engines without these differences have `Cvar_Get` and the first members of a variable in ioquake3's places, and
//!    only those with ioquake3's table store a variable's description.
//!
//! A test whose data cannot be read (no `/proc`, an unreadable file) is skipped.

use super::abi::refimport_t;
use super::services::Ioq3;
use crate::cvars;
use crate::engine::Services;
use std::ops::Range;
use std::sync::OnceLock;

/// Environment variable: with `ioquake3`, any engine is treated as having ioquake3's tables.
const VARIABLE: &str = "RELIGHT_ENGINE";

/// Engines with our version number and other tables.
struct Other {
    name: &'static str,
    /// Text in the executable's file, spelled backwards, so that a program linked with this library does not contain
    /// it.
    backwards: &'static str,
    /// `cl_renderer` of its own OpenGL renderer.
    opengl: &'static str,
}

const OTHERS: &[Other] = &[
    Other {
        name: "Quake3e",
        backwards: "E3Q_enecSoTthgiLraeniLddA_R_part",
        opengl: "opengl",
    },
    Other {
        name: "iortcw (single player)",
        backwards: "s%_ps_reredner",
        opengl: "opengl1",
    },
    Other {
        name: "iortcw (multiplayer)",
        backwards: "s%_pm_reredner",
        opengl: "opengl1",
    },
    Other {
        name: "lilium-voyager (Elite Force)",
        backwards: "reredner_mhyovmuilil",
        opengl: "opengl1",
    },
];

/// Services in ioquake3's table.
const SERVICES: usize = size_of::<refimport_t>() / size_of::<usize>();
/// Number of entries, from the first, that this library calls; later entries may be anything.
const CALLED: usize = 35;
/// Number of consecutive functions from which a table is not ioquake3's. World of Padman, whose table begins with
/// ioquake3's, has 44; Quake3e 56. A word after a table on the stack is rarely a function's address, and never eight in
/// a row.
const TOO_MANY: usize = 52;

/// Message that this engine is not supported, and what to do; `None` for an engine with ioquake3's tables.
///
/// # Safety
/// `imports` must point at the import table of an engine with our version number, the same one that `engine` calls.
pub unsafe fn refusal(engine: &Ioq3, imports: *const refimport_t) -> Option<String> {
    // An unset variable counts as empty.
    let wanted = std::env::var(VARIABLE).unwrap_or_default();
    let (found, opengl) = match is_ours(&wanted) {
        Some(true) => return None,
        Some(false) => (format!("{VARIABLE} calls it {wanted}"), "opengl1"),
        // SAFETY: `imports` is the table of an engine with our version number by this function's contract.
        None => unsafe { difference(engine, imports) }?,
    };
    Some(format!(
        "Relight supports ioquake3 and engines with its tables; this engine has others ({found}). Start it with \
         \"+set cl_renderer {opengl}\" to play without Relight; if it does have ioquake3's tables, set the \
         environment variable {VARIABLE}=ioquake3"
    ))
}

/// Value of the environment variable, if it is set.
fn is_ours(variable: &str) -> Option<bool> {
    (!variable.is_empty()).then(|| variable.eq_ignore_ascii_case("ioquake3"))
}

/// First difference from ioquake3, and the `cl_renderer` of the engine's OpenGL renderer.
///
/// # Safety
/// `imports` must point at the import table of an engine with our version number, the same one that `engine` calls.
unsafe fn difference(engine: &Ioq3, imports: *const refimport_t) -> Option<(String, &'static str)> {
    if let Some(other) = executable() {
        return Some((format!("it is {}", other.name), other.opengl));
    }
    // SAFETY: ioquake3's table has this number of words; for the shorter tables of other engines (39, 38 words), which
    // are on the stack, this reads one or two words of the caller's frame.
    let services = unsafe { imports.cast::<[usize; SERVICES]>().read_unaligned() };
    let code = code_ranges();
    if !code.is_empty() {
        let beyond = words_after(imports.wrapping_add(1).addr());
        if let Some(found) = odd_table(&services, &beyond, &code) {
            return Some((found, "opengl1"));
        }
    }
    let spec = &renderer_vk::settings::row("r_rt")?.spec;
    let variable = cvars::get(engine, spec)?;
    if engine.cvar_keeps_description(variable, &cvars::c_text(spec.help)) {
        return None;
    }
    let version = engine.cvar_text(c"version");
    Some((
        format!("version \"{version}\" keeps no descriptions of variables"),
        "opengl1",
    ))
}

/// The engine in [`OTHERS`] that the running program's file contains. Searched once.
fn executable() -> Option<&'static Other> {
    static FOUND: OnceLock<Option<&'static Other>> = OnceLock::new();
    *FOUND.get_or_init(|| {
        let file = std::env::current_exe().ok()?;
        marked(&std::fs::read(file).ok()?)
    })
}

/// The engine in [`OTHERS`] whose text a program's bytes contain.
fn marked(bytes: &[u8]) -> Option<&'static Other> {
    OTHERS.iter().find(|other| {
        let marker: Vec<u8> = other.backwards.bytes().rev().collect();
        let first = marker.first();
        bytes
            .windows(marker.len())
            .any(|text| text.first() == first && text == marker)
    })
}

/// Description of the first entry of a table, or word after it, that differs from ioquake3.
fn odd_table(services: &[usize], beyond: &[usize], code: &[Range<usize>]) -> Option<String> {
    let is_function = |word: usize| code.iter().any(|range| range.contains(&word));
    let called = services.iter().take(CALLED);
    for (number, &word) in called.enumerate() {
        // null entries are allowed; callers test for them
        if word != 0 && !is_function(word) {
            return Some(format!("service {number} of its table is no function"));
        }
    }
    let mut all = services.iter().chain(beyond);
    let functions = all.position(|&word| !is_function(word));
    let functions = functions.unwrap_or(services.len() + beyond.len());
    (functions >= TOO_MANY)
        .then(|| format!("its table has {functions} services or more, ioquake3's {SERVICES}"))
}

/// Address ranges of the process that hold code; empty if they cannot be read.
fn code_ranges() -> Vec<Range<usize>> {
    let maps = std::fs::read("/proc/self/maps").unwrap_or_default();
    code_in(&String::from_utf8_lossy(&maps))
}

/// The executable ranges of `/proc/self/maps`.
fn code_in(maps: &str) -> Vec<Range<usize>> {
    let range = |line: &str| {
        let (addresses, rest) = line.split_once(' ')?;
        let (start, end) = addresses.split_once('-')?;
        let number = |text| usize::from_str_radix(text, 16).ok();
        let executable = rest.split(' ').next()?.contains('x');
        executable.then_some(number(start)?..number(end)?)
    };
    maps.lines().filter_map(range).collect()
}

/// The words after a table on the stack, as far as they are readable; read through the kernel, because they may be
/// unmapped.
#[cfg(unix)]
fn words_after(address: usize) -> Vec<usize> {
    use std::os::unix::fs::FileExt;
    let mut bytes = [0; (TOO_MANY - SERVICES) * size_of::<usize>()];
    let read = std::fs::File::open("/proc/self/mem")
        .and_then(|memory| memory.read_at(&mut bytes, address as u64))
        .unwrap_or(0);
    let (words, _) = bytes[..read].as_chunks();
    words.iter().copied().map(usize::from_ne_bytes).collect()
}

#[cfg(not(unix))]
fn words_after(_address: usize) -> Vec<usize> {
    Vec::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marker(other: &Other) -> String {
        other.backwards.chars().rev().collect()
    }

    #[test]
    fn executables_are_recognized_by_their_text() {
        let quake3e = marker(&OTHERS[0]);
        assert_eq!(
            (quake3e.len(), &quake3e[..6], &quake3e[20..]),
            (32, "trap_R", "tToScene_Q3E")
        );
        assert_eq!(marker(&OTHERS[1]), ["renderer", "sp", "%s"].join("_"));
        for other in OTHERS {
            let text = marker(other);
            let image = [b"\x7fELF\0", text.as_bytes(), b"\0cl_renderer\0"].concat();
            assert_eq!(marked(&image).map(|o| o.name), Some(other.name));
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
    fn the_environment_overrules() {
        assert_eq!(is_ours(""), None);
        assert_eq!(is_ours("ioquake3"), Some(true));
        assert_eq!(is_ours("IOQuake3"), Some(true));
        assert_eq!(is_ours("quake3e"), Some(false));
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
    fn tables_are_as_long_as_ioquake3s_or_a_little_longer() {
        let code = [0x1000..0x2000, 0x5000..0x5001];
        let table = [0x1800; SERVICES];
        let odd = |beyond: &[usize]| odd_table(&table, beyond, &code);
        assert_eq!(odd(&[]), None);
        assert_eq!(odd(&[0x2000, 0x1000]), None, "the stack");
        // World of Padman
        assert_eq!(odd(&[0x1000, 0x1fff, 0x5000, 0x1000, 7]), None);
        // Quake3e
        let found = odd(&[0x1800; TOO_MANY - SERVICES]);
        assert!(found.is_some_and(|found| found.contains("52 services")));
    }

    #[test]
    fn called_entries_must_be_functions_or_null() {
        let code = std::slice::from_ref(&(0x1000..0x2000));
        for (at, word, fine) in [
            (8, 0, true),
            (8, 0x2000, false),
            (34, 1, false),
            (35, 1, true),
            (39, usize::MAX, true),
        ] {
            let mut table = [0x1000; SERVICES];
            table[at] = word;
            assert_eq!(odd_table(&table, &[], code).is_none(), fine, "{at} {word}");
        }
    }

    #[test]
    fn executable_mappings_are_code() {
        let maps = "\
55d0a0000000-55d0a0001000 r--p 00000000 fe:01 1234   /usr/lib/ioquake3/ioquake3
55d0a0001000-55d0a0003000 r-xp 00001000 fe:01 1234   /usr/lib/ioquake3/ioquake3
nonsense
7ffd00000000-7ffd00021000 rw-p 00000000 00:00 0      [stack]
ffffffffff600000-ffffffffff601000 --xp 00000000 00:00 0 [vsyscall]";
        assert_eq!(
            code_in(maps),
            [
                0x55d0_a000_1000..0x55d0_a000_3000,
                0xffff_ffff_ff60_0000..0xffff_ffff_ff60_1000
            ]
        );
        assert!(code_in("").is_empty());
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn own_code_and_stack_are_readable() {
        let function = code_in as *const ();
        let code = code_ranges();
        assert!(code.iter().any(|range| range.contains(&function.addr())));
        let words = [1usize, 2, 3];
        assert!(
            !code
                .iter()
                .any(|range| range.contains(&words.as_ptr().addr()))
        );
        assert_eq!(words_after(words.as_ptr().addr())[..3], words);
        assert_eq!(words_after(0), [0usize; 0]);
    }
}
